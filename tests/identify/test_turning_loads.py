"""What turns with a shaft: unbalance, bend and coupling against Jeffcott's rotor, dry whirl, a speed that creeps."""

import dataclasses
import math

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.identify.forces.turning_loads import find_turning_loads
from clearance_mj.identify.records.dry_whirl import without_dry_whirl
from clearance_mj.identify.records.prepared import prepare_turning, prepared
from clearance_mj.io.channels import Channel
from clearance_mj.io.dataset import Dataset, Record
from clearance_mj.rig import Bushing, Contact, Grease, Rig, Sensor, Shaker, Spin, Unbalance
from clearance_mj.signals.keyphasor import turning_of_pulses
from clearance_mj.structure import Disc, Material, Section, Shaft, Support

from ..study.turning_rig import FS, keyphasor

LENGTH, MASS, ETA, GAP = 1.0, 4.0, 20.0, 4e-4
SHAFT = Shaft(
    (Section(LENGTH, diameter=(0.025, 0.025)),), (Support(0.0, "pinned"), Support(LENGTH, "pinned")),
    material=Material(2.1e11, 1e-3), discs=(Disc(LENGTH / 2, MASS),), rayleigh=(ETA, 0.0),
)  # fmt: skip
"""Without mass of its own"""
NATURAL = math.sqrt(48 * 2.1e11 * math.pi * 0.025**4 / 64 / LENGTH**3 / MASS)
PLACES = 0.2, 0.35, 0.5, 0.75
RIG = Rig(
    "jeffcott", None, (Bushing(0.6, GAP, length=0.0, contact=Contact(1e5), grease=Grease(0.0), shape="round"),),
    tuple(Sensor(i, x, direction=axis) for i, x in enumerate(PLACES, 1) for axis in ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))),
    structure=SHAFT, shaker=Shaker("base"), spin=Spin(60.0), unbalances=(Unbalance(0.5, 1e-4),),
)  # fmt: skip
MOMENT, PHASE = 2.5e-4, 0.8
BOW = 2e-5 * np.exp(2.1j)
FORWARD, BACKWARD = 4e-6 * np.exp(0.3j), 1.5e-6 * np.exp(-1.2j)
RUN_OUT = 7e-6 * np.exp(1.0j)


def shape(x):
    """Static deflection of a pinned shaft under a force in the middle, over that in the middle."""
    x = np.minimum(x, LENGTH - x) / LENGTH
    return 3 * x - 4 * x**3


def bent(x):
    """Static deflection of a pinned shaft under a moment on its end x = 0, over that in the middle."""
    return x * (LENGTH - x) * (2 * LENGTH - x) / (0.375 * LENGTH**3)


def gain(speed, times=1):
    """Of a force k u on the disc: 1/(1 - r² + 2iζr), r = ω/ω₀."""
    r = times * speed / NATURAL
    return 1 / (1 - r**2 + 1j * r * ETA / NATURAL)


def whirl(spin, angle, place, bow=0.0, coupling=(0.0, 0.0)):
    """y + i z at a place, of once and of twice per turn: of the disc (e r² + b)/(1 - r² + 2iζr) e^(iφ).

    Nicholas, Gunter & Allaire, J. Eng. Power 98, 1976, with e = moment/mass, and the bow's shape that of a force on the
    disc. A coupling's moment bends the shaft at rest, by u at the disc; the rest of the motion is of the disc's force.
    """
    unbalance = MOMENT / MASS * (spin / NATURAL) ** 2 * np.exp(1j * PHASE)
    once = shape(place) * (unbalance + bow) * gain(spin) * np.exp(1j * angle)
    ways = zip(coupling, (spin, -spin), (2j, -2j))
    return once, sum(u * (bent(place) + shape(place) * (gain(s, 2) - 1)) * np.exp(k * angle) for u, s, k in ways)


def record(name, speed, seed, **loads):
    spin, time = Spin(speed), np.arange(round(8 * FS)) / FS
    angle, rng = spin.angle_at(time), np.random.default_rng(seed)
    signals = []
    for node, place in enumerate(PLACES, 1):
        once, twice = whirl(speed, angle, place, **loads)
        read = -(speed**2) * (once + 4 * twice)
        signals += [(node, "+Y", "acceleration", read.real), (node, "+Z", "acceleration", read.imag)]
    seen = sum(whirl(speed, angle, 0.6, **loads)) + RUN_OUT * np.exp(1j * angle)
    signals += [(*label.split(":"), "displacement", x) for label, x in zip(RIG.probe_labels, (seen.real, seen.imag))]
    noisy = [(*at, x + 0.01 * np.std(x) * rng.standard_normal(x.size)) for *at, x in signals]
    noisy.append((400, "S", "unknown", keyphasor(angle)))
    units = {"unknown": "V"}
    channels = [Channel(f"{at}{way}", int(at), way, of, x, FS, unit=units.get(of, "")) for at, way, of, x in noisy]
    return Record(name, "identify", RIG, FS, channels, "spin", "", None, None, None, {}, None, spin)


def identified_loads(**loads):
    speeds = 0.05, 0.35, 0.6, 0.8, 1.3
    records = [record(f"at_{ratio:g}", ratio * NATURAL, i, **loads) for i, ratio in enumerate(speeds)]
    turning = prepare_turning(Dataset(RIG, tuple(records)))
    loads = find_turning_loads(RIG, turning, {})
    return loads, dict(zip(loads.estimates.names, zip(loads.estimates.value, loads.estimates.varied_std))), turning


