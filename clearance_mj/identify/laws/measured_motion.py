"""Measured motion of a clearance beside its restoring force: what laws are compared with, instant by instant."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Sequence
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import scipy.fft
import scipy.ndimage
import scipy.signal
import scipy.spatial

from ...clearance import ContactLaw, KelvinVoigt, along
from ...clearance.grease import GreaseModel
from ...clearance.record import clearance_records
from ...clearance.walls.slot import penetration
from ...estimate.parameter import Parameter
from ...rig import Bushing, Rig
from ...rig.dimensions import shaft_radius
from ..forces.restoring import RestoringForce
from .forces_in_lanes import Path, decimated, law_forces

__all__ = [
    "DECIMATION", "FORCE_ERROR", "MeasuredMotion", "OwnSlowMotion", "RoundCase", "RoundMotion", "forces_along",
    "low_pass", "path_of",
]  # fmt: skip

INTERPOLATION = 2  # factor by which motions are interpolated: contact begins and ends between samples
DECIMATION = 2  # factor by which forces are decimated: beyond the pass band there is nothing to compare
PASS, STOP, ATTENUATION = 0.17, 0.33, 60.0  # low-pass: ends of pass and stop band over fs, dB
FORCE_ERROR = 0.05  # error that a law is expected to have, over the force's local RMS
LOCAL_RMS = 0.02  # s over which that RMS is taken
BLOCK = 2.0  # s, longer than errors of a law are correlated
RECORD_BLOCKS = 1e9  # more blocks than a record has, so that none spans two records
HELD_OUT = (0.72, 0.86)  # from where to where of a record's duration no fit sees it
WIDE = 1e3  # gaps, of a hole whose wall is never met
SLOW_ROUNDS = 2  # in which the slow motion follows a law, from where it was found last


class OwnSlowMotion(NamedTuple):
    """Slow motion of one bushing in one record, as spectra (n_f,), and how it follows the force F of the bushing's law.

    It is free - compliance (F - stiffness x).
    """

    x: np.ndarray  #: where it begins, m
    free: np.ndarray  #: m
    compliance: np.ndarray  #: m/N
    stiffness: float  #: N/m


class MeasuredMotion:
    """Motion and restoring force of one bushing in all records, with the weight of each sample.

    Parameters
    ----------
    forces : sequence of RestoringForce
        Restoring forces of each record, all with one sample rate.
    rig : Rig
        The linear rig.
    number : int
        Index of the bushing.
    gap_parameters : sequence of Parameter
        Gap, offset and length, so far as the rig file leaves them open.
    """

    def __init__(
        self, forces: Sequence[RestoringForce], rig: Rig, number: int, gap_parameters: Sequence[Parameter]
    ) -> None:
        self.rig, self.nominal, self.gap_parameters = rig, rig.bushings[number], tuple(gap_parameters)
        self.paths = [path_of(f, number, f.rig.bushings[number].length) for f in forces]
        self.factor = INTERPOLATION * DECIMATION
        self.rate = forces[0].fs / DECIMATION
        """samples compared per second"""
        pieces = [samples_of(f, number, i) for i, f in enumerate(forces)]
        self.force, level, noise, block, fitted, held_out = (np.concatenate(arrays) for arrays in zip(*pieces))
        self.unknown_lines = _unknown_lines(forces, [len(piece[0]) for piece in pieces])
        self.fitted, self.held_out = np.flatnonzero(fitted), np.flatnonzero(held_out)
        """numbers of the samples that fits see, and of those that they do not"""
        # Where the force is small all over, the error is one of the rig and the sensors: the median keeps its weight
        # finite.
        self.weight = 1 / np.hypot(FORCE_ERROR * np.hypot(level, np.median(level[self.fitted])), noise)
        self.blocks = np.flatnonzero(np.diff(block[self.fitted], prepend=-1))
        """(n_blocks,) where blocks begin among the fitted samples"""
        self.slow: list[OwnSlowMotion] = []
        """of each record, where its slow motion is not measured but follows from laws (`SlowMotion`)"""

    def forces(self, cases: Sequence[tuple[Bushing, ContactLaw]], rounds: int = SLOW_ROUNDS) -> np.ndarray:
        """Return the forces (n_t, n_cases) of laws, N, in the band in which that of the records is known."""
        x, last = [np.repeat(own.x[:, None], len(cases), axis=1) for own in self.slow], np.full(len(cases), np.inf)
        for _ in range(rounds if self.slow else 0):
            forces = self.slow_forces(cases, x)
            new = [own.free[:, None] - own.compliance[:, None] * (f - own.stiffness * each)
                   for own, f, each in zip(self.slow, forces, x)]  # fmt: skip
            change = sum(np.sum(np.abs(n - each) ** 2, axis=0) for n, each in zip(new, x))
            nearer = change < last  # laws that are too stiff for it stay where they were
            x = [np.where(nearer, n, each) for n, each in zip(new, x)]
            last = np.where(nearer, change, 0.0)
        found = self.all_forces(cases, x)
        for part, unknown in self.unknown_lines:
            spectrum = scipy.fft.rfft(found[part], axis=0)
            spectrum[:unknown] = 0
            found[part] = scipy.fft.irfft(spectrum, part.stop - part.start, axis=0)
        return found

    def slow_forces(self, cases: Sequence[tuple[Bushing, ContactLaw]], x: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return the slow lines (n_f, n_cases) of laws' forces in each record with a slow motion x, also such lines."""
        found = self.all_forces(cases, x)
        return [scipy.fft.rfft(found[part], axis=0)[:count] for part, count in self.unknown_lines]

    def all_forces(self, cases: Sequence[tuple[Bushing, ContactLaw]], x: Sequence[np.ndarray]) -> np.ndarray:
        """Return forces (n_t, n_cases) at all frequencies, with slow lines x (n_f, n_cases) in each record, if any."""
        slow = [scipy.fft.irfft(each, part.stop - part.start, axis=0)
                for each, (part, _) in zip(x, self.unknown_lines)]  # fmt: skip
        return law_forces(self.paths, low_pass(), self.factor, self.rig, cases, slow)

    def _at_ends(self, length: float) -> np.ndarray:
        """Displacements (n_t, 2) at both ends of a bushing of a length."""
        ends = np.concatenate([path.at_ends(length)[:: self.factor] for path in self.paths])
        for own, (part, _) in zip(self.slow, self.unknown_lines):
            ends[part] += scipy.fft.irfft(own.x, part.stop - part.start)[:, None]
        return ends

    def residuals(self, cases: Sequence[tuple[Bushing, ContactLaw]]) -> np.ndarray:
        """Return (n_t, n_cases) differences of laws' forces from the measured one, over their expected errors."""
        return (self.forces(cases) - self.force[:, None]) * self.weight[:, None]

    def in_gap(self, bushing: Bushing, fillings: Sequence[GreaseModel]) -> tuple[np.ndarray, np.ndarray]:
        """Return weighted forces of fillings and of the record where nothing touches, see `GapForces.in_gap`."""
        free = dataclasses.replace(bushing, gap=WIDE * bushing.gap)  # its walls are never met
        inside = self.fitted[~penetration(self._at_ends(bushing.length)[self.fitted], *bushing.walls).any(axis=1)]
        columns = self.forces([(free, ContactLaw(KelvinVoigt(1.0), filling)) for filling in fillings], rounds=0)
        return columns[inside] * self.weight[inside, None], self.force[inside] * self.weight[inside]

    def with_reach(self, parameter: Parameter, bushing: Bushing) -> Parameter:
        """Return a gap's parameter with at least half of the shaft's way as its lower bound, if nothing ever touches.

        Parameters
        ----------
        parameter : Parameter
            Any; others than gaps are returned as they are.
        bushing : Bushing
            With the gap found.
        """
        ends = np.concatenate([path.at_ends(bushing.length).ravel() for path in self.paths])
        if not parameter.name.endswith(".gap") or penetration(ends, *bushing.walls).any():
            return parameter
        return dataclasses.replace(parameter, low=max(parameter.low, 0.5 * float(np.ptp(ends))))


