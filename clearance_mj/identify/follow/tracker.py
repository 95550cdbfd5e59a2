"""One clearance followed along a record: learnt once, then refined window by window, watched for changes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...clearance import ContactLaw
from ...clearance.gap import penetration
from ...estimate.beliefs import Belief, refine
from ...estimate.parameter import Parameter
from ...rig import Bushing, Rig
from ..forces.restoring import RestoringForce
from ..forces.windows import WindowForces
from ..laws.families import Family
from ..laws.force_fit import ForceFit, Motion, _Fit
from .changes import Changes, fused, observed
from .initial_fit import learnt, of_rigs, of_rivals, of_the_rest

__all__ = ["QUANTITIES", "Followed", "Seen"]

QUANTITIES = ("gap", "stiffness", "damping")
"""what is told of a clearance, in this order"""


class Varies(NamedTuple):
    """How a parameter is followed, relative; an offset over the gap."""

    kind: str
    """of change, of which the parameter is a part; "" if it changes with none"""
    walk: float
    """standard deviation of its random walk over a second"""
    look: float
    """how far a window looks from what is believed"""
    anew: float
    """how far a change may go"""


VARIES = {
    "gap": Varies("gap", 1e-3, 0.03, 0.3), "offset": Varies("", 2e-3, 0.03, 0.3),
    "contact force at one gap": Varies("stiffness", 2e-3, 0.05, 0.5),
    "contact stiffness": Varies("stiffness", 2e-3, 0.05, 0.5),
    "contact cubic stiffness": Varies("stiffness", 2e-3, 0.05, 0.5),
    "contact damping": Varies("damping", 0.01, 0.2, 1.0), "contact loss": Varies("damping", 0.01, 0.2, 1.0),
    "contact exponent": Varies("", 1e-3, 0.02, 0.1),
    "grease stiffness": Varies("grease stiffness", 1e-3, 0.02, 0.3),
    "grease damping": Varies("grease damping", 5e-3, 0.05, 0.5),
}  # fmt: skip
"""parameters that are followed; the others stay as learnt"""
LEAST = {"gap": 0.03, "stiffness": 0.05, "damping": 0.3, "grease stiffness": 0.1, "grease damping": 0.3}
"""relative changes of each kind that do not matter; of damping none is an alarm: only the shapes of
their laws tell it and the film's losses apart"""
SURE = 4.0
"""standard deviations beyond them from which on a change is an alarm"""
WINDOWS = 2
"""that show a change, at least, for its kind to be told"""
BLOCK = 0.25
"""s over which what a law misses may hang together"""
KNOWN = 0.1
"""standard deviation of the gap's logarithm, from which on it is followed"""
TOUCHES = 0.005
"""share of the time in contact, from which on a law can be learnt"""
FURTHER = 1.3
"""times the way that the shaft went, at which the law is learnt anew"""
FAR = 2.0
"""times how far a window looks: one that ends further off is begun again, looking further"""
OUTLYING = 4.0
"""of the usual misfit: what is missed by more counts less"""
LARGEST = 1e3
"""of the usual misfit: nothing is counted as more"""
PUSH = 1e-3
"""m/s, at which a contact's damping is taken"""


class Alert(NamedTuple):
    """A change of a clearance."""

    kind: str
    """of `LEAST`"""
    windows: int
    """since it began, the last one included"""
    before: float
    """value, SI"""
    after: float
    """the same"""


class Seen(NamedTuple):
    """What is known of a clearance at a window's end."""

    mean: np.ndarray
    """(3,) logarithms of gap, stiffness and damping, m, N/m, N s/m"""
    std: np.ndarray
    """(3,)"""
    contact: float
    """share of the time in contact"""
    misfit: float
    """what the law misses of the force, over what it missed when it was learnt"""
    alert: Alert | None
    """a change"""


