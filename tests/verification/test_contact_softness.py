"""Contact softness in MuJoCo. Contacts and tendon limits with `solref_solimp`: springs and dampers.

Small MJCF models; nothing of the engines but the mapping.
"""

import mujoco
import numpy as np
import pytest

from clearance_mj import LawError, solref_solimp

from ..refusals import assert_refused

RELEASED = {0.1: 0.744079, 0.2: 0.571740, 0.3: 0.450975, 0.5: 0.298436}
MASS, STIFFNESS = 0.7, 2e4
OMEGA = np.sqrt(STIFFNESS / MASS)


def sphere_on_plane(gravity, timestep, height):
    """A sphere that can only rise and sink; its pair with the floor is the contact."""
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>
      <option timestep="{timestep}" gravity="0 0 {-gravity}" integrator="Euler" cone="elliptic"/><worldbody>
        <geom name="floor" type="plane" size="1 1 1"/><body pos="0 0 {0.1 + height}"><joint type="slide" axis="0 0 1"/>
          <geom name="ball" type="sphere" size="0.1" mass="{MASS}"/></body></worldbody>
      <contact><pair geom1="floor" geom2="ball" condim="1"/></contact></mujoco>""")
    return model, model.pair_solref, model.pair_solimp, model.body_invweight0[1, 0]


def mass_on_tendon(gravity, timestep, height):
    """Two masses on slides; a fixed tendon with coefficients ±1/2, as of a mode shape, has a lower limit."""
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>
      <option timestep="{timestep}" gravity="0 0 {-gravity}" integrator="Euler"/><worldbody>
        <body pos="0 0 0"><joint name="up" type="slide" axis="0 0 1"/><geom size="0.1" mass="{MASS / 2}"/></body>
        <body pos="1 0 0"><joint name="down" type="slide" axis="0 0 -1"/><geom size="0.1" mass="{MASS / 2}"/></body>
      </worldbody><tendon><fixed limited="true" range="{-height} 9">
          <joint joint="up" coef="0.5"/><joint joint="down" coef="-0.5"/></fixed></tendon></mujoco>""")
    return model, model.tendon_solref_lim, model.tendon_solimp_lim, model.tendon_invweight0[0]


def name_of(make):
    return make.__name__.replace("_", " ")


all_models = pytest.mark.parametrize("make", [sphere_on_plane, mass_on_tendon], ids=lambda make: make.__name__)


def soften(solref, solimp, inverse_inertia, stiffness, damping, **impedance):
    solref[0], solimp[0] = solref_solimp(stiffness, damping, inverse_inertia, **impedance)


def damping(ratio):
    return 2 * ratio * np.sqrt(STIFFNESS * MASS)


def run(model, height, speed, steps):
    """Height over the floor or limit, and velocity. Both models have one way to move: all joints alike."""
    data = mujoco.MjData(model)
    data.qvel[:] = speed * np.array([1, -1])[: model.nv]
    rows = np.empty((steps, 2))
    for row in rows:
        mujoco.mj_step(model, data)
        row[:] = height + data.qpos[0], data.qvel[0]
    return rows.T


@all_models
def test_static_penetration(make, measured):
    """m g / k; at rest, long after a small drop, nothing of the impedance is left in it."""
    model, *contact = make(9.81, 1e-4, 0.0)
    soften(*contact, STIFFNESS, damping(0.5))
    what, penetration = f"static penetration, {name_of(make)} (m)", -run(model, 0.0, 0.0, 6000)[0, -1]
    measured.equal(what, penetration, MASS * 9.81 / STIFFNESS, "m g/k", rel=1e-6)


@all_models
@pytest.mark.parametrize(("ratio", "expected"), RELEASED.items())
def test_restitution(make, ratio, expected, measured):
    """Kelvin-Voigt contact that never pulls: exp[-(b/w)(π - atan2(2bw, w² - b²))] within 0.2 %."""
    model, *contact = make(0.0, 2e-3 / OMEGA, 1e-4)
    soften(*contact, STIFFNESS, damping(ratio))
    height, velocity = run(model, 1e-4, -0.5, 8000)
    assert np.min(height) < 0 < height[-1]
    what, source = f"restitution, {name_of(make)}, ζ = {ratio}", "closed form, release where the force is zero"
    measured.equal(what, -velocity[-1] / velocity[0], expected, source, rel=2e-3)


