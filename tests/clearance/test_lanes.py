"""Numbers in the lanes of a register, against numpy; greases and contacts in them, against the kernel's steps."""

import dataclasses

import numpy as np
import pytest
from clearance_mj.clearance.lane_contacts import contact_in_lanes, lane_contacts, penetration_in_lanes
from clearance_mj.clearance.lane_greases import grease_in_lanes, lane_greases

from clearance_mj.clearance import (
    AdamsImpact,
    AmplitudeLaw,
    ConstantLaw,
    ContactLaw,
    Cubic,
    Flores,
    HuntCrossley,
    HuntCrossley1975,
    KelvinVoigt,
    MaxwellSlip,
)
from clearance_mj.clearance.greases.bouc_wen import BoucWen
from clearance_mj.clearance.kernel import clearance_records, contact_step, grease_step
from clearance_mj.clearance.lanes import (
    all_below,
    any_below,
    exponential,
    larger,
    load,
    power,
    signed,
    smaller,
    store,
    where_above,
    whole,
)
from clearance_mj.core.jit import OPTIONS, jit
from clearance_mj.rig import Grease

from ..conftest import TABLE1

LANES = (0, 1, 2, 3)
FILM = Grease(5e3, 2.0, 0.8, 1.1, 1.5e7, 5e6, 1.9, 8e-4, 0.3)


@jit(**OPTIONS)
def arithmetic(a, b, out, lanes):
    x, y = load(a, 0, lanes), load(b, 0, lanes)
    store(out, 0, power(abs(x), y), lanes)
    store(out, 1, signed(y, x), lanes)
    store(out, 2, larger(x, 0.5), lanes)
    store(out, 3, (2.0 - x * y) / (x + 30.0), lanes)
    store(out, 4, smaller(x, y), lanes)
    store(out, 5, where_above(y, x), lanes)
    store(out, 6, exponential(x), lanes)
    return any_below(x, -3.0), all_below(x, y), whole(y)


def test_arithmetic(rng):
    for _ in range(200):
        a = rng.standard_normal((1, 4)) * 10.0 ** rng.integers(-6, 2)
        b, out = rng.uniform(0.5, 3, (1, 4)), np.zeros((7, 4))
        assert arithmetic(a, b, out, LANES) == (np.any(a < -3), np.all(a < b), int(b[0, 0]))
        x, y = a[0], b[0]
        expected = (
            np.abs(x) ** y, np.where(x > 0, y, -y), np.maximum(x, 0.5), (2 - x * y) / (x + 30), np.minimum(x, y),
            np.where(x > 0, y, 0), np.exp(x),
        )  # fmt: skip
        np.testing.assert_allclose(out, expected, rtol=2e-14)
    arithmetic(np.zeros((1, 4)), np.full((1, 4), 1.5), out, LANES)
    np.testing.assert_allclose(out[0], 0, atol=1e-300)
    assert not arithmetic(np.array([[np.nan, 0.0, 0.0, 0.0]]), np.ones((1, 4)), out, LANES)[1]


@jit(**OPTIONS)
def in_lanes(greases, x, step, lanes, out):
    elastic, viscous = np.zeros((1, len(lanes))), np.zeros((1, len(lanes)))
    for i in range(len(x)):
        grease_in_lanes(greases, 0, x[i : i + 1], step, lanes, elastic, viscous)
        out[i, 0], out[i, 1] = elastic[0], viscous[0]


@jit(**OPTIONS)
def alone(clearance, x, out):
    bushings, states, numbers = clearance
    for i in range(len(x)):
        out[i] = grease_step(bushings[0], states[0], numbers, x[i])


SLIPS = (2e3, 1e3, 5e2), (0.2, 0.15, 0.3)
GREASES = {
    "Bouc-Wen": [
        BoucWen(g)
        for g in (FILM, Grease(4e3, 3.0), dataclasses.replace(FILM, exponent=2.0), dataclasses.replace(FILM, gamma=0.0))
    ],
    "Maxwell-slip": [
        MaxwellSlip(*SLIPS, 1e3, 4.0), MaxwellSlip(*SLIPS, 0.0, 4.0, 8e-4, 0.3),
        MaxwellSlip(*SLIPS, 1e3, 4.0, static_ratio=1.4, stribeck_speed=0.1),
        MaxwellSlip(*SLIPS, 1e3, 4.0, static_ratio=2.0, stribeck_speed=1.0),
    ],
}  # fmt: skip


@pytest.mark.parametrize("model", GREASES)
def test_greases_in_lanes(model):
    """Sliding and film, off centre, beside a Bouc-Wen grease that does not slide and slips of constant friction."""
    greases = GREASES[model]
    offsets = np.array([[1e-4], [0.0], [-5e-5], [2e-4]])
    t = np.linspace(0, 20, 3000)[:, None]
    x = 3e-4 * np.sin(t * [1.0, 1.1, 1.2, 0.9]) + 1e-4 * np.sin(3.3 * t)
    made = lane_greases([[g] for g in greases], offsets)
    assert made.law[0]
    found = np.zeros((3000, 2, 4))
    in_lanes(made, x, 1e-4, LANES, found)
    for lane, (grease, offset) in enumerate(zip(greases, offsets[:, 0])):
        bushing = dataclasses.replace(TABLE1.bushings[0], offset=float(offset))
        law = ConstantLaw(0.0, 0.0, grease)
        clearance = clearance_records(TABLE1.replace(bushings=(bushing,)), law, 1e-4)
        expected = np.zeros((3000, 2))
        alone(clearance, x[:, lane], expected)
        np.testing.assert_allclose(found[:, :, lane], expected, rtol=1e-11, atol=1e-12)


