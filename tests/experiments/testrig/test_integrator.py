"""The virtual rig's integrator. Its steps, impacts, energy and grease against closed forms and Runge-Kutta."""

import numpy as np
import pytest
import scipy.integrate
import scipy.linalg
import scipy.optimize

from clearance_mj.rig import Beam
from experiments.testrig import BoucWen, Iwan, LuGre, Truth, integrator
from experiments.testrig.bench import greases
from experiments.testrig.fem import FiniteElements, Points

from ...conftest import dense

FIRST = Points(np.array([0]), np.array([[1.0, 0.0, 0.0, 0.0]]))
HYSTERESES = [BoucWen(), Iwan(4e-4), LuGre(2e-4, 3e-4, 0.02, 0.5)]
BEAM = Beam(length=0.8, young_modulus=70e9, density=2700.0, diameter=0.01, rayleigh=(3.0, 2e-5))


def no_contact():
    return integrator.Contacts(*np.zeros((5, 0)))


def no_points():
    return Points(np.zeros(0, dtype=np.int64), np.zeros((0, 4)))


def test_one_step_solves_the_equation_of_motion(no_grease):
    """M a + C v + K u = load after a step from a random state, with Newmark's relations between u, v and a."""
    elements, rng = FiniteElements.of_shaft(BEAM, elements=6), np.random.default_rng(0)
    load, h = rng.standard_normal(elements.count), 1e-4
    scheme = integrator.scheme(elements, load, no_points(), h, beta=0.3, gamma=0.6)
    motion = integrator.at_rest(elements, load, no_points(), no_grease)
    u, v, a = (rng.standard_normal(elements.count) * s for s in (1e-6, 1e-3, 1.0))
    motion.displacement[:], motion.velocity[:], motion.acceleration[:] = u, v, a
    assert integrator.step(scheme, motion, no_contact(), no_grease, 2.0)
    m, k, new = dense(elements.mass), dense(elements.stiffness), motion.acceleration
    inner = k @ motion.displacement
    balance = m @ new + (BEAM.rayleigh[0] * m + BEAM.rayleigh[1] * k) @ motion.velocity + inner - 2.0 * load
    assert np.abs(balance).max() < 1e-10 * np.abs(inner).max()
    np.testing.assert_allclose(motion.velocity, v + h * (0.4 * a + 0.6 * new), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(motion.displacement, u + h * v + h**2 * (0.2 * a + 0.3 * new), rtol=1e-9, atol=1e-15)


def test_starts_with_the_acceleration_of_its_load(no_grease):
    elements = FiniteElements.of_shaft(BEAM)
    motion = integrator.at_rest(elements, elements.inertia, no_points(), no_grease, excitation=-3.0)
    expected = scipy.linalg.solveh_banded(elements.mass, -3.0 * elements.inertia, lower=True)
    np.testing.assert_allclose(motion.acceleration, expected, rtol=1e-8, atol=1e-6)


def test_second_order(no_grease, measured):
    """Free decay of the first mode against its closed form: a quarter of the error at half the step."""
    elements = FiniteElements.of_shaft(BEAM, elements=8)
    values, shapes = scipy.linalg.eigh(dense(elements.stiffness), dense(elements.mass))
    decay = (BEAM.rayleigh[0] + BEAM.rayleigh[1] * values[0]) / 2
    damped, end = np.sqrt(values[0] - decay**2), 5.2 * 2 * np.pi / np.sqrt(values[0])
    exact = np.exp(-decay * end) * (np.cos(damped * end) + decay / damped * np.sin(damped * end))
    errors = []
    for steps in (1000, 2000):
        scheme = integrator.scheme(elements, elements.inertia, no_points(), end / steps)
        motion = integrator.at_rest(elements, elements.inertia, no_points(), no_grease)
        motion.displacement[:], motion.acceleration[:] = shapes[:, 0], -values[0] * shapes[:, 0]
        for _ in range(steps):
            integrator.step(scheme, motion, no_contact(), no_grease, 0.0)
        errors.append(abs(motion.displacement[-2] / shapes[-2, 0] - exact))
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.02)
    order = np.log2(errors[0] / errors[1])
    measured.equal("virtual rig, free decay of the first mode: order", order, 2, "e^{-δt} cos ω_d t", abs=0.03)


