"""Records of shafts that turn: keyphasors, directions of excitation, orbits; and what is refused of them."""

import dataclasses

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.rig import Spin
from clearance_mj.signals.keyphasor import turning_of_pulses

FS, N = 1024.0, 4096
TIME = np.arange(N) / FS


def pulses(angle):
    """Return raised cosines of 60 degrees, which rise through their half height at whole turns."""
    turns = (angle / (2 * np.pi) + 1 / 24) % 1.0  # the half height comes a quarter of the pulse after its start
    return np.where(turns < 1 / 6, 0.5 - 0.5 * np.cos(2 * np.pi * 6 * turns), 0.0)


@pytest.fixture(scope="module")
def rig():
    return cm.Rig.load("models/rotor.toml")


def channels(rig, angle, without=()):
    """Zeros of all sensors and probes, a base that moves along y, and a keyphasor."""
    rows = [("base", 100, "+Y", "acceleration", np.sin(TIME))]
    rows += [(f"acc {l}", int(l[:-3]), l[-2:], "acceleration", np.cos(TIME)) for l in rig.sensor_labels]
    rows += [(f"probe {l}", int(l[:-3]), l[-2:], "displacement", 1e-6 * TIME) for l in rig.probe_labels]
    rows += [("keyphasor", 400, "S", "unknown", pulses(angle))]
    return [cm.Channel(*row, FS) for row in rows if row[0] not in without]


@pytest.mark.parametrize("rate", [0.0, 15.0])
def test_the_angle_of_a_shaft(rate):
    """Pulses of a known ramp give its angle within 0.2 degrees, and its speed, between the first and the last mark."""
    angle = 1.0 + 40.0 * TIME + rate / 2 * TIME**2
    rotation = turning_of_pulses(3.0 * pulses(angle) - 1.0, FS)
    inside = (TIME >= rotation.marks[0]) & (TIME <= rotation.marks[-1])
    error = rotation.angle - angle
    assert np.abs(error - 2 * np.pi * np.round(error[inside].mean() / (2 * np.pi)))[inside].max() < 0.2 * np.pi / 180
    assert np.abs(rotation.speed - 40.0 - rate * TIME)[inside].max() < 0.1
    assert np.array_equal(turning_of_pulses(pulses(angle), FS, -1.0).angle, -rotation.angle)


def test_a_record_along_y_of_a_shaft_that_turns(rig, tmp_path):
    """Direction and spin of each record go through files, and the rig as tested is driven along them."""
    spin = Spin(40.0)
    made = cm.Record("y", "identify", rig, FS, channels(rig, 40.0 * TIME), direction=(0.0, 1.0, 0.0), spin=spin)
    orbit = cm.Record("run", "orbit", rig, FS, channels(rig, 40.0 * TIME, ["base", "acc 1:+Z"]), "spin", spin=spin)
    cm.write_dataset(tmp_path, rig, [made, orbit])
    loaded = cm.Dataset.load(tmp_path)
    record, (running,) = loaded.records[0], loaded.orbits
    assert record.tested_rig.spin == spin and record.tested_rig.shaker.direction == (0.0, 1.0, 0.0)
    response = record.response()
    assert response.reference == "100:+Y" and np.allclose(response.excitation, np.sin(TIME))
    assert response.spin == pytest.approx(40.0, rel=1e-3)
    assert running.excitation().value.any() == False and running.response().displacement.shape == (2, N)  # noqa: E712
    assert loaded.records[1].tested_rig.shaker == rig.shaker


@pytest.mark.parametrize("changed, words", [
    ({"without": ["keyphasor"]}, "turns at 40 rad/s and has no keyphasor, a channel of once-per-turn pulses at 400:S"),
    ({"without": ["base"]}, "has no acceleration at node 100 along Y"),
    ({"kind": "spin", "spin": Spin(0.0)}, 'is of kind "spin", and its shaft does not turn'),
    ({"kind": "spin", "role": "orbit", "without": ["probe 2:+Y"]},
     "has no displacement at node 2 along Y, a probe of an orbit"),
])  # fmt: skip
def test_what_a_record_lacks(rig, changed, words):
    """One line that says what is missing."""
    given = {"role": "identify", "kind": "base", "spin": Spin(40.0), "without": ()} | changed
    with pytest.raises(cm.RecordError, match=words):
        cm.Record(
            "x", given["role"], rig, FS, channels(rig, 40.0 * TIME, given["without"]), given["kind"],
            direction=(0.0, 1.0, 0.0), spin=given["spin"],
        )  # fmt: skip


