"""Slow motion in the clearances of records without displacement probes: what their laws and the structure make of it.

Accelerometers do not show where in its gap a shaft hangs on average, nor how that drifts as the level rises; a law's
own slow force does. Below `RestoringForce.band` the motion x of the clearances is what the excitation u and the forces
F of the laws make of the structure without them,

    x = H u - C F(x + quick motion),

solved by x <- (1 + C K)⁻¹ (H u - C (F - K x)) with the mean stiffness K of the forces, which makes it converge.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.fft

from ...beam import ritz_model
from ...clearance import ContactLaw
from ...rig import Bushing, Rig
from ..forces.restoring import MODES, flanks
from ..records.prepared import PreparedRecord
from .measured_motion import DECIMATION, MeasuredMotion, OwnSlowMotion

__all__ = ["SlowMotion"]

ROUNDS = 12  # of the fixed point, at most
CONVERGED = 1e-3  # of the slow motion: a smaller change ends the rounds
SHIFT = 2e-6  # m, by which a shaft is shifted to find the mean stiffness of the forces on it
LEAST_STIFFNESS = 1.0  # N/m, of what is between shaft and base


class _Lines(NamedTuple):
    """Slow lines of one record."""

    compliance: np.ndarray  # (n_f, n_bushings, n_bushings) displacement by minus the forces, m/N
    free: np.ndarray  # (n_f, n_bushings) spectra of the displacement without any force in the clearances


class SlowMotion:
    """Slow motion of all clearances in all records, of which each bushing's `MeasuredMotion` gets its own.

    Parameters
    ----------
    motions : sequence of MeasuredMotion
        Of each bushing.
    records : sequence of PreparedRecord
        What they are of.
    rig : Rig
        The linear rig.
    """

    def __init__(self, motions: Sequence[MeasuredMotion], records: Sequence[PreparedRecord], rig: Rig) -> None:
        self.motions = tuple(motions)
        self.lines = [
            _lines(record, rig, part.stop - part.start, count)
            for record, (part, count) in zip(records, motions[0].unknown_lines)
        ]
        self.found = [np.zeros_like(lines.free) for lines in self.lines]
        """(n_f, n_bushings) spectra of each record"""

    def follow(self, cases: Sequence[tuple[Bushing, ContactLaw]]) -> None:
        """Solve the slow motion for a law of each bushing, and let their motions begin from there.

        Parameters
        ----------
        cases : sequence of (Bushing, ContactLaw)
            Of each bushing.
        """
        stiffness = self._stiffness(cases)
        forces, change, share = self._forces(cases), np.inf, 1.0
        for _ in range(ROUNDS):
            new = [_solved(*each) for each in zip(self.lines, self.found, forces, stiffness)]
            moved = np.sqrt(sum(np.sum(np.abs(n - x) ** 2) for n, x in zip(new, self.found)))
            share = share / 2 if moved > change else share
            change = float(moved)
            self.found = [x + share * (n - x) for n, x in zip(new, self.found)]
            forces = self._forces(cases)
            if change < CONVERGED * np.sqrt(sum(np.sum(np.abs(x) ** 2) for x in self.found)):
                break
        for j, motion in enumerate(self.motions):
            motion.slow = [
                _own(lines, x, f, k, j) for lines, x, f, k in zip(self.lines, self.found, forces, stiffness)
            ]

    def _forces(self, cases: Sequence[tuple[Bushing, ContactLaw]]) -> list[np.ndarray]:
        """Spectra (n_f, n_bushings) of the forces of each record in the slow motion found last."""
        own = [m.slow_forces([case], [x[:, j : j + 1] for x in self.found]) for j, (m, case) in self._numbered(cases)]
        return [np.column_stack([f[i] for f in own]) for i in range(len(self.lines))]

    def _stiffness(self, cases: Sequence[tuple[Bushing, ContactLaw]]) -> list[np.ndarray]:
        """Mean stiffness (n_bushings,) of the forces in each record, N/m."""
        found = []
        for j, (motion, case) in self._numbered(cases):
            shifted = [np.repeat(x[:, j : j + 1], 2, axis=1) for x in self.found]
            for x, (part, _) in zip(shifted, motion.unknown_lines):
                x[0] += np.array([-SHIFT, SHIFT]) * (part.stop - part.start)
            forces = motion.slow_forces([case, case], shifted)
            mean = [np.diff(f[0].real)[0] / (part.stop - part.start) for f, (part, _) in zip(forces, motion.unknown_lines)]
            found.append(np.maximum(np.array(mean) / (2 * SHIFT), LEAST_STIFFNESS))
        return list(np.transpose(found))

    def _numbered(self, cases: Sequence[tuple[Bushing, ContactLaw]]) -> enumerate[tuple[MeasuredMotion, tuple[Bushing, ContactLaw]]]:
        return enumerate(zip(self.motions, cases))


def _lines(record: PreparedRecord, rig: Rig, size: int, count: int) -> _Lines:
    """Slow lines of a record of which every `DECIMATION`-th sample counts."""
    n = len(record.signals)
    spacing = record.fs / (DECIMATION * size)
    frequency = spacing * np.arange(count)
    omega = 2 * np.pi * np.maximum(frequency, spacing / 2)  # a free shaft has no static compliance
    model = ritz_model(rig, MODES)
    gains = model.displacement_gains(model.at_bushings, record.kind, omega)
    driven = scipy.fft.rfft(record.signals[:, -1] * flanks(n, record.fs))[:count] / DECIMATION
    driven[frequency < (record.band[0] if record.band else spacing)] = 0  # sensors' drift, not the shaker
    return _Lines(-gains[:, :, :-1], gains[:, :, -1] * driven[:, None])


def _softened(lines: _Lines, stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compliance and free motion with springs in the clearances."""
    inverse = np.linalg.inv(np.eye(stiffness.size) + lines.compliance * stiffness)
    return inverse @ lines.compliance, (inverse @ lines.free[:, :, None])[:, :, 0]


def _solved(lines: _Lines, x: np.ndarray, forces: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    compliance, free = _softened(lines, stiffness)
    return np.asarray(free - (compliance @ (forces - stiffness * x)[:, :, None])[:, :, 0])


def _own(lines: _Lines, x: np.ndarray, forces: np.ndarray, stiffness: np.ndarray, number: int) -> OwnSlowMotion:
    """What one bushing's own law makes of its slow motion, where the others' forces stay on their tangents."""
    compliance, free = _softened(lines, stiffness)
    rest = forces - stiffness * x
    rest[:, number] = 0
    free = free[:, number] - np.einsum("fj,fj->f", compliance[:, number], rest)
    return OwnSlowMotion(x[:, number], free, compliance[:, number, number], float(stiffness[number]))
