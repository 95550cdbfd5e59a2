"""The shaft in two bushings with clearance. Every engine against an ODE solver.

The reference, written here, has 24 cantilever modes, its matrices by quadrature, Kelvin-Voigt contacts at both ends of
both bushings that never pull, and linear grease. Impacting systems are chaotic: trajectories are compared over 30 ms of
contact.
"""

import functools

import numpy as np
import pytest
import scipy.integrate

from clearance_mj import Excitation, Links, Modal, simulate
from clearance_mj.clearance import ConstantLaw, ContactLaw, HuntCrossley

from ..conftest import TABLE1 as RIG
from .modal_mj import ModalMujoco

STIFFNESS, DAMPING = 2e4, 3.0
FS, DURATION, RAMP = 8192.0, 0.11, 0.02
"""A rate at which the anti-alias filter leaves impacts alone; excitation that rises smoothly from rest"""

_generator = np.random.default_rng(14)
TONES = _generator.uniform(5, 220, 60), _generator.uniform(0, 2 * np.pi, 60)


def base_acceleration(t):
    """Sixty tones of 4 m/s² rms in all, faded in over 20 ms."""
    t = np.asarray(t, dtype=float)
    frequency, phase = TONES
    tones = 4.0 * np.sqrt(2 / 60) * np.sum(np.cos(2 * np.pi * np.multiply.outer(t, frequency) + phase), axis=-1)
    return tones * np.where(t < RAMP, np.sin(np.pi / 2 * t / RAMP) ** 2, 1.0)


def mode(x, i):
    """Cantilever mode by its asymptotically stable form; (n_x,)."""
    root = (2 * i - 1) * np.pi / 2
    for _ in range(30):
        root -= (np.cos(root) + 1 / np.cosh(root)) / (-np.sin(root) - np.sinh(root) / np.cosh(root) ** 2)
    sigma = (np.cosh(root) + np.cos(root)) / (np.sinh(root) + np.sin(root))
    # cosh - σ sinh = ((1 - σ) e^{βx} + (1 + σ) e^{-βx})/2 with 1 - σ = (sin λ - cos λ - e^{-λ})/(sinh λ + sin λ)
    rest = (np.sin(root) - np.cos(root) - np.exp(-root)) / (np.sinh(root) + np.sin(root))
    grown = (rest * np.exp(root * x) + (2 - rest) * np.exp(-root * x)) / 2
    return grown - np.cos(root * x) + sigma * np.sin(root * x), root


class Reference:
    """M p̈ + C ṗ + K p = -Γ a - Σ Y(x) f."""

    def __init__(self, modes=24):
        shaft, (mass,) = RIG.beam, RIG.masses
        node, weight = np.polynomial.legendre.leggauss(400)
        x = (node + 1) / 2
        shapes, roots = zip(*(mode(x, i) for i in range(1, modes + 1)))
        tip = self.at(1.0, modes)
        product = np.array(shapes) * weight / 2
        matrix = shaft.mass_per_length * product @ np.array(shapes).T + mass.mass * np.outer(tip, tip)
        stiffness = np.diag(shaft.bending_stiffness * np.array(roots) ** 4)
        load = shaft.mass_per_length * product.sum(axis=1) + mass.mass * tip
        damping = shaft.rayleigh[0] * matrix + shaft.rayleigh[1] * stiffness
        self.middles = np.array([self.at(b.position, modes) for b in RIG.bushings])
        self.ends = np.array([self.at(x, modes) for b in RIG.bushings for x in b.ends])
        self.gaps = np.repeat([b.gap for b in RIG.bushings], 2)
        for bushing, at in zip(RIG.bushings, self.middles):
            stiffness = stiffness + bushing.grease.stiffness * np.outer(at, at)
            damping = damping + bushing.grease.damping * np.outer(at, at)
        inverse = np.linalg.inv(matrix)
        self.matrix = -inverse @ np.hstack((stiffness, damping))
        self.load, self.from_ends = inverse @ load, inverse @ self.ends.T

    @staticmethod
    def at(x, modes):
        return np.array([mode(np.array([x]), i)[0][0] for i in range(1, modes + 1)])

    def contact_forces(self, p, v):
        """Force on each bushing end, N, against positive displacement."""
        x, speed = p @ self.ends.T, v @ self.ends.T
        side = np.where(np.abs(x) > self.gaps, np.sign(x), 0.0)
        return side * np.maximum(STIFFNESS / 2 * (np.abs(x) - self.gaps) + DAMPING / 2 * side * speed, 0.0)

    def rate(self, t, y):
        p, v = np.split(y, 2)
        acceleration = self.matrix @ y - self.load * base_acceleration(t) - self.from_ends @ self.contact_forces(p, v)
        return np.concatenate((v, acceleration))

    def solve(self, t):
        """Displacement and contact force at both bushings."""
        start = np.zeros(2 * self.load.size)
        solution = scipy.integrate.solve_ivp(self.rate, (0, t[-1]), start, "DOP853", t, rtol=1e-9, atol=1e-12)
        assert solution.success
        p, v = np.split(solution.y, 2)
        return self.middles @ p, self.contact_forces(p.T, v.T).reshape(t.size, 2, 2).sum(axis=2).T


