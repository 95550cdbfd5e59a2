"""Contacts and limits in physical units, on small models whose forces, frequencies and steps are known."""

import mujoco
import numpy as np
import pytest

from clearance_mj import physical
from clearance_mj.core.errors import LawError, ModelError
from clearance_mj.physical.rows import softness_of

from ..processes import run
from .arm import C, K, arm
from .stepping import mass_matrix, with_data


def torque(model, elbow, speed=0.0, shoulder=0.2):
    """Constraint force at the elbow, and its acceleration."""
    data = mujoco.MjData(model)
    data.qpos[:2], data.qvel[1] = (shoulder, elbow), speed
    mujoco.mj_forward(model, data)
    return data.qfrc_constraint[1], data.qacc[1]


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicitfast"])
@pytest.mark.parametrize("flag", ["", 'refsafe="disable"'])
@pytest.mark.parametrize("kind", ["spec", "model"])
def test_joint_limit(kind, flag, integrator):
    """τ = -(k r + c ṙ) - μ α with μ = d/((1-d)Â) from d = 1e-4 (model) to 2e-4 (specification), in any pose."""
    spec = arm(f'integrator="{integrator}"', flag)
    if kind == "spec":
        physical.joint_limit(spec, "elbow", K, C)
    model = spec.compile()
    if kind == "model":
        physical.joint_limit(model, "elbow", K, C)
    limit, mass = np.deg2rad(90), model.jnt_solimp[1, 0] / (1 - model.jnt_solimp[1, 0]) / model.dof_invweight0[1]
    assert 1e-4 <= model.jnt_solimp[1, 0] <= 2e-4
    for depth, speed, shoulder in ((1e-3, 0.0, 0.0), (0.2, 0.3, 1.0), (0.05, -0.5, -0.7)):
        moment, acceleration = torque(model, limit + depth, speed, shoulder)
        assert moment == pytest.approx(-(K * depth + C * speed) - mass * acceleration, rel=1e-6)
    assert torque(model, limit - 1e-6)[0] == 0


def test_tendon_limit():
    model = arm().compile()
    physical.tendon_limit(model, "sum", K, C)
    data = mujoco.MjData(model)
    data.qpos[:2], data.qvel[:2] = (-1.0, 1.5), (0.1, 0.2)
    mujoco.mj_forward(model, data)
    row = np.array([-1, 0.5])  # out of the lower limit
    force = K * 0.15 + C * 0.0 + 1e-4 / (1 - 1e-4) / model.tendon_invweight0[0] * (row @ data.qacc[:2])
    np.testing.assert_allclose(data.qfrc_constraint[:2], -force * row, rtol=1e-6)


def test_margins_are_gone():
    """MuJoCo's springs begin at the margin; a limit in physical units begins at its range, a contact at the surface."""
    spec = arm()
    physical.joint_limit(spec, "shoulder", K, C)
    physical.contact(spec, ("ball", "ground"), K, C)
    model = spec.compile()
    assert model.jnt_margin[0] == model.pair_margin[0] == 0


def sinking(model, depth=1e-3):
    """Force that lifts the ball while it is held so deep in the ground."""
    data = mujoco.MjData(model)
    data.qpos[4] = -1.9 - depth
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_inverse(model, data)
    return -data.qfrc_inverse[4]


def test_contact():
    spec = arm()
    physical.contact(spec, ("ball", "ground"), K, C)
    assert sinking(spec.compile()) == pytest.approx(K * 1e-3, rel=1e-6)


def test_contacts_of_a_geom():
    """All that MuJoCo would let collide with the ball: both links, the hand and the lower floor."""
    spec = arm()
    physical.contact(spec, "ball", K, C, frictionless=True)
    touched = {frozenset((p.geomname1, p.geomname2)) - {"ball"} for p in spec.pairs}
    assert touched == {frozenset((name,)) for name in ("floor", "upper", "lower", "hand")}
    assert all(p.condim == 1 for p in spec.pairs)
    before = len(spec.texts)
    physical.contact(spec, "ball", 2 * K, C, frictionless=True)  # anew, not twice
    assert (len(spec.pairs), len(spec.texts)) == (4, before)


