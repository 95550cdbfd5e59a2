"""Laws fitted to the restoring forces along the measured motion, each bushing for itself: gap, offset, contact, grease.

The motion is measured, so nothing is simulated and impacts are not chaotic: a law's force along the motion is compared
with the restoring force instant by instant. Families of laws compete by their evidence in Laplace's approximation, for
errors of unknown size that hang together in time, and by a piece of each record that no fit sees.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.fft
import scipy.ndimage
import scipy.optimize
import scipy.signal

from ..clearance import ContactLaw
from ..parameters import Estimates, Parameter
from ..rig import Bushing, Rig
from .families import Family, split
from .forces import RestoringForce
from .loop import FINER, along

__all__: list[str] = []

MODEL = 0.05
"""of the force's local RMS: error that a law is expected to have"""
LOCAL = 0.02
"""s over which that RMS is taken"""
ALIKE = 0.5
"""s of a record that count as one observation: what a law misses, it misses again in every cycle"""
HELD_OUT = (0.72, 0.86)
"""of a record's duration: the piece that no fit sees"""
STEP = 1e-3
"""prior standard deviations, for differences"""
NEAREST = 0.95
"""of the gap: the largest offset"""


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
    log_evidence: float
    """logarithm of the probability of the records given the family, but for a constant of the bushing"""
    misfit: float
    """of the force, over `MODEL` of its local RMS: robust mean over what was fitted"""
    held_out: float
    """the same over what was not"""
    varied: np.ndarray
    """(n,) values in prior standard deviations: where another fit can start"""

    def drawn(self, bushing: Bushing, seed: int) -> tuple[Bushing, ContactLaw]:
        """Draw gap, offset and law from their covariance; ``bushing`` has the rest."""
        return of_values(self.estimates.draw(1, seed)[0], self.estimates.names, self.told, bushing, *self.families)

    @property
    def families(self) -> tuple[Family, Family]:
        """Contact and grease."""
        return self.contact, self.grease


