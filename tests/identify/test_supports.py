"""Supports that a rig file takes for rigid, and the records know better."""

import math

import pytest

import clearance_mj as cm
from clearance_mj.beam import natural_frequencies
from clearance_mj.identify.records.prepared import prepare
from clearance_mj.identify.structure.hypotheses.candidate import HYPOTHESES, Bench
from clearance_mj.identify.structure.priors import prepared_rig, priors
from clearance_mj.identify.structure.updating import rig_file_misfit
from clearance_mj.io.dataset import Dataset
from clearance_mj.rig import Bushing, Contact, Grease, Rig, Sensor, Tolerance
from clearance_mj.structure import Material, Section, Shaft, Support

from .records import noisy

PINS = Support(0.0, "pinned"), Support(0.6, "pinned")


def stepped(*supports, tolerances=()):
    sections, steel = (Section(0.36, 0.018), Section(0.24, 0.0144)), Material(210e9, 7850.0)
    shaft = Shaft(sections, supports, material=steel, rayleigh=(0.5, 1e-5))
    bushing = Bushing(0.33, 3e-4, 0.012, Grease(4e3, 3.0), Contact(1e4, 4.0))
    sensors = tuple(Sensor(i, x) for i, x in enumerate((0.08, 0.2, 0.33, 0.42, 0.5, 0.55), 1))
    return Rig("stepped", None, (bushing,), sensors, structure=shaft, tolerances=tolerances)


def of_supports(rig):
    return {p.name: p for p in priors(rig) if "supports" in p.name}


def test_pins_are_stiff_springs_within_decades():
    """So stiff at first that the lowest frequency of a slender shaft changes by less than 1 %."""
    opened = of_supports(stepped(*PINS))
    names = "translation", "translation_damping"
    assert set(opened) == {f"structure.supports[{i}].{name}" for i in (0, 1) for name in names}
    assert all(p.prior_std == pytest.approx(math.log(10)) for p in opened.values())
    rig = stepped(*PINS)
    assert natural_frequencies(prepared_rig(rig), 1) == pytest.approx(natural_frequencies(rig, 1), rel=0.01)


def test_a_clamp_of_a_shaft_may_turn():
    """Of a cantilever, whose tip rests on a spring: deflection and rotation of the root are open."""
    rig = stepped(Support(0.0, "clamped"), Support(0.6, translation=1e4))
    opened = of_supports(rig)
    assert "structure.supports[0].rotation" in opened and "structure.supports[1].translation_damping" not in opened
    assert natural_frequencies(prepared_rig(rig), 1) == pytest.approx(natural_frequencies(rig, 1), rel=0.02)


def test_a_clamp_on_springs_still_holds_the_twist():
    rig = stepped(Support(0.0, "clamped"))
    twisting = rig.replace(sensors=(*rig.sensors, Sensor(9, "@0.6:RX", mass=1e-3)))  # kg m²
    (support,) = prepared_rig(twisting).structure.supports
    assert support.kind == "elastic" and support.holds_twist
    assert prepared_rig(rig).structure.supports[0].twist is None


def test_exact_supports_stay_pins():
    rig = stepped(*PINS, tolerances=(Tolerance("structure.supports[1].translation", "0 %"),))
    assert [s.kind for s in prepared_rig(rig).structure.supports] == ["elastic", "pinned"]
    assert all("supports[0]" in name for name in of_supports(rig))


def test_each_support_that_is_said_to_be_exact_is_opened_alone():
    rig = stepped(*PINS, tolerances=(Tolerance("structure.supports.translation", "0 %"),))
    candidates = list(HYPOTHESES["support"].candidates(Bench(rig, (5.0, 300.0), False, 2048.0)))
    opened = [{name.partition("].")[0] for name in of_supports(candidate.make(1.0))} for candidate in candidates]
    assert opened == [{"structure.supports[0"}, {"structure.supports[1"}]
    words = candidates[1].words(stepped(PINS[0], Support(0.6, translation=4.5e5)))
    assert words == "the support at x = 0.6 m, which it says to be exact, gives (4.5e+05 N/m)"
    assert not list(HYPOTHESES["support"].candidates(Bench(stepped(*PINS), (5.0, 300.0), False, 2048.0)))


def test_a_clamp_that_is_said_to_be_exact_is_opened(rig):
    exact = rig.replace(tolerances=tuple(Tolerance(f"beam.clamp.{of}", "0 mm") for of in ("rotation", "translation")))
    (candidate,) = HYPOTHESES["support"].candidates(Bench(exact, (5.0, 300.0), False, 2048.0))
    assert not [p for p in priors(exact) if "clamp" in p.name]
    assert {"1/beam.clamp.rotation", "1/beam.clamp.translation"} <= {p.name for p in priors(candidate.make(1.0))}


def test_pins_that_are_pins_do_not_contradict_the_records():
    """A rig file that is exact misses what noise and modes beyond the band make of a channel, not springs for pins."""
    rig = stepped(*PINS)
    record = noisy(rig, cm.simulate(rig, cm.excitation.random(4.0, 2048.0, (5, 500), 2.0, 3), engine="modal"))
    assert rig_file_misfit(rig, prepare(Dataset(rig, (record,), "bench"))).max() < 0.06


@pytest.mark.slow
@pytest.mark.parametrize("exact", [False, True])
def test_soft_supports_are_found_and_nothing_is_invented(exact):
    """Pins that are said to be exact are named; else they made a mode of the fixture and a mass of 1 kg."""
    truth = [Support(x, translation=k, translation_damping=20.0) for x, k in ((0.0, 3e5), (0.6, 4.5e5))]
    drives = (cm.excitation.random(8.0, 2048.0, (5, 500), rms, seed) for seed, rms in ((1, 1.0), (2, 4.0)))
    tolerances = (Tolerance("structure.supports.translation", "0 %"),) if exact else ()
    drawn, built = stepped(*PINS, tolerances=tolerances), stepped(*truth)
    records = [noisy(drawn, cm.simulate(built, drive, engine="modal"), name=f"r{i}") for i, drive in enumerate(drives)]
    update = cm.identify.update_rig(Dataset(drawn, tuple(records), "bench"))
    assert [one.name for one in update.structure.accepted] == ["support"] * 2 * exact
    assert not update.rig.tolerances
    for support, true in zip(update.rig.structure.supports, truth):
        assert support.translation == pytest.approx(true.translation, rel=0.2)
        assert support.translation_damping == pytest.approx(true.translation_damping, rel=0.5)
    moved = [a.position - b.position for a, b in zip(update.rig.sensors, drawn.sensors)]
    assert max(map(abs, moved)) < 8e-3