def test_file_keeps_six_digits_and_the_softness():
    """MJCF numbers have six digits; saved as it is written, the file gives k and c within 1e-6 anywhere."""
    rng = np.random.default_rng(1)
    spec = arm()
    spec.compiler.savecompiled = spec.compiler.savecanonical = False
    for _ in range(10):
        k, c = 10 ** rng.uniform(1, 6), 10 ** rng.uniform(-2, 3)
        physical.joint_limit(spec, ["shoulder", "elbow"], k, c)
        physical.contact(spec, ("ball", "ground"), k, c)
        physical.tendon_limit(spec, "sum", k, c)
        model = mujoco.MjModel.from_xml_string(spec.to_xml())
        rows = (("joint", 0), ("joint", 1), ("pair", 0), ("tendon", 0))
        np.testing.assert_allclose([softness_of(model, *row) for row in rows], [(k, c)] * 4, rtol=1e-6)
        physical.apply(model)
        np.testing.assert_allclose([softness_of(model, *row) for row in rows], [(k, c)] * 4, rtol=1e-14)


def test_softness_follows_changes():
    """Â is of the whole model: whoever adds a mass afterwards compiles with `compile`, or is told by `check`."""
    spec = arm()
    physical.joint_limit(spec, "elbow", K, C)
    spec.body("lower").add_geom(size=[0.1, 0, 0], pos=[0.4, 0, 0], condim=1, contype=0, conaffinity=0)
    stale = spec.compile()
    assert softness_of(stale, "joint", 1)[0] != pytest.approx(K, rel=1e-2)
    assert any('joint limit "elbow" has k = ' in line and "k = 730.123, " in line for line in physical.check(stale))
    model = physical.compile(spec)
    assert softness_of(model, "joint", 1) == pytest.approx((K, C), rel=1e-14)
    assert physical.check(model) == ()


def test_attached_with_a_prefix():
    top = mujoco.MjSpec()
    top.option.timestep = 1e-4
    for i, side in enumerate(("left_", "right_")):
        spec = arm()
        spec.delete(spec.keys[0])
        physical.joint_limit(spec, "elbow", K * (i + 1), C)
        top.attach(spec, prefix=side, frame=top.worldbody.add_frame(pos=[0, i, 0]))
    model = physical.compile(top)
    for side, k in (("left", K), ("right", 2 * K)):
        assert softness_of(model, "joint", model.joint(f"{side}_elbow").id) == pytest.approx((k, C))


@pytest.mark.parametrize("damping", [0.0, 40.0])
def test_largest_step(damping):
    """2/(δ + √(δ² + ω²)) of the inertia behind the limit and μ; ringing grows a hundredth above it, not below."""
    spec = arm()
    physical.joint_limit(spec, "elbow", 1e5, damping)
    model = spec.compile()
    d = model.jnt_solimp[1, 0]
    inverse = 1 / (1 / np.linalg.inv(mass_matrix(model))[1, 1] + d / (1 - d) / model.dof_invweight0[1])
    decay = damping * inverse / 2
    expected = 2 / (decay + np.sqrt(decay**2 + 1e5 * inverse))
    bent = model.qpos0.copy()
    assert physical.largest_step(model, model.qpos0) == pytest.approx(expected, rel=1e-6)
    bent[1] = np.deg2rad(90)
    largest, grown, rest = physical.largest_step(model, bent), [], bent[1] + 1e-3
    for fraction in (0.99, 1.01):
        data = mujoco.MjData(model)
        model.opt.timestep, model.opt.integrator = fraction * largest, mujoco.mjtIntegrator.mjINT_EULER
        model.dof_damping[:] = 0
        data.qpos[1], data.qfrc_applied[1] = rest + 1e-6, 1e5 * 1e-3
        swing = []
        for _ in range(600):
            mujoco.mj_step(model, data)
            swing.append(abs(data.qpos[1] - rest))
        grown.append(max(swing) / 1e-6)
    assert grown[0] < 30 < grown[1]


def test_step_of_contacts():
    """A free ball: ω² = k/(m + μ) touching or not; without softness in physical units there is no limit."""
    spec = arm()
    physical.contact(spec, ("ball", "ground"), 1e6, 0.0)
    model = spec.compile()
    poses = np.tile(model.qpos0, (2, 1))
    poses[1, 4] = -1.91
    d, inverse = model.pair_solimp[0, 0], model.body_invweight0[model.body("ball").id, 0]
    expected = 2 / np.sqrt(1e6 / (model.body("ball").mass[0] + d / (1 - d) / inverse))
    for pose in poses:
        assert physical.largest_step(model, pose) == pytest.approx(expected, rel=1e-6)
    assert physical.largest_step(arm().compile()) == np.inf


