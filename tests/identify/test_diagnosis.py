"""Gross faults put into a record that was sound are named, with what would be right."""

import dataclasses
import re

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from clearance_mj.beam import natural_frequencies
from clearance_mj.clearance.law import ConstantLaw
from clearance_mj.core.errors import RecordError
from clearance_mj.identify import diagnose, fit_bench, update_rig
from clearance_mj.identify.records.prepared import prepare
from clearance_mj.identify.structure.faults.assessment import Assessment
from clearance_mj.identify.structure.faults.of_channels import ChannelCorrection, nearest_unit_gain
from clearance_mj.identify.structure.faults.of_gaps import bends_of, gap_faults
from clearance_mj.identify.structure.faults.of_records import require_one_rig
from clearance_mj.identify.structure.faults.of_rigs import longer
from clearance_mj.identify.structure.faults.of_signals import describe_signal_fault
from clearance_mj.identify.structure.updating import update_from
from clearance_mj.io.dataset import Dataset
from clearance_mj.rig import Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor
from clearance_mj.signals import excitation

from .records import record_of, with_channel

STIFFNESS, GAP = 2e4, 2e-4
RIG = Rig(
    name="small", beam=Beam(length=0.6, young_modulus=2.1e11, density=7850.0, diameter=0.008, rayleigh=(1.0, 2e-5)),
    bushings=(Bushing(0.4, GAP, 0.01, Grease(3000.0, 3.0), Contact(STIFFNESS, 5.0)),),
    sensors=tuple(Sensor(i, x) for i, x in enumerate((0.15, 0.3, 0.45, 0.6), 1)), masses=(PointMass(0.6, 0.2),),
)  # fmt: skip
PROBE = (301, "displacement")


@pytest.fixture(scope="module")
def sound():
    """A level ramp on a rig whose modulus is 2.4 % below that of its file."""
    real = RIG.replace(beam=dataclasses.replace(RIG.beam, young_modulus=2.05e11))
    push = excitation.level_ramp(6.0, 512.0, (5.0, 100.0), start_rms=0.3, end_rms=8.0, seed=1)
    record, _ = record_of(real, push, ConstantLaw(np.array([STIFFNESS]), np.array([5.0])))
    return Dataset(RIG, (dataclasses.replace(record, rig=RIG),))


def scaled(dataset, channel, factor):
    return Dataset(dataset.rig, (with_channel(dataset.records[0], *channel, lambda value: factor * value),))


def with_rig(dataset, rig):
    return Dataset(rig, (dataclasses.replace(dataset.records[0], rig=rig),))


def beam(**fields):
    return RIG.replace(beam=dataclasses.replace(RIG.beam, **fields))


def gap(factor):
    return RIG.replace(bushings=(dataclasses.replace(RIG.bushings[0], gap=factor * GAP),))


def diagnosed(dataset):
    return diagnose(update_rig(dataset, as_drawn=True))


def test_a_sound_bench_gives_no_words_and_costs_nothing(sound, monkeypatch):
    update = update_rig(sound, as_drawn=True)
    monkeypatch.setattr("clearance_mj.identify.structure.faults.assessment.update_from", None)  # no hypothesis is tried
    diagnosis = diagnose(update)
    assert diagnosis.words == () and diagnosis.update is update


@pytest.mark.slow
def test_wrong_sign(sound):
    diagnosis = diagnosed(scaled(sound, (4, "acceleration"), -1.0))
    (fault,) = diagnosis.faults
    assert fault.cause == "accelerometer 4:+Z reads with the wrong sign"
    assert fault.factor == -1.0 and not diagnosis.unexplained


@pytest.mark.slow
def test_swapped_sensors(sound):
    swapped = ChannelCorrection({0: (2, 1.0), 2: (0, 1.0)}).applied(prepare(sound))
    (fault,) = diagnose(update_from(RIG, swapped)).faults
    assert fault.cause == "accelerometers 1:+Z and 3:+Z are swapped"


@pytest.mark.slow
def test_probe_in_millimetres(sound):
    (fault,) = diagnosed(scaled(sound, PROBE, 1e3)).faults
    assert str(fault).startswith("probe 301:+Z reads in mm instead of SI units: times 0.001")


