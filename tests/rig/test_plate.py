"""The plate of a rig file: kept by files and plain data, left out where there is none, refused in one line."""

import math

import numpy as np
import pytest

from clearance_mj.rig import Plate, Rig

from .rig_changes import NUMBER, TABLES, refused

PLATE = {"sensor": 8, "area": 0.1, "distance": 1.0}


def test_rigs_without_one_are_as_they_were():
    assert "plate" not in Rig.from_dict(TABLES).to_dict()


EFFICIENCIES = [{}, {"radiation_efficiency": 0.3}, {"radiation_efficiency": [0.1, 0.5], "frequencies": [100.0, 1000.0]}]


@pytest.mark.parametrize("more", EFFICIENCIES)
def test_it_comes_back_from_a_file(tmp_path, more):
    rig = Rig.from_dict(TABLES | {"plate": PLATE | more})
    rig.save(tmp_path / "rig.toml")
    assert Rig.load(tmp_path / "rig.toml") == rig and rig.plate.row(rig.sensors) == 7


def test_efficiency_is_straight_over_logarithms_and_held_beyond_its_ends():
    plate = Plate(8, 0.1, 1.0, (0.01, 1.0), (100.0, 1000.0))
    efficiency = plate.efficiency(np.array([0.0, 100.0, math.sqrt(1e5), 1000.0, 9000.0]))
    assert efficiency == pytest.approx([0.01, 0.01, 0.1, 1.0, 1.0])
    assert Plate(8, 0.1, 1.0, 0.3).efficiency(np.array([0.0, 50.0])) == pytest.approx([0.3, 0.3])
    assert plate.solid_angle == pytest.approx(2 * math.pi)


@pytest.mark.parametrize(("changed", "words"), [
    ({"sensor": 9}, "plate.sensor 9 is no accelerometer's node; the rig has 1, 2, 3, 4, 5, 6, 7, 8"),
    ({"area": 0}, "plate.area must be > 0, got 0"),
    ({"area": "0.1 m2"}, f"plate.area {NUMBER} '0.1 m2'"),
    ({"radiation_efficiency": -1}, "plate.radiation_efficiency[0] must be > 0, got -1"),
    ({"radiation_efficiency": [1, 2]}, "plate.frequencies holds 0 numbers beside 2 of radiation_efficiency"),
    ({"radiation_efficiency": [1, 2], "frequencies": [3, 2]}, "plate.frequencies must rise"),
    ({"surroundings": "room"}, 'plate.surroundings "room" is unknown; use reflecting floor or free field'),
    ({"colour": "red"}, "plate.colour is not a known key"),
])  # fmt: skip
def test_impossible_plates_are_refused(changed, words):
    assert words in refused("plate", PLATE | changed)


def test_a_sensor_that_measures_along_two_directions_is_no_plate():
    twice = [*TABLES["sensors"], {"node": 8, "position": 1.0, "direction": [0.0, 1.0, 0.0]}]
    rig = TABLES | {"sensors": twice, "bushings": [each | {"shape": "round"} for each in TABLES["bushings"]]}
    with pytest.raises(Exception, match=r"plate\.sensor 8 measures along several directions"):
        Rig.from_dict(rig | {"plate": PLATE})
