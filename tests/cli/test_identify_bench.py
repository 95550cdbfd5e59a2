"""clearance-mj identify where the rig file is not exact: the folder it writes, its page, and what is refused."""

import html
import json
import re

import numpy as np
import pytest

from clearance_mj import Rig, load_law
from clearance_mj.cli import main
from experiments.benches.bench import NAMED

from .conftest import measured_bench


@pytest.fixture
def folder(tmp_path):
    """The shaft meets both walls in the second half of 6 s."""
    return measured_bench(tmp_path / "dataset", 6.0, 6.0, provenance={"source": "synthetic"})


@pytest.mark.slow
def test_rig_law_numbers_and_page(folder, tmp_path, answer):
    out, truth = tmp_path / "found", NAMED["one-bushing"]()
    (tmp_path / "found").mkdir()
    (out / "mine.txt").write_text("stays")
    printed = answer("identify", folder, "--out", out, "--quiet")
    stored = json.loads((out / "identified.json").read_text(encoding="utf-8"))
    assert (stored["synthetic"], stored["identified_from"]) == (True, ["ramp"])
    assert printed["parameters"] == stored["parameters"] and (out / "mine.txt").read_text() == "stays"

    rows = {row["name"]: row for row in stored["parameters"]}
    rig = Rig.load(out / "rig.toml")
    assert rig.bushings[0].gap == pytest.approx(rows["bushings[0].gap"]["value"])
    assert rig.bushings[0].gap == pytest.approx(truth.holes[0].gap, rel=0.06)  # the rig file is 22 % off
    assert rows["bushings[0].gap"]["before"] == truth.rig.bushings[0].gap
    assert load_law(out / "law.json").to_dict() == printed["law"]
    assert np.array(stored["correlation"]).shape == (len(rows), len(rows))
    assert all(0 < r["posterior_over_prior"] < 1.01 and r["low"] <= r["value"] <= r["high"] for r in rows.values())
    assert sum(family["weight"] for family in stored["families"]) == pytest.approx(1)
    assert {row["sensor"] for row in stored["misfit"]["frf"]} == set(rig.sensor_labels)

    page = (out / "index.html").read_text(encoding="utf-8")
    assert "SYNTHETIC" in page and not re.search(r'(src|href)="https?:', page)
    assert all(words.split("; most at")[0] in html.unescape(page) for words in stored["warnings"])
    figures = {p.stem for p in (out / "figures").iterdir()}
    assert figures == {"rattle_map", "restoring_force", "parameters", "spectra", "misfit"}
    charts = [json.loads(text) for text in re.findall(r'<script type="application/json">(.*?)</script>', page)]
    labels = [{line["label"] for line in chart["series"]} for chart in charts]
    assert labels == [{"measured", "law"}, {"measured", "rig file", "updated"}]


@pytest.mark.parametrize("arguments, words", [
    ("--out {data}", "rig.toml would replace the records' own; give another folder"),
    ("--out law.json", "a folder is written, with rig.toml and law.json; give a folder"),
    ("--rig-exact --method bench", "--rig-exact is --method output-error, and not --method bench"),
    ("--out mine", "rig.toml is there and not listed as written"),
])  # fmt: skip
def test_refused(small_dataset, tmp_path, monkeypatch, refused, arguments, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "rig.toml").write_text("mine")
    assert words in refused("identify", small_dataset, *arguments.format(data=small_dataset).split())
    assert (tmp_path / "mine" / "rig.toml").read_text() == "mine"


def test_an_option_that_is_not_known(small_dataset, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["identify", str(small_dataset), "--rig-exactly"])
    assert "'--rig-exactly' is not known, did you mean --rig-exact?" in capsys.readouterr().err