@pytest.mark.slow
@pytest.mark.parametrize(("channel", "factor", "cause"), [
    (PROBE, -1.0, "probe 301:+Z reads with the wrong sign"),
    ((3, "acceleration"), 1 / 9.80665, "accelerometer 3:+Z reads in g instead of SI units"),
    ((3, "acceleration"), -1e3, "accelerometer 3:+Z reads in mm/s² instead of SI units and with the wrong sign"),
    ((100, "acceleration"), -1.0, "the excitation reads with the wrong sign"),
])  # fmt: skip
def test_signs_and_units(sound, channel, factor, cause):
    (fault,) = diagnosed(scaled(sound, channel, factor)).faults
    assert fault.cause == cause and fault.factor == pytest.approx(1 / factor)


def test_records_of_two_rigs_are_refused_and_records_at_two_levels_are_not():
    """One record quiet inside the gap, one loud beyond it; then a third, of a shaft that is a tenth thicker."""

    def record(name, real, level):
        push = excitation.random(4.0, 512.0, (5.0, 100.0), rms=level, seed=2)
        synthetic, _ = record_of(real, push, ConstantLaw(np.array([STIFFNESS]), np.array([5.0])), name=name)
        return dataclasses.replace(synthetic, rig=RIG)

    records = [record("quiet", RIG, 0.3), record("loud", RIG, 6.0)]
    assert require_one_rig(RIG, prepare(Dataset(RIG, tuple(records)))) is None
    records.append(record("thicker", beam(diameter=0.0088), 1.0))
    words = 'record "thicker" is not of the rig or set-up of "quiet", "loud": one rig for both misses accelerometer '
    with pytest.raises(RecordError, match=words) as error:
        fit_bench(Dataset(RIG, tuple(records)))
    theirs, others = re.search(r"frequencies are ([\d.]+), .* Hz against ([\d.]+), ", str(error.value)).groups()
    assert float(others) == pytest.approx(natural_frequencies(RIG, 1)[0], rel=0.02)
    assert float(theirs) > 1.05 * float(others)


@pytest.mark.slow
@pytest.mark.parametrize(("factor", "words"), [(1 / 3, "small"), (3.0, "large")])
def test_gap_told_wrong(sound, factor, words):
    (fault,) = diagnosed(with_rig(sound, gap(factor))).faults
    assert fault.cause.startswith("bushings[0].gap is ")
    assert f"too {words} in the rig file" in fault.cause
    assert fault.factor == pytest.approx(1 / factor, rel=0.15)  # of the bend, on a grid of 12 %


@pytest.mark.parametrize("probes", [True, False])
@pytest.mark.parametrize(("gap_factor", "level", "said"), [(0.85, 1.0, False), (0.85, 8.0, False), (0.4, 1.0, True)])
def test_a_wall_that_an_offset_brings_near_is_no_gap_told_wrong(gap_factor, level, said, probes):
    """The rig file knows of no offset, which is half of the gap: one wall stands at half of it, the other beyond."""
    real = dataclasses.replace(RIG.bushings[0], gap=gap_factor * GAP, offset=0.5 * gap_factor * GAP)
    push = excitation.level_ramp(6.0, 512.0, (5.0, 100.0), start_rms=0.3, end_rms=level, seed=1)
    record, _ = record_of(RIG.replace(bushings=(real,)), push, ConstantLaw(np.array([STIFFNESS]), np.array([5.0])))
    (prepared_record,) = prepare(Dataset(RIG, (dataclasses.replace(record, rig=RIG),)))
    faults = gap_faults(update_from(RIG, [prepared_record if probes else prepared_record.without_probes()]))
    assert [fault.factor for fault in faults] == ([pytest.approx(gap_factor, rel=0.15)] if said else [])


@pytest.mark.slow
@pytest.mark.parametrize(("factor", "words"), [(1 / 3, "small"), (3.0, "large")])
def test_gap_told_wrong_without_probes(sound, factor, words):
    wrong = with_rig(sound, gap(factor))
    (fault,) = diagnosed(Dataset(wrong.rig, (with_channel(wrong.records[0], *PROBE, None),))).faults
    assert f"too {words} in the rig file" in fault.cause
    assert fault.factor == pytest.approx(1 / factor, rel=0.3)


def test_a_channel_that_cannot_be_used_is_refused(sound):
    with pytest.raises(RecordError, match="excitation is constant"):
        diagnosed(scaled(sound, (100, "acceleration"), 0.0))


@pytest.mark.slow
def test_a_record_that_is_loud_from_the_start_has_no_fault(sound):
    push = excitation.random(4.0, 512.0, (5.0, 100.0), rms=8.0, seed=1)
    record, _ = record_of(RIG, push, ConstantLaw(np.array([STIFFNESS]), np.array([5.0])))
    assert diagnosed(Dataset(RIG, (record,))).words == ()


