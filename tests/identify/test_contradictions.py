"""Methods that take the rig file for exact say what contradicts it; records of that rig say nothing."""

import warnings

import numpy as np
import pytest

from clearance_mj.clearance.law import ConstantLaw
from clearance_mj.core.errors import RecordError
from clearance_mj.identify import law
from clearance_mj.identify.records.checks import IdentifiabilityWarning
from clearance_mj.identify.records.prepared import prepare
from clearance_mj.identify.structure.faults.contradictions import contradictions_of_rig
from clearance_mj.identify.structure.updating import rig_file_misfit
from clearance_mj.io.dataset import Dataset
from clearance_mj.signals import excitation

from ..conftest import ROOT
from .records import record_of, with_channel
from .test_diagnosis import PROBE, RIG, STIFFNESS, beam, with_rig


@pytest.fixture(scope="module")
def exact():
    """A level ramp on the very rig of the file."""
    push = excitation.level_ramp(8.0, 512.0, (5.0, 100.0), start_rms=0.3, end_rms=8.0, seed=1)
    record, _ = record_of(RIG, push, ConstantLaw(np.array([STIFFNESS]), np.array([5.0])))
    return Dataset(RIG, (record,))


def reversed_probe(dataset):
    return Dataset(dataset.rig, (with_channel(dataset.records[0], *PROBE, lambda value: -value),))


def test_nothing_contradicts_a_rig_that_is_told_exactly(exact):
    """1 % of noise on each channel; near the clamp, where little is left of the base's motion, that is 6 %."""
    shipped = Dataset.load(ROOT / "data" / "table1_rig")
    assert rig_file_misfit(exact.rig, prepare(exact)).max() < 0.06
    assert contradictions_of_rig(exact.rig, prepare(exact)) == ()
    assert contradictions_of_rig(shipped.rig, prepare(shipped)) == ()


def test_without_more_sensors_than_clearances_nothing_can_be_said(exact):
    bare = RIG.replace(sensors=RIG.sensors[:1])
    record = with_channel(with_rig(exact, bare).records[0], *PROBE, None)
    with pytest.raises(RecordError, match="needs more sensors than clearances"):
        rig_file_misfit(bare, prepare([record]))
    assert contradictions_of_rig(bare, prepare([record])) == ()


@pytest.mark.parametrize(("lie", "words"), [
    pytest.param(reversed_probe, "probe 301:+Z reads with the wrong sign", marks=pytest.mark.slow),
    pytest.param(lambda d: with_rig(d, beam(diameter=0.0092)), "beam.diameter is 0.008", marks=pytest.mark.slow),
])  # fmt: skip
def test_a_method_for_an_exact_rig_says_it(exact, lie, words):
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", IdentifiabilityWarning)
        law(lie(exact), "amplitude")
    assert words in " ".join(str(warning.message) for warning in said)
