"""The section on sines: what the study's periodic vibrations are, as figures, tables and words."""

import dataclasses
import json
import re

import numpy as np
import pandas as pd
import pytest

from clearance_mj import Model, TimeLaw, periodic
from clearance_mj.core.cache import ResultCache
from clearance_mj.core.files import to_json
from clearance_mj.periodic.summaries import stable_points
from clearance_mj.report import ReportWriter
from clearance_mj.report.html import PageSection, page
from clearance_mj.report.sections.periodic import sines, special_points, unknown
from clearance_mj.signals import SineSteps
from clearance_mj.study import IdentifiedModel, study_summary
from clearance_mj.study import periodic as of_study
from clearance_mj.study.periodic import amplitude_error
from tests.studies import study_of

from .conftest import LAW, RIG, under_sines


def text_of(study, folder):
    markup = sines(study, ReportWriter(folder))
    page("sines", [PageSection("sines", "Sines", markup)])
    return " ".join(re.sub("<[^>]+>", " ", re.sub('src="[^"]*"', "", markup)).split())


@pytest.fixture(scope="module")
def written(study, tmp_path_factory):
    """The section's words, and the folder of its tables."""
    folder = tmp_path_factory.mktemp("sines")
    return text_of(study, folder), folder


def folds_of(branch):
    return [point for point in branch.special if point.kind == "fold"]


def test_tables_hold_branches_and_map(written):
    _, folder = written
    rows = pd.read_csv(folder / "tables" / "response.csv")
    branch = under_sines().branches[1]
    of_level = rows[rows["level"] == 4.0]
    np.testing.assert_array_equal(of_level["frequency_hz"], branch.frequency)
    np.testing.assert_allclose(of_level["acceleration_3:+Z_amplitude_m_s2"], branch.amplitude()[:, 2], rtol=1e-12)
    assert of_level["special"].tolist().count("fold") == len(folds_of(branch)) == 2
    assert len(pd.read_csv(folder / "tables" / "rattle_map.csv")) == 2 * 2 * 86


def test_folds_are_told_with_their_jumps():
    table = special_points(under_sines().branches)
    rows = {row[4]: row for row in table.rows if row[1] == "fold"}
    up, down = rows["upwards"], rows["downwards"]
    folds = sorted(point.frequency for point in folds_of(under_sines().branches[1]))
    assert (down[3], up[3]) == tuple(folds) and down[2] == up[2] == 1
    assert up[6] > up[7] and down[6] < down[7], "a hardening curve: down upwards, up downwards"


def test_folds_that_are_one_within_the_resolution_are_one_row_that_says_how_many():
    """Five loops around each of the two folds, within 0.1 %: two rows of six, with the folds' own jumps."""
    branch = under_sines().branches[1]
    branch = dataclasses.replace(branch, special=tuple(folds_of(branch)))
    loops = [
        dataclasses.replace(point, frequency=point.frequency * (1 + 1e-4 * i))
        for point in branch.special for i in range(1, 6)
    ]  # fmt: skip
    wound = special_points((dataclasses.replace(branch, special=(*branch.special, *loops)),))
    plain = special_points((branch,))
    assert [row[2] for row in wound.rows] == [6, 6]
    assert [(*row[:2], 1, *row[3:]) for row in wound.rows] == list(plain.rows)


def test_stability_by_folds_is_that_of_the_multipliers():
    """Where a branch has folds only; a multiplier passes 1 at each (Seydel 2010, chapter 2), but for rounding."""
    branch = periodic.follow_response(Model(RIG, LAW), 4.0, (30.0, 60.0), 5)
    folds = [point.index for point in folds_of(branch)]
    assert {point.kind for point in branch.special} == {"fold", "first contact"} and (~branch.stable).sum() > 3
    off = np.flatnonzero(stable_points(dataclasses.replace(branch, multipliers=None)) != branch.stable)
    assert all(min(abs(i - fold) for fold in folds) <= 1 for i in off)


def test_the_section_says_which_law_and_what_it_does(written):
    said, _ = written
    assert "What law “constant” does where the excitation is a sine" in said
    assert "(9 harmonics)" in said and "gap 0.3 mm: touches first from" in said


def steps_of(branch, frequencies, factor):
    """What a stepped sine of the branch's level would show if the rig moved by a factor more."""
    at = [int(np.argmin(np.abs(branch.frequency - f))) for f in frequencies]
    accelerations = factor * branch.amplitude()[at]
    up = np.ones(len(at), dtype=bool)
    return SineSteps(branch.frequency[at], np.full(len(at), abs(branch.level[0, 0])), up, accelerations, None)


def test_a_stepped_sine_is_compared_with_the_branch_of_its_level():
    """1.1 times the branch's amplitudes: the law misses -1/11; nothing beyond the branch's ends."""
    branches = under_sines().branches
    steps = steps_of(branches[0], [10.0, 30.0, 39.0, 80.0], 1.1)
    np.testing.assert_allclose(amplitude_error(branches, steps), -1 / 11, rtol=1e-9)
    assert np.isnan(amplitude_error(branches, dataclasses.replace(steps, frequency=steps.frequency + 100.0))).all()


