"""Step of a drive inside an actuator, compiled; MuJoCo calls it as the actuator's dynamics.

Semi-implicit as MuJoCo's steps: torques are those of the step's positions, and the rotor's damping, with that of a
servo that measures its speed, is implicit. The step adds the derivative times the time step to the activation.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numba
import numpy as np

from ..core.jit import OPTIONS, STRICT, jit
from .drives import ANGLE, BEGUN, BRISTLES, DRIVE, INPUT, MOTOR_TORQUE, SPEED
from .library import doubles, field, integers, offsets_of, pointer

__all__ = [
    "PLACE", "PLACES", "SENSED", "accelerate", "advance", "filter_control", "motor_force", "sense", "slip",
    "teeth_torque", "turn",
]  # fmt: skip

_DATA = ("act", "act_dot", "ctrl", "actuator_length", "actuator_velocity", "sensordata")
_MODEL = (
    "actuator_actrange", "actuator_biasprm", "actuator_ctrllimited", "actuator_ctrlrange", "actuator_dynprm",
    "actuator_forcerange", "actuator_gainprm", "actuator_gear", "actuator_group", "numeric_data",
)  # fmt: skip
PLACE = np.dtype([(name, np.int64) for name in ("actuator", "numeric", "slips", "act", "size", "output", "control")])
"""Addresses of a drive's parameters, activation, length and control"""
SENSED = np.dtype([("address", np.int64), ("drive", np.int64)])
"""Address of a rotor's angle in the sensordata, and index of its drive"""

_SIZE, _PRM = DRIVE.itemsize, 10
_SHORTEST = 1e-15  # s, of a filter, as MuJoCo has it
_WORST = 1e10  # above which MuJoCo takes a control for an error
PLACES = offsets_of(_DATA, _MODEL, ("disableflags", "disableactuator", "timestep"))
"""Offsets in MuJoCo's structures, bytes"""
_CLAMP_OFF = int(mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL)


@jit(**OPTIONS)
def turn(head: Any, model: int, data: int, place: Any) -> None:
    """Write the derivative of a drive's activation; its last element makes the actuator exert the teeth's torque."""
    h = doubles(model + head.m_timestep, 1)[0]
    per_second = 1.0 / h
    act = doubles(field(data + head.d_act) + 8 * place.act, place.size)
    rates = doubles(field(data + head.d_act_dot) + 8 * place.act, place.size)
    group = integers(field(model + head.m_actuator_group) + 4 * place.actuator, 1)[0]
    if 0 <= group < 31 and (integers(model + head.m_disableactuator, 1)[0] >> group) & 1:
        act[BEGUN] = 0.0  # restarts when it is enabled
        return
    parameters = field(model + head.m_numeric_data) + 8 * place.numeric
    drive, slips = numba.carray(pointer(parameters), 1, DRIVE)[0], doubles(parameters + _SIZE, 2 * place.slips)
    gear = doubles(field(model + head.m_actuator_gear) + 48 * place.output, 1)[0]
    length = doubles(field(data + head.d_actuator_length), place.output + 1)[place.output]
    velocity = doubles(field(data + head.d_actuator_velocity), place.output + 1)[place.output]
    per_gear = 1.0 / gear
    load, load_speed = length * per_gear, velocity * per_gear
    begun = act[BEGUN] != 0.0
    angle, speed = (act[ANGLE], act[SPEED]) if begun else (load, load_speed)
    if drive.encoder == 0.0:
        length, velocity = gear * angle, gear * speed
    limited = numba.carray(pointer(field(model + head.m_actuator_ctrllimited) + place.control), 1, np.uint8)[0]
    gain_input, rates[INPUT] = filter_control(
        drive, h, act[INPUT], doubles(field(data + head.d_ctrl) + 8 * place.control, 1)[0],
        limited and not integers(model + head.m_disableflags, 1)[0] & _CLAMP_OFF,
        doubles(field(model + head.m_actuator_ctrlrange) + 16 * place.control, 2),
        doubles(field(model + head.m_actuator_actrange) + 16 * place.actuator, 2),
        doubles(field(model + head.m_actuator_dynprm) + 8 * _PRM * place.actuator, 1)[0],
    )  # fmt: skip
    motor, braking = motor_force(
        doubles(field(model + head.m_actuator_gainprm) + 8 * _PRM * place.actuator, 3),
        doubles(field(model + head.m_actuator_biasprm) + 8 * _PRM * place.actuator, 3),
        doubles(field(model + head.m_actuator_forcerange) + 16 * place.actuator, 2), gain_input, length, velocity,
    )  # fmt: skip
    motor, braking = gear * motor, gear * gear * braking if drive.encoder == 0.0 else 0.0

    closing = speed - load_speed
    torque = teeth_torque(drive, angle - load, closing)
    for i in range(place.slips):
        k, largest = slips[2 * i], slips[2 * i + 1]
        bristle = min(max(act[BRISTLES + 1 + i] + begun * h * closing, -largest / k), largest / k)
        rates[BRISTLES + 1 + i] = (bristle - act[BRISTLES + 1 + i]) * per_second
        torque += k * bristle

    largest, smallest = slip(drive, speed, motor, torque)
    bristle, rate = accelerate(drive, h, act[BRISTLES], begun * h, speed, motor, braking, torque, largest, smallest)
    rates[BRISTLES] = (bristle - act[BRISTLES]) * per_second
    new_speed = speed + h * rate
    rates[SPEED] = rate if begun else (new_speed - act[SPEED]) * per_second
    rates[ANGLE] = new_speed if begun else (angle + h * new_speed - act[ANGLE]) * per_second
    rates[BEGUN] = (1.0 - act[BEGUN]) * per_second
    rates[MOTOR_TORQUE] = (motor - braking * (new_speed - speed) - act[MOTOR_TORQUE]) * per_second
    rates[place.size - 1] = (torque * per_gear - act[place.size - 1]) * per_second


