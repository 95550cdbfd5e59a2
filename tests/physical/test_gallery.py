"""The gallery's figures against closed forms, which hold for what was asked and not for MuJoCo's defaults."""

import numpy as np
import pytest

from experiments.physical import ball_in_a_tube, ball_on_a_floor, door_latch, gallery, robot_arm, scene
from experiments.physical.ball_in_a_tube import TUBE_GAP
from experiments.physical.door_latch import LATCH_GAP
from experiments.physical.robot_arm import SPIN, TEETH
from experiments.physical.scene import ARCMIN


def test_ball_that_is_set_down():
    """Depth over time of a mass on a spring and damper; at rest m g/k, which neither usual solref gives."""
    time, depth = ball_on_a_floor.set_down("physical")
    static = ball_on_a_floor.MASS * scene.GRAVITY / ball_on_a_floor.FLOOR_K
    np.testing.assert_allclose(depth, ball_on_a_floor.set_down_expected(time), atol=4e-3 * static)
    ringing = scene.ringing(ball_on_a_floor.FLOOR_K, ball_on_a_floor.MASS, ball_on_a_floor.FLOOR_C)
    assert scene.rings(time, depth - static) == pytest.approx(ringing, rel=2e-4)
    assert ball_on_a_floor.at_rest("physical", 0.3) == pytest.approx(0.3 * static, rel=1e-4)
    for usual in ("default", "direct"):  # the same depth whatever the mass
        assert ball_on_a_floor.at_rest(usual, 0.3) == pytest.approx(ball_on_a_floor.at_rest(usual, 3.0), rel=1e-3)


def test_lost_motion():
    """2 gap but for what the load coasts, A (1 - cos φ) at either end, tan φ = Ω J/c."""
    drive, load = robot_arm.reversal(robot_arm.robot(braked=robot_arm.OTHERS, timestep=5e-4), period=8.0)
    coasts = np.ptp(drive) * (1 - np.cos(np.arctan(2 * np.pi / 8 * SPIN.load / SPIN.damping)))
    assert robot_arm.lost_motion(drive, load) == pytest.approx(2 * TEETH["spin"][0] - coasts, rel=2e-3)


def test_sag():
    """Loads rest gap + torque/k behind their drives, and the tip where that puts it; not so with two hinges."""
    with_backlash, usual = robot_arm.sag(robot_arm.robot(), 2.0), robot_arm.sag(robot_arm.robot(recipe=True), 2.0)
    loaded = slice(1, 5)  # the other axes are vertical, or hold a tool that is round
    np.testing.assert_allclose(with_backlash.measured[loaded], with_backlash.expected[loaded], rtol=1e-5)
    assert with_backlash.tip == pytest.approx(with_backlash.tip_expected, rel=1e-5)
    assert np.all(np.abs(usual.measured[loaded] / with_backlash.expected[loaded] - 1) > 0.05)


def test_servo_that_hunts():
    """Limit cycle by matrix exponentials; the describing function is near it."""
    time, _, load = robot_arm.hunting(robot_arm.robot(braked=robot_arm.OTHERS, timestep=5e-5), 0.8)
    late = time > 0.5
    cycle = scene.rings(time[late], load[late] - load[late].mean()), np.ptp(load[late]) / 2
    np.testing.assert_allclose(cycle, robot_arm.limit_cycle(), rtol=3e-3)
    np.testing.assert_allclose(cycle, robot_arm.first_harmonic(), rtol=0.05)


def test_describing_function_of_a_load_without_friction():
    """By hand: teeth of equivalent stiffness k N(A) = kp, ω² = kp/J, the drive at rest, so the load swings by A."""
    frequency, amplitude = robot_arm.first_harmonic(SPIN._replace(damping=1e-9, c=1e-9))
    assert frequency == pytest.approx(np.sqrt(SPIN.kp / SPIN.load) / (2 * np.pi), rel=1e-6)
    cosine = SPIN.gap / amplitude
    equivalent = 2 / np.pi * (np.arccos(cosine) - cosine * np.sqrt(1 - cosine**2))
    assert equivalent == pytest.approx(SPIN.kp / SPIN.k, rel=1e-6)


def test_limit_cycle_that_is_nearly_a_sine():
    """Teeth hardly harder than the servo are met nearly always: the describing function is nearly exact."""
    soft = SPIN._replace(k=SPIN.kp / 0.9, c=0.0)
    np.testing.assert_allclose(robot_arm.limit_cycle(soft), robot_arm.first_harmonic(soft), rtol=0.015)


def test_first_contact_of_the_latch():
    """No force at 0.999 of the closed form's pressure, and a force at 1.001."""
    first = door_latch.first_contact()
    below, above = door_latch.rattle(door_latch.latch(), [0.999 * first, 1.001 * first], 0.3).sensors.max(axis=(1, 2))
    assert below == 0 < above


def test_force_of_the_latch():
    """While it rattles, k r + c ṙ and never pulling; a step's sensors belong to the state before it."""
    motion = door_latch.rattle(door_latch.latch(), [2 * door_latch.first_contact()], 0.4)
    place, (turns, slides) = door_latch.bolt(motion)[0], motion.qvel[0].T
    speed = place / np.tan(motion.qpos[0, :, 0]) * turns + np.sin(motion.qpos[0, :, 0]) * slides
    force = door_latch.LATCH_K * (np.abs(place) - LATCH_GAP) + door_latch.LATCH_C * np.sign(place) * speed
    force = np.where(np.abs(place) > LATCH_GAP, np.maximum(force, 0), 0)[:-1]
    np.testing.assert_allclose(motion.sensors[0, 1:, 0], force, atol=1e-3 * force.max())
    assert force.max() > 200


def test_door_pressed_on_the_stop():
    _, depth, frequency = door_latch.pressed()
    np.testing.assert_allclose((depth, frequency), door_latch.pressed_expected(), rtol=1e-3)
    _, depth, frequency = door_latch.pressed(default=True)
    assert depth > 3 * LATCH_GAP and np.isnan(frequency)


def test_ball_in_a_tube():
    """It bounces until it whirls: m ω² R = k (R - gap), of the angular momentum of the start."""
    way = ball_in_a_tube.orbit(ball_in_a_tube.tube(), (-0.8e-3, 0.0), [(0.08, 0.16), (0.0, 0.9)], 0.1)
    started = ball_in_a_tube.BALL * -0.8e-3 * np.array([0.16, 0.9])
    np.testing.assert_allclose(way.momentum, np.broadcast_to(started[:, None], way.momentum.shape), rtol=1e-5)
    for radius, frequency, momentum in zip(way.radius, way.frequency, started):
        expected = ball_in_a_tube.whirl(momentum)
        assert radius - TUBE_GAP == pytest.approx(expected[0] - TUBE_GAP, rel=1e-3)
        assert frequency == pytest.approx(expected[1], rel=1e-4)
    usual = ball_in_a_tube.orbit(ball_in_a_tube.tube(default=True), (-0.8e-3, 0.0), (0.08, 0.16), 0.1)
    assert usual.frequency[0] < 0.5 * way.frequency[0]


@pytest.mark.slow
def test_figures(tmp_path, capsys):
    gallery.main(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {f"physical_{name}.png" for name in gallery.FIGURES}
    assert f"{TEETH['spin'][0] / ARCMIN * 2:.4f}'" in capsys.readouterr().out
