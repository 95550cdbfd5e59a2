"""Identification of Bouc-Wen with a gap. Known loops are recovered, and what a record leaves open is said."""

import numpy as np
import pytest

from clearance_mj.core.errors import RecordError
from experiments.joints.hysteresis import BoucWenFit, bouc_wen

from ...refusals import assert_refused

TIME = np.linspace(0, 4, 2001)
MOTION = 1e-3 * (np.sin(2 * np.pi * TIME) * (0.4 + 0.15 * TIME) + 0.3 * np.sin(5.4 * np.pi * TIME))


def element(k=5e4, ratio=0.3, z_ult=2.5e-4, shape=0.4, exponent=1.8, gap=2e-4, offset=5e-5, dead_travel="fixed"):
    """A known element; shape is γ/β."""
    beta = z_ult**-exponent / (1 + shape)
    return BoucWenFit(k, ratio, beta, shape * beta, exponent, gap, offset, dead_travel)


def noisy(force, fraction, seed):
    return force + fraction * force.std() * np.random.default_rng(seed).standard_normal(force.size)


@pytest.mark.parametrize("gap", [0.0, 2e-4, None])
@pytest.mark.parametrize("dead_travel", ["fixed", "reopening"])
def test_recovered_without_noise(gap, dead_travel, measured):
    truth = element(gap=2e-4 if gap is None else gap, dead_travel=dead_travel)
    fit = bouc_wen(TIME, MOTION, truth.force(TIME, MOTION), gap=gap, dead_travel=dead_travel)
    np.testing.assert_allclose(fit.value, truth.value, rtol=1e-3)
    fitted, known = (value[truth.value != 0] for value in (fit.value, truth.value))
    what = f"no noise, {dead_travel} gap, {'unknown' if gap is None else f'{gap * 1e3:g} mm'}: largest error"
    measured.below(what, np.max(np.abs(fitted / known - 1)), 1e-3, "the element's own parameters")
    assert fit.unidentified == ()
    np.testing.assert_allclose(fit.force(TIME, MOTION), truth.force(TIME, MOTION), atol=1e-6)


@pytest.mark.parametrize("dead_travel", ["fixed", pytest.param("reopening", marks=pytest.mark.slow)])
def test_recovered_from_noise(dead_travel, measured):
    """1 % noise, 8 seeds: within two standard deviations in 95 % of the 56 cases (3 expected outside), all within 4."""
    truth = element(dead_travel=dead_travel)
    clean = truth.force(TIME, MOTION)
    fits = [bouc_wen(TIME, MOTION, noisy(clean, 0.01, seed), dead_travel=dead_travel) for seed in range(8)]
    deviation = np.abs([(fit.value - truth.value) / fit.estimates.std for fit in fits])
    assert np.sum(deviation > 2) <= 7  # binomial(56, 0.05): more than 7 has a chance of 0.5 %
    what = f"1 % noise, {dead_travel} gap: largest error over its standard deviation, 8 noises"
    measured.below(what, deviation.max(), 4, "the element's own parameters")
    assert all(fit.unidentified == () for fit in fits) and fits[0].nrmse == pytest.approx(0.01, rel=0.1)


@pytest.mark.parametrize(
    ("exponent", "reversal", "z", "energy"),
    [(1, 1, 0.721535, 0.593245), (1, 3, 0.993307, 7.04011), (2, 1, 0.825659, 0.463088), (2, 3, 0.999909, 7.61416)],
)
def test_steady_loops(exponent, reversal, z, energy, measured):
    """Closed forms for A = 1, β = γ = 1/2; found again from the loop, whose energy and reversal the fit has."""
    t = np.arange(8001) / 1000
    motion = reversal * np.sin(2 * np.pi * t)
    fit = bouc_wen(t, motion, element(1.0, 0.0, 1.0, 1.0, exponent, 0.0, 0.0).force(t, motion), gap=0)
    loop, last = fit.force(t, motion), slice(-1001, None)
    what, source = f"fitted steady loop, n = {exponent}, X = {reversal}", "closed form, A = 1, β = γ = 1/2"
    measured.equal(f"{what}: z at reversal", loop[last].max(), z, source, rel=2e-4)
    measured.equal(f"{what}: energy per cycle", np.trapezoid(loop[last], motion[last]), energy, source, rel=2e-4)