def impact(elements, no_grease, speed, stiffness, dissipation, step):
    """Throw the first of the free masses at a Hertz stop; speed after it, and time in contact."""
    load = np.zeros(elements.count)
    scheme = integrator.scheme(elements, load, FIRST, step)
    motion = integrator.at_rest(elements, load, FIRST, no_grease)
    motion.velocity[0], motion.displacement[0] = speed, 0.9999e-3
    contacts = integrator.Contacts(*np.array([[1e-3], [0.0], [stiffness], [1.5], [dissipation]]))
    touching = 0
    while motion.velocity[0] > 0 or motion.displacement[0] > 0.999e-3:
        assert integrator.step(scheme, motion, contacts, no_grease, 0.0)
        touching += motion.force[0] != 0
    return -motion.velocity[0], touching * step


@pytest.mark.parametrize("speed", [0.05, 0.4])
@pytest.mark.parametrize("dissipation", [0.0, 0.5, 2.0])
def test_restitution(free_masses, no_grease, speed, dissipation, measured):
    """κ (1 + e) = ln[(1 + κ) / (1 - κ e)] with κ = 1.5 α v (Hertz-damped, κ δ̇/v_i = 1.5 α δ̇)."""
    after, _ = impact(free_masses, no_grease, speed, 3e5, dissipation, 2e-6)
    kappa = 1.5 * dissipation * speed
    if not kappa:
        assert after == pytest.approx(speed, rel=1e-6)
        return
    equation = lambda e: kappa * (1 + e) - np.log((1 + kappa) / (1 - kappa * e))  # noqa: E731
    expected = scipy.optimize.brentq(equation, 1e-6, min(1, 1 / kappa) - 1e-9)
    what = f"virtual rig, restitution at {speed} m/s, α = {dissipation} s/m"
    measured.equal(what, after / speed, expected, "κ(1 + e) = ln[(1 + κ)/(1 - κe)]", abs=1e-5)


def test_hertz_impact_duration(free_masses, no_grease, measured):
    """2.943275 δ_max / v with δ_max = (5 m v² / 4 K)^(2/5) (Goldsmith, Impact, 1960, eq. 4.32)."""
    mass, speed, stiffness = 0.7, 0.2, 3e5
    _, duration = impact(free_masses, no_grease, speed, stiffness, 0.0, 2e-6)
    depth = (5 * mass * speed**2 / (4 * stiffness)) ** 0.4
    expected, source = 2.943275 * depth / speed, "Goldsmith 1960, eq. 4.32"
    measured.equal("virtual rig, duration of a Hertz impact (s)", duration, expected, source, rel=1e-3)


