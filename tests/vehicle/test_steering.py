"""Steering: servo against its transfer function, lost motion against backlash in closed form, shaft against beam."""

import dataclasses

import numpy as np
import pytest
import scipy.signal

from clearance_mj import ConstantLaw, Contact, Grease, beam
from clearance_mj.core.errors import ManoeuvreError
from clearance_mj.vehicle.lost_motion import LostMotion, lost_motion_step
from clearance_mj.vehicle.plant import STEP
from clearance_mj.vehicle.steering import LEVER_ARM, STEERING_SHAFT, Steering, parse_gap

from ..refusals import assert_refused

HALF_GAP = np.radians(0.2)
FIDELITIES = ("play", "modal")
every_fidelity = pytest.mark.parametrize("fidelity", FIDELITIES)
COLUMN = 172.0 * 16**2  # N m/rad, the column's stiffness at the road wheel


def shaft(contact=None, grease=None, masses=STEERING_SHAFT.masses):
    """The steering's shaft with other bushings."""
    changes = {name: value for name, value in (("contact", contact), ("grease", grease)) if value}
    bushings = tuple(dataclasses.replace(b, **changes) for b in STEERING_SHAFT.bushings)
    return STEERING_SHAFT.replace(bushings=bushings, masses=masses)


RIGID = shaft(Contact(1e15))


def steer(steering, command, moment, period=0.01, seed=0):
    """Wheel angle, servo angle and contact side at every millisecond, for one command and moment each period."""
    run = steering.start(seed)
    cases = zip(command, np.broadcast_to(moment, len(command)))
    rows = [(run.advance(u, m, period), run.servo, run.contact) for u, m in cases]
    return [np.concatenate(column) for column in zip(*rows)]


def play(servo, half_gap):
    """Wheel that stays until it is pushed: the play operator, sample by sample."""
    wheel = np.zeros(servo.size)
    for i in range(1, servo.size):
        wheel[i] = np.clip(wheel[i - 1], servo[i] - half_gap, servo[i] + half_gap)
    return wheel


GAPS = [("0.2deg", np.pi / 900), ("3.5mrad", 3.5e-3), ("0.15mm", 0.15e-3 / 0.1), (" 1e-3 rad", 1e-3), ("100µm", 1e-3)]


@pytest.mark.parametrize(("text", "radians"), GAPS)
def test_gap_with_a_unit(text, radians):
    assert parse_gap(text, lever_arm=0.1) == pytest.approx(radians, rel=1e-12)


@every_fidelity
def test_nothing_moves_without_excitation(fidelity):
    wheel, servo, contact = steer(Steering(HALF_GAP, fidelity), np.zeros(100), 0.0)
    assert not wheel.any() and not servo.any() and not contact.any()


@pytest.mark.parametrize("moment", [0.0, 150.0])
def test_without_clearance_the_wheel_is_the_servo(moment):
    command = 0.05 * np.sin(2 * np.pi * 0.7 * 0.01 * np.arange(300))
    wheel, servo, _ = steer(Steering(shaft=RIGID), command, moment * np.sign(command))
    np.testing.assert_allclose(wheel, servo, atol=1e-10)


@pytest.mark.parametrize(("frequency", "damping"), [(6.0, 0.7), (4.0, 1.0), (4.0, 1.5)])
def test_servo_step(frequency, damping):
    """Step response of ω²/(s² + 2ζω s + ω²), small enough for the rate limit."""
    _, servo, _ = steer(Steering(frequency=frequency, damping=damping), np.full(50, 1e-3), 0.0)
    natural = 2 * np.pi * frequency
    system = scipy.signal.lti([natural**2], [1, 2 * damping * natural, natural**2])
    expected = scipy.signal.step(system, T=np.concatenate(([0], STEP * np.arange(1, servo.size + 1))))[1][1:]
    np.testing.assert_allclose(servo, 1e-3 * expected, atol=1e-14)


