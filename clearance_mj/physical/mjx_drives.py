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

_WORST = 1e10  # from which on MuJoCo takes a control for an error
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
        """How many numbers the state of each has: those of `drives`, up to most elements of hysteresis, and torque."""
        return BRISTLES + 2 + int(self.hysteresis.shape[-2])

    def turn(self, mx: Any, dx: Any, state: Any) -> tuple[Any, Any]:
        """Let drives in a state (n, size) turn by a step; return it and what their actuators exert (n,)."""
        here, numbers, h = np.array(self.actuators, dtype=int), self.numbers, mx.opt.timestep
        gear, begun = _taken(mx.actuator_gear, here)[:, 0], state[:, BEGUN] != 0
        length, velocity = _taken(dx.actuator_length, here), _taken(dx._impl.actuator_velocity, here)
        load, load_speed = length / gear, velocity / gear
        angle = jp.where(begun, state[:, ANGLE], load)
        speed = jp.where(begun, state[:, SPEED], load_speed)
        at_motor = numbers["encoder"] == 0
        length, velocity = jp.where(at_motor, gear * angle, length), jp.where(at_motor, gear * speed, velocity)
        entered, after_input = self._input(mx, dx, state[:, INPUT], here)
        force, braking = _motor(mx, here, entered, length, velocity)
        motor, braking = gear * force, jp.where(at_motor, gear**2 * braking, 0.0)

        ahead, closing, gap, k, c = angle - load, speed - load_speed, numbers["gap"], numbers["k"], numbers["c"]
        up = jp.maximum(k * (ahead - gap) + c * closing, 0.0)
        down = jp.minimum(k * (ahead + gap) + c * closing, 0.0)
        torque = jp.where(ahead > gap, up, jp.where(ahead < -gap, down, 0.0))
        torque = jp.where(gap == 0, k * ahead + c * closing, torque)
        step = jp.where(begun, h, 0.0)
        stiffness, slipping = self.hysteresis[..., 0], self.hysteresis[..., 1]
        most = slipping / jp.where(stiffness > 0, stiffness, 1.0)
        slipped = jp.clip(state[:, BRISTLES + 1 : -1] + (step * closing)[:, None], -most, most)
        torque += (stiffness * slipped).sum(axis=-1)

        largest, smallest = _slipping(numbers, speed, motor, torque)
        friction_k = numbers["friction_k"]
        bent = jp.clip(state[:, BRISTLES] + step * speed, smallest / friction_k, largest / friction_k)
        rubbing = jp.clip(friction_k * bent + numbers["friction_c"] * speed, smallest, largest)
        viscous = numbers["friction_viscous"]
        faster = (motor - torque - rubbing - viscous * speed) / (numbers["inertia"] + h * (viscous + braking))
        after = speed + h * faster

        exerted = torque / gear
        places = {
            ANGLE: angle + h * after, SPEED: after, MOTOR_TORQUE: motor - braking * (after - speed),
            BEGUN: jp.ones_like(after), INPUT: after_input, BRISTLES: bent,
        }  # fmt: skip
        first = jp.stack([places[i] for i in range(BRISTLES + 1)], axis=1)
        return jp.concatenate((first, slipped, exerted[:, None]), axis=1), exerted

    def controls(self, ctrl: Any, exerted: Any) -> Any:
        """Return controls with what the drives' actuators exert in the places of theirs."""
        own = np.isin(np.arange(len(ctrl)), self.actuators)
        order = np.clip(np.searchsorted(self.actuators, np.arange(len(ctrl))), 0, len(self.actuators) - 1)
        return jp.where(own, _taken(exerted, order), ctrl)  # to scatter is slow

    def _input(self, mx: Any, dx: Any, before: Any, here: np.ndarray) -> tuple[Any, Any]:
        """Return what the motors' gains are multiplied with, and what follows the actuators' former activation."""
        control, h = _taken(dx.ctrl, here), mx.opt.timestep
        control = jp.where(jp.abs(control) <= _WORST, control, 0.0)
        if not mx.opt.disableflags & _CLAMP_OFF:
            limited, limits = _taken(mx.actuator_ctrllimited, here).astype(bool), _taken(mx.actuator_ctrlrange, here)
            control = jp.where(limited, jp.clip(control, limits[:, 0], limits[:, 1]), control)
        dynamics, tau = self.numbers["dynamics"], jp.maximum(_taken(mx.actuator_dynprm, here)[:, 0], 1e-15)
        slow = jp.where(dynamics == 2, tau, h / -jp.expm1(-h / tau))
        rate = jp.where(dynamics > 1, (control - before) / slow, control)
        after, limits = before + h * rate, _taken(mx.actuator_actrange, here)
        after = jp.where(limits[:, 0] < limits[:, 1], jp.clip(after, limits[:, 0], limits[:, 1]), after)
        entered = jp.where(self.numbers["early"] != 0, after, before)
        return jp.where(dynamics == 0, control, entered), jp.where(dynamics == 0, before, after)


