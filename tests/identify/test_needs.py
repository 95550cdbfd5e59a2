"""What a method needs of the records is told before anything is computed; what is built upon is in its own words."""

import dataclasses

import pytest

from clearance_mj import identify
from clearance_mj.core.errors import RecordError
from clearance_mj.identify import METHODS, require
from clearance_mj.identify.records import needs
from clearance_mj.io.dataset import Dataset

from ..conftest import record_of

OWN = {name for name, method in METHODS.items() if method.find.__module__.startswith("clearance_mj.")}
NO_PROBES = {"nominal", "constant", "output-error", "bench"}
"""Methods that get by without probes, by their docstrings: the datasheet, output error on the accelerometers, and the
bench, which takes the band from 4 Hz on."""


@pytest.fixture(scope="module")
def whole(rig):
    return record_of(rig, "whole", "identify", 1.0, 1, duration=8.0)


def without(record, quantity, nodes=None):
    """The record without channels of a quantity, at all nodes or some."""
    kept = [c for c in record.channels if c.quantity != quantity or (nodes and c.node not in nodes)]
    return dataclasses.replace(record, name="bare", channels=kept)


def allowed(dataset):
    """Those of the package: experiments that other tests import register more."""
    names = set()
    for name in OWN:
        try:
            require(name, dataset)
        except RecordError:
            continue
        names.add(name)
    return names


def test_methods_that_need_probes_are_refused_and_say_which_are_left(whole, rig, monkeypatch):
    bare = Dataset(rig, (without(whole, "displacement", {7}),))
    assert allowed(Dataset(rig, (whole,))) == OWN and allowed(bare) == NO_PROBES
    monkeypatch.setattr(type(bare.records[0]), "response", None)  # no sample is looked at
    words = r'method "amplitude": it needs a displacement probe at every bushing, and record "bare" has none at '
    with pytest.raises(RecordError, match=words + r"bushings\[1\] \(displacement at node 7\); these records allow"):
        identify.law(bare, "amplitude")


def test_ridge_needs_probes_in_the_longest_record_only(whole, rig):
    short = record_of(rig, "short", "identify", 1.0, 2, duration=4.0)
    assert "ridge" in allowed(Dataset(rig, (whole, without(short, "displacement"))))
    assert "ridge" not in allowed(Dataset(rig, (without(whole, "displacement"), short)))


def test_bench_needs_more_sensors_than_clearances(whole, rig):
    """Two clearances: two accelerometers are enough with probes, and not without."""
    few = rig.replace(sensors=rig.sensors[5:7])
    bare = dataclasses.replace(without(whole, "displacement"), rig=few)
    assert needs.more_sensors_than_clearances(Dataset(few, (dataclasses.replace(whole, rig=few),))) == ""
    assert "there are 2 sensors and 2 clearances" in needs.more_sensors_than_clearances(Dataset(few, (bare,)))
    assert "bench" not in allowed(Dataset(few, (bare,)))


def test_without_a_record_to_identify_the_datasheet_is_left(whole, rig):
    assert allowed(Dataset(rig, (dataclasses.replace(whole, role="validate"),))) == {"nominal"}
