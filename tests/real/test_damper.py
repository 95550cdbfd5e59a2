"""Measured records: friction damper with backlash. KocaeliDBE predicted from characterisation records only."""

import json

import numpy as np
import pytest

from experiments.real import damper
from experiments.real.records import DamperRecord, read_damper

BRAKE = "band brake"
SOURCE = "measured force; characterisation records only are fitted"


def read(folder, name):
    return read_damper(folder / "backlash_damper" / f"{name}.json.gz")


@pytest.fixture(scope="module")
def records(real_data):
    return [read(real_data, name) for name in damper.CHARACTERISATION]


@pytest.fixture(scope="module")
def target(real_data):
    return read(real_data, damper.PREDICT)


@pytest.fixture(scope="module")
def predicted(records, target):
    """The band brake fitted to the characterisation records, and its force in the earthquake."""
    assert damper.PREDICT not in damper.CHARACTERISATION
    brake, (force,) = damper.fit_and_predict(damper.Task(BRAKE, records, [target], damper.motion(target)["travel"]))
    return brake, force


def test_earthquake_is_predicted(predicted, target, measured):
    error = damper.nrmse(predicted[1], target.force)
    measured.below("KocaeliDBE, force, band brake: NRMSE", error, 0.3, SOURCE)
    assert error == pytest.approx(0.246, abs=0.01)


def test_what_is_left(predicted, target, measured):
    """Half of the error stands in the first pulls: the first force does not tell how far the band was charged."""
    shares, early = damper.error_shares(predicted[1], target)
    assert 0.4 < early < 0.6
    doubts = damper.doubts(predicted[0], target)
    assert doubts["charged"] < 0.2 < doubts["drawn"][0] < 0.25 < doubts["uncharged"] < 0.3
    assert sum(shares.values()) == pytest.approx(1)
    measured.below("KocaeliDBE: share of the squared error in the dead travel", shares["dead travel"], 0.25, SOURCE)
    assert max(shares, key=shares.get) == "pull, loading"


def test_dead_travel(predicted, measured):
    """README of the records: about 0.1 in of dead travel; here between forces of 5 % of what the pull slides at."""
    brake, _ = predicted
    x = np.concatenate((np.linspace(0, 0.02, 4000), np.linspace(0.02, 0, 4000)))
    force = np.abs(brake.force(np.arange(x.size), x)[4000:] - brake.force_zero)
    dead = np.ptp(x[4000:][force < 0.05 * brake.pull.slide])
    measured.equal("dead travel (in)", dead / 0.0254, 0.1, "README of the records", abs=0.03)


def test_pull_slides_harder(predicted, records):
    """As the median measured force of each characterisation record while it slides."""
    brake, _ = predicted
    assert brake.pull.slide > brake.push.slide
    slide = [r.force[np.abs(r.force) > 0.3 * np.abs(r.force).max()] for r in records]
    assert all(np.median(f[f > 0]) > -np.median(f[f < 0]) for f in slide)


def test_motion_lies_within_the_characterisation(records, target):
    earthquake, known = damper.motion(target), [damper.motion(r) for r in records]
    for quantity in ("travel", "speed"):
        assert earthquake[quantity] < min(k[quantity] for k in known)


def test_bootstrap_is_around_the_value():
    rng = np.random.default_rng(4)
    force = rng.standard_normal(20_000)
    record = DamperRecord(np.arange(20_000) / 1000, force, force, 1000.0)
    wrong = force + 0.3 * rng.standard_normal(20_000)
    draws = damper.block_bootstrap({"a": wrong}, record)["a"]
    assert np.median(draws) == pytest.approx(damper.nrmse(wrong, force), rel=0.01)
    assert np.std(draws) == pytest.approx(0.3 / np.sqrt(20_000), rel=0.3)


@pytest.mark.slow
def test_chosen_by_left_out_records(real_data, tmp_path, capsys):
    """The choice never sees the earthquake's force; table, figure and numbers are written."""
    result = damper.analyse(real_data)
    assert result["chosen"] == BRAKE
    rows = {r["element"]: r for r in result["rows"]}
    assert rows[BRAKE]["left_out"] < 0.19 < 0.3 < rows["Bouc-Wen, re-opening gap"]["left_out"]
    assert rows["Bouc-Wen, re-opening gap"]["nrmse"] == pytest.approx(0.483, abs=0.02)
    assert rows["Bouc-Wen, re-opening gap"]["above_chosen_low"] > 0.1  # paired bootstrap, 95 %
    damper.write(result, tmp_path)
    assert (tmp_path / "damper.png").read_bytes()[:4] == b"\x89PNG"
    assert len((tmp_path / "damper.csv").read_text().splitlines()) == 1 + len(damper.ELEMENTS)
    numbers = json.loads((tmp_path / "damper.json").read_text())
    assert numbers["chosen"] == BRAKE and len(numbers["left_out"]) == 5 * len(damper.ELEMENTS)
    assert "band brake: left-out records 0.1" in capsys.readouterr().out
