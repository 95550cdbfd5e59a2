"""The model of the live page: its figures hold what the library's calls give; what is impossible says so."""

import dataclasses
import io
import json
import re
import zipfile
from unittest import mock

import numpy as np
import pytest

from clearance_mj import ClearanceError, Dataset, Grease, Model, Rig, SimulationError, periodic, simulate
from clearance_mj.beam import linear_frf
from clearance_mj.clearance import AmplitudeLaw, ConstantLaw, ContactLaw, HuntCrossley
from clearance_mj.live import Session, figures, on_demand
from clearance_mj.live.controls import build_model
from clearance_mj.live.export import exported
from clearance_mj.live.figures import thinned
from clearance_mj.signals import csac, estimate_frf, excitation, rmse_db

from ..conftest import ROOT, TABLE1, record_of
from ..refusals import assert_refused

LAW = ConstantLaw(7.8e3, 4.0)
SHORT = {"duration": 4.0}


@pytest.fixture
def session():
    return Session(Model(TABLE1, LAW))


def with_gap(rig, gap):
    first, *others = rig.to_dict()["bushings"]
    return type(rig).from_dict(rig.to_dict() | {"bushings": [first | {"gap": gap}, *others]})


def test_figures_hold_what_the_library_gives(session):
    numbers = session.show(session.setting(SHORT | {"bushings[0].gap": 1.5e-4, "level": 3.0, "seed": 4}))
    response = simulate(with_gap(TABLE1, 1.5e-4), excitation.random(4.0, 2048.0, rms=3.0, seed=4), LAW, "modal")
    frf = estimate_frf(response)
    known = {"magnitude": np.abs(frf.value[:, 0]), "coherence": frf.coherence[:, 0], "frequency": frf.frequency}
    for name, expected in known.items():
        np.testing.assert_array_equal(numbers.arrays[name], expected)
    for extreme in (np.max, np.min):
        drawn, x = (extreme(each, axis=1) for each in (numbers.arrays["displacement"], response.displacement))
        np.testing.assert_array_equal(drawn, x)
    # the natural frequencies of docs/theory.md, which the rig reproduces
    np.testing.assert_allclose(numbers.facts["natural"][:4], [9.25, 39.75, 92.85, 188.85], rtol=1e-4)
    assert numbers.facts["walls"][0] == [-1.5e-4, 1.5e-4]


def test_identified_settings_are_the_rig_and_law_that_were_given():
    grease = Grease(stiffness=4000.0, damping=5.0, film_height=3.5e-4)
    for law in (
        ConstantLaw(6e3, 12.0, grease=grease), AmplitudeLaw([1e-4, 5e-4], [6e3, 8e3], [3.0, 9.0]),
        ContactLaw(HuntCrossley(5e5, 0.6)),
    ):  # fmt: skip
        model = build_model(Model(TABLE1, law), Session(Model(TABLE1, law)).identified)
        rig, same = model.rig, model.law
        assert rig == TABLE1
        for of_given, of_built in zip(law.table(2)[:5], same.table(2)[:5]):
            np.testing.assert_array_equal(of_built, of_given)
        assert (same.grease[1] if same.grease else None) == (law.grease[0] if law.grease else None)


def test_noise_is_that_of_the_records():
    """Band and rate of the first record that says its band; sliders reach it."""
    records = tuple(record_of(TABLE1, name, "identify", 1.0, 0, duration=4.0) for name in "ab")
    wide = dataclasses.replace(records[1], band=(0.5, 1000.0))
    controls = Session(Model(TABLE1), Dataset(TABLE1, (dataclasses.replace(records[0], band=None), wide))).controls
    low, high = controls["band_low"], controls["band_high"]
    assert (low.value, high.value) == (0.5, 1000.0) and low.low <= 0.5 and high.high >= 1000.0
    assert Session(Model(TABLE1)).controls["band_high"].value == 220.0


