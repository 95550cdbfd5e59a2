"""Clearances from orbits alone, on records of the library's own engine and on a foreign bench; the twin on orbits."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj import Bushing, Contact, Grease, Rig, Sensor
from clearance_mj.clearance.contacts.hunt_crossley_1975 import HuntCrossley1975
from clearance_mj.core.errors import RecordError
from clearance_mj.estimate import Parameter
from clearance_mj.identify.in_operation.problem import law_parameters, places_of
from clearance_mj.io.channels import Channel
from clearance_mj.io.dataset import Record
from clearance_mj.model import Model
from clearance_mj.rig import OilFilm, Spin, Unbalance
from clearance_mj.structure import Disc, Material, Section, Shaft, Support

from ..refusals import assert_refused

FS = 1024.0
STEEL = Material(2.1e11, 7800.0)
GAP, CONTACT = 2e-4, 1e6
SLOW, MIDDLE = Spin(20.0), Spin(90.0)
RUN_UP = Spin(90.0, 15.0, 180.0)


def rotor(gap=GAP, unbalance=1e-4, offset=0.0):
    """A disc of 3 kg on a shaft of 20 mm, in an empty bushing; its critical speed is at 125 rad/s."""
    pins = Support(0.0, "pinned"), Support(1.0, "pinned")
    shaft = Shaft((Section(1.0, (0.02, 0.02)),), pins, (Disc(0.35, 3.0, 0.01),), STEEL, (12.0, 0.0))
    bushing = Bushing(0.6, gap, 0.0, Grease(0.0, 1.0), Contact(CONTACT, 50.0), offset=offset, shape="round")
    return Rig("rotor", None, (bushing,), (Sensor(1, 0.35),), structure=shaft, spin=MIDDLE,
               unbalances=(Unbalance(0.35, unbalance, 0.5),))  # fmt: skip


def recorded(name, rig, spin, seconds=8.0, noise=2e-7, nominal=None, law=None):
    """What probes and keyphasor show of the rig, simulated by the library; its run-out is 3 µm."""
    turning = rig.replace(spin=spin)
    lead = 0.0 if spin.rate else 4.0
    still = cm.excitation.still(seconds + lead, FS)
    moved = cm.simulate(turning, still, law, engine="modal").displacement[:, round(lead * FS) :]
    time = np.arange(moved.shape[1]) / FS
    angle = spin.angle_at(time + lead)
    rng = np.random.default_rng(len(name))
    run_out = 3e-6 * np.array([np.cos(angle), np.cos(angle - np.pi / 2)])
    shown = moved + run_out + noise * rng.standard_normal((2, time.size))
    pulses = 5.0 * (np.cos(angle + np.pi / 3) > 0.5)
    channels = [Channel(f"probe {way}", 301, f"+{way}", "displacement", value, FS) for way, value in zip("YZ", shown)]
    channels.append(Channel("keyphasor", 400, "S", "unknown", pulses, FS, unit="V"))
    return Record(name, "orbit", nominal or rig, FS, channels, "spin", spin=spin)


@pytest.fixture(scope="module")
def rubbing():
    """Records of a rotor whose file has a gap that is 15 % too wide, and two examples."""
    drawn = rotor(1.15 * GAP)
    soft = dataclasses.replace(drawn.bushings[0], contact=Contact(0.3 * CONTACT, 50.0))
    examples = "bushings.contact.stiffness", "structure.material.density"
    drawn = drawn.replace(bushings=(soft,), examples=examples)
    plan = ("slow", SLOW, 3.5), ("middle", MIDDLE, 3.5), ("run_up", RUN_UP, 6.5)
    return [recorded(name, rotor(), spin, seconds, nominal=drawn) for name, spin, seconds in plan]


@pytest.fixture(scope="module")
def known_gaps(rubbing):
    return cm.identify.orbits(rubbing)


def test_a_gap_that_is_met_is_found_with_an_interval_that_holds(known_gaps):
    (clearance,) = known_gaps.clearances
    assert clearance.seen and clearance.touches
    assert clearance.gap == pytest.approx(GAP, rel=0.03)
    low, high = clearance.interval
    assert low < GAP < high < 1.2 * low and known_gaps.rig.bushings[0].gap == clearance.gap
    assert clearance.contact == "linear"
    np.testing.assert_allclose(clearance.rest, 0.0, atol=1e-5)


@pytest.mark.slow
def test_a_wall_of_which_one_side_is_met_tells_the_gap_and_the_middle():
    """Of a wall met along n alone, only the gap less the middle's distance along n is told: a long valley."""
    real, drawn = rotor(unbalance=6e-5, offset=-0.75 * GAP), rotor(1.15 * GAP, 6e-5, -0.6 * GAP)
    records = [recorded(*which, nominal=drawn) for which in (("slow", real, SLOW, 3.5), ("run_up", real, RUN_UP, 6.5))]
    (clearance,) = cm.identify.orbits(records).clearances
    low, high = clearance.interval
    assert low < GAP < high and clearance.gap == pytest.approx(GAP, rel=0.02)
    np.testing.assert_allclose(clearance.rest, (0.0, -0.75 * GAP), atol=4e-6)
    assert clearance.gap - np.hypot(*clearance.rest) == pytest.approx(0.25 * GAP, rel=0.02)
    assert clearance.arc < np.pi
    assert "hardly tells the gap and its middle apart" in clearance.words


