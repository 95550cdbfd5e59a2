"""The right-hand sides of commonroad-vehicle-models, compiled.

The library's own source is compiled, not copied: each of its functions is taken with the compiled ones in place of
those that it calls. Parameters become named tuples, which compiled code reads as the library reads its objects.

The tyres' lateral shifts are zeroed. As shipped they jump with the sign of the camber, so that the multi-body model
drives no straight line but limit-cycles by 10 mm at 72 km/h and 27 mm at 120 km/h.
"""

from __future__ import annotations

import dataclasses
import functools
import types
from collections import namedtuple
from collections.abc import Callable
from typing import Any

import numba
import vehiclemodels.utils.tire_model as tire_model
import vehiclemodels.vehicle_dynamics_mb as multi_body_module
import vehiclemodels.vehicle_dynamics_std as drift_module
from vehiclemodels.utils.vehicle_dynamics_ks_cog import vehicle_dynamics_ks_cog
from vehiclemodels.vehicle_parameters import VehicleParameters, setup_vehicle_parameters

__all__ = ["GRAVITY", "SHIFTS", "multi_body", "parameters", "single_track_drift"]

GRAVITY = 9.81
"""m/s², as in the library"""
SHIFTS = ("p_hy1", "p_hy3", "p_vy1", "p_vy3", "r_hy1", "r_vy1", "r_vy3")
"""Tyre parameters that shift the lateral force"""


_read = functools.cache(setup_vehicle_parameters)


def parameters() -> VehicleParameters:
    """The library's parameters of vehicle 2, a BMW 320i, with the tyres' lateral shifts zeroed."""
    values = _read(2)
    return dataclasses.replace(values, tire=dataclasses.replace(values.tire, **dict.fromkeys(SHIFTS, 0.0)))


def _numbers(values: object) -> dict[str, float]:
    """Fields of a parameter object that hold numbers."""
    return {name: float(value) for name, value in vars(values).items() if isinstance(value, int | float)}


def _record(name: str, *fields: str) -> Any:
    """Named tuple type; named at module level, so that the compiler's cache recognises it in the next process."""
    return namedtuple(name, fields)


_EXAMPLE = parameters()
Steering = _record("Steering", *_numbers(_EXAMPLE.steering))
Longitudinal = _record("Longitudinal", *_numbers(_EXAMPLE.longitudinal))
Tire = _record("Tire", *_numbers(_EXAMPLE.tire))
Parameters = _record("Parameters", "steering", "longitudinal", "tire", *_numbers(_EXAMPLE))


def compiled_parameters(values: VehicleParameters) -> tuple[Any, ...]:
    """Parameters as compiled code reads them."""
    steering, longitudinal = Steering(**_numbers(values.steering)), Longitudinal(**_numbers(values.longitudinal))
    return Parameters(steering, longitudinal, Tire(**_numbers(values.tire)), **_numbers(values))


def _compiled(function: types.FunctionType, **callees: object) -> Callable[..., Any]:
    """A function of the library, calling what is given in place of what its module names."""
    names = {**function.__globals__, **callees}
    copy = types.FunctionType(function.__code__, names, function.__name__, function.__defaults__)
    copy.__module__ = function.__module__
    # NumPy's error model: a wheel without load divides by zero, which shows as a motion that is not finite.
    return numba.njit(copy, cache=True, nogil=True, error_model="numpy")


_TIRE = types.ModuleType("tire")
_SIGN = _compiled(tire_model.sign)
for _name in ("formula_longitudinal", "formula_lateral", "formula_longitudinal_comb", "formula_lateral_comb"):
    setattr(_TIRE, _name, _compiled(getattr(tire_model, _name), sign=_SIGN))
_LIMITS = {
    name: _compiled(getattr(multi_body_module, name)) for name in ("steering_constraints", "acceleration_constraints")
}
_KINEMATIC = _compiled(vehicle_dynamics_ks_cog, **_LIMITS)

multi_body = _compiled(
    multi_body_module.vehicle_dynamics_mb, tireModel=_TIRE, vehicle_dynamics_ks_cog=_KINEMATIC, **_LIMITS
)
"""f(x, u, p) of the multi-body model, 29 states"""
single_track_drift = _compiled(
    drift_module.vehicle_dynamics_std, tire_model=_TIRE, vehicle_dynamics_ks_cog=_KINEMATIC, **_LIMITS
)
"""f(x, u, p) of the single-track drift model, 9 states"""
