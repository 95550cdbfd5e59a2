"""Curves over two parameters: folds over frequency and level or gap, first contact over frequency and level.

A fold is where the derivative J of the balance by the motion is singular. A bordered system [J b; cᵀ 0] [v; g] = [0; 1]
has g = 0 there and nowhere else nearby (minimally augmented system: W. J. F. Govaerts, Numerical Methods for
Bifurcations of Dynamical Equilibria, SIAM 2000, chapter 4). With w of the transposed system the derivative of g by the
motion is -wᵀ J_z v, a difference of J along v. Where contacts open and close J changes in steps and Newton's method may
fail: there the fold is located anew at the next level or gap, as the extreme of the frequency across v.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

from ..clearance.law import Law
from ..core.errors import ClearanceError, ExcitationError
from ..rig import Rig
from ..signals import labelled
from ..signals.arrays import ArrayData, read_only
from ._balance import balance
from .branch import Branch, SpecialPoint
from .condensed import Condensed, condensed, laws_of
from .continuation import Motion, NoConvergence, Solver
from .following import resumed
from .forced import excitation_kind, resolution
from .in_gap import filled, linear_in_gap
from .stability import FOLD

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["Curve", "first_contact", "fold_curve"]

TOLERANCE = 1e-8
"""of the motion, and of g"""
ITERATIONS = 12
DAMPED = 1 / 16
DIFFERENCE = 1e-5
"""of motion, frequency and level: half of the difference quotients' step"""
LONGEST, SHORTEST = 0.05, 1e-6
"""of a step, as a share of motion, frequency and level"""
SHARPEST = 0.8
"""cosine of the largest angle between two steps"""
COARSEST = 2e-4
"""step below which the fold is located anew"""
APART = (0.02, 0.005, 0.001)
"""of level or gap: steps to where"""
REACH = (0.01, 0.03, 0.1)
"""of the motion: how far from the guess"""
MOST_POINTS = 2000
BISECTIONS = 60


@dataclass(frozen=True, eq=False, repr=False)
class Curve(ArrayData):
    """A curve over two parameters, in the order in which its points follow each other."""

    what: str
    """ "fold" or "first contact" """
    over: str
    """ "level" or "gap": the parameter beside the frequency"""
    kind: str
    """ "base" or "force": what the excitation is"""
    frequency: np.ndarray
    """(n,) Hz"""
    value: np.ndarray
    """(n,) level, m/s² or N; or gap of the first clearance, m, the others in the same ratio"""
    ended: str
    """why the curve ends before its last value: "" if it does not"""

    def __post_init__(self) -> None:
        self._set(frequency=read_only(self.frequency), value=read_only(self.value))

    @property
    def turns(self) -> np.ndarray:
        """Indices of points at which level or gap turn: of a curve of folds the cusps, where two folds meet."""
        step = np.diff(self.value)
        return np.flatnonzero(step[1:] * step[:-1] < 0) + 1

    @property
    def _unit(self) -> str:
        return "m" if self.over == "gap" else "m/s²" if self.kind == "base" else "N"

    def plot(self) -> Figure:
        """Draw level or gap over frequency; turns of a curve of folds are marked."""
        from ..core.drawing import canvas

        figure = canvas(4.5, 6)
        axes = figure.subplots()
        axes.plot(self.frequency, self.value, label=self.what)
        if self.what == "fold" and self.turns.size:
            axes.plot(self.frequency[self.turns], self.value[self.turns], "o", color="k", mfc="w", label="cusp")
        axes.set_xlabel("frequency (Hz)")
        axes.set_ylabel(f"{self.over} ({self._unit})")
        axes.legend(frameon=False)
        return figure

    def to_xarray(self) -> xr.Dataset:
        """Return frequency and level or gap over ``point``."""
        unit = self._unit.replace("m/s²", "m s-2")
        variables = {"frequency": ("point", self.frequency, "Hz"), self.over: ("point", self.value, unit)}
        return labelled.dataset(
            "curve", variables, {}, {"what": self.what, "kind": self.kind, "ended": self.ended}
        )  # fmt: skip


class _State(NamedTuple):
    """A point of a curve of folds."""

    z: np.ndarray
    y: np.ndarray
    omega: float
    share: float
    """of level or gap"""


