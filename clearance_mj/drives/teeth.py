"""Motor and load with play and elastic teeth between them, followed along a log of the motor; compiled."""

from __future__ import annotations

import numpy as np

from ..core.jit import jit

__all__ = ["NUMBERS", "predict_teeth"]

NUMBERS = (
    "inertia", "load inertia", "play", "stiffness", "teeth's damping", "efficiency", "turnover", "tail",
    "friction", "width", "load friction", "load width", "damping", "load damping", "spring", "correction", "lean",
    "load",
)  # fmt: skip
"""Parameters of `predict_teeth`, in this order"""


@jit(error_model="numpy")
def predict_teeth(
    angle: np.ndarray, torque: np.ndarray, step: float, values: np.ndarray, steps: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return one-step predictions (n,) of motor and load angle, rad, and the teeth's torque.

    The motor's torque drives motor and load. At each sample, the error of the angle shifts angle and speed of both, as
    a stationary Kalman filter of a double integrator does, so that noise of the torque does not add up: errors are
    those of one prediction (Ljung, System Identification, 2nd ed., 1999, section 7.3). Teeth are taken implicitly, so
    that no stiffness is unstable. Friction is that of Dahl (AIAA Journal 14, 1976). Efficiency η multiplies the teeth's
    torque by 1/η at the motor where power goes to the load, by η where it comes back, and turns over with the motor's
    speed. "lean" is 1 or -1 for a load that stays on one side of the teeth: it is then counted so that play, which such
    a run does not show, does not change it.

    Parameters
    ----------
    angle, torque : ndarray, shape (n,)
        Measured at the motor, rad and N m.
    step : float
        Between samples, s.
    values : ndarray, shape (18,)
        Of `NUMBERS`, SI units of the motor.
    steps : int
        Of the integration between samples.

    Returns
    -------
    angle, teeth, load : ndarray, shape (n,)
        rad, N m and rad.
    """
    (
        inertia, load_inertia, play, stiffness, dashpot, efficiency, turnover, tail, friction, width,
        load_friction, load_width, damping, load_damping, spring, correction, lean, load,
    ) = values  # fmt: skip
    motor_angle, teeth, load_angle = np.empty(angle.size), np.empty(angle.size), np.empty(angle.size)
    relaxation = dashpot / stiffness
    h = step / steps
    loss = -np.log(efficiency)
    angle_gain, speed_gain = np.sqrt(2.0) * correction * step, correction**2 * step
    first = min(20, angle.size - 1)
    # Spring and load are given at the motor, through the elastic teeth.
    spring = spring / (1.0 - spring / stiffness)
    load = (load + lean * spring * play) * (1.0 + spring / stiffness)
    tau_0 = load + spring * angle[0]
    side = 1.0 if tau_0 > 0 else -1.0
    x_m, v_m = angle[0], (angle[first] - angle[0]) / (first * step)
    x_l, v_l = x_m - side * play - tau_0 / stiffness, v_m
    z_m, z_l, tau = 0.0, 0.0, tau_0
    motor_angle[0], teeth[0], load_angle[0] = x_m, tau_0, x_l
    for i in range(1, angle.size):
        for j in range(steps):
            u = torque[i - 1] + (torque[i] - torque[i - 1]) * (j + 0.5) / steps
            z_m = (z_m + h * v_m / width) / (1.0 + h * abs(v_m) / width)
            z_l = (z_l + h * v_l / load_width) / (1.0 + h * abs(v_l) / load_width)
            a_m = (u - friction * z_m - damping * v_m) / inertia
            a_l = -(load + spring * x_l + load_friction * z_l + load_damping * v_l) / load_inertia
            rate = v_m - v_l + h * (a_m - a_l)
            lag_0 = x_m - x_l
            lag = lag_0 + h * rate
            side = 1.0 if lag > 0.0 else -1.0
            gap = lag * side - play
            tau, factor, dt = 0.0, 1.0, h
            if gap > 0.0:
                # Teeth that meet within a step push for its remainder, so that the response is continuous.
                if lag_0 * side < play:
                    dt = h * gap / (lag * side - lag_0 * side)
                w = v_m / turnover
                factor = np.exp(loss * side * ((1.0 - tail) * np.tanh(w) + tail * w / np.sqrt(1.0 + w * w)))
                mobility = factor / inertia + 1.0 / load_inertia
                push = gap + relaxation * rate * side
                tau = side * max(0.0, stiffness * push / (1.0 + stiffness * mobility * dt * (dt + relaxation)))
            v_m += h * a_m - dt * factor * tau / inertia
            v_l += h * a_l + dt * tau / load_inertia
            x_m += h * v_m
            x_l += h * v_l
        motor_angle[i], teeth[i], load_angle[i] = x_m, tau, x_l
        error = angle[i] - x_m
        x_m += angle_gain * error
        x_l += angle_gain * error
        v_m += speed_gain * error
        v_l += speed_gain * error
    return motor_angle, teeth, load_angle
