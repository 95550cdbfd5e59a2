"""Rubbing and what it does to clearances, beside Archard's and Dickrell & Sawyer's closed forms."""

import dataclasses
import math

import numpy as np
import pytest

from clearance_mj import ClearanceError, ConstantLaw, Model, Rig, RigError, simulate
from clearance_mj.rig import Spin
from clearance_mj.signals.excitation import still
from clearance_mj.wear import Marched, Sine, predict_life
from clearance_mj.wear.growth import HOUR, growth, growth_per_volume
from clearance_mj.wear.rubbing import in_space, rubbing

from ..conftest import TABLE1
from ..refusals import assert_refused

K, RADIUS, LENGTH = 1e-12, 5e-3, 0.02
N = 4096
TURN = 2 * np.pi * np.arange(N) / N


def with_wear(rig: Rig, **fields) -> Rig:
    first = dataclasses.replace(rig.bushings[0], **{"wear": K, "radius": RADIUS, "length": LENGTH} | fields)
    return rig.replace(bushings=(first,))


def shaft(**fields) -> Rig:
    """A shaft in one round bushing, turning under its weight."""
    rig = with_wear(TABLE1.with_shape("round").replace(gravity=(0.0, 0.0, -9.81), spin=Spin(100.0)), **fields)
    return rig.replace(bushings=(dataclasses.replace(rig.bushings[0], grease=dataclasses.replace(
        rig.bushings[0].grease, stiffness=0.0)),))  # fmt: skip


def test_a_tilting_section_rubs_by_load_times_slip():
    """N = N₀ (1 + cos ωt) on the upper wall, θ = θ₀ sin ωt: the mean of N|v| is N₀ R θ₀ ω 2/π, exactly."""
    rig, omega, load, angle = with_wear(TABLE1), 300.0, 7.0, 1e-4
    place = np.array([-1, 1])[:, None] * LENGTH / 2 * angle * np.sin(TURN) + 4e-4
    speed = np.array([-1, 1])[:, None] * LENGTH / 2 * angle * omega * np.cos(TURN)
    force = np.array([np.zeros(N), load * (1 + np.cos(TURN))])
    work = rubbing(rig, in_space(rig, place), in_space(rig, speed), force)
    exact = load * RADIUS * angle * omega * 2 / np.pi
    assert work[0, 0, 0] == 0
    np.testing.assert_allclose(work[0, 1], exact * np.array([1, 0, 1, 0, 1, 0]), rtol=1e-6)
    depth = HOUR * K * exact / (2 * RADIUS * LENGTH)
    gap, _, offset = growth(rig, work)[0]
    assert gap - offset == pytest.approx(depth, rel=1e-6)  # the upper wall
    assert gap + offset == pytest.approx(0, abs=1e-12 * depth)  # the lower one


@pytest.mark.parametrize("stops, moved", [("upper", (1.0, 0.0)), ("both", (0.5, -0.5))])
def test_the_wall_that_is_touched_recedes(stops, moved):
    rig = with_wear(TABLE1, stops=stops)
    power = np.array([[[1, 0, 1, 0, 1, 0], [0, 0, 0, 0, 0, 0]]], dtype=float)
    gap, y, z = growth_per_volume(rig, power)[0] * 2 * RADIUS * LENGTH
    assert (gap, z, y) == pytest.approx((*moved, 0))


def test_a_shaft_that_whirls_in_full_contact_wears_a_round_hole():
    """N all around with v = (Ω R + ṙ·t): V goes off 2πRL, h = V/(2πRL), and the middle stays."""
    rig, whirl, spin, load = shaft(), 40.0, 100.0, 11.0
    gap = rig.bushings[0].gap
    path = gap * np.array([np.cos(TURN), np.sin(TURN)])
    speed = gap * whirl * np.array([-np.sin(TURN), np.cos(TURN)])
    both = rubbing(rig, np.array([path, path]), np.array([speed, speed]), np.full((2, N), load / 2), spin)
    volume = load * (RADIUS * spin + gap * whirl)
    assert both[0, :, 0].sum() == pytest.approx(volume, rel=1e-9)
    grown = growth_per_volume(rig, both)[0]
    np.testing.assert_allclose(grown, [volume / (2 * np.pi * RADIUS * LENGTH), 0, 0], rtol=1e-9, atol=1e-9 * grown[0])


