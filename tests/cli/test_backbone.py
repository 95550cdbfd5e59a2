"""clearance-mj backbone: what the Python call finds, as files; bad input is one line."""

import dataclasses
import json

import numpy as np
import pytest

from clearance_mj import Model, Rig, periodic
from clearance_mj.beam import natural_frequencies
from clearance_mj.report.backbones import draw

from .conftest import LAW, RIG, csv_rows


def test_files_hold_what_the_call_finds(law, tmp_path, output_of):
    """Below the gap the linear mode's frequency; contact of a stop raises it (M. Krack, 2015)."""

    out, ends = tmp_path / "out", (1e-4, 6e-4)
    given = ["--mode", "2,1", "--from", str(ends[0]), "--to", str(ends[1]), "--harmonics", "7", "--quiet"]
    lines = output_of("backbone", RIG, "--law", law, *given, "--out", out).out.splitlines()
    stored = json.loads((out / "backbone.json").read_text(encoding="utf-8"))
    rig = Rig.load(RIG)
    backbone = periodic.follow_backbone(Model(rig, LAW), 2, ends, 7)
    second, first = stored["backbones"]
    assert (second["mode"], first["mode"]) == (2, 1) and second["ended"] == ""
    assert second["frequency"] == backbone.frequency.tolist() and second["damping"] == backbone.damping.tolist()
    np.testing.assert_allclose([second["amplitude"][0], second["amplitude"][-1]], ends, rtol=1e-6)
    linear = natural_frequencies(rig, 2)
    np.testing.assert_allclose([first["frequency"][0], second["frequency"][0]], linear, rtol=2e-3)
    assert second["frequency"][-1] > 1.1 * linear[1]
    assert lines[0].startswith(f"mode 2, amplitudes at 6:+Z: {second['frequency'][0]:.5g} Hz, ")
    rows = [row for row in csv_rows(out / "backbone.csv") if row["mode"] == "2"]
    np.testing.assert_array_equal([float(row["frequency_hz"]) for row in rows], backbone.frequency)
    np.testing.assert_allclose([float(row["acceleration_8:+Z_amplitude_m_s2"]) for row in rows],
                               backbone.amplitude("acceleration")[:, 7], rtol=1e-12)  # fmt: skip
    assert (out / "backbone.png").stat().st_size > 20_000


def test_a_mode_that_the_excitation_does_not_move_is_drawn_without_a_level():
    backbone = periodic.follow_backbone(Model(Rig.load(RIG), LAW), 2, (1e-4, 1.1e-4), 3)
    drawing = draw([backbone, dataclasses.replace(backbone, level=np.full_like(backbone.level, np.inf))])
    assert [ax.get_yscale() for ax in drawing.figure.axes[2::3]] == ["log", "linear"] and drawing.png()


@pytest.mark.parametrize("arguments, words", [
    (["--mode", "0"], "mode must be between 1 and"),
    (["--from", "1e-4"], "give both or none"),
    (["--from", "-1", "--to", "1"], "amplitude_range must be > 0 m"),
    (["--harmonics", "0"], "harmonics must be 1 or more"),
])  # fmt: skip
def test_refusals(law, tmp_path, refused, arguments, words):
    out = tmp_path / "out"
    assert words in refused("backbone", RIG, "--law", law, "--out", out, *arguments) and not out.exists()
