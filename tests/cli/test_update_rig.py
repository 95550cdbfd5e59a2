"""The command update-rig: what it writes and prints, and what it refuses."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from clearance_mj import Rig
from clearance_mj.identify.structure import selection
from clearance_mj.report.updated_rig import draw_spectra
from experiments.benches.bench import NAMED

from .conftest import measured_bench


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return measured_bench(tmp_path_factory.mktemp("bench") / "dataset", 4.0, 0.6)


def test_files_and_json(folder, tmp_path, answer, monkeypatch):
    """Whether a mass is missing is scored, and none is fitted: tests of found structures have the rest."""
    out = tmp_path / "out"
    monkeypatch.setattr(selection, "MIN_SCORE", np.inf)
    for name in set(selection.HYPOTHESES) - {"mass"}:
        monkeypatch.delitem(selection.HYPOTHESES, name)
    printed = answer("update-rig", folder, "--out", out)
    stored = json.loads((out / "updated_rig.json").read_text(encoding="utf-8"))
    assert printed == stored | {"out": str(out)}
    rows = {row["name"]: row for row in stored["parameters"]}
    rig = Rig.load(out / "rig.toml")
    assert rig.beam.young_modulus == pytest.approx(rows["beam.young_modulus"]["value"])
    assert rig.bushings[0].gap == NAMED["one-bushing"]().rig.bushings[0].gap  # not a matter of the linear rig
    mass = rows["masses[0].mass"]
    assert mass["posterior_over_prior"] == pytest.approx(mass["posterior_std"] / mass["prior_std"])
    assert stored["diagnosis"] == [] and np.array(stored["covariance"]).shape == (len(rows), len(rows))
    assert set(stored["records"][0]["misfit"]) >= {"accelerometer 1:+Z", "accelerometer 2:+Z"}
    assert (out / "updated_rig.png").stat().st_size > 10_000


def test_spectra_have_an_axis_in_words():
    """Its channels have several units, and so the axis none to refer to."""
    lines = np.ones((2, 3))
    piece = SimpleNamespace(
        record="ramp", level=lines, duration=4.0, frequency=np.array([5.0, 50.0, 200.0]), measured=lines,
        before=2 * lines, fitted=lines, relative_error=np.zeros(2), is_whole=True,
    )  # fmt: skip
    update = SimpleNamespace(misfit=[piece], channels=("base", "accelerometer 1:+Z"), rig=SimpleNamespace(name="mine"))
    assert {ax.get_ylabel() for ax in draw_spectra(update).figure.axes} == {"Spectrum (dB)"}


def test_the_datasets_rig_is_not_replaced(folder, refused):
    assert "rig.toml is read by this command; give another --out" in refused("update-rig", folder, "--out", folder)
