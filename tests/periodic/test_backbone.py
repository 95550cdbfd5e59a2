"""Backbones of nonlinear modes. Truth: closed forms of oscillators, linear modes, forced vibrations in resonance."""

import numpy as np
import pytest
from scipy.special import ellipk

from clearance_mj import ClearanceError, Excitation, Modal, Model, periodic, simulate
from clearance_mj.clearance import ConstantLaw, MaxwellSlip
from clearance_mj.periodic import condensed, continuation
from clearance_mj.structure import Matrices
from experiments.periodic.verification import SLIDERS

from ..conftest import TABLE1
from ..refusals import assert_refused
from .lost import until
from .one_mass import one_mass
from .test_published import DUFFING, HARDENING
from .test_rigs import LAW, REFUSED

TURN = 2 * np.pi
KAPPA = 0.1  # of the cubic spring


def fundamental(curve, clearance=0):
    """Amplitude of the fundamental at a clearance, which is real."""
    return curve.clearance_displacement[:, clearance, 1].real


def test_in_the_gap_it_is_the_linear_mode():
    """Poles λ of the linear rig: |λ| = ω, -Re λ = ζω but for the damping that couples modes, second order in ζ."""
    poles = condensed.condensed(Model(TABLE1, LAW), "base", [], 1, 8).driven.model.poles().value
    poles = sorted(poles[poles.imag > 0], key=abs)
    for mode, pole in enumerate(poles[:4], 1):
        curve = periodic.follow_backbone(Model(TABLE1, LAW), mode, (1e-5, 1e-4), 3)
        np.testing.assert_allclose(TURN * curve.frequency, abs(pole), rtol=1e-3)
        np.testing.assert_allclose(curve.damping, -pole.real / abs(pole), rtol=2e-3)
        assert not curve.contact_force.any()
        assert np.allclose(fundamental(curve, curve.clearance)[[0, -1]], (1e-5, 1e-4), rtol=1e-6)


def test_duffing_with_one_harmonic():
    """ω² = 1 + ¾ κ A² (Nayfeh & Mook, Nonlinear Oscillations, 1979, 4.1), ζ = c / 2ω, level of resonance c ω A."""
    curve = periodic.follow_backbone(Model(DUFFING, HARDENING), 1, (0.1, 20.0), 1, 16)
    omega, amplitude = TURN * curve.frequency, fundamental(curve)
    np.testing.assert_allclose(omega**2, 1 + 0.75 * KAPPA * amplitude**2, rtol=1e-7)
    np.testing.assert_allclose(curve.damping, 0.05 / (2 * omega), rtol=1e-7)
    np.testing.assert_allclose(curve.level, 0.05 * omega * amplitude, rtol=1e-7)


def test_duffing_with_many_harmonics():
    """Period 4 K(m) / √(1 + κ X²) with m = κ X² / 2(1 + κ X²), K the complete elliptic integral, X the peak."""
    curve = periodic.follow_backbone(Model(one_mass(gap=1e3), HARDENING), 1, (0.1, 20.0), 11)
    squares = KAPPA * curve.amplitude("displacement")[:, 0] ** 2
    period = 4 * ellipk(squares / (2 * (1 + squares))) / np.sqrt(1 + squares)
    np.testing.assert_allclose(1 / curve.frequency, period, rtol=1e-6)
    np.testing.assert_allclose(curve.damping, 0, atol=1e-9)


def test_between_two_walls():
    """Free motion of 1 kg on a spring k_0 through a gap d, beyond it on k_0 + k: time in the gap and beyond it.

    Beyond, x = x_c + (X - x_c) cos ω_1 t with ω_1² = k_0 + k and x_c = k d / ω_1², to the wall at t_1; within the gap
    from 0 to the wall t_2 = atan(ω_0 d / v) / ω_0 with the speed v there. The period is 4 (t_1 + t_2). A small
    dashpot c of the wall dissipates 4 c ∫ ẋ² dt from 0 to t_1, as much as ζ gives back, 2π ζ ω² |X_1|².
    """
    gap, spring, wall, dashpot = 1e-3, 4e3, 2e4, 0.2
    model = Model(one_mass(spring, gap=gap), ConstantLaw(wall, dashpot))
    curve = periodic.follow_backbone(model, 1, (0.5 * gap, 4 * gap), 41)
    peak = curve.amplitude("clearance_displacement")[:, 0]
    beyond = peak > 1.1 * gap  # where 41 harmonics suffice for short contacts
    assert beyond.sum() > 20
    peak, stiff = peak[beyond], spring + wall
    fast, middle = np.sqrt(stiff), wall * gap / stiff
    outside = np.arccos((gap - middle) / (peak - middle)) / fast
    speed = fast * (peak - middle) * np.sin(fast * outside)
    inside = np.arctan(np.sqrt(spring) * gap / speed) / np.sqrt(spring)
    np.testing.assert_allclose(1 / curve.frequency[beyond], 4 * (outside + inside), rtol=2e-4)
    lost = 4 * dashpot * stiff * (peak - middle) ** 2 * (outside / 2 - np.sin(2 * fast * outside) / (4 * fast))
    known = lost / (TURN * (TURN * curve.frequency * fundamental(curve))[beyond] ** 2)
    np.testing.assert_allclose(curve.damping[beyond], known, rtol=0.02)


