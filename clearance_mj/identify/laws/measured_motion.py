"""Measured motion and restoring force of a clearance, which laws are compared with instant by instant."""

from __future__ import annotations

import copy
import dataclasses
import functools
import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.fft
import scipy.ndimage
import scipy.signal
import scipy.spatial

from ...clearance import ContactLaw, KelvinVoigt
from ...clearance.grease import GreaseModel
from ...clearance.walls.slot import penetration
from ...estimate.parameter import Parameter
from ...rig import Bushing, Rig
from ..forces.restoring import RestoringForce
from .case import ClearanceWithLaw, nominal_of
from .forces_in_lanes import BushingMotion, decimated, law_forces

__all__ = ["DECIMATION", "FORCE_ERROR", "MeasuredMotion", "OwnSlowMotion", "becomes_quiet", "low_pass", "rms_of_blocks"]

INTERPOLATION = 2  # factor by which motions are interpolated: contact begins and ends between samples
DECIMATION = 2  # factor by which forces are decimated: beyond the pass band there is nothing to compare
PASS, STOP, ATTENUATION = 0.17, 0.33, 60.0  # low-pass: ends of pass and stop band over fs, dB
FORCE_ERROR = 0.05  # error that a law is expected to have, over the force's local RMS
LOCAL_RMS = 0.02  # s over which that RMS is taken
BLOCK = 2.0  # s, longer than errors of a law are correlated
RECORD_BLOCKS = 1e9  # more blocks than a record has, so that none spans two records
HELD_OUT = (0.72, 0.86)  # from where to where of a record's duration no fit sees it
WIDE = 1e3  # gaps, of a hole whose wall is never met
QUIET = 0.2  # of the loudest block's RMS: a motion that becomes as quiet falls
REPEATED = 0.2  # s: so much of a motion counts as one observation in intervals, at least, where errors repeat


class OwnSlowMotion(NamedTuple):
    """Slow motion of one bushing in one record, as spectra (n_f,), and how it follows the force F of the bushing's law.

    It is free - compliance (F - stiffness x).
    """

    x: np.ndarray  #: where it begins, m
    free: np.ndarray  #: m
    compliance: np.ndarray  #: m/N
    stiffness: float  #: N/m


