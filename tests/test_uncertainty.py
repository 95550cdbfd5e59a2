"""FRF bands: the covariance that goes in comes out, and a linear rig's band is known in closed form."""

import dataclasses

import numpy as np
import pytest

from clearance_mj.beam import linear_frf
from clearance_mj.clearance import ConstantLaw, ContactLaw, HuntCrossley
from clearance_mj.errors import LawError
from clearance_mj.excitation import multisine
from clearance_mj.frf import estimate_frf
from clearance_mj.identify.laws import METHODS, Identified, nominal
from clearance_mj.identify.output_error import Fit, Parameter
from clearance_mj.io.dataset import Dataset
from clearance_mj.report.uncertainty import draw, drawings
from clearance_mj.rig import Grease
from clearance_mj.study import Knowledge, Study
from clearance_mj.uncertainty import Band, draw_laws, frf_band

NAMES = ("contact stiffness", "contact damping", "grease stiffness", "grease damping")


def fitted(value, std, correlation=None, low=1e-6, high=1e9):
    """Parameters as a fit of the method "constant" leaves them."""
    correlation = np.eye(4) if correlation is None else np.asarray(correlation)
    parameters = tuple(Parameter(name, "SI", v, low, high) for name, v in zip(NAMES, value))
    law = ConstantLaw(value[0], value[1], grease=Grease(value[2], value[3]))
    return Identified.of_fit(Fit(law, parameters, np.array(value), np.array(std), correlation, 0.1, 1.0, 1))


def logarithms(laws):
    return np.log([(law.k[0], law.c[0], law.grease[0].stiffness, law.grease[0].damping) for law in laws])


def test_drawn_laws_have_the_covariance(rig):
    correlation = np.eye(4)
    correlation[0, 1] = correlation[1, 0] = -0.9
    std = np.array((0.2, 0.1, 0.05, 0.3))
    found = fitted((7e3, 4.0, 4e3, 3.0), std, correlation)
    drawn = logarithms(draw_laws(rig, "constant", found.parameters, 4000, seed=2))
    # Standard errors of 4000 draws: σ/√4000 of a mean, about 2 % of a covariance's scale.
    np.testing.assert_allclose(drawn.mean(axis=0), np.log((7e3, 4.0, 4e3, 3.0)), atol=4 * 0.3 / np.sqrt(4000))
    np.testing.assert_allclose(np.cov(drawn.T) / np.outer(std, std), correlation, atol=0.08)


def test_same_seed_same_laws_within_the_bounds(rig):
    found = fitted((7e3, 4.0, 4e3, 3.0), (0.5, 0.5, 0.5, 0.5), low=2.9, high=7.1e3)
    laws, again = (logarithms(draw_laws(rig, "constant", found.parameters, 50, seed=4)) for _ in range(2))
    np.testing.assert_array_equal(laws, again)
    assert laws.min() == pytest.approx(np.log(2.9))
    assert laws.max() == pytest.approx(np.log(7.1e3))


def test_band_of_a_linear_rig(rig):
    """Below contact only the grease stiffness matters; where |H| rises or falls with it throughout, the band's limits
    are |H| of the stiffness's percentiles."""
    found = fitted((7e3, 4.0, 4369.0, 3.0), (1e-9, 1e-9, 0.04, 1e-9))
    laws = draw_laws(rig, "constant", found.parameters, 30, seed=1)
    drive = multisine(8.0, 1024.0, band=(5, 220), rms=0.02, period=2.0)
    band = frf_band(rig, drive, found.law, laws)
    stiffness = np.exp(logarithms(laws)[:, 2])

    def exact(k):
        grease = Grease(k, damping=3.0)
        bushings = tuple(dataclasses.replace(b, grease=grease) for b in rig.bushings)
        return np.abs(linear_frf(rig.replace(bushings=bushings), band.fitted.frequency))

    every = 20 * np.log10([exact(k) for k in np.sort(stiffness)])
    slope = np.sign(np.diff(every, axis=0))
    spread = np.ptp(every, axis=0)
    # Not at resonances and zeros, which a record of 8 s smears.
    clear = np.all(slope == slope[0], axis=0) & (spread > 0.2) & (spread < 2)
    assert clear.sum() > 200
    ends = np.sort([exact(k) for k in np.percentile(stiffness, (2.5, 97.5))], axis=0)
    error = 20 * np.log10(band.limits / np.abs(band.fitted.value) / (ends / exact(4369.0)))[:, clear]
    assert np.sqrt(np.mean(error**2)) < 0.05
    assert np.median(band.half_width_db[clear]) > 0.15


def test_physical_law_is_made_again(rig):
    """Force at one gap F, exponent n, restitution e: a Hunt-Crossley contact with K = F / dⁿ."""
    values = (4e3, 4.0, 0.8, 3e-4, 8e-4, 2.0, 0.5, 2.0, 1.5, 0.6)
    law = METHODS["output-error"].make(rig, *values)
    assert law.contact[0] == HuntCrossley(2.0 / 3e-4**1.5, 0.6, 1.5)
    assert law.grease[0].yield_displacement == pytest.approx(3e-4)
    assert isinstance(law, ContactLaw)


def test_methods_without_covariance_and_parameters_that_are_not_told(rig):
    with pytest.raises(LawError, match='method "nominal" gives no covariance'):
        draw_laws(rig, "nominal", (), 10)
    found = fitted((7e3, 4.0, 4e3, 3.0), (0.1, np.inf, 0.1, 0.1))
    with pytest.raises(LawError, match="do not tell the contact damping"):
        draw_laws(rig, "constant", found.parameters, 10)


def test_figure_holds_band_and_test(rig):
    drive = multisine(4.0, 1024.0, band=(5, 220), rms=2.0)
    laws = [ConstantLaw(k, 4.0) for k in (6e3, 8e3, 1e4)]
    band = frf_band(rig, drive, laws[1], laws)
    drawing = draw(rig, {"constant": band}, band.fitted)
    axes = drawing.figure.axes
    assert len(axes) == 4  # two bushings, magnitude and deviation
    assert all(len(ax.collections) == 1 for ax in axes)
    assert np.ptp(axes[2].lines[0].get_ydata()) == 0  # the test is the fitted law itself
    assert f"{np.mean(band.half_width_db):.2g} dB" in drawing.caption


def test_figure_of_a_study(small_dataset):
    """Of the laws that have a covariance, at the middle level."""
    dataset = Dataset.load(small_dataset)
    found = fitted((7e3, 4.0, 4e3, 3.0), (0.1, 0.1, 0.02, 0.1))
    laws = [Knowledge("constant", found.law, "", found.parameters), Knowledge("nominal", nominal(dataset.rig), "")]
    tests = {r.name: estimate_frf(r.response(), resolution=0.5) for r in dataset.validate}
    (drawing,) = drawings(Study(dataset, tuple(laws), tests, (), {}))
    assert drawing.name == "uncertainty"
    assert "constant: mean half width" in drawing.caption
    assert "nominal" not in drawing.caption
    assert drawings(Study(dataset, (laws[1],), tests, (), {})) == []


def test_limits_are_percentiles():
    values = np.arange(1.0, 102.0)[:, None, None] * np.ones((101, 2, 3))
    band = Band(None, values, confidence=0.9)
    np.testing.assert_allclose(band.limits[:, 0, 0], (6, 96))
    np.testing.assert_allclose(band.half_width_db, 10 * np.log10(16))