def test_servo_keeps_its_rate():
    _, servo, _ = steer(Steering(rate_limit=0.4), np.repeat([0.3, -0.3, 0.0], 150), 0.0)
    assert np.abs(np.diff(servo) / STEP).max() == pytest.approx(0.4, rel=1e-9)
    assert servo[-1] == pytest.approx(0.0, abs=1e-3) and np.ptp(servo) == pytest.approx(0.6, rel=0.1)


def test_friction_driven_is_the_play_operator():
    """Rigid contact and friction above all other moments: the wheel stays until it is pushed."""
    steering = Steering(HALF_GAP, friction=300.0, shaft=RIGID)
    wheel, servo, contact = steer(steering, np.cumsum(np.random.default_rng(0).normal(0, 2e-3, 500)), 50.0)
    np.testing.assert_allclose(wheel, play(servo, HALF_GAP), atol=1e-9)
    pushed, turning = contact != 0, np.diff(wheel, prepend=0)
    assert np.all(np.abs(turning[~pushed]) < 1e-12) and np.all(turning[pushed] * contact[pushed] > -1e-9)


@pytest.mark.parametrize("ratio", [0.1, 0.3, 0.6])
def test_describing_function_of_backlash(ratio):
    """N = [π/2 + asin b + b √(1-b²) - j (1-b²)]/π, b = 1 - 2 h/A (Gelb & Vander Velde, 1968, appendix B)."""
    n, model = 4000, LostMotion(ratio, stiffness=1e12, friction=1.0)
    phase = 2 * np.pi * np.arange(2 * n + 1) / n
    servo, lost = np.sin(phase), np.zeros(2 * n + 1)
    for i in range(2 * n):
        lost[i + 1], _ = lost_motion_step(lost[i], servo[i + 1] - servo[i], 0.0, STEP, model)
    last = slice(n, 2 * n)
    lost_harmonic = 2j / n * np.sum((servo + lost)[last] * np.exp(-1j * phase[last]))
    b = 1 - 2 * ratio
    expected = (np.pi / 2 + np.arcsin(b) + b * np.sqrt(1 - b**2) - 1j * (1 - b**2)) / np.pi
    assert lost_harmonic == pytest.approx(expected, abs=1e-6)


@every_fidelity
@pytest.mark.parametrize("moment", [20.0, -120.0])
def test_torque_driven_follows_the_moment(fidelity, moment):
    """At rest d = -h σ - M/k, k the column's 172 N m/rad times 16²; what the slender shaft carries is 0.2 N m."""
    wheel, servo, contact = steer(Steering(HALF_GAP, fidelity), np.zeros(100), moment)
    side = np.sign(moment)
    assert contact[-1] == side
    assert wheel[-1] - servo[-1] == pytest.approx(-HALF_GAP * side - (moment - 0.13 * side) / COLUMN, abs=1e-5)


def test_crossing_the_play():
    """A moment that changes sign moves the wheel across at M/c: 2 h c/M from contact to contact."""
    steering, moment = Steering(HALF_GAP), 20.0
    _, _, contact = steer(steering, np.zeros(100), np.where(np.arange(100) < 50, moment, -moment))
    crossing = np.sum(contact[500:] == 0) * STEP
    damping = 3920.0 * LEVER_ARM**2  # the rack's; the other bushing's grease adds 0.02 %
    assert crossing == pytest.approx(2 * HALF_GAP * damping / moment, abs=2 * STEP)
    assert contact[499] == 1 and contact[-1] == -1


