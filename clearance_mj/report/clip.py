"""Clips for animations: the shape of a shaft that rattles or whirls in its bushings, from a response."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..core.errors import ClearanceError
from ..rig import Rig
from ..rotors.whirling import clearance_places, spin_and_angle
from ..signals.response import Response
from ..structure import Shaft
from ..structure.base import is_rotation
from .deflection import deflection
from .outline import outline

__all__ = ["Clip", "clip"]

POINTS = 81  # of a shaft's line, to which its steps are added
DRAWN_LIFT, MAX_LIFT = 0.22, 0.4
"""largest drawn lift over the shaft's length: if no exaggeration is asked for, and at most"""
MIN_LIFT = 1e-4  # of the most: less cannot be seen
MAX_FRAMES = 600


@dataclass(frozen=True, eq=False)
class Clip:
    """Content of an animation."""

    rig: Rig  #: the rig
    time: np.ndarray  #: (n,) s, of the pictures
    position: np.ndarray  #: (n_x,) m, points of the shafts' lines
    shaft: np.ndarray  #: (n_x,) number of the shaft that each point is on
    lift: np.ndarray  #: (n, 2, n_x) displacement of these points along y and z from the unloaded shaft to the base, m
    force: np.ndarray  #: (n, n_rows) contact force, N, positive where the shaft presses upwards
    angle: np.ndarray  #: (n,) rad, of the shaft; 0 of one that does not turn
    trace_time: np.ndarray  #: (n_t,) s, of every sample from the first picture to the last
    trace: np.ndarray  #: (n_t, n_bushings) contact force of every sample, N; of a round clearance its size
    path: np.ndarray  #: (n_t, n_rows) m, place of the shaft's line in its clearances, see `rotors.clearance_places`
    exaggeration: float  #: how many times larger lifts and gaps are drawn than they are
    slow: float  #: how many times slower the motion is shown than it is
    rate: float  #: pictures per second

    @property
    def length(self) -> float:
        """Length from the start of the first shaft to the end of the last one, m."""
        first, last = self.rig.linear.span
        return last - first

    def lift_at(self, point: float | str, pictures: int | slice = slice(None)) -> np.ndarray:
        """Return the displacement (n, 2) of a point in pictures, m, along y and z."""
        shaft, x = self.rig.linear.place(point)
        on = self.shaft == shaft
        lift = self.lift[pictures][..., on]
        rows = [np.interp(x, self.position[on], row) for row in lift.reshape(-1, lift.shape[-1])]
        return np.reshape(rows, lift.shape[:-1])


def clip(rig: Rig, response: Response, start: float | None = None, seconds: float = 0.15, slow: float = 60.0,
         exaggeration: float | None = None, rate: float = 20.0) -> Clip:  # fmt: skip
    """Return the clip of a response from rest: ``seconds`` from ``start`` (s), ``slow`` times slower.

    Default: the strongest contact is in the middle, and lifts fill the picture. A ClearanceError says what could be
    shown of a rig and response, if what is asked for cannot.
    """
    shafts = rig.linear.shafts
    if not shafts:
        raise ClearanceError(
            f"rig {rig.name!r}: its structure has no shaft whose shape could be shown; clearance-mj "
            f"{'orbits' if rig.moves_across else 'motion'} draws the motion at the clearances"
        )
    if not rig.bushings:
        raise ClearanceError(f"rig {rig.name!r} has no bushings in which its shaft could rattle")
    count, lines = _count_pictures(seconds, slow, rate), [_line(shaft) for shaft in shafts]
    points = [f"{s.name}@{x!r}" if s.name else x for s, line in zip(shafts, lines) for x in line.tolist()]
    lift = deflection(rig, response, points)
    lift = lift if rig.moves_across else np.stack((np.zeros_like(lift), lift), axis=1)
    first, last = _window(response, start, seconds)
    shown, trace = np.linspace(first, last, count).round().astype(int), slice(first, last + 1)
    left, right = rig.linear.span
    gaps = [b.gap for b in rig.bushings if not is_rotation(b.position)]
    largest = float(max([np.hypot(*lift[trace].transpose(1, 0, 2)).max(), *gaps]))
    contact, angle = np.asarray(response.contact_force), spin_and_angle(rig, response)[1]
    sizes = [np.hypot(*contact[rows]) if rows.stop - rows.start == 2 else contact[rows.start]
             for rows in rig.clearance_rows]  # fmt: skip
    return Clip(
        rig, response.time[shown], np.concatenate(lines), np.repeat(np.arange(len(shafts)), [x.size for x in lines]),
        lift[shown], contact.T[shown], np.zeros(count) if angle is None else angle[shown], response.time[trace],
        np.stack(sizes, axis=1)[trace], clearance_places(rig, response).T[trace],
        _exaggeration(exaggeration, largest, right - left), slow, rate,
    )  # fmt: skip


def _exaggeration(requested: float | None, largest: float, length: float) -> float:
    """Return how many times larger the largest lift (m) of shafts of a length (m) is drawn; refuses what cannot be."""
    exaggeration = float(f"{DRAWN_LIFT * length / largest:.2g}") if requested is None else requested
    most = MAX_LIFT * length / largest
    if not MIN_LIFT * most <= exaggeration <= most:
        raise ClearanceError(
            f"exaggeration {exaggeration:g}: must be {MIN_LIFT * most:.3g} to {most:.3g}, at which the largest lift, "
            f"{1e3 * largest:.3g} mm, is drawn as {MAX_LIFT:g} of the shaft's length"
        )
    return exaggeration


def _line(shaft: Shaft) -> np.ndarray:
    """Return (n_x,) points of a shaft, close on both sides of every step."""
    steps = np.unique(outline(shaft)[0])[1:-1]
    near = 1e-9 * (shaft.end - shaft.start)
    return np.sort(np.concatenate((np.linspace(shaft.start, shaft.end, POINTS), steps - near, steps + near)))


def _count_pictures(seconds: float, slow: float, rate: float) -> int:
    """Return the number of pictures."""
    for name, value in (("seconds", seconds), ("slow", slow), ("rate", rate)):
        if not 0 < value < math.inf:
            raise ClearanceError(f"{name} {value:g}: must be above 0")
    count = seconds * slow * rate
    if not 1.5 < count < MAX_FRAMES + 0.5:
        raise ClearanceError(
            f"{seconds:g} s shown {slow:g} times slower are {count:.6g} pictures at {rate:g} per second; from 2 to "
            f"{MAX_FRAMES} can be shown"
        )
    return round(count)


def _window(response: Response, start: float | None, seconds: float) -> tuple[int, int]:
    """Return the first and the last sample that is shown."""
    if seconds > response.duration:
        raise ClearanceError(f"{seconds:g} s cannot be shown of a response of {response.duration:g} s")
    if start is None:
        strongest = np.argmax(np.abs(np.asarray(response.contact_force)).max(axis=0)) / response.fs
        start = np.clip(strongest - seconds / 2, 0, response.duration - seconds)
    if not 0 <= start <= response.duration - seconds + 0.5 / response.fs:
        raise ClearanceError(
            f"start {start:g} s: with {seconds:g} s shown of {response.duration:g} s it must be in 0 to "
            f"{response.duration - seconds:g} s"
        )
    last = response.excitation.shape[-1] - 1
    return min(round(start * response.fs), last - 1), min(round((start + seconds) * response.fs), last)