CHANGES = {
    "override": (lambda m: setattr(m.opt, "enableflags", 1), "flag override replaces the softness"),
    "diagexact": (lambda m: setattr(m.opt, "enableflags", 1 << 5), "flag diagexact scales stiffness with the pose"),
    "no limits": (lambda m: setattr(m.opt, "disableflags", 1 << 3), "flag limit is disabled"),
    "no contacts": (lambda m: setattr(m.opt, "disableflags", 1 << 4), "flag contact is disabled"),
    "nothing": (lambda m: setattr(m.opt, "disableflags", 1), "flag constraint is disabled"),
    "discrete": (lambda m: setattr(m.opt, "integrator", 4), "integrator discrete"),
    "step": (lambda m: setattr(m.opt, "timestep", 0.1), r"timestep 0\.1 s is too long: .* is stable below 0\.0"),
    "varies": (
        lambda m: m.jnt_solimp.__setitem__((1, 0), 5e-4),
        r'joint limit "elbow": impedance changes from 0\.0005 to 0\.0001',
    ),
    "impedance": (lambda m: m.jnt_solimp.__setitem__((1, [0, 1]), 0.9), r'"elbow": impedance 0\.9 adds a mass'),
    "margin": (lambda m: m.jnt_margin.__setitem__(1, 0.1), r'"elbow": its margin lets the force begin 0\.1 before'),
    "friction": (lambda m: m.pair_dim.__setitem__(0, 3), "in a pyramidal cone multiplies its normal stiffness"),
    "rigid": (lambda m: m.tendon_invweight0.__setitem__(0, 0), r'tendon limit "sum" is rigid'),
    "geom": (lambda m: m.geom_solref.__setitem__((0, 0), -1e4), 'geom "floor" has a solref of its own'),
}


@pytest.mark.parametrize("what", CHANGES)
def test_check(what):
    """One line each; `test_what_check_says_is_so` shows that they are right."""
    change, part = CHANGES[what]
    spec = arm()
    physical.joint_limit(spec, "elbow", K, C)
    physical.tendon_limit(spec, "sum", K, C)
    physical.contact(spec, ("ball", "ground"), K, C)
    model = physical.compile(spec)
    assert physical.check(model) == ()
    change(model)
    (line,) = physical.check(model)
    with pytest.raises(ModelError, match=part):
        raise ModelError(line)


def test_what_check_says_is_so():
    """Cones, exact diagonals and several points change a force that is k r without them."""
    spec = arm()
    physical.contact(spec, ("ball", "ground"), K, C)
    physical.joint_limit(spec, "elbow", K, C)
    model = physical.compile(spec)
    model.pair_dim[0], model.pair_friction[0, :2] = 3, 0.3
    assert sinking(model) > 20 * K * 1e-3
    model.pair_dim[0], model.opt.enableflags = 1, int(mujoco.mjtEnableBit.mjENBL_DIAGEXACT)
    assert torque(model, np.deg2rad(90) + 0.01, shoulder=0.0)[0] != pytest.approx(-K * 0.01, rel=0.05)
    box = mujoco.MjSpec.from_string("""<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1" condim="1"/>
      <body name="b" pos="0 0 0.099"><freejoint/><geom name="box" type="box" size=".1 .1 .1" condim="1"/></body>
      </worldbody></mujoco>""")
    physical.contact(box, ("floor", "box"), K, C)
    model = physical.compile(box)
    says = 'contact "floor - box": plane and box touch in up to 4 points, each with this stiffness'
    assert physical.check(model) == (says,)
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_inverse(model, data)
    assert data.qfrc_inverse[2] + 4 * K * 1e-3 == pytest.approx(9.81 * model.body("b").mass[0], rel=1e-6)


