"""Dataset folders: what comes back, what is refused, and which files are opened."""

import copy
import dataclasses
import pickle
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
import tomli_w

from clearance_mj.core.errors import RecordError, RigError
from clearance_mj.io import dataset as dataset_module
from clearance_mj.io import record as record_module
from clearance_mj.io.dataset import Dataset, Record, write_dataset
from clearance_mj.io.uff import Channel, read_uff, write_uff
from clearance_mj.rig import Rig
from clearance_mj.signals.frf import FRF

RIG = Rig.load(Path(__file__).parents[2] / "models" / "table1_rig.toml")
RNG = np.random.default_rng(3)
N, FS = 256, 512.0


def channel(node, quantity="acceleration", direction="+Z", n=N, fs=FS, **more):
    value = RNG.standard_normal(n).astype(np.float32)
    return Channel(f"{quantity} {node}", node, direction, quantity, value, fs, **more)


def channels():
    """In an order that is not the rig's."""
    accelerometers = [channel(node) for node in (8, 7, 6, 5, 4, 3, 2, 1)]
    return [*accelerometers, channel(100), channel(7, "displacement"), channel(6, "displacement")]


def record(name="level-0.5", role="identify", **changes):
    values = {
        "rig": RIG,
        "fs": FS,
        "channels": channels(),
        "description": "band-limited random",
        "level": 0.5,
        "seed": 7,
        "band": (5.0, 220.0),
        "provenance": {"synthetic": True, "generator": "test", "noise": {"share": 0.01}},
    }
    return Record(name, role, **(values | changes))


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "rig one"
    hammer = [c for c in channels() if c.node != 100] + [channel(200, "force")]
    plain = {"level": None, "seed": None, "band": None, "provenance": {}}
    records = [
        record(),
        record("hammer", excitation_kind="force", channels=hammer, **plain),
        record("level-1", "validate", level=1.0),
    ]
    write_dataset(path, RIG, records)
    return path


def opened(ds):
    return [r.name for r in ds.records if r.opened]


def edit(path, change):
    """Change the parsed dataset.toml in place."""
    data = tomllib.loads((path / "dataset.toml").read_text())
    change(data)
    (path / "dataset.toml").write_text(tomli_w.dumps(data))


# What comes back


def test_everything_comes_back(tmp_path):
    sent = [record(), record("level-1", "validate")]
    write_dataset(tmp_path, RIG, sent)
    got = Dataset.load(tmp_path)
    assert got.rig == RIG
    assert got.path == tmp_path
    names = [f.name for f in dataclasses.fields(Record) if f.name != "channels"]
    for a, b in zip(got.records, sent, strict=True):
        assert all(getattr(a, name) == getattr(b, name) for name in names)
        assert (a.size, a.duration) == (b.size, b.duration) == (N, 0.5)
        for one, other in zip(a.channels, b.channels, strict=True):
            assert (one.name, one.label, one.quantity, one.fs) == (other.name, other.label, other.quantity, FS)
            np.testing.assert_array_equal(one.value, other.value)


def test_a_dataset_written_again_is_the_same_in_every_byte(folder, tmp_path):
    loaded = Dataset.load(folder)
    write_dataset(tmp_path / "again", loaded.rig, loaded.records)
    names = sorted(p.name for p in folder.iterdir())
    assert names == ["dataset.toml", "hammer.uff", "level-0.5.uff", "level-1.uff", "rig.toml"]
    for name in names:
        assert (tmp_path / "again" / name).read_bytes() == (folder / name).read_bytes()


def test_roles(folder):
    ds = Dataset.load(folder)
    assert [r.name for r in ds.identify] == ["level-0.5", "hammer"]
    assert [r.name for r in ds.validate] == ["level-1"]


def test_what_is_not_listed_comes_back_as_none(folder):
    hammer = Dataset.load(folder).records[1]
    assert (hammer.level, hammer.seed, hammer.band, hammer.provenance) == (None, None, None, {})


