"""Forces that the engines report, recomputed from the displacements they report, step by step.

The bushings are so short that both ends touch at once, and sit where the chain of links is as high as the shaft it
stands for: then k gap(x) + c ẋ and the grease's law can be evaluated on the output.
"""

import dataclasses

import numpy as np
import pytest

from clearance_mj.clearance import AmplitudeLaw, ConstantLaw, ContactLaw, HuntCrossley, KelvinVoigt, TimeLaw
from clearance_mj.core.errors import LawError
from clearance_mj.engines import get_engine
from clearance_mj.rig import Grease

from ..conftest import TABLE1 as LOADED
from .alike import at_every_step

POSITIONS = 0.55 + 0.05 / np.sqrt(12), 0.8 - 0.05 / np.sqrt(12)
GAPS = np.array([1e-4, 3e-4])
SHORT = [dataclasses.replace(b, length=1e-6) for b in LOADED.bushings]
SHORT = tuple(dataclasses.replace(b, position=x, gap=d) for b, x, d in zip(SHORT, POSITIONS, GAPS))
RIG = LOADED.replace(bushings=SHORT)


@dataclasses.dataclass
class Motion:
    time: np.ndarray
    x: np.ndarray  #: (n, 2) displacement
    contact: np.ndarray
    grease: np.ndarray
    step: float

    @property
    def penetration(self):
        return np.sign(self.x) * np.maximum(np.abs(self.x) - GAPS, 0)

    def speed(self, engine):
        """Of the first displacement to the last but one: as the engines of MuJoCo know it, or central differences."""
        before = np.diff(self.x, axis=0, prepend=0.0)[:-1] / self.step
        return before if engine != "modal" else (before + np.diff(self.x, axis=0) / self.step) / 2


def simulate(engine, law, duration=0.4, level=8.0, rig=RIG):
    """Output at every step, without interpolation and decimation."""
    motion = Motion(*at_every_step(rig, engine, law, level, duration, cuts=7))
    assert np.all(np.mean(motion.penetration != 0, axis=0) > 0.05)
    assert np.all(motion.penetration.min(axis=0) < 0) and np.all(motion.penetration.max(axis=0) > 0)
    return motion


def assert_close(computed, expected, tolerance, norm=np.max):
    for j in range(2):
        assert norm(np.abs(computed - expected)[:, j]) < tolerance * norm(np.abs(expected)[:, j])


def rms(values):
    return np.sqrt(np.mean(values**2))


TOLERANCE = {"links": 1e-3, "modal": 3e-3}
"""Links turn in space; the compiled engine takes its velocity within its own step"""
SPRING = {**TOLERANCE, "modal": 1e-9}  # Without dampers
NO_FORCE = {"links": 2e-3, "modal": 1e-12}
"""N; MuJoCo: what is left of the other bushing's force when the solver's joint forces are shared among points"""


@pytest.mark.parametrize("c", [np.zeros(2), np.array([5.0, 9.0])], ids=["spring", "spring and damper"])
def test_contact_force(engine, c):
    """k g + c ġ during contact, and never a pull."""
    k = np.array([2e4, 7e3])
    motion = simulate(engine, ConstantLaw(k, c))
    side, speed = np.sign(motion.penetration)[:-1], motion.speed(engine)
    expected = side * np.maximum(side * (k * motion.penetration[:-1] + c * speed), 0)
    assert np.min(motion.contact * np.sign(motion.penetration)) > -NO_FORCE[engine]
    if c.any():
        assert_close(motion.contact[:-1], expected, TOLERANCE[engine], rms)
        assert np.count_nonzero((expected == 0) & (side != 0)) > 20  # inside the wall, and the damper would pull
    else:
        assert_close(motion.contact[:-1], expected, SPRING[engine])
        assert np.max(np.abs(motion.contact[motion.penetration == 0])) < NO_FORCE[engine]


def test_force_of_linear_grease(engine):
    motion = simulate(engine, ConstantLaw(2e4, 3.0))
    expected = 4369.0 * motion.x[:-1] + 3.0 * motion.speed(engine)
    assert_close(motion.grease[:-1], expected, 1e-3 if engine == "modal" else 1e-12)


