"""Depths in walls that are said to be too deep: against walls and orbits that are counted by hand."""

import dataclasses

import numpy as np
import pytest

from clearance_mj.rig import Rig
from clearance_mj.rig.depths import depth_words, wall_depths

from ..conftest import ROOT

TABLE_1 = Rig.load(ROOT / "models" / "table1_rig.toml")


def test_walls_of_an_offset_and_of_one_side():
    """Gap 0.3 mm. At rest 0.1 mm above the middle: walls at 0.2 and -0.4 mm; a lower stop alone has none above."""
    first, second = TABLE_1.bushings
    walls = dataclasses.replace(first, offset=1e-4), dataclasses.replace(second, stops="lower")
    rig = TABLE_1.replace(bushings=walls)
    assert wall_depths(rig, np.array([[2.5e-4, -4.2e-4, 0.0], [9e-4, -2e-4, 0.0]])) == pytest.approx([5e-5, 0.0])


def test_an_orbit_in_space():
    """(0.3, 0.4) mm is 0.5 mm from the middle of a gap of 0.3 mm."""
    rig = TABLE_1.with_shape("round")
    moved = np.array([[3e-4, 0.0], [4e-4, 0.0], [1e-4, 0.0], [0.0, 1e-4]])
    assert wall_depths(rig, moved) == pytest.approx([2e-4, 0.0])


def test_no_bushings():
    assert wall_depths(TABLE_1.replace(bushings=()), np.zeros((0, 5))).size == 0


def test_what_is_too_deep_is_said():
    """A fifth of 0.3 mm is 0.06 mm; a bushing that bears 10 µm says so first."""
    contact = dataclasses.replace(TABLE_1.bushings[1].contact, bearable_depth=1e-5)
    rig = TABLE_1.replace(bushings=(TABLE_1.bushings[0], dataclasses.replace(TABLE_1.bushings[1], contact=contact)))
    assert depth_words(rig, [5.9e-5, 9e-6]) == [] == depth_words(rig, [np.nan, np.nan])
    first, second = depth_words(rig, [6.1e-5, 1.1e-5])
    assert first.startswith(
        "clearance 6:+Z: the shaft is 0.061 mm deep in the wall, beyond a fifth of the gap (0.3 mm)"
    )
    words = "clearance 7:+Z: the shaft is 0.011 mm deep in the wall, and from 0.01 mm on the bushing yields"
    assert second.startswith(words)