class Motion:
    """Measured motion and restoring force of one bushing in all records."""

    def __init__(self, forces: Sequence[RestoringForce], rig: Rig, number: int, gap: Sequence[Parameter]) -> None:
        self.rig, self.told, self.number, self.gap = rig, rig.bushings[number], number, tuple(gap)
        self.parts, kept, held, weights = [], [], [], []
        self.alike = ALIKE * forces[0].fs
        for f in forces:
            n = f.time.size
            points = np.concatenate((f.displacement[number : number + 1], f.ends[number]))
            x = scipy.signal.resample(points, n * FINER, axis=1)
            v = np.gradient(x, axis=1) * (f.fs * FINER)
            lines = int(f.band[1] * n / f.fs)
            self.parts.append((x[None], v[None], 1 / (f.fs * FINER), n, lines))
            aside = (f.time > HELD_OUT[0] * f.time[-1]) & (f.time < HELD_OUT[1] * f.time[-1])
            kept.append(f.valid & ~aside)
            held.append(f.valid & aside)
            level = np.sqrt(scipy.ndimage.uniform_filter1d(f.force[number] ** 2, max(1, int(LOCAL * f.fs))))
            weights.append(np.array([level, np.full(n, f.force_std[number])]))
        self.force = np.concatenate([f.force[number] for f in forces])
        self.kept, self.held = np.concatenate(kept), np.concatenate(held)
        level, noise = np.concatenate(weights, axis=1)
        self.weight = 1 / np.hypot(MODEL * np.hypot(level, np.median(level[self.kept])), noise)

    def left(self, bushing: Bushing, law: ContactLaw) -> np.ndarray:
        """(n_t,) weighted difference of a law's force along the motion from the restoring force."""
        rig, found = self.rig.replace(bushings=(bushing,)), []
        for x, v, step, n, lines in self.parts:
            fine = np.zeros((1, x.shape[2]))
            along(x, v, rig, law, step, fine)
            spectrum = scipy.fft.rfft(fine[0])[: n // 2 + 1]
            spectrum[lines + 1 :] = 0
            found.append(scipy.fft.irfft(spectrum, n) / FINER)
        return (np.concatenate(found) - self.force) * self.weight


class _Fit:
    """Robust least squares of a family's parameters, in prior standard deviations from where they start."""

    def __init__(self, motion: Motion, contact: Family, grease: Family) -> None:
        self.motion, self.contact, self.grease = motion, contact, grease
        own = [*contact.parameters(motion.told), *grease.parameters(motion.told)]
        self.parameters = [*motion.gap, *own]
        self.origin = np.array([p._forward(p.start) for p in self.parameters])
        self.width = np.array([p.prior_std for p in self.parameters])
        ends = np.array([[p._forward(p.low), p._forward(p.high)] for p in self.parameters])
        self.bounds = ((ends - self.origin[:, None]) / self.width[:, None]).T
        self._latest: tuple[np.ndarray, np.ndarray] | None = None

    def values(self, at: np.ndarray) -> list[float]:
        varied = self.origin + self.width * np.clip(at, *self.bounds)
        return [float(p._inverse(v)) for p, v in zip(self.parameters, varied)]

    def law(self, at: np.ndarray) -> tuple[Bushing, ContactLaw]:
        """Bushing and law of values."""
        told, names = self.motion.told, [p.name for p in self.parameters]
        return of_values(self.values(at), names, told, told, self.contact, self.grease)

    def left(self, at: np.ndarray) -> np.ndarray:
        return self.motion.left(*self.law(at))

    def run(self, start: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Where the fit ends, what is left there (n_t,), and its slopes (n_kept, n)."""
        kept, share = self.motion.kept, self.motion.alike**-0.5
        size = int(kept.sum())

        def residual(at: np.ndarray) -> np.ndarray:
            left = self.left(at)
            self._latest = at.copy(), left
            return np.concatenate((left[kept], at))

        def jacobian(at: np.ndarray) -> np.ndarray:
            if self._latest is None or not np.array_equal(self._latest[0], at):
                residual(at)
            assert self._latest is not None
            here = self._latest[1]
            steps = np.where(at + STEP > self.bounds[1], -STEP, STEP)
            slopes = [(self.left(at + step) - here)[kept] for step in np.diag(steps)]
            return np.vstack((np.array(slopes).T / steps, np.eye(at.size)))

        def loss(squares: np.ndarray) -> np.ndarray:
            """Soft L1 for the data, of which several count as one; the priors are squared."""
            root = np.sqrt(1 + squares[:size])
            data = np.array([2 * (root - 1), 1 / root, -0.5 / root**3]) * share**2
            return np.hstack((data, [squares[size:], np.ones(at_size), np.zeros(at_size)]))

        at_size = start.size
        inside = np.clip(start, self.bounds[0] + STEP, self.bounds[1] - STEP)
        found = scipy.optimize.least_squares(
            residual, inside, jacobian, self.bounds, loss=loss, xtol=1e-3, ftol=1e-3, max_nfev=most
        )
        left = self.left(found.x)
        return found.x, left, jacobian(found.x)[:size]


def of_values(
    values: Sequence[float], names: Sequence[str], told: Bushing, bushing: Bushing, contact: Family, grease: Family
) -> tuple[Bushing, ContactLaw]:
    """Bushing with another gap, and another offset short of the wall, and the law of values by their names."""
    known = {n.rpartition(".")[2]: float(v) for n, v in zip(names, values) if n.startswith("bushings[")}
    gap, offset = known.get("gap", bushing.gap), known.get("offset", bushing.offset)
    offset = float(np.clip(offset, -NEAREST * gap, NEAREST * gap))
    law = ContactLaw(*split([float(v) for v in values[len(known) :]], told, contact, grease))
    return dataclasses.replace(bushing, gap=gap, offset=offset), law


def fit(motion: Motion, contact: Family, grease: Family, start: ForceFit | None = None, most: int = 30) -> ForceFit:
    """Fit a family at a bushing, beginning with what another fit had alike."""
    problem = _Fit(motion, contact, grease)
    at = np.zeros(len(problem.parameters))
    if start is not None:
        known = dict(zip(start.estimates.names, start.varied))
        at = np.array([known.get(p.name, 0.0) for p in problem.parameters])
    at, left, slopes = problem.run(at, most)
    kept = motion.kept
    root = np.sqrt(1 + left[kept] ** 2)
    scale = float(np.mean(2 * (root - 1)))
    precision = (slopes / root[:, None]).T @ slopes / (motion.alike * scale) + np.eye(at.size)
    covariance = np.linalg.inv(precision)
    evidence = -0.5 * (kept.sum() / motion.alike * np.log(scale) + at @ at + np.linalg.slogdet(precision)[1])
    bushing, law = problem.law(at)
    values = problem.values(at)
    estimates = Estimates.of(problem.parameters, values, covariance * np.outer(problem.width, problem.width))
    outside = float(np.mean(2 * (np.sqrt(1 + left[motion.held] ** 2) - 1)))
    return ForceFit(contact, grease, motion.told, law, bushing, estimates, float(evidence), scale**0.5, outside**0.5, at)