@pytest.mark.slow
def test_a_contact_that_is_not_linear_is_found_with_its_exponent(tmp_path):
    """Of Hertz's exponent, 5 % of the gap deep at most; taken for a linear one, the gap is 1.1 % too large."""
    depth = 0.05 * GAP
    stiffness = 0.3 * CONTACT * depth / depth**1.5
    drawn, law = rotor(1.15 * GAP), cm.ContactLaw(HuntCrossley1975(stiffness, 0.5 * stiffness, 1.5))
    plan = ("slow", SLOW, 3.5), ("middle", MIDDLE, 3.5), ("run_up", RUN_UP, 6.5)
    fit = cm.identify.orbits([recorded(n, rotor(), spin, s, nominal=drawn, law=law) for n, spin, s in plan])
    (clearance,) = fit.clearances
    assert clearance.contact == "power law" and clearance.gap == pytest.approx(GAP, rel=0.005)
    assert clearance.contact_model.force(depth, 0.0) == pytest.approx(0.3 * CONTACT * depth, rel=0.1)
    fit.save(tmp_path)
    assert Model.load(tmp_path).law == fit.model.law


def test_a_found_unbalance_is_the_one_that_acts(known_gaps):
    values = dict(zip(known_gaps.estimates.names, known_gaps.estimates.value))
    along, across = (values[f"unbalances[0] {part} the mark"] for part in ("along", "across"))
    # The mark passes where the pulses rise, which the records' angle begins at.
    assert np.hypot(along, across) == pytest.approx(1e-4, rel=0.05)


def test_the_rig_that_is_saved_predicts_with_what_was_found(known_gaps, tmp_path):
    """Contact and unbalance, too: its file had contact at 0.3 of what it is, and no angle from the keyphasor's mark."""
    known_gaps.save(tmp_path)
    rig = Rig.load(tmp_path / "rig.toml")
    assert rig.bushings[0].contact.stiffness == pytest.approx(CONTACT, rel=0.1)
    (unbalance,) = rig.unbalances
    assert unbalance.moment == pytest.approx(1e-4, rel=0.05)
    # Pulses rise where cos(angle + π/3) passes 0.5, at -2π/3: the mark. Half a sample is 0.04 rad of a turn.
    assert unbalance.phase == pytest.approx(0.5 - 2 * np.pi / 3, abs=0.05)
    assert rig.structure.supports[0].kind == "elastic"


