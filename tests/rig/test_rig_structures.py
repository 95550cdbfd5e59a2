"""Rigs with a structure of their own, and files that cannot be read."""

import copy
import math
import re
import tomllib
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
import pytest

from clearance_mj.core.errors import RigError
from clearance_mj.core.validation import Text, checked
from clearance_mj.rig import Beam, Contact, Grease, Rig, Sensor
from clearance_mj.structure import Assembly, Structure

from ..refusals import assert_refused
from .rig_changes import FILE, NUMBER, SHAFT, STEEL, TABLES, refused

# Structures


def with_structure(structure, **more):
    """Return the tables of a rig of a structure of 1 m."""
    tables = {key: value for key, value in copy.deepcopy(TABLES).items() if key != "beam"}
    return tables | {"structure": structure} | more


SECTION = SHAFT["sections"][0]


@pytest.mark.parametrize(("structure", "start"), [
    (3, "structure must be a table of keys, got 3"),
    ({}, "structure.kind is missing; use "),
    ({"kind": "shft"}, 'structure.kind "shft" is unknown; use '),
    ({"kind": 3}, "structure.kind must be a string, got 3"),
    ({"kind": "shaft"}, "structure.sections is missing"),
    (SHAFT | {"matrial": STEEL}, "structure.matrial is not a known key; known: sections, supports, discs"),
    (SHAFT | {"sections": [SECTION, SECTION | {"diamter": 1.0}]}, "structure.sections[1].diamter is not a known"),
    (SHAFT | {"sections": [SECTION, SECTION | {"diameter": 0.0}]},
     "structure.sections[1].diameter[0] must be > 0, got 0"),
    (SHAFT | {"sections": [SECTION, {"length": 1.0}]}, "structure.sections[1]: give either diameter, or width"),
    (SHAFT | {"sections": []}, "structure.sections must hold 1 or more, got none"),
    (SHAFT | {"supports": [{"position": 0.0, "kind": "clampd"}]}, 'structure.supports[0].kind "clampd" is unknown'),
    (SHAFT | {"supports": [{"position": 0.0, "rotation": -1}]}, "structure.supports[0].rotation must be >= 0, got"),
])  # fmt: skip
def test_structures_are_refused_by_the_name_of_what_is_wrong(structure, start):
    assert assert_refused(RigError, None, Rig.from_dict, with_structure(structure)).startswith(start)


def test_structure_comes_back(tmp_path):
    rig = Rig.from_dict(with_structure(SHAFT))
    assert rig.beam is None and rig.linear is rig.structure and rig.structure.end == 1.0
    assert rig.total_mass == pytest.approx(rig.structure.total_mass + 0.434)
    rig.save(tmp_path / "rig.toml")
    assert Rig.load(tmp_path / "rig.toml") == rig and hash(rig) == hash(Rig.from_dict(rig.to_dict()))


@pytest.fixture
def read_from_file(monkeypatch):
    """Structures may be of a kind that is read from a file."""

    @checked(RigError)
    class OfFile(Structure):
        """One mass on a spring, whose numbers a file holds."""

        file: Text
        kind: Literal["of-file"] = "of-file"
        files: ClassVar[tuple[str, ...]] = ("file",)

        def check(self, point):
            pass

        def assemble(self, points, modes):
            return Assembly(np.eye(1), np.eye(1), np.zeros((1, 3)), lambda at: np.ones((len(at), 1)))

    monkeypatch.setitem(Structure.known, "of-file", OfFile)
    return OfFile


def test_files_of_a_structure_are_named_from_the_rig_file(tmp_path, monkeypatch, read_from_file):
    monkeypatch.chdir(tmp_path)
    Rig("r", None, (), (Sensor(1, "1:+Z"),), structure=read_from_file("model.npz")).save("rigs/r.toml")
    assert tomllib.loads(Path("rigs/r.toml").read_text())["structure"]["file"] == "../model.npz"
    monkeypatch.chdir(tmp_path / "rigs")
    assert Path(Rig.load("r.toml").structure.file).resolve() == tmp_path / "model.npz"
    assert Path(Rig.load("../rigs/r.toml").structure.file).resolve() == tmp_path / "model.npz"


