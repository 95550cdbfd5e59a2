"""Branches over the level of a harmonic excitation at many frequencies: onset of contact, growth and jumps.

At each frequency the branch that grows out of rest is followed. Without contact the vibration of linear greases is
known in closed form, so the branch begins where a gap is just filled, and ends once it only rises above the largest
level. A frequency without contact up to there costs one vibration; over the levels of a rattle map that makes branches
over the level much cheaper than those over frequency, and they meet the same vibrations.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from .continuation import Motions, NoConvergence, PeriodicMotion
from .following import expanded
from .in_gap import level_of_contact, linear_in_gap, without_contact
from .map_rows import nonlinear_forces, row_displacements
from .solver import Solver
from .stability import TestedPoint

__all__ = ["IMPACT", "LIMITED", "WAYS", "LevelBranch", "level_branches"]

LIMITED = ("contact_force", "penetration", "displacement", "acceleration")
"""Quantities of a branch, each the peak of a period, or half of the peak-to-peak value."""
IMPACT = "impact"
"""Penetration of an end or, of one that rests against its wall, its lift-off; below 0 without impact."""
FORCES = ("contact_force", "penetration")  # present at rest where the weight presses against a wall
WAYS = ("lift", "other wall")
"""Lift-off of an end that touches, and penetration of both walls in a period; below 0 without."""
TOLERANCE = 1e-5  # residual over the size of the motion
BENT, LONGEST, FIRST_STEP = 0.03, 0.15, 5e-3  # steps along branches, see `continuation`
SHARES = (1.0, 0.25)  # factors of these steps, tried in turn
BACK = 1e-2  # of the first motion's level: below it a branch is lost
BEYOND = 1.2  # of the largest level: a branch that rises above is left
DEEP = 0.5  # of the gap: no branch is left before it went so deep
FAR = 4.0  # times the largest level: where contact begins above that, no branch is followed
STEPS = 400  # of one branch
PARTS = 8  # interpolation points between two motions


class LevelBranch(NamedTuple):
    """The vibrations at one frequency, in their order from rest; the level turns at folds."""

    level: np.ndarray
    """(m,) factor of the excitation's level; the first is 0, at rest"""
    depth: np.ndarray
    """(m,) largest penetration in a period, m; below 0 without contact"""
    values: np.ndarray
    """(n_quantities, m) requested quantities, the largest over the clearances or sensors"""
    complete: bool
    """True if it was followed to the largest level; else nothing is known above its last level"""

    def crossings(self, levels: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return number, penetration and quantities of the vibrations at given levels.

        Parameters
        ----------
        levels : ndarray, shape (n,)
            Factors of the excitation's level, > 0.

        Returns
        -------
        count : ndarray of int, shape (n,)
            Number of vibrations, stable or not; 0 where none is known.
        depth : ndarray, shape (n,)
            The deepest one's penetration, m; 0 without contact.
        values : ndarray, shape (n_quantities, n)
            The largest of each quantity.
        """
        low, high = self.level[:-1, None], self.level[1:, None]
        crossed = np.diff(self.level[:, None] < levels, axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            fraction = np.where(crossed, (levels - low) / (high - low), 0.0)

        def largest(of: np.ndarray) -> np.ndarray:
            return np.where(crossed, of[:-1, None] + fraction * np.diff(of)[:, None], 0.0).max(axis=0, initial=0.0)

        return crossed.sum(axis=0), largest(self.depth), np.array([largest(row) for row in self.values])

    def sweeps(self, levels: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Return values in sweeps over the level, (2, ..., n): upwards from rest, then downwards; nan if unknown.

        Parameters
        ----------
        levels : ndarray, shape (n,)
            Factors of the excitation's level, > 0.
        values : ndarray, shape (..., m)
            Of the vibrations along the branch.
        """
        crossed = np.diff(self.level[:, None] < levels, axis=0)
        if not len(crossed):
            return np.full((2, *values.shape[:-1], levels.size), np.nan)
        ends = np.array([crossed.argmax(axis=0), len(crossed) - 1 - crossed[::-1].argmax(axis=0)])
        with np.errstate(divide="ignore", invalid="ignore"):
            fraction = (levels - self.level[ends]) / (self.level[ends + 1] - self.level[ends])
        fraction = np.where(crossed.any(axis=0), fraction, np.nan)
        return np.moveaxis(values[..., ends] + fraction * (values[..., ends + 1] - values[..., ends]), -2, 0)

    def level_from_rest(self, values: np.ndarray) -> float:
        """Return the level at which a quantity rises above 0 if the level is raised slowly from rest, or infinity.

        Parameters
        ----------
        values : ndarray, shape (m,)
            `depth`, or a row of `values`.
        """
        if values.max() <= 0:
            return np.inf
        i = int(np.argmax(values > 0))
        ends = slice(max(i - 1, 0), i + 1)
        begins = float(np.interp(0.0, values[ends], self.level[ends]))
        return max(begins, float(self.level[:i].max(initial=0.0)))  # a fold in the gap is passed before

    def first_level(self, values: np.ndarray, limit: float) -> float:
        """Return the lowest level at which a quantity is beyond a limit, infinite if at none.

        Parameters
        ----------
        values : ndarray, shape (m,)
            `depth`, or a row of `values`.
        limit : float
            Limit to exceed.
        """
        beyond = values > limit
        lowest = self.level[beyond].min(initial=np.inf)
        for i in np.flatnonzero(beyond[1:] != beyond[:-1]):
            fraction = (limit - values[i]) / (values[i + 1] - values[i])
            lowest = min(lowest, self.level[i] + fraction * (self.level[i + 1] - self.level[i]))
        return float(lowest)


def level_branches(
    solver: Solver, omega: np.ndarray, largest: float, quantities: Sequence[str] = (),
    rows: Sequence[int | None] = (),
) -> Iterator[LevelBranch]:  # fmt: skip
    """Yield the vibrations over the level at each frequency.

    Parameters
    ----------
    solver : Solver
        For a rig and an excitation of level 1, see `map_rows.solver_at`; its parameter and tolerances are changed.
    omega : ndarray, shape (n,)
        Angular frequencies, 1/s.
    largest : float
        Level up to which vibrations are followed.
    quantities : sequence of str
        Of `LIMITED` and `WAYS`, or `IMPACT`.
    rows : sequence of int or None
        Clearance or sensor of each quantity; None, or nothing given: the largest of all.
    """
    solver.tolerance = TOLERANCE * solver.system.fineness
    level = level_of_contact(solver, omega) if linear_in_gap(solver) else np.zeros(omega.size)
    chosen = [*rows, *([None] * (len(quantities) - len(rows)))]
    for w, contact in zip(omega.tolist(), level.tolist()):
        try:
            if contact > FAR * largest:
                motions = Motions.of([_contact_free_motion(solver, w, FAR * largest)])
            else:
                start = _motion_at_contact(solver, w, contact) if contact > 0 else solver.growing(w)
                motions = _follow(solver, start, largest)
        except NoConvergence:
            yield LevelBranch(np.zeros(1), -np.ones(1), np.zeros((len(quantities), 1)), False)
        else:
            yield _make_branch(solver, motions, w, contact, largest, quantities, chosen)


def _contact_free_motion(solver: Solver, omega: float, level: float) -> PeriodicMotion:
    """Return the motion without contact at a level, now the solver's parameter; its tangent is a placeholder."""
    (z,), (y,) = without_contact(solver, np.array([omega]))
    z[:, 1:] *= level
    y[:, 1:] *= level
    solver.raise_over("level", omega)
    return PeriodicMotion(level, z, y, np.zeros_like(y), np.append(np.zeros(solver.size), 1.0), solver.scale_of(z))


def _motion_at_contact(solver: Solver, omega: float, level: float) -> PeriodicMotion:
    """Return the motion that just fills a gap, with its tangent towards larger ones."""
    guess = _contact_free_motion(solver, omega, level)
    motion = solver.solved_at(level, guess.z, guess.y, guess.scale)
    return replace(motion, tangent=np.copysign(1.0, motion.tangent[-1]) * motion.tangent)


def _follow(solver: Solver, start: PeriodicMotion, largest: float) -> Motions:
    """Return the motions from a first one on, until they rise above the largest level or the continuation fails.

    Raises
    ------
    NoConvergence
        If they return to rest, even with short steps, as after a jump back to the branch that they came along.
    """
    ends = BACK * start.parameter, FAR * max(largest, start.parameter)
    for factor in SHARES:
        solver.bent, solver.longest = factor**2 * BENT, factor * LONGEST
        step = FIRST_STEP if start.parameter < largest else solver.longest
        motions = solver.followed(start, STEPS, step, ends, BEYOND * largest, DEEP * solver.system.size)
        if motions.parameter[-1] > ends[0]:
            return motions
    raise NoConvergence(start.parameter)


def _make_branch(
    solver: Solver, motions: Motions, omega: float, contact: float, largest: float,
    quantities: Sequence[str], rows: Sequence[int | None],
) -> LevelBranch:  # fmt: skip
    """Return the branch of motions, with rest before them."""
    x, depth = row_displacements(solver, motions.z, motions.y)
    deepest = depth.max(axis=(1, 2))
    values = np.array([_evaluate(solver, name, row, motions, omega, x, depth) for name, row in zip(quantities, rows)])
    values = values.reshape(len(quantities), motions.parameter.size)
    if 0 < contact <= FAR * largest:  # it just fills the gap, if not at any of the samples
        deepest[0] = 0.0
        values[[name == IMPACT for name in quantities], 0] = 0.0
    level, rows_of = _interpolate(motions, np.array([deepest, *values]))
    # At rest nothing moves, but a weight may press against a wall.
    pressed = [deepest[0] if contact == 0 else -solver.system.size]
    at_rest = (*WAYS, IMPACT, *FORCES) if deepest[0] > 0 else (*WAYS, IMPACT)
    pressed += [row[0] if name in at_rest else 0.0 for name, row in zip(quantities, values)]
    deepest, *whole = np.column_stack((pressed, rows_of))
    interpolated = np.array(whole).reshape(len(whole), level.size + 1)
    return LevelBranch(np.append(0.0, level), deepest, interpolated, bool(level[-1] >= largest))


def _interpolate(motions: Motions, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Interpolate levels (n,) and values (n_rows, n) between motions (n_rows, m), so that folds are accurate."""
    if motions.parameter.size < 2:
        return motions.parameter, values
    # In units that do not change along the branch, else smooth functions of the arc length have corners at the motions.
    count, size, largest = motions.parameter.size, motions.scale.max(), motions.parameter.max()
    of_z, of_level = motions.z.reshape(count, -1) / size, motions.parameter / largest
    s = np.append(0.0, np.cumsum(np.sqrt(np.sum(np.diff(of_z, axis=0) ** 2, axis=1) + np.diff(of_level) ** 2)))
    direction = motions.tangent * (motions.scale / size)[:, None]
    direction[:, -1] = motions.tangent[:, -1] * of_level
    places = np.interp(np.arange(PARTS * (count - 1) + 1) / PARTS, np.arange(count), s)
    slope = largest * direction[:, -1] / np.linalg.norm(direction, axis=1)
    return CubicHermiteSpline(s, motions.parameter, slope)(places), PchipInterpolator(s, values, axis=1)(places)


def _in_both_walls(solver: Solver, x: np.ndarray) -> np.ndarray:
    """Return the smaller penetration of the two walls (m, n_bushings) of motions (m, n_rows, K), m; < 0 if round."""
    system = solver.system
    depth = np.full((len(x), len(system.rig.bushings)), -system.size)
    place = x @ solver.grid.basis.T
    for j, bushing in enumerate(system.rig.bushings):
        if not bushing.is_round and np.isfinite(bushing.walls).all():
            ends = place[:, system.laws.rows_of(j)[1:, 1]]
            lower, upper = bushing.walls
            depth[:, j] = np.minimum(ends.max(axis=2) - upper, lower - ends.min(axis=2)).max(axis=1)
    return depth


def _evaluate(
    solver: Solver, name: str, row: int | None, motions: Motions, omega: float, x: np.ndarray,
    depth: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Return a quantity (m,) of motions with displacements x and penetrations as of `map_rows.row_displacements`."""
    if name == "penetration":
        of_rows = depth.max(axis=2)
    elif name == "lift":
        of_rows = -depth.min(axis=2)
    elif name == IMPACT:
        at_wall = depth[0].min(axis=1) > 0  # the first motion is that which just fills the gap, or next to rest
        of_rows = np.where(at_wall, -depth.min(axis=2), depth.max(axis=2))
    elif name == "other wall":
        of_rows = _in_both_walls(solver, x)
    elif name == "contact_force":
        of_rows = np.array([nonlinear_forces(solver, omega, each)[1] for each in x])
    else:
        branch = expanded(solver, [TestedPoint(motions.motion(i), None) for i in range(len(x))], "")
        of_rows = branch.excursion() if name == "displacement" else branch.amplitude(name)
    return np.asarray(of_rows.max(axis=1) if row is None else of_rows[:, row])
