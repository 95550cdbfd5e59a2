"""All vibrations over frequency that hang together with the one in the gap, at one level.

As long as no wall is touched the vibration of linear greases is known in closed form; the curve leaves it where the gap
is filled and comes back to it at another such frequency. These arcs are continued; gaps and arcs in turn are the whole
curve, from the lowest frequency to the highest one, and loops beside it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .continuation import Motion, Motions, NoConvergence, difference
from .in_gap import edges, filled, linear_in_gap, without_contact
from .solver import Solver

__all__ = ["Curve", "Vibrations", "curve"]

LOW, HIGH, BROKEN = -1, -2, -3
"""Kinds of end of an arc that does not end where the gap is filled: at the range's lowest or highest frequency, or
where no next motion was found."""
PARTS = 8  # points between two motions at which an arc is read
MAX_MOTIONS = 2000  # motions of an arc: one that goes on is lost in turns that no sweep resolves
MARGIN = 1e-6  # share of the frequency by which arcs go beyond the range
SAME = 1e-2  # difference over what vibrates below which two motions at one frequency are one
SAG = 1e-2  # share of a mean under which a vibration about it is not known well enough to tell two from each other
SAME_FOLD = 3e-4  # relative distance in frequency below which a map does not resolve two folds


@dataclass(frozen=True, eq=False)
class Vibrations:
    """Those of one stretch of the curve, in its order."""

    cell: np.ndarray  #: (m,) index of the frequency
    z: np.ndarray  #: (m, r, K) harmonics of the coordinates, m
    y: np.ndarray  #: (m, n_points, K) of the points beside them, m

    def __getitem__(self, which: np.ndarray | slice) -> Vibrations:
        """Those of some indices."""
        return Vibrations(self.cell[which], self.z[which], self.y[which])


@dataclass(frozen=True, eq=False)
class Curve:
    """What is known of the vibrations at one level."""

    order: Vibrations
    """from the lowest frequency along the curve to the highest one"""
    beside: Vibrations
    """of loops that a sweep does not meet"""
    folds: tuple[tuple[float, bool], ...]
    """1/s, and whether a sweep upwards ends there, or one downwards"""
    ended: tuple[float, ...]
    """1/s: where no further motion was found"""


@dataclass(frozen=True, eq=False)
class _Link:
    """A stretch of the curve between two of its ends."""

    ends: tuple[int, int]
    vibrations: Vibrations
    folds: tuple[tuple[float, bool], ...] = ()


def curve(solver: Solver, omega: np.ndarray) -> Curve:
    """Return the vibrations at increasing frequencies, 1/s, of an excitation with one harmonic.

    The frequency may be that of the turning, whose speed then changes along the curve.
    """
    ended: list[float] = []
    if linear_in_gap(solver):
        known = edges(solver, omega)
        links = [*_gaps(solver, omega, known), *_arcs(solver, omega, known, ended)]
    else:
        links = list(_whole(solver, omega, ended))
    folds = tuple(fold for link in links for fold in link.folds)
    whole = list(links)
    up = _walk(links, LOW)
    down = _walk(links, HIGH)
    if up and up[-1].ends[1] == BROKEN and (other := _walk(whole, HIGH)) and other[-1].ends[1] == LOW:
        links, up, down = whole, [], other
    order = _joined(solver, [*up, *(_reversed(link) for link in reversed(down))])
    return Curve(order, _joined(solver, links, order)[order.cell.size :], folds, tuple(ended))


def _gaps(solver: Solver, omega: np.ndarray, known: list[tuple[float, bool]]) -> Iterator[_Link]:
    """The stretches without contact, in closed form."""
    inside = filled(solver, omega) <= 1
    bounds = [LOW, *range(len(known)), HIGH]
    for left, right in zip(bounds, bounds[1:]):
        opens = left == LOW or not known[left][1]
        closes = right == HIGH or known[right][1]
        if not (opens and closes) or (left == LOW and right == HIGH and not inside.any()):
            continue
        low, high = -np.inf if left == LOW else known[left][0], np.inf if right == HIGH else known[right][0]
        cells = np.flatnonzero(inside & (omega > low) & (omega < high))
        yield _Link((left, right), Vibrations(cells, *without_contact(solver, omega[cells])))


def _arcs(
    solver: Solver, omega: np.ndarray, known: list[tuple[float, bool]], ended: list[float]
) -> Iterator[_Link]:  # fmt: skip
    """The stretches with contact, each from an end that no other one has reached."""
    low, high = omega[0] * (1 - MARGIN), omega[-1] * (1 + MARGIN)
    starts = [(i, above) for i, (_, above) in enumerate(known)]
    if filled(solver, omega[:1])[0] > 1:
        starts.insert(0, (LOW, True))
    if filled(solver, omega[-1:])[0] > 1:
        starts.append((HIGH, False))
    reached: set[int] = set()
    for start, up in starts:
        if start in reached:
            continue
        motions: list[Motion] = []
        end = BROKEN
        try:
            first = solver.first(low if start == LOW else high) if start < 0 else _at_edge(solver, known[start][0])
            for motion in solver.within(first, low, high, up, MAX_MOTIONS):
                if len(motions) > 1 and not solver.touches(motion) and solver.touches(motions[-1]):
                    end = _edge(motion, known)
                    motion = _at_edge(solver, known[end][0])
                motions.append(motion)
                if end != BROKEN:
                    break
            else:
                end = LOW if motions[-1].omega < (low + high) / 2 else HIGH
        except NoConvergence as failed:
            ended.append(failed.args[0])
        reached.update((start, end))
        if end == start and len(motions) > 2:
            motions, end = _until_return(motions, end, ended)
        if motions:
            link = _link((start, end), motions, omega)
            corners = (*_corner(start, known, motions[:2]), *_corner(end, known, motions[:-3:-1]))
            yield _Link(link.ends, link.vibrations, (*_elsewhere(link.folds, corners), *corners))


def _until_return(motions: list[Motion], end: int, ended: list[float]) -> tuple[list[Motion], int]:
    """Motions and their end, cut where they turn back along themselves to their beginning, as at a corner."""
    if np.linalg.norm(difference(motions[0], motions[-1])) > SAME:
        return motions, end
    way = np.cumsum([np.linalg.norm(difference(a, b)) for a, b in itertools.pairwise(motions)])
    found = motions[: int(np.searchsorted(way, way[-1] / 2)) + 1]
    ended.append(found[-1].omega)
    return found, BROKEN


def _elsewhere(
    folds: tuple[tuple[float, bool], ...], corners: tuple[tuple[float, bool], ...]
) -> Iterator[tuple[float, bool]]:
    """The folds of an arc that are not its corners: whether one shows as a fold too hangs on the last bits."""
    for omega, up in folds:
        if not any(up == other and abs(omega / at - 1) < SAME_FOLD for at, other in corners):
            yield omega, up


def _corner(end: int, known: list[tuple[float, bool]], motions: list[Motion]) -> Iterator[tuple[float, bool]]:
    """The fold where the gap is filled, if the arc from there, two motions, goes back beside the vibration in the gap.

    A circle that meets the wall all around it has such a corner.
    """
    if end >= 0 and len(motions) == 2 and (motions[1].omega > known[end][0]) != known[end][1]:
        yield known[end]


def _at_edge(solver: Solver, omega: float) -> Motion:
    """The motion at which the gap is just filled."""
    (z,), (y,) = without_contact(solver, np.array([omega]))
    return solver.solved_at(omega, z, y, max(float(np.linalg.norm(z)), solver.least))


def _edge(motion: Motion, known: list[tuple[float, bool]]) -> int:
    """Where a motion that left contact came into the gap."""
    upwards = motion.tangent[-1] > 0
    ends = [i for i, (_, above) in enumerate(known) if above != upwards] or range(len(known))
    return min(ends, key=lambda i: abs(known[i][0] - motion.omega))


def _whole(solver: Solver, omega: np.ndarray, ended: list[float]) -> Iterator[_Link]:
    """The curve of greases that are not linear in the gap, from below and, if it does not get through, from above."""
    low, high = omega[0] * (1 - MARGIN), omega[-1] * (1 + MARGIN)
    for start, stop, ends in ((low, high, (LOW, HIGH)), (high, low, (HIGH, LOW))):
        motions: list[Motion] = []
        end = BROKEN
        try:
            for motion in solver.within(solver.first(start), low, high, stop > start, MAX_MOTIONS):
                motions.append(motion)
            end = LOW if motions[-1].omega < (low + high) / 2 else HIGH
        except NoConvergence as failed:
            ended.append(failed.args[0])
        if end == ends[0] and len(motions) > 2:
            motions, end = _until_return(motions, end, ended)
        yield _link((ends[0], end), motions, omega)
        if end == ends[1]:
            return


def _walk(left: list[_Link], start: int) -> list[_Link]:
    """Take stretches from a list, one after the other from an end of the range on, each turned the way that is gone."""
    found: list[_Link] = []
    at = start
    while at >= 0 or (not found and at != BROKEN):
        if (link := next((link for link in left if at in link.ends), None)) is None:
            break
        left.remove(link)
        found.append(link if link.ends[0] == at else _reversed(link))
        at = found[-1].ends[1]
    return found


def _reversed(link: _Link) -> _Link:
    return _Link(link.ends[::-1], link.vibrations[::-1], link.folds)


def _link(ends: tuple[int, int], motions: list[Motion], omega: np.ndarray) -> _Link:
    """Motions that follow each other, as vibrations at the frequencies that they pass.

    Between two motions go cubic parabolas along their tangents (Hermite).
    """
    if len(motions) < 2:
        return _Link(ends, Vibrations(np.zeros(0, dtype=int), *np.zeros((2, 0, 0, 0))))
    w, z, y, _, direction, scale = Motions.of(motions)
    of_z, of_w = direction[:, :-1].reshape(z.shape) * scale[:, None, None], direction[:, -1] * w
    length = np.array([np.linalg.norm(difference(a, b)) for a, b in zip(motions, motions[1:])])
    # A tangent is of length 1 in the units of its own motion; what is passed is measured in those of the first.
    later = np.sqrt(np.sum(of_z[1:] ** 2, axis=(1, 2)) / scale[:-1] ** 2 + (of_w[1:] / w[:-1]) ** 2)
    bends = np.stack((length, length / later))
    s = np.arange(PARTS) / PARTS
    fine = np.append(
        _hermite(w[:-1, None], w[1:, None], (bends[0] * of_w[:-1])[:, None], (bends[1] * of_w[1:])[:, None], s), w[-1]
    )
    low, high = np.minimum(fine[:-1], fine[1:]), np.maximum(fine[:-1], fine[1:])
    first, last = np.searchsorted(omega, low), np.searchsorted(omega, high)
    part = np.repeat(np.arange(low.size), last - first)
    cell = np.concatenate([np.arange(a, b)[:: 1 if up else -1] for a, b, up in zip(first, last, np.diff(fine) > 0)])
    share = (part % PARTS + (omega[cell] - fine[part]) / (fine[part + 1] - fine[part])) / PARTS
    i, share = part // PARTS, share[:, None, None]
    bent = bends[:, i, None, None]
    found = _hermite(z[i], z[i + 1], bent[0] * of_z[i], bent[1] * of_z[i + 1], share)
    vibrations = Vibrations(cell.astype(int), found, y[i] + share * (y[i + 1] - y[i]))
    return _Link(ends, vibrations, tuple(_folds(fine)))


def _hermite(a: ArrayLike, b: ArrayLike, at_a: ArrayLike, at_b: ArrayLike, s: np.ndarray) -> np.ndarray:
    """Return the cubic parabola from a to b with these derivatives, at shares of the way."""
    a, b, at_a, at_b = map(np.asarray, (a, b, at_a, at_b))
    rest = 1 - s
    return rest**2 * ((1 + 2 * s) * a + s * at_a) + s**2 * ((1 + 2 * rest) * b - rest * at_b)


def _folds(w: np.ndarray) -> Iterator[tuple[float, bool]]:
    """Where frequencies along a curve turn, by the parabola through three, and whether from up to down."""
    step = np.diff(w)
    turns = [
        (float(w[i + 1] - (w[i + 2] - w[i]) ** 2 / (8 * (step[i + 1] - step[i]))), bool(step[i] > 0))
        for i in np.flatnonzero(step[:-1] * step[1:] < 0)
    ]
    while len(turns) > 1:
        closest = min(range(len(turns) - 1), key=lambda i: abs(turns[i + 1][0] - turns[i][0]))
        if abs(turns[closest + 1][0] / turns[closest][0] - 1) > SAME_FOLD:
            break
        del turns[closest : closest + 2]
    yield from turns


def _joined(solver: Solver, links: list[_Link], known: Vibrations | None = None) -> Vibrations:
    """The vibrations of stretches behind those known already, those that several have once."""
    k = 2 * solver.harmonics + 1
    known = known or Vibrations(
        np.zeros(0, dtype=int), np.zeros((0, solver.size // k, k)), np.zeros((0, solver.rows, k))
    )  # fmt: skip
    for link in links:
        new = link.vibrations
        if not new.cell.size:
            continue
        new = new[np.array([not _holds(known, new.cell[i], new.z[i]) for i in range(new.cell.size)])]
        known = Vibrations(
            np.concatenate((known.cell, new.cell)), np.concatenate((known.z, new.z)), np.concatenate((known.y, new.y))
        )
    return known


def _holds(known: Vibrations, cell: int, z: np.ndarray) -> bool:
    there = known.z[known.cell == cell]
    size = max(float(np.linalg.norm(z[:, 1:])), SAG * float(np.linalg.norm(z)))
    return bool(there.size and np.any(np.linalg.norm(there - z, axis=(1, 2)) < SAME * size))
