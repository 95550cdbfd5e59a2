"""Dataset folders: what comes back, what is refused, and which files are opened."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest

from clearance_mj import Dataset, Record, RecordError, read_uff, write_dataset
from clearance_mj.io import record as record_module

from .dataset_folders import FS, RIG, N, channel, channels, record


def opened(ds):
    return [r.name for r in ds.records if r.opened]


# What comes back


def test_everything_comes_back(tmp_path):
    sent = [record(), record("level-1", "validate")]
    write_dataset(tmp_path, RIG, sent)
    got = Dataset.load(tmp_path)
    assert (got.rig, got.path) == (RIG, tmp_path)
    names = [f.name for f in dataclasses.fields(Record) if f.name != "channels"]
    for a, b in zip(got.records, sent, strict=True):
        assert all(getattr(a, name) == getattr(b, name) for name in names)
        assert (a.size, a.duration) == (b.size, b.duration) == (N, 0.5)
        for one, other in zip(a.channels, b.channels, strict=True):
            assert (one.name, one.label, one.quantity, one.fs) == (other.name, other.label, other.quantity, FS)
            np.testing.assert_array_equal(one.value, other.value)


def test_a_dataset_written_again_is_the_same_in_every_byte(folder, tmp_path):
    loaded = Dataset.load(folder)
    assert [r.name for r in loaded.identify] == ["level-0.5", "hammer"]
    assert [r.name for r in loaded.validate] == ["level-1"]
    hammer = loaded.records[1]  # what is not listed comes back as none
    assert (hammer.level, hammer.seed, hammer.band, hammer.provenance) == (None, None, None, {})
    write_dataset(tmp_path / "again", loaded.rig, loaded.records)
    again, before = ({p.name: p.read_bytes() for p in f.iterdir()} for f in (tmp_path / "again", folder))
    assert sorted(before) == ["dataset.toml", "hammer.uff", "level-0.5.uff", "level-1.uff", "rig.toml"]
    assert again == before


def test_the_list_holds_every_digit_of_the_rate(tmp_path):
    """The universal file alone rounds 1/512.123456789 s to eight digits."""
    fs = 512.123456789
    write_dataset(tmp_path, RIG, [record(fs=fs, channels=[dataclasses.replace(c, fs=fs) for c in channels()])])
    (got,) = Dataset.load(tmp_path).records
    assert got.fs == fs and {c.fs for c in got.channels} == {fs}


# Excitation and response


def values(record, quantity):
    return {c.node: c.value for c in record.channels if c.quantity == quantity}


def test_response_in_the_order_of_the_rig(folder):
    source = Dataset.load(folder).records[0]
    response, acceleration = source.response(), values(source, "acceleration")
    assert response.responses == tuple(f"{i}:+Z" for i in range(1, 9))
    np.testing.assert_array_equal(response.acceleration, np.stack([acceleration[i] for i in range(1, 9)]))
    np.testing.assert_array_equal(response.excitation, acceleration[100])
    assert (response.fs, response.kind, response.band, response.reference) == (FS, "base", (5.0, 220.0), "100:+Z")
    assert response.contact_force is None and response.grease_force is None
    assert response.provenance == {"record": "level-0.5", "rig": "table1", **source.provenance}


def test_probes_in_the_order_of_the_bushings(folder):
    """Nodes 6 and 7 of the table-1 rig sit in its first and second bushing (models/table1_rig.toml)."""
    source = Dataset.load(folder).records[0]
    displacement = values(source, "displacement")
    expected = np.stack([displacement[6], displacement[7]])
    np.testing.assert_array_equal(source.response().displacement, expected)
    response = dataclasses.replace(source, rig=source.rig.replace(bushings=source.rig.bushings[::-1])).response()
    np.testing.assert_array_equal(response.displacement, expected[::-1])


def test_no_displacement_unless_every_bushing_has_a_probe(folder):
    one_probe = [c for c in channels() if (c.node, c.quantity) != (6, "displacement")]
    assert record(channels=one_probe).response().displacement is None
    far = [dataclasses.replace(s, position=0.5) if s.node == 6 else s for s in RIG.sensors]
    assert record(rig=RIG.replace(sensors=tuple(far))).response().displacement is None


def test_directions_of_sensors():
    """One that is mounted upside down is turned round; other directions of a triaxial one are left alone."""
    given = channels()
    turned = [dataclasses.replace(c, direction="-Z", value=-c.value) if c.node in (3, 100) else c for c in given]
    expected = record(channels=given).response()
    for others in (turned, [channel(3, direction="+X"), *given, channel(3, direction="+RZ")]):
        got = record(channels=others).response()
        np.testing.assert_array_equal(got.acceleration, expected.acceleration)
        np.testing.assert_array_equal(got.excitation, expected.excitation)


def test_excitation(folder):
    ramp, hammer, _ = Dataset.load(folder).records
    excitation = ramp.excitation()
    np.testing.assert_array_equal(excitation.value, values(ramp, "acceleration")[100])
    assert (excitation.kind, excitation.fs, excitation.band) == ("base", FS, (5.0, 220.0))
    assert excitation.description == {"generator": "record", "record": "level-0.5", "excitation": "band-limited random",
                                      "level": 0.5, "seed": 7}  # fmt: skip
    np.testing.assert_array_equal(hammer.excitation().value, values(hammer, "force")[200])
    assert hammer.excitation().kind == "force" and hammer.response().reference == "200:+Z"


# Which files are opened


def test_only_the_records_that_are_used_are_opened(folder, monkeypatch):
    read = []
    monkeypatch.setattr(record_module, "read_uff", lambda path, **w: read.append(path.name) or read_uff(path, **w))
    ds = Dataset.load(folder)
    assert [(r.size, r.duration, len(r.channels)) for r in ds.records] == 3 * [(N, 0.5, 11)]
    assert opened(ds) == read == []
    for used in ds.identify:
        used.response(), used.excitation(), list(used.channels)
    assert opened(ds) == ["level-0.5", "hammer"] and read == ["level-0.5.uff", "hammer.uff"]
    assert opened(pickle.loads(pickle.dumps(ds))) == opened(copy.deepcopy(ds)) == opened(ds)
    assert record().opened  # made in memory


def test_file_damaged_after_loading(folder):
    ds = Dataset.load(folder)
    (folder / "hammer.uff").write_bytes(b"gone")
    with pytest.raises(RecordError, match=r"hammer\.uff: not a universal file"):
        ds.records[1].response()