def test_the_list_holds_every_digit_of_the_rate(tmp_path):
    """The universal file alone rounds 1/512.123456789 s to eight digits."""
    fs = 512.123456789
    write_dataset(tmp_path, RIG, [record(fs=fs, channels=[dataclasses.replace(c, fs=fs) for c in channels()])])
    (got,) = Dataset.load(tmp_path).records
    assert got.fs == fs
    assert {c.fs for c in got.channels} == {fs}


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
    turned = source.rig.replace(bushings=source.rig.bushings[::-1])
    response = dataclasses.replace(source, rig=turned).response()
    np.testing.assert_array_equal(response.displacement, expected[::-1])


def test_no_displacement_unless_every_bushing_has_a_probe(folder):
    one_probe = [c for c in channels() if (c.node, c.quantity) != (6, "displacement")]
    assert record(channels=one_probe).response().displacement is None
    far = [dataclasses.replace(s, position=0.5) if s.node == 6 else s for s in RIG.sensors]
    assert record(rig=RIG.replace(sensors=tuple(far))).response().displacement is None


def test_a_sensor_mounted_upside_down_is_turned_round():
    given = channels()
    turned = [dataclasses.replace(c, direction="-Z", value=-c.value) if c.node in (3, 100) else c for c in given]
    expected, got = record(channels=given).response(), record(channels=turned).response()
    np.testing.assert_array_equal(got.acceleration, expected.acceleration)
    np.testing.assert_array_equal(got.excitation, expected.excitation)


def test_other_directions_of_a_triaxial_sensor_are_left_alone():
    given = channels()
    more = [channel(3, direction="+X"), *given, channel(3, direction="+RZ")]
    np.testing.assert_array_equal(
        record(channels=more).response().acceleration, record(channels=given).response().acceleration
    )


def test_excitation(folder):
    ramp, hammer, _ = Dataset.load(folder).records
    excitation = ramp.excitation()
    np.testing.assert_array_equal(excitation.value, values(ramp, "acceleration")[100])
    assert (excitation.kind, excitation.fs, excitation.band) == ("base", FS, (5.0, 220.0))
    assert excitation.description == {
        "generator": "record",
        "record": "level-0.5",
        "excitation": "band-limited random",
        "level": 0.5,
        "seed": 7,
    }
    np.testing.assert_array_equal(hammer.excitation().value, values(hammer, "force")[200])
    assert hammer.excitation().kind == "force"
    assert hammer.response().reference == "200:+Z"


# Which files are opened


def test_loading_parses_no_samples(folder, monkeypatch):
    monkeypatch.setattr(record_module, "read_uff", lambda path: pytest.fail(f"{path} was read"))
    ds = Dataset.load(folder)
    assert [(r.size, r.duration, len(r.channels)) for r in ds.records] == 3 * [(N, 0.5, 11)]
    assert opened(ds) == []


def test_only_the_records_that_are_used_are_opened(folder, monkeypatch):
    read = []
    monkeypatch.setattr(record_module, "read_uff", lambda path: read.append(path.name) or read_uff(path))
    ds = Dataset.load(folder)
    for used in ds.identify:
        used.response(), used.excitation(), list(used.channels)
    assert opened(ds) == ["level-0.5", "hammer"]
    assert read == ["level-0.5.uff", "hammer.uff"]


def test_a_copy_remembers_what_was_opened(folder):
    assert record().opened  # made in memory
    ds = Dataset.load(folder)
    ds.records[0].response()
    again = pickle.loads(pickle.dumps(ds))
    assert opened(again) == ["level-0.5"]
    assert opened(copy.deepcopy(ds)) == ["level-0.5"]


def test_file_damaged_after_loading(folder):
    ds = Dataset.load(folder)
    (folder / "hammer.uff").write_bytes(b"gone")
    with pytest.raises(RecordError, match=r"hammer\.uff: not a universal file"):
        ds.records[1].response()


# Refusals


def refused(path, *parts, error=RecordError):
    with pytest.raises(error) as caught:
        Dataset.load(path)
    message = str(caught.value)
    assert message.startswith(str(path)) and "\n" not in message
    assert all(part in message for part in parts), message


def first(path):
    return sorted(path.glob("*.uff"))[0]