def path_of(f: RestoringForce, number: int, length: float) -> Path:
    """Return the motion of row ``number`` of a record's displacements, interpolated, with that of its ends."""
    n = f.time.size
    points = np.concatenate((f.displacement[number : number + 1], f.ends[number]))
    spectrum = INTERPOLATION * scipy.fft.rfft(points, axis=1)
    spectrum[:, : math.ceil(f.band[0] * n / f.fs)] = 0  # where it is not known, but for what ends of records make of it
    omega = 2 * np.pi * scipy.fft.rfftfreq(n, 1 / f.fs)
    x, v = (np.ascontiguousarray(scipy.fft.irfft(s, n * INTERPOLATION).T) for s in (spectrum, 1j * omega * spectrum))
    return Path(x, v, 1 / (f.fs * INTERPOLATION), length)


def samples_of(f: RestoringForce, number: int, record: int) -> tuple[np.ndarray, ...]:
    """Return force as `law_forces` gives it, local RMS, noise, number of the block, whether fitted, or held out."""
    taps = low_pass()
    fine = scipy.signal.resample(f.force[number], f.time.size * INTERPOLATION)
    time, valid = f.time[::DECIMATION], f.valid[::DECIMATION]
    force = decimated(fine, taps, INTERPOLATION * DECIMATION)
    power = scipy.ndimage.uniform_filter1d(force**2, max(1, int(LOCAL_RMS * f.fs / DECIMATION)))
    level = np.sqrt(np.maximum(power, 0.0))  # of a force that ends, rounding leaves less than nothing
    _, gain = scipy.signal.freqz(taps, worN=f.noise_frequency, fs=f.fs * INTERPOLATION)
    density = np.abs(gain) * f.noise_density[number]
    noise = np.full(time.size, np.sqrt(np.sum(density**2) * f.noise_frequency[1]))
    aside = (time > HELD_OUT[0] * f.time[-1]) & (time < HELD_OUT[1] * f.time[-1])
    return force, level, noise, time // BLOCK + record * RECORD_BLOCKS, valid & ~aside, valid & aside


