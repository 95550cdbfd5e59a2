"""Labels and units of an excitation's level and frequency, for figures, tables and text."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["LevelAxis", "level_axis", "parameter_axis"]


class LevelAxis(NamedTuple):
    """Labels of the level and frequency of one kind of excitation."""

    unit: str  #: of its level, in words behind a number
    symbol: str  #: of its level, in labelled data and tables
    level: str  #: label of its level
    frequency: str  #: label of its frequency
    title: str  #: of its level, on figures of reports


FREQUENCY = "frequency (Hz)"
AXES = {
    "base": LevelAxis("m/s²", "m s-2", "level (m/s²)", FREQUENCY, "Amplitude of the excitation (m/s²)"),
    "force": LevelAxis("N", "N", "level (N)", FREQUENCY, "Amplitude of the excitation (N)"),
    "unbalance": LevelAxis(
        "× unbalance", "1", "unbalance over the rig's", "turns in a second (Hz)", "Unbalance over the rig's"
    ),
}

SHARES = {"load": ("constant loads over the rig's", "× loads"), "gap": ("gaps over the rig's", "× gaps")}


def parameter_axis(over: str, kind: str) -> tuple[str, str]:
    """Return label and unit of a branch's continuation parameter.

    Parameters
    ----------
    over : str
        As of a `Branch`.
    kind : str
        Kind of its excitation.
    """
    axis = level_axis(kind)
    return {"frequency": (axis.frequency, "Hz"), "level": (axis.level, axis.unit), **SHARES}.get(
        over, ("speed (rad/s)", "rad/s")
    )


def level_axis(kind: str) -> LevelAxis:
    """Return the labels of an excitation's level and frequency; a whirl, which nothing excites, has those of a force.

    Parameters
    ----------
    kind : str
        "base", "force", "unbalance" or "whirl".
    """
    return AXES.get(kind, AXES["force"])
