"""Measured record: Brake-Reuss beam. Forced responses from a ring-down and the stepped sine at 0.2 N."""

import dataclasses
import json

import numpy as np
import pytest

from experiments.real import brb
from experiments.real.records import SteppedSine

from ..refusals import assert_refused


@pytest.fixture(scope="module")
def result(real_data):
    if not (real_data / "brb" / "HammerImpact.mat").exists():
        pytest.skip("HammerImpact.mat is missing; it is in BRBtesting on GitHub")
    return brb.analyse(real_data)


def rows(result, source):
    return {(r["control"], r["index"]): r for r in result["rows"] if r["source"] == source}


def test_ring_down(result, measured):
    """README of the records: 80.4 to 80.6 Hz and 0.24 to 0.14 % over the decay from 32 to 1 m/s²."""
    first = result["decays"][1]
    late, source = int(np.argmin(np.abs(first.amplitude - 1))), "README of the records"
    measured.equal("ring-down at 1 m/s²: frequency (Hz)", first.frequency[late], 80.6, source, abs=0.05)
    measured.equal("ring-down at 1 m/s²: damping (%)", 100 * first.damping[late], 0.14, source, abs=0.01)
    early = first.amplitude > 20
    assert first.amplitude.max() > 30 and 0.2 < 100 * first.damping[early].min() < 100 * first.damping.max() < 0.28


@pytest.mark.parametrize("sensor", [2, 3])
def test_accelerometers_agree(result, sensor, measured):
    frequency, damping = brb.agreement(result["decays"], sensor)
    what = f"ring-down: accelerometer {sensor} against 1, at most"
    measured.below(f"{what}, frequency (Hz)", frequency, 0.015, "accelerometer 1")
    measured.below(f"{what}, damping (%)", 100 * damping, 0.015, "accelerometer 1")


def test_law_along_the_ring_down(result, measured):
    for sensor, (frequency, damping) in brb.misses(result).items():
        what, source = f"joint along the ring-down, accelerometer {sensor}, at most", "wavelet ridge"
        measured.below(f"{what}: frequency (Hz)", frequency, 0.05, source)
        measured.below(f"{what}: damping (%)", 100 * damping, 0.03, source)


def test_peak_at_one_newton(result, measured):
    """Fitted to the ring-down (up to 32 m/s²) and to 0.2 N alone; a linear beam would reach twice as much."""
    at, known = rows(result, "predicted")["ForceControl", 2], rows(result, "measured")["ForceControl", 2]
    assert not at["fitted"] and at["beyond_decay"]
    assert [key for key, row in rows(result, "predicted").items() if row["fitted"]] == [("ForceControl", 0)]
    what, source = "stepped sine at 1 N, peak (m/s²)", "measured; ring-down and 0.2 N are fitted"
    measured.equal(what, at["peak_amplitude"], known["peak_amplitude"], source, rel=0.05)
    assert at["peak_amplitude_low"] < known["peak_amplitude"] < at["peak_amplitude_high"]
    lines = result["lines"]
    linear = lines[(lines["control"] == "ForceControl") & (lines["index"] == 2)]["linear"].max()
    assert linear > 1.5 * known["peak_amplitude"]


def test_held_response(result, measured):
    at, known = rows(result, "predicted")["ResponseControl", 1], rows(result, "measured")["ResponseControl", 1]
    source = "measured; ring-down and 0.2 N are fitted"
    measured.equal("response held at 20 m/s²: least force (N)", at["peak_force"], known["peak_force"], source, rel=0.15)
    what = "response held at 20 m/s²: frequency (Hz)"
    measured.equal(what, at["peak_frequency"], known["peak_frequency"], source, abs=0.11)
    assert at["peak_frequency_low"] < known["peak_frequency"] < at["peak_frequency_high"]


def test_what_is_left(result):
    """Above 40 m/s² the beam stiffens, as the measurement alone shows; a joint that slips can only soften."""
    [sine] = [s for s in result["sines"] if (s.control, s.index) == ("ForceControl", 2)]
    points = result["fit"].test.seen(brb.as_curve(sine))
    near = sine.amplitude > 55
    middle = (sine.amplitude > 36) & (sine.amplitude < 45)
    assert points.frequency[near].mean() > points.frequency[middle].mean() + 0.1
    frequency, _ = result["fit"].mode.backbone(np.array([4e-5, 1e-4, 1.6e-4, 2.3e-4]))
    assert (np.diff(frequency) < 0).all()
    missed = rows(result, "measured")["ForceControl", 2]["peak_frequency"]
    assert rows(result, "predicted")["ForceControl", 2]["peak_frequency_high"] < missed


def test_tables_and_figures(result, tmp_path, capsys):
    brb.write(result, tmp_path)
    saved = json.loads((tmp_path / "brb.json").read_text())
    assert {(r["control"], r["index"], r["source"]) for r in saved} == {
        (s.control, s.index, source) for s in result["sines"] for source in ("measured", "predicted")
    }
    assert all(r["peak_amplitude"] > 0 and r["peak_frequency"] > 79 for r in saved)
    assert len((tmp_path / "brb_forced.csv").read_text().splitlines()) == sum(s.force.size for s in result["sines"]) + 1
    for name in ("decay", "forced", "seen"):
        assert (tmp_path / f"brb_{name}.png").read_bytes()[:4] == b"\x89PNG"
    assert "ForceControl 2, predicted: amplitude 59" in capsys.readouterr().out


def sine(control, index, force):
    frequency = np.arange(79.0, 81.0, 0.1)
    return SteppedSine(control, index, frequency, np.full(20, force), np.linspace(1, 2, 20), np.zeros(20))


def test_the_curve_that_is_fitted():
    sines = [sine("ResponseControl", 1, 0.2), sine("ForceControl", 2, 1.0), sine("ForceControl", 0, 0.19)]
    assert brb.fitted_sine(sines) is sines[2]
    assert_refused(brb.RecordError, "no force-controlled curve", brb.fitted_sine, sines[:1])


def test_peaks_of_a_measurement():
    """The largest amplitude, or, where that is held, the least force."""
    forced, resting = sine("ForceControl", 0, 0.2), sine("ResponseControl", 0, 0.2)
    assert brb.measured_peak(forced) == pytest.approx((2.0, 80.9, 0.2))
    resting.force[7] = 0.1
    assert brb.measured_peak(resting) == pytest.approx((1 + 7 / 19, 79.7, 0.1))


def test_a_linear_beam_scales():
    known, other = sine("ForceControl", 0, 0.2), sine("ForceControl", 1, 0.6)
    np.testing.assert_allclose(brb.scaled(other, known), 3 * known.amplitude)
    np.testing.assert_allclose(brb.scaled(sine("ResponseControl", 1, 1.0), known), 0.2)
    assert np.isnan(brb.scaled(dataclasses.replace(other, frequency=other.frequency - 1.05), known)).sum() == 11
