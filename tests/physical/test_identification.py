"""Identification of any MuJoCo model: a drive with play against an ODE of its own, and what is refused."""

import dataclasses

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from clearance_mj import physical
from clearance_mj.clearance import ConstantLaw
from clearance_mj.core.errors import ModelError, RecordError
from clearance_mj.physical import identification
from clearance_mj.physical.identification.simulation import Simulator, state_of
from experiments.drives import servos
from experiments.physical import elbow

LOAD, DRIVE, SPRING = 0.02, 0.01, 3.0  # kg m², kg m², N m/rad
GAP, K, C = 0.02, 400.0, 0.4  # rad, N m/rad, N m s/rad
FS, DURATION, NOISE = 500.0, 3.0, 2e-4  # Hz, s, rad
TIME = np.arange(int(FS * DURATION)) / FS


def torque(t):
    return 1.2 * np.sin(2 * np.pi * 0.9 * t) + 0.8 * np.sin(2 * np.pi * 2.3 * t + 1) + 0.5 * np.sin(2 * np.pi * 5.1 * t)


def rate(t, x):
    """Of load and drive on springs and dampers to ground, with play between."""
    load, drive, load_speed, drive_speed = x
    beyond = max(drive - load - GAP, 0.0) + min(drive - load + GAP, 0.0)
    tooth = K * beyond + C * (drive_speed - load_speed) if beyond else 0.0
    tooth = tooth if tooth * beyond > 0 else 0.0
    motor = torque(t) - 0.05 * drive_speed
    return load_speed, drive_speed, (tooth - SPRING * load - 0.1 * load_speed) / LOAD, (motor - tooth) / DRIVE


@pytest.fixture(scope="module")
def record():
    """Of scipy's Runge-Kutta method of order eight, with noise."""
    path = solve_ivp(rate, (0, DURATION), np.zeros(4), "DOP853", TIME, rtol=1e-8, atol=1e-10, max_step=2e-3).y
    noisy = path[0] + np.random.default_rng(3).normal(0, NOISE, TIME.size)
    return identification.ModelRecord(FS, {"motor": torque(TIME)}, {"angle": noisy})


def load(timestep=5e-4):
    """The MuJoCo model of a load on a spring."""
    return mujoco.MjSpec.from_string(f"""<mujoco><compiler angle="radian"/>
  <option timestep="{timestep}" gravity="0 0 0"/><worldbody><body>
      <joint name="joint" axis="0 1 0" stiffness="{SPRING}" damping="0.1"/>
      <inertial pos="0 0 0" mass="1" diaginertia="{LOAD} {LOAD} {LOAD}"/></body></worldbody>
  <actuator><motor name="motor" joint="joint"/></actuator><sensor><jointpos name="angle" joint="joint"/></sensor>
</mujoco>""")


def drive(gap=GAP, k=K, c=C, timestep=5e-4):
    """The same with a drive behind play."""
    spec = load(timestep)
    physical.add_backlash(spec, "joint", gap, k, c, inertia=DRIVE).damping = [0.05, 0, 0]
    return spec


def assert_intervals_hold(fit, known):
    low, high = fit.estimates.interval()
    assert np.all((low < known) & (known < high))


def test_gap_and_stiffness_from_wrong_starts(record):
    """Both starts off by half and more; the record is of another integrator."""
    start = drive(1.5 * GAP, K / 2.5, timestep=2.5e-4)
    fit = identification.fit_model(start, record, ["joint backlash.gap", "joint backlash.k"])
    fitted_values = fit.values
    assert fitted_values["joint backlash.gap"] == pytest.approx(GAP, rel=0.01)
    assert fitted_values["joint backlash.k"] == pytest.approx(K, rel=0.03)
    assert_intervals_hold(fit, [GAP, K])
    assert np.all(fit.estimates.varied_std < 0.05)
    assert fit.noise["angle"] == pytest.approx(NOISE, rel=0.1)
    assert "joint backlash.gap" in fit.summary()
    assert fit.misfit["angle"] < 1.5
    assert fit.starts == 1 and not fit.notes
    assert physical.compile(fit.spec).tendon_range[0, 1] == pytest.approx(fitted_values["joint backlash.gap"])


@pytest.mark.parametrize(("names", "says"), [
    (["joint backlsh.gap"], 'no clearance "joint backlsh"; did you mean "joint backlash"'),
    (["joint backlash.kk"], 'parameter "joint backlash.kk": did you mean "k"'),
    (["joint.k"], 'no contact, limit or clearance "joint"'),
    (["jiont.damping"], 'no joint "jiont"; did you mean "joint"'),
    (["joint.frictionloss"], "start with a value > 0"),
    (["joint.friction"], 'no friction of "joint"'),
    (["gap"], "needs an element and a quantity"),
    ([], "parameters are none"),
    ({"joint backlash.k": (500.0, 600.0)}, "about its start 400"),
])  # fmt: skip
def test_parameters_that_cannot_be(record, names, says):
    with pytest.raises(ModelError, match=says):
        identification.fit_model(drive(), record, names)


