"""Laws fitted to the restoring forces along the measured motion, each bushing for itself: gap, offset, contact, grease.

The motion is measured, so nothing is simulated and impacts are not chaotic: a law's force along the motion is compared
with the restoring force instant by instant. Families of laws compete by their evidence in Laplace's approximation, for
errors of unknown size that hang together in time, and by a piece of each record that no fit sees.

What hangs together in time tells less than as many samples that do not. How much less shows in the gradients of the
misfit over short blocks, which would be as large as the slopes say if it were noise: the likelihood counts as so many
observations (Ribatet, Cooley and Davison, Bayesian inference from composite likelihoods, Statistica Sinica 22, 2012).
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.fft
import scipy.ndimage
import scipy.signal

from ...clearance import ContactLaw
from ...clearance.gap import penetration
from ...estimate.estimates import Estimates
from ...estimate.parameter import Parameter
from ...rig import Bushing, Rig
from ..forces.restoring import RestoringForce
from .families import Family, split
from .forces_in_lanes import Path, forces_along

__all__: list[str] = []

FINER = 2
"""factor by which motions are interpolated: contact begins and ends between samples"""
COARSER = 2
"""factor by which forces are decimated"""
PASS, STOP, ATTENUATION = 0.17, 0.33, 60.0
"""of fs: up to here forces are compared, from there on they are down by so many dB"""
MODEL = 0.05
"""of the force's local RMS: error that a law is expected to have"""
LOCAL = 0.02
"""s over which that RMS is taken"""
BLOCK = 2.0
"""s over which what a law misses may hang together"""
CYCLE = 0.03
"""s that tell no more than one observation where families are compared, a cycle in the middle of 5 to 220 Hz: rig and
sensors are a little wrong too"""
MANY = 1e9
"""blocks, more than in a record"""
HELD_OUT = (0.72, 0.86)
"""of a record's duration: the piece that no fit sees"""
STEP = 1e-3
"""prior standard deviations, for differences"""
NEAREST = 0.95
"""of the gap: the largest offset"""
DAMPINGS = (0.0, 0.01, 0.1, 0.3, 1.0, 3.0, 10.0, 50.0)
"""Levenberg's and Marquardt's, all tried at once"""
SMALLEST = 0.2
"""gain of the log-posterior below which a fit ends"""
MOST = 24
"""steps of a fit"""
DIVERGED = 1e6
"""of the expected error: nothing is counted as more"""
CAREFUL = 10.0
"""samples, at most, that count as one on the way: far from the optimum all that is missed hangs together"""
KNOWN = 1e-6
"""of the largest information, from which on a direction counts as known"""


class Motion:
    """Measured motion and restoring force of one bushing in all records, ready to compare laws with."""

    def __init__(self, forces: Sequence[RestoringForce], rig: Rig, number: int, gap: Sequence[Parameter]) -> None:
        self.rig, self.told, self.gap = rig, rig.bushings[number], tuple(gap)
        self.paths, self.factor = [_path(f, number) for f in forces], FINER * COARSER
        self.rate = forces[0].fs / COARSER
        """samples compared per second"""
        pieces = [_compared(f, number, i) for i, f in enumerate(forces)]
        self.force, level, noise, block, kept, held = (np.concatenate(arrays) for arrays in zip(*pieces))
        self.slow = _slow_lines(forces, [len(piece[0]) for piece in pieces])
        self.kept, self.held = np.flatnonzero(kept), np.flatnonzero(held)
        self.weight = 1 / np.hypot(MODEL * np.hypot(level, np.median(level[self.kept])), noise)
        self.blocks = np.flatnonzero(np.diff(block[self.kept], prepend=-1))
        """(n_blocks,) where they begin among what is kept"""

    def forces(self, cases: Sequence[tuple[Bushing, ContactLaw]]) -> np.ndarray:
        """(n_t, n_cases) forces of laws along the motion, in the band in which that of the records is known, N."""
        found = forces_along(self.paths, _taps(), self.factor, self.rig, cases)
        for part, unknown in self.slow:
            spectrum = scipy.fft.rfft(found[part], axis=0)
            spectrum[:unknown] = 0
            found[part] = scipy.fft.irfft(spectrum, part.stop - part.start, axis=0)
        return found

    def left(self, cases: Sequence[tuple[Bushing, ContactLaw]]) -> np.ndarray:
        """(n_t, n_cases) weighted differences of laws' forces along the motion from the restoring force."""
        return (self.forces(cases) - self.force[:, None]) * self.weight[:, None]

    def with_reach(self, parameter: Parameter, bushing: Bushing) -> Parameter:
        """The gap's parameter, at least half of the way that the shaft went, if it never left the gap found."""
        ends = np.concatenate([path.x[:, 1:].ravel() for path in self.paths])
        if not parameter.name.endswith(".gap") or penetration(ends, *bushing.walls).any():
            return parameter
        return dataclasses.replace(parameter, low=max(parameter.low, 0.5 * float(np.ptp(ends))))


