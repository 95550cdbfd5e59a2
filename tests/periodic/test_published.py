"""Periodic responses of published oscillators. NLvib's curves, and closed forms.

nlvib_duffing.csv and nlvib_unilateral.csv were computed by NLvib 1.3 (Krack & Gross, Harmonic Balance for Nonlinear
Vibration Problems, Springer 2019) in Octave 7.3: angular frequency, amplitude of the fundamental and, by shooting, the
leading Floquet multiplier.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from clearance_mj import Bushing, ConstantLaw, Contact, Grease, Model, Rig, Sensor, Shaker, periodic
from clearance_mj.structure import Matrices

from .one_mass import PolynomialSpring, one_mass

TURN = 2 * np.pi
STIFFNESS = np.array([[1.0, -1.0], [-1.0, 2.0]])
UNILATERAL = Rig(
    "two masses and a one-sided spring", None,
    (Bushing("1:X", 1.0, 0.0, Grease(0.0), Contact(100.0), stops="upper"),), (Sensor(1, "1:X"), Sensor(2, "2:X")),
    shaker=Shaker("force", "2:X"),
    structure=Matrices("m-kg-s", mass=np.eye(2), stiffness=STIFFNESS, damping=0.03 * STIFFNESS, dofs=["1:X", "2:X"]),
)  # fmt: skip
STOP = ConstantLaw(100.0, 0.0)
DUFFING, HARDENING = one_mass(damping=0.05, gap=1e3), ConstantLaw(0.0, 0.0, grease=PolynomialSpring(0.0, 0.1))


def nlvib_rows(name):
    file = Path(__file__).with_name(f"nlvib_{name}.csv")
    return np.genfromtxt(file, delimiter=",", names=True, dtype=None, encoding="utf-8")


def distances(branch, sensor, omega, amplitude):
    """Relative distance in amplitude of points from the curve through a branch, which may be steep."""
    orbit = np.column_stack((TURN * branch.frequency, np.abs(branch.displacement[:, sensor, 1])))
    scale = np.array([np.ptp(omega), np.ptp(amplitude)])
    way = np.cumsum(np.append(0, np.linalg.norm(np.diff(orbit / scale, axis=0), axis=1)))
    fine = CubicSpline(way, orbit)(np.linspace(0, way[-1], 200_000)) / scale
    points = np.column_stack((omega, amplitude)) / scale
    return np.sqrt([np.min(np.sum((fine - point) ** 2, axis=1)) for point in points]) * scale[1] / amplitude


def test_two_masses_and_a_one_sided_spring(measured):
    """NLvib's third example: 21 harmonics, 1024 samples, continued from Ω = 0.8 to 0.5 around two folds."""
    rows = nlvib_rows("unilateral")
    rows = rows[rows["method"] == "hb"][:-1]  # the last one is where NLvib was stopped
    branch = periodic.follow_response(Model(UNILATERAL, STOP), 0.1, (0.8 / TURN, 0.5 / TURN), 21, 1024, stability=False)
    off = distances(branch, 1, rows["angular_frequency"], rows["fundamental_amplitude_2"])
    measured.below("harmonic balance, two masses and a one-sided spring: amplitude", off.max(), 1e-3, "NLvib 1.3")
    assert np.abs(branch.displacement[:, 1, 1]).max() == pytest.approx(0.93739, rel=1e-3)
    assert [point.kind for point in branch.special if point.kind != "first contact"] == ["fold", "fold"]
    peak = [point for point in branch.special if point.kind == "fold"][1]
    assert peak.frequency * TURN == pytest.approx(0.755632, rel=1e-4)  # the last of NLvib's frequencies


@pytest.mark.slow
def test_where_it_doubles_its_period_and_becomes_quasiperiodic():
    """NLvib by shooting: multipliers, leaving the circle at -1 from Ω = 0.7556 on, and as pairs about 0.6 and 0.58."""
    rows = nlvib_rows("unilateral")
    rows = rows[rows["method"] == "shooting"]
    branch = periodic.follow_response(Model(UNILATERAL, STOP), 0.1, (0.8 / TURN, 0.5 / TURN), 61, 1024)
    special = [(point.kind, point.frequency * TURN) for point in branch.special]
    doubling, pairs = ([o for kind, o in special if kind == name] for name in ("period doubling", "Neimark-Sacker"))
    assert doubling[0] == pytest.approx(0.75558, rel=1e-3)
    assert 0.612180039 < pairs[0] < 0.631792197  # unstable and stable neighbours in NLvib's list
    assert 0.579294894 < pairs[1] < 0.593838931
    # From the first fold to the second one a real multiplier above 1, before and after a pair.
    omega, amplitude = TURN * branch.frequency, np.abs(branch.displacement[:, 1, 1])
    for row in rows[[11, 12, 17, 20, -8, -6, -4]]:
        near = (omega - row["angular_frequency"]) ** 2 + (amplitude - row["fundamental_amplitude_2"]) ** 2
        multiplier = branch.multipliers[np.argmin(near), 0]
        known = row["floquet_real"] + 1j * abs(row["floquet_imag"])
        assert abs(multiplier.real + 1j * abs(multiplier.imag)) == pytest.approx(abs(known), rel=0.1)
        assert (abs(multiplier) > 1) == (row["stable"] == 0)


def test_duffing(measured):
    """NLvib: q'' + 0.05 q' + q + 0.1 q³ = 0.18 cos Ωt, 7 harmonics, 29 samples."""
    rows = nlvib_rows("duffing")
    branch = periodic.follow_response(Model(DUFFING, HARDENING), 0.18, (0.5 / TURN, 1.6 / TURN), 7, 29)
    off = distances(branch, 0, rows["angular_frequency"], rows["fundamental_amplitude"])[:-1]
    measured.below("harmonic balance, Duffing's oscillator: amplitude", off.max(), 1e-3, "NLvib 1.3")
    assert [point.kind for point in branch.special if point.kind != "first contact"] == ["fold", "fold"]
    first, second = (point.index for point in branch.special)
    # The points next to a fold are so near that the multiplier's distance from 1 is that of its discretisation.
    assert branch.stable[: first - 1].all() and branch.stable[second + 2 :].all()
    assert not branch.stable[first + 2 : second - 1].any()


def test_duffing_with_one_harmonic():
    """((1 + ¾ κ A² - Ω²)² + (δ Ω)²) A² = F² (Nayfeh & Mook, Nonlinear Oscillations, 1979, 4.1), and its backbone."""
    branch = periodic.follow_response(Model(DUFFING, HARDENING), 0.18, (0.5 / TURN, 1.6 / TURN), 1, 16, stability=False)
    amplitude, omega = np.abs(branch.displacement[:, 0, 1]), TURN * branch.frequency
    force = np.hypot(1 + 0.075 * amplitude**2 - omega**2, 0.05 * omega) * amplitude
    np.testing.assert_allclose(force, 0.18, rtol=1e-6)
    resonant = np.abs(np.angle(branch.displacement[:, 0, 1]) + np.pi / 2).argmin()
    assert omega[resonant] == pytest.approx(np.sqrt(1 + 0.075 * amplitude[resonant] ** 2), rel=3e-3)
