"""Curves over two parameters: folds over frequency and level or gap.

A fold is where the derivative J of the balance by the motion is singular. A bordered system [J b; cᵀ 0] [v; g] = [0; 1]
has g = 0 there and nowhere else nearby (minimally augmented system: W. J. F. Govaerts, Numerical Methods for
Bifurcations of Dynamical Equilibria, SIAM 2000, chapter 4). With w of the transposed system the derivative of g by the
motion is -wᵀ J_z v, a difference of J along v. Where contacts open and close J changes in steps and Newton's method may
fail: there the fold is located anew at the next level or gap, as the extreme of the frequency across v.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar
from tqdm import tqdm

from ..core.errors import ClearanceError
from ..core.kinds import checks_kinds
from ..linear.refusals import refuse_across
from ..signals import labelled
from ..signals.arrays import ArrayData
from .branch import Branch, SpecialPoint
from .condensed import Condensed, laws_of
from .continuation import Motion, NoConvergence, Solver
from .following import resumed
from .harmonic_balance import balance
from .stability import FOLD

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["Curve", "follow_folds"]

TOLERANCE = 1e-8  # of Newton's method, on the balance over the size of the motion and on g
ITERATIONS = 12  # of Newton's method
DAMPED = 1 / 16  # share of a Newton step below which it is given up
DIFFERENCE = 1e-5  # half of the step of difference quotients, over motion, frequency or level
LONGEST, SHORTEST = 0.05, 1e-6  # steps, as a share of motion, frequency and level
SHARPEST = 0.8  # cosine of the largest angle between two tangents
COARSEST = 2e-4  # step below which the fold is located anew
APART = (0.02, 0.005, 0.001)  # relative steps of level or gap to where it is located anew
REACH = (0.01, 0.03, 0.1)  # relative distances from the guess within which the extreme is looked for
MAX_POINTS = 2000


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
        axes.set(xlabel="frequency (Hz)", ylabel=f"{self.over} ({self._unit})")
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
    share: float  #: of level or gap


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
        """Return what finds motions at a share of level or gap."""
        return Solver(self._system_at(share), self.solver.harmonics, self.solver.samples)

    def _system_at(self, share: float) -> Condensed:
        system = self.system
        if self.over == "level":
            return system._replace(linear=system.linear._replace(excitation=share * system.linear.excitation))
        rig = system.rig
        scaled = rig.with_gap([share * bushing.gap for bushing in rig.bushings])
        return system._replace(laws=laws_of(scaled, system.model.law))

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
        """Return what balance and g leave (m + 1,), their derivatives (m + 1, m + 2), and what y should be."""
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
        """Return the fold near a guess on the plane across ``row`` through it, and the tangent of the curve."""
        left, matrix, y = self.equations(at, scale)
        for _ in range(ITERATIONS):
            now = float(np.linalg.norm(left)) + float(np.linalg.norm(y - at.y)) / scale
            square = np.vstack((matrix, row))
            if now < TOLERANCE:
                tangent = np.linalg.solve(square, np.append(np.zeros(left.size), 1.0))
                self.b, self.c = self._next
                return at._replace(y=y), tangent / np.linalg.norm(tangent)
            step = np.linalg.solve(square, np.append(-left, 0.0))
            share = 1.0
            while True:
                moved = _moved(at._replace(y=y), share * step, scale)
                if moved.omega > 0 and moved.share > 0:
                    found = self.equations(moved, scale)
                    then = float(np.linalg.norm(found[0])) + float(np.linalg.norm(found[2] - moved.y)) / scale
                    if then < now or then < TOLERANCE:
                        break
                share /= 2
                if share < DAMPED:
                    return None
            at, (left, matrix, y) = moved, found
        return None


def _moved(at: _State, step: np.ndarray, scale: float) -> _State:
    z = at.z + scale * step[:-2].reshape(at.z.shape)
    return at._replace(z=z, omega=at.omega * (1 + step[-2]), share=at.share * (1 + step[-1]))


def _relocated(folds: _Folds, at: _State, tangent: np.ndarray, scale: float, low: float, high: float) -> _State | None:
    """The fold at a level or gap a little further on: the extreme of the frequency across the singular direction."""
    for apart in APART if tangent[-1] else ():
        share = float(np.clip(at.share * (1 + np.sign(tangent[-1]) * apart), low, high))
        guess = _moved(at, (share / at.share - 1) / tangent[-1] * tangent, scale)._replace(share=share)
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


@checks_kinds
def follow_folds(branch: Branch, point: SpecialPoint, to: float, over: str = "level", progress: bool = False) -> Curve:
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
    progress : bool
        Show a progress bar.

    Returns
    -------
    Curve
        If no next point was found, the curve so far: ``ended`` says where.

    Raises
    ------
    ClearanceError
        If the point is no fold of the branch, or at an impossible last value.
    """
    refuse_across(branch.model.rig, "follow_folds")
    if over not in ("level", "gap"):
        raise ClearanceError(f'over must be "level" or "gap", got {over!r}')
    if point not in branch.special or point.kind != FOLD:
        raise ClearanceError("point must be a fold of the branch, one of branch.special")
    begun = point.level if over == "level" else branch.model.rig.bushings[0].gap
    if not (0 < to < np.inf and to != begun):
        raise ClearanceError(f"to must be > 0 and another {over} than that of the fold, {begun:g}; got {to!r}")
    solver, omega, z, y = resumed(branch, point.index)
    found: list[_State] = []
    ended = ""
    curve = itertools.islice(_fold_after_fold(_Folds(solver, over), _State(z, y, omega, 1.0), to / begun), MAX_POINTS)
    try:
        for each in tqdm(curve, desc="folds", unit="point", disable=not progress):
            found.append(each)
    except NoConvergence as end:
        if not found:
            raise ClearanceError(
                "the fold is not found again by a bordered system; locate it with more samples"
            ) from None
        last = solver.system.periods * found[-1].omega / (2 * np.pi)
        ended = f"no further fold was found beyond {last:.6g} Hz and {over} {begun * end.args[0]:g}"
    frequency = solver.system.periods * np.array([each.omega for each in found]) / (2 * np.pi)
    return Curve(FOLD, over, branch.kind, frequency, begun * np.array([each.share for each in found]), ended)


