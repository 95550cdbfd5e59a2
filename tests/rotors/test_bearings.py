"""Shafts in bearings with coefficients between two directions: thresholds, tables over the spin, plain springs."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.optimize
from numpy.testing import assert_allclose

import clearance_mj as cm
from clearance_mj.cli import main
from clearance_mj.core.errors import ClearanceError, RigError
from clearance_mj.rig import Bearing, Rig, Sensor, Shaker, Spin, Unbalance
from clearance_mj.rotors import turning_shaft
from clearance_mj.structure import Disc, Material, Section, Shaft, Support

from ..refusals import assert_refused

MASS, STIFFNESS, DAMPING = 3.0, 1e6, 1000.0  # kg of the disc, N/m and N s/m of each of two bearings
BENDING = 48 * 2.1e11 * np.pi * 0.05**4 / 64  # N/m, of a shaft of 1 m in its middle
OMEGA = np.sqrt(1 / (1 / (2 * STIFFNESS) + 1 / BENDING) / MASS)  # rad/s, of both in series


def rotor(*bearings: Bearing, density: float = 7850.0, **changes: Any) -> Rig:
    steel = Material(2.1e11, density)
    shaft = Shaft((Section(1.0, (0.05, 0.05)),), (), (Disc(0.5, MASS, 0.01),), steel, theory="euler")
    rig = Rig("rotor", None, (), (Sensor(1, 0.5),), structure=shaft, bearings=bearings, shaker=Shaker("force", 0.5))
    return rig.replace(**changes)


def of_seal(x: float, until: float) -> Bearing:
    """Half of the fluid turns with the shaft: k_yz = -k_zy = c Ω/2, linear in the spin."""
    speeds = np.linspace(0.0, until, 4)
    rows = [(STIFFNESS, DAMPING * s / 2, -DAMPING * s / 2, STIFFNESS) for s in speeds]
    return Bearing(x, rows, DAMPING, tuple(speeds.tolist()))  # type: ignore[arg-type]


def constant(x: float, cross: float) -> Bearing:
    return Bearing(x, [[STIFFNESS, cross], [-cross, STIFFNESS]], DAMPING)  # type: ignore[arg-type]


def test_the_threshold_of_a_cross_coupled_bearing() -> None:
    """A Jeffcott rotor whirls by itself where k_yz = c ω: in a seal where half of the fluid turns, at twice ω."""
    shaft = turning_shaft(rotor(of_seal(0.0, 3 * OMEGA), of_seal(1.0, 3 * OMEGA), density=1e-3))
    threshold = shaft.threshold(np.linspace(0.5, 2.9, 25) * OMEGA)
    assert threshold is not None
    assert_allclose(threshold, 2 * OMEGA, rtol=1e-4)
    poles = shaft.poles(2.2 * OMEGA)
    assert shaft.sense(poles.motion[:, [int(np.argmax(poles.value.real))]]) == pytest.approx([1.0], abs=1e-6)  # forward


@pytest.mark.parametrize("ratio", [0.8, 1.2])
def test_the_modal_engine_grows_and_decays_as_the_poles_do(ratio: float) -> None:
    lowest = turning_shaft(rotor(constant(0.0, 0.0), constant(1.0, 0.0))).poles(100.0).value[0].imag
    cross = ratio * DAMPING * lowest
    rig = rotor(constant(0.0, cross), constant(1.0, cross), spin=Spin(100.0))
    value = turning_shaft(rig).poles(100.0).value
    slowest = value[np.argmax(value.real)]
    assert np.sign(slowest.real) == np.sign(ratio - 1)
    fs = 8192.0
    response = cm.simulate(rig, _hit(fs), engine="modal").acceleration[0]
    late = response[int(0.2 * fs) :]  # the other whirl has died out
    peaks = np.flatnonzero((late[1:-1] > late[:-2]) & (late[1:-1] > late[2:])) + 1
    assert_allclose(np.polyfit(peaks / fs, np.log(late[peaks]), 1)[0], slowest.real, rtol=2e-2)


def _hit(fs: float) -> cm.Excitation:
    value = np.zeros(int(0.5 * fs))
    value[10:30] = 10 * np.sin(np.pi * np.arange(20) / 20)
    return cm.Excitation(value, fs, "force")


def test_a_table_that_is_constant_is_the_constant() -> None:
    row = (STIFFNESS, 3e4, -2e4, 2 * STIFFNESS)
    of_table = Bearing(0.0, (row,) * 3, (np.diag([DAMPING, 2 * DAMPING]).ravel(),) * 3, (0.0, 150.0, 400.0))  # type: ignore[arg-type]
    alone = Bearing(0.0, (row,), np.diag([DAMPING, 2 * DAMPING]).tolist())  # type: ignore[arg-type]
    pushed = _hit(2048.0)
    for spin in (Spin(120.0), Spin(100.0, 50.0, 120.0)):
        turning = {"spin": spin, "unbalances": (Unbalance(0.5, 1e-4),)}
        rigs = [rotor(b, dataclasses.replace(b, position=1.0), **turning) for b in (of_table, alone)]
        values = [turning_shaft(rig).poles(130.0).value for rig in rigs]
        assert_allclose(*values, rtol=1e-12)
        motions = [cm.simulate(rig, pushed, engine="modal").acceleration for rig in rigs]
        assert_allclose(*motions, rtol=0, atol=1e-12 * np.abs(motions[0]).max())


def test_a_bearing_without_coupling_is_a_support_of_springs_and_dampers() -> None:
    """The same shaft on supports, whose stiffness and damping in each direction are fields of their own."""
    steel = Material(2.1e11, 7850.0)
    sections, disc = (Section(0.8, (0.02, 0.02)),), Disc(0.3, 2.0, 0.004)
    places = (0.05, 0.75)
    springs = {"translation": 2e6, "translation_damping": 50.0, "translation_y": 1e6, "translation_damping_y": 30.0}
    supports = tuple(Support(x, **springs) for x in places)
    bearings = tuple(Bearing(x, [[1e6, 0.0], [0.0, 2e6]], [[30.0, 0.0], [0.0, 50.0]]) for x in places)  # type: ignore[arg-type]
    on_supports = Rig("s", None, (), (Sensor(1, 0.4),), structure=Shaft(sections, supports, (disc,), steel))
    in_bearings = on_supports.replace(structure=Shaft(sections, (), (disc,), steel), bearings=bearings)
    first, second = (turning_shaft(rig) for rig in (on_supports, in_bearings))
    assert_allclose(second.poles(200.0).value[:6], first.poles(200.0).value[:6], rtol=1e-6)
    assert_allclose(second.critical_speeds[:4], first.critical_speeds[:4], rtol=1e-6)


def test_critical_speeds_in_bearings_that_stiffen_with_the_spin() -> None:
    """Ω² m = 1/(1/(2 k(Ω)) + 1/k_shaft) of a disc in the middle of a light shaft, k = k0 + a Ω, solved here.

    What couples both directions with opposite signs is no stiffness: the critical speeds are the same with it.
    """
    slope, speeds = 2e3, np.linspace(0.0, 2000.0, 5)

    def apart(spin: float) -> float:
        return 1 / (1 / (2 * (STIFFNESS + slope * spin)) + 1 / BENDING) - MASS * spin**2

    expected = scipy.optimize.brentq(apart, 100.0, 1900.0)
    for cross in (0.0, 3e5):
        rows = [(STIFFNESS + slope * s, cross, -cross, STIFFNESS + slope * s) for s in speeds]
        held = [Bearing(x, rows, DAMPING, tuple(speeds.tolist())) for x in (0.0, 1.0)]  # type: ignore[arg-type]
        critical = turning_shaft(rotor(*held, density=1e-3)).critical_speeds
        assert_allclose(critical[:2], expected, rtol=1e-5)  # backward and forward alike: the disc does not tilt
        assert critical.max() <= 2000.0


def test_commands_of_rotors_take_a_table_of_a_bearing(tmp_path: Path) -> None:
    """Campbell diagram and unbalance response of the shipped rotor with a seal whose stiffness grows with the spin."""
    (tmp_path / "seal.csv").write_text("speed (rpm),kyy (N/m),kyz,kzz,cyy (N s/m)\n0,0,0,0,50\n8000,1e5,2e4,1e5,50\n")
    text = (Path(__file__).parents[2] / "models" / "rotor.toml").read_text(encoding="utf-8")
    (tmp_path / "rotor.toml").write_text(text + '\n[[bearings]]\nposition = 0.5\ntable = "seal.csv"\n')
    for command in ("campbell", "unbalance"):
        out = tmp_path / command
        assert main([command, str(tmp_path / "rotor.toml"), "--speeds", "0", "600", "--quiet", "--out", str(out)]) == 0
        speed = np.genfromtxt(out / "critical_speeds.csv", delimiter=",", names=True)["spin_rev_min"]
        assert np.atleast_1d(speed).max() > 1.01 * 1418  # of the rotor without the seal, docs/rotors.md


def test_what_bearings_do_not_allow_is_said_in_a_line() -> None:
    seal = of_seal(0.0, 100.0)
    words = r"bearings\[0\].spin reaches from 0 to 100 rad/s, and the shaft turns at 200 rad"
    assert_refused(RigError, words, rotor, seal, spin=Spin(200.0))
    words = r"known from 0 to 100 rad/s, not at 150 rad/s; extend its table, or ask for spins"
    assert_refused(RigError, words, turning_shaft(rotor(seal, of_seal(1.0, 100.0))).poles, 150.0)
    falling = Bearing(0.0, ((1e5, 0.0, 0.0, 1e5), (-1e5, 0.0, 0.0, -1e5)), 1.0, (0.0, 100.0))  # type: ignore[arg-type]
    falls = turning_shaft(rotor(falling, dataclasses.replace(falling, position=1.0)))
    words = "its bearings leave the shaft a motion without stiffness, so that it has no crit"
    assert_refused(RigError, words, lambda: falls.critical_speeds)
    case = rotor(constant(0.0, 1.0)), _hit(2048.0)
    assert_refused(ClearanceError, "links knows no bearings; use modal", cm.simulate, *case, engine="links")
    assert_refused(RigError, r"bearings\[0\].position 3 m lies outside", rotor, constant(3.0, 1.0))
