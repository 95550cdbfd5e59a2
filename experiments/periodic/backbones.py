"""Backbones of the Table-1 rig's first two modes beside a free decay and forced vibrations, and how fast they are."""

import sys
import time
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import clearance_mj as cm
from experiments.script import run

ROOT = Path(__file__).parents[2]
LAW = cm.ConstantLaw(7.8e3, 4.0)
LEVELS = (2.0, 4.0, 8.0, 12.0)  # m/s², of the forced vibrations
SWEPT = 0.3, 25.0  # m/s², s: the sine that brings the first mode to its resonance before the base stops
TIP = 7  # row of the sensor


def cycles(signal: np.ndarray, fs: float) -> tuple[np.ndarray, np.ndarray]:
    """Amplitude of the fundamental and frequency, Hz, of each cycle between upward zero crossings."""
    up = np.flatnonzero((signal[:-1] < 0) & (signal[1:] >= 0))
    begun = up - signal[up] / (signal[up + 1] - signal[up])
    fraction = np.arange(512) / 512
    rows = np.interp(begun[:-1, None] + fraction * np.diff(begun)[:, None], np.arange(signal.size), signal)
    return 2 * np.abs(rows @ np.exp(-2j * np.pi * fraction)) / fraction.size, fs / np.diff(begun)


def decay(rig: cm.Rig, curve: cm.periodic.Backbone) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Amplitude, m, at the curve's clearance, frequency, Hz, and damping ratio over a free decay of the first mode.

    The action ω |q|² decays with 2ζω; q moves as the tip. Damping is the mean of eight cycles.
    """
    level, swept = SWEPT
    fs = 4096.0
    resonance = np.interp(level, curve.level, curve.frequency)
    t = np.arange(int((swept + 4) * fs)) / fs
    frequency = np.minimum(8.5 + (resonance - 8.5) * t / swept, resonance)
    base = level * np.minimum(t, 1) * np.cos(2 * np.pi * np.cumsum(frequency) / fs) * (t < swept)
    response = cm.simulate(rig, cm.Excitation(base, fs), LAW, "modal")
    rest = slice(int(swept * fs), None)
    amplitude, pace = cycles(response.displacement[curve.clearance, rest], fs)
    acceleration, tips = cycles(response.acceleration[TIP, rest], fs)
    count = min(amplitude.size, tips.size)
    action = np.log(acceleration[:count] ** 2 / tips[:count] ** 3)
    return amplitude[4 : count - 4], pace[4 : count - 4], ((action[:-8] - action[8:]) / (8 * 4 * np.pi))


def draw(rig: cm.Rig) -> Figure:
    """The first mode with a free decay, the second one with forced vibrations."""
    figure = Figure(figsize=(9, 5), layout="constrained")
    axes = figure.subplots(2, 2, sharex="col")
    for column, mode in enumerate((1, 2)):
        begun = time.perf_counter()
        curve = cm.periodic.follow_backbone(cm.Model(rig, LAW), mode)
        print(f"mode {mode}: {curve.frequency.size / (time.perf_counter() - begun):.0f} points/s")
        row, (above, below) = curve.clearance, axes[:, column]
        gap = rig.bushings[row].gap
        if mode == 1:
            amplitude, frequency, damping = decay(rig, curve)
            above.plot(amplitude / gap, frequency, ".", color="C1", label="free decay, marched")
            below.plot(amplitude / gap, 100 * damping, ".", color="C1")
        for level in LEVELS if mode == 2 else ():
            branch = cm.periodic.follow_response(cm.Model(rig, LAW), level, (30.0, 60.0), stability=False)
            displacement = np.abs(branch.clearance_displacement[:, row, 1]) / gap
            above.plot(displacement, branch.frequency, lw=1, label=f"{level:g} m/s²")
        displacement = np.abs(curve.clearance_displacement[:, row, 1]) / gap
        above.plot(displacement, curve.frequency, "k", label=f"mode {mode}")
        below.plot(displacement, 100 * curve.damping, "k")
        above.set_ylabel("frequency (Hz)")
        below.set(ylabel="damping ratio (%)", xlabel=f"displacement at bushing {row + 1} over its gap")
        above.legend(fontsize=7)
    return figure


def main(out: Path = ROOT / "docs" / "periodic_backbone.png") -> None:
    """Make the figure of docs/periodic.md."""
    draw(cm.Rig.load(ROOT / "models" / "table1_rig.toml")).savefig(out, dpi=110)


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
