"""Frequency and damping over amplitude from a free decay. Of signals whose frequency and damping are known formulas."""

import numpy as np

from clearance_mj import RecordError, identify
from clearance_mj.signals.free_decay import decay

from ..refusals import assert_refused

FS = 2048.0
TIME = np.arange(8192) / FS


def test_a_linear_decay(measured):
    """e^{-ζωt} cos ωt: 80 Hz and 0.2 % at every amplitude."""
    omega, ratio = 2 * np.pi * 80, 0.002
    signal = 30 * np.exp(-ratio * omega * TIME) * np.cos(omega * TIME)
    trace = decay(identify.ridge(signal, FS, (70, 90), 12.0), 0.2, FS)
    assert trace.time.size >= 15
    measured.below("linear decay: largest error of the frequency (Hz)", np.abs(trace.frequency - 80).max(), 1e-3, "80")
    measured.below("linear decay: largest error of the damping", np.abs(trace.damping - ratio).max(), 1e-5, "0.002")
    np.testing.assert_allclose(trace.amplitude, 30 * np.exp(-ratio * omega * trace.time), rtol=1e-3)


def test_a_friction_decay(measured):
    """A' = -a - bA from A(0) = 10, ω = 2π (80 - 0.02 A): ζ = (a/A + b)/ω, whatever the time."""
    a, b, start = 0.8, 0.5, 10.0
    amplitude = (start + a / b) * np.exp(-b * TIME) - a / b
    phase = 2 * np.pi * (80 * TIME - 0.02 * ((start + a / b) / b * (1 - np.exp(-b * TIME)) - a / b * TIME))
    trace = decay(identify.ridge((amplitude * np.cos(phase))[amplitude > 1], FS, (70, 90), 12.0), 0.2, FS)
    known = 80 - 0.02 * trace.amplitude
    error = np.abs(trace.frequency - known).max()
    measured.below("decay by friction: largest error of the frequency (Hz)", error, 2e-3, "80 - 0.02 A")
    error = np.abs(trace.damping / ((a / trace.amplitude + b) / (2 * np.pi * known)) - 1).max()
    measured.below("decay by friction: largest relative error of the damping", error, 0.01, "(a/A + b)/ω")


def test_what_the_impact_leaves_averages_out():
    """A mode at 300 Hz, twenty times as high, begins with it: the ridge's frequency beats, the windows' does not."""
    struck = np.where(TIME > 0.5, np.cos(2 * np.pi * 80 * TIME) + 20 * np.sin(2 * np.pi * 300 * TIME), 0.0)
    line = identify.ridge(struck * np.exp(-TIME), FS, (70, 90), 12.0)
    trace = decay(line, 0.15, FS)
    assert np.abs(line.omega[line.valid] / (2 * np.pi * 80) - 1).max() > 10 * np.abs(trace.frequency / 80 - 1).max()
    assert np.abs(trace.frequency / 80 - 1).max() < 2e-4


def test_refused():
    line = identify.ridge(np.exp(-TIME) * np.cos(2 * np.pi * 80 * TIME), FS, (70, 90))
    assert_refused(RecordError, "at least 8 are needed", decay, line, 0.001, FS)
    assert_refused(RecordError, "as long as a window", decay, line, 5.0, FS)
