"""FRF bands against closed forms; covariance and random errors against the scatter of repeated fits and records."""

import dataclasses

import numpy as np
import pytest
import scipy.optimize
import scipy.signal
import scipy.stats

from clearance_mj.beam import linear_frf
from clearance_mj.clearance import ConstantLaw
from clearance_mj.core.cache import ResultCache
from clearance_mj.core.errors import LawError, RecordError
from clearance_mj.core.files import SEAL
from clearance_mj.estimate.estimates import Estimates
from clearance_mj.estimate.parameter import Parameter
from clearance_mj.identify import Identified
from clearance_mj.identify.laws.law_misfit import LawMisfit, Stretch
from clearance_mj.identify.registry import fitted_model
from clearance_mj.io.dataset import Dataset
from clearance_mj.model import Model
from clearance_mj.report.figures import band_drawing, study_bands
from clearance_mj.rig import Grease
from clearance_mj.signals.excitation import multisine, random
from clearance_mj.signals.frf import FRF, estimate_frf
from clearance_mj.signals.frf_error import random_error
from clearance_mj.signals.response import Response
from clearance_mj.statistics.frf_bands import Band, frf_band, inside, paired_error
from clearance_mj.study import IdentifiedModel
from tests.studies import study_of

from ..conftest import SMALL_LAW, TABLE1

NAMES = ("contact stiffness", "contact damping", "grease stiffness", "grease damping")


def law_of(k, c, grease_k, grease_c):
    return ConstantLaw(k, c, grease=Grease(float(grease_k), float(grease_c)))


def fitted(value, std, correlation=None, low=1e-6, high=1e9):
    """Parameters as a fit of the method "constant" leaves them."""
    correlation = np.eye(4) if correlation is None else np.asarray(correlation)
    parameters = tuple(Parameter(name, "SI", v, low, high) for name, v in zip(NAMES, value))
    estimates = Estimates(parameters, np.array(value), np.array(std), correlation)
    return Identified(model=fitted_model(TABLE1, law_of, estimates), estimates=estimates)


def logarithms(models):
    laws = [model.law for model in models]
    return np.log([(law.k[0], law.c[0], law.grease[0].stiffness, law.grease[0].damping) for law in laws])


def test_drawn_laws_have_the_covariance(rig):
    correlation = np.eye(4)
    correlation[0, 1] = correlation[1, 0] = -0.9
    std = np.array((0.2, 0.1, 0.05, 0.3))
    fit = fitted((7e3, 4.0, 4e3, 3.0), std, correlation)
    drawn = logarithms(fit.draw(4000, seed=2))
    # Standard errors of 4000 draws: σ/√4000 of a mean, about 2 % of a covariance's scale.
    np.testing.assert_allclose(drawn.mean(axis=0), np.log((7e3, 4.0, 4e3, 3.0)), atol=4 * 0.3 / np.sqrt(4000))
    np.testing.assert_allclose(np.cov(drawn.T) / np.outer(std, std), correlation, atol=0.08)


def test_same_seed_same_laws_within_the_bounds(rig):
    fit = fitted((7e3, 4.0, 4e3, 3.0), (0.5, 0.5, 0.5, 0.5), low=2.9, high=7.1e3)
    laws, again = (logarithms(fit.draw(50, seed=4)) for _ in range(2))
    np.testing.assert_array_equal(laws, again)
    assert laws.min() == pytest.approx(np.log(2.9))
    assert laws.max() == pytest.approx(np.log(7.1e3))


def test_band_of_a_linear_rig(rig):
    """Below contact only the grease stiffness matters: the magnitudes that go into the band are in closed form."""
    fit = fitted((7e3, 4.0, 4369.0, 3.0), (1e-9, 1e-9, 0.04, 1e-9))
    laws = fit.draw(30, seed=1)
    drive = multisine(8.0, 1024.0, band=(5, 220), rms=0.02, period=2.0)
    band = frf_band(fit.model, drive, laws)

    def exact(k):
        grease = Grease(k, damping=3.0)
        bushings = tuple(dataclasses.replace(b, grease=grease) for b in rig.bushings)
        return np.log(np.abs(linear_frf(rig.replace(bushings=bushings), band.fitted.frequency)))[:, None]

    every = np.array([exact(k) for k in np.exp(logarithms(laws)[:, 2])])
    spread = np.ptp(every, axis=0) * 8.686
    clear = (spread > 0.2) & (spread < 2)  # not at resonances and zeros, which a record of 8 s smears
    assert clear.sum() > 200
    half = scipy.stats.t.ppf(0.975, 29) * np.sqrt(1 + 1 / 30) * every.std(axis=0, ddof=1)
    expected = np.array((every.mean(axis=0) - half, every.mean(axis=0) + half)) - exact(4369.0)
    error = 8.686 * (np.log(band.limits / np.abs(band.fitted.value)) - expected)[:, clear]
    assert np.sqrt(np.mean(error**2)) < 0.05
    assert np.median(band.half_width_db[clear]) > 0.15


