"""Identification by output error. Truth: laws that the records were simulated with (the same engine, so not a test of
the physics, which tests/verification and tests/testrig check, but of the fit)."""

import dataclasses
import math

import numpy as np
import pytest

from clearance_mj import identify
from clearance_mj.clearance import nominal_law
from clearance_mj.core.errors import ClearanceError, RecordError
from clearance_mj.engines import simulate
from clearance_mj.estimate.parameter import Parameter
from clearance_mj.identify.laws import output_error
from clearance_mj.identify.laws.output_error import ResponseFeatures, before_contact, evidence, features
from clearance_mj.identify.methods.constant import fit_constant
from clearance_mj.identify.methods.physical import fit_output_error
from clearance_mj.io.dataset import Dataset
from clearance_mj.signals import Response, csac, csf, estimate_frf, frac, rmse_db
from experiments.testrig import Truth

from ..conftest import ROOT, SMALL_LAW, record_of
from ..refusals import assert_refused


def test_nominal_law_is_the_datasheet(rig):
    law = nominal_law(rig)
    assert law.k.tolist() == [b.contact.stiffness for b in rig.bushings]
    assert law.c.tolist() == [b.contact.damping for b in rig.bushings] and law.grease is None


@pytest.mark.slow
def test_constants_are_recovered_and_validation_records_stay_closed(small_dataset, measured):
    dataset = Dataset.load(small_dataset)
    fit = fit_constant(dataset)
    truth = [SMALL_LAW.k[0], SMALL_LAW.c[0], SMALL_LAW.grease[0].stiffness, SMALL_LAW.grease[0].damping]
    # Single impacts are chaotic: below about 2 % of a contact parameter the residuals are rough.
    names = ("contact k (N/m)", "contact c (N s/m)", "grease k (N/m)", "grease c (N s/m)")
    for name, value, known, limit in zip(names, fit.estimates.value, truth, (0.02, 0.1, 0.01, 0.05)):
        measured.equal(f"constants by output error: {name}", value, known, "the law of the simulation", rel=limit)
    assert fit.residual_db < 0.3 and [r.opened for r in dataset.validate] == [False] * 4
    assert all(r.opened for r in dataset.identify)


def test_start_values_are_worse_than_the_fit(small_dataset):
    """The datasheet misses the same residual by far: the fit is what brings it down."""
    dataset = Dataset.load(small_dataset)
    compared = output_error.ResponseResiduals(
        dataset.rig, evidence(dataset.identify), lambda: nominal_law(dataset.rig), math.inf, None
    )
    assert np.sqrt(np.mean(compared.residuals(np.empty((1, 0)))[0][: compared.frf_size] ** 2)) > 1.0


def test_unknown_method_lists_the_known(small_dataset):
    words = 'method "guess" is unknown; use nominal, constant, ridge'
    assert_refused(ClearanceError, words, identify.law, Dataset.load(small_dataset), "guess")


def test_nothing_to_identify_from(small_dataset):
    dataset = Dataset.load(small_dataset)
    alone = dataclasses.replace(dataset, records=dataset.validate)
    assert_refused(RecordError, 'no record has role "identify"', identify.law, alone, "constant")


def test_the_quiet_part_ends_before_the_first_touch(small_dataset):
    dataset = Dataset.load(small_dataset)
    (whole,) = evidence(dataset.identify)
    (quiet,) = before_contact([whole], dataset.rig)
    n, gap = quiet.excitation.value.size, dataset.rig.bushings[0].gap
    assert n == quiet.response.acceleration.shape[1] == quiet.response.displacement.shape[1]
    assert np.abs(whole.response.displacement[:, :n]).max() <= gap < np.abs(whole.response.displacement[:, n]).max()


def test_nothing_is_quiet_without_probes(small_dataset):
    dataset = Dataset.load(small_dataset)
    (whole,) = evidence(dataset.identify)
    blind = whole._replace(response=dataclasses.replace(whole.response, displacement=None))
    assert before_contact([blind], dataset.rig) == []


@pytest.mark.slow
def test_physical_law_without_probes(rig):
    """No force balance then: continued from several starts. The truth's grease is linear, 4000 N/m."""
    record = record_of(rig, "ramp", "identify", 6.0, 1, 10.0, start=0.3)
    blind = [c for c in record.channels if c.quantity != "displacement"]
    fit = fit_output_error(Dataset(rig, (dataclasses.replace(record, channels=blind),)))
    assert fit.law.grease[0].stiffness == pytest.approx(SMALL_LAW.grease[0].stiffness, rel=0.05)


