"""Rigs of slots and round clearances together: what their files say, rows and labels, and who refuses them in one line.

Rows and labels are written out by hand: a slot or stop has one row, a round clearance those along y and z.
"""

import dataclasses

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.core.errors import ClearanceError, RigError
from clearance_mj.io.dataset import Dataset, Record, write_dataset
from clearance_mj.io.formats import to_channels
from clearance_mj.io.uff.geometry import rig_geometry
from clearance_mj.rig import Bushing, Contact, Friction, Grease, Load, OilFilm, Spin
from clearance_mj.rig.depths import wall_depths
from clearance_mj.signals.response import Response
from clearance_mj.statistics import contact_statistics
from tests.conftest import ROOT
from tests.refusals import assert_refused

TABLE1 = cm.Rig.load(ROOT / "models" / "table1_rig.toml")
ROUND, SLOT = TABLE1.with_shape("round").bushings[0], TABLE1.bushings[1]
TEETH = Bushing("@0.33:RX", 1e-3, 0.0, Grease(0.0), Contact(1e3))
BOTH = TABLE1.replace(bushings=(ROUND, TEETH, SLOT))


def test_rows_and_labels():
    assert [b.n_coordinates for b in BOTH.bushings] == [2, 1, 1] and BOTH.n_rows == 4 and BOTH.moves_across
    assert BOTH.clearance_rows == [slice(0, 2), slice(2, 3), slice(3, 4)]
    assert BOTH.bushing_of_row.tolist() == [0, 0, 1, 2]
    assert BOTH.end_rows.tolist() == [[0, 2], [1, 3], [4, 5], [6, 7]]
    assert BOTH.probe_labels == ["6:+Y", "6:+Z", "301:+RX", "7:+Z"]
    assert BOTH.clearance_labels == ["6:+Z", "@0.33:RX", "7:+Z"]
    assert [row[0] for row in BOTH._overview().table[1:]] == ["6:+Y", "301:+RX", "7:+Z"]
    across = dataclasses.replace(SLOT, position=f"@{SLOT.position}:-Y")
    assert TABLE1.replace(bushings=(ROUND, across)).probe_labels == ["6:+Y", "6:+Z", "7:-Y"]
    assert TABLE1.replace(bushings=()).clearance_rows == [] and not TABLE1.replace(bushings=()).end_rows.size


def test_a_clearance_whose_row_has_its_name_already_is_a_probe_of_its_own():
    """Two at one node along one direction: the second one has node 301, the first that no sensor has."""
    teeth = dataclasses.replace(TEETH, position=f"@{ROUND.position}:RX")
    rig = TABLE1.replace(bushings=(ROUND, teeth, dataclasses.replace(teeth, gap=2e-3)))
    assert rig.probe_labels == ["6:+Y", "6:+Z", "6:+RX", "301:+RX"]


def test_a_file_says_the_shape_of_each_and_comes_back(tmp_path):
    rig = BOTH.replace(gravity=(0.0, 0.0, -9.81), spin=Spin(20.0))
    rig.save(tmp_path / "rig.toml")
    assert cm.Rig.load(tmp_path / "rig.toml") == rig
    assert (tmp_path / "rig.toml").read_text(encoding="utf-8").count('shape = "round"') == 1
    assert rig.content() == rig.to_dict()  # older files, of one kind alone, have no such digest
    assert "motion" not in rig.content()


def test_slots_may_stand_in_a_rig_that_moves_along_y():
    """Which planes a shaft bends in follows from what acts; slots stay along z."""
    pushed = dataclasses.replace(TABLE1.shaker, kind="force", position=0.5, direction=(0.0, 1.0, 0.0))
    across = (Load(0.5, force=(0.0, 1.0, 0.0)),)
    for rig in (TABLE1.replace(spin=Spin(20.0)), TABLE1.replace(shaker=pushed), TABLE1.replace(loads=across)):
        assert rig.moves_across and rig.n_rows == 2 and rig.probe_labels == TABLE1.probe_labels