class Followed:
    """A clearance that is followed.

    Parameters
    ----------
    rig : Rig
        The linear rig.
    number : int
        Of the bushing.
    gap : sequence of Parameter
        What is known before of its gap and offset.
    families : tuple of Family or None
        Of contact and grease; None: found.
    values : mapping of str to float
        Of their parameters, where a fit may begin.
    windows : int
        From which a law is learnt.
    seconds : float
        Of a window.
    drawn : sequence of WindowForces
        Of rigs that are drawn from what is known of it.
    """

    def __init__(
        self, rig: Rig, number: int, gap: Sequence[Parameter], families: tuple[Family, Family] | None,
        values: Mapping[str, float], windows: int, seconds: float, drawn: Sequence[WindowForces] = (),
    ) -> None:  # fmt: skip
        self.rig, self.number, self.gap, self.families, self.values = rig, number, gap, families, values
        self.windows, self.seconds, self.drawn = windows, seconds, drawn
        self.recent: list[RestoringForce] = []
        self.fit: ForceFit | None = None
        self.reach, self.depth, self.of_family = 0.0, math.nan, np.zeros(3)

    def take(self, force: RestoringForce, number: int) -> Seen | None:
        """Take a window's forces, and its number; return what is known then, None as long as the gap is not."""
        seen = self._refine(force) if self.fit else None
        if seen and seen.alert:
            self.recent = []
        self.recent = [*self.recent, force][-self.windows :]
        reach = self._reach(force)
        if len(self.recent) == self.windows and reach > FURTHER * self.reach:
            self._learn(max(reach, *(self._reach(f) for f in self.recent)), number)
        return seen

    def _reach(self, force: RestoringForce) -> float:
        """RMS of the motion, m."""
        return float(np.sqrt(np.mean(force.displacement[self.number, force.valid] ** 2)))

    def _learn(self, reach: float, last: int) -> None:
        """Fit all parameters to the recent windows, the last one's number given; keep them if the gap is known then."""
        ends = np.concatenate([f.ends[self.number][:, f.valid] for f in self.recent], axis=1)
        told = self.rig.bushings[self.number]
        if np.abs(ends).max() < 0.5 * told.gap:  # no contact is nearer
            return
        motion, (found, *rivals) = learnt(self.recent, self.rig, self.number, self.gap, self.families, self.values)
        depth = np.abs(penetration(ends, *found.bushing.walls))
        names = [p.name.rpartition("].")[2] for p in found.estimates.parameters]
        if np.mean(depth > 0) < TOUCHES or found.estimates.varied_std[names.index("gap")] > KNOWN:
            return
        self.reach, self.fit, self.problem = reach, found, _Fit(motion, *found.families)
        self.families, self.values = found.families, found.values
        if math.isnan(self.depth):
            self.depth = float(np.sqrt(np.mean(depth[depth > 0] ** 2)))
        if rivals:
            self.of_family = of_rivals(np.array([_quantities(f.bushing, f.law, self.depth) for f in (found, *rivals)]))
        self.free = np.array([i for i, name in enumerate(names) if name in VARIES])
        unit = [told.gap if self.problem.parameters[i].transform == "linear" else 1.0 for i in self.free]
        unit /= self.problem.width[self.free]
        of = [VARIES[names[i]] for i in self.free]
        self.walk = unit * np.array([v.walk for v in of]) * math.sqrt(self.seconds)
        self.looks, self.anew = unit * np.array([v.look for v in of]), unit * np.array([v.anew for v in of])
        self.directions = unit * np.array([[v.kind == kind for v in of] for kind in LEAST])
        covariance = np.linalg.inv(found.information / found.alike + np.eye(found.at.size))
        self.belief = Belief(found.at[self.free], covariance[np.ix_(self.free, self.free)])
        others = [[each.window(i) for i in range(last + 1 - len(self.recent), last + 1)] for each in self.drawn]
        self.alike = of_the_rest(found, self.free)
        if others:
            self.alike += of_rigs(motion, self.number, found, self.problem, others, self.free)
        self.changes = Changes(self.belief, self.anew)

    def law(self, x: np.ndarray) -> tuple[Bushing, ContactLaw]:
        """Bushing and law where the parameters that are followed are."""
        assert self.fit is not None
        at = self.fit.at.copy()
        at[self.free] = x
        return self.problem.law(np.clip(at, self.problem.low, self.problem.high))

    def _quantities(self, points: np.ndarray) -> np.ndarray:
        """(n_points, 3) logarithms."""
        return np.array([_quantities(*self.law(x), self.depth) for x in points])

    def _refine(self, force: RestoringForce) -> Seen:
        """Refine what is known by a window's forces."""
        assert self.fit is not None
        motion = Motion([force], self.rig, self.number, self.gap)
        samples, unit = np.sort(np.concatenate((motion.kept, motion.held))), self.fit.misfit

        def residuals(points: np.ndarray) -> np.ndarray:
            left = motion.left([self.law(x) for x in points])[samples].T / unit
            left = np.clip(np.nan_to_num(left, nan=LARGEST), -LARGEST, LARGEST)
            return left / (1 + (left / OUTLYING) ** 2) ** 0.25  # squares grow as the size of what is far off

        block, loose = round(BLOCK * motion.rate), self.belief.drifted(self.looks)
        found = refine(loose, residuals, block)
        if np.any(np.abs(found.belief.mean - loose.mean) > FAR * self.looks):
            loose = self.belief.drifted(self.anew)
            found = refine(loose, residuals, block)
        seen, believed = observed(loose, found.belief), self.belief.drifted(self.walk)
        scatter = self.changes.add(believed, seen)
        self.belief = fused(believed, seen, scatter)
        alert = self._alert()
        known = Belief(self.belief.mean, self.belief.covariance + self.alike).through(self._quantities)
        walls = self.law(self.belief.mean)[0].walls
        touching = penetration(force.ends[self.number][:, force.valid], *walls).any(axis=0)
        misfit = float(np.sqrt(np.mean(found.residuals**2)))
        std = np.sqrt(known.std**2 + self.of_family)
        return Seen(known.mean, std, float(touching.mean()), misfit, alert)

    def _alert(self) -> Alert | None:
        """A change that the windows show; what is believed then begins anew with what followed it."""
        found = self.changes.look(self.directions, np.log1p(list(LEAST.values())))
        if found is None or found[1] < SURE or found[0].windows < WINDOWS:
            return None
        change, _ = found
        self.belief = change.after.drifted(self.looks)  # the window in which it happened holds both
        self.changes = Changes(self.belief, self.anew)
        kind = list(LEAST)[change.kind]
        if kind == "damping":
            return None
        before = self._value(kind, change.before)
        return Alert(kind, change.windows, before, before * math.exp(change.size))

    def _value(self, kind: str, x: np.ndarray) -> float:
        if kind in QUANTITIES:
            return float(np.exp(self._quantities(x[None])[0, QUANTITIES.index(kind)]))
        at = self.problem.origin.copy() * 0.0
        at[self.free] = x
        names = [p.name for p in self.problem.parameters]
        return self.problem.values(at)[names.index(kind)]


def _quantities(bushing: Bushing, law: ContactLaw, depth: float) -> np.ndarray:
    """(3,) logarithms of gap, and of stiffness and damping at a depth, m."""
    contact = law.contact[0]
    still, fast = contact.force(depth, 0.0, PUSH), contact.force(depth, PUSH, PUSH)
    return np.log([bushing.gap, still / depth, max((fast - still) / PUSH, 1e-6)])
