"""Pictures of what files hold: ``clearance-mj show FILE --out PICTURE``."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ..core.drawing import COLOURS, canvas, envelope, tidy
from ..core.errors import RecordError
from ..core.units import UNITS
from ..io.channels import UNKNOWN, Channel
from ..io.contents import FileContents
from ..rig import Rig
from ..signals.ema import Modes
from ..signals.frf import FRF
from ..signals.response import Response
from ..signals.spectra import Spectra
from ..structure.geometry import Geometry
from .figures import rig_drawing

__all__ = ["MOST_DRAWN", "contents_figure"]

MOST_DRAWN = 12  # functions in one picture


def contents_figure(obj: object) -> Figure:
    """Draw what a file holds, of many functions the first; of several things modes on their geometry, or the first.

    Parameters
    ----------
    obj : object
        What `clearance_mj.read` returned.

    Raises
    ------
    RecordError
        If it is nothing that can be drawn by itself, such as a law or a dataset.
    """
    if isinstance(obj, FileContents):
        if obj.geometry is not None and len(obj.mode_sets) == 1:
            return obj.geometry.plot(obj.modes)
        return contents_figure(next(iter(obj.parts.values())))
    if isinstance(obj, FRF | Spectra):
        return obj.plot(range(min(MOST_DRAWN, len(obj.labels))))
    if isinstance(obj, Response | Geometry):
        return obj.plot()
    if isinstance(obj, Modes):
        return _modes_figure(obj)
    if isinstance(obj, list):
        return _channels_figure(obj[:MOST_DRAWN])
    if isinstance(obj, Rig):
        return rig_drawing(obj).figure
    raise RecordError(f"a {type(obj).__name__} cannot be drawn by itself; show prints it without --out")


def _channels_figure(channels: Sequence[Channel]) -> Figure:
    figure = canvas(0.3 + 1.3 * len(channels))
    axes = np.ravel(np.asarray(figure.subplots(len(channels), 1, squeeze=False)))
    for ax, channel in zip(axes, channels):
        unit = channel.unit if channel.quantity == UNKNOWN else next(iter(UNITS[channel.quantity]))
        ax.plot(*envelope(channel.time, channel.value), color=COLOURS[0], lw=0.6)
        words = channel.quantity.capitalize() if channel.quantity != UNKNOWN else "Value"
        place = f", {channel.label}" if channel.placed else ""
        tidy(ax, f"{channel.name}{place}", f"{words}\n({unit or 'unknown unit'})", "Time (s)" if ax is axes[-1] else "")
    figure.align_ylabels(axes)
    return figure


def _modes_figure(modes: Modes) -> Figure:
    """Real parts of the shapes, by degree of freedom."""
    count = min(MOST_DRAWN, modes.frequency.size)
    figure = canvas(0.3 + 1.2 * count)
    axes = np.ravel(np.asarray(figure.subplots(count, 1, sharex=True, squeeze=False)))
    for i, ax in enumerate(axes):
        ax.plot(modes.shape[:, i].real, color=COLOURS[0], lw=0.9, marker=".")
        title = f"mode {i + 1}: {modes.frequency[i]:.4g} Hz, damping {100 * modes.damping[i]:.3g} %"
        tidy(ax, title, "Shape (1)", "Degree of freedom, in the order of the file" if ax is axes[-1] else "")
    return figure
