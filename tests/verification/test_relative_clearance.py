"""A clearance between two shafts. The modal engine against an ODE solution at 1e-9.

The reference, written here, has the sine modes of two pinned shafts in closed form. Its one static shape, that under
opposite unit forces on both in the clearance, is the series of the modes left over.
"""

import functools

import numpy as np
import pytest
import scipy.integrate

from clearance_mj import Bushing, ConstantLaw, Contact, Grease, Modal, Rig, Sensor, linear_model
from clearance_mj.structure import Material, Section, Shaft, Shafts, Support

YOUNG, DENSITY = 210e9, 7850.0
SHAFTS = {"inner": (0.0, 0.8, 0.012, 0.0), "outer": (0.1, 0.6, 0.03, 0.026)}  # start, length, diameter, bore, m
AT, HALF, GAP = 0.42, 0.01, 1e-4
GREASE_K, GREASE_C, CONTACT_K = 2e3, 3.0, 5e4
RAYLEIGH = (2.0, 1e-6)
MODES, DURATION = 8, 0.06
STEPS = 2e-5 / 2.0 ** np.arange(4)


def rig():
    def one(name, start, length, diameter, bore):
        section = Section(length, diameter, bore or None)
        pins = (Support(start, "pinned"), Support(start + length, "pinned"))
        return Shaft((section,), pins, (), Material(YOUNG, DENSITY), theory="euler", start=start, name=name)

    parts = tuple(one(name, *values) for name, values in SHAFTS.items())
    bushing = Bushing(f"inner@{AT}", GAP, 2 * HALF, Grease(GREASE_K, GREASE_C), Contact(CONTACT_K), to=f"outer@{AT}")
    return Rig("shaft in a tube", None, (bushing,), (Sensor(1, "inner@0.2"),), structure=Shafts(parts, (), RAYLEIGH))


def base_acceleration(t):
    """Two tones, faded in over 10 ms."""
    tones = 60 * np.sin(2 * np.pi * 37 * t) + 80 * np.sin(2 * np.pi * 171 * t + 0.4)
    return tones * np.where(t < 0.01, np.sin(np.pi / 2 * t / 0.01) ** 2, 1.0)


class Reference:
    """q̈ + (η1 + η2 ω²) q̇ + ω² q = -Γ a - Rᵀ f, the relative displacements R q at the middle and both ends."""

    def __init__(self, terms=100_000):
        n = np.arange(1, terms + 1)
        omega, load, rows = [], [], []
        for sign, (start, length, diameter, bore) in zip((1, -1), SHAFTS.values()):
            mass = DENSITY * np.pi * (diameter**2 - bore**2) / 4 * length
            omega.append((n * np.pi / length) ** 2 * np.sqrt(YOUNG * (diameter**2 + bore**2) / 16 / DENSITY))
            load.append(np.sqrt(2 * mass) * (1 - np.cos(n * np.pi)) / (n * np.pi))
            at = np.array([AT, AT - HALF, AT + HALF]) - start
            rows.append(sign * np.sqrt(2 / mass) * np.sin(np.outer(at, n * np.pi / length)))
        omega, load, rows = np.concatenate(omega), np.concatenate(load), np.hstack(rows)
        order = np.argsort(omega)
        omega, load, rows = omega[order], load[order], rows[:, order]
        static = rows[0, MODES:] / omega[MODES:] ** 2
        unit = static / np.linalg.norm(static)
        self.omega = np.append(omega[:MODES], np.linalg.norm(unit * omega[MODES:]))
        self.load = np.append(load[:MODES], unit @ load[MODES:])
        self.rows = np.hstack((rows[:, :MODES], rows[:, MODES:] @ unit[:, None]))

    def rate(self, t, y):
        q, v = np.split(y, 2)
        x, speed = self.rows @ q, self.rows[0] @ v
        contact = CONTACT_K / 2 * np.sign(x[1:]) * np.maximum(np.abs(x[1:]) - GAP, 0)
        force = np.array([GREASE_K * x[0] + GREASE_C * speed, *contact])
        damping = (RAYLEIGH[0] + RAYLEIGH[1] * self.omega**2) * v
        return np.concatenate((v, -self.load * base_acceleration(t) - damping - self.omega**2 * q - force @ self.rows))


@functools.cache
def reference(rtol=1e-9):
    """Relative displacement in the middle of the clearance at the steps of the longest step."""
    model, times = Reference(), np.arange(0, DURATION, STEPS[0])
    start = np.zeros(2 * model.omega.size)
    options = {"rtol": rtol, "atol": 1e-5 * rtol, "max_step": 1e-4}
    solution = scipy.integrate.solve_ivp(model.rate, (0, DURATION), start, "DOP853", times, **options)
    return model.rows[0] @ solution.y[: model.omega.size]


def by_engine(step):
    steps = round(DURATION / step)
    run = Modal(modes=MODES).start(rig(), ConstantLaw(CONTACT_K, 0.0), "base", step)
    return run.advance(base_acceleration(np.arange(steps) * step))[:: round(STEPS[0] / step), 1]


def test_linear_model(measured):
    """Frequencies and relative shapes, that of the static shape among them."""
    model, expected = linear_model(rig(), MODES), Reference()
    error = np.max(np.abs(model.omega / expected.omega - 1))
    measured.below("two pinned shafts, 8 modes and a static shape: error of frequencies", error, 1e-9, "series")
    rows = model.at_points * np.sign(model.at_points[0] * expected.rows[0])
    error = np.max(np.abs(rows - expected.rows)) / np.max(np.abs(expected.rows))
    measured.below("two pinned shafts: error of relative shapes", error, 1e-8, "series")


@pytest.mark.slow
def test_time_history(measured):
    """Displacement over 60 ms; both walls are hit, first after 10 ms."""
    expected = reference()
    assert (expected > GAP).any() and (expected < -GAP).any()
    assert 4 < np.count_nonzero(np.diff((np.abs(expected) > GAP).astype(int)) == 1) < 40
    size = np.sqrt(np.mean(expected**2))
    source = "closed-form modes, DOP853 at 1e-9"
    solver_error = np.sqrt(np.mean((reference(1e-11) - expected) ** 2)) / size
    what = "clearance between two shafts, the ODE solution's own: RMS error"
    measured.below(what, solver_error, 1e-8, "DOP853 at 1e-11")
    errors = [np.sqrt(np.mean((by_engine(step) - expected) ** 2)) / size for step in STEPS]
    order = np.polyfit(np.log(STEPS), np.log(errors), 1)[0]
    measured.equal("clearance between two shafts, modal: order", order, 2, source, abs=0.1)
    what = f"clearance between two shafts, modal, step {STEPS[-1] * 1e6:g} µs: RMS error"
    measured.below(what, errors[-1], 1e-6, source)
