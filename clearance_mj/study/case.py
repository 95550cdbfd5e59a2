"""A case of a study, one law on one engine against one validation record, and what a dataset needs to have any."""

from __future__ import annotations

import dataclasses
from collections import Counter
from dataclasses import dataclass

from ..core.errors import RecordError
from ..core.notes import note
from ..io.dataset import Dataset, Record
from ..signals.comparison import Comparison
from ..signals.ema import Modes
from ..signals.frf import FRF

__all__ = ["LevelModes", "StudyCase", "require_comparable", "single_input_dataset"]


@dataclass(frozen=True, eq=False)
class StudyCase:
    """One law on one engine against one validation record."""

    law: str
    """name"""
    engine: str
    """name"""
    record: Record
    """validation record whose excitation is simulated"""
    frf: FRF
    """the model's"""
    comparison: Comparison
    """of the test's FRFs with the model's"""
    statistics: dict
    """as `contact_statistics`"""


@dataclass(frozen=True, eq=False)
class LevelModes:
    """Modes that all records of a level show well, in one order."""

    of_record: dict[str, Modes]
    """by the record's name, as it shows them"""
    left_out: tuple[str, ...]
    """which modes are not compared and why, in words"""


def require_comparable(dataset: Dataset) -> None:
    """Refuse a dataset without bushings or validation records, or with one of these without level.

    Parameters
    ----------
    dataset : Dataset
        Rig and records.
    """
    if not dataset.validate:
        raise RecordError(f'{dataset.path}: no record has role "validate", so there is nothing to compare with')
    if not dataset.rig.bushings:
        raise RecordError(f"{dataset.path}: the rig has no bushings, so there is no clearance to study")
    for record in dataset.validate:
        if record.level is None and record.excitation_kind != "spin":
            raise RecordError(f'{dataset.path}: record "{record.name}" has no level; validation records need one')


def single_input_dataset(dataset: Dataset) -> Dataset:
    """Return a dataset whose records to compare with have one input, if its rig is in a plane; a note names the others.

    Parameters
    ----------
    dataset : Dataset
        Its records to identify from stay, whatever their input.
    """
    kinds = Counter(record.excitation_kind for record in dataset.validate if record.excitation_kind != "spin")
    if dataset.rig.moves_across or len(kinds) < 2:
        return dataset
    (kept, _), *_ = kinds.most_common()
    excluded = [r for r in dataset.validate if r.excitation_kind not in (kept, "spin")]
    names = ", ".join(record.name for record in excluded)
    note(dataset.path, [f'compared with records of kind "{kept}"; left out {names}, of the other input'])
    return dataclasses.replace(dataset, records=tuple(r for r in dataset.records if r not in excluded))