FRICTION, BRISTLE = 0.4, 200.0  # N m, N m/rad


def rubbing(t, x):
    """Of a load on a spring to ground with elastic Coulomb friction: bristles bend, and slip at the largest force."""
    place, speed, bent = x
    slips = BRISTLE * abs(bent) >= FRICTION and bent * speed > 0
    return speed, (torque(t) - SPRING * place - 0.1 * speed - BRISTLE * bent) / LOAD, 0.0 if slips else speed


def test_friction_of_bristles():
    """Found from a start three times too small; the record is of an ODE solver."""
    path = solve_ivp(rubbing, (0, 2), np.zeros(3), "RK45", TIME[:1000], rtol=1e-7, atol=1e-10, max_step=1e-3).y
    noisy = path[0] + np.random.default_rng(4).normal(0, NOISE, 1000)
    spec = load(timestep=1e-3)
    physical.joint_friction(spec, "joint", FRICTION / 3, BRISTLE)
    record = identification.ModelRecord(FS, {"motor": torque(TIME[:1000])}, {"angle": noisy})
    fit = identification.fit_model(spec, record, ["joint.friction", "joint.damping"])
    assert fit.values["joint.friction"] == pytest.approx(FRICTION, rel=0.01)
    assert fit.values["joint.damping"] == pytest.approx(0.1, rel=0.1)
    assert physical.compile(fit.spec).numeric("physical:friction:joint:joint").data[0] == fit.values["joint.friction"]


@pytest.mark.slow
def test_a_motor_constant_that_is_wrong_is_said_and_widens_intervals(record):
    """What is found with a third too much torque is wrong, and its intervals hold the truth."""
    wrong = identification.ModelRecord(FS, {"motor": 4 / 3 * record.control["motor"]}, record.sensors)
    fit = identification.fit_model(drive(), wrong, ["joint backlash.gap", "joint backlash.k"], starts=2, seed=1)
    assert fit.starts == 2
    assert fit.misfit["angle"] > 20
    assert "times its noise, after 2 starts: the model does not move as recorded" in str(fit)
    assert_intervals_hold(fit, [GAP, K])
    assert all(f"{name} is not told by these records" in fit.notes for name in fit.not_told)


def test_a_law_has_no_stiffness_to_be_found(record):
    spec = drive()
    physical.tendon_limit(spec, "joint backlash", law=ConstantLaw(K, C))
    with pytest.raises(ModelError, match='"joint backlash" follows a law'):
        identification.fit_model(spec, record, ["joint backlash.k"])


@pytest.mark.slow
def test_elbow():
    """Gap within 3 %, stiffness within 10 %, another excitation within 1.5 times the noise; own equations."""
    row, _, _ = elbow.case(0, motor_side=False)
    assert abs(row["error"]["elbow backlash.gap"]) < 0.03
    assert abs(row["error"]["elbow backlash.k"]) < 0.10
    assert max(row["prediction over noise"].values()) < 1.5


def test_a_parameter_that_the_record_says_nothing_about():
    """Of teeth that never meet."""
    still = identification.ModelRecord(FS, {"motor": 1e-3 * TIME[:300]}, {"angle": 0.01 * np.sin(7 * TIME[:300])})
    with pytest.raises(ModelError, match=r"nothing about joint backlash\.k"):
        identification.fit_model(drive(gap=1.0), still, ["joint backlash.k"])


@pytest.mark.parametrize(("change", "says"), [
    ({"control": {"moter": TIME}}, 'no actuator "moter"; did you mean "motor"'),
    ({"control": {}}, 'no control of actuator "motor"'),
    ({"sensors": {"angel": TIME}}, 'no sensor "angel"; did you mean "angle"'),
    ({"sensors": {"angle": TIME[:-1]}}, '"motor" has 1500 samples'),
    ({"sensors": {"angle": np.where(TIME == 1.0, np.nan, TIME)}}, r"not finite at sample 500 \(1 s\)"),
    ({"sensors": {"angle": TIME[:9]}, "control": {"motor": TIME[:9]}}, "9 samples is too short"),
    ({"sensors": {"angle": np.ones((1500, 2))}}, 'sensor "angle" has 1 numbers, the record 2'),
    ({"fs": 0.0}, "must be > 0"),
    ({"hold": "cubic"}, 'use "linear" or "zero"'),
    ({"pose": [0.0]}, "needs 2 numbers"),
])  # fmt: skip
def test_records_that_cannot_be(change, says):
    given = {"fs": FS, "control": {"motor": TIME}, "sensors": {"angle": TIME}} | change
    with pytest.raises(RecordError, match=says):
        identification.fit_model(drive(), identification.ModelRecord(**given), ["joint backlash.k"])