def test_methods_without_covariance_and_parameters_that_are_not_identifiable(rig):
    with pytest.raises(LawError, match="the model has no posterior to draw from"):
        Model(rig).draw(10)
    fit = fitted((7e3, 4.0, 4e3, 3.0), (0.1, np.inf, 0.1, 0.1))
    with pytest.raises(LawError, match="do not identify the contact damping"):
        fit.draw(10)


def test_figure_holds_bands_and_test(rig):
    drive = multisine(4.0, 1024.0, band=(5, 220), rms=2.0)
    cases = [Model(rig, ConstantLaw(k, 4.0)) for k in (6e3, 8e3, 1e4)]
    band = frf_band(cases[1], drive, cases)
    drawing = band_drawing(rig, {"constant": band}, {"constant": np.full(band.half_width_db.shape, 0.01)}, band.fitted)
    axes = drawing.figure.axes
    assert len(axes) == 4  # two bushings, magnitude and deviation
    assert [len(ax.collections) for ax in axes] == [0, 0, 2, 2]
    assert np.ptp(axes[2].lines[0].get_ydata()) == 0  # the test is the fitted law itself
    assert f"±{np.mean(band.half_width_db):.2g} dB" in drawing.caption


def test_bands_of_a_study(small_dataset, tmp_path):
    """Of the laws that have a covariance, at the middle level's first record; the second time out of the cache."""
    dataset = Dataset.load(small_dataset)
    fit = fitted((7e3, 4.0, 4e3, 3.0), (0.1, 0.1, 0.02, 0.1))
    constant = IdentifiedModel.of("constant", fit)
    laws = (constant, IdentifiedModel("nominal", Model(dataset.rig)))
    (record,) = (r for r in dataset.validate if r.name == "level_4_1")
    assert study_bands(study_of(dataset, laws[1:])) == []
    cache = ResultCache(tmp_path / "cache")
    bands = study_of(dataset, laws, cache=cache).bands
    assert list(bands) == ["constant"]
    (path,) = (p for p in cache.folder.iterdir() if p.suffix != SEAL)
    written = path.stat().st_mtime_ns
    study = study_of(dataset, laws, cache=cache)
    (band, error), (again, error_again) = bands["constant"], study.bands["constant"]
    assert path.stat().st_mtime_ns == written
    assert again == band
    np.testing.assert_array_equal(error_again, error)
    (drawing,) = study_bands(study)
    inside_percent = 100 * inside(band.limits, estimate_frf(record.response(), resolution=0.5))
    assert f"constant: parameters alone ±{np.mean(band.half_width_db):.2g} dB" in drawing.caption
    assert f"inside at {inside_percent:.0f} %" in drawing.caption


def test_limits_hold_another_draw_as_often_as_they_say(rng):
    """4000 lines, 6 laws: binomial scatter of a share of 0.9 is 0.005. So do those of a test with a random error."""
    draws, error = rng.normal(1.0, 0.3, (7, 1, 1, 4000)), 0.6
    band = Band(None, np.exp(draws[:6]), confidence=0.9)
    assert share(band.limits, draws[6]) == pytest.approx(0.9, abs=0.02)
    test = draws[6] + rng.normal(0, error, 4000)
    assert share(band.limits, test) < 0.75
    # Two variances, one of them known, in quadrature: nearly so.
    assert share(band.prediction(error), test) == pytest.approx(0.9, abs=0.03)
    np.testing.assert_allclose(band.half_width_db, 10 * np.log10(band.limits[1] / band.limits[0]))


def share(limits, logarithm) -> float:
    return inside(limits, FRF(np.arange(4000.0), np.exp(logarithm)))


def records(rng, n, shared, noise, size=8192):
    """A filter with noise and a square that no FRF can say, and a model that lacks the noise."""
    for _ in range(n):
        x = rng.standard_normal(size)
        y = scipy.signal.lfilter([1.0], [1, -0.5], x) + shared * (x**2 - 1)
        test = (y + noise * rng.standard_normal(size))[None]
        yield Response(1024.0, x, test, band=(20, 500)), Response(1024.0, x, y[None], band=(20, 500))


