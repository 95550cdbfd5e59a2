"""Where a turning shaft begins to whirl by itself: Hopf points of its equilibrium over the speed."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from ..core.errors import ClearanceError
from .condensed import Condensed, grid, slopes
from .continuation import NoConvergence
from .forces import Sampled, fill_forces
from .solver import AT_REST, Solver

__all__ = ["Hopf", "first_hopf", "rest_and_growth"]

SPEEDS = 60  # between which a change of stability is looked for
EXACT = 1e-9  # of the speed


class Hopf(NamedTuple):
    """Where an equilibrium loses its stability as the shaft turns faster."""

    speed: float  #: rad/s
    omega: float  #: 1/s, of the whirl that begins
    rest: np.ndarray  #: (n_rows, 1) places, m
    shape: np.ndarray  #: (n_rows,) complex, of the whirl


class _Rest(NamedTuple):
    place: np.ndarray  # (n_rows, 1)
    value: complex  # of the motion that grows fastest
    shape: np.ndarray  # (n_rows,)


def rest_and_growth(system: Condensed, speed: float) -> _Rest:
    """Return where a rig rests at a speed, rad/s, and the small motion about it that grows fastest, or dies slowest.

    Friction that slides goes on sliding, bristles that stick are springs.

    Raises
    ------
    NoConvergence
        If it does not rest.
    """
    model, laws, points = system.driven.model, system.laws, system.driven.points
    z, y = Solver(system.undriven, 0, AT_REST, speed).raised_to_loads(max(abs(speed), 1.0))
    place, functions = system.basis @ z + y, grid(0, AT_REST)
    motion = Sampled(np.tile(place, AT_REST), np.zeros((len(place), AT_REST)), max(abs(speed), 1.0), speed)
    about = slopes(laws, AT_REST, 0)
    fill_forces(
        laws, motion, functions.basis, functions.rate, functions.project, True, np.empty_like(motion.place), about
    )
    last = AT_REST - 1
    springs, dampers = np.zeros((2, model.size, model.size))
    for p, (width, rows) in enumerate(zip(laws.width.tolist(), laws.rows)):
        by_place, by_speed = about.x[p, :width, :width, last], about.v[p, :width, :width, last]
        if about.carried[p, last]:
            _, now_x, before_v, now_v = np.split(about.step[p, last, -width:, -4 * width :], 4, axis=1)
            by_place, by_speed = now_x, before_v + now_v
        moved = points[rows[:width]]
        springs += moved.T @ by_place @ moved
        dampers += moved.T @ by_speed @ moved
    small = dataclasses.replace(model, springs=model.springs + springs, coupling=model.coupling + dampers)
    found = small.poles(speed).vibrating
    if not found.value.size:
        return _Rest(place, -np.inf + 0j, np.zeros(len(points), dtype=complex))
    fastest = int(found.value.real.argmax())
    return _Rest(place, complex(found.value[fastest]), points @ found.motion[:, fastest])


def first_hopf(system: Condensed, ends: tuple[float, float]) -> Hopf:
    """Return where the equilibrium first loses its stability between two speeds, rad/s, from the first one on.

    Raises
    ------
    ClearanceError
        If it does not, or does not rest at any speed.
    """
    before: tuple[float, _Rest] | None = None
    reached = False
    for speed in np.linspace(*ends, SPEEDS):
        try:
            now = rest_and_growth(system, speed)
        except NoConvergence:
            before = None
            continue
        reached = True
        if before is not None and before[1].value.real < 0 < now.value.real:
            at = brentq(lambda s: rest_and_growth(system, s).value.real, before[0], speed, xtol=EXACT * max(ends))
            found = rest_and_growth(system, at)
            return Hopf(at, found.value.imag, found.place, found.shape)
        before = float(speed), now
    name = system.rig.name
    if not reached:
        raise ClearanceError(f"rig {name!r}: it comes to rest at no speed from {ends[0]:g} to {ends[1]:g} rad/s")
    state = "grows by itself" if before and before[1].value.real > 0 else "is stable"
    raise ClearanceError(
        f"rig {name!r}: no whirl begins between {ends[0]:g} and {ends[1]:g} rad/s; at the last speed rest {state}"
    )
