"""What a bench has and its rig file does not draw: hypotheses, how they are found on foreign physics, their words."""

import dataclasses

import numpy as np
import pytest

from clearance_mj.clearance import ContactLaw, KelvinVoigt
from clearance_mj.engines import simulate
from clearance_mj.identify import update_rig
from clearance_mj.identify.laws.case import ClearanceWithLaw
from clearance_mj.identify.laws.forces_in_lanes import BushingMotion, law_forces
from clearance_mj.identify.records.prepared import prepare
from clearance_mj.identify.structure.accepted_parts import Accepted
from clearance_mj.identify.structure.hypotheses.candidate import HYPOTHESES, Bench
from clearance_mj.identify.structure.priors import priors, rig_with
from clearance_mj.identify.structure.rig_fit import RigFit
from clearance_mj.identify.structure.spectra import ChannelSpectra, complex_frequency, complex_spectra, flank_spectra
from clearance_mj.io.dataset import Dataset, Record
from clearance_mj.rig import Rig
from clearance_mj.signals import excitation
from clearance_mj.structure.attached import FixtureMode, Oscillator
from clearance_mj.structure.beam import Clamp
from experiments.benches.bench import make_bench
from experiments.benches.records import measure_channels, plans
from experiments.benches.structure import CLASSES, HARD
from experiments.benches.structures import HYPOTHESIS
from experiments.testrig.records import FS

from ..conftest import TABLE1
from .records import noisy

BENCH = Bench(TABLE1, (5.0, 300.0), True, FS, (100.0,))


def test_every_class_of_the_benches_has_a_hypothesis():
    """But for a support, which is no class of benches: it is the rig file that says too much."""
    assert {HYPOTHESIS[name] for name in (*CLASSES, *HARD)} == set(HYPOTHESES) - {"support"}


@pytest.mark.parametrize("name", HYPOTHESES)
def test_candidates_are_rigs_with_open_parameters_that_a_file_can_hold(name, tmp_path):
    before = {p.name for p in priors(TABLE1, 300.0, True)}
    for candidate in HYPOTHESES[name].candidates(BENCH):
        rig = candidate.make(1.0)
        rig.save(tmp_path / "rig.toml")
        assert Rig.load(tmp_path / "rig.toml") == rig
        opened = [p for p in priors(rig, 300.0, True) if p.name not in before]
        assert opened
        further = {p.name: p.from_varied(p.to_varied(p.start) + 0.1 * p.prior_std) for p in opened}
        moved = rig_with(rig, {p.name: float(np.clip(further[p.name], p.low, p.high)) for p in opened})
        assert candidate.words(moved) != candidate.words(rig)


@pytest.mark.parametrize("name", ["fixture", "rocking"])
def test_modes_are_tried_and_found_where_the_records_have_lines_alone(name):
    """At 1 kHz a mode at 608 Hz had the most evidence, above the Nyquist frequency."""
    rig = TABLE1.replace(fixture=(FixtureMode(390.0, 0.02, 0.5),))
    base = excitation.random(2.0, 1000.0, (5.0, 480.0), 2.0, 1)
    fit = RigFit(rig, prepare(Dataset(rig, (noisy(rig, simulate(rig, base, engine="modal")),), "bench")))
    assert fit.band[1] <= 400.0  # 0.4 of the sampling rate
    (frequency,) = (p for p in fit.problem.parameters if p.name == "fixture[0].frequency")
    assert (frequency.high, fit.band[0] <= frequency.low) == (fit.band[1], True)
    tried = [c.make(1.0).fixture[0].frequency for c in HYPOTHESES[name].candidates(BENCH)]
    assert BENCH.band[0] <= min(tried) and max(tried) == pytest.approx(BENCH.band[1])


def test_a_mode_beyond_the_records_has_no_frequency_in_words():
    clamp = Clamp(translation=4e6, mass=0.4)  # 503 Hz
    (words,) = {c.words(TABLE1.replace(beam=dataclasses.replace(TABLE1.beam, clamp=clamp)))
                for c in HYPOTHESES["clamp"].candidates(BENCH)}  # fmt: skip
    assert words.endswith("0.4 kg on 4e+06 N/m (above 300 Hz, where the records end)")


