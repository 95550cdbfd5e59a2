"""Dataset folders that are refused, and what is left of a folder that could not be written."""

import dataclasses
import re

import numpy as np
import pytest

from clearance_mj import FRF, Dataset, RecordError, RigError, write_dataset, write_uff
from clearance_mj.io import dataset as dataset_module

from .dataset_folders import RIG, N, channels, edit, record
from .refusals import assert_refused

# Refusals


def refused(path, *parts, error=RecordError):
    with pytest.raises(error) as caught:
        Dataset.load(path)
    message = str(caught.value)
    assert message.startswith(str(path)) and "\n" not in message
    assert all(part in message for part in parts), message


def first(path):
    return sorted(path.glob("*.uff"))[0]


@pytest.mark.parametrize("mutate, error, parts", [
    (lambda d: first(d).write_bytes(first(d).read_bytes()[:5000]), RecordError, ["hammer.uff: data set", "cut"]),
    (lambda d: first(d).write_bytes(b"\x00\xff" * 4000), RecordError, ["hammer.uff: not a universal file"]),
    (lambda d: (d / "rig.toml").write_text("beam = {"), RigError, ["rig.toml: not valid TOML"]),
    (lambda d: (d / "rig.toml").write_text((d / "rig.toml").read_text() + "\n[nonsense]\nx = 1\n"), RigError,
     ["rig.toml: nonsense is not a known key"]),
    (lambda d: first(d).unlink(), RecordError, ["hammer.uff: cannot be read (No such file"]),
    (lambda d: [p.unlink() for p in d.iterdir()], RecordError, ["is empty; a dataset is a folder with rig.toml"]),
], ids=["truncated", "garbage", "notoml", "unknown", "missing", "empty"])  # fmt: skip
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


@pytest.mark.parametrize("text, part", [
    ("records = [", "not valid TOML"),
    ("", "records is missing"),
    ("records = []", "records must hold 1 or more, got none"),
    ("records = 3", "records must be a list of tables ([[records]]), got 3"),
    ("records = [1]", "records[0] must be a table of keys, got 1"),
    ("[records]\nname = 'a'", "records must be a list of tables ([[records]]), got"),
    ("title = 'x'\n[[records]]\n", "title is not a known key; known: records"),
])  # fmt: skip
def test_list_that_is_no_list(folder, text, part):
    (folder / "dataset.toml").write_text(text)
    refused(folder, "dataset.toml: ", part)


def test_list_in_another_encoding(folder):
    (folder / "dataset.toml").write_bytes(b"# \xe9\n" + (folder / "dataset.toml").read_bytes())
    refused(folder, "dataset.toml: not valid TOML")


@pytest.mark.parametrize("changes, part", [
    ({"role": "train"}, 'role "train" is unknown; use identify, validate, sine or orbit'),
    ({"kind": "shock"}, 'kind "shock" is unknown; use base, force or spin'),
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
])  # fmt: skip
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


@pytest.mark.parametrize("change, part", [
    (without(4), "has no acceleration at node 4 along Z, a sensor of the rig; leave it out of this record alone"),
    (without(100), "has no acceleration at node 100 along Z, the excitation"),
    (lambda given: [], "has no channels"),
    (swap(2, value=np.zeros(N - 1)), 'channel "acceleration 6" has 255 samples, channel "acceleration 8" has 256'),
    (swap(2, fs=1024.0), 'channel "acceleration 6" is sampled at 1024 Hz, the record at 512 Hz'),
    (swap(2, start=0.1), 'channel "acceleration 6" starts at 0.1 s, channel "acceleration 8" at 0 s'),
    (swap(2, direction="+X"), "has no acceleration at node 6 along Z"),
    (swap(2, quantity="velocity"), "has no acceleration at node 6 along Z"),
    (swap(2, node=5, direction="-Z"),
     'channels "acceleration 6" and "acceleration 5" both are acceleration at node 5 along Z'),
])  # fmt: skip
def test_channels_that_do_not_fit(folder, change, part):
    assert_refused('record "level-0.5": ' + re.escape(part), record, channels=change(channels()))
    if changed := change(channels()):
        write_uff(folder / "level-0.5.uff", changed)
        refused(folder, "dataset.toml: records[0] (level-0.5.uff)", part)


@pytest.mark.parametrize("changed, part", [
    ({"left_out": ("9:+Z",)}, 'left_out: "9:+Z" is no sensor of the rig; it has 1:+Z, '),
    ({"left_out": ("4:+Z",), "role": "validate"}, "left_out is for records to identify: others are compared at"),
    ({"left_out": ("4:+Z",), "role": "sine"}, "left_out is for records to identify: others are compared at"),
    ({"left_out": tuple(RIG.sensor_labels)}, "left_out leaves no sensor"),
])  # fmt: skip
def test_sensors_that_cannot_be_left_out(changed, part):
    assert_refused('record "level-0.5": ' + re.escape(part), record, **changed)


def test_file_of_frfs_instead_of_a_record(folder):
    write_uff(folder / "level-1.uff", FRF([1.0, 2.0], [[1.0 + 0j, 2.0]]))
    refused(folder, "level-1.uff: needs time records (data sets 58 of function type 1); its functions are 4 (freq")


def test_writing_refuses_before_it_writes(tmp_path):
    other = record("b", rig=RIG.replace(name="other"))
    for records, part in (
        ([], "at least one record"),
        ([record("a"), record("A")], 'record name "A" is used twice'),
        ([record("a"), other], 'record "b" was measured on another rig, "other"'),
        ([record("a", provenance={"law": None})], "a provenance holds what TOML cannot"),
        ([record("a", provenance={"law": object()})], "a provenance holds what TOML cannot"),
    ):
        assert_refused(re.escape(f"{tmp_path}: ") + ".*" + part, write_dataset, tmp_path, RIG, records)
    assert not list(tmp_path.iterdir())


def test_list_is_written_last(tmp_path, monkeypatch):
    """A run that dies half-way leaves a folder that does not load, not half a dataset."""

    def fail(path, obj):
        raise OSError("disk full")

    monkeypatch.setattr(dataset_module, "write_uff", fail)
    with pytest.raises(OSError, match="disk full"):
        write_dataset(tmp_path, RIG, [record()])
    refused(tmp_path, "has no dataset.toml")