@jit(**OPTIONS)
def filter_control(
    drive: Any, h: float, activation: float, control: float, clamped: bool, control_range: Any, range_of_input: Any,
    tau: float,
) -> tuple[float, float]:  # fmt: skip
    """Return the input of the motor's gain, and the derivative of the original actuator's activation."""
    if not abs(control) <= _WORST:
        control = 0.0
    if clamped:
        control = min(max(control, control_range[0]), control_range[1])
    if drive.dynamics == 0.0:
        return control, 0.0
    rate = control
    if drive.dynamics > 1.0:
        time_constant = max(tau, _SHORTEST)
        if drive.dynamics > 2.0:
            tanh_half = np.tanh(0.5 * h / time_constant)  # with it 1 - exp(-h/tau) is exact in single precision too
            time_constant = h * (1.0 + tanh_half) / (2.0 * tanh_half)
        rate = (control - activation) / time_constant
    if range_of_input[0] < range_of_input[1]:
        rate = (min(max(activation + h * rate, range_of_input[0]), range_of_input[1]) - activation) / h
    return activation + h * rate if drive.early != 0.0 else activation, rate


@jit(**OPTIONS)
def motor_force(
    gain: Any, bias: Any, limits: Any, gain_input: float, length: float, velocity: float
) -> tuple[float, float]:
    """Return the motor's force, and the damping in it."""
    force = (
        (gain[0] + gain[1] * length + gain[2] * velocity) * gain_input + bias[0] + bias[1] * length + bias[2] * velocity
    )
    if limits[0] < limits[1] and (force < limits[0] or force > limits[1]):
        return min(max(force, limits[0]), limits[1]), 0.0
    return force, max(-(gain[2] * gain_input + bias[2]), 0.0)


@jit(**OPTIONS)
def teeth_torque(drive: Any, deflection: float, closing: float) -> float:
    """Return the torque of teeth with play on the load."""
    if drive.gap == 0.0:
        return drive.k * deflection + drive.c * closing
    if deflection > drive.gap:
        return max(drive.k * (deflection - drive.gap) + drive.c * closing, 0.0)
    if deflection < -drive.gap:
        return min(drive.k * (deflection + drive.gap) + drive.c * closing, 0.0)
    return 0.0


@jit(**OPTIONS)
def slip(drive: Any, speed: float, motor: float, torque: float) -> tuple[float, float]:
    """Return the largest friction, forward and backward, at which the rotor slips; see `DriveFriction`."""
    load = -torque
    limit = drive.friction_coulomb + abs(drive.friction_external * load - drive.friction_motor * motor)
    stribeck = drive.friction_stribeck
    stribeck += abs(drive.friction_stribeck_external * load - drive.friction_stribeck_motor * motor)
    if load * motor < 0.0:
        if abs(load) < abs(motor):
            stribeck += drive.friction_motor_square * load * load
        elif abs(load) > abs(motor):
            stribeck += drive.friction_external_square * motor * motor
    if stribeck > 0.0:
        limit += stribeck * np.exp(-(abs(speed / drive.friction_stribeck_speed) ** drive.friction_stribeck_exponent))
    driven, driving = drive.loss_forward * abs(torque), drive.loss_backward * abs(torque)
    if torque >= 0.0:
        return limit + driven, -limit - driving
    return limit + driving, -limit - driven


@jit(**OPTIONS)
def accelerate(
    drive: Any, h: float, bristle: float, step: float, speed: float, motor: float, braking: float, torque: float,
    largest: float, smallest: float,
) -> tuple[float, float]:  # fmt: skip
    """Return the deflection of the friction's bristle after a step, and the rotor's acceleration in it."""
    deflection = min(max(bristle + step * speed, smallest / drive.friction_k), largest / drive.friction_k)
    friction = min(max(drive.friction_k * deflection + drive.friction_c * speed, smallest), largest)
    damping = drive.friction_viscous + braking
    return deflection, (motor - torque - friction - drive.friction_viscous * speed) / (drive.inertia + h * damping)


@jit(**STRICT)
def advance(head: Any, model: int, data: int, place: Any) -> None:
    """Advance a drive in a user's loop, without MuJoCo's call to `turn`."""
    turn(head, model, data, place)
    h = doubles(model + head.m_timestep, 1)[0]
    act = doubles(field(data + head.d_act) + 8 * place.act, place.size)
    rates = doubles(field(data + head.d_act_dot) + 8 * place.act, place.size)
    for i in range(place.size):
        act[i] += h * rates[i]


@jit(**OPTIONS)
def sense(head: Any, model: int, data: int, place: Any, address: int) -> None:
    """Write the angle of a drive's rotor into the sensordata."""
    act = doubles(field(data + head.d_act) + 8 * place.act, place.size)
    angle = act[ANGLE]
    if act[BEGUN] == 0.0:  # not started yet: at the load
        length = doubles(field(data + head.d_actuator_length), place.output + 1)[place.output]
        angle = length / doubles(field(model + head.m_actuator_gear) + 48 * place.output, 1)[0]
    doubles(field(data + head.d_sensordata), address + 1)[address] = angle
