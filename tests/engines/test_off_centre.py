"""Bushings whose shaft does not hang in their middle, or that have one wall only, on every engine.

The bushings are so short that both ends touch at once, and sit where the chain of links is as high as the shaft it
stands for. Free masses between such walls: verification/test_impact.py.
"""

import dataclasses

import numpy as np
import pytest

from clearance_mj.clearance import ConstantLaw
from clearance_mj.core.errors import RigError
from clearance_mj.engines import simulate
from clearance_mj.engines.energy import energy_balance
from clearance_mj.rig import Grease, Shaker
from clearance_mj.signals.excitation import Excitation, random

from ..conftest import TABLE1
from ..verification.modal_mj import ModalMujoco
from .alike import at_every_step

POSITIONS = 0.55 + 0.05 / np.sqrt(12), 0.8 - 0.05 / np.sqrt(12)
GAPS, OFFSETS, K = np.array([1e-4, 3e-4]), np.array([6e-5, -1e-4]), 2e4
FILM = Grease(4369.0, 4.0, film_height=7.5e-4)


def off_centre(offsets=OFFSETS, stops=("both", "both"), **changes):
    places = zip(TABLE1.bushings, POSITIONS, GAPS, offsets, stops, strict=True)
    short = {"length": 1e-6, "grease": FILM}
    made = [dataclasses.replace(b, position=x, gap=d, offset=o, stops=s, **short) for b, x, d, o, s in places]
    return TABLE1.replace(bushings=tuple(made), **changes)


@pytest.mark.parametrize("stops", [("both", "both"), ("upper", "lower")])
def test_forces_begin_at_the_walls(engine, stops):
    """K times what the displacement from rest exceeds gap - offset upwards and gap + offset downwards."""
    _, x, contact, *_ = at_every_step(off_centre(stops=stops), engine, ConstantLaw(K, 0.0))
    upper = np.where([s != "lower" for s in stops], GAPS - OFFSETS, np.inf)
    lower = np.where([s != "upper" for s in stops], -GAPS - OFFSETS, -np.inf)
    assert np.all(x.max(axis=0) > 1.5 * (GAPS - OFFSETS)) and np.all(x.min(axis=0) < 1.5 * (-GAPS - OFFSETS))
    expected = K * (np.maximum(x - upper, 0) + np.minimum(x - lower, 0))
    pushed = [[bool(np.any(f > 0)), bool(np.any(f < 0))] for f in expected.T]
    assert pushed == [[s != "lower", s != "upper"] for s in stops]
    np.testing.assert_allclose(contact, expected, atol=3e-3 * np.abs(expected).max())


def test_the_film_is_thinner_on_the_nearer_side(engine):
    """k x + c ẋ / max(1 - |x + offset|/h, ε)²: the springs' force is that above what they carry at rest."""
    _, x, _, grease, step = at_every_step(off_centre(), engine, ConstantLaw(K, 0.0))
    before, after = np.diff(x, axis=0)[:-1] / step, np.diff(x, axis=0)[1:] / step
    speed = (before + after) / 2 if engine == "modal" else before
    thin = np.maximum(1 - np.abs(x + OFFSETS) / FILM.film_height, FILM.film_limit)
    expected = 4369.0 * x[1:-1] + 4.0 * speed / thin[1:-1] ** 2
    assert thin.min() < 0.5
    np.testing.assert_allclose(grease[1:-1], expected, atol=6e-3 * np.abs(expected).max())


def flexibility(x, y):
    """Deflection at x under a unit force at y of the bare cantilever: a²(3b - a)/(6EI), a the nearer of the two."""
    near, far = min(x, y), max(x, y)
    return near**2 * (3 * far - near) / (6 * TABLE1.beam.bending_stiffness)


@pytest.mark.parametrize("side", [1, -1])
def test_rest_against_a_wall(engine, side):
    """A force at the tip rises and stands still: x = (G F + k G_b w)/(1 + k G_b), w the wall that it leans on."""
    damped = dataclasses.replace(off_centre().bushings[0], gap=2e-4, grease=Grease(0.0, 30.0))
    rig = TABLE1.replace(bushings=(damped,), shaker=Shaker("force", TABLE1.beam.length))
    at, fs, force = damped.position, 512.0, side * 0.4
    time = np.arange(round(5 * fs)) / fs
    drive = Excitation(force * np.sin(np.pi / 2 * np.minimum(time / 2, 1)) ** 2, fs, "force")
    rest = simulate(rig, drive, ConstantLaw(K, 20.0), engine).displacement[0, time > 4.5].mean()
    wall, compliance = side * 2e-4 - 6e-5, flexibility(at, at)
    expected = (flexibility(at, TABLE1.beam.length) * force + K * compliance * wall) / (1 + K * compliance)
    assert abs(expected) > 1.05 * abs(wall)
    assert rest == pytest.approx(expected, rel=2e-3)


def test_engines_agree():
    """Displacements over the first contacts, 60 ms."""
    rig, law = off_centre(), ConstantLaw(K, 3.0)
    drive = random(0.2, 2048, band=(5, 220), rms=12.0, seed=4)
    modal = simulate(rig, drive, law, "modal")
    exact = modal.displacement[:, :123]
    assert np.all(np.any(modal.contact_force[:, :123] != 0, axis=1))
    for engine, bound in ((ModalMujoco(), 0.01), ("links", 0.03)):
        error = simulate(rig, drive, law, engine).displacement[:, :123] - exact
        assert np.sqrt(np.mean(error**2) / np.mean(exact**2)) < bound, engine


def test_energy_balance_closes(engine):
    """Greases that slide and thin, off centre; at rest nothing is stored."""
    grease = Grease(4369.0, 4.0, 0.5, 1.0, 1.2e7, 0.8e7, 2.0, film_height=7e-4)
    balance = energy_balance(off_centre(), random(0.3, 2048, rms=8.0, seed=1), ConstantLaw(K, 3.0, grease), engine)
    response = balance.response
    assert balance.grease[:, 0] == pytest.approx(0, abs=1e-12) and np.all(balance.grease >= -1e-12)
    assert balance.imbalance < 0.02
    for j, (lower, upper) in enumerate(b.walls for b in off_centre().bushings):
        for side, beyond in (("upper", response.displacement[j] > upper), ("lower", response.displacement[j] < lower)):
            logged = sum(i.duration for i in balance.impacts if (i.bushing, i.side) == (j, side)) / 2  # two ends
            assert logged == pytest.approx(np.sum(beyond) / response.fs, rel=0.1, abs=2e-3) and logged > 0


@pytest.mark.parametrize("offset", [1e-4, -2e-4])
def test_an_offset_beyond_the_gap(offset):
    with pytest.raises(RigError, match=r"offset -?0\.000[12] m lies beyond the gap 0\.0001 m"):
        off_centre([offset, 0.0])
