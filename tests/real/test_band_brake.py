"""Self-energising band brake: loops in closed form, and identification of known parameters from loops."""

import numpy as np
import pytest

from clearance_mj.core.errors import RecordError
from experiments.real.band_brake import NAMES, BandBrakeFit, BrakeSide, band_brake, travel_since_reversal

from ..experiments.joints.test_hysteresis import changed
from ..refusals import assert_refused

TIME = np.linspace(0, 6, 1501)
MOTION = 1e-2 * (np.sin(2 * np.pi * TIME) * np.minimum(0.2 + 0.2 * TIME, 1) + 0.25 * np.sin(7.3 * np.pi * TIME))
PULL, PUSH = BrakeSide(3000.0, 0.2, 1.5, 2e-3, 1.6), BrakeSide(2000.0, 0.3, 1.2, 1.5e-3, 2.0)


def brake(pull=PULL, push=PUSH, gap=1e-3, soft=5e4, damping=600.0, friction=60.0, zero=20.0, travel=1.2e-3, charge=0.3):
    return BandBrakeFit(pull, push, gap, soft, damping, friction, zero, travel, charge)


def band_alone(**changes):
    """Nothing but the band, slack throughout the dead travel."""
    return brake(soft=0.0, damping=0.0, friction=0.0, zero=0.0, **changes)


@pytest.mark.parametrize("charge", [True, False])
def test_energy_of_a_cycle(charge, measured):
    """Slip each way is 2X - 2d - r₊ - r₋ =: S; it takes F (S - D) + F D (σ + (1-σ)/(q+1)) each way."""
    sides = [PULL, PUSH] if charge else [BrakeSide(s.slide, 1.0, 1.0, s.elastic, s.exponent) for s in (PULL, PUSH)]
    known = band_alone(pull=sides[0], push=sides[1])
    x = 1e-2 * np.sin(2 * np.pi * np.arange(40_001) / 20_000)
    loop = known.force(np.arange(x.size), x)
    slip, d = 2e-2 - 2e-3 - PULL.elastic - PUSH.elastic, known.charge_travel
    expected = sum(s.slide * (slip - d + d * (s.start + (1 - s.start) / (s.rise + 1))) for s in sides)
    last = slice(20_000, None)
    energy = np.trapezoid(loop[last], x[last])
    what = f"band brake {'that charges' if charge else 'without charge'}: energy of a cycle, J"
    measured.equal(what, energy, expected, "2 ∫ capacity over slip, closed form", rel=1e-5)
    assert (loop[last].max(), -loop[last].min()) == pytest.approx((3000.0, 2000.0), rel=1e-8)


def test_unloading_and_dead_travel():
    """From sliding it unloads along F ((r-δ)/r)^p, whatever the charge, and then has no force for 2d."""
    x = np.concatenate((np.linspace(0, 1e-2, 2001), np.linspace(1e-2, 0, 4001)[1:]))
    back, fall = band_alone().force(np.arange(x.size), x)[2001:], 1e-2 - x[2001:]
    expected = 3000 * np.clip(1 - fall / 2e-3, 0, None) ** 1.6
    np.testing.assert_allclose(back[fall <= 4e-3], expected[fall <= 4e-3], atol=1e-6)
    assert back[fall > 4.01e-3].max() < 0


def test_partly_loaded_band_reloads_elastically():
    """Charged by sliding, it slips no more below the force that it has reached."""
    back = np.linspace(2.2e-3, 1.4e-3, 200)
    x = np.concatenate((np.linspace(0, 2.2e-3, 400), back, back[::-1]))
    force = band_alone(charge=0.0).force(np.arange(x.size), x)
    assert force[399] > 1.4 * 0.2 * 3000
    np.testing.assert_allclose(force[400:600], force[600:][::-1], atol=1e-6)
    assert force[399] < 0.9 * (3000 * ((2.2e-3 - 1e-3) / 2e-3) ** 1.6)


