"""Numbers in the lanes of a register, against numpy; greases in them, against the kernel's step lane by lane."""

import dataclasses

import numba
import numpy as np
import pytest

from clearance_mj.clearance import ConstantLaw, MaxwellSlip
from clearance_mj.clearance._lanes import any_below, larger, load, power, signed, store
from clearance_mj.clearance._pointers import OPTIONS
from clearance_mj.clearance.greases.bouc_wen import BoucWen
from clearance_mj.clearance.kernel import clearance_records, grease_step
from clearance_mj.clearance.lane_greases import grease_in_lanes, lane_greases
from clearance_mj.rig import Grease

from ..conftest import TABLE1

LANES = (0, 1, 2, 3)
FILM = Grease(5e3, 2.0, 0.8, 1.1, 1.5e7, 5e6, 1.9, 8e-4, 0.3)


@numba.njit(**OPTIONS)
def arithmetic(a, b, out, lanes):
    x, y = load(a, 0, lanes), load(b, 0, lanes)
    store(out, 0, power(abs(x), y), lanes)
    store(out, 1, signed(y, x), lanes)
    store(out, 2, larger(x, 0.5), lanes)
    store(out, 3, (2.0 - x * y) / (x + 30.0), lanes)
    return any_below(x, -3.0)


def test_arithmetic(rng):
    for _ in range(200):
        a = rng.standard_normal((1, 4)) * 10.0 ** rng.integers(-6, 2)
        b, out = rng.uniform(0.5, 3, (1, 4)), np.zeros((4, 4))
        assert arithmetic(a, b, out, LANES) == np.any(a < -3)
        x, y = a[0], b[0]
        expected = np.abs(x) ** y, np.where(x > 0, y, -y), np.maximum(x, 0.5), (2 - x * y) / (x + 30)
        np.testing.assert_allclose(out, expected, rtol=2e-14)
    arithmetic(np.zeros((1, 4)), np.full((1, 4), 1.5), out, LANES)
    np.testing.assert_allclose(out[0], 0, atol=1e-300)


@numba.njit(**OPTIONS)
def in_lanes(greases, x, step, lanes, out):
    elastic, viscous = np.zeros((1, len(lanes))), np.zeros((1, len(lanes)))
    for i in range(len(x)):
        grease_in_lanes(greases, 0, x[i : i + 1], step, lanes, elastic, viscous)
        out[i, 0], out[i, 1] = elastic[0], viscous[0]


@numba.njit(**OPTIONS)
def alone(clearance, x, out):
    bushings, states, numbers = clearance
    for i in range(len(x)):
        out[i] = grease_step(bushings[0], states[0], numbers, x[i])


def test_bouc_wen_in_lanes():
    """Sliding and film, off centre, beside a grease that does not slide."""
    greases = [FILM, Grease(4e3, 3.0), dataclasses.replace(FILM, exponent=2.0), dataclasses.replace(FILM, gamma=0.0)]
    offsets = np.array([[1e-4], [0.0], [-5e-5], [2e-4]])
    t = np.linspace(0, 20, 3000)[:, None]
    x = 3e-4 * np.sin(t * [1.0, 1.1, 1.2, 0.9]) + 1e-4 * np.sin(3.3 * t)
    made = lane_greases([[BoucWen(g)] for g in greases], offsets)
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


@pytest.mark.parametrize("models", [[MaxwellSlip((1e3,), (0.1,))] * 4, [BoucWen(FILM), MaxwellSlip((1e3,), (0.1,))]])
def test_greases_that_are_called_lane_by_lane(models):
    """A law with loops, and lanes of unlike greases."""
    assert not lane_greases([[model] for model in models], np.zeros((len(models), 1))).law[0]