class _Folds:
    """Newton's method on the balance and g, and steps along the curve; everything over `scale`, ω and share."""

    def __init__(self, solver: Solver, over: str):
        self.solver, self.over, self.system = solver, over, solver.system
        self.b = self.c = np.zeros(0)
        self._next = self.b, self.c  # borders that follow the curve

    def left(self, at: _State, want: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What the balance leaves (m,), what y should be, and the derivatives (m, m + 1) by z and ω if wanted."""
        s, system = self.solver, self._system_at(at.share)
        found = balance(system.linear, s.grid, system.laws, s.slopes, at.omega, at.z, at.y, want, s.jacobian)
        return found[0].ravel(), found[2], s.jacobian[:-1].copy() if want else s.jacobian[:0]

    def solver_at(self, share: float) -> Solver:
        """What finds motions at a share of level or gap."""
        return Solver(self._system_at(share), self.solver.harmonics, self.solver.samples)

    def _system_at(self, share: float) -> Condensed:
        system = self.system
        if self.over == "level":
            return system._replace(linear=system.linear._replace(excitation=share * system.linear.excitation))
        rig = system.rig
        scaled = rig.replace(bushings=tuple(replace(b, gap=share * b.gap) for b in rig.bushings))
        return system._replace(laws=laws_of(scaled, system.law))

    def begin(self, at: _State) -> None:
        """Border the derivative with its own singular vectors."""
        u, _, v = np.linalg.svd(self.left(at, True)[2][:, :-1])
        self.b, self.c = u[:, -1], v[-1]

    def _bordered(self, j: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """v, w and g."""
        n = len(j)
        matrix = np.zeros((n + 1, n + 1))
        matrix[:n, :n], matrix[:n, n], matrix[n, :n] = j, self.b, self.c
        right = np.append(np.zeros(n), 1.0)
        v, w = np.linalg.solve(matrix, right), np.linalg.solve(matrix.T, right)
        return v[:n], w[:n], float(v[n])

    def equations(self, at: _State, scale: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What balance and g leave (m + 1,), their derivatives (m + 1, m + 2), and what y should be."""
        left, y, slopes = self.left(at, True)
        n = left.size
        v, w, g = self._bordered(slopes[:, :-1])
        way = (v / np.linalg.norm(v)).reshape(at.z.shape)
        far = DIFFERENCE * scale

        def pushed(of: Callable[[float], _State], step: float) -> np.ndarray:
            ahead, behind = self.left(of(step), True)[2], self.left(of(-step), True)[2]
            return (ahead - behind)[:, :-1] / (2 * step)

        matrix = np.zeros((n + 1, n + 2))
        matrix[:n, :n], matrix[:n, n] = slopes[:, :-1], slopes[:, -1] * at.omega / scale
        by_way = pushed(lambda e: at._replace(z=at.z + e * way), far)
        matrix[n, :n] = -(w @ by_way) * np.linalg.norm(v) * scale
        matrix[n, n] = -(w @ pushed(lambda e: at._replace(omega=at.omega * (1 + e)), DIFFERENCE) @ v)
        more, less = at._replace(share=at.share * (1 + DIFFERENCE)), at._replace(share=at.share * (1 - DIFFERENCE))
        matrix[:n, n + 1] = (self.left(more, False)[0] - self.left(less, False)[0]) / (2 * DIFFERENCE * scale)
        if self.over == "gap":
            matrix[n, n + 1] = -(w @ pushed(lambda e: at._replace(share=at.share * (1 + e)), DIFFERENCE) @ v)
        self._next = w / np.linalg.norm(w), v / np.linalg.norm(v)
        return np.append(left / scale, g), matrix, y

    def solve(self, at: _State, row: np.ndarray, scale: float) -> tuple[_State, np.ndarray] | None:
        """The fold near a guess on the plane across ``row`` through it, and the direction of the curve."""
        left, matrix, y = self.equations(at, scale)
        for _ in range(ITERATIONS):
            now = float(np.linalg.norm(left)) + float(np.linalg.norm(y - at.y)) / scale
            square = np.vstack((matrix, row))
            if now < TOLERANCE:
                along = np.linalg.solve(square, np.append(np.zeros(left.size), 1.0))
                self.b, self.c = self._next
                return at._replace(y=y), along / np.linalg.norm(along)
            step = np.linalg.solve(square, np.append(-left, 0.0))
            share = 1.0
            while True:
                trial = _moved(at._replace(y=y), share * step, scale)
                if trial.omega > 0 and trial.share > 0:
                    found = self.equations(trial, scale)
                    then = float(np.linalg.norm(found[0])) + float(np.linalg.norm(found[2] - trial.y)) / scale
                    if then < now or then < TOLERANCE:
                        break
                share /= 2
                if share < DAMPED:
                    return None
            at, (left, matrix, y) = trial, found
        return None


def _moved(at: _State, step: np.ndarray, scale: float) -> _State:
    z = at.z + scale * step[:-2].reshape(at.z.shape)
    return at._replace(z=z, omega=at.omega * (1 + step[-2]), share=at.share * (1 + step[-1]))


def _relocated(folds: _Folds, at: _State, along: np.ndarray, scale: float, low: float, high: float) -> _State | None:
    """The fold at a level or gap a little further on: the extreme of the frequency across the singular direction."""
    for apart in APART if along[-1] else ():
        share = float(np.clip(at.share * (1 + np.sign(along[-1]) * apart), low, high))
        guess = _moved(at, (share / at.share - 1) / along[-1] * along, scale)._replace(share=share)
        if guess.omega > 0 and (found := _extreme(folds, guess, scale)):
            return found
    return None


def _extreme(folds: _Folds, guess: _State, scale: float) -> _State | None:
    solver, row = folds.solver_at(guess.share), np.append(folds.c, 0.0)
    way = folds.c.reshape(guess.z.shape)

    def motion(t: float) -> Motion | None:
        return solver.solve(guess.omega, guess.z + t * scale * way, guess.y, row, scale)

    for reach in REACH:
        places = np.linspace(-reach, reach, 5)
        omega = [found.omega for t in places if (found := motion(float(t)))]
        if len(omega) < places.size:
            continue
        inner = [i for i in (int(np.argmax(omega)), int(np.argmin(omega))) if 0 < i < places.size - 1]
        if not inner:
            continue
        sign = 1.0 if inner[0] == int(np.argmax(omega)) else -1.0

        def missed(t: float, sign: float = sign) -> float:
            found = motion(t)
            return np.inf if found is None else -sign * found.omega / guess.omega

        ends = places[inner[0] - 1], places[inner[0] + 1]
        best = motion(float(minimize_scalar(missed, bounds=ends, method="bounded", options={"xatol": 1e-5}).x))
        if best is not None:
            return _State(best.z, best.y, best.omega, guess.share)
    return None


def fold_curve(branch: Branch, point: SpecialPoint, to: float, over: str = "level") -> Curve:
    """Follow a fold over level or gap: the curve on which a rig jumps.

    It passes cusps, where two folds meet and below which nothing jumps, and goes on with the other fold.

    Parameters
    ----------
    branch : Branch
        Over frequency or level.
    point : SpecialPoint
        A fold of it.
    to : float
        Last level, m/s² or N, or gap of the first clearance, m; the curve also ends where it comes back to the value
        it began with.
    over : str
        "level" or "gap"; the gaps of all clearances keep their ratio.

    Returns
    -------
    Curve
        If no next point was found, the curve so far: ``ended`` says where.

    Raises
    ------
    ClearanceError
        If the point is no fold of the branch, or at an impossible last value.
    """
    if over not in ("level", "gap"):
        raise ClearanceError(f'over must be "level" or "gap", got {over!r}')
    if point not in branch.special or point.kind != FOLD:
        raise ClearanceError("point must be a fold of the branch, one of branch.special")
    begun = point.level if over == "level" else branch.rig.bushings[0].gap
    if not (0 < to < np.inf and to != begun):
        raise ClearanceError(f"to must be > 0 and another {over} than that of the fold, {begun:g}; got {to!r}")
    solver, omega, z, y = resumed(branch, point.index)
    folds, last = _Folds(solver, over), to / begun
    at = _State(z, y, omega, 1.0)
    folds.begin(at)
    found: list[_State] = []
    ended = ""
    scale = max(float(np.linalg.norm(z)), solver.least)
    own = np.append(np.zeros(solver.size + 1), 1.0)
    first = folds.solve(at, own, scale)
    if first is None:
        raise ClearanceError("the fold is not found again by a bordered system; locate it with more samples")
    at, along = first
    along = along * np.sign(along[-1] * (last - 1.0))
    found.append(at)
    step = 1e-3
    low, high = min(1.0, last), max(1.0, last)
    while len(found) < MOST_POINTS:
        border = folds.b, folds.c
        guess = _moved(at, step * along, scale)
        turned = along * np.concatenate((np.ones(solver.size), [guess.omega / at.omega, guess.share / at.share]))
        new = folds.solve(guess, turned, scale) if guess.omega > 0 and guess.share > 0 else None
        if new is not None and new[1] @ along < 0:
            new = new[0], -new[1]
        if new is None or new[1] @ along < SHARPEST:
            folds.b, folds.c = border
            step /= 2
            if step < COARSEST and (again := _relocated(folds, at, along, scale, low, high)):
                before, at = at, again
                found.append(at)
                pace = [at.omega / before.omega - 1, at.share / before.share - 1]
                way = np.append((at.z - before.z).ravel() / scale, pace)
                along, step = way / np.linalg.norm(way), 1e-3
                folds.begin(at)
                if at.share in (low, high):
                    break
                continue
            if step < SHORTEST:
                last_found = solver.system.periods * at.omega / (2 * np.pi)
                ended = f"no further fold was found beyond {last_found:.6g} Hz and {over} {begun * at.share:g}"
                break
            continue
        bent = float(np.linalg.norm(new[1] - along))
        before, (at, along) = at, new
        if not low <= at.share <= high:
            share = ((high if at.share > high else low) - before.share) / (at.share - before.share)
            mixed = _State(
                before.z + share * (at.z - before.z), at.y, before.omega + share * (at.omega - before.omega),
                before.share + share * (at.share - before.share),
            )  # fmt: skip
            final = folds.solve(mixed, own, scale)
            if final is not None:
                found.append(final[0])
            break
        found.append(at)
        scale = max(float(np.linalg.norm(at.z)), solver.least)
        step = min(step * min(max(0.1 / max(bent, 1e-12), 0.3), 2.0), LONGEST)
    frequency = solver.system.periods * np.array([each.omega for each in found]) / (2 * np.pi)
    value = begun * np.array([each.share for each in found])
    return Curve(FOLD, over, branch.kind, frequency, value, ended)


def first_contact(
    rig: Rig,
    law: Law,
    frequencies: ArrayLike,
    kind: str | None = None,
    harmonics: int = 21,
    samples: int | None = None,
    modes: int = 8,
) -> Curve:
    """Find the level at which a wall is first touched, over frequency.

    In closed form where greases are linear in the gap; others are followed over the level until a gap is filled.

    Parameters
    ----------
    rig : Rig
        The rig.
    law : Law
        What acts in its clearances.
    frequencies : array_like
        (n,) Hz.
    kind : str, optional
        "base" or "force"; None: as the rig's shaker.
    harmonics : int
        Of the motion.
    samples : int, optional
        Of a period; None: the power of two from 12 times the harmonics on.
    modes : int
        Of the Ritz basis, as in the modal engine.

    Returns
    -------
    Curve
        Its ``over`` is "level"; nan where no vibration fills a gap, ``ended`` says at which frequency first.

    Raises
    ------
    ClearanceError
        For impossible numbers of harmonics, samples or modes.
    ExcitationError
        For impossible frequencies, or a rig without a position for a force.
    LawError
        For a law over time or amplitude, or one that does not fit the rig.
    RigError
        If the rig has no clearance, or in the gap moves without stiffness.
    """
    frequency = np.atleast_1d(np.asarray(frequencies, dtype=float))
    if frequency.ndim != 1 or not frequency.size or not np.all((frequency > 0) & (frequency < np.inf)):
        raise ExcitationError("frequencies must be numbers > 0 Hz")
    harmonics, (samples, *_) = resolution(harmonics, samples, 1, modes)
    kind = excitation_kind(rig, kind)
    solver = Solver(condensed(rig, law, kind, [1.0], harmonics, modes), harmonics, samples)
    omega = 2 * np.pi * frequency
    if linear_in_gap(solver):
        return Curve("first contact", "level", kind, frequency, 1 / filled(solver.system, omega), "")
    level = np.full(omega.size, np.nan)
    ended = ""
    for i, each in enumerate(omega):
        try:
            level[i] = _level_of_contact(solver, float(each))
        except NoConvergence as failed:
            where = f"{frequency[i]:.6g} Hz and level {failed.args[0]:g}"
            ended = ended or f"no further periodic vibration was found beyond {where}"
    return Curve("first contact", "level", kind, frequency, level, ended)


def _level_of_contact(solver: Solver, omega: float) -> float:
    """The level at which a vibration that grows out of rest fills a gap."""
    left, moved = solver.over_level(omega)
    walls = np.repeat(np.abs([bushing.walls for bushing in solver.system.rig.bushings]).min(axis=1), 2)

    def reach(motion: Motion) -> float:
        return float(np.max(np.abs(solver.ends(motion)) / walls[:, None]))

    row = np.append(np.zeros(solver.size), 1.0)
    linear = solver.system.linear.basis @ -left + moved
    count = len(solver.system.rig.bushings)
    least = 0.1 / float(np.max(np.abs(linear[count:] @ solver.grid.basis.T) / walls[:, None]))
    scale = max(least * float(np.linalg.norm(left)), solver.least)
    motion = solver.solve(least, -least * left, least * moved, row, scale)
    if motion is None:
        raise NoConvergence(least)
    before = after = motion
    for after in solver.within(motion, 1e-3 * least, 1e6 * least):
        if reach(after) > 1:
            break
        before = after
    else:
        raise NoConvergence(before.omega)
    low, high = 0.0, 1.0
    way = (after.z - before.z, after.omega - before.omega)
    for _ in range(BISECTIONS):
        length = (low + high) / 2
        at = before.omega + length * way[1]
        found = solver.solve(at, before.z + length * way[0], before.y, row, before.scale)
        if found is None:
            raise NoConvergence(at)
        low, high = (low, length) if reach(found) > 1 else (length, high)
        if (high - low) * abs(way[1]) < 1e-9 * at:
            break
    return float(before.omega + (low + high) / 2 * way[1])
