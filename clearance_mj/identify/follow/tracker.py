"""One clearance tracked in a record: fitted once, then refined window by window, tested for changes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...clearance.family import FamilyParameter
from ...clearance.walls.slot import penetration
from ...estimate.beliefs import Belief
from ...estimate.parameter import Parameter
from ...rig import Rig
from ..forces.restoring import RestoringForce
from ..forces.windows import WindowForces
from ..laws.case import ClearanceWithLaw
from ..laws.families import FamilyValues
from ..laws.force_fit import ForceFit, ForceProblem
from ..laws.measured_motion import MeasuredMotion
from .alarms import QUANTITIES, TRACKED, Alarm
from .follower import Label, SequentialPosterior
from .initial_fit import between_family_variance, covariance_of_fixed, covariance_of_rig, fit_law

__all__ = ["BLOCK", "ClearanceTracker"]

# The law of a clearance: some of its parameters are tracked, the others stay as they were fitted.

SMALL_SPEED = 1e-3  # m/s, at which a contact's damping is taken
NO_DAMPING = 1e-6  # N s/m, has a logarithm


class TrackedLaw:
    """A fitted law as a function of the parameters x (n,) that are tracked, in prior standard deviations.

    Parameters
    ----------
    fit : ForceFit
        Fit of all parameters.
    problem : ForceProblem
        Problem of the same families.
    depth : float
        m, penetration at which a contact's stiffness and damping are taken.
    """

    def __init__(self, fit: ForceFit, problem: ForceProblem, depth: float) -> None:
        self.fit, self.problem, self.depth = fit, problem, depth
        names = [_quantity_of(p) for p in problem.parameters]
        self.free = np.array([i for i, name in enumerate(names) if name in TRACKED])
        """(n,) numbers of the tracked ones among all parameters"""
        self.names = [str(names[i]) for i in self.free]
        """(n,) quantity in `TRACKED` that each belongs to"""
        linear = np.array([problem.parameters[i].transform == "linear" for i in self.free])
        self.unit = np.where(linear, fit.nominal.gap, 1.0) / problem.unit[self.free]
        """(n,) a relative change of 1, of an offset one by a gap, in prior standard deviations"""

    def case(self, x: np.ndarray) -> ClearanceWithLaw:
        """Return the clearance and its law at x."""
        point = self.fit.point.copy()
        point[self.free] = x
        return self.problem.case(np.clip(point, self.problem.low, self.problem.high))

    def log_quantities(self, points: np.ndarray) -> np.ndarray:
        """Return logarithms (n_points, 3) of `QUANTITIES` at points (n_points, n)."""
        return np.array([log_quantities(self.case(x), self.depth) for x in points])

    def value(self, label: Label, x: np.ndarray) -> float:
        """Return the value of one of `TRACKED` at x, SI: of the filling's, that of the parameter tracked as it."""
        name = label[1]
        if name in QUANTITIES:
            return float(np.exp(self.log_quantities(x[None])[0, QUANTITIES.index(name)]))
        point = np.zeros_like(self.problem.origin)
        point[self.free] = x
        return float(self.problem.values(point)[self.free[self.names.index(name)]])


def log_quantities(case: ClearanceWithLaw, depth: float) -> np.ndarray:
    """Return logarithms (3,) of gap, and of stiffness F/δ and damping dF/dδ̇ of a contact at a depth δ, m."""
    contact = case.law.contact[0]
    still, fast = contact.force(depth, 0.0, SMALL_SPEED), contact.force(depth, SMALL_SPEED, SMALL_SPEED)
    return np.log([case.bushing.gap, still / depth, max((fast - still) / SMALL_SPEED, NO_DAMPING)])


def _quantity_of(parameter: Parameter) -> str | None:
    """Return the tracked quantity of a parameter: gap and offset are known by their paths into the rig."""
    if isinstance(parameter, FamilyParameter):
        return parameter.tracked_as
    return parameter.name.rpartition("].")[2]


BLOCK = 0.25  # s, longer than errors of a law are correlated within a window
MAX_GAP_STD = 0.1  # standard deviation of the gap's logarithm, up to which it is known well enough to be tracked
MIN_CONTACT = 0.005  # fraction of time in contact from which on a law can be fitted
REACH_RATIO = 1.3  # of the shaft's RMS motion to that in the fit, from which on the law is fitted again
OUTLYING = 4.0  # of the fit's misfit: larger residuals count less
MAX_RESIDUAL = 1e3  # of the fit's misfit: none counts as more


class WindowEstimate(NamedTuple):
    """Estimate of a clearance at a window's end."""

    mean: np.ndarray  #: (3,) logarithms of gap, stiffness and damping, m, N/m, N s/m
    std: np.ndarray  #: (3,) standard deviations of the logarithms
    contact: float  #: fraction of time in contact
    misfit: float  #: RMS of the force that the law misses, over its misfit when it was fitted
    alarm: Alarm | None  #: a change that this window shows


