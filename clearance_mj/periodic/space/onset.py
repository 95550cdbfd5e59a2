"""Where a turning shaft begins to whirl by itself: Hopf points of its equilibrium over the speed."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from ...core.errors import ClearanceError
from ..condensed import grid
from ..continuation import NoConvergence
from .condensed import RoundCondensed, round_slopes
from .forces import Sampled, fill_round_forces
from .solver import AT_REST, RoundSolver

__all__ = ["Hopf", "first_hopf", "rest_and_growth"]

SPEEDS = 60  # between which a change of stability is looked for
EXACT = 1e-9  # of the speed


class Hopf(NamedTuple):
    """Where an equilibrium loses its stability as the shaft turns faster."""

    speed: float  #: rad/s
    omega: float  #: 1/s, of the whirl that begins
    rest: np.ndarray  #: (2 n_points, 1) places, m
    shape: np.ndarray  #: (2 n_points,) complex, of the whirl


class _Rest(NamedTuple):
    place: np.ndarray  # (2 n_points, 1)
    value: complex  # of the motion that grows fastest
    shape: np.ndarray  # (2 n_points,)


def rest_and_growth(system: RoundCondensed, speed: float) -> _Rest:
    """Return where a rig rests at a speed, rad/s, and the small motion about it that grows fastest, or dies slowest.

    Friction that slides goes on sliding, bristles that stick are springs.

    Raises
    ------
    NoConvergence
        If it does not rest.
    """
    model, laws = system.driven.model, system.laws
    z, y = RoundSolver(system.undriven, 0, AT_REST, speed).raised_to_weight(max(abs(speed), 1.0))
    place, points = system.basis @ z + y, model.at_points
    count, functions = len(points) // 2, grid(0, AT_REST)
    slopes, shape = round_slopes(laws, count, AT_REST, 0), (count, 2, AT_REST)
    motion = Sampled(np.tile(place.reshape(count, 2, 1), AT_REST), np.zeros(shape), max(abs(speed), 1.0), speed)
    fill_round_forces(laws, motion, functions.basis, functions.rate, functions.project, True, np.empty(shape), slopes)
    last = AT_REST - 1
    by_place, by_speed = slopes.x[..., last].copy(), slopes.v[..., last].copy()
    for p in np.flatnonzero(slopes.carried[:, last]).tolist():
        force = slopes.step[p, last, -2:]
        by_place[p], by_speed[p] = force[:, -6:-4], force[:, -4:-2] + force[:, -2:]
    each = points.reshape(count, 2, -1)
    springs, dampers = (np.einsum("pan,pab,pbm->nm", each, by, each, optimize=True) for by in (by_place, by_speed))
    about = dataclasses.replace(model, springs=model.springs + springs, coupling=model.coupling + dampers)
    found = about.poles(speed).vibrating
    if not found.value.size:
        return _Rest(place, -np.inf + 0j, np.zeros(2 * count, dtype=complex))
    fastest = int(found.value.real.argmax())
    return _Rest(place, complex(found.value[fastest]), points @ found.motion[:, fastest])


def first_hopf(system: RoundCondensed, ends: tuple[float, float]) -> Hopf:
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
