"""Drives inside actuators in MJX: the formulas of `drive_loop`, as functions of arrays over a model's drives."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from .drives import ANGLE, BEGUN, BRISTLES, DRIVE, INPUT, MOTOR_TORQUE, SPEED, drives
from .packages import naming_package

with naming_package("functions for MJX", "clearance-mj[mjx]"):
    import jax
    from jax import numpy as jp

__all__ = ["Drives", "drives_of"]

_LARGEST_CONTROL = 1e10  # above which MuJoCo takes a control for an error
_CLAMP_OFF = int(mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Drives:
    """Drives inside the actuators of a model; gains, gears and ranges of these are in its ``actuator_`` fields."""

    numbers: dict[str, Any]
    """(n,) each, by the names of `drives.DRIVE`"""
    hysteresis: Any
    """(n, m, 2) stiffness and force of its elements, zero where a drive has fewer than others"""
    names: tuple[str, ...] = field(metadata={"static": True})
    actuators: tuple[int, ...] = field(metadata={"static": True})

    @property
    def size(self) -> int:
        """Length of each drive's state: as in `drives`, with the largest number of hysteresis elements."""
        return BRISTLES + 2 + int(self.hysteresis.shape[-2])

    def turn(self, mx: Any, dx: Any, state: Any) -> tuple[Any, Any]:
        """Advance the state (n, size) of drives by a step; return it and the actuators' forces (n,)."""
        index, numbers, h = np.array(self.actuators, dtype=int), self.numbers, mx.opt.timestep
        gear, begun = _take(mx.actuator_gear, index)[:, 0], state[:, BEGUN] != 0
        length, velocity = _take(dx.actuator_length, index), _take(dx._impl.actuator_velocity, index)
        load, load_speed = length / gear, velocity / gear
        angle = jp.where(begun, state[:, ANGLE], load)
        speed = jp.where(begun, state[:, SPEED], load_speed)
        at_motor = numbers["encoder"] == 0
        length, velocity = jp.where(at_motor, gear * angle, length), jp.where(at_motor, gear * speed, velocity)
        actuator_input, after_input = self._input(mx, dx, state[:, INPUT], index)
        force, braking = _motor_force(mx, index, actuator_input, length, velocity)
        motor, braking = gear * force, jp.where(at_motor, gear**2 * braking, 0.0)

        deflection, closing, gap, k, c = angle - load, speed - load_speed, numbers["gap"], numbers["k"], numbers["c"]
        up = jp.maximum(k * (deflection - gap) + c * closing, 0.0)
        down = jp.minimum(k * (deflection + gap) + c * closing, 0.0)
        torque = jp.where(deflection > gap, up, jp.where(deflection < -gap, down, 0.0))
        torque = jp.where(gap == 0, k * deflection + c * closing, torque)
        step = jp.where(begun, h, 0.0)
        stiffness, forces = self.hysteresis[..., 0], self.hysteresis[..., 1]
        slip = forces / jp.where(stiffness > 0, stiffness, 1.0)
        hysteresis = jp.clip(state[:, BRISTLES + 1 : -1] + (step * closing)[:, None], -slip, slip)
        torque += (stiffness * hysteresis).sum(axis=-1)

        largest, smallest = _slip_limits(numbers, speed, motor, torque)
        friction_k = numbers["friction_k"]
        bristle = jp.clip(state[:, BRISTLES] + step * speed, smallest / friction_k, largest / friction_k)
        friction = jp.clip(friction_k * bristle + numbers["friction_c"] * speed, smallest, largest)
        viscous = numbers["friction_viscous"]
        acceleration = (motor - torque - friction - viscous * speed) / (numbers["inertia"] + h * (viscous + braking))
        new_speed = speed + h * acceleration

        output = torque / gear
        state_values = {
            ANGLE: angle + h * new_speed, SPEED: new_speed, MOTOR_TORQUE: motor - braking * (new_speed - speed),
            BEGUN: jp.ones_like(new_speed), INPUT: after_input, BRISTLES: bristle,
        }  # fmt: skip
        first = jp.stack([state_values[i] for i in range(BRISTLES + 1)], axis=1)
        return jp.concatenate((first, hysteresis, output[:, None]), axis=1), output

    def controls(self, ctrl: Any, exerted: Any) -> Any:
        """Return controls in which those of the drives' actuators are replaced by their forces."""
        is_drive = np.isin(np.arange(len(ctrl)), self.actuators)
        order = np.clip(np.searchsorted(self.actuators, np.arange(len(ctrl))), 0, len(self.actuators) - 1)
        return jp.where(is_drive, _take(exerted, order), ctrl)  # scatter is slow

    def _input(self, mx: Any, dx: Any, activation: Any, index: np.ndarray) -> tuple[Any, Any]:
        """Return the inputs of the motors' gains, and the next activations of the original actuators."""
        control, h = _take(dx.ctrl, index), mx.opt.timestep
        control = jp.where(jp.abs(control) <= _LARGEST_CONTROL, control, 0.0)
        if not mx.opt.disableflags & _CLAMP_OFF:
            limited, limits = _take(mx.actuator_ctrllimited, index).astype(bool), _take(mx.actuator_ctrlrange, index)
            control = jp.where(limited, jp.clip(control, limits[:, 0], limits[:, 1]), control)
        dynamics, tau = self.numbers["dynamics"], jp.maximum(_take(mx.actuator_dynprm, index)[:, 0], 1e-15)
        time_constant = jp.where(dynamics == 2, tau, h / -jp.expm1(-h / tau))
        rate = jp.where(dynamics > 1, (control - activation) / time_constant, control)
        after, limits = activation + h * rate, _take(mx.actuator_actrange, index)
        after = jp.where(limits[:, 0] < limits[:, 1], jp.clip(after, limits[:, 0], limits[:, 1]), after)
        actuator_input = jp.where(self.numbers["early"] != 0, after, activation)
        return jp.where(dynamics == 0, control, actuator_input), jp.where(dynamics == 0, activation, after)


