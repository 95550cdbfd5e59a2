"""Impacts with closed forms. The contact models alone, and the loops that the engines run.

The loops are given a free mass between two stops: the compiled one of the modal engine, and that of links with a mass
on a slide joint whose two tendons are the ends of the bushing.
"""

import dataclasses
import functools

import numpy as np
import pytest
import scipy.integrate
import scipy.optimize

from clearance_mj import Bushing, Contact, Grease, Modal, Rig, Sensor
from clearance_mj import clearance as models
from clearance_mj.structure import Matrices

from .modal_mj import ModalMujoco

ADHESIVE = {0.1: 0.729248, 0.2: 0.526621, 0.3: 0.372326, 0.5: 0.163034}
RELEASE = "closed form, release where the force is zero"
RELEASED = {0.1: 0.744079, 0.2: 0.571740, 0.3: 0.450975, 0.5: 0.298436}
HERTZ = "κ(1 + e) = ln[(1 + κ)/(1 - κe)]"
FIRST_ORDER = functools.partial(models.HuntCrossley, first_order=True)
HERTZ_DAMPED = [
    *((FIRST_ORDER, e, out) for e, out in ((0.9, 0.9090), (0.7, 0.7680), (0.5, 0.6630))),
    *((models.HuntCrossley, e, e) for e in (0.9, 0.7, 0.5, 0.3, 0.1)),
    *((models.LankaraniNikravesh, e, out) for e, out in ((0.9, 0.9132), (0.7, 0.7960), (0.5, 0.7252))),
    *((models.Flores, e, out) for e, out in ((0.9, 0.8939), (0.7, 0.6832), (0.5, 0.4704))),
]  # restitution, given the e of the model, from κ(1 + e) = ln[(1 + κ)/(1 - κe)]


def restitution(force, mass=1.0, speed=0.3, duration=10.0):
    """Rebound over impact speed of a free mass on a contact, by an ODE solver."""

    def rate(_, y):
        return y[1], -force(y[0], y[1]) / mass

    def leaves(_, y):
        return y[0]

    leaves.terminal, leaves.direction = True, -1
    options = {"events": leaves, "rtol": 1e-10, "atol": 1e-14, "max_step": 0.01}
    solution = scipy.integrate.solve_ivp(rate, (0, duration), (1e-12, speed), **options)
    assert solution.status == 1
    return -solution.y[1, -1] / speed


def damping(ratio, mass=1.0, stiffness=1.0):
    return 2 * ratio * np.sqrt(mass * stiffness)


@pytest.mark.parametrize(("ratio", "expected"), ADHESIVE.items())
def test_kelvin_voigt_adhesive(ratio, expected, measured):
    """exp(-πζ/√(1-ζ²))."""
    assert np.exp(-np.pi * ratio / np.sqrt(1 - ratio**2)) == pytest.approx(expected, abs=1e-6)
    value = restitution(models.KelvinVoigt(1.0, damping(ratio), adhesion=True).force)
    what = f"restitution, Kelvin-Voigt with adhesion, ζ = {ratio}"
    measured.equal(what, value, expected, "exp(-πζ/√(1-ζ²))", rel=1e-5)


@pytest.mark.parametrize(("ratio", "expected"), RELEASED.items())
def test_kelvin_voigt_released(ratio, expected, measured):
    """exp[-(b/w)(π - atan2(2bw, w² - b²))]: the contact ends where the force has fallen to zero."""
    w = np.sqrt(1 - ratio**2)
    closed = np.exp(-(ratio / w) * (np.pi - np.arctan2(2 * ratio * w, w**2 - ratio**2)))
    assert closed == pytest.approx(expected, abs=1e-6)
    value = restitution(models.KelvinVoigt(1.0, damping(ratio)).force)
    measured.equal(f"restitution, Kelvin-Voigt, ζ = {ratio}", value, expected, RELEASE, rel=1e-5)


def name_of(model):
    return "HuntCrossley, first order" if model is FIRST_ORDER else model.__name__


def hertz_damped_restitution(kappa):
    """κ(1 + e) = ln[(1 + κ)/(1 - κe)] for any exponent (Hunt & Crossley 1975, by energy)."""

    def balance(e):
        return kappa * (1 + e) - np.log((1 + kappa) / (1 - kappa * e))

    return scipy.optimize.brentq(balance, 1e-3, min(1.0, (1 - 1e-12) / kappa), xtol=1e-14)


