"""Figures of whirl: orbits in their clearances, full spectra, cascades over speed; one panel for each point."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from ..core.drawing import COLOURS, FONT, REPEAT, TEST, WIDTH, canvas, key, of_curves, tidy

__all__ = ["cascade_figure", "frequency_limit", "full_spectrum_figure", "orbit_figure"]

MICRO = 1e6  # µm, in which orbits are drawn
DECADES, SHADES = 4.0, 3.0  # of amplitudes that are drawn below the largest: as a curve, and in colours
ORDERS = 5.0  # multiples of the spin that are drawn to each side
RPM = 30 / np.pi
WALL: dict[str, Any] = {"color": TEST, "lw": 0.9}
PATH: dict[str, Any] = {"color": COLOURS[0], "lw": 0.7}
MARK: dict[str, Any] = {"color": COLOURS[1], "marker": "o", "ls": "", "ms": 3.5, "mew": 0}
ONCE: dict[str, Any] = {"color": COLOURS[2], "lw": 1.2, "ls": (0, (4, 1.5))}
BEHIND: dict[str, Any] = {"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.8}
SPIN: dict[str, Any] = {"color": COLOURS[1], "lw": 0.8, "ls": "--"}


# Orbits and spectra draw themselves with these functions, so their modules import this one.
Orbits: TypeAlias = Any
"""`orbits.Orbits`"""
Spectrum: TypeAlias = Any
"""A `FullSpectrum`"""
Cascade: TypeAlias = Any
"""A `SpeedCascade`"""


def orbit_figure(orbits: Mapping[str, Orbits | np.ndarray], gaps: Mapping[str, float]) -> Figure:
    """Draw orbits, by the names of their points, each in a circle of its radial gap (m) where that is known.

    Of a shaft that does not turn it is a path (2, n) along y and z, m, without marks.
    """
    columns = min(len(orbits), 3)
    rows = -(-len(orbits) // columns)
    figure = canvas(0.45 + rows * min(WIDTH / columns, 3.6), WIDTH)
    axes = np.ravel(figure.subplots(rows, columns, squeeze=False))
    for ax in axes[len(orbits) :]:
        ax.axis("off")
    turning = False
    for ax, (name, orbit) in zip(axes, orbits.items()):
        if isinstance(orbit, np.ndarray):
            path, words = orbit, ""
        else:
            path, words, turning = _draw_turns(ax, orbit), _turns(orbit), True
        _draw_orbit(ax, (": " if columns < 3 else "\n").join(filter(None, (name, words))), MICRO * path, gaps.get(name))
    looks = {"wall": WALL} if gaps else {}
    looks |= {"orbit": PATH} | ({"once-per-turn mark": MARK, "1X, mean of the turns": ONCE} if turning else {})
    key(figure, of_curves(looks))
    return figure


def _draw_turns(ax: Axes, orbits: Orbits) -> np.ndarray:
    """Draw the marks and the mean ellipse of a turning shaft, and return its path."""
    ax.plot(*MICRO * orbits.filtered().path(), **ONCE, zorder=3)
    ax.plot(*MICRO * orbits.marks, **MARK, zorder=4)
    return np.concatenate((*orbits.position,), axis=1)


def _draw_orbit(ax: Axes, title: str, path: np.ndarray, gap: float | None) -> None:
    ax.plot(*path, **PATH)
    reach = float(np.abs(path).max())
    if gap is not None:
        turn = np.linspace(0, 2 * np.pi, 361)
        ax.plot(MICRO * gap * np.cos(turn), MICRO * gap * np.sin(turn), **WALL)
        reach = max(reach, MICRO * gap)
    reach = 1.08 * reach or 1.0
    ax.set(xlim=(-reach, reach), ylim=(-reach, reach))
    ax.set_aspect("equal")
    tidy(ax, title, "z (µm)", "y (µm)")


def _turns(orbits: Orbits) -> str:
    n = len(orbits.time)
    return f"{n} turn{'s' * (n > 1)} at {_rpm(orbits.speed)} rev/min"


def _rpm(speed: np.ndarray) -> str:
    low, high = RPM * speed.min(), RPM * speed.max()
    return f"{low:.4g}" if high - low < 5e-3 * abs(high) else f"{low:.4g} to {high:.4g}"


def full_spectrum_figure(spectra: Mapping[str, Spectrum], spin: float | None = None) -> Figure:
    """Draw full spectra, by the names of their points, one above the other; lines of the spin (rad/s) where known."""
    figure = canvas(0.5 + 1.9 * len(spectra))
    axes = np.ravel(figure.subplots(len(spectra), 1, sharex=True, squeeze=False))
    first = next(iter(spectra.values()))
    highest = frequency_limit(first.frequency, spin)
    sense = -1.0 if spin is not None and spin < 0 else 1.0
    for ax, (name, spectrum) in zip(axes, spectra.items()):
        ax.plot(sense * spectrum.frequency, MICRO * spectrum.amplitude, color=COLOURS[0], lw=0.9)
        top = MICRO * spectrum.amplitude.max() or 1.0
        ax.set(yscale="log", ylim=(top * 10**-DECADES, 2 * top))
        _mark_orders(ax, spin, highest)
        tidy(ax, name, "Amplitude (µm)")
        ax.set_xlim(-highest, highest)
    axes[-1].set_xlabel(f"Frequency (Hz): {_sides(spin)}", fontsize=FONT)
    windows = f"mean of {first.averages} windows" if first.averages > 1 else "one window"
    words = f"lines every {first.resolution:.3g} Hz, {first.window} window, {windows}"
    axes[0].set_title(words, fontsize=FONT - 1, loc="right", pad=3, color=REPEAT)
    figure.align_ylabels(axes)
    return figure


def _sides(spin: float | None) -> str:
    return "z to y on the left, y to z on the right" if spin is None else "backward on the left, forward on the right"


def _mark_orders(ax: Axes, spin: float | None, highest: float) -> None:
    if spin is None or not spin:
        return
    hz = abs(spin) / (2 * np.pi)
    for n in (-1, 1):
        if hz <= highest:
            ax.axvline(n * hz, **SPIN)
            ax.annotate(f"{n}X".replace("-", "−"), (n * hz, 1), xycoords=("data", "axes fraction"), fontsize=FONT - 1,
                        xytext=(2, -2), textcoords="offset points", va="top", color=COLOURS[1])  # fmt: skip


def frequency_limit(frequency: np.ndarray, spin: float | None) -> float:
    """Return the highest frequency that is drawn, Hz: five times the spin (rad/s), if there are lines so far."""
    last = float(frequency[-1])
    return min(last, ORDERS * abs(spin) / (2 * np.pi)) if spin else last


def cascade_figure(cascades: Mapping[str, Cascade], highest: float | None = None) -> Figure:
    """Draw amplitudes over frequency and speed, by the names of points, one above the other, to a frequency (Hz)."""
    figure = canvas(0.4 + 2.9 * len(cascades))
    axes = np.ravel(figure.subplots(len(cascades), 1, sharex=True, squeeze=False))
    first = next(iter(cascades.values()))
    fastest = first.speed[np.argmax(np.abs(first.speed))]
    limit = frequency_limit(first.frequency, fastest) if highest is None else min(highest, float(first.frequency[-1]))
    for ax, (name, cascade) in zip(axes, cascades.items()):
        bar = figure.colorbar(_draw_cascade(ax, cascade, limit, fastest < 0), ax=ax, pad=0.01)
        bar.set_label("Amplitude (µm)", fontsize=FONT)
        bar.ax.tick_params(labelsize=FONT - 1)
        tidy(ax, name, "Spin (rev/min)")
        ax.grid(False)
        ax.set_xlim(-limit, limit)
    axes[-1].set_xlabel(f"Frequency (Hz): {_sides(fastest)}", fontsize=FONT)
    words = f"lines every {first.resolution:.3g} Hz, {first.window} window"
    axes[0].set_title(words, fontsize=FONT - 1, loc="right", pad=3, color=REPEAT)
    return figure


def _draw_cascade(ax: Axes, cascade: Cascade, highest: float, reverse: bool) -> QuadMesh:
    is_drawn = np.abs(cascade.frequency) <= highest
    order = np.argsort(cascade.speed, kind="stable")
    rpm = RPM * cascade.speed[order]
    amplitude = MICRO * cascade.amplitude[order][:, is_drawn]
    top = amplitude.max() or 1.0
    frequency = (-1.0 if reverse else 1.0) * cascade.frequency[is_drawn]
    norm = LogNorm(top * 10**-SHADES, top)
    floor = np.maximum(amplitude, top * 10**-SHADES)
    mesh = ax.pcolormesh(frequency, rpm, floor, norm=norm, cmap="Blues", shading="nearest", rasterized=True)
    for n in (-2, -1, 1, 2):
        hz = n * np.abs(rpm) / 60
        inside = np.abs(hz) <= highest
        if inside.any():
            ax.plot(hz[inside], rpm[inside], color=COLOURS[1], lw=0.7, ls="--" if abs(n) == 1 else ":")
            ax.annotate(f"{n}X".replace("-", "−"), (hz[inside][-1], rpm[inside][-1]), fontsize=FONT - 1,
                        xytext=(2, -8), textcoords="offset points", color=COLOURS[1], bbox=BEHIND)  # fmt: skip
    return mesh