@pytest.mark.parametrize(("friction", "moment"), [(0.0, 100.0), (60.0, 30.0)], ids=["torque-driven", "friction-driven"])
def test_modal_tends_to_play(friction, moment):
    """Slow command and moment: the lost motion of the two models, 10 s, differs by less than 3 % RMS."""
    phase, lost = 2 * np.pi * 0.1 * 0.01 * np.arange(1000), {}
    for fidelity in FIDELITIES:
        steering = Steering(HALF_GAP, fidelity, friction)
        wheel, servo, contact = steer(steering, 0.05 * np.sin(phase), moment * np.sin(phase + 0.3))
        lost[fidelity] = wheel - servo
        assert set(contact) == {-1, 0, 1}
    assert np.sqrt(np.mean((lost["modal"] - lost["play"]) ** 2)) < 0.03 * np.sqrt(np.mean(lost["play"] ** 2))
    assert np.ptp(lost["play"]) > 2 * HALF_GAP


def test_links_beside_modal():
    """The MuJoCo chain in co-simulation, through contact, play and contact again: within 0.02 mrad of the modes."""
    moment = 60 * np.cos(2 * np.pi * 2 * 0.01 * np.arange(40))
    modal, links = (steer(Steering(HALF_GAP, engine), np.full(40, 0.01), moment) for engine in ("modal", "links"))
    assert np.ptp(modal[0] - modal[1]) > 2 * HALF_GAP
    np.testing.assert_allclose(links[0], modal[0], atol=2e-5)


def test_rattle_at_the_beams_frequencies():
    """A bare shaft that a small step of the moment sets ringing within a wide play: lines at its beam's frequencies."""
    bare = shaft(grease=Grease(0.0), masses=())
    steering = Steering(np.radians(4), "modal", shaft=bare)
    wheel, _, contact = steer(steering, np.zeros(800), np.where(np.arange(800) < 1, 0.0, 0.01))
    assert not contact.any() and np.ptp(wheel) > 1e-5
    spectrum = np.abs(np.fft.rfft(np.gradient(wheel - wheel.mean(), STEP) * np.hanning(wheel.size)))
    frequency = np.fft.rfftfreq(wheel.size, STEP)
    for expected in beam.natural_frequencies(bare, 2):
        near = np.abs(frequency - expected) < 0.3 * expected
        assert frequency[near][spectrum[near].argmax()] == pytest.approx(expected, abs=0.13)


def test_reduced_model_is_the_shafts():
    """Column and rack at the wheel over the lever arm; within the play the shaft bends as 3 EI/a³."""
    model = Steering(HALF_GAP, friction=5.0).lost_motion
    b, a = STEERING_SHAFT.beam, 0.475
    assert model.half_gap == HALF_GAP and model.friction == 5.0
    assert model.stiffness == pytest.approx(COLUMN, rel=1e-9)
    assert model.damping == pytest.approx(3920 * (16 * 7.1e-3) ** 2, rel=1e-3)
    assert model.shaft_stiffness == pytest.approx(3 * b.bending_stiffness / a**3 * LEVER_ARM**2, rel=1e-9)


@every_fidelity
def test_law_of_the_contact(fidelity):
    """An identified law takes the place of the datasheet's contact: half the stiffness, twice the wind-up."""
    soft = ConstantLaw(COLUMN / LEVER_ARM**2 / 2, 200.0)
    wheel, _, _ = steer(Steering(HALF_GAP, fidelity, law=soft), np.zeros(100), 50.0)
    assert wheel[-1] == pytest.approx(-HALF_GAP - 2 * 50.0 / COLUMN, rel=3e-3)


def test_road_noise():
    """Without play the wheel is off by noise over stiffness: seeded, of the RMS asked for, and within its band."""
    steering = Steering(road_moment=20.0, road_band=(1.0, 15.0))
    wheel, _, _ = steer(steering, np.zeros(6000), 0.0, seed=4)
    assert np.sqrt(np.mean(wheel**2)) * COLUMN == pytest.approx(20.0, rel=0.02)
    frequency, density = scipy.signal.welch(wheel, 1 / STEP, nperseg=8192)
    assert density[frequency > 16].max() < 1e-3 * density.max()
    again, other = (steer(steering, np.zeros(50), 0.0, seed=seed)[0] for seed in (4, 5))
    np.testing.assert_array_equal(again, wheel[:500])
    assert np.abs(other - again).max() > 1e-4


