"""A format from outside of the package: one file, one registration, and every door knows it; what cm.read takes."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.cli import main
from clearance_mj.cli.options import load_plugin
from clearance_mj.io.registry import FORMATS, OBJECT_NAMES, Format, register

DOCS = Path(__file__).parents[2] / "docs"
FILE = '''
"""Frequency response as three columns of text: frequency, real and imaginary part, of acc:1 to the base."""

import numpy as np

from clearance_mj import FRF, RecordError
from clearance_mj.core.files import replacing
from clearance_mj.io.registry import Format, register


def read(path):
    try:
        frequency, real, imag = np.loadtxt(path, unpack=True, ndmin=2)
        return FRF(frequency, [real + 1j * imag])
    except (OSError, ValueError, RecordError) as error:
        raise RecordError(f"{path}: not three columns of numbers: {str(error).splitlines()[0]!a}"[:400]) from None


def write(path, frf):
    with replacing(path) as temporary:
        np.savetxt(temporary, np.stack([frf.frequency, frf.functions[0].real, frf.functions[0].imag], axis=1))


register(Format("three columns", (".3col",), (FRF,), read, write, note="one FRF"))
'''


@pytest.fixture
def plugin(tmp_path, monkeypatch):
    """Path of the file; what it registered is forgotten afterwards."""
    path = tmp_path / "three_columns.py"
    path.write_text(FILE)
    monkeypatch.setattr(sys, "path", [*sys.path])
    before = dict(FORMATS)
    yield path
    FORMATS.clear()
    FORMATS.update(before)
    sys.modules.pop("three_columns", None)


def accelerance():
    frequency = np.arange(5.0, 60.0, 0.5)
    return cm.FRF(frequency, [1 / (1 - (frequency / 20) ** 2 + 0.02j)], None, ("1:+Z",))


def test_every_door_knows_a_format_from_outside(tmp_path, plugin, capsys):
    assert main(["convert", str(tmp_path / "h.3col"), str(tmp_path / "h.uff")]) == 2
    load_plugin(plugin)
    cm.write(tmp_path / "h.3col", accelerance())
    np.testing.assert_array_equal(cm.read(tmp_path / "h.3col").value, accelerance().value)
    arguments = ["--plugin", str(plugin)]
    assert main(["convert", str(tmp_path / "h.3col"), str(tmp_path / "h.uff"), *arguments]) == 0
    np.testing.assert_array_equal(cm.read(tmp_path / "h.uff").value, accelerance().value)
    assert (
        main(["compare", str(tmp_path / "h.uff"), str(tmp_path / "h.3col"), "--modes", "0", "--json", *arguments]) == 0
    )
    assert '"rmse_db": 0.0' in capsys.readouterr().out
    assert main(["convert", str(tmp_path / "h.uff"), str(tmp_path / "h.xyz")]) == 2
    assert ".3col" in capsys.readouterr().err
    with pytest.raises(cm.RecordError, match=r"three columns files cannot take time records; use \.uff"):
        cm.write(tmp_path / "r.3col", [cm.Channel("a", 1, "+Z", "force", [1.0], 10.0)])


def test_the_fuzzer_takes_it(tmp_path, plugin):
    load_plugin(plugin)
    from tests.fuzz.readers import readers
    from tests.fuzz.run import fuzz

    outcome = fuzz([readers()["three columns"]], 1, tmp_path / "found", count=40, progress=False)["three columns"]
    assert outcome.findings == [] and 0 < outcome.read < 40


def test_table_of_the_page():
    """docs/files.md has a row for each registered format: suffixes, what goes in and out, the note."""
    page = (DOCS / "files.md").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in line.strip("| ").split(" |")] for line in page.splitlines() if "| in" in line]
    for known in dict.fromkeys(FORMATS.values()):
        way = "in, out" if known.write else "in"
        holds = [", ".join(f"`{s}`" for s in known.suffixes)]
        holds += [way if kind in known.holds else "" for kind in OBJECT_NAMES] + [known.note]
        assert [*map(str.strip, holds)] in rows, f"| {' | '.join(holds)} |"


@pytest.mark.parametrize("path, kind", [
    ("models/table1_rig.toml", cm.Rig), ("data/table1_rig", cm.Dataset), ("data/table1_rig/ramp.uff", list),
])  # fmt: skip
def test_read_gives_the_object_that_a_path_holds(path, kind):
    path = DOCS.parent / path
    path = path if path.exists() else sorted(path.parent.glob("*.uff"))[0]
    assert isinstance(cm.read(path), kind)


def test_laws_and_rigs_go_out_and_in(tmp_path, rig):
    law = cm.ConstantLaw([1e4, 2e4], 3.0)
    cm.write(tmp_path / "a.json", law)
    cm.write(tmp_path / "a.toml", rig)
    assert cm.read(tmp_path / "a.json").to_dict() == law.to_dict() and cm.read(tmp_path / "a.toml") == rig
    for suffix, obj, part in ((".json", rig, "a rig; use .toml"), (".uff", law, "a law; use .json")):
        with pytest.raises(cm.RecordError, match=f"cannot take {re.escape(part)}"):
            cm.write(tmp_path / f"b{suffix}", obj)
    assert main(["convert", str(tmp_path / "a.toml"), str(tmp_path / "a.uff")]) == 2


def test_registrations_that_clash():
    with pytest.raises(cm.RecordError, match=r'format "mine": suffix "\.csv" is that of CSV'):
        register(Format("mine", (".mine", ".csv"), (cm.FRF,), cm.read))
    with pytest.raises(cm.RecordError, match='format "mine" holds int; use Channel, Response, FRF'):
        register(Format("mine", (".mine",), (int,), cm.read))
    assert ".mine" not in FORMATS
