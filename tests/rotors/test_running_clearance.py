"""The clearance criterion of API Standard 617 beside the closed form of a Jeffcott rotor; command; bad input."""

import csv
import dataclasses
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from clearance_mj import Bushing, ClearanceError, Contact, Grease, Rig, Sensor, excitation, simulate
from clearance_mj.rig import Spin, Unbalance
from clearance_mj.rotors import running_clearance, whirl

from ..conftest import ROOT
from ..refusals import assert_refused
from .test_turning import JEFFCOTT, jeffcott

GAP, MOMENT, OUTER = 2e-4, 3e-5, 12.0
SPEEDS = np.linspace(0.0, 2.0 * JEFFCOTT, 801)


def rotor(*unbalances, **changes):
    """Return a disc of 3 kg in a round bushing, with two unbalances that make MOMENT together, or with those given."""
    half = Unbalance(0.5, MOMENT / 2, 0.4)
    given = {
        "bushings": (Bushing(0.5, GAP, 0.0, Grease(0.0), Contact(2e6, 50.0), shape="round"),),
        "sensors": (Sensor(1, 0.5),), "spin": Spin(100.0), "unbalances": unbalances or (half, half),
    }  # fmt: skip
    return jeffcott((OUTER, 0.0)).replace(**(given | changes))


def radius(spin):
    return MOMENT * spin**2 / (3.0 * np.abs(JEFFCOTT**2 - spin**2 + 1j * OUTER * spin))


def test_a_jeffcott_rotor():
    """Its orbit is a circle of r = m e Ω²/|k - m Ω² + i Ω c|; the limit is 25.4 µm at these speeds."""
    operating = 1.3 * JEFFCOTT, 1.8 * JEFFCOTT
    check = running_clearance(rotor(), SPEEDS, operating)
    assert_allclose(check.major[0], 2 * radius(SPEEDS), rtol=1e-4)
    assert_allclose(check.vibration[0], 2 * radius(SPEEDS), rtol=1e-4)
    limit = 25.4e-6  # the shaft turns slower than 12000 rev/min
    assert operating[1] * 30 / math.pi < 12000
    scale = limit / (2 * radius(SPEEDS[(operating[0] <= SPEEDS) & (operating[1] >= SPEEDS)]).max())
    assert check.limit == pytest.approx(limit) and check.scale == pytest.approx(scale, rel=1e-4)
    assert check.allowed == pytest.approx([1.5 * GAP])
    assert_allclose(check.used[0], scale * radius(SPEEDS) / (0.75 * GAP), rtol=2e-4)
    assert check.holds.tolist() == [scale * radius(SPEEDS).max() < 0.75 * GAP]
    assert sum(u.moment for u in check.scaled_rig.unbalances) == pytest.approx(scale * MOMENT, rel=1e-4)


LIMITS = [(3000, 25.4e-6), (6000, 25.4e-6), (12000, 25.4e-6), (15000, 22.718e-6), (48000, 12.7e-6)]


@pytest.mark.parametrize(("rpm", "limit"), LIMITS)
def test_the_limit_is_one_mil_at_most(rpm, limit):
    """min(25.4, 25.4 √(12000/N)) µm: API 617, 9th edition, 6.8.2.11, as petrobras/ross #1377 has it."""
    speeds = np.array([1.0, rpm * math.pi / 30])
    check = running_clearance(rotor(Unbalance(0.5, 1e-6)), speeds, (0.5, speeds[-1]))
    assert check.limit == pytest.approx(limit, rel=1e-4)
    assert check.scale == pytest.approx(np.clip(limit / (2 * 1e-6 / MOMENT * radius(speeds).max()), 0.5, 6.0), rel=1e-3)


@pytest.mark.parametrize(("moment", "scale"), [(1e-8, 6.0), (1.0, 0.5)])
def test_the_scale_has_bounds(moment, scale):
    check = running_clearance(rotor(Unbalance(0.5, moment)), SPEEDS, (1.3 * JEFFCOTT, 1.8 * JEFFCOTT))
    assert check.scale == scale and check.holds[0] == (scale > 1)