@every_fidelity
def test_any_period(fidelity):
    """Cut into periods of 1 ms the same drive comes out as in periods of 10 ms."""
    steering = Steering(HALF_GAP, fidelity, friction=10.0, road_moment=5.0)
    command, moment = 0.02 * np.sin(np.arange(40)), 80 * np.cos(np.arange(40))
    long = steer(steering, command, moment)
    for a, b in zip(long, steer(steering, np.repeat(command, 10), np.repeat(moment, 10), STEP)):
        np.testing.assert_allclose(a, b, atol=1e-12)


GAP = r'gap "{}" is not a gap.*0\.2deg'
RANGE = r"steering\.half_gap must be in 0\.\."
ELSEWHERE = STEERING_SHAFT.replace(bushings=STEERING_SHAFT.bushings[:1])


@pytest.mark.parametrize(("refused", "says"), [
    (lambda: parse_gap("0.2"), r'gap "0.2" has no unit.*0\.2deg'),
    *((lambda text=text: parse_gap(text), GAP.format(text)) for text in ("", "-1deg", "1lb", "deg")),
    (lambda: Steering(-0.1), RANGE),
    (lambda: Steering(float("nan")), RANGE),
    (lambda: Steering(fidelity="exact"), '"play" or an engine: engine "exact" is unknown; known: links, mjx'),
    (lambda: Steering(frequency=0.0), r"steering\.frequency must be"),
    (lambda: Steering(shaft=ELSEWHERE), "must be at one of its bushings"),
    *((lambda t=t: Steering().start().advance(0.0, 0.0, t), "whole milliseconds") for t in (0.0, 0.0015, -0.01)),
])  # fmt: skip
def test_refusals(refused, says):
    assert_refused(ManoeuvreError, says, refused)


def against_a_spring(steering, spring, ramp, seconds):
    """Servo angle over time of a command that rises, against a moment in proportion to the angle."""
    run = steering.start()
    angles = []
    for k in range(round(seconds / 0.01)):
        run.advance(min(ramp * k * 0.01, 0.1), spring * run.angle, 0.01)
        angles.append(run.angle)
    return np.array(angles)


@pytest.mark.parametrize("friction", [0.0, 30.0])
def test_motor_stalls_where_the_load_takes_its_torque(friction):
    """100 N m against 3000 N m/rad and friction: the servo stops at (100 - T_f)/3000 rad, whatever is asked for."""
    wheel = against_a_spring(Steering(torque_limit=100.0, friction=friction), 3000.0, 0.01, 14.0)
    assert wheel[-1] == pytest.approx((100.0 - friction) / 3000.0, abs=6e-4)
    assert against_a_spring(Steering(friction=friction), 3000.0, 0.01, 14.0)[-1] == pytest.approx(0.1, abs=1e-3)


def test_motor_turns_its_inertia():
    """A torque T alone on inertia J and damping c: T/c (t - τ (1 - exp(-t/τ))), τ = J/c, from the first command on."""
    time = 0.01 * np.arange(1, 5)
    wheel = against_a_spring(Steering(torque_limit=50.0, rate_limit=10.0), 0.0, 1e3, 0.05)[1:]
    inertia, damping = 0.04 * 16**2, 3920.0 * LEVER_ARM**2
    fade = inertia / damping
    np.testing.assert_allclose(wheel, 50.0 / damping * (time - fade * (1 - np.exp(-time / fade))), rtol=0.12)
    assert wheel[-1] == pytest.approx(50.0 / damping * (0.04 - fade * (1 - np.exp(-0.04 / fade))), rel=0.03)


def test_motor_that_suffices_changes_nothing():
    free, motor = (against_a_spring(Steering(HALF_GAP, torque_limit=t), 3e3, 0.2, 1.0) for t in (np.inf, 1e4))
    np.testing.assert_array_equal(free, motor)