def _path(f: RestoringForce, number: int) -> Path:
    n = f.time.size
    spectrum = FINER * scipy.fft.rfft(np.concatenate((f.displacement[number : number + 1], f.ends[number])), axis=1)
    omega = 2 * np.pi * scipy.fft.rfftfreq(n, 1 / f.fs)
    x, v = (np.ascontiguousarray(scipy.fft.irfft(s, n * FINER).T) for s in (spectrum, 1j * omega * spectrum))
    return Path(x, v, 1 / (f.fs * FINER))


def _compared(f: RestoringForce, number: int, record: int) -> tuple[np.ndarray, ...]:
    """Force as `forces_along` gives it, its local RMS, its noise, number of the block, whether kept or held out."""
    taps = _taps()
    fine = scipy.signal.resample(f.force[number], f.time.size * FINER)
    time, valid = f.time[::COARSER], f.valid[::COARSER]
    force = scipy.signal.upfirdn(taps, fine, 1, FINER * COARSER)[taps.size // 2 // (FINER * COARSER) :][: time.size]
    level = np.sqrt(scipy.ndimage.uniform_filter1d(force**2, max(1, int(LOCAL * f.fs / COARSER))))
    _, gain = scipy.signal.freqz(taps, worN=f.noise_frequency, fs=f.fs * FINER)
    density = np.abs(gain) * f.noise_density[number]
    noise = np.full(time.size, np.sqrt(np.sum(density**2) * f.noise_frequency[1]))
    aside = (time > HELD_OUT[0] * f.time[-1]) & (time < HELD_OUT[1] * f.time[-1])
    return force, level, noise, time // BLOCK + record * MANY, valid & ~aside, valid & aside


def _slow_lines(forces: Sequence[RestoringForce], sizes: Sequence[int]) -> list[tuple[slice, int]]:
    """Samples of records whose slow forces are not known, and how many lines of their spectra are not."""
    ends = np.cumsum([0, *sizes]).tolist()
    lines = [math.ceil(f.band[0] * size * COARSER / f.fs) for f, size in zip(forces, sizes)]
    return [(slice(*part), count) for part, count in zip(itertools.pairwise(ends), lines) if count]


@functools.cache
def _taps() -> np.ndarray:
    """Of the low-pass, an odd number, centred on a sample that is kept."""
    count, beta = scipy.signal.kaiserord(ATTENUATION, 2 * (STOP - PASS) / FINER)
    half = FINER * COARSER * -(-count // (2 * FINER * COARSER))
    return scipy.signal.firwin(2 * half + 1, (PASS + STOP) / 2, window=("kaiser", beta), fs=FINER)


@dataclass(frozen=True, eq=False)
class ForceFit:
    """One family of contact and grease at one bushing."""

    contact: Family
    grease: Family
    told: Bushing
    """as the rig file has it"""
    law: ContactLaw
    """of this bushing"""
    bushing: Bushing
    """with the gap and offset found"""
    estimates: Estimates
    """of gap and offset, where the rig file leaves them open, then of contact and grease"""
    at: np.ndarray
    """(n,) values in prior standard deviations"""
    information: np.ndarray
    """(n, n) of `at`, as if the misfit were noise, without the priors"""
    size: int
    """samples that were fitted"""
    alike: float
    """samples that tell as much as one, see the module"""
    misfit: float
    """of the force, over `MODEL` of its local RMS: robust mean over what was fitted"""
    held_out: float
    """the same over what was not"""

    def log_evidence(self, alike: float) -> float:
        """Logarithm of the probability of the records given the family, but for a constant of the bushing.

        ``alike``: the number of samples that tell as much as one, the same for all families.
        """
        precision = self.information / alike + np.eye(self.at.size)
        data = self.size / alike * np.log(self.misfit**2)
        return float(-0.5 * (data + self.at @ self.at + np.linalg.slogdet(precision)[1]))

    def drawn(self, bushing: Bushing, seed: int) -> tuple[Bushing, ContactLaw]:
        """Draw gap, offset and law from their covariance; ``bushing`` has the rest."""
        return of_values(self.estimates.draw(1, seed)[0], self.estimates.names, self.told, bushing, *self.families)

    @property
    def values(self) -> dict[str, float]:
        """By name, SI: where another fit can start."""
        return dict(zip(self.estimates.names, self.estimates.value.tolist()))

    @property
    def families(self) -> tuple[Family, Family]:
        """Contact and grease."""
        return self.contact, self.grease


def _size(left: np.ndarray) -> np.ndarray:
    """Soft L1 of what is left (n, ...): its mean."""
    return np.mean(2 * (np.sqrt(1 + left**2) - 1), axis=0)


class _Fit:
    """Posterior of a family's parameters, in prior standard deviations from where they start.

    Errors are of unknown size, of which a robust mean is taken, and of them several tell as much as one.
    """

    def __init__(self, motion: Motion, contact: Family, grease: Family) -> None:
        self.motion, self.contact, self.grease = motion, contact, grease
        own = [*contact.parameters(motion.told), *grease.parameters(motion.told)]
        self.parameters = [*motion.gap, *own]
        self.origin = np.array([p.to_varied(p.start) for p in self.parameters])
        self.width = np.array([p.prior_std for p in self.parameters])
        ends = np.array([[p.to_varied(p.low), p.to_varied(p.high)] for p in self.parameters])
        self.low, self.high = ((ends - self.origin[:, None]) / self.width[:, None]).T

    def values(self, at: np.ndarray) -> list[float]:
        varied = self.origin + self.width * at
        return [float(np.clip(p.from_varied(v), p.low, p.high)) for p, v in zip(self.parameters, varied)]

    def at(self, values: Mapping[str, float]) -> np.ndarray:
        """Where values by name are; those that are not given, at their priors."""
        inside = [np.clip(values.get(p.name, p.start), p.low, p.high) for p in self.parameters]
        return (np.array([p.to_varied(float(v)) for p, v in zip(self.parameters, inside)]) - self.origin) / self.width

    def law(self, at: np.ndarray) -> tuple[Bushing, ContactLaw]:
        """Bushing and law of values."""
        told, names = self.motion.told, [p.name for p in self.parameters]
        return of_values(self.values(at), names, told, told, self.contact, self.grease)

    def left(self, points: Sequence[np.ndarray]) -> np.ndarray:
        """(n_kept, n_points); no more than `DIVERGED`, where a trial law diverges."""
        found = self.motion.left([self.law(at) for at in points])[self.motion.kept]
        return np.clip(np.nan_to_num(found, nan=DIVERGED), -DIVERGED, DIVERGED)

    def likely(self, points: Sequence[np.ndarray], left: np.ndarray, alike: float) -> np.ndarray:
        """(n_points,) logarithm of the posterior."""
        return -0.5 * (len(left) / alike * np.log(_size(left)) + np.sum(np.square(points), axis=1))

    def slopes(self, at: np.ndarray, left: np.ndarray) -> np.ndarray:
        """(n_kept, n); zeros where a step already leads to a law that diverges."""
        steps = np.where(at + STEP > self.high, -STEP, STEP)
        moved = self.left(at + np.diag(steps))
        return np.where(np.abs(moved).max(axis=0) < DIVERGED, (moved - left[:, None]) / steps, 0.0)

    def told(self, slopes: np.ndarray, left: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """Gradient of the misfit, information (n, n), and how many samples tell as much as one."""
        size = _size(left)
        weighted = slopes / np.sqrt(1 + left**2)[:, None]
        scores = weighted * (left / size)[:, None]
        information = weighted.T @ slopes / size
        found, direction = np.linalg.eigh(information)
        known = found > KNOWN * found[-1]
        of_blocks = np.add.reduceat(scores @ direction[:, known], self.motion.blocks, axis=0)
        alike = np.mean(np.sum(of_blocks**2, axis=0) / found[known]) if known.any() else 0.0
        return scores.sum(axis=0), information, max(1.0, float(alike))

    def steps(self, at: np.ndarray, slope: np.ndarray, precision: np.ndarray) -> list[np.ndarray]:
        """Points to go to, Gauss and Newton's first; what is at a bound and would pass it stays there."""
        free = ~((at <= self.low) & (slope > 0) | (at >= self.high) & (slope < 0))
        points = np.tile(at, (len(DAMPINGS), 1))
        for point, damping in zip(points, DAMPINGS):
            damped = precision + damping * np.diag(np.diag(precision))
            point[free] -= np.linalg.solve(damped[np.ix_(free, free)], slope[free])
        return list(np.clip(points, self.low, self.high))

    def run(self, starts: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """Where the fit ends, what is left there (n_kept,), the information and how many samples tell as one."""
        starts = [np.clip(start, self.low, self.high) for start in starts]
        found, gain = self.left(starts), np.inf
        i = int(np.argmax(self.likely(starts, found, len(found) / self.motion.blocks.size)))
        at, left = starts[i], found[:, i]
        for _ in range(MOST):
            gradient, information, alike = self.told(self.slopes(at, left), left)
            if gain < SMALLEST:
                break
            count = min(alike, CAREFUL)
            points = self.steps(at, gradient / count + at, information / count + np.eye(at.size))
            found = self.left(points)
            likely = self.likely(points, found, count)
            i = int(np.argmax(likely))
            gain = likely[i] - self.likely([at], left[:, None], count)[0]
            if not gain > 0:
                break
            at, left = points[i], found[:, i]
        return at, left, information, alike


def of_values(
    values: Sequence[float], names: Sequence[str], told: Bushing, bushing: Bushing, contact: Family, grease: Family
) -> tuple[Bushing, ContactLaw]:
    """Bushing with another gap, and another offset short of the wall, and the law of values by their names."""
    known = {n.rpartition(".")[2]: float(v) for n, v in zip(names, values) if n.startswith("bushings[")}
    gap, offset = known.get("gap", bushing.gap), known.get("offset", bushing.offset)
    offset = float(np.clip(offset, -NEAREST * gap, NEAREST * gap))
    law = ContactLaw(*split([float(v) for v in values[len(known) :]], told, contact, grease))
    return dataclasses.replace(bushing, gap=gap, offset=offset), law


def fit(motion: Motion, contact: Family, grease: Family, starts: Sequence[Mapping[str, float]] = ()) -> ForceFit:
    """Fit a family at a bushing, beginning with the likeliest of some values by name, or else with the priors."""
    problem = _Fit(motion, contact, grease)
    points = [problem.at(values) for values in (*starts, {})]
    at, left, information, alike = problem.run(points)
    covariance = np.linalg.inv(information / alike + np.eye(at.size)) * np.outer(problem.width, problem.width)
    bushing, law = problem.law(at)
    parameters = [motion.with_reach(p, bushing) for p in problem.parameters]
    outside = motion.left([(bushing, law)])[motion.held, 0]
    return ForceFit(
        contact, grease, motion.told, law, bushing, Estimates.of(parameters, problem.values(at), covariance), at,
        information, left.size, alike, float(_size(left)) ** 0.5, float(_size(outside)) ** 0.5,
    )  # fmt: skip