@pytest.mark.parametrize(("rms", "touches"), [(0.2, False), (8.0, True)])
def test_lines_beyond_the_excitation_count_if_impacts_reach_there(rms, touches):
    base = excitation.random(4.0, FS, (5.0, 220.0), rms, 1)
    (record,) = prepare(Dataset(TABLE1, (noisy(TABLE1, simulate(TABLE1, base, engine="modal")),), "bench"))
    assert ChannelSpectra(record).frequency[-1] == pytest.approx(297.0 if touches else 220.0, abs=0.5)


def test_what_flanks_add_to_a_windowed_motion():
    """The transform of (f y)¨ is s² that of f y, and (f y)¨ = f ÿ + 2 ḟ ẏ + f̈ y."""
    fs, decay, omega = 2048.0, 0.4, 2 * np.pi * np.array([5.0, 40.0])
    motion = np.exp((1j * omega - decay) * (np.arange(8192)[:, None] / fs))  # goes on where the record ends
    histories = motion.real, ((1j * omega - decay) ** 2 * motion).real
    (frequency, of_motion), (_, of_acceleration) = (complex_spectra(y, fs, (3.0, 60.0), 500) for y in histories)
    s = 1j * complex_frequency(frequency, 4.0)[:, None]
    added = flank_spectra(motion.real, fs, frequency)
    np.testing.assert_allclose(of_acceleration + added, s**2 * of_motion, atol=1e-4 * np.abs(s**2 * of_motion).max())


def test_a_shaft_s_places_open_a_bushing_s_length_and_degrees_of_freedom_do_not():
    of_lengths = {p.name: p for p in priors(TABLE1) if p.name.endswith(".length")}
    assert set(of_lengths) == {"bushings[0].length", "bushings[1].length"}
    length = of_lengths["bushings[0].length"]
    assert length.low == 0.0 and length.start == TABLE1.bushings[0].length
    assert rig_with(TABLE1, {length.name: 0.004}).bushings[0].length == 0.004


def test_contact_is_at_the_ends_of_the_length_that_a_bushing_has():
    """Ends of 4 mm in a motion that is known at 12 mm: a third of the way from the middle, by hand."""
    time = np.arange(4000) / 4096.0
    middle = 4e-4 * np.sin(2 * np.pi * 20 * time)
    x = middle[:, None] * (1.0, 0.9, 1.1)
    path = BushingMotion(
        x[:, :, None], np.gradient(x, time, axis=0)[:, :, None], np.zeros(time.size), 1 / 4096.0, 0.012
    )
    law = ContactLaw([KelvinVoigt(1e4)], [dataclasses.replace(TABLE1.bushings[0].grease, stiffness=1e-9, damping=0.0)])
    bushing = dataclasses.replace(TABLE1.bushings[0], gap=3e-4, length=0.004)
    (force,) = law_forces([path], np.array([0.0, 1.0, 0.0]), 1, [ClearanceWithLaw(bushing, law)]).T
    by_hand = np.zeros(time.size)
    for lever in (1 - 0.1 / 3, 1 + 0.1 / 3):
        place = lever * middle
        by_hand += 0.5e4 * np.sign(place) * np.maximum(np.abs(place) - 3e-4, 0)
    np.testing.assert_allclose(force, by_hand, atol=1e-6 * np.abs(by_hand).max())


def test_an_arm_that_a_rig_file_has_is_open():
    rig = TABLE1.replace(oscillators=(Oscillator(0.7, 0.02, 120.0, 0.01, -0.1), Oscillator(0.3, 0.02, 80.0)))
    assert [p.name for p in priors(rig) if p.name.endswith(".lever")] == ["oscillators[0].lever"]


def test_rivals_are_said_with_the_measurement_that_tells_them_apart():
    one = Accepted("mass", "a mass of 0.06 kg near x = 0.87 m", 40.0, 12.0, ("a clamp with a mode of its own",), "")
    assert str(one).endswith("near x = 0.87 m; a clamp with a mode of its own explains them about as well")
    apart = dataclasses.replace(one, apart="an accelerometer on the clamp")
    assert str(apart).endswith("about as well, an accelerometer on the clamp would tell which")


