"""Numbers in the lanes of a register, against numpy; clearances in them, against each by itself."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from numba.extending import register_jitable

from clearance_mj import clearance as models
from clearance_mj.clearance import lanes as ops
from clearance_mj.clearance.along import force_at, forces_along
from clearance_mj.clearance.greases.bouc_wen import BoucWen
from clearance_mj.clearance.greases.long_film import LongFilm
from clearance_mj.clearance.record import clearance_records, laws_of, one_each, side_by_side
from clearance_mj.clearance.registers import load, spread, store
from clearance_mj.core.jit import OPTIONS, jit
from clearance_mj.rig import Bushing, Contact, Friction, Grease

LANES, STEP = (0, 1, 2, 3), 1e-4
FILM = Grease(5e3, 2.0, 0.8, 1.1, 1.5e7, 5e6, 1.9, 8e-4, 0.3)


@jit(**OPTIONS)
def arithmetic(a, b, out, lanes):
    x, y = load(a, 0, lanes), load(b, 0, lanes)
    store(out, 0, ops.power(abs(x), y), lanes)
    store(out, 1, ops.signed(y, x), lanes)
    store(out, 2, ops.larger(x, 0.5), lanes)
    store(out, 3, (2.0 - x * y) / (x + 30.0), lanes)
    store(out, 4, ops.smaller(x, y), lanes)
    store(out, 5, ops.where_above(y, x), lanes)
    store(out, 6, ops.exponential(x), lanes)
    return ops.any_below(x, -3.0), ops.all_below(x, y), ops.whole(y)


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


EIGHT = tuple(range(8))
SLIPS = (2e3, 1e3, 5e2), (0.2, 0.15, 0.3)


@register_jitable
def one(row, p, lanes):
    return (load(row, p, lanes),)


@register_jitable
def two(row, p, lanes):
    return load(row, 2 * p, lanes), load(row, 2 * p + 1, lanes)


@jit(**OPTIONS)
def slots_together(lanes, bushings, numbers, x, v, spin, out):
    for i in range(x.shape[0]):
        force = force_at(
            bushings[0], numbers, i * STEP, one(x[i], 0, lanes), one(v[i], 0, lanes), one(x[i], 1, lanes),
            one(v[i], 1, lanes), one(x[i], 2, lanes), one(v[i], 2, lanes), spread(spin, lanes), lanes,
        )  # fmt: skip
        store(out[i], 0, force[0], lanes)


@jit(**OPTIONS)
def rounds_together(lanes, bushings, numbers, x, v, spin, out):
    for i in range(x.shape[0]):
        force = force_at(
            bushings[0], numbers, i * STEP, two(x[i], 0, lanes), two(v[i], 0, lanes), two(x[i], 1, lanes),
            two(v[i], 1, lanes), two(x[i], 2, lanes), two(v[i], 2, lanes), spread(spin, lanes), lanes,
        )  # fmt: skip
        store(out[i], 0, force[0], lanes)
        store(out[i], 1, force[1], lanes)


def motion(d, n=2000):
    """Motions (n, 3, d, 8) of the middle and the ends from the middle, and their velocities."""
    rng, time = np.random.default_rng(5), STEP * np.arange(n)
    x = np.zeros((n, 3, d, 8))
    for frequency in rng.uniform(5, 60, 12):
        size = 1e-4 * rng.standard_normal((1, d, 8)) * (1.0, 1.1, 0.8, 1.0, 1.2, 0.9, 1.0, 1.05)
        size = size + 2e-5 * rng.standard_normal((3, d, 8))
        x += size * np.sin(2 * np.pi * frequency * time + 6 * rng.random())[:, None, None, None]
    return x - x[0], np.gradient(x, STEP, axis=0)


def bushings(**fields):
    """Eight with other gaps and places."""
    fields |= {"grease": Grease(0.0), "contact": Contact(1e4), "radius": 0.01}
    return [Bushing(0.5, 2e-4 + 1e-5 * i, 0.01, offset=2e-5 * (i - 4), **fields) for i in range(8)]


def compared(clearances, laws, spin=30.0):
    """Forces in lanes and of each by itself, over the largest, and the records of the lanes."""
    d = clearances[0].n_coordinates
    x, v = motion(d)
    rigs = [SimpleNamespace(bushings=(bushing,)) for bushing in clearances]
    parts = [clearance_records(rig, law, STEP) for rig, law in zip(rigs, laws)]
    records = side_by_side(parts, laws_of(rigs[0], laws[0]))
    computed, known = np.zeros((2, len(x), d, 8))
    rows = [np.ascontiguousarray(each.reshape(len(x), 3 * d, 8)) for each in (x, v)]
    (slots_together if d == 1 else rounds_together)(EIGHT, *records, *rows, spin, computed)
    for lane, part in enumerate(parts):
        known[:, :, lane] = forces_along(part, 0, *(np.ascontiguousarray(each[..., lane]) for each in (x, v)), spin)
    assert np.all(np.linalg.norm(x[:, 1:], axis=2).max(axis=(0, 1)) > [bushing.gap for bushing in clearances])
    return np.abs(computed - known).max() / np.abs(known).max(), records.bushings[0]


def each(make):
    return [make(1 + 0.1 * i) for i in range(8)]


CONTACTS = {
    "kelvin-voigt": each(lambda f: models.KelvinVoigt(1e4 * f, 3.0)),
    "adhesion": each(lambda f: models.KelvinVoigt(1e4 * f, 3.0, adhesion=True)),
    "cubic": each(lambda f: models.Cubic(1e4, 1e11 * f, 2.0)),
    "adams-impact": each(lambda f: models.AdamsImpact(1e6, 1.0 + f / 4, 3.0, 5e-5 * f)),
    "hunt-crossley": each(lambda f: models.HuntCrossley(1e6 * f, 0.5, 1.4 + 0.1 * f)),
    "lankarani-nikravesh": each(lambda f: models.LankaraniNikravesh(1e6 * f, 0.5)),
    "flores": each(lambda f: models.Flores(1e6, 0.5 * f)),
    "hunt-crossley-1975": each(lambda f: models.HuntCrossley1975(1e6 * f, 1e5, 1.0 + f / 2)),
}
FILLINGS = {
    "linear": each(lambda f: Grease(4e3 * f, 5.0)),
    "Bouc-Wen": each(lambda f: dataclasses.replace(FILM, gamma=5e6 / f, elastic_ratio=1 / f)),
    "Maxwell-slip": each(lambda f: models.MaxwellSlip(*SLIPS, 1e3 * f, 4.0, 8e-4, 0.3)),
    "Stribeck": each(lambda f: models.MaxwellSlip(*SLIPS, 1e3, 4.0, static_ratio=f, stribeck_speed=0.1)),
    "long film": each(lambda f: LongFilm(3e3 * f, 2.0, 8e-4)),
    "short bearing": each(lambda f: models.ShortBearing(0.02 * f, 0.01, 0.01, 4e-4, 1e-6)),
    "finite bearing": each(lambda f: models.FiniteBearing(0.02 * f, 0.01, 0.01, 4e-4, 1e-6)),
}
SHAPES = {
    "slot": {}, "slot that rubs": {"friction": Friction(0.2, 1e5, 0.1)}, "round": {"shape": "round"},
    "round that rubs": {"shape": "round", "friction": Friction(0.2, 1e5, 0.1, 1.5, 0.01)},
    "oval that rubs": {"shape": "oval", "wall": {"wide": 1e-5, "across": -5e-6}, "friction": Friction(0.2)},
}  # fmt: skip
CLOSE = 1e-13  # of the largest force


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("contact", CONTACTS)
def test_contacts_in_lanes(shape, contact):
    clearances, laws = bushings(**SHAPES[shape]), [models.ContactLaw(c, Grease(0.0)) for c in CONTACTS[contact]]
    error, record = compared(clearances, laws)
    assert error < CLOSE
    assert not record["contact_by_lane"]


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("filling", FILLINGS)
def test_fillings_in_lanes(shape, filling):
    laws = [models.ContactLaw(models.KelvinVoigt(1e4, 3.0), g) for g in FILLINGS[filling]]
    assert compared(bushings(**SHAPES[shape]), laws)[0] < CLOSE


@pytest.mark.parametrize("shape", SHAPES)
def test_laws_over_time_and_amplitude_in_lanes(shape):
    clearances = bushings(**SHAPES[shape])
    over_time = each(lambda f: models.TimeLaw([0.0, 0.1 * f], [1e4, 3e4], [3.0, 9.0 * f], FILM))
    amplitude = each(lambda f: models.AmplitudeLaw([1e-4, 5e-4], [1e4, 3e4 * f], [3.0, 9.0], grease=FILM))
    for laws in (over_time, amplitude):
        error, record = compared(clearances, laws)
        assert error < CLOSE
        assert record["contact_by_lane"]


@dataclasses.dataclass(frozen=True)
class Branched(BoucWen):
    @staticmethod
    def law(p, state, r, dr, spin, step, out):
        out[0] = p[0] * r[0] if r[0] > 0.0 else 0.0
        out[1] = p[6]


def test_laws_with_branches_are_called_lane_by_lane():
    table = models.ContactLaw(models.KelvinVoigt(1e4, 3.0)).table
    laws = each(lambda f: SimpleNamespace(grease=[Branched(Grease(1e3 * f, 2.0))], table=table))
    error, record = compared(bushings(), laws)
    assert error < CLOSE
    assert record["filling_by_lane"] and not record["contact_by_lane"]


@pytest.mark.parametrize("contact", CONTACTS)
def test_contacts_of_arrays(contact, rng):
    """Python's own call with arrays of an array library, as JAX traces it, is that with each number."""
    model = CONTACTS[contact][0]
    depth, impact = rng.uniform(1e-6, 1e-4, 9), rng.uniform(0.01, 1.0, 9)
    both = [0.0, 0.0]
    model.law(np.array(model.parameters()), depth, -impact, impact, both)
    for i in range(9):
        one = [0.0, 0.0]
        model.law(model.parameters(), float(depth[i]), -float(impact[i]), float(impact[i]), one)
        for value, scalar in zip(both, one):
            assert np.broadcast_to(value, 9)[i] == pytest.approx(scalar, rel=1e-13)


@pytest.mark.parametrize("size", [1, 2])
@pytest.mark.parametrize("filling", ["linear", "Bouc-Wen", "long film"])
def test_fillings_of_arrays(filling, size, rng):
    (model,) = one_each([FILLINGS[filling][3]], 1)
    states, places, ways = (rng.uniform(-2e-4, 2e-4, (size, 9)) for _ in range(3))
    memory, both = list(states), [0.0] * (size + size**2)
    model.law(np.array(model.parameters()), memory, tuple(places), tuple(ways), 0.0, STEP, both)
    for i in range(9):
        state, one = states[:, i].tolist(), [0.0] * (size + size**2)
        given = tuple(places[:, i].tolist()), tuple(ways[:, i].tolist())
        model.law(model.parameters(), state, *given, 0.0, STEP, one)
        for value, scalar in zip((*both, *memory), (*one, *state)):
            assert np.broadcast_to(value, 9)[i] == pytest.approx(scalar, rel=1e-13, abs=1e-18)