def _unknown_lines(forces: Sequence[RestoringForce], sizes: Sequence[int]) -> list[tuple[slice, int]]:
    """Samples of records whose slow forces are not known, and how many lines of their spectra are not."""
    ends = np.cumsum([0, *sizes]).tolist()
    lines = [math.ceil(f.band[0] * size * DECIMATION / f.fs) for f, size in zip(forces, sizes)]
    return [(slice(*part), count) for part, count in zip(itertools.pairwise(ends), lines) if count]


@functools.cache
def low_pass() -> np.ndarray:
    """Return taps of the low-pass before decimation, an odd number, centred on a sample that is kept."""
    count, beta = scipy.signal.kaiserord(ATTENUATION, 2 * (STOP - PASS) / INTERPOLATION)
    factor = INTERPOLATION * DECIMATION
    half = factor * -(-count // (2 * factor))
    return scipy.signal.firwin(2 * half + 1, (PASS + STOP) / 2, window=("kaiser", beta), fs=INTERPOLATION)


# Measured motion of a round clearance beside its restoring force along y and z: what laws are compared with.


class RoundCase(NamedTuple):
    """A law of one round clearance."""

    bushing: Bushing  #: with its gap, wall, length and friction; its offset counts for nothing
    law: ContactLaw  #: of contact and filling
    rest: tuple[float, float] = (0.0, 0.0)  #: from the middle to where the shaft is when its probes read zero, m


def forces_along(
    case: RoundCase, x: np.ndarray, v: np.ndarray, spin: np.ndarray, step: float, lever: float = 1.0
) -> np.ndarray:
    """Return the forces (n_t, 2) of a law along y and z, N, in a motion of the shaft from where it rests.

    Parameters
    ----------
    case : RoundCase
        The law.
    x, v : ndarray, shape (n_t, 3, 2)
        Displacements and velocities of the middle and both ends, m and m/s.
    spin : ndarray, shape (n_t,)
        rad/s.
    step : float
        s.
    lever : float
        By which the law's ends are farther from the middle.
    """
    bushing = dataclasses.replace(case.bushing, offset=0.0, offset_y=0.0)
    records = clearance_records(SimpleNamespace(bushings=(bushing,)), case.law, step)
    offset = records.bushings["offset"][0]
    records.numbers[offset : offset + 2] = case.rest
    if lever != 1.0:
        x, v = (each[:, :1] + lever * (each - each[:, :1]) for each in (x, v))
    return along.forces_along(records, 0, x, v, spin)


class RoundMotion:
    """Motion and restoring force of one round clearance in all records, along y and z sample by sample.

    A steady force, such as that of the shaft's weight on the wall, moves nothing and is not known: of each record and
    direction the mean of the force is left out.

    Parameters
    ----------
    forces : sequence of RestoringForce
        Restoring forces of each record, all with one sample rate.
    rig : Rig
        The linear rig.
    number : int
        Index of the clearance.
    """

    def __init__(self, forces: Sequence[RestoringForce], rig: Rig, number: int) -> None:
        self.rig, self.number = rig, number
        self.nominal = dataclasses.replace(rig.bushings[number], radius=shaft_radius(rig, number) or None)
        self.rate = forces[0].fs / DECIMATION
        """samples compared per second, of each direction"""
        rows = 2 * number, 2 * number + 1
        self._motions = [_Motion.of(f, rows, f.rig.bushings[number].length) for f in forces]
        self._length = forces[0].rig.bushings[number].length
        self.turns = any(f.spin is not None for f in forces)
        """whether the shaft turns in any record"""
        pieces = [[samples_of(f, row, i) for row in rows] for i, f in enumerate(forces)]
        sizes = [2 * piece[0][0].size for piece in pieces]
        self._records = [slice(*part) for part in itertools.pairwise(np.cumsum([0, *sizes]).tolist())]
        both = [[np.column_stack(pair).ravel() for pair in zip(*piece)] for piece in pieces]
        self.force, level, noise, block, fitted, held_out = (np.concatenate(parts) for parts in zip(*both))
        level = np.repeat(np.sqrt(np.square(level).reshape(-1, 2).mean(axis=1)), 2)
        self.fitted, self.held_out = np.flatnonzero(fitted), np.flatnonzero(held_out)
        """numbers of the values that fits see, and of those that they do not"""
        self.weight = 1 / np.hypot(FORCE_ERROR * np.hypot(level, np.median(level[self.fitted])), noise)
        self._counted = self.weight**2 * fitted
        self.blocks = np.flatnonzero(np.diff(block[self.fitted], prepend=-1))
        """(n_blocks,) where blocks begin among the fitted values"""

    def forces(self, case: RoundCase) -> np.ndarray:
        """Return the forces (n,) of a law, N: y and z of each sample one after the other."""
        found = []
        lever = case.bushing.length / self._length if self._length else 1.0
        for motion in self._motions:
            out = forces_along(case, motion.x, motion.v, motion.spin, motion.step, lever)
            found.append(decimated(out, low_pass(), INTERPOLATION * DECIMATION).ravel())
        return np.concatenate(found)

    def residuals(self, cases: Sequence[RoundCase]) -> np.ndarray:
        """Return (n, n_cases) differences of laws' forces from the measured one, over their expected errors."""
        return np.column_stack([self._difference(self.forces(case)) for case in cases])

    def _difference(self, force: np.ndarray) -> np.ndarray:
        rest = force - self.force
        for part in self._records:
            own, counted = rest[part].reshape(-1, 2), self._counted[part].reshape(-1, 2)
            own -= np.sum(own * counted, axis=0) / np.maximum(counted.sum(axis=0), 1e-300)
        return np.asarray(rest * self.weight)

    def touches(self, case: RoundCase) -> bool:
        """Return whether an end ever goes beyond the gap."""
        reach = max(float(np.hypot(*(m.x[:, 1:] + np.array(case.rest)).T).max()) for m in self._motions)
        return reach > case.bushing.wall_model.reach(case.bushing.gap)

    @property
    def middle(self) -> np.ndarray:
        """Middle (2,), m, of the smallest circle about the motion: the hole's, if all of it is touched."""
        return smallest_circle(np.concatenate([m.x[::DECIMATION, 0] for m in self._motions]))[0]

    def in_gap(self, bushing: Bushing, fillings: Sequence[GreaseModel]) -> tuple[np.ndarray, np.ndarray]:
        """Return weighted forces of fillings and of the record where nothing touches, see `GapForces.in_gap`."""
        free = dataclasses.replace(bushing, gap=WIDE * bushing.gap, friction=None)
        inside = self.fitted  # a filling acts all the time, and what the wall adds is large and short
        columns = [self.forces(RoundCase(free, ContactLaw(KelvinVoigt(1.0), filling))) for filling in fillings]
        weight = self.weight[inside]
        return np.column_stack(columns)[inside] * weight[:, None], self.force[inside] * weight


class _Motion(NamedTuple):
    """Motion of a record at a fine rate."""

    x: np.ndarray  #: (n, 3, 2) displacements along y and z of the middle and both ends, m
    v: np.ndarray  #: (n, 3, 2) velocities, m/s
    spin: np.ndarray  #: (n,) rad/s
    step: float  #: s

    @classmethod
    def of(cls, force: RestoringForce, rows: Sequence[int], length: float) -> _Motion:
        paths = [path_of(force, row, length) for row in rows]
        x, v = (np.ascontiguousarray(np.stack([getattr(p, name) for p in paths], axis=2)) for name in "xv")
        time = np.arange(len(x)) * paths[0].step
        spin = np.zeros(time.size) if force.spin is None else np.interp(time, force.time, force.spin)
        return cls(x, v, spin, paths[0].step)


def smallest_circle(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Return middle (2,) and radius of the smallest circle about points (n, 2), by Badoiu and Clarkson's steps.

    M. Badoiu, K. L. Clarkson, Optimal core-sets for balls, Computational Geometry 40, 2008.
    """
    points = points[scipy.spatial.ConvexHull(points).vertices]
    middle = points.mean(axis=0)
    for i in range(1, 2000):
        away = points - middle
        farthest = int(np.argmax(np.einsum("ij,ij->i", away, away)))
        middle = middle + away[farthest] / (i + 1)
    return middle, float(np.hypot(*(points - middle).T).max())