@pytest.mark.parametrize(("change", "words"), [
    ({"friction": Friction(0.1, along="3:Y")}, 'bushings[2].friction.along "3:Y" is no position on the beam'),
    ({"offset_y": 1e-5}, 'bushings[2].offset_y needs shape = "round", and bushings[2] is a slot'),
    ({"film": OilFilm(0.02), "grease": Grease(0.0)}, 'bushings[2].film needs shape = "round"'),
    ({"probe_angle": 0.1}, 'bushings[2].probe_angle needs shape = "round"'),
    ({"position": "@0.77:X", "length": 0.0}, '"@0.77:X": a shaft does not move along X'),
    ({"position": "@0.77:Y", "shape": "round"}, "bushings[2].position names Y, but it moves along y and z"),
])  # fmt: skip
def test_what_a_slot_cannot_have_is_refused_beside_round_ones(change, words):
    changed = lambda: BOTH.replace(bushings=(ROUND, TEETH, dataclasses.replace(SLOT, **change)))  # noqa: E731
    assert words in assert_refused(RigError, None, changed)


def response():
    """Two seconds in which row i of the displacements is i + 1 µm, and of the forces i + 1 N."""
    rows, n = np.arange(1.0, 5.0)[:, None] * np.ones(128), len(BOTH.sensors)
    return Response(
        64.0, np.zeros(128), np.zeros((n, 128)), 1e-6 * rows, rows, 0 * rows, responses=tuple(BOTH.sensor_labels),
        contact_share=np.array([0.1, 0.2, 0.3]), coordinates=tuple(BOTH.probe_labels), provenance={"step": 1e-4},
    )  # fmt: skip


def test_a_response_knows_the_rows_of_each_clearance():
    both_kinds = response()
    assert both_kinds.clearance_rows == BOTH.clearance_rows
    assert Response.from_xarray(both_kinds.to_xarray()).clearance_rows == BOTH.clearance_rows
    statistics = contact_statistics(both_kinds)
    np.testing.assert_allclose(statistics["displacement_peak"], [np.hypot(1e-6, 2e-6), 3e-6, 4e-6])
    np.testing.assert_allclose(statistics["contact_peak"], [np.hypot(1.0, 2.0), 3.0, 4.0])
    axes = {ax.get_ylabel(): ax for ax in both_kinds.plot().axes}
    names = [line.get_label() for line in axes["Contact force (N)"].get_lines()]
    assert names == ["bushing 1, y", "bushing 1, z", "bushing 2", "bushing 3"]
    depth = wall_depths(BOTH, np.tile(np.array([[3e-4], [4e-4], [-2e-3], [1e-4]]), 5))
    np.testing.assert_allclose(depth, [5e-4 - ROUND.gap, 1e-3, 0.0], rtol=1e-12)


def test_records_have_a_channel_for_every_row(tmp_path):
    write_dataset(tmp_path, BOTH, [Record("r", "identify", BOTH, 64.0, to_channels(response(), BOTH))])
    record = Dataset.load(tmp_path).records[0]
    assert not record.missing_probes and record.rig == BOTH
    np.testing.assert_allclose(record.response().displacement[:, 0], 1e-6 * np.arange(1, 5), rtol=1e-6)
    without = [c for c in to_channels(response(), BOTH) if c.label != "301:+RX"]
    assert Record("r", "identify", BOTH, 64.0, without).missing_probes == ((2, "301:+RX"),)
    geometry = rig_geometry(BOTH)
    places = dict(zip(geometry.numbers, geometry.position))
    assert places[301][0] == 0.33 and places[7][0] == SLOT.position


def test_what_knows_slots_alone_says_so_in_one_line():
    dataset = Dataset(BOTH, [Record("r", "identify", BOTH, 64.0, to_channels(response(), BOTH))])
    words = r'method "constant" knows planar rigs, and rig .* moves in space'
    assert_refused(ClearanceError, words, cm.identify.identify, dataset, "constant")