def test_a_turning_shaft_under_a_constant_load_wears_by_archard():
    """V = K F 2πR n whatever the pressure, and the shaft sinks by V/(2RL): F as the engine finds it at rest."""
    model = Model(shaft(), ConstantLaw(1e6, 100.0))
    force = np.hypot(*simulate(model, still(0.1, 2048.0), engine="modal").contact_force[:, -1])
    life = predict_life(model, Marched(still(0.1, 2048.0)), "0.4 mm", hours=1.0)
    turns = 100.0 / (2 * np.pi) * HOUR  # in an hour
    volume = K * force * 2 * np.pi * RADIUS * turns
    assert life.rubbing[0, 0] == pytest.approx(force * RADIUS * 100.0, rel=1e-4)  # both ends along their own normals
    sinks = life.rate[0, 0] * 2  # gap and middle move by half of it each
    assert sinks == pytest.approx(volume / (2 * RADIUS * LENGTH), rel=1e-4)
    even = predict_life(Model(shaft(worn="shaft"), model.law), Marched(still(0.1, 2048.0)), "0.4 mm", hours=1.0)
    assert even.rate[0, 0] == pytest.approx(volume / (2 * np.pi * RADIUS * LENGTH), rel=1e-4)
    assert not even.offset.any()


def test_a_shaft_that_sinks_is_relieved_exponentially():
    """The shaft's own stiffness takes over: F = F₀ - k h, so h = F₀/k (1 - exp(-k c t)) with dh/dt = c F."""
    rig, law, quiet = shaft(), ConstantLaw(1e6, 100.0), still(0.05, 2048.0)

    def load(sunk: float) -> float:
        bushing = dataclasses.replace(rig.bushings[0], gap=rig.bushings[0].gap + sunk / 2, offset=sunk / 2)
        at_rest = simulate(Model(rig.replace(bushings=(bushing,)), law), quiet, engine="modal")
        return float(np.hypot(*at_rest.contact_force[:, -1]))

    first, relief = load(0.0), (load(0.0) - load(2e-4)) / 2e-4
    c = HOUR * K * 100.0 / (2 * LENGTH)
    hours = 1e-4 / (c * first) * 2
    life = predict_life(Model(rig, law), Marched(quiet), "9 mm", hours=hours)
    sunk = 2 * (life.gap[-1, 0] - life.gap[0, 0])
    assert sunk == pytest.approx(first / relief * (1 - math.exp(-relief * c * hours)), rel=1e-3)
    assert life.offset[-1, 0, 1] == pytest.approx(sunk / 2, rel=1e-3)  # along y friction would move it


def test_marching_and_harmonic_balance_rub_alike():
    rig = TABLE1.replace(bushings=tuple(dataclasses.replace(b, wear=K) for b in TABLE1.bushings))
    model, sine = Model(rig), Sine(39.0, 5.0, n_harmonics=61)
    balanced = sine.source(model).first(model)
    marched = sine.in_time(model).source(model).first(model)
    assert balanced.kind == "periodic" and marched.kind == "marched"
    np.testing.assert_allclose(marched.power, balanced.power, rtol=1e-3)


def test_old_rigs_keep_their_data():
    assert "wear" not in TABLE1.to_dict()["bushings"][0]
    assert Rig.from_dict(with_wear(TABLE1).to_dict()) == with_wear(TABLE1)


@pytest.mark.parametrize("change, words", [
    ({"wear": -1e-12}, "wear"),
    ({"length": 0.0}, "needs the bushing's length"),
    ({"wear": 0.0, "radius": None}, "no bushing has a coefficient of wear"),
])  # fmt: skip
def test_impossible_wear_is_refused_in_one_line(change, words):
    assert_refused(RigError, words, lambda: predict_life(Model(with_wear(TABLE1, **change)), Sine(39.0, 5.0), "x2"))


def test_a_limit_below_the_gap_is_refused():
    with pytest.raises(ClearanceError, match="must be above its gap"):
        predict_life(Model(with_wear(TABLE1)), Sine(39.0, 5.0), "0.2 mm")
