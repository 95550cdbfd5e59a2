"""Loops of a drive: the load's torque and angle error over the motor's angle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..core.drawing import COLOURS, REPEAT
from .drive import Drive
from .record import DriveRecord

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw_loops", "draw_runs"]


def draw_loops(axes: Sequence[Axes], record: DriveRecord, drive: Drive) -> None:
    """Draw the load of a run, measured and predicted by a drive from the motor's end.

    Parameters
    ----------
    axes : sequence of Axes
        Two: of the torque, and of the angle less ratio times the motor's.
    record : DriveRecord
        Where it has a load's end, that is drawn too.
    drive : Drive
        The model.
    """
    x, lines = np.degrees(record.motor_angle), ((record.load_angle, record.load_torque), drive.follow(record))
    styles = ((REPEAT, 2.0, "measured"), (COLOURS[1], 0.8, "from the motor's end"))
    for (angle, torque), (colour, width, label) in zip(lines, styles):
        if torque is not None:
            axes[0].plot(x, torque, color=colour, lw=width, label=label)
        if angle is not None:
            deviation = np.degrees(angle - drive.zero - drive.ratio * record.motor_angle)
            axes[1].plot(x, deviation, color=colour, lw=width, label=label)
    axes[0].set_ylabel("load's torque, N m")
    axes[1].set_ylabel("load's angle less ratio x\nmotor's, degrees")


def draw_runs(records: Sequence[DriveRecord], drive: Drive) -> Figure:
    """Return a figure with a row for each run.

    Parameters
    ----------
    records : sequence of DriveRecord
        The runs.
    drive : Drive
        The model.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 2.6 * len(records)), layout="constrained")
    rows = figure.subplots(len(records), 2, squeeze=False)
    for axes, record in zip(rows, records):
        draw_loops(axes, record, drive)
        axes[0].set_title(record.name, fontsize=9)
    for ax in rows[-1]:
        ax.set_xlabel("motor's angle, degrees")
    rows[0, 0].legend(fontsize=7)
    return figure