@pytest.mark.slow
@pytest.mark.parametrize(("rig", "cause", "value"), [
    (longer(RIG, 1.1, "length"), "beam.length is {} m", 0.6),
    (longer(RIG, 1.1, "lengths"), "beam.length is {} m", 0.6),
    (beam(diameter=0.0092), "beam.diameter is {} m", 0.008),
])  # fmt: skip
def test_wrong_rig_file(sound, rig, cause, value):
    (fault,) = diagnosed(with_rig(sound, rig)).faults
    match = re.match(re.escape(cause).replace(r"\{\}", "([0-9.]+)"), fault.cause)
    assert match
    assert float(match[1]) == pytest.approx(value, rel=0.02)  # the modulus, known to 3 %, is 2.4 % off


def test_correction_moves_samples_between_channels(sound):
    (record,) = prepare(sound)
    (corrected,) = ChannelCorrection({0: (2, -1.0), 2: (0, 0.5)}).applied([record])
    before, after = record.response().acceleration, corrected.response().acceleration
    np.testing.assert_array_equal(after, [-before[2], before[1], 0.5 * before[0], before[3]])


GAINS = [(1.03, 1.0), (-0.9, -1.0), (0.11, 1 / 9.80665), (-1100.0, -1e3), (2.0344, 2.03)]


@pytest.mark.parametrize(("gain", "read"), GAINS)
def test_gains_near_a_unit_are_that_units(gain, read):
    assert nearest_unit_gain(gain, "accelerometer") == read


@dataclasses.dataclass
class Force:
    displacement: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    valid: np.ndarray


@pytest.mark.parametrize("walls", [(1e-4, 1e-4), (1e-4, 3e-4), (4e-4, 1.5e-4), (np.inf, 2e-4), (np.inf, np.inf)])
def test_restoring_force_bends_at_each_wall(walls):
    """F = k x + c v + k_c p(x), p beyond the walls upwards and downwards."""
    t = np.linspace(0, 20, 40_000)
    x = 6e-4 * t / 20 * np.sin(2 * np.pi * 7 * t)
    v = np.gradient(x, t)
    f = 4e3 * x + 3 * v + 1e4 * (np.maximum(x - walls[0], 0) - np.maximum(-x - walls[1], 0))
    f += 0.02 * f.std() * np.random.default_rng(0).standard_normal(t.size)
    bends = bends_of(Force(x[None], v[None], f[None], np.ones(t.size, dtype=bool)), 0)
    assert bends == pytest.approx(walls, rel=0.1)  # the grid's step is 12 %


def late(value):
    return np.concatenate((np.zeros(2), value))[: value.size]


def rounded(value):
    """Clipped, then filtered: no flat top is left."""
    return np.convolve(np.clip(value, -value.std(), value.std()), np.ones(5) / 5, "same")


def fast(value):
    """Sampled by another logger, whose clock is 0.1 % too fast and began at the same instant."""
    at = np.arange(value.size)
    return CubicSpline(at, value)(at / 1.001)


@pytest.mark.parametrize(("damage", "words"), [
    (fast, "accelerometer 3:+Z has a clock of its own, 0.1 % too fast"),
    (late, "accelerometer 3:+Z is late by 3.9 ms"),  # two samples
    pytest.param(lambda value: value[::-1].copy(), "accelerometer 3:+Z holds noise or another signal",
                 marks=pytest.mark.slow),
    pytest.param(rounded, "accelerometer 3:+Z follows the others in part only", marks=pytest.mark.slow),
])  # fmt: skip
def test_likeliest_cause_of_a_channel_that_no_factor_explains(sound, damage, words):
    damaged = Dataset(RIG, (with_channel(sound.records[0], 3, "acceleration", damage),))
    assert describe_signal_fault(Assessment(update_rig(damaged, as_drawn=True))).startswith(words)


def test_a_base_channel_of_the_wrong_sign_is_named_as_such_where_accelerometers_are_few(sound):
    """Four of them and no probe: no noise and no other signal, though no correction of a single channel is sure."""
    few = RIG.replace(sensors=RIG.sensors[:4])
    kept = [c for c in sound.records[0].channels if c.quantity == "acceleration"]
    record = dataclasses.replace(sound.records[0], rig=few, channels=kept)
    turned = Dataset(few, (with_channel(record, 100, "acceleration", np.negative),))
    assessment = Assessment(update_rig(turned, as_drawn=True))
    assert describe_signal_fault(assessment).startswith("excitation has the wrong sign (likeness -")