REFUSED = {
    "unknown joint": (lambda s: physical.joint_limit(s, "elbov", K, C), 'no joint "elbov"; did you mean "elbow"'),
    "unknown tendon": (lambda s: physical.tendon_limit(s, "xyz", K, C), 'no tendon "xyz"; it has sum, free'),
    "unknown geom": (lambda s: physical.contact(s, ("ball", "walls"), K, C), 'no geom "walls"'),
    "no limit": (lambda s: physical.tendon_limit(s, "free", K, C), 'tendon "free" has no limits; give it a range'),
    "stiffness": (lambda s: physical.joint_limit(s, "elbow", -1.0, C), "k = -1"),
    "damping": (lambda s: physical.joint_limit(s, "elbow", K, -1.0), "c = -1"),
    "friction": (
        lambda s: physical.contact(s, ("hand", "floor"), K, C),
        r"floor - hand has friction \(condim 3\), and a pyramidal cone multiplies .*: give frictionless=True",
    ),
    "itself": (lambda s: physical.contact(s, ("ball", "ball"), K, C), 'geom "ball" touches itself'),
    "three": (lambda s: physical.contact(s, ("ball", "hand", "floor"), K, C), "a contact has two geoms, got 3"),
    "no pair": (lambda s: physical.contact(s.compile(), ("ball", "ground"), K, C), 'no pair of geoms "ball" and "gr'),
    "not a model": (lambda s: physical.joint_limit("x.xml", "elbow", K, C), "got str, needs a mujoco.MjSpec or"),
    "no name": (lambda s: physical.joint_limit(s, s.body("ball").joints[0], K, C), "has no name"),
    "poses": (lambda s: physical.largest_step(s.compile(), np.zeros(3)), r"poses of shape \(1, 3\)"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_refusals(what):
    act, part = REFUSED[what]
    with pytest.raises((ModelError, LawError), match=part):
        act(arm())


def test_elliptic_friction_is_refused():
    with pytest.raises(ModelError, match="an elliptic cone changes the normal force while it slides"):
        physical.contact(arm('cone="elliptic"'), ("hand", "floor"), K, C)


def test_step_too_long_is_refused():
    spec = arm()
    physical.joint_limit(spec, "elbow", 1e8, C)
    with pytest.raises(ModelError, match=r'timestep 0\.0002 s is too long: joint "elbow" is stable below .*e-05 s'):
        physical.compile(spec)


def test_broken_specification_is_refused():
    spec = arm()
    spec.worldbody.add_body(name="nothing").add_joint(name="loose")
    with pytest.raises(ModelError, match="the specification does not compile"):
        physical.joint_limit(spec, "elbow", K, C)


def test_record_that_is_damaged():
    spec = arm()
    spec.add_text(name="physical:joint:elbow", data="stiff")
    with pytest.raises(ModelError, match='text "physical:joint:elbow" holds "stiff", needs "k=STIFFNESS c=DAMPING"'):
        physical.apply(spec)


@pytest.mark.parametrize(("ratio", "expected"), {0.1: 0.744079, 0.3: 0.450975, 0.5: 0.298436}.items())
def test_restitution(ratio, expected):
    """exp[-(b/w)(π - atan2(2bw, w² - b²))], b = ζω, w = ω√(1-ζ²): a contact that never pulls, within 0.2 %."""
    spec = arm()
    mass = spec.compile().body("ball").mass[0]
    physical.contact(spec, ("ball", "ground"), 2e4, 2 * ratio * np.sqrt(2e4 * mass))
    spec.option.timestep = 2e-3 / np.sqrt(2e4 / mass)
    model, data = with_data(physical.compile(spec))
    data.qpos[4], data.qvel[4] = -1.89999, -0.5
    mujoco.mj_step(model, data, 4000)
    assert data.qpos[4] > -1.9
    assert data.qvel[4] / 0.5 == pytest.approx(expected, rel=2e-3)


def test_needs_mujoco_and_numpy_only():
    """Other libraries are made absent; of the package come its errors and where compiled functions are kept."""
    program = """
import sys
allowed = {"mujoco", "numpy", "clearance_mj", "typing_extensions"} | set(sys.stdlib_module_names)  # of MuJoCo 3
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] not in allowed:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Absent())
import clearance_mj as cm
assert cm.physical.joint_limit and cm.solref_solimp(1.0, 1.0, 1.0)
print(*sorted({n.split(".")[1] for n in sys.modules if n.startswith("clearance_mj.")}))
"""
    process = run("-c", program)
    assert process.returncode == 0, process.stderr
    assert process.stdout.split() == ["core", "physical", "version"]