def test_force_of_bouc_wen_grease_with_a_squeeze_film(engine):
    """φ = λkx + (1-λ)kz + c ẋ/max(1-|x|/h, ε)²; z by Runge-Kutta over every step, the motion straight between two."""
    grease = (
        Grease(5e3, 2.0, 0.3, 0.9, 2e7, -5e6, 2.0, film_height=8e-4, film_limit=0.7),
        Grease(4e3, 1.0, 0.6, 1.0, 1e4, 3e3, 1.3),
    )
    motion = simulate(engine, ConstantLaw(2e4, 3.0, grease))
    z = np.zeros_like(motion.x)
    for j, g in enumerate(grease):
        for i in range(1, len(z)):
            dx = motion.x[i, j] - motion.x[i - 1, j]

            def slope(z, dx=dx, g=g):
                return g.amplitude * dx - abs(z) ** g.exponent * (g.beta * abs(dx) * np.sign(z) + g.gamma * dx)

            old, k1 = z[i - 1, j], slope(z[i - 1, j])
            k2 = slope(old + k1 / 2)
            k3 = slope(old + k2 / 2)
            z[i, j] = old + (k1 + 2 * k2 + 2 * k3 + slope(old + k3)) / 6
    assert np.all(np.max(np.abs(z), axis=0) > [0.8 * g.yield_displacement for g in grease])
    thin = np.maximum(1 - np.abs(motion.x[:, 0]) / 8e-4, 0.7)
    assert thin.min() == 0.7
    damping = np.column_stack((2.0 / thin**2, np.ones(len(thin))))[:-1]
    k, ratio = np.array([5e3, 4e3]), np.array([0.3, 0.6])
    springs = k * (ratio * motion.x + (1 - ratio) * z)
    expected = springs[:-1] + damping * motion.speed(engine)
    assert_close(motion.grease[:-1], expected, 3e-3 if engine == "modal" else 1e-4)


def test_time_law_acts_in_the_very_step(engine):
    """k jumps at 0.2 s: every step before has the old one, every step from then on the new one."""
    jump = 0.2
    law = TimeLaw([0.0, jump, jump + 1e-9, 1.0], [[1e4, 5e3], [1e4, 5e3], [2e4, 9e3], [2e4, 9e3]], np.zeros(4))
    motion = simulate(engine, law)
    for j, (before, after) in enumerate(((1e4, 2e4), (5e3, 9e3))):
        pressed = np.abs(motion.penetration[:, j]) > 5e-5
        stiffness = motion.contact[pressed, j] / motion.penetration[pressed, j]
        late = motion.time[pressed] > jump
        assert late[0] == 0 and late[-1] == 1
        np.testing.assert_allclose(stiffness, np.where(late, after, before), rtol=5e-3)
    # The outer bushing touches across the jump, so that the very step is seen.
    assert np.all(np.abs(motion.penetration[np.abs(motion.time - jump) < 1.5 * motion.step, 1]) > 1e-5)


def test_amplitude_law_follows_the_envelope(engine):
    """A ← max(|x|, A e^(-h/τ)) at every step, k interpolated over A of the bushing's own middle."""
    amplitude, k = [2e-4, 8e-4, 3e-3], np.array([[5e3, 2e4], [2e4, 8e3], [3e4, 4e3]])
    motion = simulate(engine, AmplitudeLaw(amplitude, k, np.zeros(3), release=0.02))
    envelope, held = np.empty_like(motion.x), np.zeros(2)
    for i, x in enumerate(np.abs(motion.x)):
        held = envelope[i] = np.maximum(x, held * np.exp(-motion.step / 0.02))
    stiffness = np.column_stack([np.interp(envelope[:, j], amplitude, k[:, j]) for j in range(2)])
    assert np.all(np.ptp(stiffness, axis=0) > 5e3)
    assert_close(motion.contact, stiffness * motion.penetration, SPRING[engine])


def test_hunt_crossley_remembers_the_impact_speed(engine):
    """K δ^1.5 (1 + κ δ̇/v) with v the speed of the first step in contact, half of K at each of the two ends."""
    motion = simulate(engine, ContactLaw(HuntCrossley(8e5, 0.6, first_order=True)))
    speed, expected = motion.speed(engine), np.zeros_like(motion.x[:-1])
    for j in range(2):
        impact = 0.0
        for i, (g, v) in enumerate(zip(motion.penetration[:-1, j], speed[:, j])):
            if g == 0:
                impact = 0.0
                continue
            impact = impact or abs(v)
            expected[i, j] = 8e5 * abs(g) ** 1.5 * max(1 + 0.6 * np.sign(g) * v / impact, 0) * np.sign(g)
    assert_close(motion.contact[:-1], expected, 10 * TOLERANCE[engine], rms)


def test_adhesion():
    """The compiled engine lets the damper pull; k g + c ġ holds throughout the contact."""
    k, c = 2e4, 20.0
    motion = simulate("modal", ContactLaw(KelvinVoigt(k, c, adhesion=True)))
    expected = k * motion.penetration[:-1] + c * motion.speed("modal") * (motion.penetration[:-1] != 0)
    assert_close(motion.contact[:-1], expected, 3e-3, rms)
    pull = -motion.contact * np.sign(motion.penetration)
    assert np.all(pull.max(axis=0) > 0.2)


def test_mujoco_refuses_adhesion():
    models = (KelvinVoigt(2e4, 20.0), KelvinVoigt(2e4, 20.0, adhesion=True))
    with pytest.raises(LawError, match="the links engine cannot simulate adhesion: MuJoCo's contacts never pull"):
        get_engine("links").start(RIG, ContactLaw(models), "base", 1e-5)


def test_a_law_without_stiffness_switches_the_contact_off(engine):
    assert np.max(np.abs(simulate(engine, ConstantLaw(0.0, 0.0)).contact)) < 1e-5  # N; MuJoCo: a mass of 1e-8 kg