def test_a_spring_with_a_slider():
    """Jenkins' element of spring k, friction F: its loop 4 F (X - F/k), its secant stiffness at one harmonic.

    Secant stiffness (k/π) (φ - sin φ cos φ) with cos φ = 1 - 2 F / (k X); T. K. Caughey, J. Appl. Mech. 27 (1960) 640.
    """
    spring, friction = 1000.0, 0.5
    law = ConstantLaw(0.0, 0.0, grease=MaxwellSlip(springs=(spring,), forces=(friction,), elastic=0.0, damping=0.0))
    start = friction / spring
    curve = periodic.follow_backbone(Model(one_mass(4e3), law), 1, (0.5 * start, 20 * start), 1, 2048)
    omega, amplitude = TURN * curve.frequency, fundamental(curve)
    slips = amplitude > 1.05 * start
    angle = np.arccos(np.clip(1 - 2 * start / amplitude, -1, 1))
    secant = np.where(amplitude > start, spring / np.pi * (angle - np.sin(angle) * np.cos(angle)), spring)
    np.testing.assert_allclose(omega**2, 4e3 + secant, rtol=1e-4)
    known = 4 * friction * (amplitude - start) / (TURN * (omega * amplitude) ** 2)
    np.testing.assert_allclose(curve.damping[slips], known[slips], rtol=2e-3)
    assert np.abs(curve.damping[amplitude < 0.99 * start]).max() < 1e-8


@pytest.mark.parametrize(("law", "level"), [(LAW, 12.0), (ConstantLaw(7.8e3, 4.0, grease=SLIDERS), 4.0)])
def test_forced_vibrations_in_resonance_lie_on_it(law, level, measured):
    """Frequency and level of the largest displacement at the clearance, which lies some ζ² below resonance."""
    curve = periodic.follow_backbone(Model(TABLE1, law), 2)
    assert not curve.ended and np.all(np.diff(fundamental(curve)) > 0)
    branch = periodic.follow_response(Model(TABLE1, law), level, (32, 56), stability=False)
    largest = np.abs(branch.clearance_displacement[:, 0, 1])
    i = largest.argmax()
    frequency = np.interp(largest[i], fundamental(curve), curve.frequency)
    needed = np.interp(largest[i], fundamental(curve), curve.level)
    name = f"backbone of mode 2{' with sliders' if law is not LAW else ''}, {level:g} m/s²"
    measured.below(f"{name}: frequency", abs(frequency / branch.frequency[i] - 1), 1e-2, "largest forced vibration")
    measured.below(f"{name}: level", abs(needed / level - 1), 1e-2, "largest forced vibration")


def cycles(signal, fs):
    """Amplitude of the fundamental and frequency, Hz, of each cycle between upward zero crossings."""
    up = np.flatnonzero((signal[:-1] < 0) & (signal[1:] >= 0))
    begun = up - signal[up] / (signal[up + 1] - signal[up])
    fraction = np.arange(512) / 512
    at = begun[:-1, None] + fraction * np.diff(begun)[:, None]
    rows = np.interp(at, np.arange(signal.size), signal)
    return 2 * np.abs(rows @ np.exp(-2j * np.pi * fraction)) / fraction.size, fs / np.diff(begun)


@pytest.mark.slow
def test_a_free_decay_follows_it(measured):
    """The modal engine's march: swept up along the first mode, then the base stops.

    Where frequency changes with amplitude, the action ω |q|² decays with 2ζω, not the amplitude squared; q moves as the
    tip, the clearance less so as walls hold it.
    """
    curve = periodic.follow_backbone(Model(TABLE1, LAW), 1)
    level, fs, swept = 0.3, 4096.0, 25.0
    resonance = np.interp(level, curve.level, curve.frequency)
    time = np.arange(int((swept + 2) * fs)) / fs
    frequency = np.minimum(8.5 + (resonance - 8.5) * time / swept, resonance)
    base = level * np.minimum(time, 1) * np.cos(TURN * np.cumsum(frequency) / fs) * (time < swept)
    response = simulate(TABLE1, Excitation(base, fs), LAW, Modal(resolution=0.25))
    rest = slice(int(swept * fs), None)
    amplitude, pace = cycles(response.displacement[curve.clearance, rest], fs)
    known = np.interp(amplitude, fundamental(curve, curve.clearance), curve.frequency)
    assert amplitude[0] > 2 * TABLE1.bushings[0].gap > 3 * amplitude[-1]
    off = np.abs(pace / known - 1).max()
    measured.below("backbone of mode 1: frequency of a free decay", off, 5e-3, "modal engine's march")
    acceleration, pace = cycles(response.acceleration[7, rest], fs)
    tip = acceleration / (TURN * pace) ** 2
    of_curve = np.abs(curve.displacement[:, 7, 1])
    beyond = int(np.sum(np.interp(tip, of_curve, fundamental(curve, curve.clearance)) > TABLE1.bushings[0].gap))
    assert beyond > 8
    lost = np.log(pace[0] * tip[0] ** 2 / (pace[beyond] * tip[beyond] ** 2))
    damping = np.interp(tip, of_curve, curve.damping)
    off = abs(lost / (TURN * np.sum(damping[:beyond] + damping[1 : beyond + 1])) - 1)
    measured.below("backbone of mode 1: damping of a free decay beyond the gap", off, 3e-2, "modal engine's march")


