"""The frequency response at one level: contact-free stretches in closed form, arcs with contact by continuation.

Without contact the vibration of linear greases is known in closed form; the curve leaves it where the gap is filled and
returns to it at another such frequency. Gaps and arcs in turn make up the whole curve, from the lowest frequency to the
highest one, and detached loops.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .continuation import Motions, NoConvergence, PeriodicMotion, difference, first_half
from .in_gap import edges, gap_ratio, linear_in_gap, without_contact
from .solver import Solver

__all__ = ["ArcVibrations", "LevelCurve", "curve"]

LOW, HIGH, BROKEN = -1, -2, -3
"""Kinds of end of an arc that does not end where the gap is filled: at the range's lowest or highest frequency, or
where the continuation failed."""
PARTS = 8  # points of an arc's interpolation between two motions
MAX_MOTIONS = 2000  # motions of an arc: a longer one winds through turns that no sweep resolves
MARGIN = 1e-6  # fraction of the frequency by which arcs go beyond the range
SAME = 1e-2  # difference over the vibration below which two motions at one frequency are the same
SAG = 1e-2  # ratio to the mean below which a vibration is not resolved well enough to tell two from each other
SAME_FOLD = 3e-4  # relative distance in frequency below which a map does not resolve two folds


class ArcVibrations(NamedTuple):
    """Vibrations of one stretch of the curve, in its order."""

    cell: np.ndarray  #: (m,) index of the frequency
    z: np.ndarray  #: (m, r, K) harmonics of the coordinates, m
    y: np.ndarray  #: (m, n_points, K) of the displacements outside the basis, m

    def selected(self, which: np.ndarray | slice) -> ArcVibrations:
        """Return the vibrations at some indices."""
        return ArcVibrations(*(part[which] for part in self))


class LevelCurve(NamedTuple):
    """The vibrations at one level over frequency."""

    order: ArcVibrations
    """from the lowest frequency along the curve to the highest one"""
    detached: ArcVibrations
    """of detached loops that a sweep does not reach"""
    folds: tuple[tuple[float, bool], ...]
    """1/s, and True if an upward sweep jumps there, False if a downward one"""
    ended: tuple[float, ...]
    """1/s: where the continuation failed"""


@dataclass(frozen=True, eq=False)
class _Link:
    """A stretch of the curve between two of its ends."""

    ends: tuple[int, int]
    vibrations: ArcVibrations
    folds: tuple[tuple[float, bool], ...] = ()


def curve(solver: Solver, omega: np.ndarray) -> LevelCurve:
    """Return the vibrations at increasing frequencies, 1/s, of an excitation with one harmonic.

    The frequency may be that of the turning, whose speed then changes along the curve.
    """
    ended: list[float] = []
    if linear_in_gap(solver):
        known = edges(solver, omega)
        links = [*_contact_free_links(solver, omega, known), *_contact_links(solver, omega, known, ended)]
    else:
        links = list(_continued_links(solver, omega, ended))
    folds = tuple(fold for link in links for fold in link.folds)
    whole = list(links)
    up = _walk(links, LOW)
    down = _walk(links, HIGH)
    if up and up[-1].ends[1] == BROKEN and (other := _walk(whole, HIGH)) and other[-1].ends[1] == LOW:
        links, up, down = whole, [], other
    order = _merge(solver, [*up, *(_reverse(link) for link in reversed(down))])
    detached = _merge(solver, links, order).selected(slice(order.cell.size, None))
    return LevelCurve(order, detached, folds, tuple(ended))


def _contact_free_links(solver: Solver, omega: np.ndarray, known: list[tuple[float, bool]]) -> Iterator[_Link]:
    """Yield the stretches without contact, in closed form."""
    inside = gap_ratio(solver, omega) <= 1
    bounds = [LOW, *range(len(known)), HIGH]
    for left, right in zip(bounds, bounds[1:]):
        opens = left == LOW or not known[left][1]
        closes = right == HIGH or known[right][1]
        if not (opens and closes) or (left == LOW and right == HIGH and not inside.any()):
            continue
        low, high = -np.inf if left == LOW else known[left][0], np.inf if right == HIGH else known[right][0]
        cells = np.flatnonzero(inside & (omega > low) & (omega < high))
        yield _Link((left, right), ArcVibrations(cells, *without_contact(solver, omega[cells])))


def _contact_links(
    solver: Solver, omega: np.ndarray, known: list[tuple[float, bool]], ended: list[float]
) -> Iterator[_Link]:  # fmt: skip
    """Yield the stretches with contact, each from an end that no other one has reached."""
    low, high = omega[0] * (1 - MARGIN), omega[-1] * (1 + MARGIN)
    starts = [(i, above) for i, (_, above) in enumerate(known)]
    if gap_ratio(solver, omega[:1])[0] > 1:
        starts.insert(0, (LOW, True))
    if gap_ratio(solver, omega[-1:])[0] > 1:
        starts.append((HIGH, False))
    reached: set[int] = set()
    for start, up in starts:
        if start in reached:
            continue
        motions: list[PeriodicMotion] = []
        end = BROKEN
        try:
            first = solver.first(low if start == LOW else high) if start < 0 else _solve_edge(solver, known[start][0])
            for motion in solver.within(first, low, high, up, MAX_MOTIONS):
                if len(motions) > 1 and not solver.touches(motion) and solver.touches(motions[-1]):
                    end = _entered_edge(motion, known)
                    motion = _solve_edge(solver, known[end][0])
                motions.append(motion)
                if end != BROKEN:
                    break
            else:
                end = LOW if motions[-1].parameter < (low + high) / 2 else HIGH
        except NoConvergence as error:
            ended.append(error.args[0])
        reached.update((start, end))
        motions, end = _until_return(start, end, motions, ended)
        if motions:
            link = _link((start, end), motions, omega)
            corners = (*_corner_fold(start, known, motions[:2]), *_corner_fold(end, known, motions[:-3:-1]))
            yield replace(link, folds=(*_folds_off_corners(link.folds, corners), *corners))


def _until_return(
    start: int, end: int, motions: list[PeriodicMotion], ended: list[float]
) -> tuple[list[PeriodicMotion], int]:
    """Return motions and their end, cut where they turn back along themselves to their beginning, as at a corner."""
    if end != start or len(motions) < 3 or np.linalg.norm(difference(motions[0], motions[-1])) > SAME:
        return motions, end
    outward = first_half(motions)
    ended.append(outward[-1].parameter)
    return outward, BROKEN


def _folds_off_corners(
    folds: tuple[tuple[float, bool], ...], corners: tuple[tuple[float, bool], ...]
) -> Iterator[tuple[float, bool]]:
    """Yield the folds of an arc that are not its corners: rounding decides if a corner shows up as a fold too."""
    for omega, up in folds:
        if not any(up == other and abs(omega / at - 1) < SAME_FOLD for at, other in corners):
            yield omega, up


def _corner_fold(
    end: int, known: list[tuple[float, bool]], motions: list[PeriodicMotion]
) -> Iterator[tuple[float, bool]]:
    """Yield the fold where the gap is filled, if the arc's first two motions go back next to the vibration in the gap.

    A circle that meets the wall all around it has such a corner.
    """
    if end >= 0 and len(motions) == 2 and (motions[1].parameter > known[end][0]) != known[end][1]:
        yield known[end]


def _solve_edge(solver: Solver, omega: float) -> PeriodicMotion:
    """Return the motion that just fills the gap."""
    (z,), (y,) = without_contact(solver, np.array([omega]))
    return solver.solved_at(omega, z, y, solver.scale_of(z))


def _entered_edge(motion: PeriodicMotion, known: list[tuple[float, bool]]) -> int:
    """Return the index of the frequency at which a motion that lost contact has entered the gap."""
    upwards = motion.tangent[-1] > 0
    ends = [i for i, (_, above) in enumerate(known) if above != upwards] or range(len(known))
    return min(ends, key=lambda i: abs(known[i][0] - motion.parameter))


def _continued_links(solver: Solver, omega: np.ndarray, ended: list[float]) -> Iterator[_Link]:
    """Yield the curve of greases that are nonlinear in the gap, from below and, if that fails, from above."""
    low, high = omega[0] * (1 - MARGIN), omega[-1] * (1 + MARGIN)
    for start, stop, ends in ((low, high, (LOW, HIGH)), (high, low, (HIGH, LOW))):
        motions: list[PeriodicMotion] = []
        end = BROKEN
        try:
            for motion in solver.within(solver.first(start), low, high, stop > start, MAX_MOTIONS):
                motions.append(motion)
            end = LOW if motions[-1].parameter < (low + high) / 2 else HIGH
        except NoConvergence as error:
            ended.append(error.args[0])
        motions, end = _until_return(ends[0], end, motions, ended)
        yield _link((ends[0], end), motions, omega)
        if end == ends[1]:
            return


def _walk(remaining: list[_Link], start: int) -> list[_Link]:
    """Take consecutive stretches from a list, from one end of the range on, each oriented along the walk."""
    chain: list[_Link] = []
    at = start
    while at >= 0 or (not chain and at != BROKEN):
        if (link := next((link for link in remaining if at in link.ends), None)) is None:
            break
        remaining.remove(link)
        chain.append(link if link.ends[0] == at else _reverse(link))
        at = chain[-1].ends[1]
    return chain


def _reverse(link: _Link) -> _Link:
    return _Link(link.ends[::-1], link.vibrations.selected(slice(None, None, -1)), link.folds)


def _link(ends: tuple[int, int], motions: list[PeriodicMotion], omega: np.ndarray) -> _Link:
    """Interpolate consecutive motions at the frequencies that they pass, by Hermite's cubics along their tangents."""
    if len(motions) < 2:
        return _Link(ends, ArcVibrations(np.zeros(0, dtype=int), *np.zeros((2, 0, 0, 0))))
    w, z, y, _, direction, scale = Motions.of(motions)
    dz, dw = direction[:, :-1].reshape(z.shape) * scale[:, None, None], direction[:, -1] * w
    length = np.array([np.linalg.norm(difference(a, b)) for a, b in zip(motions, motions[1:])])
    # A tangent has length 1 in the units of its motion; the arc length is measured in those of the first.
    next_length = np.sqrt(np.sum(dz[1:] ** 2, axis=(1, 2)) / scale[:-1] ** 2 + (dw[1:] / w[:-1]) ** 2)
    bends = np.stack((length, length / next_length))
    s = np.arange(PARTS) / PARTS
    fine = np.append(
        _hermite(w[:-1, None], w[1:, None], (bends[0] * dw[:-1])[:, None], (bends[1] * dw[1:])[:, None], s), w[-1]
    )
    low, high = np.minimum(fine[:-1], fine[1:]), np.maximum(fine[:-1], fine[1:])
    first, last = np.searchsorted(omega, low), np.searchsorted(omega, high)
    interval = np.repeat(np.arange(low.size), last - first)
    cell = np.concatenate([np.arange(a, b)[:: 1 if up else -1] for a, b, up in zip(first, last, np.diff(fine) > 0)])
    fraction = (interval % PARTS + (omega[cell] - fine[interval]) / (fine[interval + 1] - fine[interval])) / PARTS
    i, fraction = interval // PARTS, fraction[:, None, None]
    bent = bends[:, i, None, None]
    harmonics = _hermite(z[i], z[i + 1], bent[0] * dz[i], bent[1] * dz[i + 1], fraction)
    vibrations = ArcVibrations(cell.astype(int), harmonics, y[i] + fraction * (y[i + 1] - y[i]))
    return _Link(ends, vibrations, tuple(_folds(fine)))


