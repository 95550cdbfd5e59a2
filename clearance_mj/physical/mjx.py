"""Friction, drives and laws by table in MJX, MuJoCo's engine for thousands of environments on a GPU.

Contacts, limits and backlash of constant stiffness and damping do not need this module: MJX follows the solver
parameters of the compiled model. `step` adds the forces of a `Softener`, as a function of arrays, for ``jax.jit``,
``jax.vmap`` and ``jax.grad``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import mujoco
import numpy as np

from ..core.errors import ModelError
from .accelerators import frictionless_copy
from .bristles import pairs_with_bristles
from .drives import ANGLE, MOTOR_TORQUE, SPEED, DriveState
from .mjx_drives import Drives, drives_of
from .mjx_friction import OF_PAIR, DryFriction, PairFriction, dry_friction, pair_friction
from .mjx_laws import TabulatedLaws, can_be_tabulated, tabulated_laws
from .packages import naming_package
from .softness import IMPEDANCE

with naming_package("functions for MJX", "clearance-mj[mjx]"):
    import jax
    import mujoco.mjx as mjx
    from jax import numpy as jp

__all__ = ["MjxParameters", "MjxState", "drive_state", "init", "pair_solref", "put_model", "step"]

_Dyn, _Gain, _Bias = mujoco.mjtDyn, mujoco.mjtGain, mujoco.mjtBias


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class MjxParameters:
    """Parameters of friction, drives and laws, all arrays: they may be traced, differentiated, differ by environment.

    ``dataclasses.replace`` changes them.
    """

    friction: DryFriction
    pairs: PairFriction
    drives: Drives
    laws: TabulatedLaws


class MjxState(NamedTuple):
    """State of friction, drives and laws."""

    friction: Any
    """(n,) deflections of the bristles of joints and tendons, rad or m"""
    pairs: Any
    """(n, 7) bristles of contacts: deflection, m, angle about the normal, rad, and angles rolled, rad"""
    drives: Any
    """(n, size) of each drive, as the actuator's activation on a CPU"""
    begun: Any
    """1 from the first step on; before, bristles do not deflect"""
    laws: Any
    """(n,) amplitudes of the laws, rad or m"""


def put_model(model: mujoco.MjModel) -> tuple[Any, MjxParameters]:
    """Return a compiled model for MJX, and the parameters of its friction, drives and laws.

    Pairs with bristles become frictionless there. Actuators with drives have no activation there, and ``mjx.step``
    refuses them.

    Parameters
    ----------
    model : mujoco.MjModel
        Compiled with `compile`; not changed.

    Returns
    -------
    tuple
        A ``mujoco.mjx.Model`` and its `MjxParameters`.

    Raises
    ------
    ModelError
        For laws other than tables of a limit's k and c, integrator RK4, contacts without MuJoCo's friction in an
        elliptic cone, and drives of a model whose actuation is disabled.
    """
    engine_model, activations = _engine_model(model)
    parameters = MjxParameters(dry_friction(model), pair_friction(model), drives_of(model), tabulated_laws(model))
    drive_actuators = np.array(parameters.drives.actuators, dtype=int)
    mx, has_drive = mjx.put_model(engine_model, impl="jax"), np.isin(np.arange(model.nu), drive_actuators)
    count = np.where(has_drive, 0, model.actuator_actnum)
    first = np.where(count > 0, np.cumsum(count) - count, -1)
    mx = mx.replace(
        na=len(activations), actuator_actnum=count, actuator_actadr=first, key_act=model.key_act[:, activations],
        actuator_dyntype=model.actuator_dyntype.copy(),
    )  # fmt: skip
    return mx, parameters


def init(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Any, MjxState]:
    """Return data for MJX, and the initial state of friction and drives for `step`.

    Drives are as in ``data.act``; bristles of friction begin undeflected.

    Parameters
    ----------
    model : mujoco.MjModel
        As given to `put_model`.
    data : mujoco.MjData
        Positions, velocities, controls, ...; not changed.

    Returns
    -------
    tuple
        A ``mujoco.mjx.Data`` and a `MjxState`.
    """
    engine_model, activations = _engine_model(model)
    engine_data, spec = mujoco.MjData(engine_model), int(mujoco.mjtState.mjSTATE_INTEGRATION)
    state = np.zeros(mujoco.mj_stateSize(model, spec))
    mujoco.mj_getState(model, data, state, spec)
    mujoco.mj_setState(engine_model, engine_data, state, spec)
    mujoco.mj_fwdPosition(engine_model, engine_data)
    mujoco.mj_fwdVelocity(engine_model, engine_data)
    dx, drives = mjx.put_data(engine_model, engine_data, impl="jax"), drives_of(model)
    acts = np.zeros((len(drives.actuators), drives.size))
    for row, actuator in zip(acts, drives.actuators):
        activation = data.act[model.actuator_actadr[actuator] :][: model.actuator_actnum[actuator]]
        row[: len(activation) - 1], row[-1] = activation[:-1], activation[-1]
    dry, pairs, laws = (len(builder(model).names) for builder in (dry_friction, pair_friction, tabulated_laws))
    dx = dx.replace(act=dx.act[activations], act_dot=dx.act_dot[activations])
    return dx, MjxState(jp.zeros(dry), jp.zeros((pairs, OF_PAIR)), jp.array(acts), jp.zeros(()), jp.zeros(laws))