@pytest.mark.parametrize(
    ("mutate", "error", "parts"),
    [
        (lambda d: first(d).write_bytes(first(d).read_bytes()[:5000]), RecordError, ["hammer.uff: data set", "cut"]),
        (lambda d: first(d).write_bytes(b"\x00\xff" * 4000), RecordError, ["hammer.uff: not a universal file"]),
        (lambda d: (d / "rig.toml").write_text("beam = {"), RigError, ["rig.toml: not valid TOML"]),
        (
            lambda d: (d / "rig.toml").write_text((d / "rig.toml").read_text() + "\n[nonsense]\nx = 1\n"),
            RigError,
            ["rig.toml: nonsense is not a known key"],
        ),
        (lambda d: first(d).unlink(), RecordError, ["hammer.uff: cannot be read (No such file"]),
        (lambda d: [p.unlink() for p in d.iterdir()], RecordError, ["is empty; a dataset is a folder with rig.toml"]),
    ],
    ids=["truncated", "garbage", "notoml", "unknown", "missing", "empty"],
)
def test_cases_of_the_acceptance_check(folder, mutate, error, parts):
    """Six ways in which a dataset may be broken."""
    mutate(folder)
    refused(folder, *parts, error=error)


def test_folder_that_is_no_dataset(tmp_path):
    refused(tmp_path / "absent", "does not exist; a dataset is a folder with rig.toml, dataset.toml and the .uff file")
    (tmp_path / "notes.txt").write_text("")
    refused(tmp_path, "has no dataset.toml; a dataset is a folder with")
    refused(tmp_path / "notes.txt", "is not a folder")


def test_rig_file_missing(folder):
    (folder / "rig.toml").unlink()
    refused(folder, "rig.toml: cannot be read", error=RigError)


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("records = [", "not valid TOML"),
        ("", "records is missing"),
        ("records = []", "records must hold 1 or more, got none"),
        ("records = 3", "records must be a list of tables ([[records]]), got 3"),
        ("records = [1]", "records[0] must be a table of keys, got 1"),
        ("[records]\nname = 'a'", "records must be a list of tables ([[records]]), got"),
        ("title = 'x'\n[[records]]\n", "title is not a known key; known: records"),
    ],
)
def test_list_that_is_no_list(folder, text, part):
    (folder / "dataset.toml").write_text(text)
    refused(folder, "dataset.toml: ", part)


def test_list_in_another_encoding(folder):
    (folder / "dataset.toml").write_bytes(b"# \xe9\n" + (folder / "dataset.toml").read_bytes())
    refused(folder, "dataset.toml: not valid TOML")


@pytest.mark.parametrize(
    ("changes", "part"),
    [
        ({"role": "train"}, 'role "train" is unknown; use identify, validate or sine'),
        ({"kind": "shock"}, 'kind "shock" is unknown; use base or force'),
        ({"kind": "force"}, "has no force at node 200 along Z, the excitation of a record of kind"),
        ({"fs": 1024.0}, "is sampled at 512 Hz, the record at 1024 Hz"),
        ({"fs": 400.0}, "fs 400 Hz is below twice the band's upper end 220 Hz"),
        ({"fs": 0}, "records[0].fs must be > 0, got 0 (samples per second)"),
        ({"fs": "512 Hz"}, "records[0].fs must be a plain number in SI units, got '512 Hz'"),
        ({"fs": 10**400}, "records[0].fs must be a plain number in SI units, got 1000"),
        ({"band": [5.0, 300.0]}, "is below twice the band's upper end 300 Hz"),
        ({"band": [220.0, 5.0]}, "must be two increasing frequencies"),
        ({"band": [5.0]}, "records[0].band must be a list of 2 numbers, got [5.0]"),
        ({"band": [5.0, "220"]}, "records[0].band[1] must be a plain number in SI units, got '220'"),
        ({"band": [5.0, float("nan")]}, "records[0].band[1] must be finite, got nan"),
        ({"level": -1.0}, "records[0].level must be >= 0, got -1 (RMS of the excitation, m/s² or N)"),
        ({"seed": 1.5}, "seed must be a whole number, got 1.5"),
        ({"name": "level-1"}, 'record name "level-1" is used twice'),
        ({"name": "LEVEL-1"}, "is used twice"),
        ({"name": ""}, "records[0].name must be letters, digits"),
        ({"name": "a/b"}, "name must be letters"),
        ({"name": 3}, "name must be a string, got 3"),
        ({"file": "../other.uff"}, "must be the name of a file in the folder"),
        ({"file": "a\\b.uff"}, "must be the name of a file in the folder"),
        ({"file": "a\0.uff"}, "must be the name of a file in the folder"),
        ({"file": "a" * 300}, "cannot be read"),
        ({"file": ".."}, "cannot be read"),
        ({"provenance": "mine"}, "provenance must be a table"),
        ({"colour": "red"}, "records[0].colour is not a known key; known: name, file, role"),
    ],
)
def test_impossible_entries(folder, changes, part):
    edit(folder, lambda data: data["records"][0].update(changes))
    refused(folder, part)