@pytest.mark.slow
def test_a_rig_file_without_spin_and_unbalance_gets_both(rubbing):
    """An unbalance acts on a shaft that turns: of a file that says of no speed, that of the fastest record is taken."""
    plain = rotor(1.15 * GAP).replace(unbalances=(), spin=None)
    rig = cm.identify.orbits([dataclasses.replace(record, rig=plain) for record in rubbing]).rig
    assert rig.spin == RUN_UP and rig.unbalances[0].moment == pytest.approx(1e-4, rel=0.05)


def test_examples_that_the_orbits_do_not_tell_stay_and_are_said(known_gaps):
    assert known_gaps.rig.examples == ("structure.material.density",)
    assert known_gaps.warnings[-1].startswith("of the rig file, 1 number is an example that nobody gave")


def test_results_are_words_rows_and_a_figure(known_gaps, tmp_path):
    assert known_gaps.words()[0].startswith("bushings[0]: gap ") or "gap " in known_gaps.words()[0]
    assert known_gaps.rows()[0]["seen"] is True
    known_gaps.save(tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["law.json", "orbits.json", "rig.toml"]
    assert len(known_gaps.plot().axes) == 1


def test_a_gap_that_is_never_met_is_not_seen_and_is_wider_than_the_motion():
    records = [recorded("slow", rotor(), SLOW, 3.5), recorded("middle", rotor(), MIDDLE, 3.5)]
    (clearance,) = cm.identify.orbits(records).clearances
    assert not clearance.seen and not clearance.touches
    assert 0 < clearance.at_least < GAP and clearance.interval == (clearance.at_least, np.inf)
    assert "not seen" in clearance.words


def test_without_contact_oil_alone_knows_where_the_wall_is():
    """Neither a hole's roundness nor friction shows then; a dry bushing shows its damper and the force at rest."""
    oil = dataclasses.replace(rotor().bushings[0], length=0.02, film=OilFilm(0.05), grease=Grease(0.0))
    left = {}
    for name, bushing in (("dry", rotor().bushings[0]), ("oil", oil)):
        (place,) = places_of(rotor().replace(bushings=(bushing,)))
        gap = Parameter("bushings[0].gap", "m", GAP, GAP / 2, 2 * GAP, 0.2)
        both = (law_parameters(place, [gap], (0.0, 0.0), True, 1.0, touching) for touching in (False, True))
        left[name], all_ = ({p.name.partition("].")[2] for p in parameters} for parameters in both)
        assert all_ > left[name] | {"contact stiffness", "friction", "out_of_round_y", "out_of_round_yz"}
    at_rest = {"force at rest y", "force at rest z"}
    assert left["oil"] == {"gap", "rest_y", "rest_z", "grease viscosity"} | at_rest
    assert not {"gap", "rest_y", "contact stiffness", "friction"} & left["dry"] and left["dry"] > at_rest


BEGINS = 12.0  # s, at which a rub begins


@pytest.fixture(scope="module")
def rub_begins():
    """A record that goes on with that of a narrower gap: its orbit of 13 µm meets a wall at 4 µm."""
    later = Spin(MIDDLE.speed, angle=MIDDLE.speed * BEGINS % (2 * np.pi))
    before, after = recorded("a", rotor(), MIDDLE, BEGINS), recorded("a", rotor(4e-6), later, BEGINS)
    pairs = zip(before.channels, after.channels)
    joined = [dataclasses.replace(c, value=np.concatenate((c.value, d.value))) for c, d in pairs]
    return Record("on", "orbit", before.rig, FS, joined, "spin", spin=MIDDLE)


def test_the_twin_sees_a_rub_within_seconds_of_its_onset(rub_begins, known_gaps):
    twin = cm.identify.follow_orbits(rub_begins, known_gaps)
    rubs = [a for a in twin.alarms if a.quantity == "rub"]
    assert len(rubs) == 1 and BEGINS < rubs[0].time < BEGINS + 3.0
    assert "rubs since" in str(rubs[0])
    gap, missed = twin.plot().axes
    assert (gap.get_title(loc="left"), gap.get_ylabel()) == ("bushing 1", "Gap (mm)")
    assert [(line.get_xdata()[0], line.get_linestyle()) for line in missed.lines[1:]] == [(rubs[0].time, "-")]
    assert twin.words()[0].startswith("bushings[0] at 24 s: gap 0.2 mm ± ") and twin.words()[0].endswith("% (95 %)")
    quiet = cm.identify.follow_orbits(recorded("a", rotor(), MIDDLE, BEGINS), known_gaps)
    assert not quiet.alarms and quiet.value("gap")[-1, 0] == pytest.approx(GAP, rel=0.05)


def test_the_command_follows_later_records(rubbing, rub_begins, known_gaps, tmp_path, monkeypatch, answer, refused):
    """No gap is found from them; what is found from the others is known here."""
    taken = []
    fake = lambda records, rig: taken.extend(r.name for r in records) or known_gaps  # noqa: E731
    monkeypatch.setattr("clearance_mj.cli.orbit_gaps.orbits", fake)
    later = dataclasses.replace(rub_begins, rig=rubbing[0].rig)
    cm.write_dataset(tmp_path / "machine", rubbing[0].rig, [*rubbing, later])
    result = answer("orbit-gaps", tmp_path / "machine", "--follow", "on", "--out", tmp_path / "out")
    assert taken == ["slow", "middle", "run_up"]
    assert result["clearances"][0]["gap"] == known_gaps.clearances[0].gap
    assert [words.split("since")[0] for words in result["alarms"]["on"] if "rubs" in words]
    written = sorted(p.name for p in (tmp_path / "out").glob("[!.]*"))
    assert written == ["followed_on.json", "followed_on.png", "law.json", "orbits.json", "orbits.png", "rig.toml"]
    assert "provenance" in json.loads((tmp_path / "out" / "law.json").read_text())
    error = refused("orbit-gaps", tmp_path / "machine", "--follow", "off", "--out", tmp_path / "out")
    assert "--follow off" in error and "has no such record; it has slow, middle, run_up, on" in error


def test_bad_input_is_refused_in_one_line(rubbing, known_gaps):
    rig = rotor()
    assert_refused(RecordError, "there are no records", cm.identify.orbits, [])
    assert_refused(RecordError, "has no bushings", cm.identify.orbits, rubbing, rig.replace(bushings=()))
    planar = rig.replace(spin=None, unbalances=(), sensors=(Sensor(1, 0.35),)).with_shape(None)
    assert_refused(RecordError, "moves in a plane and has no orbits", cm.identify.orbits, rubbing, planar)
    short = recorded("short", rig, MIDDLE, 1.0)
    assert_refused(RecordError, "orbits are looked at in windows", cm.identify.orbits, [short])
    still = [dataclasses.replace(c, value=0 * c.value) if c.quantity == "displacement" else c for c in short.channels]
    with pytest.raises(RecordError, match="no probe moves; needs orbits"):
        cm.identify.orbits([dataclasses.replace(short, channels=still)])
    assert_refused(RecordError, "a twin learns from", cm.identify.follow_orbits, short, known_gaps)


@pytest.mark.slow
def test_a_foreign_bench_whose_rotor_touches(tmp_path):
    from experiments.benches.space.bench import make_bench
    from experiments.benches.space.records import write_bench

    bench = make_bench(3, "rotor")
    write_bench(bench, tmp_path / "bench", roles=("identify", "orbit"), kinds=("spin",))
    (clearance,) = cm.identify.orbits(cm.Dataset.load(tmp_path / "bench")).clearances
    assert clearance.gap == pytest.approx(bench.holes[0].gap, rel=0.05)
    low, high = clearance.interval
    assert low < bench.holes[0].gap < high
