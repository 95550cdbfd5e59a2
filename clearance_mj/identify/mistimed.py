"""Of a channel that no sign, swap, unit or gain explains: whether it is late, noise, a loose cable, or distorted."""

from __future__ import annotations

import numpy as np

from .lapses import channels_of, lapses
from .trial import Trial, projected

__all__ = ["likeliest"]

LATEST = 0.05
"""s"""
DELAYS = 2001
"""that are tried"""
ALIKE = 0.9
"""coherence with what the other channels say, from which on a delay explains a channel"""
NOTHING = 0.3
"""below which it holds nothing of the rig's motion"""
BETTER = 0.02
"""least gain of coherence by a delay"""


def likeliest(trial: Trial) -> str:
    """Return in words what is likeliest wrong with the channel that the others contradict most; "" if none."""
    if not trial.suspects:
        return ""
    gains, left = trial.gains(trial.update.rig, {}), dict[int, float]()
    for i in trial.suspects:
        weights, predicted = projected(gains, trial.measured, (i,))
        error = np.abs((predicted - np.vstack(trial.measured)) * weights) ** 2
        left[i] = float(np.sum(np.log1p(np.mean(np.delete(error, i, axis=1), axis=0))))
    i = min(left, key=left.__getitem__)
    name = trial.update.channels[i]
    if words := _lapses(trial, i):
        return f"{name} {words}"
    return f"{name} {_distorted(trial, gains, i)}"


def _lapses(trial: Trial, channel: int) -> str:
    for record in trial.dataset.records:
        signals = [signal for _, signal in channels_of(record)]
        if len(signals) == len(trial.update.channels) and (words := lapses(signals, record.fs)[channel]):
            return f'{words} in record "{record.name}", as of a loose cable'
    return ""


def _distorted(trial: Trial, gains: list[np.ndarray], channel: int) -> str:
    """By the coherence of the channel's lines with what the other channels say, over delays."""
    weights, predicted = projected(gains, trial.measured, (channel,))
    measured = np.vstack(trial.measured)[:, channel] * weights[:, channel]
    expected = predicted[:, channel] * weights[:, channel]
    frequency = np.concatenate([piece.frequency[:: trial._step] for piece in trial.update.misfit])
    delays = np.linspace(-LATEST, LATEST, DELAYS)
    product = measured * expected.conj() / (np.linalg.norm(measured) * np.linalg.norm(expected))
    alike = (np.exp(2j * np.pi * np.outer(delays, frequency)) @ product).real
    best, now = float(alike.max()), float(alike[DELAYS // 2])
    if best > ALIKE and best > now + BETTER:
        late = 1e3 * float(delays[np.argmax(alike)])
        return f"is {'late' if late > 0 else 'early'} by {abs(late):.3g} ms, as of another filter or converter"
    if best < NOTHING:
        return "holds noise or another signal: no motion of this rig"
    return f"follows the others in part only (coherence {best:.2f}): clipped, overloaded or filtered"
