"""The energy balance looks at the very simulation that `simulate` runs, and what it finds can be written and drawn.

That its energies and impacts are right is tested in verification/test_energy_balance.py.
"""

import csv
import json
import re
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from clearance_mj.clearance import ConstantLaw
from clearance_mj.cli import main
from clearance_mj.core.errors import ClearanceError
from clearance_mj.engines import Engine, simulate
from clearance_mj.engines.base import SimulationRun
from clearance_mj.engines.energy import energy_balance
from clearance_mj.report.energy import draw
from clearance_mj.rig import Grease, Shaker
from clearance_mj.signals.excitation import random

from ..conftest import ROOT
from ..test_docs import run_python
from .alike import HISTORIES, with_bushings

LAW = ConstantLaw([2e4, 1e4], [3.0, 5.0])


@pytest.fixture(scope="module")
def kept(rig):
    return energy_balance(rig, random(0.6, 2048, rms=8.0, seed=2), LAW, "modal")


@pytest.mark.parametrize("kind", ["base", "force"])
def test_within_empty_gaps_energies_close_to_rounding(rig, engine, kind):
    """M (q₊ - 2q + q₋)/h² + C (q₊ - q₋)/2h + K q = b a times the travel (q₊ - q₋)/2; links also turn as they sag."""
    rig = with_bushings(rig.replace(shaker=Shaker(kind, 0.9)), grease=Grease(0.0))
    balance = energy_balance(rig, random(0.3, 2048.0, rms=0.02, seed=0, kind=kind), LAW, engine)
    assert not balance.response.contact_force.any() and balance.input[-1] > 0 and not balance.film.any()
    assert balance.imbalance < (1e-9 if engine == "modal" else 1e-5)


def test_response_is_that_of_simulate(rig, engine):
    noise = random(0.3, 2048, rms=8.0, seed=3)
    balance, expected = energy_balance(rig, noise, LAW, engine), simulate(rig, noise, LAW, engine)
    response = balance.response
    assert response.contact_force.any() and balance.impacts
    for name in HISTORIES:
        np.testing.assert_array_equal(getattr(response, name), getattr(expected, name))
    assert response.provenance == expected.provenance


def test_impacts_account_for_the_energy_lost_in_contacts(kept):
    """All of it but what a visit that has not ended has lost."""
    for j, losses in enumerate(kept.contact_loss):
        impacts = [i for i in kept.impacts if i.bushing == j]
        lost, after = sum(i.loss for i in impacts), round(max(i.time + i.duration for i in impacts) * kept.fs) + 1
        assert 0 < lost <= losses[-1] * (1 + 1e-9)
        assert lost == pytest.approx(losses[min(after, kept.time.size - 1)], rel=0.05)


def test_impacts_are_visits_beyond_the_gap(rig, kept):
    """The bushing's middle, which the response knows, is beyond the gap for as long as its ends are, nearly."""
    for j, bushing in enumerate(rig.bushings):
        for side, sign in (("upper", 1), ("lower", -1)):
            beyond = np.sum(sign * kept.response.displacement[j] > bushing.gap) / kept.response.fs
            logged = sum(i.duration for i in kept.impacts if (i.bushing, i.side) == (j, side)) / 2  # two ends
            assert logged == pytest.approx(beyond, rel=0.1, abs=2e-3)


def test_columns_and_summary(kept):
    columns = kept.columns()
    assert list(columns)[:3] == ["time", "input", "law_work[0]"]
    assert all(value.shape == kept.time.shape for value in columns.values())
    left = columns["input"] - sum(v for k, v in columns.items() if k not in ("time", "input", "residual"))
    np.testing.assert_allclose(left, columns["residual"], atol=1e-12)
    summary = kept.summary()
    assert summary["energy"]["input"] == kept.input[-1]
    assert sum(summary["impacts"]) == len(kept.impacts)
    assert json.loads(json.dumps(summary)) == summary


def test_a_rig_without_bushings(rig, engine):
    balance = energy_balance(rig.replace(bushings=()), random(0.2, 2048, rms=2.0), ConstantLaw(0.0, 0.0), engine)
    assert balance.impacts == () and balance.summary()["median_restitution"] is None
    assert balance.damping[-1] > 0
    assert balance.imbalance < 1e-4  # links turn in space
    assert draw(balance).png()[:4] == b"\x89PNG"


def test_nothing_put_in(rig):
    balance = energy_balance(rig, random(0.1, 2048, rms=0.0), LAW, "modal")
    assert balance.imbalance == 0
    assert draw(balance).png()[:4] == b"\x89PNG"


def test_an_engine_that_does_not_tell(rig):
    class Deaf(SimulationRun):
        def advance(self, drive):
            return np.zeros((drive.size, 14))

    @dataclass(frozen=True)
    class Silent(Engine):
        name: ClassVar[str] = "silent"

        def largest_step(self, rig, law):
            return 1e-3

        def start(self, rig, law, kind, step):
            return Deaf()

    with pytest.raises(ClearanceError, match="does not tell its energies"):
        energy_balance(rig, random(0.1, 2048), LAW, Silent())


def test_figure(kept):
    drawing = draw(kept)
    assert len(drawing.figure.axes) == 4 and f"{len(kept.impacts)} impacts" in drawing.caption


def command(tmp_path, *more):
    rig = str(ROOT / "models" / "table1_rig.toml")
    short = ("--engine", "modal", "--duration", "0.5", "--rms", "8", "--quiet", "--out", str(tmp_path / "r.nc"))
    return main(["simulate", rig, *short, *more])


def test_command(tmp_path, capsys):
    folder = tmp_path / "energy"
    assert command(tmp_path, "--energy", str(folder), "--json") == 0
    printed = json.loads(capsys.readouterr().out)["energy"]
    assert {p.name for p in folder.iterdir()} == {".clearance-mj", "energy.csv", "energy_balance.png", "impacts.csv"}
    energy = np.genfromtxt(folder / "energy.csv", delimiter=",", names=True)
    assert energy.size == 1024
    assert energy["input"][-1] == pytest.approx(printed["energy"]["input"], rel=1e-8)
    with (folder / "impacts.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [sum(int(row["bushing"]) == j for row in rows) for j in range(2)] == printed["impacts"]
    assert float(rows[0]["restitution"]) == pytest.approx(float(rows[0]["v_out"]) / float(rows[0]["v_in"]))


def test_command_in_words(tmp_path, capsys):
    assert command(tmp_path, "--energy", str(tmp_path / "energy")) == 0
    words = capsys.readouterr().out
    assert "the energies balance within 0.0" in words and "more than 1 %" not in words
    (tmp_path / "file").write_text("")
    assert command(tmp_path, "--energy", str(tmp_path / "file")) == 2
    assert "is a file; give a folder" in capsys.readouterr().err


@pytest.mark.slow
def test_page(tmp_path):
    """The code of docs/energy_balance.md runs as it stands, and finds what the page says."""
    (tmp_path / "models").symlink_to(ROOT / "models")
    assert 0 < float(re.search(r"imbalance ([\d.e-]+),", run_python("energy_balance.md", tmp_path))[1]) < 1e-3
    assert (tmp_path / "energy" / "energy_balance.png").exists()