def test_samples_between_reversals_do_not_matter():
    known = brake(damping=0.0)
    corners = 1e-3 * np.array([0.0, 8.0, -7.0, 1.0, -2.0, 9.0, 8.0, 8.8])
    fine = np.interp(np.linspace(0, 7, 7001), np.arange(8), corners)
    coarse = known.force(np.arange(8), corners)
    np.testing.assert_allclose(known.force(np.arange(7001), fine)[::1000], coarse, atol=1e-4)


@pytest.mark.parametrize("first", [-900.0, 150.0, 1500.0])
def test_starts_where_the_first_force_says(first):
    assert brake(charge=float(first > 0)).force(TIME, MOTION, first)[0] == pytest.approx(first, rel=1e-6)


def test_recovered_without_noise(measured):
    truth = brake()
    fit = band_brake(TIME, MOTION, truth.force(TIME, MOTION, 20.0))
    error = np.max(np.abs(fit.value / truth.value - 1))
    measured.below("band brake, no noise: largest error of 17 parameters", error, 1e-6, "the brake's own parameters")
    assert fit.nrmse < 1e-8


def test_recovered_from_noise(measured):
    """But for the first sample, which tells where the band stood."""
    truth = brake()
    force = truth.force(TIME, MOTION, 20.0)
    noise = 0.01 * force.std() * np.random.default_rng(2).standard_normal(force.size)
    fit = band_brake(TIME, MOTION, force + changed(noise, 0, 0.0))
    deviation = np.abs(fit.value - truth.value) / fit.estimates.std
    what = "band brake, 1 % noise: largest error over its standard deviation"
    measured.below(what, deviation.max(), 4, "the brake's own parameters")
    assert fit.nrmse == pytest.approx(0.01, rel=0.1)


def test_held_and_samples_that_do_not_count():
    """Two records; what stands in samples that are not used is never looked at, and held parameters stay."""
    truth = brake(damping=0.0, zero=0.0)
    force = truth.force(TIME, MOTION)
    wrong, use = force.copy(), np.ones(TIME.size, dtype=bool)
    use[700:800] = False
    wrong[700:800] = 9e3
    held = {"damping": 0.0, "force_zero": 0.0}
    fit = band_brake([TIME, TIME], [MOTION, MOTION], [wrong, force], [use, use], held=held)
    np.testing.assert_allclose(fit.value, truth.value, rtol=1e-6, atol=1e-9)
    assert set(fit.estimates.names) == set(NAMES) - set(held)


def test_travel_since_reversal():
    """A reversal of less than the least one does not count."""
    x = np.interp(np.linspace(0, 4, 401), np.arange(5), np.array([0.0, 5.0, 4.9, 8.0, 6.0]))
    travel = travel_since_reversal(x, 0.3)
    assert travel[300] == 8.0 and travel[-1] == 2.0
    np.testing.assert_allclose(travel[100:300], np.abs(x[100:300]))


@pytest.mark.parametrize(("arguments", "options", "message"), [
    ((TIME, changed(MOTION, 7, np.nan), MOTION), {}, "displacement is not finite at sample 7"),
    ((TIME, MOTION, 0 * MOTION), {}, "force is constant at 0"),
    ((TIME, MOTION, MOTION), {"use": np.ones(3)}, "use must have the shape of the records"),
    ((TIME, MOTION, MOTION), {"use": 0 * TIME}, "no sample is used"),
    ((TIME, MOTION, MOTION), {"speed_over": -1.0}, "speed_over must be >= 0 s"),
    ((TIME, MOTION, MOTION), {"held": {"mass": 1.0}}, "mass cannot be held; parameters are slide_pull"),
    ((TIME, MOTION, np.random.default_rng(1).standard_normal(TIME.size)), {}, "does not follow the displacement"),
])  # fmt: skip
def test_bad_input(arguments, options, message):
    assert_refused(RecordError, message, band_brake, *arguments, **options)
