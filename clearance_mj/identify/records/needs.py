"""Needs of identification methods, checked on the rig and the records' channels before anything is computed.

A method names its needs where it is registered; each is a function of the dataset that says what is lacking.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ...io.dataset import Dataset, Record

__all__ = ["Need", "more_sensors_than_clearances", "probes", "probes_in_longest"]

Need = Callable[[Dataset], str]
"""Function that returns in words what a dataset lacks; "" where it lacks nothing."""


def probes(dataset: Dataset) -> str:
    """Need a displacement probe at every clearance in every record to identify.

    Parameters
    ----------
    dataset : Dataset
        Rig and records.
    """
    return _without_probes(dataset.to_identify())


def probes_in_longest(dataset: Dataset) -> str:
    """Need a displacement probe at every clearance in the longest record to identify.

    Parameters
    ----------
    dataset : Dataset
        Rig and records.
    """
    return _without_probes([max(dataset.to_identify(), key=lambda record: record.duration)])


def _without_probes(records: Sequence[Record]) -> str:
    for record in records:
        if missing := record.missing_probes:
            where = ", ".join(f"bushings[{j}] (displacement at node {label.split(':')[0]})" for j, label in missing)
            return f'it needs a displacement probe at every bushing, and record "{record.name}" has none at {where}'
    return ""


def more_sensors_than_clearances(dataset: Dataset) -> str:
    """Need more sensors than clearances; probes count where every record to identify has all.

    Parameters
    ----------
    dataset : Dataset
        Rig and records.
    """
    rig = dataset.rig
    clearances, sensors = len(rig.bushings), len(rig.sensors)
    if not any(record.missing_probes for record in dataset.to_identify()):
        sensors += clearances
    if sensors > clearances:
        return ""
    return (
        f"it needs more sensors than clearances to tell the rig from the unknown forces there, and there are {sensors} "
        f"sensors and {clearances} clearances"
    )