def test_every_number_of_a_law_can_be_moved():
    law = ContactLaw(HuntCrossley(5e5, 0.6), grease=Grease(4e3, 5.0, film_height=3.5e-4))
    session = Session(Model(TABLE1, law))
    moved = {"contact.restitution": 0.3, "grease.film_height": 4e-4, "offset": 1e-4}
    model = build_model(Model(TABLE1, law), session.setting({f"bushings[1].{k}": v for k, v in moved.items()}))
    assert model.law.contact == (HuntCrossley(5e5, 0.6), HuntCrossley(5e5, 0.3))
    assert [g.film_height for g in model.law.grease] == [3.5e-4, 4e-4]
    assert [b.offset for b in model.rig.bushings] == [0.0, 1e-4]
    factors = Session(Model(TABLE1, AmplitudeLaw([1e-4, 5e-4], [6e3, 8e3], [3.0, 9.0])))
    assert factors.controls["bushings[0].contact.k"].unit == "×"
    twice = build_model(factors.model, factors.setting({"bushings[0].contact.k": 2.0})).law
    np.testing.assert_array_equal(twice.k, [[12e3, 6e3], [16e3, 8e3]])


@pytest.mark.parametrize(("changes", "words"), [
    ({"bushings[7].gap": 1e-4}, "'bushings\\[7\\].gap' is nothing that can be moved"),
    ({"level": "high"}, "Level, RMS: needs a number"),
    ({"level": float("nan")}, "needs a number"),
    ({"level": True}, "needs a number"),
    ({"seed": 1.5}, "whole number"),
    ({"seed": -1}, "whole number"),
    ({"engine": "warp"}, "'warp' is unknown; use modal"),
    ({"bushings[0].offset": 4e-4}, "beyond the gap"),
    ({"bushings[0].gap": -1.0}, "gap"),
    ({"bushings[0].contact.k": -1.0}, "k must be"),
    ({"bushings[0].contact.k": 1e16}, "stiff"),
    ({"duration": 1e9}, "samples; take fewer"),
    ({"resolution": 0.01}, "shorter than one segment"),
    ({"band_low": 300.0}, "band"),
])  # fmt: skip
def test_impossible_settings_say_what_is_wrong(session, changes, words):
    assert_refused(ClearanceError, words, lambda: session.simulated(session.setting(SHORT | changes)))


def test_a_simulation_that_diverges_leaves_the_session_working(session):
    assert_refused(SimulationError, "diverged", session.show, session.setting(SHORT | {"level": 1e200}))
    assert session.shown is None and session.show(session.setting(SHORT)).facts["values"]["level"] == 2.0


def test_kinds_of_excitation(session):
    made = []
    for kind in session.controls["excitation"].choices:
        response = session.simulated(session.setting(SHORT | {"excitation": kind, "level": 1.0})).response
        made.append(response.provenance["excitation"]["generator"])
    assert made == "random multisine burst_random level_ramp sweep sweep hammer stepped_sine".split()


def test_a_sine_shows_amplitudes(session):
    """Below contact the tip of the linear rig moves as `linear_frf` says."""
    setting = {"excitation": "sine", "frequency": 20.0, "level": 0.1, "duration": 20.0}
    numbers = session.show(session.setting(setting))
    assert numbers.facts["spectrum"] and numbers.facts["clearances"][1]["rattle"] == "free"
    at = np.argmin(np.abs(numbers.arrays["frequency"] - 20.0))
    expected = np.sqrt(2) * 0.1 * np.abs(linear_frf(TABLE1, [20.0]))[:, 0]
    np.testing.assert_allclose(numbers.arrays["magnitude"][:, at], expected, rtol=0.01)


@pytest.mark.parametrize("kind", ["impacts", "burst random", "multisine"])
def test_frfs_of_segments_without_a_window(session, kind):
    """Below contact they are those of `linear_frf`, once a segment holds a whole decay or a whole period."""
    setting = {"excitation": kind, "level": 0.05, "peak": 0.5, "duration": 40.0, "resolution": 0.2}
    numbers = session.show(session.setting(setting))
    x, frequency = numbers.arrays["displacement"], numbers.arrays["frequency"]
    assert np.abs(x).max() < TABLE1.bushings[0].gap and (frequency[0], frequency[-1]) == (5.0, 220.0)
    expected = np.abs(linear_frf(TABLE1, frequency))
    np.testing.assert_allclose(numbers.arrays["magnitude"], expected, atol=0.03 * expected.max())


