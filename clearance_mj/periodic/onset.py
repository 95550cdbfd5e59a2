"""Onset speed of self-excited whirl: Hopf points of a turning shaft's equilibrium."""

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

__all__ = ["ShaftEquilibrium", "first_hopf", "rest_and_growth"]

SPEEDS = 60  # sampled for a change of stability
EXACT = 1e-9  # of the speed


class ShaftEquilibrium(NamedTuple):
    """Equilibrium of a turning shaft, and the motion about it that grows fastest."""

    speed: float  #: rad/s
    place: np.ndarray  #: (n_rows, 1) m
    value: complex  #: 1/s: growth rate, and frequency
    shape: np.ndarray  #: (n_rows,) complex, of this motion


def rest_and_growth(system: Condensed, speed: float) -> ShaftEquilibrium:
    """Return the equilibrium of a rig at a speed, rad/s, and its eigenvalue with the largest real part.

    Sliding friction stays sliding, sticking bristles are springs.

    Raises
    ------
    NoConvergence
        If there is no equilibrium.
    """
    model, laws, points = system.driven.model, system.laws, system.driven.points
    z, y = Solver(system.undriven, 0, AT_REST, speed).raised_to_loads(max(abs(speed), 1.0))
    place, derivatives = system.basis @ z + y, slopes(laws, AT_REST, 0)
    motion = Sampled(np.tile(place, AT_REST), np.zeros((len(place), AT_REST)), max(abs(speed), 1.0), speed)
    fill_forces(laws, motion, *grid(0, AT_REST)[:3], True, np.empty_like(motion.place), derivatives)
    last = AT_REST - 1
    springs, dampers = np.zeros((2, model.size, model.size))
    for p, (width, rows) in enumerate(zip(laws.width.tolist(), laws.rows)):
        by_place, by_speed = derivatives.x[p, :width, :width, last], derivatives.v[p, :width, :width, last]
        if derivatives.carried[p, last]:
            _, now_x, before_v, now_v = np.split(derivatives.step[p, last, -width:, -4 * width :], 4, axis=1)
            by_place, by_speed = now_x, before_v + now_v
        rows_of_point = points[rows[:width]]
        springs += rows_of_point.T @ by_place @ rows_of_point
        dampers += rows_of_point.T @ by_speed @ rows_of_point
    linearised = dataclasses.replace(model, springs=model.springs + springs, coupling=model.coupling + dampers)
    modes = linearised.poles(speed).vibrating
    if not modes.value.size:
        return ShaftEquilibrium(speed, place, -np.inf + 0j, np.zeros(len(points), dtype=complex))
    fastest = int(modes.value.real.argmax())
    return ShaftEquilibrium(speed, place, complex(modes.value[fastest]), points @ modes.motion[:, fastest])


def first_hopf(system: Condensed, ends: tuple[float, float]) -> ShaftEquilibrium:
    """Return the equilibrium at the first speed between two, rad/s, at which it loses its stability: a Hopf point.

    Raises
    ------
    ClearanceError
        If it stays stable, or there is no equilibrium at any speed.
    """
    before: ShaftEquilibrium | None = None
    rested = False
    for speed in np.linspace(*ends, SPEEDS):
        try:
            now = rest_and_growth(system, speed)
        except NoConvergence:
            before = None
            continue
        rested = True
        if before is not None and before.value.real < 0 < now.value.real:
            between = before.speed, now.speed
            onset = brentq(lambda s: rest_and_growth(system, s).value.real, *between, xtol=EXACT * max(ends))
            return rest_and_growth(system, onset)
        before = now
    name = system.rig.name
    if not rested:
        raise ClearanceError(f"rig {name!r}: it comes to rest at no speed from {ends[0]:g} to {ends[1]:g} rad/s")
    state = "grows by itself" if before and before.value.real > 0 else "is stable"
    raise ClearanceError(
        f"rig {name!r}: no whirl begins between {ends[0]:g} and {ends[1]:g} rad/s; at the last speed rest {state}"
    )
