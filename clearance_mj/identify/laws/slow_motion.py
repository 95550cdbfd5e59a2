"""Slow motion in the clearances of records without displacement probes, computed from their laws and the structure.

Accelerometers do not show where in its gap a shaft hangs on average, nor how that drifts as the level rises; a law's
slow force does. Below `RestoringForce.band` the motion x of the clearances is the response of the structure without
them to the excitation u and the forces F of the laws,

    x = H u - C F(x + quick motion),

solved by x <- (1 + C K)⁻¹ (H u - C (F - K x)) with the mean stiffness K of the forces, which makes it converge.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.fft

from ...linear import linear_model
from ...rig import Rig
from ..forces.restoring import MODES, flanks
from ..records.prepared import PreparedRecord
from .case import ClearanceWithLaw
from .force_fit import ForceFit, fit_force
from .measured_motion import DECIMATION, FORCE_ERROR, WIDE, MeasuredMotion, OwnSlowMotion, becomes_quiet, rms_of_blocks

__all__ = ["SlowMotion", "fit_with_slow_motion", "next_offsets"]

ROUNDS = 12  # of the fixed point, at most
CONVERGED = 1e-3  # of the slow motion: a smaller change ends the rounds
SHIFT = 2e-6  # m, by which a shaft is shifted to find the mean stiffness of the forces on it
BLOCK = 2.0  # s, over which a stiffness is a mean: it converges if none is twice the one that is taken
SETTLED = 5e-7  # m: offsets that move less stay
MAX_OFFSET = 0.9  # of the gap
LEAST_STIFFNESS = 1.0  # N/m, between shaft and base
TELLING = 0.1  # of the walls' mean force in all records
STATIC_STIFFNESS_ERROR = 0.5  # of a filling's mean stiffness, which records show above their band alone


class _SlowLines(NamedTuple):
    """Slow lines of one record."""

    compliance: np.ndarray  # (n_f, n_bushings, n_bushings) displacement by minus the forces, m/N
    free: np.ndarray  # (n_f, n_bushings) spectra of the displacement without any force in the clearances


class SlowMotion:
    """Slow motion of all clearances in all records; each bushing's `MeasuredMotion` gets its part.

    Parameters
    ----------
    motions : sequence of MeasuredMotion
        Of each bushing.
    records : sequence of PreparedRecord
        Records of these motions.
    rig : Rig
        The linear rig.
    """

    def __init__(self, motions: Sequence[MeasuredMotion], records: Sequence[PreparedRecord], rig: Rig) -> None:
        self.motions = tuple(motions)
        self.lines = [
            _lines(record, rig, part.stop - part.start, count)
            for record, (part, count) in zip(records, motions[0].unknown_lines)
        ]
        self.spectra = [np.zeros_like(lines.free) for lines in self.lines]
        """(n_f, n_bushings) spectra of each record"""

    def follow(self, cases: Sequence[ClearanceWithLaw]) -> None:
        """Solve the slow motion for a law of each bushing, and let their motions begin from there.

        Parameters
        ----------
        cases : sequence of Case
            Of each bushing.
        """
        stiffness = self._stiffness(cases)
        soft = [_with_springs(*each) for each in zip(self.lines, stiffness)]
        forces, best, relaxation = self._forces(cases), np.inf, 1.0
        best_spectra, best_forces = self.spectra, forces
        for _ in range(ROUNDS):
            new = [_fixed_point_step(*each) for each in zip(soft, self.spectra, forces, stiffness)]
            change = _norm([n - x for n, x in zip(new, self.spectra)])
            if change < best:
                best_spectra, best_forces, best = self.spectra, forces, change
            else:  # not nearer: half as far from where it was nearest
                relaxation /= 2
                new = [_fixed_point_step(*each) for each in zip(soft, best_spectra, best_forces, stiffness)]
            self.spectra = [x + relaxation * (n - x) for n, x in zip(new, best_spectra)]
            forces = self._forces(cases)
            if best < CONVERGED * _norm(self.spectra):
                break
        for j, motion in enumerate(self.motions):
            motion.slow = [_slow_motion(*each, j) for each in zip(soft, self.spectra, forces, stiffness)]

    def mean_error(self, cases: Sequence[ClearanceWithLaw]) -> np.ndarray:
        """Return the standard deviations (n_bushings,), m, of the shaft's mean position according to laws.

        Each wall's mean force is wrong by `FORCE_ERROR` of itself, the filling's mean stiffness by
        `STATIC_STIFFNESS_ERROR`, and the remainder of both displaces the shaft against structure and filling. A filling
        that slid while the motion was larger before holds the shaft there by as large a part of its stiffness. The
        largest counts of the records that fits see and that hold at least `TELLING` of their walls' force: these errors
        repeat.
        """
        free = [c._replace(bushing=dataclasses.replace(c.bushing, gap=WIDE * c.bushing.gap)) for c in cases]
        walls = []
        for j, (motion, *both) in enumerate(zip(self.motions, cases, free)):
            forces_of_both = motion.all_forces(both, [np.repeat(x[:, j : j + 1], 2, axis=1) for x in self.spectra])
            walls.append(forces_of_both[:, 0] - forces_of_both[:, 1])
        errors, forces = [], []
        for i, stiffness in enumerate(self._stiffness(free)):
            part, _ = self.motions[0].unknown_lines[i]
            force = np.array([each[part] for each in walls])
            upper, lower = (np.maximum(side, 0.0).mean(axis=1) for side in (force, -force))
            mean = np.abs(self.spectra[i][0]) / (part.stop - part.start)
            decline = [_decline(motion.paths[i].x[:: motion.factor, 0, 0], motion.rate) for motion in self.motions]
            of_filling = STATIC_STIFFNESS_ERROR * stiffness * np.hypot(mean, decline)
            error = np.hypot(FORCE_ERROR * np.hypot(upper, lower), of_filling)
            compliance = np.abs(_with_springs(self.lines[i], stiffness).compliance[0])
            errors.append(np.sqrt(compliance**2 @ error**2))
            forces.append(np.sum(np.abs(force).mean(axis=1)))
        counted = np.array([motion.used for motion in self.motions]).T * np.array(forces)[:, None]
        is_informative = counted >= TELLING * np.maximum(counted.sum(axis=0), 1e-300)
        return np.max(np.where(is_informative, errors, 0.0), axis=0)

    def _forces(self, cases: Sequence[ClearanceWithLaw]) -> list[np.ndarray]:
        """Return spectra (n_f, n_bushings) of the forces of each record in the latest slow motion."""
        by_bushing = [
            motion.slow_forces([case], [x[:, j : j + 1] for x in self.spectra])
            for j, (motion, case) in enumerate(zip(self.motions, cases))
        ]
        return [np.column_stack([f[i] for f in by_bushing]) for i in range(len(self.lines))]

    def _stiffness(self, cases: Sequence[ClearanceWithLaw]) -> list[np.ndarray]:
        """Mean stiffness (n_bushings,) of the forces in each record, N/m."""
        stiffness = []
        for j, (motion, case) in enumerate(zip(self.motions, cases)):
            shifted = [np.repeat(x[:, j : j + 1], 2, axis=1) for x in self.spectra]
            for x, (part, _) in zip(shifted, motion.unknown_lines):
                x[0] += np.array([-SHIFT, SHIFT]) * (part.stop - part.start)
            slope = np.diff(motion.all_forces([case, case], shifted), axis=1)[:, 0] / (2 * SHIFT)
            block = int(BLOCK * motion.rate)
            parts = [slope[part][: max(1, slope[part].size // block) * block] for part, _ in motion.unknown_lines]
            means = [np.mean(of.reshape(-1, min(block, of.size)), axis=1) for of in parts]
            stiffness.append([max(float(np.mean(of)), float(np.max(of)) / 2, LEAST_STIFFNESS) for of in means])
        return list(np.transpose(stiffness))


def fit_with_slow_motion(slow: SlowMotion, fits: Sequence[ForceFit], rounds: int) -> list[ForceFit]:
    """Fit every bushing's family in turn with the slow motion of all, until their offsets stay.

    Parameters
    ----------
    slow : SlowMotion
        Of all bushings.
    fits : sequence of ForceFit
        Of each bushing, its family and where the search begins.
    rounds : int
        Fits of each bushing at most.

    Returns
    -------
    list of ForceFit
        Of each bushing.

    Notes
    -----
    The motion that a fit is given follows from the offsets before it, so that these come nearer by a part each time;
    Anderson's acceleration goes all the way (D. G. Anderson, Iterative procedures for nonlinear integral equations,
    J. ACM 12, 1965). The effect of a fit's errors on the fixed point, and the laws' errors of the mean motion, widen
    the offsets' standard deviations.
    """
    places: list[np.ndarray] = []
    moves: list[np.ndarray] = []
    fits, best = list(fits), [f.bushing.offset for f in fits]
    for _ in range(rounds):
        slow.follow([ClearanceWithLaw(dataclasses.replace(f.bushing, offset=o), f.law) for f, o in zip(fits, best)])
        starts = [{n: o if n.endswith(".offset") else v for n, v in f.values.items()} for f, o in zip(fits, best)]
        fits = [fit_force(m, f.contact, f.filling, [start]) for m, f, start in zip(slow.motions, fits, starts)]
        at, new = np.array(best), np.array([f.bushing.offset for f in fits])
        places.append(at)
        moves.append(new - at)
        if np.abs(new - at).max() < SETTLED:
            break
        best = next_offsets(places, moves, [MAX_OFFSET * f.bushing.gap for f in fits]).tolist()
    std = np.array([_offset_std(f) for f in fits])
    # What laws miss wherever the shaft comes by again is in the walls' forces: it does not count twice.
    ratio = [math.sqrt(f.correlation_length / max(f.correlation_length, m.shortest_correlation))
             for m, f in zip(slow.motions, fits)]  # fmt: skip
    error = np.hypot(_amplification(places, moves, std * ratio) * std * ratio, slow.mean_error([f.case for f in fits]))
    return [_with_offset_std(f, max(factor, 1.0)) for f, factor in zip(fits, error / np.where(std > 0, std, 1.0))]


def next_offsets(places: Sequence[np.ndarray], moves: Sequence[np.ndarray], largest: Sequence[float]) -> np.ndarray:
    """Return offsets (n_bushings,) at the fixed point that the last steps predict.

    Parameters
    ----------
    places : sequence of ndarray
        Offsets (n_bushings,) that were tried.
    moves : sequence of ndarray
        Steps of the fits from there, each (n_bushings,).
    largest : sequence of float
        Of each bushing: beyond it there is no offset, and a step is at most half of it.
    """
    step = moves[-1]
    if len(places) > 1:
        recent = slice(-1 - len(step), None)
        dx, df = (np.diff(np.array(part[recent]), axis=0).T for part in (places, moves))
        step = step - (dx + df) @ np.linalg.lstsq(df, moves[-1], rcond=0.05)[0]
    most = np.array(largest)
    return np.asarray(np.clip(places[-1] + np.clip(step, -most / 2, most / 2), -most, most))


def _amplification(places: Sequence[np.ndarray], moves: Sequence[np.ndarray], std: np.ndarray) -> np.ndarray:
    """Factors (n_bushings,) by which offsets are less well known than a fit in a given slow motion says."""
    if len(places) < 2 or not std.all():
        return np.ones(std.size)
    dx, df = (np.diff(np.array(part), axis=0).T for part in (places, moves))
    amplification = dx @ np.linalg.pinv(df, rcond=0.05)
    return np.maximum(1.0, np.linalg.norm(amplification * std, axis=1) / std)


def _offset_std(fit: ForceFit) -> float:
    return sum(s for n, s in zip(fit.estimates.names, fit.estimates.std) if n.endswith(".offset"))


def _with_offset_std(fit: ForceFit, factor: float) -> ForceFit:
    scale = np.array([factor if n.endswith(".offset") else 1.0 for n in fit.estimates.names])
    return fit.widened_by(fit.estimates.covariance * (np.outer(scale, scale) - 1))


def _decline(x: np.ndarray, rate: float) -> float:
    """Return how far, m, the RMS of a falling motion is below the largest before, mean of all blocks."""
    if not becomes_quiet(x, rate):
        return 0.0
    rms = rms_of_blocks(x, rate)
    return float(np.mean(np.maximum.accumulate(rms) - rms))


def _norm(spectra: Sequence[np.ndarray]) -> float:
    return float(np.sqrt(sum(np.sum(np.abs(x) ** 2) for x in spectra)))


def _lines(record: PreparedRecord, rig: Rig, size: int, count: int) -> _SlowLines:
    """Slow lines of a record of which every `DECIMATION`-th sample counts."""
    n = len(record.signals)
    spacing = record.fs / (DECIMATION * size)
    frequency = spacing * np.arange(count)
    omega = 2 * np.pi * np.maximum(frequency, spacing / 2)  # a free shaft has no static compliance
    model = linear_model(rig, MODES)
    gains = model.displacement_gains(model.at_bushings, record.kind, omega)
    driven = scipy.fft.rfft(record.signals[:, -1] * flanks(n, record.fs))[:count] / DECIMATION
    driven[frequency < (record.band[0] if record.band else spacing)] = 0  # sensors' drift, not the shaker
    return _SlowLines(-gains[:, :, :-1], gains[:, :, -1] * driven[:, None])


def _with_springs(lines: _SlowLines, stiffness: np.ndarray) -> _SlowLines:
    """Lines of the structure with springs in its clearances."""
    inverse = np.linalg.inv(np.eye(stiffness.size) + lines.compliance * stiffness)
    return _SlowLines(inverse @ lines.compliance, (inverse @ lines.free[:, :, None])[:, :, 0])


def _fixed_point_step(soft: _SlowLines, x: np.ndarray, forces: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    return np.asarray(soft.free - (soft.compliance @ (forces - stiffness * x)[:, :, None])[:, :, 0])


def _slow_motion(
    soft: _SlowLines, x: np.ndarray, forces: np.ndarray, stiffness: np.ndarray, number: int
) -> OwnSlowMotion:
    """Return a bushing's slow motion as a function of its law's force; the other forces stay on their tangents."""
    residual = forces - stiffness * x
    residual[:, number] = 0
    free = soft.free[:, number] - np.einsum("fj,fj->f", soft.compliance[:, number], residual)
    return OwnSlowMotion(x[:, number], free, soft.compliance[:, number, number], float(stiffness[number]))
