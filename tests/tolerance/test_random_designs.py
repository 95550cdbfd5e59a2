"""Random excitation over a production of designs."""

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.statistics import share_interval
from clearance_mj.tolerance import DesignPeaks, Noise, Runner, Scatter, Scattered, peaks_of_designs, random_production
from clearance_mj.tolerance.peaks import noise_of, peaks_over_an_hour
from clearance_mj.tolerance.random_designs import peaks_over_production

from ..refusals import assert_refused

RIG = cm.Rig.load("models/table1_rig.toml")
PSD = cm.PSD([5.0, 20.0, 80.0, 220.0], [0.5, 1.0, 1.0, 0.2])
DESIGNS = [RIG.with_gap(gap) for gap in np.linspace(2.5e-4, 3.5e-4, 10)]
NOISE = Noise(PSD, [2.0, 4.0], 3.0, limit=2.0, settling=1.0)
ALONE = Runner(1)


def design(number, level=1.0, touch=0.0, exceeded=0.0, median=1.0, rate=0.0):
    return DesignPeaks(number, level, (rate,), (touch,), (median,), (median,), (median,), (exceeded,))


def test_a_design_is_as_it_is_alone_under_the_noise_of_its_eight():
    peaks = peaks_of_designs(DESIGNS, NOISE, 7, ALONE)
    assert [(each.level, each.design) for each in peaks] == [(level, i) for level in (2.0, 4.0) for i in range(10)]
    for i, eight in ((3, 0), (9, 1)):
        alone = peaks_over_an_hour(DESIGNS[i], noise_of(PSD.scaled(4.0), 4.0, [7, eight]), settling=1.0, limit=2.0)
        assert peaks[10 + i].median == pytest.approx(alone.median.tolist(), rel=1e-6, nan_ok=True)
        assert peaks[10 + i].exceeded == pytest.approx(alone.exceeded.tolist(), rel=1e-6, nan_ok=True)
        assert peaks[10 + i].impacts_per_second == tuple(alone.impacts_per_second)


@pytest.mark.slow
def test_the_number_of_workers_changes_nothing():
    one, two = (peaks_of_designs(DESIGNS, NOISE, 7, Runner(n)) for n in (1, 2))
    assert repr(one) == repr(two)


def test_share_of_independent_designs_has_wilsons_interval():
    """One level of three groups, too few to see a scatter of groups."""
    (production_peaks,) = peaks_over_production([design(i, touch=float(i < 6)) for i in range(24)])
    assert production_peaks.touches[0] == pytest.approx([0.25, *share_interval(0.25, 24, 0.9)])


def test_designs_that_share_their_fate_count_as_one():
    """Groups of eight that all touch or none does: as many designs as groups, less one for the mean."""
    groups = 10
    (production_peaks,) = peaks_over_production([design(i, touch=float(i // 8 < 4)) for i in range(8 * groups)])
    assert production_peaks.touches[0] == pytest.approx([0.4, *share_interval(0.4, groups - 1, 0.9)])


def test_levels_and_quantiles_over_designs():
    designs = [design(i, level, median=float(i), rate=2.0 * i) for level in (3, 1) for i in range(21)]
    production_peaks = peaks_over_production(designs)
    assert [(each.level, each.designs) for each in production_peaks] == [(1, 21), (3, 21)]
    assert production_peaks[0].largest[0] == pytest.approx([1.0, 10.0, 19.0])
    assert production_peaks[0].impacts_per_second[0] == pytest.approx([2.0, 20.0, 38.0])


def test_designs_with_too_few_peaks_widen_the_interval():
    """Ten designs exceed the limit surely, ten touch surely and have too few peaks: from below 1/2 to above 1."""
    few = [design(i, touch=1.0, exceeded=np.nan, median=np.nan) for i in range(10, 20)]
    (production_peaks,) = peaks_over_production([design(i, touch=1.0, exceeded=1.0) for i in range(10)] + few)
    value, low, high = production_peaks.exceeds[0]
    assert (value, low, high) == (0.5, pytest.approx(share_interval(0.5, 20, 0.9)[0]), 1.0)
    assert production_peaks.too_few.tolist() == [0.5]
    (no_limit,) = peaks_over_production([design(0, exceeded=np.nan)])
    assert np.isnan(no_limit.exceeds).all()


REFUSED = [([], [1.0], "one model or more"), ([RIG], [], "one level or more"), ([RIG], [0.0], "rms 0.0: must be > 0")]


@pytest.mark.parametrize(("models", "levels", "words"), REFUSED)
def test_refuses(models, levels, words):
    assert_refused(cm.ClearanceError, words, lambda: peaks_of_designs(models, Noise(PSD, levels), runner=ALONE))
    assert_refused(cm.ClearanceError, "no design", peaks_over_production, [])


def test_a_production_goes_on_where_it_stopped(tmp_path):
    """What is kept is not marched again, also where more levels are asked for; what is damaged is."""
    designs = Scatter((Scattered("bushings.gap", within="0.05 mm"),)).draw(cm.Model(RIG), 9)
    production_peaks = random_production(designs, Noise(PSD, [1.0, 3.0], 6.0), 0, Runner(1, kept=tmp_path))
    kept = sorted(tmp_path.glob("random_excitation_*.npz"))
    assert len(kept) == 4 and [each.designs for each in production_peaks] == [9, 9]
    kept[0].write_bytes(kept[0].read_bytes()[:200])
    written = {path: path.stat().st_mtime_ns for path in kept[1:]}
    again = random_production(designs, Noise(PSD, [0.5, 1.0, 3.0], 6.0), 0, Runner(1, kept=tmp_path))
    assert repr(again[1:]) == repr(production_peaks)
    assert all(path.stat().st_mtime_ns == time for path, time in written.items())