class ClearanceTracker:
    """A clearance whose law is tracked.

    Parameters
    ----------
    rig : Rig
        The linear rig.
    number : int
        Index of the bushing.
    gap_parameters : sequence of Parameter
        Priors of its gap and offset.
    families : FamilyValues or None
        Families of contact and filling, with values where their fit begins; None: the likeliest are selected.
    windows : int
        Number of windows that the law is fitted to.
    seconds : float
        Length of a window, s.
    drawn : sequence of WindowForces
        Forces on rigs that are drawn from the posterior of the rig.
    """

    def __init__(
        self, rig: Rig, number: int, gap_parameters: Sequence[Parameter], families: FamilyValues | None, windows: int,
        seconds: float, drawn: Sequence[WindowForces] = (),
    ) -> None:  # fmt: skip
        self.rig, self.number, self.gap_parameters, self.families = rig, number, gap_parameters, families
        self.windows, self.seconds, self.drawn = windows, seconds, drawn
        self.recent: list[RestoringForce] = []
        self.fit: ForceFit | None = None
        self.fitted_reach, self.depth, self.family_variance = 0.0, math.nan, np.zeros(3)

    def take(self, force: RestoringForce, index: int, time: float) -> WindowEstimate | None:
        """Take a window's forces and return the estimate then; None as long as the gap is not known.

        Parameters
        ----------
        force : RestoringForce
            Forces of all clearances in the window.
        index : int
            Number of the window in the record.
        time : float
            s, its end.
        """
        estimate = self._refine(force, time) if self.fit else None
        if estimate and estimate.alarm:
            self.recent = []  # windows before a change say nothing of the law after it
        self.recent = [*self.recent, force][-self.windows :]
        reach = self._rms_motion(force)
        if len(self.recent) == self.windows and reach > REACH_RATIO * self.fitted_reach:
            self._fit(max(reach, *(self._rms_motion(f) for f in self.recent)), index)
        return estimate

    def _rms_motion(self, force: RestoringForce) -> float:
        """RMS of the motion, m."""
        return float(np.sqrt(np.mean(force.displacement[self.number, force.valid] ** 2)))

    def _fit(self, reach: float, index: int) -> None:
        """Fit all parameters to the recent windows, up to number `index`; keep them if the gap is known then."""
        ends = np.concatenate([f.ends[self.number][:, f.valid] for f in self.recent], axis=1)
        if np.abs(ends).max() < 0.5 * self.rig.bushings[self.number].gap:  # no gap in reach of its prior is met
            return
        motion = MeasuredMotion(self.recent, self.rig, self.number, self.gap_parameters)
        fit, *rivals = fit_law(motion, self.families)
        depth = np.abs(penetration(ends, *fit.bushing.walls))
        gap_std = dict(zip(fit.estimates.names, fit.estimates.varied_std))[f"bushings[{self.number}].gap"]
        if np.mean(depth > 0) < MIN_CONTACT or gap_std > MAX_GAP_STD:
            return
        self.fitted_reach, self.fit = reach, fit
        self.families = FamilyValues(fit.contact, fit.filling, fit.values)
        if math.isnan(self.depth):
            self.depth = float(np.sqrt(np.mean(depth[depth > 0] ** 2)))
        if rivals:
            quantities = [log_quantities(f.case, self.depth) for f in (fit, *rivals)]
            self.family_variance = between_family_variance(np.array(quantities))
        problem = ForceProblem(motion, fit.contact, fit.filling)
        self.law = TrackedLaw(fit, problem, self.depth)
        free = self.law.free
        belief = Belief(fit.point[free], fit.covariance[np.ix_(free, free)])
        labels = [(self.number, name) for name in self.law.names]
        self.follower = SequentialPosterior(belief, labels, self.law.unit, self.law.value, self.seconds, self.seconds)
        drawn_forces = [[w.window(i) for i in range(index + 1 - len(self.recent), index + 1)] for w in self.drawn]
        self.constant_covariance = covariance_of_fixed(fit, free)
        """of errors that are the same in all windows"""
        if drawn_forces:
            self.constant_covariance += covariance_of_rig(fit, problem, drawn_forces, free)

    def _refine(self, force: RestoringForce, time: float) -> WindowEstimate:
        """Refine the belief by a window's forces."""
        law = self.law
        motion = MeasuredMotion([force], self.rig, self.number, self.gap_parameters)
        samples, unit = np.sort(np.concatenate((motion.fitted, motion.held_out))), law.fit.misfit

        def residuals(points: np.ndarray) -> np.ndarray:
            errors = motion.residuals([law.case(x) for x in points])[samples].T / unit
            errors = np.clip(np.nan_to_num(errors, nan=MAX_RESIDUAL), -MAX_RESIDUAL, MAX_RESIDUAL)
            return errors / (1 + (errors / OUTLYING) ** 2) ** 0.25  # squares of outliers grow as their size

        refinement, alarm = self.follower.take(residuals, round(BLOCK * motion.rate), time)
        belief = self.follower.belief
        quantities = Belief(belief.mean, belief.covariance + self.constant_covariance).through(law.log_quantities)
        walls = law.case(belief.mean).bushing.walls
        touching = penetration(force.ends[self.number][:, force.valid], *walls).any(axis=0)
        misfit = float(np.sqrt(np.mean(refinement.residuals**2)))
        std = np.sqrt(quantities.std**2 + self.family_variance)
        return WindowEstimate(quantities.mean, std, float(touching.mean()), misfit, alarm)