def test_several_records():
    truth, half = element(), TIME.size // 2
    parts = [(TIME[:half], MOTION[:half]), (TIME[:half], 1.3 * MOTION[:half])]
    fit = bouc_wen([t for t, _ in parts], [x for _, x in parts], [truth.force(t, x) for t, x in parts])
    np.testing.assert_allclose(fit.value, truth.value, rtol=1e-3)


def test_reopening_gap_differs_from_fixed():
    """After a reversal far from the centre only the re-opening gap has its dead travel 2d there."""
    t, x = np.arange(2001.0), np.concatenate((np.linspace(0, 1, 1001), np.linspace(1, 0, 1001)[1:]))
    force = {kind: element(1e3, 0.0, 0.05, 0.5, 2.0, 0.1, 0.0, kind).force(t, x) for kind in ("fixed", "reopening")}
    back = x[1001:]
    idle = back[np.abs(force["reopening"][1001:]) < 1e-9]
    assert np.ptp(idle) == pytest.approx(0.2, abs=2e-3) and idle.min() > 0.7
    assert force["fixed"][1001:][back > 0.3].min() == pytest.approx(-50, rel=1e-3)


def test_start_within_reopening_gap():
    """x0 from the first force gives that force back."""
    known, motion = element(dead_travel="reopening", ratio=0.0), MOTION + 3e-4
    assert known.force(TIME, motion, known.offset_of(motion[0], 3.0))[0] == pytest.approx(3.0, rel=1e-9)
    assert known.offset_of(motion[0], 0.0) == motion[0]
    assert_refused(RecordError, "fixed gap", lambda: element().offset_of(0.0, 1.0))


def test_sliding_of_a_linear_spring_is_not_identifiable():
    fit = bouc_wen(TIME, MOTION, noisy(2e4 * MOTION, 0.01, 1), gap=0)
    assert {"beta", "gamma"} <= set(fit.unidentified)
    np.testing.assert_allclose(fit.force(TIME, MOTION), 2e4 * MOTION, atol=0.02 * np.ptp(2e4 * MOTION))


def test_as_grease():
    grease = element().grease
    assert (grease.stiffness, grease.elastic_ratio, grease.exponent) == (5e4, 0.3, 1.8)
    assert grease.yield_displacement == pytest.approx(2.5e-4)


def changed(a, index, value):
    a = a.copy()
    a[index] = value
    return a


@pytest.mark.parametrize(("arguments", "options", "message"), [
    ((TIME, changed(MOTION, 7, np.nan), MOTION), {}, "displacement is not finite at sample 7"),
    ((TIME, MOTION, changed(MOTION, 9, np.inf)), {}, "force is not finite at sample 9"),
    ((TIME, 0 * MOTION + 1, MOTION), {}, "displacement is constant at 1"),
    ((TIME, MOTION, 0 * MOTION), {}, "force is constant at 0"),
    ((TIME[:19], MOTION[:19], MOTION[:19]), {}, "19 samples are too short"),
    ((TIME[:50], MOTION, MOTION), {}, "\\(n,\\) each"),
    ((changed(TIME, 5, 0.0), MOTION, MOTION), {}, "time does not rise at sample 5"),
    ((TIME, MOTION, MOTION), {"gap": 2e-3}, "gap of 0.002 m is larger than the motion .* mean force"),
    ((TIME, MOTION, MOTION), {"gap": -1.0}, "gap must be >= 0"),
    ((TIME, MOTION, MOTION), {"dead_travel": "loose"}, '"loose" is unknown; use fixed, reopening'),
    ((TIME, np.minimum(MOTION, 4e-4), element().force(TIME, MOTION)), {}, "clipped at 0.0004 m"),
    (([TIME], [MOTION], []), {}, "1 times, 1 displacements and 0 forces"),
])  # fmt: skip
def test_bad_input(arguments, options, message):
    assert_refused(RecordError, message, bouc_wen, *arguments, **options)


def test_no_contact_in_the_record():
    force = np.random.default_rng(3).standard_normal(TIME.size)
    with pytest.raises(RecordError, match=r"does not follow the displacement .* gap is larger than the motion"):
        bouc_wen(TIME, MOTION, force)
