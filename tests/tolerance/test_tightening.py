"""Sobol indices and tolerances. Truth: a spring so slow that a force of gap times stiffness fills its gap.

The logarithm of that force is the sum of two normal numbers, so that indices, shares and tolerances are closed forms;
and SALib's estimators (Herman and Usher, Journal of Open Source Software 2, 2017) of the same designs.
"""

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose
from SALib.analyze.sobol import analyze
from scipy.optimize import minimize_scalar
from scipy.stats import norm, qmc

import clearance_mj as cm
from clearance_mj import ClearanceError, Contact, Grease
from clearance_mj.report.tightening import draw_tightening, tightening_words
from clearance_mj.statistics.sobol import sobol_indices
from clearance_mj.structure import Matrices
from clearance_mj.tolerance import Runner, Scatter, Sines, production, random_tightening, rattle_sensitivity, tighten
from clearance_mj.tolerance.random_designs import DesignPeaks, Noise, peaks_over_production
from clearance_mj.tolerance.scattered import Correlation, Scattered

from ..refusals import assert_refused
from .oscillator import GAP, STIFFNESS, oscillator

SLOW, ALONE = 0.01, Runner(1)  # Hz
FORCE = GAP * STIFFNESS  # N
SIZES = {"bushings[0].gap": 0.03, "bushings[0].grease.stiffness": 0.06}
"""Standard deviations of the logarithms"""
PRICES = {"bushings[0].gap": 3.0, "bushings[0].grease.stiffness": 1.0}
ALLOWED, BELOW = 0.05, 0.08
"""Share that may touch at a force that is so much below FORCE, in its logarithm"""


def spring() -> cm.Model:
    (bushing,) = oscillator().rig.bushings
    grease = dataclasses.replace(bushing, grease=Grease(STIFFNESS, 0.0), contact=Contact(1e5, 0.0))
    structure = Matrices("m-kg-s", mass=[[1.0]], stiffness=[[1e-9]], damping=[[20.0]], dofs=["1:X"])
    return oscillator(bushings=(grease,), structure=structure)


def scattered() -> Scatter:
    stds = {name: f"{100 * np.expm1(size):.12f} %" for name, size in SIZES.items()}
    numbers = (Scattered(of, std=std, distribution="lognormal", price=PRICES[of]) for of, std in stds.items())
    return Scatter(tuple(numbers))


def test_sobol_indices_are_shares_of_the_variance(measured):
    sensitivity = rattle_sensitivity(spring(), scattered(), Sines([3 * FORCE], [SLOW]), 128, runner=ALONE)
    known = np.square(list(SIZES.values()))
    known /= known.sum()
    assert sensitivity.quantity == ("level of first contact (dB)",) and sensitivity.parameter == tuple(SIZES)
    off = max(np.abs(sensitivity.first[0] - known).max(), np.abs(sensitivity.total[0] - known).max())
    measured.below("Sobol indices of the level of first contact through the whole chain", off, 0.02, "closed form")


def test_sobol_indices_are_those_of_salib():
    """Of Ishigami's function of the same designs, in SALib's order: A_i, AB_i of each number, B_i."""
    a, b = np.split(qmc.Sobol(6, rng=np.random.default_rng(0)).random(1024), 2, axis=1)
    angles = (np.pi * (2 * block.T - 1) for block in [a, b, *(np.where(np.arange(3) == i, b, a) for i in range(3))])
    values = [np.sin(x) + 7 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x) for x, y, z in angles]
    first, total, *_ = sobol_indices(np.concatenate(values)[:, None], 3)
    problem = {"num_vars": 3, "names": ["x", "y", "z"], "bounds": [[0, 1]] * 3}
    whole = np.stack((values[0], *values[2:], values[1]), axis=1).ravel()
    salib = analyze(problem, whole, calc_second_order=False, seed=0)
    assert_allclose(total[0], salib["ST"], rtol=0.01)
    assert_allclose(first[0], salib["S1"], atol=0.01)
    assert_allclose((first[0], total[0]), [[0.3139, 0.4424, 0.0], [0.5576, 0.4424, 0.2437]], atol=0.02)  # closed form


