"""The right-hand sides of commonroad-vehicle-models, compiled.

The library's source is compiled, not copied: in each of its functions the callees are replaced by compiled ones, and
the tyres' formulas by ones with fewer operations (`magic_formula`). Parameters become records, which
compiled code reads as the library reads its objects.

The tyres' lateral shifts are zeroed. As shipped they jump with the sign of the camber, so that the multi-body model
drives no straight line but limit-cycles by 10 mm at 72 km/h and 27 mm at 120 km/h.
"""

from __future__ import annotations

import dataclasses
import functools
import types
from collections.abc import Callable
from typing import Any

import numpy as np
import vehiclemodels.vehicle_dynamics_mb as multi_body_module
import vehiclemodels.vehicle_dynamics_std as drift_module
from vehiclemodels.utils.vehicle_dynamics_ks_cog import vehicle_dynamics_ks_cog
from vehiclemodels.vehicle_parameters import VehicleParameters, setup_vehicle_parameters

from ..core.jit import STRICT, jit
from . import magic_formula

__all__ = ["GRAVITY", "SHIFT_PARAMETERS", "multi_body", "parameters", "single_track_drift"]

GRAVITY = 9.81  # Acceleration of gravity, m/s², the value that the library vehiclemodels uses.
SHIFT_PARAMETERS = ("p_hy1", "p_hy3", "p_vy1", "p_vy3", "r_hy1", "r_vy1", "r_vy3")
"""Tyre parameters that shift the lateral force."""


_read = functools.cache(setup_vehicle_parameters)


def parameters() -> VehicleParameters:
    """Return the library's parameters of vehicle 2, a BMW 320i, with the tyres' lateral shifts zeroed."""
    values = _read(2)
    return dataclasses.replace(values, tire=dataclasses.replace(values.tire, **dict.fromkeys(SHIFT_PARAMETERS, 0.0)))


def _numbers(values: object) -> dict[str, float]:
    """Return the numeric fields of a parameter object."""
    return {name: float(value) for name, value in vars(values).items() if isinstance(value, int | float)}


_EXAMPLE = parameters()
_PARTS = ("steering", "longitudinal", "tire")
_LAYOUT: list[tuple[str, Any]] = [(name, float) for name in _numbers(_EXAMPLE)]
_LAYOUT += [(part, [(name, float) for name in _numbers(getattr(_EXAMPLE, part))]) for part in _PARTS]


def compiled_parameters(values: VehicleParameters) -> np.ndarray:
    """Return the parameters as compiled code reads them, a record array (1,): its element has the library's names."""
    parts = (tuple(_numbers(getattr(values, part)).values()) for part in _PARTS)
    return np.array([(*_numbers(values).values(), *parts)], _LAYOUT)


def _compiled(function: types.FunctionType, **callees: object) -> Callable[..., Any]:
    """Return a compiled copy of a library function, with some of its callees replaced."""
    names = {**function.__globals__, **callees}
    copy = types.FunctionType(function.__code__, names, function.__name__, function.__defaults__)
    copy.__module__ = function.__module__
    # NumPy's error model: a wheel without load divides by zero and gives a motion that is not finite.
    return jit(copy, **STRICT)


_CALLEES = {
    name: _compiled(getattr(multi_body_module, name)) for name in ("steering_constraints", "acceleration_constraints")
}
_CALLEES["vehicle_dynamics_ks_cog"] = _compiled(vehicle_dynamics_ks_cog, **_CALLEES)

# f(x, u, p) of the multi-body model, 29 states, and of the single-track drift model, 9 states
multi_body = _compiled(multi_body_module.vehicle_dynamics_mb, tireModel=magic_formula, **_CALLEES)
single_track_drift = _compiled(drift_module.vehicle_dynamics_std, tire_model=magic_formula, **_CALLEES)
