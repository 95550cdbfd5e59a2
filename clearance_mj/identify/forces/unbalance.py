"""The unbalance of a shaft that turns, out of what its channels show at the frequency of its turns.

With the forces in the clearances unknown, as everywhere else, an unbalance is what the channels then still share: at
its frequency every channel reads y = G θ + U (a, b), with θ the forces and the excitation, and a, b the unbalance's
moment along y and z where the shaft's angle is 0. All records and lines have the same a and b: linear least squares.
What the unbalance moves in the slow turning that stands for the probes' run-out is missing in all other records.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np
import scipy.fft
import scipy.signal

from ...linear import LinearModel, linear_model
from ...rig import Rig, Unbalance
from ...signals.keyphasor import ShaftTurning
from ..records.prepared import PreparedRecord

__all__ = ["spun_spectra", "with_slow_roll", "with_unbalance"]

MODES = 16  # of each plane
FAST = 0.5  # of the fastest: slower turning shows run-out and the errors of the model, more than an unbalance
FLANK = 2.0  # s, of the window: where it is flat, it passes through the structure as it is
LINES = 4  # either side of the turns' frequency
NOISE = 0.01  # of a channel's RMS
MODEL_ERROR = 0.01  # of a line's level: what the model misses
RAMP_PARTS = 16  # of a ramp, each with one spin
QUIET = 1e-9  # m/s², of an excitation that was not driven


def spun_spectra(turning: ShaftTurning, window: np.ndarray, size: int, order: int = 2) -> np.ndarray:
    """Return the spectra (n_f, 2) of Ω² cos φ and Ω² sin φ under a window, with φ the shaft's angle.

    Parameters
    ----------
    turning : ShaftTurning
        How the shaft turned.
    window : ndarray, shape (n_t,)
        The window.
    size : int
        Samples of the transform.
    order : int
        Of Ω: 2 of an unbalance's force, 0 of what does not depend on the spin.
    """
    power = turning.speed**order * window
    spun = np.column_stack((power * np.cos(turning.angle), power * np.sin(turning.angle)))
    return np.asarray(scipy.fft.rfft(spun, size, axis=0))


def with_unbalance(rig: Rig, records: Sequence[PreparedRecord], probes: Mapping[str, float]) -> Rig:
    """Return a rig whose first unbalance is that of records in which its shaft turned, at one speed or in a ramp.

    Further unbalances are believed as the rig file has them.

    Parameters
    ----------
    rig : Rig
        As updated; one without an unbalance is returned as it is: no place of one is known.
    records : sequence of PreparedRecord
        Of it, such as `prepare_turning` returns them; without any, the rig is returned as it is.
    probes : mapping of str to float
        Gains and places of the probes.
    """
    fastest = max((_speed(record) for record in records), default=0.0)
    if not (rig.unbalances and fastest):
        return rig
    first, *others = rig.unbalances
    unit = [dataclasses.replace(first, moment=1.0, phase=phase) for phase in (0.0, math.pi / 2)]
    normal, right = np.zeros((2, 2)), np.zeros(2)
    for record in (r for r in records if _speed(r) >= FAST * fastest):
        columns, target = _at_turns(rig, record, probes, unit, others)
        normal += (columns.conj().T @ columns).real
        right += (columns.conj().T @ target).real
    a, b = np.linalg.solve(normal, right).tolist()
    found = dataclasses.replace(first, moment=math.hypot(a, b), phase=math.atan2(b, a))
    return rig.replace(unbalances=(found, *others))


def with_slow_roll(record: PreparedRecord, rig: Rig, probes: Mapping[str, float]) -> PreparedRecord:
    """Return a record whose probes show again what the unbalance moved in the slow turning that was subtracted.

    Parameters
    ----------
    record : PreparedRecord
        Without run-out.
    rig : Rig
        With its unbalance.
    probes : mapping of str to float
        Gains and places of the probes.
    """
    if record.turning is None or not record.slow_roll:
        return record
    model = linear_model(rig, MODES)
    rows = model.at_probes(probes)
    per_turn = _in_slow_roll(model, rows, record.slow_roll, _forces(model, rig.unbalances))
    angle, signals = record.turning.angle, record.signals.copy()
    signals[:, -1 - len(rows) : -1] += np.column_stack((np.cos(angle), np.sin(angle))) @ per_turn
    return dataclasses.replace(record, signals=signals, slow_roll=0.0)


def _speed(record: PreparedRecord) -> float:
    """Fastest spin of a record, rad/s."""
    return 0.0 if record.turning is None else float(np.abs(record.turning.speed).max())


def _at_turns(
    rig: Rig, record: PreparedRecord, probes: Mapping[str, float], unit: Sequence[Unbalance],
    others: Sequence[Unbalance],
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """What two unbalances (n, 2), and the record less other ones (n,), show that no forces in the clearances explain.

    On a few lines either side of the turns.
    """
    assert record.turning is not None
    n, fs = len(record.signals), record.fs
    window = scipy.signal.windows.tukey(n, min(1.0, 2 * FLANK * fs / n))
    turns = np.abs(record.turning.speed)[[0, -1]] / (2 * np.pi) * n / fs
    lines = slice(max(math.floor(turns.min()) - LINES, 1), math.ceil(turns.max()) + LINES + 1)
    omega = 2 * np.pi * scipy.fft.rfftfreq(n, 1 / fs)[lines]
    measured = scipy.fft.rfft(record.signals * window[:, None], axis=0)[lines]
    spun, turned = (spun_spectra(record.turning, window, n, order)[lines] for order in (2, 0))
    model, spin = linear_model(rig, MODES).driven(record.tested)
    rows = model.at_probes(probes)
    # Of a ramp, what a line shows happened as the shaft turned at its frequency, with the gyroscopic moments of then.
    ramp = record.tested.spin is not None and bool(record.tested.spin.rate)
    parts = [part for part in np.array_split(np.arange(omega.size), RAMP_PARTS if ramp else 1) if part.size]
    spins = [float(omega[part].mean()) if ramp else spin for part in parts]
    each = [(omega[part], spin) for part, spin in zip(parts, spins)]
    seen = np.concatenate([model.channel_gains(rows, record.kind, at, spin=spin) for at, spin in each])

    def shown(unbalances: Sequence[Unbalance]) -> np.ndarray:
        forces = _forces(model, unbalances)
        gains = [model.channel_gains(rows, record.kind, at, -forces.T, spin)[:, :, :-1] for at, spin in each]
        found = np.einsum("fcu,fu->fc", np.concatenate(gains), spun)
        if record.slow_roll:
            found[:, -1 - len(rows) : -1] -= turned @ _in_slow_roll(model, rows, record.slow_roll, forces)
        return found

    of_both = np.stack([shown([one]) for one in unit], axis=2)
    left = measured - shown(others) if others else measured
    white = NOISE * np.sqrt(np.mean(record.signals**2, axis=0) * np.sum(window**2)) + QUIET
    noise = np.where(record.present, np.hypot(white, MODEL_ERROR * np.abs(measured)), np.inf)[:, :, None]
    basis, _ = np.linalg.qr(seen / noise)
    targets = np.concatenate((of_both, left[:, :, None]), axis=2) / noise
    rest = targets - basis @ (basis.conj().transpose(0, 2, 1) @ targets)
    return rest[:, :, :2].reshape(-1, 2), rest[:, :, 2].ravel()


def _in_slow_roll(model: LinearModel, probes: np.ndarray, speed: float, forces: np.ndarray) -> np.ndarray:
    """What probes show (2, n_probes) of unbalances per cos φ and sin φ at a slow speed, m; ``forces``: of `_forces`."""
    rotating = speed**2 * (forces[:, :1] - 1j * forces[:, 1:])  # the real part of this e^(iφ)
    moved = model.responses(probes, rotating, np.array([speed]), speed)[0, :, 0]
    return np.array([moved.real, -moved.imag])


def _forces(model: LinearModel, unbalances: Sequence[Unbalance]) -> np.ndarray:
    """Forces (n, 2) on the modes of unbalances, per Ω² cos φ and Ω² sin φ."""
    rig = model.rig.replace(unbalances=tuple(unbalances))
    return dataclasses.replace(model, rig=rig).unbalance.T
