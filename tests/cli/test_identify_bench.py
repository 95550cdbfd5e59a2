"""clearance-mj identify where the rig file is not exact: the folder it writes, its page, and what is refused."""

import html
import json
import re

import numpy as np
import pytest

from clearance_mj import Record, Rig, load_law, write_dataset
from clearance_mj.cli import main
from clearance_mj.signals.excitation import level_ramp
from experiments.benches.bench import NAMED
from experiments.benches.records import FS, measure_channels


@pytest.fixture
def folder(tmp_path):
    """One bushing, foreign physics; the shaft meets both walls in the second half of 6 s."""
    bench = NAMED["one-bushing"]()
    base = level_ramp(6.0, FS, (5.0, 220.0), start_rms=0.3, end_rms=6.0, seed=4).value
    channels = measure_channels(bench, base, np.random.default_rng(4))
    record = Record("ramp", "identify", bench.rig, FS, channels, band=(5.0, 220.0), provenance={"source": "synthetic"})
    path = tmp_path / "dataset"
    write_dataset(path, bench.rig, [record])
    return path


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
    assert {p.stem for p in (out / "figures").iterdir()} == {
        "rattle_map", "restoring_force", "parameters", "spectra", "misfit",
    }  # fmt: skip
    charts = [json.loads(text) for text in re.findall(r'<script type="application/json">(.*?)</script>', page)]
    labels = [{line["label"] for line in chart["series"]} for chart in charts]
    assert labels == [{"measured", "law"}, {"measured", "rig file", "updated"}]


def test_refused(small_dataset, tmp_path, refused, capsys):
    message = refused("identify", small_dataset, "--out", small_dataset)
    assert "rig.toml would replace the records' own; give another folder" in message
    assert "a folder is written, with rig.toml and law.json; give a folder" in refused(
        "identify", small_dataset, "--out", tmp_path / "law.json"
    )
    with pytest.raises(SystemExit, match="2"):
        main(["identify", str(small_dataset), "--rig-exactly"])
    assert "'--rig-exactly' is not known, did you mean --rig-exact?" in capsys.readouterr().err
    assert "--rig-exact is --method output-error, and not --method bench" in refused(
        "identify", small_dataset, "--rig-exact", "--method", "bench"
    )
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "rig.toml").write_text("mine")
    assert "rig.toml is there and not listed" in refused("identify", small_dataset, "--out", tmp_path / "out")
    assert (tmp_path / "out" / "rig.toml").read_text() == "mine"