def test_a_parameter_that_no_record_tells_stays_where_it_is_believed(small_dataset):
    """Without its spread, its column of the Jacobian is zero; with it, its standard deviation is large, not nought."""
    dataset = Dataset.load(small_dataset)
    informed = Parameter("grease stiffness", "N/m", 4040.0, 1e3, 1e5)
    untold = Parameter("colour", "1", 3.0, 1.0, 9.0, prior_std=0.5)

    def law(stiffness, _):
        grease = dataclasses.replace(SMALL_LAW.grease[0], stiffness=float(stiffness))
        return dataclasses.replace(SMALL_LAW, grease=(grease,))

    fit = output_error.fit_law(dataset.rig, evidence(dataset.identify), [informed, untold], law)
    assert fit.estimates.value == pytest.approx([SMALL_LAW.grease[0].stiffness, 3.0], rel=5e-3)
    std = fit.estimates.varied_std
    assert std[1] > 30 * std[0] and fit.estimates.identifiable.tolist() == [True, False]


def test_random_error_of_a_piece_is_its_scatter(rng, measured):
    """Scatter of |H| in dB over 200 pieces of 5 s of white noise through a gain of 2, as much noise added."""
    fs, pieces = 512.0, 200
    size = int(5 * fs)
    x, noise = rng.standard_normal((2, pieces * size))
    response = Response(fs, x, (2 * x + 2 * noise)[None], band=(20, 200))
    features = [output_error.piece_features(response, slice(i * size, (i + 1) * size)) for i in range(pieces)]
    scatter = np.std([20 * np.log10(frf) for frf, *_ in features], axis=0)
    stated = np.sqrt(np.mean([error**2 for _, _, error, *_ in features], axis=0))
    what, source = "random error of an FRF of half-overlapping segments over its scatter", "repeated records"
    measured.equal(what, np.median(scatter / stated), 1.0, source, rel=0.05)


@pytest.mark.parametrize("probes", [True, False])
def test_a_record_seen_as_its_own_response(rng, probes):
    """Two pieces, of which the second holds hits, estimated by `estimate_frf` and by the excitation's kept spectra."""
    fs, size = 512.0, 2 * 2600
    x, y, z = rng.standard_normal((3, size))
    x[size // 2 :] = 0.0
    x[size // 2 + 100 :: 700] = 30.0
    record = Response(fs, x, np.array([x + y, 2 * x + z]), y[None] if probes else None, band=(20, 200))
    expected, (frf, rms) = features(record), ResponseFeatures(record).look(record)
    assert frf.size == 2 * 181 and rms.size == (4 if probes else 2)
    np.testing.assert_allclose(frf, expected.frf, rtol=1e-12)
    np.testing.assert_allclose(rms, expected.rms, rtol=1e-12)


@pytest.mark.slow
def test_physical_law_of_the_virtual_rig(measured):
    """The generator's parameters, opened here and by no identification, and records that it has not seen."""
    dataset = Dataset.load(ROOT / "data" / "table1_rig")
    fit = fit_output_error(dataset)
    assert not any(record.opened for record in dataset.validate)
    truth = Truth()
    assert len(fit.law.grease) == 2
    source = "the virtual rig's own parameters"
    for j, filling in enumerate(fit.law.grease):
        what = f"output error, bushings[{j}]"
        measured.equal(f"{what}: k (N/m)", filling.stiffness, truth.grease_stiffness, source, rel=0.02)
        measured.equal(f"{what}: λ", filling.elastic_ratio, truth.elastic_ratio, source, abs=0.03)
        measured.equal(f"{what}: film c (N s/m)", filling.damping, truth.film_damping, source, rel=0.05)
        measured.equal(f"{what}: film h (m)", filling.film_height, truth.film_height, source, rel=0.05)
    tests = {r.name: estimate_frf(r.response()) for r in dataset.validate}
    for record in dataset.validate:
        model = estimate_frf(simulate(dataset.rig, record.excitation(), fit.law, "modal")).value
        test, repeat = tests[record.name].value, tests[record.name[:-1] + {"a": "b", "b": "a"}[record.name[-1]]].value
        what, source = (
            f"output error, record {record.name}: RMSE of the FRFs",
            "repeat of the virtual rig, another seed",
        )
        measured.below(what, np.mean(rmse_db(test, model)), np.mean(rmse_db(test, repeat)), source, "dB")
        agreement = min(measure(test, model).mean() for measure in (frac, csac, csf))
        measured.above(f"output error, record {record.name}: least of FRAC, CSAC, CSF", agreement, 0.99, "target")


def test_a_law_alone_is_not_given_where_the_rig_is_found_too(small_dataset):
    """Its law belongs to that rig."""
    words = r'method "bench" finds the rig too, .* identify.identify\(dataset, "bench"\)'
    assert_refused(ClearanceError, words, identify.law, Dataset.load(small_dataset), "bench")


@pytest.mark.parametrize(("method", "duration", "words"), [
    (lambda short: identify.law(short, "constant"), 2.0,
     '"short", lasts 2 s; this method needs 5 s; long enough for ridge'),
    (identify.fit_bench, 1.0, r"lasts 1 s; this method needs 1\.2 s"),
], ids=["by name", "called by itself"])  # fmt: skip
def test_a_record_that_is_too_short_for_the_method(rig, method, duration, words):
    short = record_of(rig, "short", "identify", 1.0, 5, duration=duration)
    assert_refused(RecordError, words, method, Dataset(rig, (short,)))