@pytest.mark.parametrize("exponent", [1.5, 1.2])
@pytest.mark.parametrize(("model", "e", "expected"), HERTZ_DAMPED)
def test_hertz_damped(model, e, expected, exponent, measured):
    contact = model(1.0, e, exponent=exponent)
    value, exact = restitution(lambda x, v: contact.force(x, v, 0.3)), hertz_damped_restitution(contact.kappa)
    assert exact == pytest.approx(expected, abs=5e-5)
    measured.equal(f"restitution, {name_of(model)}, e = {e}, n = {exponent}", value, exact, HERTZ, rel=1e-4)


ENGINES = {"modal": Modal(), "mujoco": ModalMujoco()}
FREE = Matrices("m-kg-s", mass=[[1.0]], stiffness=[[0.0]], damping=[[0.0]], dofs=["1:Z"])


class FreeMass:
    """A mass of 1 kg that moves between the walls of a bushing, simulated by an engine's own loop."""

    def __init__(self, loop, law, gap, step, position, speed, grease=None, **place):
        self.step = step
        bushing = Bushing("1:Z", gap, 0.0, Grease(0.0), Contact(1.0), **place)
        rig = Rig("free mass", None, (bushing,), (Sensor(1, "1:Z"),), structure=FREE)
        run = ENGINES[loop].start(rig, dataclasses.replace(law, grease=grease), "base", step)
        if loop == "modal":
            run.motion.q[:] = run.motion.q_before[:] = position
            run.motion.v[:] = speed
        else:
            run.data.qpos[0], run.data.qvel[0] = position, speed
        self.simulate = lambda n: run.advance(np.zeros(n))[:, 1:]


def upward_crossings(x):
    """Instants, in samples, at which a signal rises through zero."""
    up = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
    return up - x[up] / (x[up + 1] - x[up])


def gap_oscillator(loop, step):
    """Periods of a mass between elastic stops, and its largest displacement: m = k = d = 1, amplitude X = 2."""
    x = FreeMass(loop, models.ConstantLaw(1.0, 0.0), 1.0, step, 2.0, 0.0).simulate(round(42 / step))[:, 0]
    return np.diff(upward_crossings(x)) * step, np.max(np.abs(x))


@pytest.mark.parametrize("loop", ["modal", "mujoco"])
def test_gap_oscillator(loop, measured):
    """Free period 4[π/2 + 1/(X-1)] = 10.28319."""
    expected, (periods, amplitude) = 4 * (np.pi / 2 + 1), gap_oscillator(loop, 1e-3)
    assert expected == pytest.approx(10.28319, abs=5e-6)
    assert periods.size == 3 and amplitude == pytest.approx(2, rel=1e-3)
    for i, period in enumerate(periods, 1):
        measured.equal(f"gap oscillator, {loop} loop, period {i} (s)", period, expected, "4[π/2 + 1/(X-1)]", rel=2e-6)


@pytest.mark.parametrize("loop", ["modal", "mujoco"])
def test_gap_oscillator_off_centre(loop, measured):
    """A wall is a half period of contact; between them the mass crosses 2 d at speed X - 1, wherever it rests.

    m = k = d = 1, X = 2 from the middle; 0.3 off it the mean of the motion is -0.3.
    """
    mass = FreeMass(loop, models.ConstantLaw(1.0, 0.0), 1.0, 1e-3, 2.0 - 0.3, 0.0, offset=0.3)
    x = mass.simulate(42_000)[:, 0]
    periods = np.diff(upward_crossings(x)) * mass.step
    what, closed = f"gap oscillator, 0.3 d off centre, {loop} loop", "4[π/2 + 1/(X-1)]"
    measured.equal(f"{what}: period (s)", np.mean(periods), 4 * (np.pi / 2 + 1), closed, rel=2e-6)
    measured.equal(f"{what}: middle of the motion (m)", (x.max() + x.min()) / 2, -0.3, "offset", abs=1e-3)


@pytest.mark.parametrize(("stops", "side"), [("upper", 1.0), ("lower", -1.0)])
@pytest.mark.parametrize("loop", ["modal", "mujoco"])
def test_one_wall(loop, stops, side, measured):
    """A mass thrown against the only wall from 1 m at 1 m/s leaves it after 1 + π s, and is not held on the other."""
    x = side * FreeMass(loop, models.ConstantLaw(1.0, 0.0), 1.0, 1e-3, 0.0, side, stops=stops).simulate(20_000)[:, 0]
    expected = -1.0 - (19.999 - (2.0 + np.pi + 1.0))  # at x = -1, where the other wall would be, it is after 3 + π s
    what = f"one wall ({stops}), {loop} loop: place after 20 s (m)"
    measured.equal(what, x[-1], expected, "1 + π s to the rebound at the same speed", rel=2e-4)