@dataclasses.dataclass(frozen=True)
class Branched(BoucWen):
    @staticmethod
    def law(p, state, x, dx, step, out):
        out[0] = p[0] * x if x > 0.0 else 0.0
        out[1] = p[6]


@pytest.mark.parametrize("models", [[Branched(FILM)] * 4, [BoucWen(FILM), MaxwellSlip((1e3,), (0.1,))]])
def test_greases_that_are_called_lane_by_lane(models):
    """A law with branches, and lanes of unlike greases."""
    assert not lane_greases([[model] for model in models], np.zeros((len(models), 1))).law[0]


@jit(**OPTIONS)
def contact_alone(clearance, x, v, out):
    bushings, states, numbers = clearance
    for i in range(len(x)):
        g, k, c = contact_step(bushings[0], states[0], numbers, 1, x[i], v[i], False)
        out[i] = k * g, c, 1.0 if g > 0.0 else -1.0


@jit(**OPTIONS)
def contacts_together(contacts, x, v, lanes, out):
    elastic, viscous, side, depth = np.zeros((4, 1, len(lanes)))
    for i in range(len(x)):
        if penetration_in_lanes(contacts, 0, 1, x[i : i + 1], 0, lanes, depth):
            contact_in_lanes(contacts, 0, 1, depth, v[i : i + 1], 0, lanes, elastic, viscous, side)
            out[i, 0], out[i, 1], out[i, 2] = elastic[0], viscous[0], side[0]


def records(laws):
    """Of bushings with other gaps and offsets, one wall missing."""
    walls = [(3e-4, 0.0), (2e-4, 1e-4), (2.5e-4, 0.0), (2e-4, -5e-5)]
    bushings = [dataclasses.replace(TABLE1.bushings[0], gap=gap, offset=offset) for gap, offset in walls]
    parts = [clearance_records(TABLE1.replace(bushings=(b,)), law, 1e-4) for b, law in zip(bushings, laws)]
    for part in parts[2:3]:
        part.bushings["lower"] = -np.inf
    return lane_contacts([law.table(1).kinds for law in laws], parts), parts


CONTACTS = {
    "kelvin-voigt": [KelvinVoigt(1e4 * i, 3.0 * i, adhesion=i == 2) for i in range(1, 5)],
    "cubic": [Cubic(1e4, 1e11 * i, 2.0 * i, 1.5 * i) for i in range(4)],
    "hertz": [HuntCrossley(1e6, 0.9), HuntCrossley(1e5, 0.5, 1.0), HuntCrossley(1e8, 0.7, 2.1), Flores(1e6, 0.8)],
    "adams-impact": [AdamsImpact(1e6, 1.0 + i / 2, 3.0 * i, 5e-5 * (i + 1)) for i in range(4)],
    "hunt-crossley-1975": [HuntCrossley1975(1e6, 1e4 * i, 1.0 + i / 2) for i in range(4)],
}


@pytest.mark.parametrize("model", CONTACTS)
def test_contacts_in_lanes(model):
    """Impacts at several speeds, of lanes in contact beside lanes in the gap."""
    contacts, parts = records([ContactLaw(contact) for contact in CONTACTS[model]])
    assert contacts.law[0]
    t = np.linspace(0, 20, 3000)[:, None]
    x = 4e-4 * np.sin(t * [1.0, 1.1, 1.2, 0.9]) + 1e-4 * np.sin(3.3 * t)
    v = np.gradient(x, 1e-4, axis=0)
    found, expected = np.zeros((2, 3000, 3, 4))
    contacts_together(contacts, x, v, LANES, found)
    for lane, part in enumerate(parts):
        contact_alone(part, x[:, lane].copy(), v[:, lane].copy(), expected[:, :, lane])
    assert np.all(np.any(expected[:, 0] > 0, axis=0)) and not np.any(expected[:, 0, 2] < 0)
    touching = expected[:, 0] != 0
    np.testing.assert_allclose(found[:, :2], expected[:, :2], rtol=1e-11, atol=1e-12)
    np.testing.assert_array_equal(found[:, 2][touching], expected[:, 2][touching])


@pytest.mark.parametrize(
    "laws",
    [[AmplitudeLaw([1e-4, 6e-4], [1e4, 3e4], [3.0, 9.0])] * 4, [ConstantLaw(1e4, 1.0), ContactLaw(Cubic(1e4, 1e11))]],
)
def test_contacts_that_are_called_lane_by_lane(laws):
    """A law over amplitude, and lanes of unlike contacts."""
    assert not records(laws)[0].law[0]
