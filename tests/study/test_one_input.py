"""A study of a rig in a plane compares with records of one input, and names those of the other that it leaves out."""

import dataclasses

import numpy as np
import pytest

from clearance_mj import Channel, Dataset, Record
from clearance_mj.core.notes import RecordNote
from clearance_mj.study.case import single_input_dataset


def record(rig, name, role, kind):
    driven = (100, "acceleration") if kind == "base" else (200, "force")
    places = [driven, *((sensor.node, "acceleration") for sensor in rig.sensors)]
    channels = [Channel(f"{node}", node, "+Z", quantity, np.zeros(8), 512.0) for node, quantity in places]
    return Record(name, role, rig, 512.0, channels, kind, level=1.0)


def test_records_of_the_rarer_input_are_left_out_with_a_note(rig):
    rig = rig.replace(shaker=dataclasses.replace(rig.shaker, position=0.3))
    tests = [("a", "validate", "base"), ("b", "validate", "base"), ("hit", "validate", "force")]
    records = [record(rig, *test) for test in (*tests, ("hammer", "identify", "force"))]
    with pytest.warns(RecordNote, match='compared with records of kind "base"; left out hit, of the other input'):
        dataset = single_input_dataset(Dataset(rig, tuple(records)))
    assert [r.name for r in dataset.records] == ["a", "b", "hammer"]
    alone = Dataset(rig, tuple(records[:2]))
    assert single_input_dataset(alone) is alone