def rebound(mass):
    """Restitution from the slopes of the displacement before and after the first contact."""
    x = mass.simulate(round(10 / mass.step))[:, 0]
    enters, leaves = np.flatnonzero(np.diff(np.abs(x) > 1.0))[:2] + 1
    return -(x[leaves + 1] - x[leaves]) / (x[enters - 1] - x[enters - 2])


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("loop", ["modal", "mujoco"])
@pytest.mark.parametrize(("ratio", "expected"), RELEASED.items())
def test_kelvin_voigt_in_the_loops(loop, ratio, expected, direction, measured):
    mass = FreeMass(loop, models.ConstantLaw(1.0, damping(ratio)), 1.0, 5e-4, 0.9 * direction, 0.5 * direction)
    what = f"restitution, Kelvin-Voigt, {loop} loop, ζ = {ratio}, {'up' if direction > 0 else 'down'}"
    measured.equal(what, rebound(mass), expected, RELEASE, rel=5e-4)


@pytest.mark.parametrize(("ratio", "expected"), ADHESIVE.items())
def test_adhesion_in_the_modal_loop(ratio, expected, measured):
    law = models.ContactLaw(models.KelvinVoigt(1.0, damping(ratio), adhesion=True))
    value = rebound(FreeMass("modal", law, 1.0, 5e-4, 0.9, 0.5))
    measured.equal(f"restitution, adhesion, modal loop, ζ = {ratio}", value, expected, "exp(-πζ/√(1-ζ²))", rel=5e-4)


@pytest.mark.parametrize("loop", ["modal", "mujoco"])
@pytest.mark.parametrize(("model", "e", "expected"), HERTZ_DAMPED)
def test_hertz_damped_in_the_loops(loop, model, e, expected, measured):
    mass = FreeMass(loop, models.ContactLaw(model(2.0, e)), 1.0, 5e-4, 0.9, 0.5)
    exact = hertz_damped_restitution(model(2.0, e).kappa)
    assert exact == pytest.approx(expected, abs=5e-5)
    measured.equal(f"restitution, {name_of(model)}, {loop} loop, e = {e}", rebound(mass), exact, HERTZ, rel=1e-6)


NEW = [models.HuntCrossley1975(2.0, 1.2), models.Cubic(1.0, 3.0, 0.3), models.AdamsImpact(1.0, 1.5, 0.8, 0.3)]


@pytest.mark.parametrize("loop", ["modal", "mujoco"])
@pytest.mark.parametrize("contact", NEW, ids=lambda c: c.name)
def test_new_contacts_in_the_loops(loop, contact, measured):
    exact = restitution(contact.force, speed=0.5)
    value = rebound(FreeMass(loop, models.ContactLaw(contact), 1.0, 5e-4, 0.9, 0.5))
    measured.equal(f"restitution, {contact.name}, {loop} loop", value, exact, "ODE solver at 1e-10", rel=2e-4)


SLIP = models.MaxwellSlip((0.5, 0.3, 0.2), (0.2, 0.3, 0.3), elastic=0.4, damping=0.05)
FILM = Grease(1.0, 0.1, 0.3, 1.0, 0.8, 0.5, 2.0, film_height=2.5, film_limit=0.3)


def slip_rate(_, y):
    """The spring of a slider follows the motion until the slider moves."""
    limits = np.array([0.4, 1.0, 1.5])
    slides = (np.abs(y[2:]) >= limits) & (y[2:] * y[1] > 0)
    force = 0.4 * y[0] + SLIP.springs @ np.clip(y[2:], -limits, limits) + 0.05 * y[1]
    return [y[1], -force, *np.where(slides, 0, y[1])]


def film_rate(_, y):
    x, v, z = y
    force = 0.3 * x + 0.7 * z + 0.1 * v / max(1 - abs(x) / 2.5, 0.3) ** 2
    return v, -force, v - 0.8 * abs(v) * abs(z) * z - 0.5 * v * z**2


@functools.cache
def rung_down(rate, states, step, rtol, max_step, method="RK45"):
    """Displacement, every step, of a mass that rings out from 1.9 m/s."""
    t, start = np.arange(round(20 / step)) * step, (0.0, 1.9, *[0.0] * states)
    options = {"rtol": rtol, "atol": rtol / 100, "t_eval": t, "max_step": max_step, "method": method}
    return scipy.integrate.solve_ivp(rate, (0, t[-1]), start, **options).y[0]


def largest_error(loop, step, grease, damping, exact):
    speed = 1.9 + step / 2 * damping * 1.9  # half a step before the start: where the loops' velocities are
    out = FreeMass(loop, models.ConstantLaw(1.0, 0.0), 10.0, step, 0.0, speed, grease).simulate(exact.size)
    return np.max(np.abs(out[:, 0] - exact))


