"""The unbalance response of a Jeffcott rotor beside its closed form, separation margins beside API 617; figure."""

import math

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from clearance_mj import RigError, Sensor
from clearance_mj.rig import Unbalance
from clearance_mj.rotors import unbalance_response
from clearance_mj.rotors.api_617 import with_margins

from ..refusals import assert_refused
from .test_running_clearance import GAP, MOMENT, rotor
from .test_turning import BENDING, JEFFCOTT, jeffcott

ZETA, PHASE = 0.05, 0.4
SPEEDS = np.linspace(0.0, 2.0 * JEFFCOTT, 101)


def damped(zeta, **changes):
    """Return a Jeffcott rotor of a damping ratio, with a bushing and its probes in the middle."""
    unbalance = Unbalance(0.5, MOMENT, PHASE)
    return rotor(unbalance, structure=jeffcott((2 * zeta * JEFFCOTT, 0.0)).structure, **changes)


def test_amplitude_and_phase_of_a_jeffcott_rotor():
    """r = e Ω²/(ω² - Ω² + 2 i ζ ω Ω), peak to peak 2 |r|; z comes a quarter of a turn after y."""
    sweep = unbalance_response(damped(ZETA), SPEEDS)
    r = MOMENT / 3.0 * sweep.speed**2 / (JEFFCOTT**2 - sweep.speed**2 + 2j * ZETA * JEFFCOTT * sweep.speed)
    assert sweep.planes == {"1:+Z": "node 1, x = 0.5 m", "1:+Y": "node 1, x = 0.5 m"}
    assert_allclose(sweep.amplitude, [2 * np.abs(r)] * 2, rtol=2e-4)
    moving = slice(1, None)  # at rest there is no phase
    lag = np.degrees(-np.angle(r) - PHASE)[moving]
    apart = (sweep.phase_lag[:, moving] - [lag + 90, lag] + 180) % 360 - 180
    assert np.abs(apart).max() < 0.1


@pytest.mark.parametrize("zeta", [1e-3, 0.02, 0.05, 0.12])
def test_amplification_factor_of_a_jeffcott_rotor(zeta):
    """The peak is at ω/√(1 - 2ζ²), 2 e/(2ζ √(1 - ζ²)) high; half-power points solve a quadratic equation in Ω²."""
    peaks = unbalance_response(damped(zeta), np.linspace(0.0, 4.0 * JEFFCOTT, 51)).criticals
    at, height = 1 / math.sqrt(1 - 2 * zeta**2), 1 / (2 * zeta * math.sqrt(1 - zeta**2))
    assert list(peaks.probe) == ["1:+Z", "1:+Y"]
    assert_allclose(peaks.spin_rad_s, at * JEFFCOTT, rtol=2e-3)
    assert_allclose(peaks.amplitude_um_pp, 2e6 * MOMENT / 3.0 * height, rtol=1e-3)
    # x⁴/((1 - x²)² + 4ζ²x²) = h²/2
    low, high = np.sort(np.sqrt(np.roots([1 - 2 / height**2, 4 * zeta**2 - 2, 1.0])))
    assert_allclose(peaks.amplification_factor, at / (high - low), rtol=0.01)
    assert_allclose(peaks.amplification_factor, 1 / (2 * zeta), rtol=0.1)  # what it is near enough
    assert "margin" not in peaks


@pytest.mark.parametrize("last", [1.1, 4.0])
def test_words_beside_a_peak_stay_within_the_axes(last):
    figure = unbalance_response(damped(0.02), np.linspace(0.0, last * JEFFCOTT, 101)).plot()
    figure.canvas.draw()
    axes = figure.axes[0]
    assert len(axes.texts) == 1  # of both probes, whose peaks coincide
    assert all(text.get_window_extent().x1 < axes.bbox.x1 for text in axes.texts)