def test_content_is_that_of_the_files(tmp_path, read_from_file):
    """It tells rigs apart by what their files hold, wherever these are; a copy holds the same."""
    (tmp_path / "model.npz").write_bytes(b"1")
    rig = Rig("r", None, (), (Sensor(1, "1:+Z"),), structure=read_from_file(str(tmp_path / "model.npz")))
    copied = rig.copied(tmp_path / "there")
    assert copied != rig and copied.content() == rig.content()
    (tmp_path / "model.npz").write_bytes(b"2")
    assert copied.content() != rig.content()
    (tmp_path / "model.npz").unlink()
    assert_refused(RigError, r"model\.npz: cannot be read \(No such file or directory\)", rig.content)


def test_a_structure_is_none_without_a_kind():
    beam = Beam(1.0, 1.0, 1.0, 1.0)
    with pytest.raises(RigError, match=r"^structure must be a table of keys, got Beam"):
        Rig("r", None, (), (Sensor(1, 1.0),), structure=beam)


@pytest.mark.parametrize(("make", "message"), [
    (lambda: Beam(0.0, 1.0, 1.0, 1.0), "beam.length must be > 0, got 0 (m)"),
    (lambda: Beam(math.nan, 1.0, 1.0, 1.0), "beam.length must be finite, got nan (m)"),
    (lambda: Grease(-1.0), "grease.stiffness must be >= 0, got -1 (k, N/m)"),
    (lambda: Grease(1.0, beta=1.0, gamma=2.0), "grease.gamma 2 makes the Bouc-Wen element create energy"),
    (lambda: Contact(0.0), "contact.stiffness must be > 0, got 0 (k, N/m)"),
    (lambda: Beam(1.0), "beam.young_modulus is missing"),
    (lambda: Contact(1.0, 2.0, 3.0, 4.0), "contact takes each of stiffness, damping, bearable_depth once"),
    (lambda: Contact(1.0, stiffness=3.0), "contact takes each of stiffness, damping, bearable_depth once"),
    (lambda: Contact(1.0, dampng=3.0),
     "contact.dampng is not a known key; known: stiffness, damping, bearable_depth; did"),
])  # fmt: skip
def test_elements_check_themselves(make, message):
    assert_refused(RigError, f"^{re.escape(message)}", make)


# Files


def refused_file(path, part):
    message = assert_refused(RigError, None, Rig.load, path)
    assert message.startswith(f"{path}: ") and part in message


@pytest.mark.parametrize(("content", "part"), [
    (b"beam = {", "not valid TOML"),
    (b"", "name is missing"),
    (b"\x00\xff" * 40, "not valid TOML"),
    (b"name = 'a'\nname = 'b'\n", "not valid TOML"),
    ("name = 'ä'".encode("latin-1"), "not valid TOML"),
    ("name = 'a'".encode("utf-16"), "not valid TOML"),
    (FILE.read_bytes() + b"\n[nonsense]\nx = 1\n", "nonsense is not a known key"),
    (FILE.read_bytes().replace(b"3.0e-4", b'"0.3 mm"'), f"bushings[0].gap {NUMBER} '0.3 mm'"),
    (FILE.read_bytes().replace(b"3.0e-4", b"nan"), "bushings[0].gap must be finite, got nan"),
    (b"x = " + b"9" * 5000, "not valid TOML"),
    (b"x = " + b"[" * 5000, "not valid TOML"),
])  # fmt: skip
def test_files_are_refused_with_their_name(tmp_path, content, part):
    path = tmp_path / "rig.toml"
    path.write_bytes(content)
    refused_file(path, part)


def test_file_that_cannot_be_read(tmp_path):
    refused_file(tmp_path / "absent.toml", "cannot be read (No such file or directory)")
    refused_file(tmp_path, "cannot be read (Is a directory)")


@pytest.mark.parametrize("path", ["beam.length", "bushings[0].gap"])
def test_whole_number_beyond_floating_point(path):
    assert refused(path, 10**400).startswith(f"{path} must be")