def test_csv(tmp_path, record):
    """Columns are told apart by the model's names."""
    path = tmp_path / "run.csv"
    table = np.stack((TIME, record.control["motor"], record.sensors["angle"]), axis=1)
    np.savetxt(path, table, delimiter=",", header="time,motor,angle", comments="")
    read = identification.ModelRecord.read_csv(path, drive())
    assert read.fs == pytest.approx(FS)
    np.testing.assert_allclose(read.sensors["angle"], record.sensors["angle"])
    np.testing.assert_allclose(read.control["motor"], record.control["motor"])
    np.savetxt(path, table, delimiter=",", header="time,motor,angl", comments="")
    with pytest.raises(RecordError, match='neither an actuator nor a sensor; did you mean "angle"'):
        identification.ModelRecord.read_csv(path, drive())
    np.savetxt(path, np.delete(table, 700, axis=0), delimiter=",", header="time,motor,angle", comments="")
    missing = r"0.004 s pass after 1.398 s instead of 0.002 s \(1 times\): samples are missing"
    with pytest.raises(RecordError, match=missing):
        identification.ModelRecord.read_csv(path, drive())


def inside(gap=GAP, k=K, c=C, **friction):
    """The load with the drive inside its actuator."""
    spec = load()
    drive_friction = physical.DriveFriction(200.0, viscous=0.05, **friction)
    physical.add_drive(spec, "motor", gap, k, c, inertia=DRIVE, friction=drive_friction)
    return spec


def test_drive_inside_an_actuator_with_unknown_motor_constant_delay_and_bias():
    """Of the same independent record, with a rotor's angle; torque a quarter too large and early, the encoder off."""
    path = solve_ivp(rate, (0, 2), np.zeros(4), "DOP853", TIME[:1000], rtol=1e-8, atol=1e-10, max_step=2e-3).y
    noise = np.random.default_rng(5).normal(0, NOISE, (2, 1000))
    early = torque(TIME[:1000] + 4e-3) * 1.25
    sensors = {"angle": path[0] + noise[0], "motor.angle": path[1] + 0.03 + noise[1]}
    record = identification.ModelRecord(FS, {"motor": early}, sensors)
    names = ["motor.gap", "motor.k", "motor.gain", "motor.delay", "motor.angle.bias"]
    fit = identification.fit_model(inside(1.3 * GAP, K / 1.5), record, names)
    known, allowed = np.array([GAP, K, 0.8, 4e-3, 0.03]), [0.03 * GAP, 0.1 * K, 0.02 * 0.8, 3e-4, 1e-3]
    assert np.all(np.abs([fit.values[name] for name in names] - known) < allowed)
    assert_intervals_hold(fit, known)


@pytest.mark.slow
def test_losses_of_a_gear_from_a_record_of_other_physics(monkeypatch):
    """A servo of Dahl's friction under its teeth's torque, integrated at 2e-5 s: losses that begin at almost none."""
    monkeypatch.setattr(servos, "SECONDS", 4.0)
    servo = servos.Servo.drawn(50, lossy=True)
    begun = dataclasses.replace(servo, loss_forward=0.02, loss_backward=0.02)
    fit = identification.fit_model(begun.model(), servo.log(1), ["servo.loss_forward", "servo.loss_backward"])
    true = np.array([servo.loss_forward, servo.loss_backward])
    np.testing.assert_allclose(fit.estimates.value, true, rtol=0.03)
    assert_intervals_hold(fit, true)
    assert not fit.not_told


def test_a_bushing_acts_in_the_simulations_of_a_fit():
    """A load on a bushing and on nothing else, beside scipy's march of J θ'' = T - c θ' - k θ."""
    axes = "".join(f'<joint name="{kind} {axis}" type="{kind}" axis="{axis}"/>'
                   for kind in ("slide", "hinge") for axis in ("1 0 0", "0 1 0", "0 0 1"))  # fmt: skip
    spec = mujoco.MjSpec.from_string(f"""<mujoco><option timestep="2e-4" gravity="0 0 0"/><worldbody><site name="a"/>
    <body>{axes}<inertial pos="0 0 0" mass="1" diaginertia="{LOAD} {LOAD} {LOAD}"/><site name="b"/></body>
  </worldbody><actuator><motor name="motor" joint="hinge 0 0 1"/></actuator>
  <sensor><jointpos name="angle" joint="hinge 0 0 1"/></sensor></mujoco>""")
    physical.add_bushing(spec, "a", "b", np.full(6, 30.0), np.full(6, 0.05))
    driven = 0.01 * torque(TIME)
    path = solve_ivp(lambda t, x: (x[1], (0.01 * torque(t) - 30.0 * x[0] - 0.05 * x[1]) / LOAD), (0, DURATION), (0, 0),
                     "DOP853", TIME, rtol=1e-9, atol=1e-13).y  # fmt: skip
    simulator = Simulator(spec, (), identification.ModelRecord(FS, {"motor": driven}, {"angle": path[0]}))
    model = simulator.model(np.zeros(0))
    runs = simulator.guided([model], state_of(model, model.qpos0)[None], slice(0, TIME.size), 0.0)
    np.testing.assert_allclose(runs.sensors[0, :, 0], path[0], rtol=0, atol=0.01 * np.abs(path[0]).max())
