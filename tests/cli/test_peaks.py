"""clearance-mj peaks: what the Python call finds, as files; bad input."""

import json

import pytest

import clearance_mj as cm
from clearance_mj.signals import road_psd
from clearance_mj.tolerance import peaks_over_an_hour

from .conftest import RIG, csv_rows

TABLE = "frequency, psd\n5,0.05\n20,0.1\n80,0.1\n220,0.02\n"


@pytest.fixture
def psd(tmp_path):
    path = tmp_path / "engine.csv"
    path.write_text(TABLE, encoding="utf-8")
    return path


def test_files_hold_what_the_call_finds(psd, tmp_path, answer):
    out = tmp_path / "out"
    printed = answer("peaks", RIG, "--psd", psd, "--rms", 3, "--limit", 2, "--duration", 5, "--seed", 3, "--out", out)
    stored = json.loads((out / "peaks.json").read_text(encoding="utf-8"))
    assert printed == stored | {"out": str(out)}
    peaks = peaks_over_an_hour(cm.Rig.load(RIG), cm.PSD.load(psd).scaled(3.0), 5.0, 3, limit=2.0)
    assert [each["median"] for each in stored["largest"]] == pytest.approx(peaks.median.tolist())
    assert [each["value"] for each in stored["impacts_per_second"]] == peaks.impacts_per_second.tolist()
    rows = csv_rows(out / "peaks.csv")
    assert [(row["place"], row["what"]) for row in rows[2:]] == [(name, "largest contact_force") for name in peaks.rows]
    assert [float(row["exceeded"]) for row in rows[2:]] == pytest.approx(peaks.exceeded.tolist())
    assert (out / "peaks.png").stat().st_size > 5000


def test_a_road_is_that_of_the_call(tmp_path, answer):
    given = ["--road", "A", "--speed", 36, "--at", "body", "--duration", 20, "--quantity", "acceleration"]
    stored = answer("peaks", RIG, *given, "--out", tmp_path)
    psd = road_psd("A", 10.0, at="body")
    assert stored["psd"]["value"] == pytest.approx(psd.value.tolist(), rel=1e-12)
    peaks = peaks_over_an_hour(cm.Rig.load(RIG), psd, 20.0, quantity="acceleration")
    assert [each["median"] for each in stored["largest"]] == pytest.approx(peaks.median.tolist())


@pytest.mark.parametrize("given, words", [
    ([], "give --psd FILE or --road CLASS, one of them"),
    (["--road", "C"], "--road needs --speed, km/h"),
    (["--road", "Z", "--speed", "80"], 'road class "Z" is unknown'),
    (["--psd", "none.csv"], "none.csv: No such file or directory"),
    (["--road", "C", "--speed", "80", "--quantity", "noise"], 'quantity "noise" is unknown'),
])  # fmt: skip
def test_bad_input_is_one_line(given, words, tmp_path, refused):
    assert words in refused("peaks", RIG, *given, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()