def test_the_major_axis_is_that_of_a_simulation_that_does_not_touch():
    rig = Rig.load(ROOT / "models" / "rotor.toml")
    centred = dataclasses.replace(rig.bushings[0], offset=0.0, length=0.0)
    light = Unbalance(0.35, 2e-5, 1.0)
    rig = rig.replace(gravity=None, bushings=(centred,), spin=Spin(170.0), unbalances=(light,))
    check = running_clearance(rig, [100.0, 170.0], (100.0, 170.0))
    seen = whirl(rig, simulate(rig, excitation.still(6.0, 1024), engine="modal")).between(4.0)
    assert 2 * seen.orbits(0).filtered().major == pytest.approx(check.major[0, -1], rel=2e-3)


def test_files_figure_and_words(tmp_path, answer):
    given = "--speeds", 10, "4200rpm", "--operating", "1800rpm", "3820rpm", "--points", 200, "--run-up", 0.5
    reported = answer("running-clearance", ROOT / "models" / "rotor.toml", *given, "--out", tmp_path / "out")
    rig, operating = Rig.load(ROOT / "models" / "rotor.toml"), (1800 * np.pi / 30, 3820 * np.pi / 30)
    check = running_clearance(rig, np.union1d(np.linspace(10, 4200 * np.pi / 30, 200), operating), operating)
    assert reported["scale"] == pytest.approx(check.scale) and reported["used"] == pytest.approx([check.used.max()])
    assert reported["at_speed"] == pytest.approx([check.speed[check.used[0].argmax()]]) and reported["holds"] == [False]
    with (tmp_path / "out" / "running_clearance.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["major_axis_m"]) for row in rows] == pytest.approx((check.scale * check.major[0]).tolist())
    assert (tmp_path / "out" / "running_clearance.png").stat().st_size > 10_000
    # It runs up to 400 rad/s: without options it operates there.
    reported = answer("running-clearance", ROOT / "models" / "rotor.toml", "--points", 100, "--out", tmp_path / "out")
    check = running_clearance(rig, np.union1d(np.linspace(0.0, 440.0, 100), 400.0), (400.0, 400.0))
    assert reported["scale"] == pytest.approx(check.scale) and reported["used"] == pytest.approx([check.used.max()])


def test_a_command_that_asks_for_what_cannot_be_is_refused(refused):
    rotor = ROOT / "models" / "rotor.toml"
    operating = "--operating", 20, 30
    assert "--speeds 100 10 rad/s: must rise" in refused("running-clearance", rotor, "--speeds", 100, 10, *operating)
    given = "running-clearance", rotor, "--speeds", 10, 100, *operating
    assert "--points 1: must be at least 2" in refused(*given, "--points", 1)
    assert "--run-up -1 s: must be positive" in refused(*given, "--run-up", -1)


@pytest.mark.parametrize(("changes", "speeds", "operating", "words"), [
    ({"bushings": (), "spin": None, "unbalances": ()}, SPEEDS, (1, 2), r'give its bushings shape = "round"'),
    ({"bushings": ()}, SPEEDS, (1, 2), "no round bushings"),
    ({"unbalances": ()}, SPEEDS, (1, 100), "no unbalances"),
    ({}, [2.0, 1.0], (1, 100), "rising spins"),
    ({}, SPEEDS, (100, 50), "must rise"),
    ({}, [1.0, 2.0], (3, 4), r"\(1 to 2 rad/s\)"),
    ({"unbalances": (Unbalance(0.5, 1e-5), Unbalance(0.5, 1e-5, math.pi))}, SPEEDS, (1, 100), "no sensor moves"),
])  # fmt: skip
def test_what_is_missing_is_said(changes, speeds, operating, words):
    assert_refused(ClearanceError, words, running_clearance, rotor(**changes), speeds, operating)