def recorded(bench):
    """The ramp and the hits of a bench, of half their length."""
    records = []
    for i, (name, role, base, words, _) in enumerate(plans(bench, short=True)):
        if role == "identify":
            channels = measure_channels(bench, base.value, np.random.default_rng((bench.seed, i)))
            records.append(Record(name, role, bench.rig, FS, channels, description=words, band=base.band))
    return Dataset(bench.rig, tuple(records))


BENCH_SEEDS = [("housing", 41), ("mass", 11), ("spring", 205), pytest.param("clamp", 41, marks=pytest.mark.release)]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seed"), BENCH_SEEDS)
def test_a_structure_is_found_on_foreign_physics_and_its_numbers_are_right(name, seed):
    """The mass of seed 41 is 2 cm from a bushing: what it does is a force there, which is unknown anyway."""
    bench = make_bench(seed, structure=(name,))
    update = update_rig(recorded(bench))
    (one,) = update.structure.accepted
    assert one.name == name and one.confirmed > 0
    rig, real = update.rig, bench.structure
    if name == "housing":
        stiffness = [housing.stiffness for housing in real.housings]
        assert [b.housing.stiffness for b in rig.bushings] == pytest.approx(stiffness, rel=0.1)
    elif name == "spring":
        assert len(real.springs) == len(rig.springs) == 1
        ((place, stiffness, damping),) = real.springs
        (spring,) = rig.springs
        assert spring.position == pytest.approx(place, abs=0.01)
        assert (spring.stiffness, spring.damping) == pytest.approx((stiffness, damping), rel=0.1)
    elif name == "mass":
        assert rig.masses[-1].mass == pytest.approx(real.masses[0][1], rel=0.15)
    else:
        assert rig.beam.clamp.mass == pytest.approx(real.clamp.mass, rel=0.15)
    if name not in ("mass", "spring"):  # as drawn, wrong numbers make good for most of a mass
        before, after = (
            max(m.relative_error.max() for m in part) for part in (update.structure.as_drawn, update.misfit)
        )
        assert after < 0.6 * before


@pytest.mark.slow
def test_a_mode_without_a_name_is_found_where_it_is():
    """An elastic strip as finite elements; what does not bend of it is a mass."""
    bench = make_bench(26, structure=("strip",))
    (strip,) = bench.structure.strips
    update = update_rig(recorded(bench))
    assert [one.name for one in update.structure.accepted] == ["oscillator", "mass"]
    (hung,) = update.rig.oscillators
    assert hung.frequency == pytest.approx(strip.frequency, rel=0.01)
    assert hung.position == pytest.approx(strip.place, abs=0.01)
    assert hung.lever == pytest.approx(0.726 * strip.length, rel=0.1)  # of a cantilever's first mode
    assert hung.mass == pytest.approx(0.613 * strip.mass, rel=0.2)
    assert "a mode at 113" in update.structure.accepted[0].words


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "fs", "highest", "levels"), [
    (41, FS, 220.0, (0.1, 0.2)),  # nothing touches
    (42, FS, 220.0, (1.0, 5.0)),
    (43, 1000.0, 450.0, (1.0, 2.0, 4.0, 8.0)),
    (44, 1000.0, 220.0, (2.0, 8.0)),
    (45, FS, 500.0, (1.0, 4.0)),
])  # fmt: skip
def test_sound_benches_give_no_name(seed, fs, highest, levels):
    bench, records = make_bench(seed), []
    for i, level in enumerate(levels):
        base = excitation.random(8.0, fs, (5.0, highest), level, i)
        channels = measure_channels(bench, base.value, np.random.default_rng((seed, i)), fs)
        records.append(Record(f"level_{level:g}", "identify", bench.rig, fs, channels, band=base.band))
    assert update_rig(Dataset(bench.rig, tuple(records))).structure.accepted == ()


@pytest.mark.slow
def test_hits_on_a_sound_bench_give_no_name():
    assert update_rig(recorded(make_bench(41))).structure.accepted == ()