def test_a_step_between_folds_is_compared_with_the_vibration_its_sweep_is_on():
    """A hardening curve: the high vibration upwards, which the sweep came along, the low one downwards."""
    branch = under_sines().branches[1]
    first, last = sorted(point.index for point in folds_of(branch))
    x, y = branch.frequency, branch.amplitude()
    high, low = ([np.interp(41.2, x[arm], row) for row in y[arm].T] for arm in (slice(first), slice(last + 1, None)))
    steps = SineSteps(np.full(2, 41.2), np.full(2, 4.0), np.array([True, False]), np.array([high, low]), None)
    assert high[2] > 3 * low[2]
    np.testing.assert_allclose(amplitude_error(under_sines().branches, steps), 0, atol=1e-9)


def test_a_stepped_sine_is_drawn_and_said(study, tmp_path):
    with_sines = study_of(study.dataset, study.laws, periodic=under_sines())
    with_sines.sine_steps = {"sine_4": steps_of(under_sines().branches[1], [10.0, 20.0, 80.0], 1 / 1.05)}
    said = text_of(with_sines, tmp_path)
    assert "record sine_4, 3 steps of 4 m/s²" in said and "by 5 % in the median" in said
    assert "Triangles: the synthetic test under a stepped sine" in said


def test_branches_that_end_early_are_said():
    whole, other = under_sines().branches
    short = dataclasses.replace(other, ended="no further one was found")
    assert unknown((whole, other)) == []
    assert unknown((whole, short)) == [f"4 m/s² from {other.frequency[-1]:.4g} Hz on"]
    assert unknown((short, other)) == []
    low, high = other.frequency.min(), other.frequency.max()
    turned = dataclasses.replace(other, frequency=other.frequency[::-1] + high - low, ended="it turns back and so on")
    assert unknown((short, turned)) == []
    apart = dataclasses.replace(turned, frequency=turned.frequency + 1.0)
    assert unknown((short, apart)) == [f"4 m/s² from {high:.4g} to {high + 1.0:.4g} Hz"]


def test_why_nothing_is_shown(study, tmp_path):
    law = TimeLaw([0.0, 1.0], [[1e3], [2e3]], [[1.0], [1.0]])
    said = text_of(study_of(study.dataset, [IdentifiedModel("ridge", Model(RIG, law), "everything")]), tmp_path)
    assert said.startswith("No periodic vibrations are shown: laws over time or amplitude have no periodic vibrations")
    assert not (tmp_path / "tables").exists()


def test_the_law_is_the_best_one_that_has_periodic_vibrations(study, monkeypatch):
    asked = []
    monkeypatch.setattr("clearance_mj.study.study.periodic_vibrations", lambda *given: asked.append(given) or "found")
    law = IdentifiedModel("ridge", Model(RIG, TimeLaw([0.0, 1.0], [[1e3], [2e3]], [[1.0], [1.0]])), "everything")
    bare = study_of(study.dataset, [*study.laws, law])
    assert bare.best_law == "ridge" and bare.periodic == "found"
    name, model, levels, band, kind, *_ = asked[0]
    assert (name, model.rig, model.law, levels, band, kind) == ("constant", RIG, LAW, [1.0, 4.0], (5.0, 220.0), "base")


def test_the_summary_holds_jumps_and_first_contact(study):
    summary = json.loads(to_json(study_summary(study)))["periodic"]
    folds = [point["frequency"] for point in summary["branches"][1]["special"]]
    assert folds == [point.frequency for point in under_sines().branches[1].special]
    assert summary["law"] == "constant" and summary["missing"] == "" and not summary["branches"][0]["floquet"]
    known = under_sines().map.first_contact
    np.testing.assert_allclose(np.array(summary["rattle_map"]["first_contact"], dtype=float), known)


def test_a_study_keeps_them_in_its_cache(study, monkeypatch, tmp_path):
    """Computed once; another study of the same law reads equal branches and an equal map."""
    computed = iter([under_sines()])
    monkeypatch.setattr("clearance_mj.study.study.periodic_vibrations", lambda *_: next(computed))
    first, second = (study_of(study.dataset, study.laws, cache=ResultCache(tmp_path)).periodic for _ in range(2))
    assert first is under_sines() and second is not first
    assert second.branches == first.branches and second.map == first.map
    assert (second.law, second.missing) == ("constant", "")
    assert second.branches[1].special == first.branches[1].special and second.map.jumps == first.map.jumps


@pytest.mark.parametrize("known", ["levels", "refused"])
def test_of_a_law(known, monkeypatch):
    """Levels go on beyond the records'; what harmonic balance refuses is said, not raised."""
    for name, value in {"HARMONICS": 3, "MAP_HARMONICS": 2, "MAP_LEVELS": 2, "MAP_FREQUENCIES": 4}.items():
        monkeypatch.setattr(of_study, name, value)
    band = (60.0, 70.0) if known == "levels" else (60.0, 60.0)
    vibrations = of_study.periodic_vibrations("constant", Model(RIG, LAW), [1.0, 4.0], band, "base", 2)
    if known == "refused":
        assert vibrations.map is None and vibrations.branches == () and "frequency_range must be" in vibrations.missing
        return
    assert [abs(branch.level[0, 0]) for branch in vibrations.branches] == [1.0, 4.0, 6.0]
    assert vibrations.map.level.tolist() == [1.0, 6.0] and vibrations.map.frequency[[0, -1]] == pytest.approx(band)