class MeasuredMotion:
    """Motion and restoring force of one clearance in all records, with the weight of each sample.

    A round clearance has two values, along y and z, of each sample, one after the other. Where it is not known where
    the shaft rests, a steady force moves nothing: of each record and direction the mean of the force is left out.

    Parameters
    ----------
    forces : sequence of RestoringForce
        Restoring forces of each record, all with one sample rate.
    rig : Rig
        The linear rig.
    number : int
        Index of the clearance.
    parameters : sequence of Parameter
        Its open parameters but for contact and filling, see `open_parameters`.
    used : sequence of bool, optional
        True for each record that is fitted; by default all.
    """

    def __init__(
        self, forces: Sequence[RestoringForce], rig: Rig, number: int, parameters: Sequence[Parameter] = (),
        used: Sequence[bool] | None = None,
    ) -> None:  # fmt: skip
        self.number, self.nominal, self.parameters = number, nominal_of(rig, number), tuple(parameters)
        self.rest_is_open = any(p.name.rpartition(".")[2].startswith("rest_") for p in parameters)
        rows = rig.clearance_rows[number]
        self.size = rows.stop - rows.start
        """coordinates"""
        self.paths = [_path_of(f, rows, f.rig.bushings[number].length) for f in forces]
        self.factor = INTERPOLATION * DECIMATION
        self.rate = forces[0].fs / DECIMATION
        """samples compared per second"""
        self.used = tuple(used) if used is not None else (True,) * len(forces)
        pieces = [_samples_of(f, rows, i) for i, f in enumerate(forces)]
        ends = np.cumsum([0, *(len(piece[0]) for piece in pieces)]).tolist()
        self._records = [slice(*part) for part in itertools.pairwise(ends)]
        self.force, level, noise, block, fitted, held_out = (np.concatenate(arrays) for arrays in zip(*pieces))
        used_samples = np.repeat(self.used, np.diff(ends))
        fitted, held_out = fitted & used_samples, held_out & used_samples
        self.unknown_lines = _unknown_lines(forces, self._records)
        self.fitted, self.held_out = np.flatnonzero(fitted), np.flatnonzero(held_out)
        """numbers of the values that fits see, and of those that they do not"""
        # Where the force is small all over, the error is one of the rig and the sensors: the median keeps its weight
        # finite.
        self.weight = 1 / np.hypot(FORCE_ERROR * np.hypot(level, np.median(level[self.fitted])), noise)
        self._counted = self.weight**2 * fitted
        self.blocks = np.flatnonzero(np.diff(block[self.fitted], prepend=-1))
        """(n_blocks,) where blocks begin among the fitted values"""
        # What a law misses at a place of a wall, it misses whenever the shaft comes by: blocks do not show that where
        # walls are all round, nor where the motion on average follows from the law itself.
        # After it has fallen, the motion on average is where something slid: the same until it slides again.
        seconds = REPEATED if self.size > 1 or self.unknown_lines else 0.0
        used_paths = [path for path, use in zip(self.paths, self.used) if use]
        if self.unknown_lines and any(becomes_quiet(p.x[:: self.factor, 0, 0], self.rate) for p in used_paths):
            seconds = BLOCK
        self.shortest_correlation = self.size * seconds * self.rate
        """values that count as one observation in intervals, at least"""
        self.slow: list[OwnSlowMotion] = []
        """of each record, where its slow motion is not measured but follows from laws (`SlowMotion`)"""

    def on(self, forces: Sequence[RestoringForce], rig: Rig) -> MeasuredMotion:
        """Return the same records' motion and forces on another rig, such as one drawn from its posterior.

        Parameters
        ----------
        forces : sequence of RestoringForce
            On that rig.
        rig : Rig
            The other one.
        """
        other, rows = copy.copy(self), rig.clearance_rows[self.number]
        other.paths = [_path_of(f, rows, f.rig.bushings[self.number].length) for f in forces]
        other.force = np.concatenate([_samples_of(f, rows, i)[0] for i, f in enumerate(forces)])
        return other

    def forces(self, cases: Sequence[ClearanceWithLaw], follow: bool = True) -> np.ndarray:
        """Return the forces (n, n_cases) of laws, N, in the band in which that of the records is known.

        The slow motion follows each law by one step from its latest solution, or stays there.
        """
        x = [np.repeat(m.x[:, None], len(cases), axis=1) for m in self.slow]
        if self.slow and follow:
            x = [m.free[:, None] - m.compliance[:, None] * (force - m.stiffness * each)
                 for m, force, each in zip(self.slow, self.slow_forces(cases, x), x)]  # fmt: skip
        forces = self.all_forces(cases, x)
        for part, unknown in self.unknown_lines:
            spectrum = scipy.fft.rfft(forces[part], axis=0)
            spectrum[:unknown] = 0
            forces[part] = scipy.fft.irfft(spectrum, part.stop - part.start, axis=0)
        return forces

    def slow_forces(self, cases: Sequence[ClearanceWithLaw], x: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return the slow lines (n_f, n_cases) of laws' forces in each record with a slow motion x, also such lines."""
        forces = self.all_forces(cases, x)
        return [scipy.fft.rfft(forces[part], axis=0)[:count] for part, count in self.unknown_lines]

    def all_forces(self, cases: Sequence[ClearanceWithLaw], x: Sequence[np.ndarray]) -> np.ndarray:
        """Return forces (n, n_cases) at all frequencies, with slow lines x (n_f, n_cases) in each record, if any."""
        slow = [scipy.fft.irfft(each, part.stop - part.start, axis=0)
                for each, (part, _) in zip(x, self.unknown_lines)]  # fmt: skip
        return law_forces(self.paths, low_pass(), self.factor, cases, slow)

    def residuals(self, cases: Sequence[ClearanceWithLaw]) -> np.ndarray:
        """Return (n, n_cases) differences of laws' forces from the measured one, over their expected errors."""
        residuals = self.forces(cases) - self.force[:, None]
        for part in self._records if self.rest_is_open else ():
            values = residuals[part].reshape(-1, self.size, len(cases))
            counted = self._counted[part].reshape(-1, self.size, 1)
            values -= np.sum(values * counted, axis=0) / np.maximum(counted.sum(axis=0), 1e-300)
        residuals *= self.weight[:, None]
        return residuals

    def depth(self, case: ClearanceWithLaw, kept: bool = False) -> np.ndarray:
        """Return the penetration (n, 2) of both ends into a clearance's walls, m, at all or the compared samples."""
        ends = [path.at_ends(case.bushing.length)[:: self.factor if kept else 1] for path in self.paths]
        for each, motion, (part, _) in zip(ends, self.slow, self.unknown_lines) if kept else ():
            each += scipy.fft.irfft(motion.x, part.stop - part.start)[:, None, None]
        bushing = case.bushing
        places = np.concatenate(ends) + np.array(case.middle)
        if self.size == 1:
            lower, upper = (wall + bushing.offset for wall in bushing.walls)
            return np.abs(penetration(places[:, :, 0], lower, upper))
        return np.asarray(np.hypot(*np.moveaxis(places, 2, 0)) - bushing.wall_model.reach(bushing.gap))

    def touches(self, case: ClearanceWithLaw) -> bool:
        """Return True if an end ever goes beyond the gap."""
        return bool((self.depth(case) > 0).any())

    def meets_one_of_two(self, case: ClearanceWithLaw) -> bool:
        """Return True if an end goes beyond one wall of a slot, and never beyond the other."""
        ends = np.concatenate([path.at_ends(case.bushing.length).ravel() for path in self.paths]) + case.middle[0]
        beyond = ends.max() > case.bushing.gap, ends.min() < -case.bushing.gap
        return self.nominal.stops == "both" and beyond[0] != beyond[1]

    @property
    def middle(self) -> np.ndarray:
        """Middle (d,), m, of the smallest circle about the motion: the clearance's, if all of its wall is touched."""
        x = np.concatenate([path.x[::DECIMATION, 0] for path in self.paths])
        return smallest_circle(x)[0] if self.size > 1 else (x.min(axis=0) + x.max(axis=0)) / 2

    def in_gap(self, bushing: Bushing, fillings: Sequence[GreaseModel]) -> tuple[np.ndarray, np.ndarray]:
        """Return weighted forces of fillings and of the record where nothing touches, see `GapForces.in_gap`."""
        free = dataclasses.replace(bushing, gap=WIDE * bushing.gap, friction=None)  # its walls are never met
        rest = (0.0,) * self.size if self.rest_is_open else None
        inside = self.fitted  # of all where the wall's place is unknown: contact forces are large and short
        if rest is None:
            touching = (self.depth(ClearanceWithLaw(bushing, ContactLaw(KelvinVoigt(1.0))), kept=True) > 0).any(axis=1)
            inside = inside[~np.repeat(touching, self.size)[inside]]
        cases = [ClearanceWithLaw(free, ContactLaw(KelvinVoigt(1.0), each), rest) for each in fillings]
        columns = self.forces(cases, follow=False)
        return columns[inside] * self.weight[inside, None], self.force[inside] * self.weight[inside]

    def with_reach(self, parameter: Parameter, case: ClearanceWithLaw) -> Parameter:
        """Return a gap's parameter with at least half of the shaft's way as its lower bound, if nothing ever touches.

        Parameters
        ----------
        parameter : Parameter
            Any; others than gaps are returned as they are.
        case : Case
            The fitted one.
        """
        if self.rest_is_open or not parameter.name.endswith(".gap") or self.touches(case):
            return parameter
        travel = float(np.ptp(np.concatenate([path.at_ends(case.bushing.length) for path in self.paths])))
        return dataclasses.replace(parameter, low=max(parameter.low, 0.5 * travel))


def becomes_quiet(x: np.ndarray, rate: float) -> bool:
    """Return True if a motion becomes quiet after it was loud, or before.

    Parameters
    ----------
    x : ndarray, shape (n,)
        m.
    rate : float
        Samples per second.
    """
    rms = rms_of_blocks(x, rate)
    return bool(rms.min() < QUIET * rms.max())


def rms_of_blocks(x: np.ndarray, rate: float) -> np.ndarray:
    """Return the RMS of a motion (n,) over each `BLOCK`, m; of one that is shorter, of all of it."""
    size = min(round(BLOCK * rate), x.size)
    return np.asarray(np.sqrt(np.mean(x[: x.size // size * size].reshape(-1, size) ** 2, axis=1)))


def _path_of(f: RestoringForce, rows: slice, length: float) -> BushingMotion:
    """Motion of a clearance's rows of a record's displacements, interpolated, with that of its ends."""
    n = f.time.size
    points = np.concatenate((f.displacement[None, rows], f.ends[rows].swapaxes(0, 1)))
    spectrum = INTERPOLATION * scipy.fft.rfft(points, axis=2)
    spectrum[:, :, : math.ceil(f.band[0] * n / f.fs)] = 0  # where it is unknown: only effects of the records' ends
    omega = 2 * np.pi * scipy.fft.rfftfreq(n, 1 / f.fs)
    both = spectrum, 1j * omega * spectrum
    x, v = (np.ascontiguousarray(np.moveaxis(scipy.fft.irfft(s, n * INTERPOLATION), 2, 0)) for s in both)
    step = 1 / (f.fs * INTERPOLATION)
    spin = np.zeros(len(x)) if f.spin is None else np.interp(np.arange(len(x)) * step, f.time, f.spin)
    return BushingMotion(x, v, spin, step, length)


def _samples_of(f: RestoringForce, rows: slice, record: int) -> tuple[np.ndarray, ...]:
    """Force as `law_forces` gives it, local RMS, noise, number of the block, fitted or not, held out or not; (n d,)."""
    taps, size = low_pass(), rows.stop - rows.start
    fine = scipy.signal.resample(f.force[rows], f.time.size * INTERPOLATION, axis=1)
    time, valid = (np.repeat(each[::DECIMATION], size) for each in (f.time, f.valid))
    force = decimated(fine.T, taps, INTERPOLATION * DECIMATION)
    power = scipy.ndimage.uniform_filter1d(force**2, max(1, int(LOCAL_RMS * f.fs / DECIMATION)), axis=0)
    level = np.sqrt(np.maximum(power, 0.0).mean(axis=1))  # of a force that ends, rounding leaves less than nothing
    _, gain = scipy.signal.freqz(taps, worN=f.noise_frequency, fs=f.fs * INTERPOLATION)
    density = np.abs(gain) * f.noise_density[rows]
    noise = np.sqrt(np.sum(density**2, axis=1) * f.noise_frequency[1])
    in_gap_of_fit = (time > HELD_OUT[0] * f.time[-1]) & (time < HELD_OUT[1] * f.time[-1])
    block = time // BLOCK + record * RECORD_BLOCKS
    level, noise = np.repeat(level, size), np.tile(noise, len(force))
    return force.ravel(), level, noise, block, valid & ~in_gap_of_fit, valid & in_gap_of_fit


def _unknown_lines(forces: Sequence[RestoringForce], parts: Sequence[slice]) -> list[tuple[slice, int]]:
    """Return the samples of records with unknown slow forces, and the number of unknown lines of their spectra."""
    lines = [math.ceil(f.band[0] * (p.stop - p.start) * DECIMATION / f.fs) for f, p in zip(forces, parts)]
    return [(part, count) for part, count in zip(parts, lines) if count]


@functools.cache
def low_pass() -> np.ndarray:
    """Return taps of the low-pass before decimation, an odd number, centred on a sample that is kept."""
    count, beta = scipy.signal.kaiserord(ATTENUATION, 2 * (STOP - PASS) / INTERPOLATION)
    factor = INTERPOLATION * DECIMATION
    half = factor * -(-count // (2 * factor))
    return scipy.signal.firwin(2 * half + 1, (PASS + STOP) / 2, window=("kaiser", beta), fs=INTERPOLATION)


def smallest_circle(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Return middle (2,) and radius of the smallest circle about points (n, 2), by Badoiu and Clarkson's steps.

    M. Badoiu, K. L. Clarkson, Optimal core-sets for balls, Computational Geometry 40, 2008.
    """
    points = points[scipy.spatial.ConvexHull(points).vertices]
    middle = points.mean(axis=0)
    for i in range(1, 2000):
        offsets = points - middle
        farthest = int(np.argmax(np.einsum("ij,ij->i", offsets, offsets)))
        middle = middle + offsets[farthest] / (i + 1)
    return middle, float(np.hypot(*(points - middle).T).max())
