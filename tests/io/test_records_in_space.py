"""Records of shafts that turn: keyphasors, directions of excitation, orbits; and what is refused of them."""

import dataclasses

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.core.errors import RecordError
from clearance_mj.io.channels import Channel
from clearance_mj.io.dataset import Dataset, Record, write_dataset
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
    return [Channel(*row, FS) for row in rows if row[0] not in without]


@pytest.mark.parametrize("rate", [0.0, 15.0])
def test_the_angle_of_a_shaft(rate):
    """Pulses of a known ramp give its angle within 0.2 degrees, and its speed, between the first and the last mark."""
    angle = 1.0 + 40.0 * TIME + rate / 2 * TIME**2
    found = turning_of_pulses(3.0 * pulses(angle) - 1.0, FS)
    inside = (TIME >= found.marks[0]) & (TIME <= found.marks[-1])
    error = found.angle - angle
    assert np.abs(error - 2 * np.pi * np.round(error[inside].mean() / (2 * np.pi)))[inside].max() < 0.2 * np.pi / 180
    assert np.abs(found.speed - 40.0 - rate * TIME)[inside].max() < 0.1
    backwards = turning_of_pulses(pulses(angle), FS, -1.0)
    assert np.array_equal(backwards.angle, -found.angle)


def test_a_record_along_y_of_a_shaft_that_turns(rig, tmp_path):
    """Direction and spin of each record go through files, and the rig as tested is driven along them."""
    spin = Spin(40.0)
    made = Record("y", "identify", rig, FS, channels(rig, 40.0 * TIME), direction=(0.0, 1.0, 0.0), spin=spin)
    orbit = Record("run", "orbit", rig, FS, channels(rig, 40.0 * TIME, ["base", "acc 1:+Z"]), "spin", spin=spin)
    write_dataset(tmp_path, rig, [made, orbit])
    loaded = Dataset.load(tmp_path)
    record, (running,) = loaded.records[0], loaded.orbits
    assert record.tested_rig.spin == spin and record.tested_rig.shaker.direction == (0.0, 1.0, 0.0)
    response = record.response()
    assert response.reference == "100:+Y" and np.allclose(response.excitation, np.sin(TIME))
    assert response.spin == pytest.approx(40.0, rel=1e-3)
    assert running.excitation().value.any() == False and running.response().displacement.shape == (2, N)  # noqa: E712
    assert loaded.records[1].tested_rig.shaker == rig.shaker


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (
            {"without": ["keyphasor"]},
            "turns at 40 rad/s and has no keyphasor, a channel of once-per-turn pulses at 400:S",
        ),
        ({"without": ["base"]}, "has no acceleration at node 100 along Y"),
        ({"kind": "spin", "spin": Spin(0.0)}, 'is of kind "spin", and its shaft does not turn'),
        (
            {"kind": "spin", "role": "orbit", "without": ["probe 2:+Y"]},
            "has no displacement at node 2 along Y, a probe of an orbit",
        ),
    ],
)
def test_what_a_record_lacks(rig, changed, words):
    """One line that says what is missing."""
    given = {"role": "identify", "kind": "base", "spin": Spin(40.0), "without": ()} | changed
    with pytest.raises(RecordError, match=words):
        Record(
            "x", given["role"], rig, FS, channels(rig, 40.0 * TIME, given["without"]), given["kind"],
            direction=(0.0, 1.0, 0.0), spin=given["spin"],
        )  # fmt: skip


@pytest.mark.parametrize(
    ("angle", "words"),
    [
        (
            40.0 * TIME + 2.0 * TIME**2,
            "said to turn at 40 rad/s, and its keyphasor shows 4[01][.]\\d* to 55[.]\\d* rad/s",
        ),
        (44.0 * TIME, "said to turn at 40 rad/s, and its keyphasor shows 44 rad/s"),
        (0.0 * TIME, "its keyphasor shows 0 whole turns in 4 s; needs 2 or more"),
    ],
)
def test_a_speed_that_is_another(rig, angle, words):
    """A stationary record whose speed changes, or is another one, is refused in one line."""
    record = Record("x", "identify", rig, FS, channels(rig, angle), direction=(0.0, 1.0, 0.0), spin=Spin(40.0))
    with pytest.raises(RecordError, match=words):
        record.turning()
    slower = dataclasses.replace(record, spin=Spin(40.0, 1.0, 100.0))
    if angle.any():
        assert slower.turning() is not None
