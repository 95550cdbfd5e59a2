"""The modal equations of the benchmark as one would write them without this project: for scipy and for plain numpy."""

import numpy as np
import scipy.integrate

import clearance_mj as cm
from clearance_mj.linear import linear_model
from clearance_mj.signals.sampling import decimate, interpolate

from .case import BAND, FS, LAW, RIG


class ModalEquations:
    """q̈ = -ω² q - 2ζω q̇ - Yᵀ f - Γ a, f the forces of grease and contact in the middle of each bushing."""

    def __init__(self, modes):
        model = linear_model(RIG, modes)
        self.stiffness, self.damping, self.load = model.omega**2, model.damping, model.participation
        self.at_bushings = model.shapes([b.position for b in RIG.bushings])
        self.from_bushings = np.ascontiguousarray(self.at_bushings.T)
        self.at_sensors = model.shapes([s.position for s in RIG.sensors])
        self.gap = np.array([b.gap for b in RIG.bushings])
        self.k, self.c = LAW.k, LAW.c
        self.grease_k, self.grease_c = np.array([(b.grease.stiffness, b.grease.damping) for b in RIG.bushings]).T
        self.largest_step = 0.8 * 2 / model.omega[-1]

    def acceleration(self, q, v, a):
        x, speed = self.at_bushings @ q, self.at_bushings @ v
        depth = x - np.minimum(np.maximum(x, -self.gap), self.gap)
        side = np.sign(depth)
        contact = side * np.maximum(side * (self.k * depth + self.c * speed), 0.0)  # a contact never pulls
        force = contact + self.grease_k * x + self.grease_c * speed
        return -self.stiffness * q - self.damping * v - self.from_bushings @ force - self.load * a


def semi_implicit_euler(modes, excitation):
    """A loop in numpy."""
    equations = ModalEquations(modes)
    factor = int(np.ceil(1 / (FS * equations.largest_step)))
    drive, h = interpolate(excitation.value, factor), 1 / (FS * factor)
    q, v = np.zeros((2, equations.load.size))
    out = np.empty((drive.size, q.size))
    for i, a in enumerate(drive):
        out[i] = equations.acceleration(q, v, a)
        v += h * out[i]
        q += h * v
    return _response(excitation, out @ equations.at_sensors.T + drive[:, None], factor)


def lsoda(modes, tolerance, excitation, factor=8):
    """scipy's solve_ivp; the drive is interpolated linearly between ``factor`` samples per sample of the record."""
    equations, n = ModalEquations(modes), ModalEquations(modes).load.size
    drive, rate = interpolate(excitation.value, factor), FS * factor

    def slope(t, y):
        i = min(int(t * rate), drive.size - 2)
        a = drive[i] + (t * rate - i) * (drive[i + 1] - drive[i])
        return np.concatenate((y[n:], equations.acceleration(y[:n], y[n:], a)))

    time = np.arange(drive.size) / rate
    scale = np.repeat((1e-4, 1e-1), n)  # sqrt(kg) m and sqrt(kg) m/s, the size of the motion
    solution = scipy.integrate.solve_ivp(
        slope, (0, time[-1]), np.zeros(2 * n), "LSODA", time, rtol=tolerance, atol=tolerance * scale
    )
    motion = zip(solution.y[:n].T, solution.y[n:].T, drive)
    out = np.array([equations.acceleration(q, v, a) for q, v, a in motion])
    return _response(excitation, out @ equations.at_sensors.T + drive[:, None], factor)


def _response(excitation, acceleration, factor):
    return cm.Response(FS, excitation.value, decimate(acceleration, factor).T, band=BAND)
