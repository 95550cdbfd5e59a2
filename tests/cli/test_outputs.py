"""What commands write: files of others stay as they are, whatever their names; what was read is never replaced."""

import hashlib
import json
import os
import shutil
import socket
import stat

import numpy as np
import pytest

from clearance_mj import ClearanceError, Dataset, Rig, write_dataset
from clearance_mj.cli import main
from clearance_mj.core.files import plain_file, replacing, write_text
from clearance_mj.core.runner import Runner
from clearance_mj.io import formats
from clearance_mj.sweep import run_sweep

from ..conftest import ROOT
from ..fuzz import samples
from ..processes import content
from ..sweep.plans import loaded, small
from .conftest import RIG

QUICK = ("--engine", "modal", "--duration", "0.05")
NAMES = ("placement.csv", "placement.json", "comparison.json", "response.csv", "backbone.json", "rattle_map.png",
         "modes.csv", "synthesis.png", "rig.toml", "calibration.json", "updated_rig.json", "motion.json",
         "phase_portraits.png", "energy.csv", "impacts.csv", "index.html", "report.html", "summary.json", "results.nc",
         "law.json", "identified.json", "lock", "plan.json", "cases", "thesis.tex", "campbell.csv",
         "orbits.json", "running_clearance.csv", "unbalance.csv")  # fmt: skip


@pytest.fixture
def mine(tmp_path):
    """58 files of the user's in a folder and beside it, with names of this program's own; all are there after."""
    for folder in ("mine", "beside"):
        (tmp_path / folder).mkdir()
        for name in NAMES:
            (tmp_path / folder / name).write_bytes(f"{folder} {name}".encode())
    before = content(tmp_path)
    assert len(before) == 58
    yield tmp_path / "mine"
    after = content(tmp_path)
    assert {name: after.get(name) for name in before} == before


@pytest.mark.parametrize("command", [
    ("place", RIG), ("motion", RIG, *QUICK, "--sine", "50"), ("campbell", RIG, "--speeds", "0", "100"),
    ("unbalance", RIG, "--speeds", "0", "100"), ("orbits", RIG),
    ("running-clearance", RIG, "--speeds", "0", "100", "--operating", "50", "100"), ("backbone", RIG),
    ("response", RIG, "--level", "1"), ("rattle-map", RIG, "--levels", "1"), ("modes", "frf.uff"),
    ("compare", "frf.uff", "frf.uff", "--modes", "0"), ("calibrate", RIG, "f.csv", "--free", "beam.length"),
    ("update-rig", ROOT / "data" / "table1_rig"), ("study", ROOT / "data" / "table1_rig"),
    ("identify", ROOT / "data" / "table1_rig"), ("sweep", "plan.toml"), ("vehicle", "--controller", "smc"),
    ("twin", ROOT / "data" / "table1_rig" / "hammer.uff", "--rig", RIG),
], ids=lambda command: command[0])  # fmt: skip
def test_files_of_the_users_in_the_folder_to_write_into(command, mine, tmp_path, refused, monkeypatch):
    monkeypatch.chdir(tmp_path)
    formats.write(tmp_path / "frf.uff", samples.frf())
    (tmp_path / "f.csv").write_text("frequency_hz\n10\n")
    loaded(tmp_path, small(2))
    message = refused(*command, "--out", mine, "--quiet")
    assert str(mine) in message and ("is there and not listed" in message or "not of a sweep" in message)


def test_energy_beside_files_of_the_users(mine, tmp_path, refused):
    message = refused("simulate", RIG, *QUICK, "--out", tmp_path / "r.nc", "--energy", mine)
    assert "energy.csv is there and not listed" in message


@pytest.mark.parametrize("command", [
    ("simulate", *QUICK, "--out", "{}.nc"), ("animate", *QUICK, "--out", "{}.gif"), ("new", "--out", "{}.toml"),
    ("simulate", *QUICK, "--out", "{}.txt"), ("live", "--no-browser", "--out", "{}.txt"),
])  # fmt: skip
def test_a_file_of_the_users_in_the_way(command, tmp_path, refused):
    name, *options = command
    path = tmp_path / options[-1].format("thesis")
    path.write_text("precious")
    message = refused(name, "bench" if name == "new" else RIG, *options[:-1], path)
    assert str(path) in message and path.read_text() == "precious"


def test_what_is_read_is_not_replaced(tmp_path, refused, answer):
    shutil.copy(RIG, tmp_path / "rig.toml")
    before = content(tmp_path)
    for out in ("rig.toml", "link.nc"):
        (tmp_path / "link.nc").unlink(missing_ok=True)
        (tmp_path / "link.nc").symlink_to("rig.toml")
        assert out in refused("simulate", tmp_path / "rig.toml", *QUICK, "--out", tmp_path / out)
    assert "is read by this command" in refused("convert", tmp_path / "rig.toml", tmp_path / "rig.toml")
    assert content(tmp_path) == before | {"link.nc": before["rig.toml"]}


def test_own_files_are_replaced_and_say_what_they_come_from(tmp_path, answer):
    out = tmp_path / "r.nc"
    for _ in range(2):
        answer("simulate", RIG, *QUICK, "--out", out)
    made = formats.read(out).provenance["made_from"]
    assert made["inputs"] == {str(RIG): hashlib.sha256(RIG.read_bytes()).hexdigest()}
    assert made["libraries"]["numpy"] == np.__version__
    for _ in range(2):
        answer("place", RIG, "--out", tmp_path / "p")
    assert json.loads((tmp_path / "p" / "placement.json").read_text())["provenance"]["inputs"] == made["inputs"]