@pytest.mark.parametrize("hysteresis", HYSTERESES)
def test_energy_balance(rig, hysteresis, measured):
    """What the base gives is stored, or spent in damping and bushings, to the last digit (average acceleration).

    Exact for the discrete motion: ΔE = Δu·(f₀ + f₁)/2 - h v̄·C v̄ with v̄ = Δu/h.
    """
    elements = FiniteElements.of_shaft(rig.beam, rig.point_masses)
    bushings = [x for b in rig.bushings for x in b.ends] + [b.position for b in rig.bushings]
    points, load, h = elements.points(bushings), -elements.inertia, 1 / 65536
    scheme = integrator.scheme(elements, load, points, h)
    contacts = integrator.Contacts(*np.outer((3e-4, 0.0, 1.5e5, 1.5, 1.5), np.ones(4)))
    grease = greases([Truth(hysteresis=hysteresis)] * 2)
    motion = integrator.at_rest(elements, load, points, grease)
    m, k, at = dense(elements.mass), dense(elements.stiffness), points.dense(elements.count)
    damping = rig.beam.rayleigh[0] * m + rig.beam.rayleigh[1] * k
    given = spent = before = touching = 0.0
    for i in range(1, 6000):
        pulse = 150 * np.sin(np.pi * i / 400) if i < 400 else 0.0
        old, force = motion.displacement.copy(), motion.force.copy()
        assert integrator.step(scheme, motion, contacts, grease, pulse)
        change = motion.displacement - old
        given += load @ change * (before + pulse) / 2
        spent += (at @ change) @ (force + motion.force) / 2 + change @ damping @ change / h
        before = pulse
        touching += np.any(motion.force[:4] != 0)
    stored = (motion.velocity @ m @ motion.velocity + motion.displacement @ k @ motion.displacement) / 2
    assert touching > 500
    what = f"virtual rig with {type(hysteresis).__name__}: energy stored and spent over given"
    measured.equal(what, (stored + spent) / given, 1, "balance of the discrete motion", rel=1e-9)
    assert 0 < stored < given


def bouc_wen_rate(model, z, v):
    slope = model.amplitude - (model.beta * np.sign(z * v) + model.gamma) * np.abs(z) ** model.exponent
    return slope * v, z[0], 0.0


def iwan_rate(model, u, v):
    limits = model.largest_yield * (np.arange(model.elements) + 0.5) / model.elements
    return np.where((np.abs(u) < limits) | (u * v < 0), v, 0.0), np.mean(np.clip(u, -limits, limits)), 0.0


def lugre_rate(model, z, v):
    limit = model.coulomb + (model.static - model.coulomb) * np.exp(-((v / model.stribeck_speed) ** 2))
    rate = v - np.abs(v) * z / limit
    return rate, z[0], model.damping * rate[0]


@pytest.mark.parametrize(("hysteresis", "rate"), list(zip(HYSTERESES, (bouc_wen_rate, iwan_rate, lugre_rate))))
def test_mass_on_grease(free_masses, hysteresis, rate, measured):
    """A mass held by the grease alone and pushed up and down, against Runge-Kutta on the equations as published."""
    truth = Truth(hysteresis=hysteresis, elastic_ratio=0.3)
    grease, mass, push, load = greases([truth]), 0.7, 0.8, np.array([1.0, 0.0, 0.0, 0.0])
    steps, end = 20000, 0.2
    scheme = integrator.scheme(free_masses, load, FIRST, end / steps)
    motion = integrator.at_rest(free_masses, load, FIRST, grease)
    time, displacement = np.arange(1, steps + 1) * end / steps, np.empty(steps)
    for i, t in enumerate(time):
        assert integrator.step(scheme, motion, no_contact(), grease, push * np.sin(2 * np.pi * 11 * t))
        displacement[i] = motion.displacement[0]

    def equations(t, y):
        x, v = y[:2]
        change, z, bristle = rate(hysteresis, y[2:], v)
        held = truth.grease_stiffness * (0.3 * x + 0.7 * z) + bristle
        film = truth.film_damping * v / max(1 - abs(x) / truth.film_height, truth.film_limit) ** 2
        return np.concatenate(([v, (push * np.sin(2 * np.pi * 11 * t) - held - film) / mass], change))

    start = np.zeros(2 + hysteresis.states)
    options = {"rtol": 1e-8, "atol": 1e-12, "max_step": 1e-4, "t_eval": time[99::100]}
    expected = scipy.integrate.solve_ivp(equations, (0, end), start, **options).y[0]
    assert np.abs(expected).max() > 2e-4  # well beyond the yield
    error = np.abs(displacement[99::100] - expected).max() / np.abs(expected).max()
    what = f"virtual rig, mass on {type(hysteresis).__name__} grease: largest error over amplitude"
    measured.below(what, error, 2e-4, "Runge-Kutta on the published equations")
