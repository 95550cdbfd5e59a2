"""Of a channel that no sign, swap, unit or gain explains: whether it is late, noise, a loose cable, or distorted."""

from __future__ import annotations

import numpy as np

from ..records.dropouts import channels_of, lapses
from .hypothesis import Trial, projected

__all__ = ["likeliest"]

LATEST = 0.05
"""s"""
DELAYS = 2001
"""that are tried"""
CERTAIN = 0.3
"""of a line's level: standard deviation of what the other channels say of it, up to which it counts"""
FEWEST = 20
"""lines that tell something"""
ALIKE = 0.8
"""likeness to what the other channels say, from which on a delay explains a channel"""
NOTHING = 0.2
"""below which it holds nothing of the rig's motion"""
BETTER = 0.02
"""least gain of likeness by a delay"""
HALF, MUCH = 0.5, 0.1
"""likeness and gain of it by a delay, from which on that explains a channel of which the others tell less"""
ADDED = 0.95
"""likeness from which on a channel is whole"""


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
    """By how alike the channel's lines are to what the other channels say, over delays; 1: the same."""
    weights, predicted = projected(gains, trial.measured, (channel,))
    measured, expected = np.vstack(trial.measured)[:, channel], predicted[:, channel]
    known = _uncertainty(gains, weights, channel) < CERTAIN * np.abs(expected)
    if np.sum(known) < FEWEST:
        return "contradicts the others"
    measured, expected = measured[known], expected[known]
    frequency = np.concatenate([piece.frequency[:: trial._step] for piece in trial.update.misfit])[known]
    delays = np.linspace(-LATEST, LATEST, DELAYS)
    # Of each line alike: else the few at resonances would tell all.
    product = measured * expected.conj() / np.maximum(np.abs(measured), np.abs(expected)) ** 2
    alike = (np.exp(2j * np.pi * np.outer(delays, frequency)) @ product).real / product.size
    best, now = float(alike.max()), float(alike[DELAYS // 2])
    if (best > ALIKE and best > now + BETTER) or (best > HALF and best > now + MUCH):
        late = 1e3 * float(delays[np.argmax(alike)])
        return f"is {'late' if late > 0 else 'early'} by {abs(late):.3g} ms, as of another filter or converter"
    if best < NOTHING:
        return "holds noise or another signal: no motion of this rig"
    if best > ADDED:
        return f"follows the others (likeness {best:.2f}) but for what is added to it, as an offset, a drift or hum"
    return f"follows the others in part only (likeness {best:.2f}): clipped, overloaded, filtered, or hum is added"


def _uncertainty(gains: list[np.ndarray], weights: np.ndarray, channel: int) -> np.ndarray:
    """(n_f,) standard deviation of what the other channels' noise, 1 over weights, leaves open of a channel."""
    seen = np.vstack(gains)
    kept = np.setdiff1d(np.arange(seen.shape[1]), channel)
    _, upper = np.linalg.qr(seen[:, kept] * weights[:, kept, None])
    own = np.linalg.solve(upper.conj().transpose(0, 2, 1), seen[:, channel, :, None].conj())
    return np.asarray(np.linalg.norm(own[:, :, 0], axis=1))