def drives_of(model: mujoco.MjModel) -> Drives:
    """Return the drives inside a model's actuators."""
    found = sorted(drives(model), key=lambda drive: drive.actuator)
    numbers = {name: jp.array([float(drive.numbers(model)[name]) for drive in found]) for name in DRIVE.names or ()}
    elements = np.zeros((len(found), max((drive.hysteresis for drive in found), default=0), 2))
    for row, drive in zip(elements, found):
        row[: drive.hysteresis] = drive.slips(model)
    names, actuators = tuple(drive.name for drive in found), tuple(drive.actuator for drive in found)
    return Drives(numbers, jp.array(elements), names, actuators)


def _taken(values: Any, places: np.ndarray) -> Any:
    """Return values at places, by a slice where they follow each other, which is faster."""
    if len(places) and np.array_equal(places, np.arange(places[0], places[0] + len(places))):
        return values[int(places[0]) : int(places[-1]) + 1]
    return values[places]


def _motor(mx: Any, here: np.ndarray, entered: Any, length: Any, velocity: Any) -> tuple[Any, Any]:
    """Return the actuators' own forces, and the damping that is in them."""
    gain, bias = _taken(mx.actuator_gainprm, here), _taken(mx.actuator_biasprm, here)
    limits = _taken(mx.actuator_forcerange, here)
    force = (gain[:, 0] + gain[:, 1] * length + gain[:, 2] * velocity) * entered
    force += bias[:, 0] + bias[:, 1] * length + bias[:, 2] * velocity
    clipped = jp.where(limits[:, 0] < limits[:, 1], jp.clip(force, limits[:, 0], limits[:, 1]), force)
    return clipped, jp.where(clipped == force, jp.maximum(-(gain[:, 2] * entered + bias[:, 2]), 0.0), 0.0)


def _slipping(numbers: dict[str, Any], speed: Any, motor: Any, torque: Any) -> tuple[Any, Any]:
    """Return the friction at which rotors slip forward, and backward; see `DriveFriction`."""
    of = {name.removeprefix("friction_"): value for name, value in numbers.items()}
    load = -torque
    limit = of["coulomb"] + jp.abs(of["external"] * load - of["motor"] * motor)
    more = of["stribeck"] + jp.abs(of["stribeck_external"] * load - of["stribeck_motor"] * motor)
    by_motor = jp.where(jp.abs(load) < jp.abs(motor), of["motor_square"] * load**2, 0.0)
    by_load = jp.where(jp.abs(load) > jp.abs(motor), of["external_square"] * motor**2, 0.0)
    more += jp.where(load * motor < 0, by_motor + by_load, 0.0)
    limit += more * jp.exp(-(jp.abs(speed / of["stribeck_speed"]) ** of["stribeck_exponent"]))
    driven, driving = of["loss_forward"] * jp.abs(torque), of["loss_backward"] * jp.abs(torque)
    forward = jp.where(torque >= 0, driven, driving)
    return limit + forward, forward - limit - driven - driving