def test_a_sine_stepped_up_and_down_jumps_at_the_folds(session):
    """docs/periodic.md: at 6 m/s² upwards at 46.91 Hz, downwards at 45.67 Hz, on steps 0.25 Hz apart."""
    values = session.setting({"level": 6.0 / np.sqrt(2)})
    numbers = on_demand.steps(session, values, 45.0, 48.0, 13, 3.0, lambda progress: None)
    assert numbers.arrays["up"].shape == numbers.arrays["down"].shape == (8, 13)
    assert numbers.facts["differ"] == [45.75, 46.75] and numbers.facts["level"] == pytest.approx(6.0, rel=1e-3)
    branch = on_demand.branch(session, values, 45.0, 48.0, lambda progress: None)
    at, amplitude = branch.arrays["frequency"], branch.arrays["amplitude"]
    for i, way in ((0, "up"), (-1, "down"), (-1, "up")):
        nearest = np.argmin(np.abs(at - numbers.arrays["frequency"][i]))
        np.testing.assert_allclose(numbers.arrays[way][:, i], amplitude[:, nearest], rtol=0.03)
    for low, high, count, hold, words in ((48, 45, 5, 1, "rising"), (1, 2, 5, 1, "cycles"), (5, 50, 200, 9, "samples")):
        with pytest.raises(ClearanceError, match=words):
            on_demand.steps(session, values, low, high, count, hold, lambda progress: None)


def test_orbits_join_two_directions_of_a_clearance():
    pump = Rig.load(ROOT / "models" / "pump_frame.toml")  # 36:Y to 38:Y and 36:Z to 38:Z
    assert figures.orbits(pump) == [(0, 1, False)] and figures.orbits(TABLE1) == []


STRUCTURES = (ROOT / "docs" / "structures.md").read_text(encoding="utf-8")
WRITTEN = re.findall(r"```toml\n(name = .*?)```", STRUCTURES, re.DOTALL)


@pytest.mark.parametrize("kind", ["pump_frame", "stepped_shaft", *range(len(WRITTEN))])
def test_rigs_of_every_kind(kind, tmp_path):
    """Shafts, parallel shafts, matrices, modes under a force; with and without clearances."""
    path = ROOT / "models" / f"{kind}.toml"
    if isinstance(kind, int):
        path = tmp_path / "rig.toml"
        path.write_text(WRITTEN[kind], encoding="utf-8")
    rig = Rig.load(path)
    session = Session(Model(rig))
    numbers = session.show(session.setting(SHORT | {"excitation": "random"}))  # in space nothing excites it at first
    expected = simulate(rig, excitation.random(4.0, 2048.0, rms=2.0, kind=rig.shaker.kind), session.model.law, "modal")
    np.testing.assert_array_equal(numbers.arrays["magnitude"], np.abs(estimate_frf(expected).value[:, 0]))
    assert len(numbers.facts["clearances"]) == len(rig.bushings)


def test_overlay_measures_agreement(small_dataset):
    dataset = Dataset.load(small_dataset)
    session = Session(Model(dataset.rig, LAW), dataset)
    numbers = session.show(session.setting({"excitation": "record: level_4_1"}))
    numbers.add(session.overlay("level_4_1", 0.5))
    record = dataset.records[3]
    test, model = map(estimate_frf, (record.response(), simulate(dataset.rig, record.excitation(), LAW, "modal")))
    np.testing.assert_array_equal(numbers.arrays["test_magnitude"], np.abs(test.value[:, 0]))
    pair = test.value[:, 0], model.value[:, 0]
    assert numbers.facts["agreement"]["rmse_db"] == pytest.approx(rmse_db(*pair).tolist())
    assert numbers.facts["agreement"]["csac"] == pytest.approx(np.mean(csac(*pair)))
    for name in ("../ramp", "/etc/passwd", ""):
        assert_refused(ClearanceError, "no record", session.overlay, name, 0.5)


def test_thinned_keeps_peaks():
    values = np.zeros((2, 100_001))
    values[0, 77_777], values[1, 33_333], values[1, 100_000] = 5.0, -3.0, 7.0
    places, thinned_values = thinned(values, 1000)
    assert thinned_values.shape[1] == places.size <= 1000 and np.all(np.diff(places) > 0)
    assert (thinned_values[0].max(), thinned_values[1].min(), thinned_values[1].max()) == (5.0, -3.0, 7.0)
    assert places[thinned_values[0].argmax()] == pytest.approx(77_777, abs=101)
    same_places, same = thinned(values[:, :1000], 1000)
    assert same.shape == (2, 1000) and same_places[-1] == 999