TIME = np.arange(round(FS * DURATION)) / FS
EXCITATION = Excitation(base_acceleration(TIME), FS)


def contact_window(displacement):
    """The 30 ms from the first contact; both bushings must be hit in them."""
    touched = np.abs(displacement) > [[b.gap] for b in RIG.bushings]
    first = np.flatnonzero(touched.any(axis=0))[0]
    window = slice(first, first + round(0.03 * FS))
    assert touched[:, window].any(axis=1).all()
    assert touched[:, window].shape[1] == round(0.03 * FS) and window.stop < TIME.size
    return window


def error(computed, expected, window):
    """RMS of the difference over RMS, of each bushing."""
    difference = computed[:, window] - expected[:, window]
    return np.sqrt(np.mean(difference**2, axis=1) / np.mean(expected[:, window] ** 2, axis=1))


@functools.cache
def reference():
    return Reference().solve(TIME)


def label(engine):
    return f"{engine.links} links" if isinstance(engine, Links) else engine.name


def test_excitation():
    assert np.std(EXCITATION.value) == pytest.approx(4, abs=0.3)


@pytest.mark.parametrize(("engine", "tolerance"), [
    (Modal(), 1e-3), (ModalMujoco(), 1e-2), (Links(20), 1e-2), (Links(40), 2e-3),
], ids=["modal", "modal-mj", "links-20", "links-40"])  # fmt: skip
def test_displacement(engine, tolerance, measured):
    """Within 1 % over 30 ms of contact motion, and as near from rest to the first contact."""
    expected, expected_force = reference()
    window = contact_window(expected)
    response = simulate(RIG, EXCITATION, ConstantLaw(STIFFNESS, DAMPING), engine)
    what, source = label(engine), "24 modes, ODE solver at 1e-9"
    start, contact = (np.max(error(response.displacement, expected, part)) for part in (slice(0, window.start), window))
    measured.below(f"{what}: displacement from rest to the first contact, RMS error", start, tolerance, source)
    measured.below(f"{what}: displacement over 30 ms of contact, RMS error", contact, tolerance, source)
    # Forces are the small difference of displacement and gap, and start in steps of c v that the filter rounds off.
    force = np.max(error(response.contact_force, expected_force, window))
    measured.below(f"{what}: contact force over 30 ms, RMS error", force, 5e-2, source)


@pytest.mark.parametrize("engine", [ModalMujoco(), Links(20)], ids=["modal-mj", "links"])
def test_hunt_crossley(engine, measured):
    """A contact model whose k and c change at every step: 1 % from the compiled engine with a fifth of its step."""
    law = ContactLaw(HuntCrossley(1e6, 0.7))
    expected = simulate(RIG, EXCITATION, law, Modal(resolution=0.2))
    window = contact_window(expected.displacement)
    response = simulate(RIG, EXCITATION, law, engine)
    what, source = f"{label(engine)}, Hunt-Crossley", "modal at a fifth of its step"
    moved = np.max(error(response.displacement, expected.displacement, window))
    measured.below(f"{what}: displacement over 30 ms of contact, RMS error", moved, 1e-2, source)
    force = np.max(error(response.contact_force, expected.contact_force, window))
    measured.below(f"{what}: contact force over 30 ms, RMS error", force, 5e-2, source)