def ring_down_periods(make, c, **impedance):
    """Three periods of a mass that stays in contact, dt = 1e-4 s."""
    model, *contact = make(9.81, 1e-4, 0.0)
    soften(*contact, STIFFNESS, c, **impedance)
    height, rest = run(model, 0.0, 0.0, 5000)[0], -MASS * 9.81 / STIFFNESS
    up = np.flatnonzero((height[:-1] < rest) & (height[1:] >= rest))[:4]
    return np.diff(up + (rest - height[up]) / (height[up + 1] - height[up])) * 1e-4


@all_models
def test_ring_down(make, measured):
    """√(k/m) √(1-ζ²), within 2e-4; k = 2e4, c = 6."""
    expected = 2 * np.pi / (OMEGA * np.sqrt(1 - (6.0 / damping(1.0)) ** 2))
    what, source = f"period of ringing in contact, {name_of(make)}: error of three", "2π/(√(k/m) √(1-ζ²))"
    measured.below(what, np.max(np.abs(ring_down_periods(make, 6.0) / expected - 1)), 2e-4, source)


@all_models
def test_ring_down_at_the_default_impedance(make, measured):
    """d = 0.9 adds μ = 9 m to the mass: the frequency is √(1-d) of what it should be, 68 % too low."""
    what, period_ratio = f"frequency of ringing in contact, {name_of(make)}, d = 0.9, over √(k/m)", 2 * np.pi / OMEGA
    period_ratio /= np.mean(ring_down_periods(make, 6.0, impedance=0.9))
    measured.equal(what, period_ratio, np.sqrt(0.1), "√(1-d): 68 % low", rel=2e-3)


@all_models
def test_standard_softness_is_wrong(make):
    """What MuJoCo makes of the same solref with its own default solimp: another stiffness."""
    model, solref, solimp, inverse_inertia = make(9.81, 1e-4, 0.0)
    default = solimp[0].copy()
    soften(solref, solimp, inverse_inertia, STIFFNESS, damping(0.5))
    solimp[0] = default
    assert abs(-run(model, 0.0, 0.0, 6000)[0, -1] / (MASS * 9.81 / STIFFNESS) - 1) > 0.5


def test_force_is_exact():
    """f = k r + c ṙ - μ a with μ = d/((1-d)Â), to rounding, on any motion."""
    rng = np.random.default_rng(1)
    for _ in range(20):
        stiffness, c, ratio = 10 ** rng.uniform(3, 6), 10 ** rng.uniform(-1, 2), rng.uniform(1e-4, 0.9)
        model, *contact = sphere_on_plane(9.81, 1e-5, 0.0)
        soften(*contact, stiffness, c, impedance=ratio)
        data = mujoco.MjData(model)
        data.qpos[0], data.qvel[0] = -rng.uniform(1e-4, 1e-3), -rng.uniform(0, 1)
        mujoco.mj_forward(model, data)
        expected = -stiffness * data.qpos[0] - c * data.qvel[0] - ratio / (1 - ratio) / contact[2] * data.qacc[0]
        assert data.qfrc_constraint[0] == pytest.approx(expected, rel=1e-9)


def test_shapes():
    solref, solimp = solref_solimp(np.ones((3, 4)) * 1e4, [0.0, 1.0, 2.0, 3.0], 2.0, impedance=0.5)
    assert solref.shape == (3, 4, 2)
    np.testing.assert_allclose(solref[1], np.array([[-1e4, 0], [-1e4, -1], [-1e4, -2], [-1e4, -3]]), atol=1e-12)
    np.testing.assert_array_equal(solimp, [0.5, 0.5, 1, 0.5, 1])
    assert solref_solimp(1.0, 1.0, 1.0)[0].shape == (2,)


@pytest.mark.parametrize(("arguments", "message"), [
    ((0.0, 1.0, 1.0), "k = 0"),
    (([1e4, -1.0], 1.0, 1.0), "k = -1"),
    ((1e4, -1.0, 1.0), "c = -1"),
    ((1e4, 1.0, 0.0), "inverse_inertia = 0"),
    ((np.nan, 1.0, 1.0), "k = nan"),
    ((1e4, np.inf, 1.0), "c = inf"),
    ((1e4, 1.0, 1.0, 0.0), "impedance 0 lies outside"),
    ((1e4, 1.0, 1.0, 1.0), "impedance 1 lies outside"),
    ((1e4, 1.0, 1.0, np.nan), "impedance nan lies outside"),
])  # fmt: skip
def test_refusals(arguments, message):
    assert_refused(LawError, message, solref_solimp, *arguments)
