"""clearance-mj production: what the Python calls find, as files and a page; bad input."""

import json

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.cli import main
from clearance_mj.tolerance import Runner, Scatter, Sines, production

from ..conftest import ROOT
from .conftest import csv_rows

RIG, SCATTER = ROOT / "models" / "table1_rig.toml", ROOT / "models" / "scatter" / "table1.toml"
BAND = ("--levels", "1.4,2", "--from", 36, "--to", 44, "--steps", 3, "--workers", 1)


def test_files_hold_what_the_calls_find(tmp_path, answer):
    out = tmp_path / "out"
    given = ("--scatter", SCATTER, "--limit", "contact_force > 0.5 N", "--designs", 24, *BAND)
    printed = answer("production", RIG, *given, "--sobol", 2, "--allowed", 0.2, "--out", out)
    stored = json.loads((out / "production.json").read_text(encoding="utf-8"))
    made_from = {"version", "code", "rig", "law", "scatter", "seed", "frequency", "provenance"}
    assert made_from <= stored.keys() and stored["scatter"] == Scatter.load(SCATTER).to_dict()
    assert printed == stored | {"out": str(out)}
    run = production(
        cm.Model(cm.Rig.load(RIG)), Scatter.load(SCATTER),
        Sines([1.4, 2.0], np.linspace(36, 44, 3), "contact_force > 0.5 N"), 24, runner=Runner(1),
    )  # fmt: skip
    assert stored["over_level"] == run.over_level("contact").tolist()
    assert stored["exceeding_over_level"] == run.over_level("exceeding").tolist()
    assert 0 < run.over_level("contact")[0] < 1
    rows = csv_rows(out / "production.csv")
    assert [float(row["share_contact"]) for row in rows] == pytest.approx(run.contact.ravel().tolist())
    assert {row["number"] for row in stored["tightening"]["numbers"]} >= {"bushings.gap", "beam.young_modulus"}
    assert {row["parameter"] for row in stored["sensitivity"]} >= {"bushings[0].gap, bushings[1].gap"}
    page = (out / "index.html").read_text(encoding="utf-8")
    for heading in ("How many rattle", "What it depends on", "Which tolerance to tighten", "What scatters"):
        assert heading in page
    assert {path.stem for path in (out / "figures").iterdir()} == {
        "production", "production_over_level", "sensitivity", "tightening",
    }  # fmt: skip


def test_random_excitation_is_a_part_of_the_page(tmp_path, answer):
    psd = tmp_path / "engine.csv"
    psd.write_text("frequency,psd\n5,0.02\n220,0.02\n", encoding="utf-8")
    given = ("--scatter", SCATTER, "--designs", 3, *BAND, "--psd", psd, "--rms", "1,2", "--duration", 10)
    stored = answer("production", RIG, *given, "--out", tmp_path / "out")
    touches = {(row["level"], row["place"]): row["touches"] for row in stored["random"] if "touches" in row}
    assert sorted(touches) == [(1.0, "6:+Z"), (1.0, "7:+Z"), (2.0, "6:+Z"), (2.0, "7:+Z")]
    assert touches[2.0, "7:+Z"][0] > 0.9
    assert answer("production", RIG, *given, "--out", tmp_path / "out") == stored  # from what is kept
    assert "Under random excitation" in (tmp_path / "out" / "index.html").read_text(encoding="utf-8")


def test_of_a_road_alone_no_sines_are_computed(tmp_path, answer, monkeypatch):
    """What is not asked for is not computed: with --levels, or no random excitation, sines are."""
    monkeypatch.setattr("clearance_mj.tolerance.production", None)
    given = ("--scatter", SCATTER, "--designs", 3, "--road", "A", "--speed", 80, "--duration", 10, "--workers", 1)
    stored = answer("production", RIG, *given, "--out", tmp_path / "out")
    assert stored["designs"] == 3 and "over_level" not in stored and {"random", "numbers"} <= stored.keys()
    assert {path.name for path in (tmp_path / "out").glob("*.*")} >= {"index.html", "production.json"}
    assert not (tmp_path / "out" / "production.csv").exists()
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert "How many rattle" not in page and "Under random excitation" in page
    with pytest.raises(TypeError):
        main([str(each) for each in ("production", RIG, *given, "--levels", 1, "--out", tmp_path / "more")])


@pytest.mark.slow
def test_which_tolerance_to_tighten_is_said_of_a_road_too(tmp_path, answer, capsys):
    """All designs touch within an hour, whatever the tolerance of the gap: the nominal gap is named."""
    scatter = tmp_path / "gap.toml"
    scatter.write_text('[[scatter]]\nof = "bushings.gap"\nwithin = "0.05 mm"\nprice = 1.0\n', encoding="utf-8")
    road = ("--road", "C", "--speed", 80, "--at", "body", "--rms", 0.1, "--duration", 6)
    given = ("--scatter", scatter, "--designs", 20, *road, "--allowed", 0.1, "--workers", 1)
    out = tmp_path / "out"
    stored = answer("production", RIG, *given, "--out", out)
    plan = stored["tightening_random"]
    assert plan["what"] == "contact within 1 h" and plan["level"] == pytest.approx(0.1) and "tightening" not in stored
    assert plan["share"] == 1.0 and plan["gap_factor"] > 2 and plan["gaps"] == [3e-4 * plan["gap_factor"]] * 2
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "Which tolerance to tighten: contact within 1 h" in page and "nominal gap" in page
    assert (out / "figures" / "tightening_random.png").exists()


BAD = '[[scatter]]\nof = "bushings.gap"\nwithin = "0.4 mm"\n'


@pytest.mark.parametrize("given, words", [
    ([], "nothing scatters"),
    (["--scatter", "none.toml"], "cannot be read"),
    (["--scatter", "bad.toml"], "scatter of bushings[0].gap reaches from -0.0001"),
    (["--scatter", SCATTER, "--limit", "noise > 3"], 'limit of "noise" is unknown'),
    (["--scatter", SCATTER, "--limit", "penetration > 3 kg"], 'unit "kg"'),
    (["--scatter", SCATTER, "--up-to", 3], "--up-to is the level of --allowed"),
    (["--scatter", "posterior"], "no posterior"),
    (["--scatter", SCATTER, "--rms", 1], "--rms is of random excitation: give --psd FILE or --road CLASS"),
    (["--scatter", SCATTER, "--sobol", 3], "--sobol 3: is no power of 2"),
    (["--scatter", SCATTER, "--allowed", 2], "--allowed 2: is no share between 0 and 1"),
    (["--scatter", SCATTER, "--road", "C"], "--road needs --speed"),
    (["--scatter", SCATTER, "--road", "C", "--speed", 80, "--limit", "displacement > 1 mm"], "under random excitation"),
])  # fmt: skip
def test_bad_input_is_one_line(given, words, tmp_path, refused, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.toml").write_text(BAD, encoding="utf-8")
    assert words in refused("production", RIG, *given, "--designs", 2, *BAND, "--out", tmp_path / "out")
