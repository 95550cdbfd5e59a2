"""What the tables of a study share: its measures, the names of its floor, its engines and units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ...io.dataset import Dataset
    from ...study import Study

__all__ = [
    "FLOOR",
    "MEASURES",
    "N_MODES",
    "OVERALL",
    "Measure",
    "engines",
    "excitation_unit",
    "is_synthetic",
    "main_engine",
]

N_MODES = 4
"""Modes that are compared"""
FLOOR = {"law": "repeat", "engine": "rig"}
"""How `Study.rows` names the second record of a level compared with the first"""


@dataclass(frozen=True)
class Measure:
    """A measure of the agreement of FRFs."""

    key: str
    """name in a comparison's summary"""
    label: str
    """name in tables"""
    unit: str
    """of its values"""
    form: str
    """format of its numbers"""
    perfect: float
    """its value for equal FRFs"""


MEASURES = (
    Measure("rmse_db", "RMSE", "dB", ".2f", 0.0),
    Measure("frac", "FRAC", "", ".4f", 1.0),
    Measure("csac", "CSAC", "", ".4f", 1.0),
    Measure("csf", "CSF", "", ".4f", 1.0),
    Measure("mre", "MRE", "", ".3f", 0.0),
)
"""Of a sensor"""
OVERALL = (
    *MEASURES,
    Measure("relative_error", "frequency error", "", ".2%", 0.0),
    Measure("mac", "MAC", "", ".4f", 1.0),
)
"""Of all sensors, and of the modes"""


def engines(study: Study) -> list[str]:
    """Engines of a study, in the order in which they were asked for.

    Parameters
    ----------
    study : Study
        The study.
    """
    return list(dict.fromkeys(c.engine for c in study.cases))


def main_engine(study: Study) -> str:
    """The engine that tables show where there is room for one: "links" if it was run, else the first.

    Parameters
    ----------
    study : Study
        The study.
    """
    return "links" if "links" in engines(study) else engines(study)[0]


def excitation_unit(study: Study) -> str:
    """Unit of the levels: m/s² for a shaken base, N for a force.

    Parameters
    ----------
    study : Study
        The study.
    """
    return "N" if study.dataset.validate[0].excitation_kind == "force" else "m/s²"


def is_synthetic(dataset: Dataset) -> bool:
    """Whether any record's provenance says that it was computed, not measured.

    Parameters
    ----------
    dataset : Dataset
        The dataset.
    """
    return any("synthetic" in str(r.provenance).lower() for r in dataset.records)
