"""clearance-mj show: what files hold, as a table, as JSON and as a picture."""

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.cli import main
from clearance_mj.io.contents import FileContents
from clearance_mj.io.inventory import sparkline
from tests.conftest import ROOT
from tests.fuzz import samples, samples_uff

from .conftest import RIG


@pytest.fixture
def several(tmp_path):
    """A file with two records, one of unknown quantity, FRFs, spectra, modes and nodes."""
    t = np.arange(4096) / 1024
    records = (
        cm.Channel("tip", 3, "+Z", "acceleration", np.sqrt(2) * np.sin(2 * np.pi * 16 * t), 1024.0),
        cm.Channel("mic", 0, "S", "unknown", t, 1024.0, unit="Pa"),
    )
    geometry = cm.Geometry((6, 7), [(0.0, 0.0, 0.0), (0.5, 0.0, 0.0)], ((6, 7),))
    contents = FileContents(records, (samples.frf(),), (samples_uff.spectra(),), (samples.modes(),), geometry)
    cm.write(tmp_path / "several.uff", contents)
    return tmp_path / "several.uff"


def test_sparkline_of_known_courses():
    """The largest of each stretch between the least and the largest of all."""
    assert sparkline(np.arange(8.0)) == "▁▂▃▄▅▆▇█" and sparkline(np.array([np.nan, 1.0, 1.0])) == "▁▁"
    assert sparkline(np.array([np.nan])) == sparkline(None) == ""
    assert sparkline(np.concatenate((np.zeros(240), np.ones(240)))) == 12 * "▁" + 12 * "█"


def test_table(several, output_of):
    first, head, *rows = output_of("show", several).out.splitlines()
    assert first.endswith("2 x time record, 2 x FRF, 2 x auto spectrum, 2 x mode, 1 x geometry")
    assert head.split() == ["kind", "name", "place", "quantity", "unit", "samples", "rate", "RMS", "peak", "course"]
    assert rows[0].split()[:12] == ["time", "record", "tip", "3:+Z", "acceleration", "m/s2", "4096", "1024", "Hz", "1",
                                    "1.414", 24 * "█"]  # fmt: skip
    assert rows[1].split()[2:5] == ["mic", "unknown", "Pa"] and rows[1].endswith("▁▁▂▂▂▃▃▃▄▄▄▅▅▅▆▆▆▇▇▇████")
    assert rows[-1] == f"what is unknown or without a place: clearance-mj map {several} --rig RIG"


def test_json_and_a_part(several, answer):
    (shown,) = answer("show", several, "--what", "frf")["files"].values()
    assert shown["holds"] == {"FRF": 2} and shown["hint"] is None
    one = shown["functions"][0]
    assert (one["name"], one["quantity"], one["unit"]) == ("6:+Z/100:+Z", "acceleration/acceleration", "1")
    assert (one["size"], one["rate"], one["peak"]) == (4, "1 Hz", pytest.approx(1.0))


@pytest.mark.parametrize(
    ("what", "suffix"),
    [(what, ".png") for what in ("channels", "frf", "spectra", "modes", "geometry")]
    + [(None, suffix) for suffix in (".png", ".svg", ".pdf")],
)
def test_picture(several, tmp_path, what, suffix):
    """Each part of the file as one kind of picture, and the whole file as all."""
    picture = tmp_path / f"a{suffix}"
    assert main(["show", str(several), "--out", str(picture), *(["--what", what] if what else [])]) == 0
    assert picture.stat().st_size > 3000


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_a_picture_is_written_again_and_that_of_another_is_left(several, tmp_path, suffix):
    picture = tmp_path / f"a{suffix}"
    for _ in range(2):
        assert main(["show", str(several), "--out", str(picture), "--what", "geometry"]) == 0
    picture.write_bytes(b"mine")
    assert main(["show", str(several), "--out", str(picture)]) == 2 and picture.read_bytes() == b"mine"


def test_what_shows_itself(tmp_path, capsys, output_of):
    """A rig, a law and a dataset print themselves; a rig is drawn."""
    cm.ConstantLaw(8e3, 4.0).save(tmp_path / "law.json")
    said = output_of("show", RIG, tmp_path / "law.json", ROOT / "data" / "table1_rig").out
    assert f"{RIG}: Rig" in said and "8e+03" in said.replace("8000", "8e+03") and "level_1_a" in said
    assert main(["show", str(RIG), "--out", str(tmp_path / "rig.png")]) == 0
    assert main(["show", str(tmp_path / "law.json"), "--out", str(tmp_path / "law.png")]) == 2
    assert "law.json: a ConstantLaw cannot be drawn by itself" in capsys.readouterr().err


def test_refused(several, tmp_path, refused):
    for arguments, part in (
        (["--what", "tables"], 'holds no "tables"; choose one of "channels"'),
        (["--out", str(tmp_path / "a.xyz")], "give a name that ends in .png or .svg or .pdf"),
        ([str(RIG), "--out", str(tmp_path / "a.png")], "one picture is drawn of one file, got 2"),
        (["--units", "yd"], 'units "yd" are unknown; use SI'),
    ):
        said = refused("show", several, *arguments)
        assert said.count("\n") == 1 and part in said


def test_warning_names_the_file(tmp_path, capsys, output_of):
    """Factors of zero are said once, on standard error."""
    zero = tmp_path / "zero.unv"
    zero.write_bytes(samples_uff.uff()[5])
    said = output_of("show", zero).err
    assert said.startswith(f"clearance-mj: warning: {zero}: data set 1 (164, units) has factors 0 and 0")
    assert said.count("\n") == 1 and main(["show", str(tmp_path / "zero.unv"), "--units", "SI"]) == 0
    assert not capsys.readouterr().err


def test_with_a_map(several, tmp_path, answer):
    """Places and units of a map of channels; what is skipped is not shown."""
    (tmp_path / "map.toml").write_text('[channels]\ntip = "acc:4:-Z"\nmic = "skip"\n')
    (shown,) = answer("show", several, "--map", tmp_path / "map.toml")["files"].values()
    assert [(one["name"], one["place"]) for one in shown["functions"]] == [("tip", "4:-Z")]
