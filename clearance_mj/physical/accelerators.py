"""Preparation of a compiled model for engines on accelerators: MJX and MuJoCo Warp."""

from __future__ import annotations

import copy
from collections.abc import Callable

import mujoco

from ..core.errors import ModelError
from .bristles import pairs_with_bristles
from .bushings import bushings_of
from .drives import drives
from .elements import KINDS, SoftElement, find, requested_softness
from .rotor_sensors import rotor_sensors

__all__ = ["frictionless_copy"]


def frictionless_copy(
    model: mujoco.MjModel, engine: str, can_follow: Callable[[mujoco.MjModel, SoftElement], bool] = lambda *_: False
) -> mujoco.MjModel:  # fmt: skip
    """Return a copy of a model in which contacts with bristles are frictionless.

    Parameters
    ----------
    model : mujoco.MjModel
        Compiled with `compile`; not changed.
    engine : str
        Its name, for messages.
    can_follow : callable
        Returns True if the engine can follow the law of an element.

    Returns
    -------
    mujoco.MjModel
        Equal but for the dimension of these contacts.

    Raises
    ------
    ModelError
        For what neither engine supports: laws, bushings, sensors of rotors, integrator RK4, and drives of a model whose
        actuation is disabled.
    """
    for element in requested_softness(model):
        if element.softness.law and not can_follow(model, element):
            raise ModelError(
                f'{KINDS[element.kind].noun} "{element.name}" follows a law, which cannot be in {engine}; constant k '
                "and c, friction and drives can, and in MJX tables of k and c over amplitude or time at joints and "
                "tendons"
            )
    for bushing in bushings_of(model):
        raise ModelError(f'bushing "{bushing.name}" acts within a Softener alone, not in {engine}')
    for sensor in rotor_sensors(model):
        raise ModelError(f'sensor "{sensor.name}" is filled in by a Softener alone, not in {engine}; use drive_state()')
    if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
        raise ModelError("integrator RK4 asks for forces between the steps; use Euler or implicitfast")
    if model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_ACTUATION and any(drives(model)):
        raise ModelError("flag actuation is disabled, so drives exert nothing; enable it")
    variant = copy.copy(model)
    for name in pairs_with_bristles(model):
        variant.pair_dim[find(model, "pair", name)] = 1
    return variant
