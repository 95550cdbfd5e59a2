"""Sensors of any quantity in rig files: what is written, how they are named, and what is refused in one line."""

from __future__ import annotations

from pathlib import Path

import pytest

from clearance_mj.core.errors import RigError
from clearance_mj.core.quantities import QUANTITIES
from clearance_mj.rig import Rig, Sensor
from clearance_mj.rig.sensing import clearance_of, sensor_points

from ..refusals import assert_refused

MODELS = Path(__file__).parents[2] / "models"
TABLE1 = Rig.load(MODELS / "table1_rig.toml")
PUMP = Rig.load(MODELS / "pump_frame.toml")


def test_a_file_of_accelerometers_is_what_it_was(tmp_path: Path) -> None:
    TABLE1.save(tmp_path / "rig.toml")
    text = (tmp_path / "rig.toml").read_text()
    assert not any(name in text for name in ("quantity", "relative_to", "fibre"))


def test_all_quantities_come_back_from_a_file(tmp_path: Path) -> None:
    sensors = tuple(Sensor(10, 0.3, quantity=name) for name in QUANTITIES if name != "force")
    rig = TABLE1.replace(
        sensors=(*sensors, Sensor(11, "bushings[1]", quantity="force"), Sensor(12, 0.2, quantity="strain", fibre=1e-3),
                 Sensor(13, 0.2, quantity="velocity", relative_to="base")),
    )  # fmt: skip
    rig.save(tmp_path / "rig.toml")
    assert Rig.load(tmp_path / "rig.toml") == rig and clearance_of(rig, rig.sensors[-3]) == 1
    assert sensor_points(rig)[-3] == rig.bushings[1].position
    labels = {s.quantity: s.label for s in sensors}
    assert labels["angle"] == "10:+RY" and labels["strain"] == "10:+Z"


def test_a_probe_on_the_shaft_is_not_that_of_the_clearance() -> None:
    probe = Sensor(6, TABLE1.bushings[0].position, quantity="displacement")
    rig = TABLE1.replace(sensors=(*TABLE1.sensors, probe))
    assert probe.label == "6:+Z" and rig.probe_labels == ["301:+Z", "7:+Z"]


@pytest.mark.parametrize(
    ("sensor", "part"),
    [
        ({"quantity": "strain", "fibre": 0.5}, "in a shaft of half depth 0.0043083 m; fibre 0.5 m is outside of it"),
        ({"quantity": "force"}, "sensors[0].position \"0.3\" has neither a clearance nor an elastic support, whose "
         'force it could read; give the name of a clearance ("bushings[0]", "bushings[1]")'),
        ({"quantity": "force", "position": "bushings[7]"}, 'sensors[0].position "bushings[7]" has neither'),
        ({"position": "bushings[0]"}, 'position "bushings[0]" is a clearance'),
        ({"quantity": "stress"}, "quantity"),
        ({"quantity": "force", "position": "bushings[0]", "mass": 0.1}, "mass has no effect"),
        ({"quantity": "strain", "relative_to": "base"}, "relative_to has no effect on a sensor of strain"),
        ({"fibre": 0.001}, "fibre is where a strain gauge sits, and the sensor reads acceleration"),
        ({"quantity": "angle", "position": "@0.3:Z"}, "is no rotation"),
    ],
)  # fmt: skip
def test_refused_on_a_shaft(sensor: dict, part: str) -> None:
    given = {"node": 1, "position": 0.3} | sensor
    assert part in assert_refused(RigError, None, lambda: TABLE1.replace(sensors=(Sensor(**given),)))


MATRICES_REFUSE = [("strain", "has no fibres: a strain gauge needs a shaft"), ("angle", "is no rotation")]


@pytest.mark.parametrize(("quantity", "part"), MATRICES_REFUSE)
def test_refused_on_matrices(quantity: str, part: str) -> None:
    at = PUMP.sensors[0].position
    assert_refused(RigError, part, lambda: PUMP.replace(sensors=(Sensor(1, at, quantity=quantity),)))


def test_two_sensors_of_one_node_and_axis_differ_in_quantity() -> None:
    two = Sensor(1, 0.3), Sensor(1, 0.3, quantity="velocity")
    assert TABLE1.replace(sensors=two).sensor_labels == ["1:+Z", "1:+Z"]
    again = (*two, Sensor(1, 0.4, quantity="velocity"))
    assert_refused(RigError, r"sensors\[2\].node 1 is used twice", TABLE1.replace, sensors=again)