def _hermite(a: ArrayLike, b: ArrayLike, at_a: ArrayLike, at_b: ArrayLike, s: np.ndarray) -> np.ndarray:
    """Return the cubic polynomial from a to b with these derivatives, at fractions s of the interval."""
    a, b, at_a, at_b = map(np.asarray, (a, b, at_a, at_b))
    t = 1 - s
    return t**2 * ((1 + 2 * s) * a + s * at_a) + s**2 * ((1 + 2 * t) * b - t * at_b)


def _folds(w: np.ndarray) -> Iterator[tuple[float, bool]]:
    """Yield frequencies of folds, by the parabola through three points, and True where they turn from up to down."""
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


def _merge(solver: Solver, links: list[_Link], known: ArcVibrations | None = None) -> ArcVibrations:
    """Append the vibrations of stretches to the known ones, without duplicates."""
    k = 2 * solver.harmonics + 1
    known = known or ArcVibrations(
        np.zeros(0, dtype=int), np.zeros((0, solver.size // k, k)), np.zeros((0, solver.rows, k))
    )  # fmt: skip
    for link in links:
        new = link.vibrations
        if not new.cell.size:
            continue
        new = new.selected(np.array([not _contains(known, cell, z) for cell, z in zip(new.cell, new.z)]))
        known = ArcVibrations(*map(np.concatenate, zip(known, new)))
    return known


def _contains(known: ArcVibrations, cell: int, z: np.ndarray) -> bool:
    z_at_cell = known.z[known.cell == cell]
    size = max(float(np.linalg.norm(z[:, 1:])), SAG * float(np.linalg.norm(z)))
    return bool(z_at_cell.size and np.any(np.linalg.norm(z_at_cell - z, axis=(1, 2)) < SAME * size))