def drives_of(model: mujoco.MjModel) -> Drives:
    """Return the drives inside a model's actuators."""
    placed = sorted(drives(model), key=lambda drive: drive.actuator)
    numbers = {name: jp.array([float(drive.numbers(model)[name]) for drive in placed]) for name in DRIVE.names or ()}
    elements = np.zeros((len(placed), max((drive.hysteresis for drive in placed), default=0), 2))
    for row, drive in zip(elements, placed):
        row[: drive.hysteresis] = drive.hysteresis_elements(model)
    names, actuators = tuple(drive.name for drive in placed), tuple(drive.actuator for drive in placed)
    return Drives(numbers, jp.array(elements), names, actuators)


def _take(values: Any, indices: np.ndarray) -> Any:
    """Return values at indices, by a slice where these are consecutive, which is faster."""
    if len(indices) and np.array_equal(indices, np.arange(indices[0], indices[0] + len(indices))):
        return values[int(indices[0]) : int(indices[-1]) + 1]
    return values[indices]


def _motor_force(mx: Any, actuators: np.ndarray, actuator_input: Any, length: Any, velocity: Any) -> tuple[Any, Any]:
    """Return the motors' forces, and the damping in them."""
    gain, bias = _take(mx.actuator_gainprm, actuators), _take(mx.actuator_biasprm, actuators)
    limits = _take(mx.actuator_forcerange, actuators)
    force = (gain[:, 0] + gain[:, 1] * length + gain[:, 2] * velocity) * actuator_input
    force += bias[:, 0] + bias[:, 1] * length + bias[:, 2] * velocity
    clipped = jp.where(limits[:, 0] < limits[:, 1], jp.clip(force, limits[:, 0], limits[:, 1]), force)
    return clipped, jp.where(clipped == force, jp.maximum(-(gain[:, 2] * actuator_input + bias[:, 2]), 0.0), 0.0)


def _slip_limits(numbers: dict[str, Any], speed: Any, motor: Any, torque: Any) -> tuple[Any, Any]:
    """Return the largest friction, forward and backward, at which rotors slip; see `DriveFriction`."""
    p = {name.removeprefix("friction_"): value for name, value in numbers.items()}
    load = -torque
    limit = p["coulomb"] + jp.abs(p["external"] * load - p["motor"] * motor)
    stribeck = p["stribeck"] + jp.abs(p["stribeck_external"] * load - p["stribeck_motor"] * motor)
    by_motor = jp.where(jp.abs(load) < jp.abs(motor), p["motor_square"] * load**2, 0.0)
    by_load = jp.where(jp.abs(load) > jp.abs(motor), p["external_square"] * motor**2, 0.0)
    stribeck += jp.where(load * motor < 0, by_motor + by_load, 0.0)
    limit += stribeck * jp.exp(-(jp.abs(speed / p["stribeck_speed"]) ** p["stribeck_exponent"]))
    driven, driving = p["loss_forward"] * jp.abs(torque), p["loss_backward"] * jp.abs(torque)
    forward = jp.where(torque >= 0, driven, driving)
    return limit + forward, forward - limit - driven - driving
