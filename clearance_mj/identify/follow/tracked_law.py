"""The law of a clearance of which some parameters are tracked, and the others stay as they were fitted."""

from __future__ import annotations

import math

import numpy as np

from ...clearance import ContactLaw
from ...clearance.family import FamilyParameter
from ...estimate.parameter import Parameter
from ...rig import Bushing
from ..laws.force_fit import ForceFit, ForceProblem
from .alarms import QUANTITIES, TESTED, TRACKED

__all__ = ["TrackedLaw", "log_quantities"]

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
    seconds : float
        Length of a window, s.
    """

    def __init__(self, fit: ForceFit, problem: ForceProblem, depth: float, seconds: float) -> None:
        self.fit, self.problem, self.depth = fit, problem, depth
        names = [_tracked_as(p) for p in problem.parameters]
        self.free = np.array([i for i, name in enumerate(names) if name in TRACKED])
        """(n,) numbers of the tracked ones among all parameters"""
        self.names = [str(names[i]) for i in self.free]
        """(n,) what each is a part of, by the names of `TRACKED`"""
        # A relative change of 1, in prior standard deviations; of an offset it is a gap.
        linear = np.array([problem.parameters[i].transform == "linear" for i in self.free])
        unit = np.where(linear, fit.nominal.gap, 1.0) / problem.unit[self.free]
        tracked = [TRACKED[name] for name in self.names]
        self.walk = unit * np.array([t.walk for t in tracked]) * math.sqrt(seconds)
        self.window_std = unit * np.array([t.window_std for t in tracked])
        self.change_std = unit * np.array([t.change_std for t in tracked])
        self.directions = unit * np.array([[name == tested for name in self.names] for tested in TESTED])

    def law(self, x: np.ndarray) -> tuple[Bushing, ContactLaw]:
        """Return bushing and law at x."""
        point = self.fit.point.copy()
        point[self.free] = x
        return self.problem.law(np.clip(point, self.problem.low, self.problem.high))

    def log_quantities(self, points: np.ndarray) -> np.ndarray:
        """Return logarithms (n_points, 3) of `QUANTITIES` at points (n_points, n)."""
        return np.array([log_quantities(*self.law(x), self.depth) for x in points])

    def value(self, name: str, x: np.ndarray) -> float:
        """Return the value of one of `TRACKED` at x, SI: of the filling's, that of the parameter tracked as it."""
        if name in QUANTITIES:
            return float(np.exp(self.log_quantities(x[None])[0, QUANTITIES.index(name)]))
        point = np.zeros_like(self.problem.origin)
        point[self.free] = x
        return float(self.problem.values(point)[self.free[self.names.index(name)]])


def log_quantities(bushing: Bushing, law: ContactLaw, depth: float) -> np.ndarray:
    """Return logarithms (3,) of gap, and of stiffness F/δ and damping dF/dδ̇ of a contact at a depth δ, m."""
    contact = law.contact[0]
    still, fast = contact.force(depth, 0.0, SMALL_SPEED), contact.force(depth, SMALL_SPEED, SMALL_SPEED)
    return np.log([bushing.gap, still / depth, max((fast - still) / SMALL_SPEED, NO_DAMPING)])


def _tracked_as(parameter: Parameter) -> str | None:
    """What a parameter is a part of: gap and offset are known by their paths into the rig."""
    if isinstance(parameter, FamilyParameter):
        return parameter.tracked_as
    return parameter.name.rpartition("].")[2]