@pytest.mark.parametrize("key", ["name", "file", "role", "fs"])
def test_entry_without(folder, key):
    edit(folder, lambda data: data["records"][1].pop(key))
    refused(folder, f"dataset.toml: records[1].{key} is missing")


def without(node):
    return lambda given: [c for c in given if c.node != node]


def swap(index, **changes):
    def change(given):
        given[index] = dataclasses.replace(given[index], **changes)
        return given

    return change


@pytest.mark.parametrize(
    ("change", "part"),
    [
        (without(4), "has no acceleration at node 4 along Z, a sensor of the rig"),
        (without(100), "has no acceleration at node 100 along Z, the excitation"),
        (lambda given: [], "has no channels"),
        (swap(2, value=np.zeros(N - 1)), 'channel "acceleration 6" has 255 samples, channel "acceleration 8" has 256'),
        (swap(2, fs=1024.0), 'channel "acceleration 6" is sampled at 1024 Hz, the record at 512 Hz'),
        (swap(2, start=0.1), 'channel "acceleration 6" starts at 0.1 s, channel "acceleration 8" at 0 s'),
        (swap(2, direction="+X"), "has no acceleration at node 6 along Z"),
        (swap(2, quantity="velocity"), "has no acceleration at node 6 along Z"),
        (
            swap(2, node=5, direction="-Z"),
            'channels "acceleration 6" and "acceleration 5" both are acceleration at node 5 along Z',
        ),
    ],
)
def test_channels_that_do_not_fit(folder, change, part):
    with pytest.raises(RecordError, match='record "level-0.5": ' + re.escape(part)):
        record(channels=change(channels()))
    if changed := change(channels()):
        write_uff(folder / "level-0.5.uff", changed)
        refused(folder, "dataset.toml: records[0] (level-0.5.uff)", part)


def test_file_of_frfs_instead_of_a_record(folder):
    write_uff(folder / "level-1.uff", FRF([1.0, 2.0], [[1.0 + 0j, 2.0]]))
    refused(folder, "level-1.uff: holds FRFs, needs time functions")


def test_writing_refuses_before_it_writes(tmp_path):
    other = record("b", rig=RIG.replace(name="other"))
    for records, part in (
        ([], "at least one record"),
        ([record("a"), record("A")], 'record name "A" is used twice'),
        ([record("a"), other], 'record "b" was measured on another rig, "other"'),
        ([record("a", provenance={"law": None})], "a provenance holds what TOML cannot"),
        ([record("a", provenance={"law": object()})], "a provenance holds what TOML cannot"),
    ):
        with pytest.raises(RecordError, match=re.escape(f"{tmp_path}: ") + ".*" + part):
            write_dataset(tmp_path, RIG, records)
    assert not list(tmp_path.iterdir())


def test_list_is_written_last(tmp_path, monkeypatch):
    """A run that dies half-way leaves a folder that does not load, not half a dataset."""

    def fail(path, obj):
        raise OSError("disk full")

    monkeypatch.setattr(dataset_module, "write_uff", fail)
    with pytest.raises(OSError, match="disk full"):
        write_dataset(tmp_path, RIG, [record()])
    refused(tmp_path, "has no dataset.toml")