@pytest.mark.parametrize(("loop", "tolerance"), [("modal", 1e-5), ("mujoco", 1e-3)])
def test_maxwell_slip_in_the_loops(loop, tolerance, measured):
    """A mass rings out in three sliding springs, against an ODE solver whose steps end where one begins to slide."""
    exact = rung_down(slip_rate, 3, 1e-3, 1e-9, 2e-3)
    what = f"ring-down in Maxwell-slip grease, {loop} loop, amplitude {np.max(np.abs(exact)):.1f} m: largest error"
    measured.below(what, largest_error(loop, 1e-3, SLIP, 0.05, exact), tolerance, "ODE solver at 1e-9", "m")


STRIBECK = dataclasses.replace(SLIP, static_ratio=1.5, stribeck_speed=0.4)


def stribeck_rate(_, y):
    """Sliders that creep at 1e5 times the excess of their springs' deflection: a penalty, not a limit."""
    limits = np.array([0.4, 1.0, 1.5]) * (1 + 0.5 * np.exp(-((y[1] / 0.4) ** 2)))
    excess = y[2:] - np.clip(y[2:], -limits, limits)
    return [y[1], -(0.4 * y[0] + SLIP.springs @ y[2:] + 0.05 * y[1]), *(y[1] - 1e5 * excess)]


@pytest.mark.parametrize("loop", ["modal", "mujoco"])
def test_stribeck_in_the_loops(loop, measured):
    """A mass rings out in sliding springs whose friction falls with speed, against sliders by a stiff penalty."""
    exact = rung_down(stribeck_rate, 3, 1e-3, 1e-8, 0.01, "LSODA")
    assert np.max(np.abs(exact - rung_down(slip_rate, 3, 1e-3, 1e-9, 2e-3))) > 0.1  # what Stribeck's law changes
    what = f"ring-down in Maxwell-slip grease with Stribeck's law, {loop} loop: largest error"
    measured.below(what, largest_error(loop, 1e-3, STRIBECK, 0.05, exact), 1e-3, "LSODA with a penalty of 1e5", "m")


def ring_down_error(loop, step):
    """Largest error, in m, of a mass that rings out in Bouc-Wen grease with a squeeze film, against an ODE solver."""
    exact = rung_down(film_rate, 1, step, 1e-10, 0.02)
    assert np.max(np.abs(exact)) > 1.7  # into the yielding and the thin film
    return largest_error(loop, step, FILM, 0.1, exact)


@pytest.mark.parametrize(("loop", "tolerance"), [("modal", 1e-6), ("mujoco", 1e-3)])
def test_grease_in_the_loops(loop, tolerance, measured):
    """The compiled loop is of second order; MuJoCo's takes the damping force at a velocity half a step old."""
    what = f"ring-down in Bouc-Wen grease with squeeze film, {loop} loop, amplitude 1.9 m: largest error"
    measured.below(what, ring_down_error(loop, 1e-3), tolerance, "ODE solver at 1e-10", "m")


@pytest.mark.parametrize("loop", ["modal", "mujoco"])
def test_small_motion_of_the_benchmark(loop, measured):
    """Noël & Schoukens (2016): m = 2 kg, c = 10 N s/m, k = α = 5e4 N/m; f0 = 35.588 Hz, ζ = 1.118 %.

    At 1 nm the hysteresis is a spring, whatever β and γ; those of the set (γ = -1.4 β) are refused as not dissipative.
    The mass here is 1 kg, so all is divided by two.
    """
    step, f0, ratio = 4e-6, 35.588, 0.01118
    grease = Grease(5e4, 5.0, elastic_ratio=0.5, beta=1.0, exponent=1.0)
    x = FreeMass(loop, models.ConstantLaw(1.0, 0.0), 1.0, step, 1e-9, 0.0, grease).simulate(75_000)[:, 0]
    crossing = upward_crossings(x)
    period, turns = np.mean(np.diff(crossing)) * step, crossing.astype(int)
    decay = -np.mean(np.diff(np.log(np.array([x[a:b].max() for a, b in zip(turns[:-1], turns[1:])])))) / period
    omega = np.hypot(2 * np.pi / period, decay)
    what, source = f"Bouc-Wen benchmark in small motion, {loop} loop", "Noël & Schoukens 2016"
    measured.equal(f"{what}: f0 (Hz)", omega / (2 * np.pi), f0, source, abs=5e-4)
    measured.equal(f"{what}: ζ", decay / omega, ratio, source, abs=5e-6)
