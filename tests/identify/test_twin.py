"""The twin against the virtual test rig, whose physics the package does not share: gaps, steps, wear, no alarm."""

import dataclasses

import numpy as np
import pytest

from clearance_mj.clearance import ContactLaw, HuntCrossley1975
from clearance_mj.errors import RecordError
from clearance_mj.identify import twin
from clearance_mj.io.dataset import Dataset
from clearance_mj.rig import Grease
from experiments.bench_twin import shaken

from ..conftest import ROOT

DATA = ROOT / "data" / "table1_rig"
LAW = ContactLaw(HuntCrossley1975(1e5, 1e5, 1.3), Grease(4e3, 5.0, 0.9, 1.0, 5e6, 5e6, film_height=1e-3))
"""kinds of contact and grease alone are right"""


@pytest.fixture(scope="module")
def record():
    return next(r for r in Dataset.load(DATA).records if r.name == "level_8_a")


@pytest.fixture(scope="module")
def found(record):
    return twin(record, law=LAW, rig_exact=True)


def test_gaps_of_the_virtual_rig(found):
    """0.3 mm in both bushings; 95 % bands that hold it are narrower than 8 %, and nothing changed."""
    assert found.alarms == ()
    low, high = found.band("gap")[:, -1]
    assert np.all((low < 3e-4) & (high > 3e-4))
    assert np.all(high / low < 1.08)
    assert found.value("gap")[-1, 1] == pytest.approx(3e-4, rel=0.01)


def test_contact_is_hertzs_law_at_the_depth(found):
    """F = 3e5 N/m^1.5 δ^1.5 (1 + 2.25 s/m δ̇) in the virtual rig: the second bushing touches most of the time."""
    force = 3e5 * found.depth[1] ** 1.5
    assert found.value("stiffness")[-1, 1] == pytest.approx(force / found.depth[1], rel=0.03)
    assert found.value("damping")[-1, 1] == pytest.approx(2.25 * force, rel=0.15)
    assert found.contact[-1, 1] > 0.5 > found.contact[-1, 0]


def test_histories_are_the_same_as_arrays_and_rows(found):
    stored = found.to_xarray()
    assert stored["gap"].sel(limit="high").values == pytest.approx(found.band("gap")[1], nan_ok=True)
    last = [row for row in found.rows() if row["time_s"] == found.time[-1]]
    assert [row["bushing"] for row in last] == [0, 1]
    assert last[1]["stiffness_low_N/m"] == found.band("stiffness")[0, -1, 1]


def test_too_little_to_follow_is_refused(record):
    with pytest.raises(RecordError, match=r"lasts 24 s; 34.6 s are needed to learn from 30 s and"):
        twin(record, learn=30.0)
    with pytest.raises(RecordError, match=r"a window of 0.1 s is too short: it must hold 4 periods .* Hz\), 0.5"):
        twin(record, window=0.1)
    with pytest.raises(RecordError, match="learns from 3 s; needs two windows of 2 s or more"):
        twin(record, learn=3.0)
    without = [c for c in record.channels if c.quantity != "displacement"]
    with pytest.raises(RecordError, match="has no displacement probe at every bushing"):
        twin(dataclasses.replace(record, channels=without))


def test_command_writes_page_and_histories(record, tmp_path, answer, refused):
    LAW.save(tmp_path / "law.json")
    arguments = ["twin", DATA / "level_5_b.uff", "--rig", DATA / "rig.toml", "--rig-exact", "--window", 4, "--quiet"]
    result = answer(*arguments, "--law", tmp_path / "law.json", "--out", tmp_path / "out")
    assert result["alarms"] == [] and result["record"] == "level_5_b" and result["law"] == LAW.to_dict()
    last = {row["bushing"]: row["gap_m"] for row in result["last"]}
    assert last[1] == pytest.approx(3e-4, rel=0.02)
    names = {"index.html", "twin.csv", "twin.nc", "twin.json"}
    assert names <= {p.name for p in (tmp_path / "out").iterdir()}
    assert "Twin of rig" in (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    told = refused("twin", DATA, "--rig", DATA / "rig.toml")
    assert told.endswith("is a folder; give the file of one record, such as level_5_a.uff in it\n")


STEPS = [("gap +20 %", "gap", 1.2), ("stiffness -20 %", "stiffness", 0.8)]


@pytest.mark.slow
@pytest.mark.parametrize(("change", "quantity", "factor"), STEPS)
def test_a_step_is_one_alarm(change, quantity, factor):
    """At 30 s of 60: seen within two windows, and the size within 4 %."""
    found = twin(shaken(50, 5.0, 60.0, change))
    (alarm,) = found.alarms
    assert (alarm.bushing, alarm.quantity) == (1, quantity)
    assert 30.0 < alarm.time < 34.5 and abs(alarm.since - 30.0) < 2.5
    assert alarm.after / alarm.before == pytest.approx(factor, rel=0.04)
    assert found.value(quantity)[-1, 1] / found.value(quantity)[10, 1] == pytest.approx(factor, rel=0.02)


@pytest.mark.slow
def test_wear_is_seen_and_followed():
    """The gap grows by 10 % over 30 s: an alarm once it passed 3 %, and the end within 2 %."""
    found = twin(shaken(51, 5.0, 60.0, "wear 10 %"))
    assert [a.quantity for a in found.alarms] in (["gap"], ["gap", "gap"])
    assert 38.0 < found.alarms[0].time < 55.0
    worn = 3e-4 * (1 + 0.1 * (found.time[-1] - 1.0 - 30.0) / 30.0)  # in the middle of the last window
    assert found.value("gap")[-1, 1] == pytest.approx(worn, rel=0.02)


@pytest.mark.slow
def test_no_alarm_without_a_change():
    """Six records of 30 s at three levels, rig corrected and families found."""
    assert [a for seed in range(60, 66) for a in twin(shaken(seed, (2.0, 5.0, 8.0)[seed % 3], 30.0)).alarms] == []