def _fold_after_fold(folds: _Folds, at: _State, last: float) -> Iterator[_State]:
    """Yield the fold near a guess and those after it, until the share is the last one or 1 again.

    Raises
    ------
    NoConvergence
        With the share beyond which no next fold is found.
    """
    solver = folds.solver
    folds.begin(at)
    scale = max(float(np.linalg.norm(at.z)), solver.least)
    own = np.append(np.zeros(solver.size + 1), 1.0)
    if (first := folds.solve(at, own, scale)) is None:
        raise NoConvergence(at.share)
    at, tangent = first
    tangent = tangent * np.sign(tangent[-1] * (last - 1.0))
    yield at
    step = 1e-3
    low, high = min(1.0, last), max(1.0, last)
    while True:
        border = folds.b, folds.c
        guess = _moved(at, step * tangent, scale)
        turned = tangent * np.concatenate((np.ones(solver.size), [guess.omega / at.omega, guess.share / at.share]))
        new = folds.solve(guess, turned, scale) if guess.omega > 0 and guess.share > 0 else None
        if new is not None and new[1] @ tangent < 0:
            new = new[0], -new[1]
        if new is None or new[1] @ tangent < SHARPEST:
            folds.b, folds.c = border
            step /= 2
            if step < COARSEST and (again := _relocated(folds, at, tangent, scale, low, high)):
                before, at = at, again
                yield at
                if at.share in (low, high):
                    return
                pace = [at.omega / before.omega - 1, at.share / before.share - 1]
                way = np.append((at.z - before.z).ravel() / scale, pace)
                tangent, step = way / np.linalg.norm(way), 1e-3
                folds.begin(at)
                continue
            if step < SHORTEST:
                raise NoConvergence(at.share)
            continue
        bent = float(np.linalg.norm(new[1] - tangent))
        before, (at, tangent) = at, new
        if not low <= at.share <= high:
            share = ((high if at.share > high else low) - before.share) / (at.share - before.share)
            mixed = _State(
                before.z + share * (at.z - before.z), at.y, before.omega + share * (at.omega - before.omega),
                before.share + share * (at.share - before.share),
            )  # fmt: skip
            if (final := folds.solve(mixed, own, scale)) is not None:
                yield final[0]
            return
        yield at
        scale = max(float(np.linalg.norm(at.z)), solver.least)
        step = min(step * min(max(0.1 / max(bent, 1e-12), 0.3), 2.0), LONGEST)