def test_correlated_numbers_have_one_index():
    scatter = dataclasses.replace(scattered(), correlations=(Correlation(tuple(SIZES), 0.5),))
    assert_refused(ClearanceError, "power of 2", rattle_sensitivity, spring(), scatter, Sines([3 * FORCE], [SLOW]), 12)
    sensitivity = rattle_sensitivity(spring(), scatter, Sines([3 * FORCE], [SLOW]), 64, runner=ALONE)
    assert sensitivity.parameter == (", ".join(SIZES),)
    assert_allclose(sensitivity.total, 1.0, atol=0.05)


def needed() -> float:
    """Standard deviation of the logarithm that leaves the share which is allowed."""
    return BELOW / norm.isf(ALLOWED)


@pytest.fixture(scope="module")
def tightened():
    return tighten(spring(), scattered(), Sines([FORCE * np.exp(-BELOW)], [SLOW]), ALLOWED, 512, runner=ALONE)


def test_a_tolerance_alone_is_as_wide_as_the_share_allows(tightened, measured):
    sizes = np.array(list(SIZES.values()))
    assert tightened.share == pytest.approx(norm.cdf(-BELOW / np.hypot(*sizes)), abs=3 / 512)
    assert_allclose(tightened.share_without, norm.cdf(-BELOW / sizes[::-1]), atol=0.002)
    assert np.isnan(tightened.width[0])  # the spring alone leaves more than is allowed
    off = tightened.width[1] / (np.sqrt(needed() ** 2 - sizes[0] ** 2) / sizes[1]) - 1
    measured.below("tolerance of a spring's stiffness that leaves 5 %", abs(off), 0.02, "closed form")


def test_the_cheapest_set_does_at_the_lowest_price(tightened, measured, tmp_path):
    """Both at once: w_1² σ_1² + w_2² σ_2² = σ²; the price is that of a search over one of them."""
    (s1, s2), (p1, p2) = SIZES.values(), PRICES.values()

    def cost(first):
        second = np.sqrt(max(needed() ** 2 - (first * s1) ** 2, 1e-12)) / s2
        return p1 * (1 / first - 1) + p2 * (1 / min(second, 1.0) - 1)

    best = minimize_scalar(cost, bounds=(0.05, min(1.0, needed() / s1)), method="bounded").fun
    measured.below("price of the cheapest set of two tolerances", abs(tightened.cost / best - 1), 0.05, "closed form")
    sines = Sines([FORCE * np.exp(-BELOW)], [SLOW])
    off = production(spring(), tightened.scatter, sines, 1024, seed=7, runner=ALONE).contact[0, 0] - ALLOWED
    measured.below("share that touches of the tightened production, beside 5 %", abs(off), 0.01, "brute force")
    path = tmp_path / "tightened.toml"
    tightened.scatter.save(path)
    assert Scatter.load(path) == tightened.scatter
    assert tightened.cheapest_limits[0] <= ALLOWED <= tightened.cheapest_limits[1]


def test_where_no_tolerance_does_the_nominal_gap_is_named():
    """Above the level of the middle design none does; gaps f times as large do at f = level/FORCE exp(1.645 σ)."""
    level = 1.2 * FORCE
    plan = tighten(spring(), scattered(), Sines([level], [SLOW]), ALLOWED, 128, runner=ALONE)
    known = level / FORCE * np.exp(norm.isf(ALLOWED) * np.hypot(*SIZES.values()))
    assert plan.share > 0.95 and np.isnan(plan.width).all() and not plan.cheapest
    assert 0.98 * known < plan.gap < 1.15 * known and plan.gap_share <= ALLOWED
    assert plan.gaps == pytest.approx((plan.gap * GAP,))
    assert any(words.startswith(f"The nominal gap does: at {plan.gap:.3g} times") for words in tightening_words(plan))


SIGMA, CYCLES, SPREAD = 0.2e-3, 20.0, 0.05  # m and 1/s of the motion in the gap; of the logarithm of the gap