def test_a_window_shows_every_sample(session):
    session.show(session.setting(SHORT))
    numbers = session.window(1.0, 1.25)
    x = session.shown.response.displacement[:, 2048 : 2048 + 512]
    np.testing.assert_array_equal(numbers.arrays["displacement"], x)
    np.testing.assert_allclose(numbers.arrays["time"][[0, -1]], [1.0, 1.25 - 1 / 2048])
    assert not session.window(5.0, 6.0).arrays


def test_branch_is_that_of_periodic_response_and_can_be_cancelled(session):
    heard = []
    numbers = on_demand.branch(session, session.setting({"level": 6.0 / np.sqrt(2)}), 43.0, 49.0, heard.append)
    branch = periodic.follow_response(Model(TABLE1, LAW), 6.0, (43.0, 49.0), 9)
    np.testing.assert_allclose(numbers.arrays["frequency"], branch.frequency, rtol=1e-9)
    np.testing.assert_allclose(numbers.arrays["amplitude"], branch.amplitude().T, rtol=1e-6)
    assert [p["kind"] for p in numbers.facts["special"]] == [p.kind for p in branch.special]
    assert 0 <= min(heard) and max(heard) <= 1 and len(heard) > 5

    with pytest.raises(KeyError):
        on_demand.branch(session, session.identified, 43.0, 49.0, mock.Mock(side_effect=KeyError))


def test_sweep_over_gap(session):
    """A wider gap is touched less; far beyond the motion, never."""
    numbers = on_demand.sweep(session, session.setting(SHORT), "bushings[1].gap", 2e-4, 2e-2, 3, lambda progress: None)
    np.testing.assert_allclose(numbers.arrays["at"], [2e-4, 2e-3, 2e-2])
    contact = numbers.arrays["share"][1]
    assert contact[0] > contact[1] >= contact[2] == 0
    rms = simulate(TABLE1, excitation.random(4.0, 2048.0, rms=2.0), LAW, "modal").acceleration.std(axis=1)
    again = on_demand.sweep(session, session.setting(SHORT), "level", 2.0, 4.0, 2, lambda progress: None)
    np.testing.assert_allclose(again.arrays["rms"][:, 0], rms)
    for name, count in (("engine", 3), ("nothing", 3), ("level", 1), ("level", 1000)):
        with pytest.raises(ClearanceError, match=r"swept|sweep has"):
            on_demand.sweep(session, session.identified, name, 1.0, 2.0, count, lambda progress: None)


def test_export_goes_on_where_the_page_was(session, tmp_path):
    session.show(session.setting(SHORT | {"bushings[0].gap": 2e-4, "bushings[1].contact.k": 9e3}))
    with zipfile.ZipFile(io.BytesIO(exported(session.shown))) as archive:
        archive.extractall(tmp_path)
    model = Model.load(tmp_path)
    assert model.rig == with_gap(TABLE1, 2e-4) and model.law == ConstantLaw([7.8e3, 9e3], [4.0, 4.0])
    assert json.loads((tmp_path / "setting.json").read_text())["bushings[0].gap"] == 2e-4
    table = np.genfromtxt(tmp_path / "frf.csv", delimiter=",", names=True, deletechars="")
    np.testing.assert_allclose(table["8:+Z_magnitude"], np.abs(session.shown.frf.value[7, 0]), rtol=1e-9)
    assert {p.name for p in tmp_path.glob("*.svg")} == {"frf.svg", "displacement.svg"}


def test_sessions_share_nothing_that_changes():
    one, other = Session(Model(TABLE1, LAW)), Session(Model(TABLE1, LAW))
    before = other.show(other.setting(SHORT)).arrays["magnitude"]
    one.show(one.setting(SHORT | {"bushings[0].gap": 5e-5, "level": 9.0}))
    np.testing.assert_array_equal(other.show(other.setting(SHORT)).arrays["magnitude"], before)
    assert other.shown.model.rig == TABLE1