def test_probes_see_the_critical_speeds_of_their_own_planes():
    """Supports that are softer along y: shaft and springs in series, each probe with one peak, nearly undamped."""
    stiff, soft = 4e5, 1e5
    supports = jeffcott((1.0, 0.0), translation=stiff, translation_y=soft).structure
    peaks = unbalance_response(rotor(structure=supports), SPEEDS).criticals.set_index("probe").spin_rad_s
    for probe, support in (("1:+Y", soft), ("1:+Z", stiff)):
        assert peaks[probe] == pytest.approx(math.sqrt(1 / (1 / (48 * BENDING) + 1 / (2 * support)) / 3.0), rel=1e-3)


def test_a_resonance_whose_half_power_points_are_not_seen_has_no_factor():
    peaks = unbalance_response(damped(ZETA), np.linspace(0.0, 1.02 * JEFFCOTT, 51), (500.0, 600.0)).criticals
    assert np.isnan(peaks.amplification_factor).all() and set(peaks.margin) == {"not known"}


@pytest.mark.parametrize(("rpm", "factor", "actual", "required", "margin"), [
    (4500, 5.0, 10.0, 17 * (1 - 1 / 3.5), "not met"),  # API RP 684, SP6.8.2.10, by hand: 12.14 %
    (4000, 5.0, 20.0, 17 * (1 - 1 / 3.5), "met"),
    (9000, 5.0, 12.5, 10 + 17 * (1 - 1 / 3.5), "not met"),
    (10000, 5.0, 25.0, 10 + 17 * (1 - 1 / 3.5), "met"),
    (4200, 40.0, 16.0, 16.0, "met"),
    (10000, 40.0, 25.0, 26.0, "not met"),
    (6000, 2.49, 0.0, 0.0, "met"),
    (6000, 2.51, 0.0, 17 * (1 - 1 / 1.01), "not met"),
    (4000, math.nan, 20.0, math.nan, "not known"),
])  # fmt: skip
def test_separation_margins_of_api_617(rpm, factor, actual, required, margin):
    """Operating speeds from 5000 to 8000 rev/min."""
    given = pd.DataFrame({"spin_rad_s": [rpm * math.pi / 30], "amplification_factor": [factor]})
    peaks = with_margins(given, (5000 * math.pi / 30, 8000 * math.pi / 30)).iloc[0]
    percent = peaks.separation_margin_percent, peaks.required_margin_percent
    assert percent == pytest.approx((actual, required), nan_ok=True) and peaks.margin == margin


def test_the_response_is_drawn_with_what_it_is_judged_by():
    rig = damped(ZETA, sensors=(Sensor(1, 0.5), Sensor(2, 0.25)))
    figure = unbalance_response(rig, SPEEDS, (1.2 * JEFFCOTT, 1.6 * JEFFCOTT)).plot()
    assert [ax.get_title(loc="left") for ax in figure.axes[::2]] == ["node 1, x = 0.5 m", "node 2, x = 0.25 m"]
    assert {ax.get_ylabel() for ax in figure.axes} == {"Amplitude (µm p-p)", "Phase lag (°)"}
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert len(labels) == len({*labels})
    assert {"along y", "along z", "critical speed", "operating speeds", "required margin"} <= {*labels}
    (clearance,) = (line for line in figure.axes[0].lines if line.get_label() == "diametral clearance")
    assert clearance.get_ydata()[0] == pytest.approx(2e6 * GAP)
    words = [text.get_text() for text in figure.axes[0].texts]
    assert all(text.startswith("1555 rev/min, AF 9.9") for text in words) and len(words) == 1


def test_what_is_missing_is_said():
    assert_refused(RigError, "has no unbalances", unbalance_response, rotor().replace(unbalances=()), SPEEDS)
    assert_refused(RigError, "speeds must be rising spins", unbalance_response, rotor(), [2.0, 1.0])
    falling = unbalance_response(rotor(), SPEEDS, (20.0, 10.0))
    assert_refused(RigError, "must be above 0 and not fall", lambda: falling.criticals)
