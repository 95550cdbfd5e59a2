"""Which items there are. A new one is one line in `ITEMS`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module

from clearance_mj.errors import ClearanceError

from .result import Result

__all__ = ["ITEMS", "get_item", "select"]

ITEMS = {
    "figure_01": "experiments.article.figure_01",
    "figure_02": "experiments.article.figure_02",
    "figure_03": "experiments.article.figure_03",
    "figure_04": "experiments.article.figure_04",
    "figure_05": "experiments.article.figure_05",
    "figure_06": "experiments.article.figure_06",
    "figure_07": "experiments.article.figure_07",
    "figure_08": "experiments.article.figure_08",
    "figure_09": "experiments.article.figure_09",
    "figure_10": "experiments.article.figure_10",
    "figure_11": "experiments.article.figure_11",
    "figure_12": "experiments.article.figure_12",
    "figure_13": "experiments.article.figure_13",
    "table_1": "experiments.article.table_1",
    "table_2": "experiments.article.table_2",
    "table_3": "experiments.article.table_3",
    "table_4": "experiments.article.table_4",
    "table_5": "experiments.article.table_5",
    "calibrate_table1": "experiments.article.calibrate_table1",
    "sensor_placement": "experiments.article.sensor_placement",
    "modal_links_rig": "experiments.article.modal_links_rig",
    "motion_control": "experiments.article.motion_control",
}
"""Module of each item by its name, in the order of the index page"""


def get_item(name: str) -> Callable[..., Result]:
    """Return the function that computes an item.

    Parameters
    ----------
    name : str
        Such as "figure_02".

    Returns
    -------
    callable
        ``run(context, **parameters)``.

    Raises
    ------
    ClearanceError
        For an unknown name; the message lists the known ones.
    """
    if name not in ITEMS:
        raise ClearanceError(f'item "{name}" is unknown; known: all, {", ".join(ITEMS)}')
    return import_module(ITEMS[name]).run


def select(names: Sequence[str]) -> list[str]:
    """Return the names in the order of `ITEMS`, each once; all of them for none or for "all".

    Parameters
    ----------
    names : sequence of str
        As the command line takes them.

    Raises
    ------
    ClearanceError
        For an unknown name.
    """
    for name in names:
        if name != "all":
            get_item(name)
    return [name for name in ITEMS if name in names or "all" in names or not names]