@pytest.mark.parametrize("ratio", [1.04, 0.7], ids=["a tolerance does", "the gap does"])
def test_under_random_excitation_the_answers_are_those_of_rices_formula(ratio, monkeypatch):
    """Impacts of a Gaussian motion, ν exp(-gap²/2σ²) a second: there is one as likely as not if ln 2 are expected."""
    model = oscillator().with_gap(float(ratio * (SIGMA * np.sqrt(2 * np.log(3600 * CYCLES / np.log(2))))))
    scatter = Scatter((Scattered("bushings.gap", std=f"{100 * np.expm1(SPREAD):.12f} %", distribution="lognormal"),))

    noise = Noise(cm.PSD([5.0, 50.0], [0.1, 0.1], "force"), [2.0])

    def peaks(designs, noise, *_):
        gaps = [designs.model(i).rig.bushings[0].gap for i in range(len(designs))]
        rates = [CYCLES * np.exp(-(gap**2) / (2 * SIGMA**2)) for gap in gaps]
        touch = [-np.expm1(-3600 * rate) for rate in rates]
        seen = [rate if 60 * rate > 1 else 0.0 for rate in rates]  # in the minute that is marched
        nothing, rows = ((np.nan,),) * 4, enumerate(zip(seen, touch))
        return peaks_over_production(DesignPeaks(i, *noise.levels, (rate,), (p,), *nothing) for i, (rate, p) in rows)

    monkeypatch.setattr("clearance_mj.tolerance.tightening.random_production", peaks)
    plan = random_tightening(model, scatter, noise, ALLOWED, 128)
    assert plan.share == pytest.approx(norm.cdf(-np.log(ratio) / SPREAD), abs=2 / 128)
    assert (plan.level, plan.unit) == (2.0, "N RMS") and plan.what == "contact within 1 h"
    if ratio > 1:
        assert plan.width == pytest.approx([np.log(ratio) / SPREAD / norm.isf(ALLOWED)], rel=0.03) and not plan.gaps
    else:
        known = np.exp(norm.isf(ALLOWED) * SPREAD) / ratio
        assert 0.98 * known < plan.gap < 1.15 * known and plan.gap_share <= ALLOWED


def test_words_have_units_as_they_are_written(tightened):
    force = dataclasses.replace(tightened, what="contact force > 2 N", level=10.0)
    assert draw_tightening(force).caption.startswith("Contact force > 2 N at levels up to 10 N. Left: share")
    assert tightening_words(force)[0].startswith("contact force > 2 N up to 10 N: ")


def test_the_legend_lies_over_no_label(tightened):
    figure = draw_tightening(tightened).figure
    figure.draw_without_rendering()
    legends = [*figure.legends, *(ax.get_legend() for ax in figure.axes if ax.get_legend())]
    boxes = [legend.get_window_extent() for legend in legends]
    assert boxes and not any(box.overlaps(ax.get_tightbbox()) for box in boxes for ax in figure.axes)


def test_what_cannot_be_tightened_is_one_line():
    assert_refused(ClearanceError, "share between 0 and 1", tighten, spring(), scattered(), Sines([FORCE], [SLOW]), 1.0)
    with pytest.raises(ClearanceError, match="too few for 2 numbers"):
        tighten(spring(), scattered(), Sines([FORCE], [SLOW]), n_designs=8, runner=ALONE)


def test_where_enough_designs_do_nothing_is_tightened():
    plan = tighten(spring(), scattered(), Sines([FORCE * np.exp(-0.5)], [SLOW]), ALLOWED, 64, runner=ALONE)
    assert plan.share == 0 and np.all(plan.width == 1) and not plan.cheapest and np.isnan(plan.cost)
    # None touches at three times that.
    far = tighten(spring(), scattered(), Sines([0.01], [SLOW]), ALLOWED, 64, runner=ALONE)
    assert far.share == 0 and np.all(far.width == 1) and not np.any(far.share_without)
    assert tightening_words(far)[1:] == tightening_words(plan)[1:] == ["The tolerances do as they are."]
    draw_tightening(far)