def test_where_no_next_vibration_is_found_the_curve_so_far_is_kept(monkeypatch):
    monkeypatch.setattr(continuation.Continuation, "pieces", until(2e-4))
    curve = periodic.follow_backbone(Model(TABLE1, LAW), 1, (1e-4, 1e-3), 3)
    last = fundamental(curve, curve.clearance)[-1]
    assert 2e-4 < last < 2.2e-4
    assert curve.ended == f"no further periodic vibration was found beyond an amplitude of {last:.6g} m"


def test_it_may_begin_beyond_the_gap():
    """What lies between is followed, but not shown."""
    whole = periodic.follow_backbone(Model(TABLE1, LAW), 2, (1e-4, 6e-4), 5)
    part = periodic.follow_backbone(Model(TABLE1, LAW), 2, (5e-4, 6e-4), 5)
    assert fundamental(part)[0] == pytest.approx(5e-4, rel=1e-9)
    between = np.interp(5e-4, fundamental(whole), whole.frequency)
    assert part.frequency[0] == pytest.approx(between, rel=1e-3)


TWO_MASSES = Matrices("m-kg-s", mass=np.eye(2), stiffness=np.diag([1.0, 4.0]), dofs=["1:X", "2:X"])


@pytest.mark.parametrize(("change", "error", "words"), [
    ({"mode": 0}, ClearanceError, "mode must be between 1 and 8, as many as the Ritz basis has, got 0"),
    ({"mode": 9}, ClearanceError, "mode must be between 1 and 8"),
    ({"mode": 1.5}, ClearanceError, "mode must be a whole number, got 1.5"),
    ({"amplitude_range": (0.0, 1e-3)}, ClearanceError, "must be > 0 m and the second one larger, got 0 and"),
    ({"amplitude_range": (1e-3, 1e-4)}, ClearanceError, "amplitude_range must be > 0 m and the second one larger"),
    ({"amplitude_range": (1e-3, float("nan"))}, ClearanceError, "amplitude_range must be > 0 m"),
    ({"amplitude_range": 1e-3}, ClearanceError, r"amplitude_range is a pair \(from, to\) in m"),
    ({"n_harmonics": 0}, ClearanceError, "harmonics must be 1 or more"),
    ({"model": Model(one_mass(gap=1e-3).replace(structure=TWO_MASSES), LAW), "mode": 2}, ClearanceError,
     "mode 2 moves no clearance, so it is linear"),
    *REFUSED,
])  # fmt: skip
def test_refusals(change, error, words):
    assert_refused(error, words, periodic.follow_backbone, **{"model": Model(TABLE1, LAW), **change})


def test_figure_and_dataset():
    curve = periodic.follow_backbone(Model(TABLE1, LAW), 2, (1e-4, 6e-4), 5)
    branch = periodic.follow_response(Model(TABLE1, LAW), 4.0, (42, 50), 5, stability=False)
    above, below = curve.plot("acceleration", 7, [branch]).axes
    forced, free = above.lines
    assert forced.get_label() == "4 m/s²"
    np.testing.assert_array_equal(forced.get_xdata(), branch.amplitude("acceleration")[:, 7])
    np.testing.assert_array_equal(free.get_ydata(), curve.frequency)
    np.testing.assert_array_equal(free.get_xdata(), curve.amplitude("acceleration")[:, 7])
    np.testing.assert_array_equal(below.lines[0].get_ydata(), 100 * curve.damping)
    assert below.get_xlabel() == "amplitude of the acceleration of 8:+Z (m/s²)"
    assert_refused(ClearanceError, "rows must be between 0 and 1", curve.plot, row=2)
    labelled = curve.to_xarray()
    assert labelled.displacement.dims == ("point", "response", "harmonic")
    assert labelled.sel(response="8:+Z", harmonic=1).displacement.values == pytest.approx(curve.displacement[:, 7, 1])
    assert labelled.level.attrs["units"] == "m s-2" and labelled.attrs["of"] == curve.clearances[curve.clearance]
