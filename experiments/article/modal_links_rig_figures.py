"""The figures of `modal_links_rig`."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import pandas as pd
import scipy.ndimage
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D

from clearance_mj.rig import Rig

from .result import BLACK, BLUE, FONT, GREY, ORANGE, VERMILION, panel, sheet

LOOKS = {
    "rig": {"color": BLACK, "lw": 2.2, "alpha": 0.6}, "links": {"color": VERMILION, "lw": 1.2},
    "modal": {"color": BLUE, "lw": 1.2, "ls": "--"}, "modal, no contact": {"color": GREY, "lw": 1.2, "ls": ":"},
}  # fmt: skip
AROUND = 5  # Lines over which variances are averaged before they are drawn
MARKERS = {"rig": "o", "links": "s", "modal": "^", "modal, no contact": "x"}
OPEN = {"color": ORANGE, "marker": "s", "mfc": "none"}


def _legend(figure: Figure, names: Iterable[str]) -> None:
    handles = [Line2D([], [], label=name, marker=MARKERS[name], ms=4, **LOOKS[name]) for name in names]
    figure.legend(handles=handles, loc="outside upper center", ncols=5, fontsize=FONT - 1, frameon=False)


def draw_shapes(rig: Rig, modes: Mapping, macs: pd.DataFrame, setup) -> Figure:
    """Draw mode shapes by (system, level), and MAC matrices of the systems with the rig."""
    figure = sheet(6.4)
    upper, lower = figure.subfigures(2, 1, height_ratios=(1, 1.35))
    low, high = setup.levels[0], setup.levels[-1]
    position = np.array([s.position for s in rig.sensors])
    order, count = np.argsort(position), modes["rig", low].frequency.size
    axes = upper.subplots(1, count, sharey=True, squeeze=False)[0]
    for i, ax in enumerate(axes):
        for name in ("rig", *setup.engines):
            shape = modes[name, low].shape[:, i].real
            sign = np.sign(shape @ modes["rig", low].shape[:, i].real)
            ax.plot(position[order], sign * shape[order], marker=MARKERS[name], ms=3, **LOOKS[name])
        hz = modes["rig", low].frequency[i]
        panel(ax, f"({chr(97 + i)}) mode {i + 1}, {hz:.2f} Hz", "Position (m)", "Shape (1)" if i == 0 else "")
    _legend(figure, ("rig", *setup.engines))
    names = [name for name in ("rig", "links", "modal") if name == "rig" or name in setup.engines]
    grid = lower.subplots(2, len(names), squeeze=False)
    for row, level in zip(grid, (low, high)):
        for ax, name in zip(row, names):
            letter = chr(97 + count + len(names) * (level == high) + names.index(name))
            image = _matrix(ax, macs[(macs["system"] == name) & (macs["level_m_s2"] == level)])
            panel(ax, f"({letter}) rig and {name}, {level:g} m/s²", f"Mode of {name} (Hz)", "Mode of rig (Hz)")
            ax.grid(False)
    bar = lower.colorbar(image, ax=grid, shrink=0.8)
    bar.set_label("MAC (1)", fontsize=FONT)
    bar.ax.tick_params(labelsize=FONT - 1)
    return figure


def _matrix(ax: Axes, macs: pd.DataFrame) -> AxesImage:
    matrix = macs.pivot(index="rig_hz", columns="system_hz", values="mac")
    image = ax.imshow(matrix, vmin=0, vmax=1, cmap="cividis", aspect="auto")
    for (i, j), value in np.ndenumerate(matrix):
        colour = "white" if value < 0.5 else "black"
        ax.text(j, i, f"{value:.2f}", ha="center", va="center", fontsize=FONT - 1.5, color=colour)
    ax.set_xticks(range(matrix.shape[1]), [f"{value:.1f}" for value in matrix.columns])
    ax.set_yticks(range(matrix.shape[0]), [f"{value:.1f}" for value in matrix.index])
    return image


def draw_backbones(rows: pd.DataFrame) -> Figure:
    """Draw natural frequency and damping of each system and mode over level."""
    figure, modes = sheet(4.4), sorted(rows["mode"].unique())
    axes = figure.subplots(2, len(modes), sharex=True, squeeze=False)
    for i, mode in enumerate(modes):
        for name, of_system in rows[rows["mode"] == mode].groupby("system", sort=False):
            style = {"marker": MARKERS[name], "ms": 3.5} | LOOKS[name]
            axes[0, i].semilogx(of_system["level_m_s2"], of_system["frequency_hz"], **style)
            axes[1, i].semilogx(of_system["level_m_s2"], 100 * of_system["damping"], **style)
        panel(axes[0, i], f"({chr(97 + i)}) mode {mode}", "", "Natural frequency (Hz)")
        letter = chr(97 + i + len(modes))
        panel(axes[1, i], f"({letter}) mode {mode}", "Level (m/s² RMS)", "Damping ratio (%)")
        axes[1, i].set_ylim(bottom=0)
        _level_ticks(axes[1, i], of_system["level_m_s2"].tolist())
    _legend(figure, rows["system"].unique())
    return figure


def _level_ticks(ax: Axes, level: list[float]) -> None:
    few = level if len(level) < 4 else level[::2]
    ax.set_xticks(few, [f"{value:g}" for value in few])
    ax.minorticks_off()


def draw_harmonics(rows: pd.DataFrame, gap: float) -> Figure:
    """Draw harmonics of each system over amplitude, and the radial gap in m."""
    figure, orders = sheet(2.8), sorted(rows["harmonic"].unique())
    axes = figure.subplots(1, len(orders), sharex=True, sharey=True)
    for order, ax in zip(orders, axes):
        for name, of_system in rows[rows["harmonic"] == order].groupby("system", sort=False):
            style = {"marker": MARKERS[name], "ms": 3} | LOOKS[name]
            ax.loglog(of_system["amplitude_m_s2"], 1e3 * of_system["displacement_m"], **style)
        ax.axhline(1e3 * gap, color=GREY, lw=0.7)
        label = "Motion in bushing 2 (mm)" if order == 1 else ""
        panel(ax, f"({chr(96 + order)}) harmonic {order}", "Amplitude (m/s²)", label)
    axes[0].set_ylim(bottom=1e-6)
    _legend(figure, rows["system"].unique())
    return figure


def draw_jumps(rows: pd.DataFrame) -> Figure:
    """Draw the motion over frequency, up and down, of each state of the grease and system."""
    states, names = rows["grease"].unique(), rows["system"].unique()
    figure = sheet(2.1 * len(states) + 0.5)
    axes = figure.subplots(len(states), len(names), sharex="row", sharey="row", squeeze=False)
    for i, state in enumerate(states):
        of_state = rows[rows["grease"] == state]
        for j, name in enumerate(names):
            ax = axes[i, j]
            for direction, style in (("up", {"color": BLUE, "marker": "o"}), ("down", OPEN)):
                branch = of_state[(of_state["system"] == name) & (of_state["direction"] == direction)]
                ax.plot(branch["frequency_hz"], 1e3 * branch["displacement_m"], ms=3.5, lw=1, label=direction, **style)
            letter = chr(97 + i * len(names) + j)
            panel(ax, f"({letter}) {name}", "Frequency (Hz)", f"Motion, grease {state} (mm)" if j == 0 else "")
        axes[i, 0].set_ylim(0, 1.08e3 * of_state["displacement_m"].max())
    axes[0, 0].legend(fontsize=FONT - 1, frameon=False)
    return figure


def draw_best_linear(approximations: Mapping, levels: Sequence[float], row: int, node: int) -> Figure:
    """Draw best linear approximations by (system, level) at a sensor, with bands of noise and distortion."""
    names = list(dict.fromkeys(name for name, _ in approximations))
    figure = sheet(0.5 + 1.8 * len(names))
    axes = figure.subplots(len(names), len(levels), sharex=True, sharey=True, squeeze=False)
    for i, name in enumerate(names):
        for j, level in enumerate(levels):
            ax, bla = axes[i, j], approximations[name, level]
            _bands(ax, bla, row, LOOKS[name]["color"])
            if name != "rig":
                rig = approximations["rig", level].frf
                ax.plot(rig.frequency, _decibel(rig.functions[row]), color=BLACK, lw=0.8, alpha=0.6)
            left = f"Sensor {node} (dB re 1)" if j == 0 else ""
            bottom = "Frequency (Hz)" if i == len(names) - 1 else ""
            panel(ax, f"({chr(97 + i * len(levels) + j)}) {name}, {level:g} m/s² RMS", bottom, left)
            ax.set_xscale("log")
            ax.set_xticks([5, 10, 20, 50, 100, 200], ["5", "10", "20", "50", "100", "200"])
            ax.minorticks_off()
    handles = [
        Line2D([], [], color=GREY, lw=6, alpha=0.9, label="± noise of the mean"),
        Line2D([], [], color=GREY, lw=6, alpha=0.35, label="± distortion of one realisation"),
        Line2D([], [], color=GREY, lw=1, ls="--", label="distortion"),
        Line2D([], [], color=GREY, lw=1, ls=":", label="noise"),
        Line2D([], [], color=BLACK, lw=0.8, alpha=0.6, label="rig"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=5, fontsize=FONT - 1, frameon=False)
    return figure


def _bands(ax, bla, row, colour):
    """Magnitude with its bands, and their levels by themselves."""
    hz, size = bla.frf.frequency, np.abs(bla.frf.functions[row])
    noise, distortion = (np.sqrt(_smooth(v[row, 0])) for v in (bla.noise_variance, bla.distortion_variance))
    for spread, alpha in ((distortion, 0.3), (noise, 0.7)):
        low, high = (_decibel(np.maximum(size + s * spread, 0.05 * size)) for s in (-1, 1))
        ax.fill_between(hz, low, high, color=colour, alpha=alpha, lw=0)
    ax.plot(hz, _decibel(size), color=colour, lw=0.9)
    ax.plot(hz, _decibel(np.where(distortion > 0, distortion, np.nan)), color=colour, lw=0.6, ls="--", alpha=0.8)
    ax.plot(hz, _decibel(noise), color=colour, lw=0.6, ls=":", alpha=0.8)
    ax.set_ylim(-80, 40)


def _smooth(variance) -> np.ndarray:
    """Mean over the lines next to each."""
    return scipy.ndimage.uniform_filter1d(variance, AROUND, mode="nearest")


def _decibel(value) -> np.ndarray:
    return 20 * np.log10(np.maximum(np.abs(value), 1e-12))
