"""Loudness over the level of the excitation: figure, rows for CSV, words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
from matplotlib.ticker import LogLocator, StrMethodFormatter

from ..core.drawing import envelope
from ..sound import LoudnessOverLevel, loudness_level
from ..statistics.intervals import CONFIDENCE, two_sided_quantile
from .style import COLOURS, FONT, MARKERS, Drawing, canvas, level_axis, tidy

__all__ = ["draw", "rows", "summary_lines"]

FEWEST = 0.01  # sone: what is softer is drawn there, as nothing


def draw(loudness: Mapping[str, LoudnessOverLevel]) -> Drawing:
    """Return the figure of one design or several: N5 over level, and N(t) at the highest level of each.

    Parameters
    ----------
    loudness : mapping
        By the design's name; the levels' unit is one.
    """
    figure = canvas(3.2)
    left, right = figure.subplots(1, 2, width_ratios=(1, 1.25))
    for i, (name, each) in enumerate(loudness.items()):
        colour = COLOURS[i % len(COLOURS)]
        look = {"color": colour, "marker": MARKERS[i % len(MARKERS)], "ms": 4, "lw": 1.2}
        means = _mean_n5(each)
        middle, low, high = np.maximum(np.array(list(means.values())).T, FEWEST)
        left.plot(list(means), middle, label=name, **look)
        left.vlines(list(means), low, high, color=colour, lw=1.2)
        loudest = each.loudness[int(np.argmax(each.level))]
        label = f"{name}, {max(each.level):g} {each.unit}"
        right.plot(*envelope(loudest.time, loudest.sone), color=colour, lw=0.9, label=label)
    unit = next(iter(loudness.values())).unit
    left.set_yscale("log")
    left.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    left.yaxis.set_minor_locator(LogLocator(subs=(2, 5)))  # more numbers would overlap
    left.yaxis.set_minor_formatter(StrMethodFormatter("{x:g}"))
    level_axis(left, sorted({level for each in loudness.values() for level in each.level}))
    tidy(left, "Exceeded in 5 % of the time", "Loudness N5 (sone)", f"Level ({unit} RMS)")
    tidy(right, "At the highest level", "Loudness N(t) (sone)", "Time (s)")
    right.set_ylim(bottom=0)
    for ax in (left, right):
        ax.legend(fontsize=FONT - 1, frameon=False)
    caption = "Loudness by ISO 532-1 of what the plate radiates: over level, and over time at the highest level."
    if any(len({*each.level}) < len(each.level) for each in loudness.values()):
        caption += " Vertical lines: 95 % intervals of the mean of several noises or designs."
    return Drawing("loudness", figure, caption, f"{caption} {' '.join(summary_lines(loudness))}")


def _mean_n5(loudness: LoudnessOverLevel) -> dict[float, tuple[float, float, float]]:
    """Return mean N5 of the sounds of each level, sone, levels rising, with Student's 95 % interval; nan for one."""
    means = {}
    for level in sorted({*loudness.level}):
        n5 = loudness.n5[np.equal(loudness.level, level)]
        n, mean = n5.size, n5.mean()
        half = two_sided_quantile(CONFIDENCE, n - 1) * n5.std(ddof=1) / np.sqrt(n) if n > 1 else np.nan
        means[level] = float(mean), float(np.maximum(mean - half, 0.0)), float(mean + half)
    return means


def rows(loudness: Mapping[str, LoudnessOverLevel]) -> pd.DataFrame:
    """Return a row for each design and level.

    Parameters
    ----------
    loudness : mapping
        By the design's name.
    """
    table = []
    for name, each in loudness.items():
        means = _mean_n5(each)
        for level, sound, heard in zip(each.level, each.sound, each.loudness):
            row = {
                "design": name, "level": level, "level_unit": each.unit, "sound_pressure_level_db": sound.level,
                "loudness_n5_sone": heard.n5, "loudness_max_sone": heard.maximum, "loudness_level_phon": heard.phon,
            }  # fmt: skip
            if len(means) < len(each.level):
                row |= zip(("mean_n5_sone", "mean_n5_low_sone", "mean_n5_high_sone"), means[level])
            table.append(row)
    return pd.DataFrame(table)


def summary_lines(loudness: Mapping[str, LoudnessOverLevel]) -> Iterator[str]:
    """Yield a line for each design on its loudness at its lowest and highest level, and which of two is louder.

    Parameters
    ----------
    loudness : mapping
        By the design's name.
    """
    for name, each in loudness.items():
        said, means = [], _mean_n5(each)
        for level in sorted({min(means), max(means)}):
            middle, low, high = means[level]
            words = f"{middle:.3g} sone ({loudness_level(middle):.0f} phon) at {level:g} {each.unit}"
            single = each.n5[np.equal(each.level, level)]
            if single.size > 1:
                words += f", the mean of {single.size} from {single.min():.3g} to {single.max():.3g}, "
                words += f"its 95 % interval {low:.3g} to {high:.3g}"
            said.append(words)
        yield f"{name}: {'; '.join(said)}."
    if len(loudness) == 2:
        (a, first), (b, second) = loudness.items()
        if common := sorted(set(first.level) & set(second.level)):
            first_n5, other = (_mean_n5(each)[common[-1]][0] for each in (first, second))
            if first_n5 > 0 and other > 0:
                yield f"At {common[-1]:g} {first.unit}, {b} is {other / first_n5:.3g} times as loud as {a}."