def test_band_of_a_bench_holds_what_the_records_missed(rig):
    """All drawn benches are the found one: half a width is 1.96 times what was missed, 0.3 dB beyond random error."""
    ones = np.ones((len(rig.sensors), 1))
    stretch = Stretch("ramp", 0.0, 5.0, 1.0, 0.5 * ones, 0.4 * ones)
    misfit = LawMisfit(tuple(rig.sensor_labels), "m/s²", np.array([5.0, 220.0]), (stretch,), ())
    case = Model(rig, SMALL_LAW)
    band = frf_band(case, random(5.0, 2048.0, (5, 220), 1.0, 1), [case] * 3, resolution=1.0, misfit=misfit)
    assert band.half_width_db == pytest.approx(1.959964 * 0.5, rel=1e-6)  # as long as the stretch, as many averages
    longer = frf_band(case, random(20.0, 2048.0, (5, 220), 1.0, 1), [case] * 3, resolution=1.0, misfit=misfit)
    assert longer.half_width_db == pytest.approx(1.959964 * np.hypot(0.3, 0.2), rel=1e-6)


def test_random_error_is_the_scatter_from_record_to_record(rng):
    """Of 150 records of 8 s, 15 half-overlapping segments, coherence 1/2 or so: σ of log |H|."""
    frfs = [estimate_frf(test, resolution=1.0) for test, _ in records(rng, 150, 0.0, 1.0)]
    scatter = np.std([np.log(np.abs(frf.value[0])) for frf in frfs], axis=0)
    stated = np.sqrt(np.mean([random_error(frf)[0] ** 2 for frf in frfs], axis=0))
    assert np.median(scatter / stated) == pytest.approx(1.0, abs=0.05)
    with pytest.raises(RecordError, match="no coherence"):  # as of one segment
        random_error(dataclasses.replace(frfs[0], coherence=None))


def test_paired_error_leaves_out_what_model_and_test_share(rng):
    """The scatter of log |H_t / H_m|; that of log |H_t| alone is four times as large."""
    ratios, paired, alone = [], [], []
    for test, model in records(rng, 150, 0.6, 0.2):
        frfs = [estimate_frf(each, resolution=1.0) for each in (test, model)]
        ratios.append(np.log(np.abs(frfs[0].value / frfs[1].value))[0])
        paired.append(paired_error(test, model, 1.0)[0] ** 2)
        alone.append(random_error(frfs[0])[0] ** 2)
    stated = np.sqrt(np.mean(paired, axis=0))
    assert np.median(np.std(ratios, axis=0) / stated) == pytest.approx(1.0, abs=0.05)
    assert np.median(np.sqrt(np.mean(alone, axis=0)) / stated) > 3


def test_a_model_can_be_drawn_from_its_folder(tmp_path):
    """A folder keeps 64 draws: their scatter is that of the covariance, their order that of the seed."""
    fit = fitted((7e3, 4.0, 4e3, 3.0), (0.2, 0.1, 0.05, 0.3)).model
    fit.save(tmp_path)
    again = Model.load(tmp_path)
    drawn = logarithms(again.draw(64))
    np.testing.assert_allclose(np.std(drawn, axis=0), (0.2, 0.1, 0.05, 0.3), rtol=0.3)
    np.testing.assert_array_equal(logarithms(again.draw(5, 3)), logarithms(again.draw(5, 3)))
    assert len({model.law.k[0] for model in again.draw(10)}) == 10
    with pytest.raises(LawError, match="keeps 64 draws, 65 are wanted"):
        again.draw(65)
    Model(TABLE1).save(tmp_path)
    with pytest.raises(LawError, match="no posterior"):
        Model.load(tmp_path).draw(1)


def test_limits_of_the_share_of_contact_hold_the_next_one_as_often_as_they_say():
    """Shares whose arcsin √ is normal, as that of counted ones nearly is: 90 % of 2000 next ones, of 12 drawn laws."""
    rng, held = np.random.default_rng(8), []
    for _ in range(2000):
        of_contact = np.sin(np.clip(rng.normal([0.15, 0.7], [0.05, 0.1], (14, 2)), 0, np.pi / 2)) ** 2
        low, high = Band(None, np.ones((12, 1, 1, 1)), confidence=0.9, contact=of_contact[:13]).contact_limits
        held.append((low <= of_contact[13]) & (of_contact[13] <= high))
    assert np.mean(held, axis=0) == pytest.approx([0.9, 0.9], abs=0.03)


def test_a_band_has_the_share_of_contact_of_each_law(rig):
    """Stiffer contacts are left sooner; the fitted law's own share is that of its simulation."""
    drive = multisine(4.0, 1024.0, band=(5, 220), rms=4.0)
    cases = [Model(rig, ConstantLaw(k, 4.0)) for k in (6e3, 8e3, 1e4)]
    band = frf_band(cases[1], drive, cases)
    assert band.contact.shape == (4, len(rig.bushings))
    np.testing.assert_allclose(band.contact[0], cases[1].simulate(drive, "modal").contact_share, rtol=1e-9)
    np.testing.assert_allclose(band.contact[0], band.contact[2], rtol=1e-9)
    low, high = band.contact_limits
    assert np.all((low < band.contact[0]) & (band.contact[0] < high))