# Datasets.


def test_a_record_is_added_to_a_list_with_comments(tmp_path, answer):
    data = tmp_path / "data"
    write_dataset(data, samples.RIG, [formats.read_record(_file(tmp_path, "a.uff"), samples.RIG, "identify")])
    (data / "rig.toml").write_text("# my rig\n" + (data / "rig.toml").read_text())
    (data / "dataset.toml").write_text("# my list\n" + (data / "dataset.toml").read_text())
    before = content(data)
    answer("convert", _file(tmp_path, "b.uff"), data)
    after = content(data)
    assert after["dataset.toml"].startswith(before["dataset.toml"].rstrip())
    assert all(after[name] == before[name] for name in ("rig.toml", "a.uff"))
    assert [record.name for record in Dataset.load(data).records] == ["a", "b"]


@pytest.mark.parametrize("name", ["a.uff", "rig.toml"])
def test_a_new_dataset_does_not_replace_files(tmp_path, refused, name):
    """Such as the very record that is converted, in the folder where it lies."""
    samples.RIG.save(tmp_path / "r.toml")
    record = _file(tmp_path, "a.uff")
    folder = tmp_path if name == "a.uff" else tmp_path / "data"
    folder.mkdir(exist_ok=True)
    if name == "rig.toml":
        Rig.load(RIG).save(folder / name)
    before = content(tmp_path)
    assert f"{folder / name} is there" in refused("convert", record, folder, "--rig", tmp_path / "r.toml")
    assert content(tmp_path) == before


def _file(folder, name):
    formats.write(folder / name, samples.channels(64))
    return folder / name


# Sweeps.


@pytest.mark.parametrize("name", ["lock", "results.nc", "cases", "plan.json"])
def test_a_sweep_does_not_begin_among_other_files(tmp_path, name):
    """Of its own files' names: the lock was once emptied, and what waited removed."""
    plan, out = loaded(tmp_path, small(2)), tmp_path / "out"
    out.mkdir()
    (out / name).write_text("mine")
    with pytest.raises(ClearanceError, match=f"holds '{name}', which is not of a sweep"):
        run_sweep(plan, out, Runner(1))
    assert content(out) == {name: b"mine"}


# What is no plain file.


def special(folder, kind):
    path = folder / "special.toml"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "socket":
        with socket.socket(socket.AF_UNIX) as server:
            server.bind(str(path))
    elif kind == "huge":
        with path.open("wb") as file:
            file.truncate(2**40)
    else:
        path.symlink_to("/dev/zero")
    return path


KINDS = {"pipe": "a pipe", "socket": "a socket", "device": "a device", "huge": "at most 4 GiB are read"}


@pytest.mark.parametrize("kind", KINDS)
def test_only_plain_files_are_read(tmp_path, kind, refused):
    path = special(tmp_path, kind)
    with pytest.raises(OSError, match=KINDS[kind]):
        plain_file(path)
    shutil.copy(RIG, tmp_path / "rig.toml")
    assert KINDS[kind] in refused("simulate", path) or kind == "socket"
    for suffix in (".uff", ".csv", ".mat", ".lvm", ".nc", ".json"):
        other = path.replace(path.with_suffix(suffix)) or path.with_suffix(suffix)
        line = refused("convert", other, tmp_path / "out.uff")
        assert str(other) in line and ("no such file" in line or KINDS[kind] in line)
        other.replace(path)


@pytest.mark.parametrize("kind", ["pipe", "socket", "device"])
def test_only_plain_files_are_replaced(tmp_path, kind):
    path = special(tmp_path, kind)
    before = os.lstat(path)
    with pytest.raises(ClearanceError, match=f"is {KINDS[kind]}, not a file"):
        write_text(path, "x")
    assert os.lstat(path) == before and len([*tmp_path.iterdir()]) == 1


def test_links_and_permissions_stay(tmp_path):
    (tmp_path / "file").write_text("old")
    (tmp_path / "file").chmod(0o600)
    (tmp_path / "link").symlink_to("file")
    with replacing(tmp_path / "link") as temporary:
        temporary.write_text("new")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "file").read_text() == "new"
    assert stat.S_IMODE((tmp_path / "file").stat().st_mode) == 0o600


def test_a_link_to_a_folder_elsewhere_stays_a_link(tmp_path, answer):
    (tmp_path / "disk").mkdir()
    (tmp_path / "disk" / ".DS_Store").write_text("of the system")
    (tmp_path / "out").symlink_to("disk")
    for _ in range(2):
        answer("place", RIG, "--out", tmp_path / "out")
    assert (tmp_path / "out").is_symlink() and (tmp_path / "disk" / "placement.csv").is_file()


@pytest.mark.parametrize("out", ["", ".", "x" * 300, "a/" + "x" * 300])
def test_names_that_cannot_be_written(out, tmp_path, monkeypatch, refused):
    monkeypatch.chdir(tmp_path)
    refused("simulate", RIG, *QUICK, "--out", out)
    assert main(["place", str(RIG), "--out", "x" * 300]) == 2