@pytest.mark.parametrize("angle, words", [
    (40.0 * TIME + 2.0 * TIME**2, "said to turn at 40 rad/s, and its keyphasor shows 4[01][.]\\d* to 55[.]\\d* rad/s"),
    (44.0 * TIME, "said to turn at 40 rad/s, and its keyphasor shows 44 rad/s"),
    (0.0 * TIME, "its keyphasor shows 0 whole turns in 4 s; needs 2 or more"),
])  # fmt: skip
def test_a_speed_that_is_another(rig, angle, words):
    """A stationary record whose speed changes, or is another one, is refused in one line."""
    record = cm.Record("x", "identify", rig, FS, channels(rig, angle), direction=(0.0, 1.0, 0.0), spin=Spin(40.0))
    with pytest.raises(cm.RecordError, match=words):
        record.turning()
    if angle.any():  # said to be a ramp as it is
        ramp = (angle[-1] - 40.0 * TIME[-1]) / TIME[-1] ** 2 * 2
        assert dataclasses.replace(record, spin=Spin(40.0, ramp, 100.0)).turning() is not None


def turning(rig, signal, spin):
    """Return what a keyphasor shows of a shaft that turns alone."""
    rows = channels(rig, 40.0 * TIME, ["base", "acc 1:+Z", "keyphasor"])
    rows.append(cm.Channel("k", 400, "S", "unknown", signal, FS))
    return cm.Record("x", "orbit", rig, FS, rows, "spin", spin=spin).turning()


RAMP = Spin(40.0, 30.0, 200.0)  # 20 to 160 rad/s, as its keyphasor is stated to show


def test_a_run_up_that_is_another(rig):
    """40 + 4 t rad/s are 55.5 rad/s where 40 + t is stated."""
    with pytest.raises(
        cm.RecordError, match=r"turn at 43\.88 rad/s at 3\.88\d* s, and its keyphasor shows 55\.5\d* rad/s"
    ):
        turning(rig, pulses(40.0 * TIME + 2.0 * TIME**2), Spin(40.0, 1.0, 100.0))
    assert turning(rig, pulses(40.0 * TIME + 2.0 * TIME**2), Spin(40.0, 4.0, 100.0)) is not None


@pytest.mark.parametrize(("slots", "uneven"), [(2, 0.0), (2, 0.6), (4, 0.3), (1, 0.0)])
@pytest.mark.parametrize("spin", [RAMP, Spin(60.0)])
def test_several_pulses_in_a_turn(rig, slots, uneven, spin):
    """The angle between marks is that of the shaft, wherever the slots are."""
    angle = 1.0 + spin.angle_at(TIME)
    several = sum(pulses(angle - 2 * np.pi * k / slots - uneven * (k == 1)) for k in range(slots))
    rotation = turning(rig, several, dataclasses.replace(spin, pulses=slots))
    inside = (TIME >= rotation.marks[0]) & (TIME <= rotation.marks[-1])
    assert np.ptp((rotation.angle - angle)[inside]) < 0.4 * np.pi / 180
    assert np.abs(rotation.speed - spin.speed_at(TIME))[inside].max() < 0.02 * spin.fastest


@pytest.mark.parametrize("spin", [RAMP, Spin(60.0), Spin(-60.0)])
def test_what_is_wrong_with_pulses_is_said(rig, spin):
    """Two slots, three pulses that are missing, an edge that rings, a spike between two pulses, half of the pulses."""
    angle = 1.0 + np.abs(spin.angle_at(TIME))
    turn = np.floor(angle / (2 * np.pi) + 1 / 24)
    sound = pulses(angle)
    count = np.count_nonzero(np.diff(np.sign(sound - 0.5)) > 0)
    stated = r"pulses where \d+ are stated, "
    with pytest.raises(cm.RecordError, match=f"{stated}(2|1.9\\d|2.0\\d) times as many: give the number of pulses"):
        turning(rig, sound + pulses(angle + np.pi), spin)
    with pytest.raises(
        cm.RecordError, match=rf"shows {count - 3} {stated}3 missing after (\d\.\d+) s; leave"
    ) as caught:
        turning(rig, sound * ~np.isin(turn, [10, 11, 12]), spin)
    assert f"after {TIME[np.argmax(turn == 9)]:.1f}" in str(caught.value)
    with pytest.raises(
        cm.RecordError, match=rf"{stated}the first too many at 0\.\d* s: an edge that rings, or a spike"
    ):
        turning(rig, sound * (1 + np.sin(2 * np.pi * 300 * TIME)), spin)
    spike = np.where(np.arange(N) == np.argmax(turn == 10) + 50, 2.0, sound)
    with pytest.raises(cm.RecordError, match=rf"shows {count + 1} {stated}the first too many at \d\.\d* s"):
        turning(rig, np.maximum(spike, sound), spin)
    with pytest.raises(cm.RecordError, match=rf"{stated}0\.5\d* times as many: give the number of pulses"):
        turning(rig, sound * (turn % 2 == 0), spin)
    higher = np.where(turn == 10, 1.1, 1.0) * sound  # a pulse that is a little higher is one
    assert np.allclose(turning(rig, higher, spin).of_turns, turning(rig, sound, spin).of_turns, rtol=0.05)
