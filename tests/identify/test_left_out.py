"""A channel that was left out of one record: nothing is concluded from it, and the other records keep the sensor.

What is known: what the same records say of a rig that never had the sensor, and the rig that was simulated.
"""

import dataclasses

import numpy as np
import pytest

from clearance_mj.beam import natural_frequencies
from clearance_mj.clearance.law import ConstantLaw
from clearance_mj.core.errors import RecordError
from clearance_mj.identify import diagnose, update_rig
from clearance_mj.identify.forces.restoring import restoring_force
from clearance_mj.identify.laws.law_misfit import law_misfit
from clearance_mj.identify.laws.output_error import ResponseFeatures
from clearance_mj.identify.records.checks import check_records
from clearance_mj.identify.records.prepared import prepare
from clearance_mj.io.dataset import Dataset, write_dataset
from clearance_mj.model import Model
from clearance_mj.signals import excitation
from tests.conftest import TABLE1 as RIG

from .records import FS, record_of, with_channel

OUT = "3:+Z"
LAW = ConstantLaw(np.full(2, 1e4), np.full(2, 4.0))
REAL = RIG.replace(beam=dataclasses.replace(RIG.beam, young_modulus=0.96 * RIG.beam.young_modulus))


def clipped(value):
    return np.clip(value, -0.3 * value.std(), 0.3 * value.std())


@pytest.fixture(scope="module")
def records():
    """Two loud records; an accelerometer of the second is clipped."""
    both = []
    for seed in (1, 2):
        loud = excitation.random(6.0, FS, (5.0, 220.0), rms=8.0, seed=seed)
        record, _ = record_of(REAL, loud, LAW, name=f"loud-{seed}")
        both.append(dataclasses.replace(record, rig=RIG))
    return both[0], with_channel(both[1], 3, "acceleration", clipped)


@pytest.fixture(scope="module")
def left_out(records):
    return records[0], dataclasses.replace(records[1], left_out=(OUT,))


def without_sensor(record):
    """The record on a rig that never had the sensor."""
    lacking = RIG.replace(sensors=tuple(s for s in RIG.sensors if s.node != 3))
    return dataclasses.replace(record, left_out=(), rig=lacking)


def test_refused_with_the_way_out_and_then_taken(records, left_out):
    words = r'"loud-2": accelerometer 3:\+Z is clipped .* left_out = \["3:\+Z"\] for this'
    with pytest.raises(RecordError, match=words):
        check_records(records)
    assert [record.absent for record in check_records(left_out)] == [(), ("accelerometer 3:+Z",)]


def test_the_rig_is_found_and_the_sensor_known_from_the_other_record(left_out):
    update = update_rig(Dataset(RIG, left_out), as_drawn=True)
    np.testing.assert_allclose(natural_frequencies(update.rig, 4), natural_frequencies(REAL, 4), rtol=3e-3)
    assert np.all(update.relative_error < 0.05)
    assert dict(zip(update.estimates.names, update.estimates.posterior_over_prior))["sensors[2].gain"] < 0.3
    assert "accelerometer 3:+Z" in update.to_dict()["records"][0]["misfit"]
    assert "accelerometer 3:+Z" not in update.to_dict()["records"][1]["misfit"]


def test_as_if_no_record_had_the_sensor(left_out):
    """Left out of its only record, a sensor moves nothing: the update is that of a rig without it."""
    alone = update_rig(Dataset(RIG, left_out[1:]), as_drawn=True)
    lacking = without_sensor(left_out[1])
    expected = update_rig(Dataset(lacking.rig, (lacking,)), as_drawn=True)
    names = [n for n in expected.estimates.names if not n.startswith("sensors")]
    assert [alone.values[name] for name in names] == pytest.approx([expected.values[name] for name in names], rel=1e-4)
    assert "sensors[2].gain" in alone.only_prior
    assert alone.relative_error[2] == 0 and np.all(np.delete(alone.relative_error, 2) > 0)
    assert diagnose(alone).faults == ()


def test_what_the_channel_holds_does_not_matter(left_out):
    """Noise in place of the clipped channel, or none at all, changes no digit."""
    noise = np.random.default_rng(3).standard_normal
    noisy = with_channel(left_out[1], 3, "acceleration", lambda value: noise(value.size))
    silent = with_channel(left_out[1], 3, "acceleration", None)
    of_all = [prepare([record])[0].signals for record in (left_out[1], noisy, silent)]
    np.testing.assert_array_equal(of_all[1:], [of_all[0]] * 2)


def test_restoring_forces_are_those_without_the_sensor(left_out):
    force, expected = restoring_force(left_out[1]), restoring_force(without_sensor(left_out[1]))
    np.testing.assert_allclose(force.force, expected.force, rtol=1e-9, atol=1e-9 * np.abs(expected.force).max())
    assert np.isinf(force.noise[2])
    np.testing.assert_allclose(np.delete(force.noise, 2), expected.noise)


def test_a_law_is_judged_by_the_other_sensors(left_out):
    misfit = law_misfit(prepare(left_out), Model(REAL, LAW))
    whole, lacking = (next(s for s in misfit.stretches if s.record == name) for name in ("loud-1", "loud-2"))
    assert np.isfinite(whole.missed).all() and np.isnan(lacking.missed[2]).all()
    assert np.nanmax(np.delete(lacking.missed, 2, axis=0)) < 1.0  # dB: the law that was simulated
    assert {row["sensor"] for row in misfit.rows() if row["record"] == "loud-2"} == {*RIG.sensor_labels} - {OUT}
    assert np.isfinite(misfit.widening)
    assert np.isfinite(misfit.spread(np.array([20.0, 100.0]), 8.0, 6.0, 1.0)).all()


def test_a_simulation_is_seen_at_the_recorded_sensors_alone(left_out):
    record, response = left_out[1].response(), left_out[0].response()
    both = [ResponseFeatures(record).look(response)[0].size, ResponseFeatures(response).look(response)[0].size]
    assert both[0] * len(RIG.sensors) == both[1] * (len(RIG.sensors) - 1)


def test_datasets_keep_it(tmp_path, left_out):
    write_dataset(tmp_path / "bench", RIG, left_out)
    again = Dataset.load(tmp_path / "bench").records
    assert [record.left_out for record in again] == [(), (OUT,)]
    assert again[1].response().responses == tuple(label for label in RIG.sensor_labels if label != OUT)