def step(mx: Any, parameters: MjxParameters, dx: Any, state: MjxState) -> tuple[Any, MjxState]:
    """Step as ``mujoco.mjx.step``, with friction, drives and laws.

    Forces of friction are among ``qfrc_passive``, those of drives are ``actuator_force`` and in ``qfrc_actuator``.

    Parameters
    ----------
    mx : mujoco.mjx.Model
        Of `put_model`; stiffness and damping of contacts are its ``pair_solref``, see `pair_solref`.
    parameters : Parameters
        Of `put_model`, or others of the same shapes.
    dx : mujoco.mjx.Data
        Of `init`, or of the step before.
    state : State
        Of `init`, or of the step before.

    Returns
    -------
    tuple
        Data and state after the step.
    """
    drive_actuators = np.array(parameters.drives.actuators, dtype=int)
    engine_model = _motor_model(mx, drive_actuators)
    dx = mjx.sensor_pos(engine_model, mjx.fwd_position(engine_model, dx))
    dx = mjx.sensor_vel(engine_model, mjx.fwd_velocity(engine_model, dx))
    h = mx.opt.timestep * state.begun
    bristles, pairs, acts, amplitudes, control = state.friction, state.pairs, state.drives, state.laws, dx.ctrl
    if parameters.laws.names:
        amplitudes, dx = parameters.laws.follow(mx, dx, amplitudes, h)
    if parameters.friction.names:
        bristles, dx = parameters.friction.rub(dx, bristles, h)
    if parameters.pairs.names:
        pairs, dx = parameters.pairs.rub(mx, dx, pairs, h)
    if len(drive_actuators):
        acts, forces = parameters.drives.turn(mx, dx, acts)
        dx = dx.replace(ctrl=parameters.drives.controls(control, forces))
    dx = mjx.fwd_acceleration(engine_model, mjx.fwd_actuation(engine_model, dx))
    if dx._impl.efc_J.size:
        dx = mjx.solve(engine_model, dx)
        dx = mjx.sensor_acc(engine_model, dx)
    else:
        dx = dx.replace(qacc=dx.qacc_smooth)
    euler = mx.opt.integrator == mujoco.mjtIntegrator.mjINT_EULER
    dx = (mjx.euler if euler else mjx.implicit)(engine_model, dx).replace(ctrl=control)
    return dx, MjxState(bristles, pairs, acts, jp.ones_like(state.begun), amplitudes)


def pair_solref(k: Any, c: Any, inverse_inertia: Any) -> Any:
    """Return solref (..., 2) of contacts with a stiffness and damping that may be traced.

    Parameters
    ----------
    k, c : array (...)
        N/m and N s/m.
    inverse_inertia : array (...)
        1/kg, of `clearance_mj.physical.inverse_inertia`.

    Returns
    -------
    array (..., 2)
        For ``mx.pair_solref`` with a ``pair_solimp`` of the impedance `IMPEDANCE`, which `contact` writes within
        5e-4: ``mx.replace(pair_solimp=mx.pair_solimp.at[:, :2].set(IMPEDANCE))`` makes it so.
    """
    return jp.stack(jp.broadcast_arrays(k, c), axis=-1) * (-(1 - IMPEDANCE) * jp.asarray(inverse_inertia)[..., None])


def drive_state(mx: Any, parameters: MjxParameters, state: MjxState, actuator: str) -> DriveState:
    """Return angle, speed and torques of a drive, as `clearance_mj.physical.drive_state` does of activations.

    Parameters
    ----------
    mx : mujoco.mjx.Model
        The model.
    parameters : Parameters
        Its parameters.
    state : State
        Of one environment and time, or of many.
    actuator : str
        Its name.

    Returns
    -------
    DriveState
        Arrays (...).

    Raises
    ------
    ModelError
        For an actuator without a drive.
    """
    ModelError.require_known("actuator", actuator, parameters.drives.names)
    i = parameters.drives.names.index(actuator)
    rows, gear = state.drives[..., i, :], mx.actuator_gear[..., parameters.drives.actuators[i], 0]
    return DriveState(rows[..., ANGLE], rows[..., SPEED], rows[..., MOTOR_TORQUE], rows[..., -1] * gear)


def _engine_model(model: mujoco.MjModel) -> tuple[mujoco.MjModel, np.ndarray]:
    """Return a copy of a model without bristles and drives, and the indices of the remaining activations."""
    if model.opt.cone == mujoco.mjtCone.mjCONE_ELLIPTIC and pairs_with_bristles(model):
        raise ModelError("MJX has no contacts without MuJoCo's friction in an elliptic cone; use cone pyramidal")
    variant, remaining = frictionless_copy(model, "MJX", can_be_tabulated), np.ones(model.na, dtype=bool)
    for i in drives_of(model).actuators:
        variant.actuator_dyntype[i], variant.actuator_gaintype[i] = int(_Dyn.mjDYN_NONE), int(_Gain.mjGAIN_FIXED)
        variant.actuator_biastype[i] = int(_Bias.mjBIAS_NONE)
        remaining[model.actuator_actadr[i] :][: model.actuator_actnum[i]] = False
    return variant, np.flatnonzero(remaining)


def _motor_model(mx: Any, actuators: np.ndarray) -> Any:
    """Return a model in which the force of a drive's actuator is its control."""
    if not len(actuators):
        return mx
    dynamics, limited = mx.actuator_dyntype.copy(), mx.actuator_ctrllimited.copy()
    dynamics[actuators], limited[actuators] = int(_Dyn.mjDYN_NONE), False
    gains = jp.asarray(mx.actuator_gainprm).at[actuators].set(0.0).at[actuators, 0].set(1.0)
    return mx.replace(actuator_dyntype=dynamics, actuator_ctrllimited=limited, actuator_gainprm=gains)
