"""The twin against the virtual test rig, whose physics the package does not share: gaps, steps, wear, no alarm."""

import dataclasses
import json

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from clearance_mj.clearance import ContactLaw, HuntCrossley1975
from clearance_mj.cli import main
from clearance_mj.core.errors import RecordError
from clearance_mj.identify import twin
from clearance_mj.identify.follow.initial_fit import between_family_variance
from clearance_mj.io.dataset import Dataset
from clearance_mj.rig import Grease
from experiments.benches.twin import shaken

from ..conftest import ROOT
from ..refusals import assert_refused

DATA = ROOT / "data" / "table1_rig"
LAW = ContactLaw(HuntCrossley1975(1e5, 1e5, 1.3), Grease(4e3, 5.0, 0.9, 1.0, 5e6, 5e6, film_height=1e-3))
"""kinds of contact and grease alone are right"""


@pytest.fixture(scope="module")
def record():
    return next(r for r in Dataset.load(DATA).records if r.name == "level_8_a")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """What the command writes of that record, told the kinds of law and that the rig is exact."""
    out = tmp_path_factory.mktemp("twin")
    LAW.save(out / "law.json")
    arguments = ["twin", DATA / "level_8_a.uff", "--rig", DATA / "rig.toml", "--rig-exact", "--quiet"]
    arguments += ["--law", out / "law.json", "--out", out / "found"]
    assert main([*map(str, arguments)]) == 0
    return out / "found"


@pytest.fixture(scope="module")
def histories(folder):
    with xr.open_dataset(folder / "twin.nc", engine="scipy") as stored:
        return stored.load()


@pytest.fixture(scope="module")
def twin_json(folder):
    return json.loads((folder / "twin.json").read_text(encoding="utf-8"))


def test_gaps_of_the_virtual_rig(histories, twin_json):
    """0.3 mm in both bushings; 95 % bands that hold it are narrower than 8 %, and nothing changed."""
    assert twin_json["alarms"] == []
    value, low, high = histories["gap"].isel(time=-1).sel(limit=["value", "low", "high"]).values
    assert np.all((low < 3e-4) & (high > 3e-4)) and np.all(high / low < 1.08)
    assert value[1] == pytest.approx(3e-4, rel=0.01)


def test_contact_is_hertzs_law_at_the_depth(histories, twin_json):
    """F = 3e5 N/m^1.5 δ^1.5 (1 + 2.25 s/m δ̇) in the virtual rig: the second bushing touches most of the time."""
    depth, last = twin_json["depth"][1], histories.isel(time=-1).sel(limit="value")
    force = 3e5 * depth**1.5
    assert last["stiffness"].values[1] == pytest.approx(force / depth, rel=0.03)
    assert last["damping"].values[1] == pytest.approx(2.25 * force, rel=0.15)
    assert last["contact"].values[1] > 0.5 > last["contact"].values[0]


def test_histories_are_the_same_in_all_files(histories, twin_json, folder):
    rows = pd.read_csv(folder / "twin.csv")
    last = rows[rows["time_s"] == rows["time_s"].max()]
    assert list(last["bushing"]) == [0, 1]
    assert last["gap_high_m"].values == pytest.approx(histories["gap"].isel(time=-1).sel(limit="high").values)
    assert [row["stiffness_low_N/m"] for row in twin_json["last"]] == pytest.approx(last["stiffness_low_N/m"].values)
    assert twin_json["record"] == "level_8_a" and twin_json["law"] == LAW.to_dict()
    assert "Twin of rig" in (folder / "index.html").read_text(encoding="utf-8")


def test_too_little_to_follow_is_refused(record):
    assert_refused(RecordError, r"lasts 24 s; 34.6 s are needed to learn from 30 s and", twin, record, learn=30.0)
    with pytest.raises(RecordError, match=r"a window of 0.1 s is too short: it must hold 4 periods .* Hz\), 0.5"):
        twin(record, window=0.1)
    assert_refused(RecordError, "learns from 3 s; needs two windows of 2 s or more", twin, record, learn=3.0)
    without = [c for c in record.channels if (c.node, c.quantity) != (7, "displacement")]
    with pytest.raises(RecordError, match=r"has no displacement probe at bushings\[1\] \(node 7\); each"):
        twin(dataclasses.replace(record, channels=without))


def test_a_folder_of_records_is_refused(refused):
    message = refused("twin", DATA, "--rig", DATA / "rig.toml")
    assert message.endswith("is a folder; give the file of one record, such as level_5_a.uff in it\n")


def test_families_that_are_not_excluded_widen_bands():
    """By the furthest one's distance from the likeliest: 0.2 and 0.1 in logarithms of two quantities."""
    assert between_family_variance(np.array([[1.0, 2.0], [1.2, 2.0], [0.9, 1.9]])) == pytest.approx([0.04, 0.01])


STEPS = [("gap +20 %", "gap", 1.2), ("stiffness -20 %", "stiffness", 0.8)]


@pytest.mark.slow
@pytest.mark.parametrize(("change", "quantity", "factor"), STEPS)
def test_a_step_is_one_alarm(change, quantity, factor):
    """At 30 s of 60: seen within two windows, and the size within 4 %."""
    followed = twin(shaken(50, 5.0, 60.0, change))
    (alarm,) = followed.alarms
    assert (alarm.bushing, alarm.quantity) == (1, quantity)
    assert 30.0 < alarm.time < 34.5 and abs(alarm.since - 30.0) < 2.5
    assert alarm.after / alarm.before == pytest.approx(factor, rel=0.04)
    assert followed.value(quantity)[-1, 1] / followed.value(quantity)[10, 1] == pytest.approx(factor, rel=0.02)


@pytest.mark.slow
def test_wear_is_seen_and_followed():
    """The gap grows by 10 % over 30 s: an alarm once it passed 3 %, and the end within 2 %."""
    followed = twin(shaken(51, 5.0, 60.0, "wear 10 %"))
    assert [a.quantity for a in followed.alarms] in (["gap"], ["gap", "gap"])
    assert 38.0 < followed.alarms[0].time < 55.0
    worn = 3e-4 * (1 + 0.1 * (followed.time[-1] - 1.0 - 30.0) / 30.0)  # in the middle of the last window
    assert followed.value("gap")[-1, 1] == pytest.approx(worn, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [60, 61, 62, *(pytest.param(s, marks=pytest.mark.release) for s in (63, 64, 65))])
def test_no_alarm_without_a_change(seed):
    """Records of 30 s at three levels, rig corrected and families found."""
    assert twin(shaken(seed, (2.0, 5.0, 8.0)[seed % 3], 30.0)).alarms == ()