def test_a_straight_shaft_has_its_unbalance_alone():
    loads, estimates, _ = identified_loads()
    assert loads.warnings == () and loads.rig.orders == ()
    (moment, moment_std), (phase, std) = estimates["unbalances[0].moment"], estimates["unbalances[0].phase"]
    assert moment == pytest.approx(MOMENT, rel=5e-3) and abs(math.log(moment / MOMENT)) < 3 * moment_std < 0.1
    assert phase == pytest.approx(PHASE, abs=5e-3) and abs(phase - PHASE) < 3 * std < 0.1
    assert set(estimates) == {"unbalances[0].moment", "unbalances[0].phase"}


def test_a_bent_shaft_is_told_from_run_out():
    loads, estimates, turning = identified_loads(bow=BOW)
    (words,) = loads.warnings
    assert "is bent" in words and "20" in words
    assert estimates["bend of the shaft"][0] == pytest.approx(abs(BOW), rel=0.02)
    assert estimates["phase of the bend of the shaft"][0] == pytest.approx(np.angle(BOW), abs=0.02)
    assert loads.rig.unbalances[0].moment == pytest.approx(MOMENT, rel=0.02)
    assert loads.rig.unbalances[0].phase == pytest.approx(PHASE, abs=0.02)
    assert abs(math.log(loads.rig.unbalances[0].moment / MOMENT)) < 3 * estimates["unbalances[0].moment"][1]
    fast = loads.with_slow_roll_restored(turning[-1], {})
    once, _ = whirl(1.3 * NATURAL, fast.turning.angle, 0.6, bow=BOW)
    moved = fast.displacement[0] + 1j * fast.displacement[1]
    assert np.std(moved - once) < 0.03 * np.std(moved)


def test_a_coupling_comes_twice_per_turn_both_ways_round():
    loads, estimates, _ = identified_loads(coupling=(FORWARD, BACKWARD))
    assert ["twice per turn" in words for words in loads.warnings] == [True, True]
    for way, true in (("with", FORWARD), ("against", BACKWARD)):
        model = cm.linear_model(loads.rig)
        orders = [order for order in loads.rig.orders if order.order == (2.0 if way == "with" else -2.0)]
        forces = [order.force * np.exp(1j * order.phase) for order in orders]
        middle = (model.static_deflection([0.5], model.shapes([order.position for order in orders])) @ forces)[0]
        assert abs(middle - true) < 0.02 * abs(FORWARD)
        assert f"bend twice per turn, {way} the spin" in estimates
    assert [order.order for order in loads.rig.orders] == [2.0, 2.0, -2.0, -2.0]
    assert loads.rig.unbalances[0].moment == pytest.approx(MOMENT, rel=0.01)


WHIRLS = [(-1, 1.1, True), (1, 1.1, False), (-1, 0.3, False), (0, 1.1, False)]


@pytest.mark.parametrize(("turns", "size", "informative"), WHIRLS)
def test_dry_whirl_goes_backwards_round_the_wall(turns, size, informative):
    """Forwards, well within the gap, or to and fro along a line it is none. Two seconds of eight whirl here."""
    whole = prepared(record("any", 60.0, 1))
    time = np.arange(len(whole.signals)) / FS
    angle = 2 * np.pi * 30 * time
    moved = size * GAP * (np.exp(1j * turns * angle) if turns else np.exp(0.4j) * np.cos(angle)) * (time > 6)
    signals = whole.signals.copy()
    signals[:, -3:-1] = np.column_stack((moved.real, moved.imag))
    whole = dataclasses.replace(whole, signals=signals)
    left = without_dry_whirl(whole)
    if informative:
        assert 4.8 < left.duration < 6 and np.array_equal(left.signals, signals[: len(left.signals)])
        assert without_dry_whirl(whole.part(slice(round(4 * FS), None))) is None
    else:
        assert left is whole


@pytest.mark.parametrize("creep", [0.0, 0.016, -0.01])
def test_a_speed_that_creeps(creep):
    """Of 60 rad/s at 0 s, by a share in ten seconds: rate 60 × share / 10."""
    time = np.arange(round(10 * FS)) / FS
    turning = turning_of_pulses(keyphasor(60 * time + 0.5 * 6 * creep * time**2), FS)
    first, last = turning.marks[[0, -1]]
    assert turning.drift == pytest.approx(6 * creep * (last - first) / (60 + 3 * creep * (first + last)), abs=5e-5)
    speed, rate = turning.steady_or_creeping
    assert rate == pytest.approx(6 * creep, abs=2e-3) and speed == pytest.approx(60, rel=2e-4)


@pytest.mark.slow
@pytest.mark.parametrize("word", ["bend", "coupling"])
def test_on_foreign_physics(word, tmp_path):
    """Of a rotor that rubs: named, its size within 15 %, the unbalance within 2 %."""
    from experiments.benches.space.make import find_bench
    from experiments.benches.space.records import write_bench

    bench = find_bench(f"rotor-43-{word}")
    write_bench(bench, tmp_path, short=True, roles=("identify",))
    dataset = Dataset.load(tmp_path)
    update = cm.identify.update_rig(dataset, as_drawn=True)
    loads = find_turning_loads(update.rig, prepare_turning(dataset), update.values, update.drawn)
    assert {"bend": "is bent", "coupling": "twice per turn"}[word] in loads.warnings[0]
    (true,) = bench.unbalances
    assert loads.rig.unbalances[0].moment == pytest.approx(true.moment, rel=0.02)
    if word == "bend":
        assert loads.estimates.value[2] == pytest.approx(bench.structure.bends[0].size, rel=0.15)
