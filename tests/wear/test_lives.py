"""Lives over draws, their cache, and the command."""

import dataclasses
import json
import math

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

from clearance_mj import ClearanceError, Model
from clearance_mj.cli import main
from clearance_mj.rig import Tolerance
from clearance_mj.tolerance import Runner
from clearance_mj.wear import Sine, predict_lives
from clearance_mj.wear.coefficients import drawn_models

from ..conftest import TABLE1
from ..refusals import assert_refused

SINE = Sine(9.25, 2.0, n_harmonics=5)
LIMIT = ("--gap-limit", "7:+Z=0.4mm", "--level", "2", "--frequency", "9.25", "--quiet")


def uncertain(**changes) -> Model:
    """The second bushing alone wears, by a coefficient that is known within 30 %."""
    second = dataclasses.replace(TABLE1.bushings[1], wear=1e-12)
    return Model(TABLE1.replace(bushings=(TABLE1.bushings[0], second),
                                tolerances=(Tolerance("bushings[1].wear", "30 %"),)).replace(**changes))  # fmt: skip


def test_lives_scatter_as_the_coefficient_does(tmp_path):
    """A life goes with 1/K, so the logarithms of lives have the spread of those of K; kept lives are not found anew."""
    folder = tmp_path / "draws"
    lives = predict_lives(uncertain(), SINE, "0.45 mm", n=4, accuracy=0.02, runner=Runner(1, kept=folder))
    kept = sorted(path.stat().st_mtime_ns for path in folder.glob("lives_*.npz"))
    again = predict_lives(uncertain(), SINE, "0.45 mm", n=4, accuracy=0.02, runner=Runner(1, kept=folder))
    assert again == lives and sorted(path.stat().st_mtime_ns for path in folder.glob("lives_*.npz")) == kept
    drawn = np.array([each.rig.bushings[1].wear for each in drawn_models(uncertain(), 4, 0)])
    np.testing.assert_allclose(lives.life, lives.nominal.life * 1e-12 / drawn, rtol=2e-3)
    scores = np.sort(np.log(drawn / 1e-12) / math.log(1.3))
    assert scores == pytest.approx(norm.ppf([0.125, 0.375, 0.625, 0.875]), abs=1)
    assert np.all(np.diff(lives.gap, axis=1) >= 0)


@pytest.mark.slow
def test_a_wide_gap_drawn_has_no_life():
    rig = uncertain(tolerances=(Tolerance("bushings[1].gap", "30 %"),))
    lives = predict_lives(rig, SINE, "0.301 mm", n=4, accuracy=0.05, runner=Runner(1))
    assert np.any(lives.life == 0.0) and np.any(lives.life > 0.0)


def test_one_draw_is_refused():
    assert_refused(ClearanceError, "n must be 2", lambda: predict_lives(uncertain(), SINE, "x2", n=1))


@pytest.fixture
def rig_file(tmp_path):
    path = tmp_path / "rig.toml"
    uncertain().rig.save(path)
    return path


def test_the_command_writes_table_figure_and_data(rig_file, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["life", str(rig_file), *LIMIT, "--out", str(out)]) == 0
    assert "life" in capsys.readouterr().out
    data, table = json.loads((out / "life.json").read_text()), pd.read_csv(out / "life.csv")
    assert data["ended"] == "limit" and data["life_h"] == pytest.approx(table["hours"].max())
    assert table[table["bushing"] == 1]["gap_m"].max() == pytest.approx(4e-4, rel=2e-6)
    assert (out / "life.png").is_file()


def test_the_command_predicts_what_is_left(rig_file, tmp_path, capsys):
    history = tmp_path / "history.csv"
    rows = [f"{h},1,{3e-4 + 1.1e-8 * h},1e-6" for h in np.linspace(0, 4000, 8)]
    history.write_text("\n".join(["hours,bushing,gap_m,std_m", *rows]))
    assert main(["life", str(rig_file), *LIMIT, "--history", str(history), "--out", str(tmp_path / "out")]) == 0
    assert "remaining life" in capsys.readouterr().out
    (left,) = json.loads((tmp_path / "out" / "life.json").read_text())["remaining"]
    assert left["low_90_h"] < left["median_h"] < left["high_90_h"]


@pytest.mark.parametrize("options, words", [
    (["--gap-limit", "0.1mm", "--level", "2", "--frequency", "9.25"], "must be above its gap"),
    (["--gap-limit", "x2", "--level", "2", "--swept-from", "5"], "give its --frequency"),
    (["--gap-limit", "9:+Z=x2", "--level", "2", "--frequency", "9.25"], "no one bushing has this name"),
    (["--gap-limit", "x2", "--level", "2", "--frequency", "9.25", "--history", "h.csv", "--draws", "3"], "--draws"),
    (["--gap-limit", "x2", "--level", "2", "--frequency", "9.25", "--history", "none.csv"], "cannot be read"),
    (["--gap-limit", "x2", "--level", "-1", "--frequency", "9.25"], "amplitude must be > 0"),
])  # fmt: skip
def test_bad_input_is_one_line(rig_file, tmp_path, refused, options, words):
    assert words in refused("life", rig_file, *options, "--quiet", "--out", tmp_path / "out")
