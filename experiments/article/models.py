"""Names and looks of the models. The article's figures have the initial model blue, the updated one black and the
test red; here the models between them have colours of their own.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from clearance_mj import FRF, RecordError, Rig, Sensor
from clearance_mj.study import Study, StudyCase

from .result import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILION


@dataclass(frozen=True)
class Model:
    """A law's name in words and its looks."""

    label: str  #: name in legends and tables
    line: dict[str, Any]  #: keywords of a line


MODELS = {
    "nominal": Model("initial (datasheet)", {"color": SKY, "lw": 1.0}),
    "constant": Model("initial (best constants)", {"color": BLUE, "lw": 1.0}),
    "ridge-as-printed": Model("updated (ridge as printed)", {"color": ORANGE, "lw": 1.0}),
    "ridge": Model("updated (ridge corrected)", {"color": GREEN, "lw": 1.0, "ls": "--"}),
    "amplitude": Model("updated (over amplitude)", {"color": BLACK, "lw": 0.9}),
    "output-error": Model("updated (output error)", {"color": BLACK, "lw": 0.9}),
}
TEST = {"color": VERMILION, "lw": 2.6, "alpha": 0.7, "label": "test (synthetic)"}
REPEAT = {"color": GREY, "lw": 1.0, "label": "test, other seed"}
ARTICLE_PRIOR = {
    "article, initial": "constant stiffness and damping of unstated origin",
    "article, updated": "stiffness and damping over time from the wavelet ridge of an unstated record",
}


def prior_information(study: Study) -> dict[str, str]:
    """Return the prior information of each model, ours and the article's, with the warnings of the identification."""
    ours = {MODELS[law.name].label: law.prior_information for law in study.laws}
    warned: dict[str, list[str]] = {}
    for law in study.laws:
        for warning in law.warnings:
            warned.setdefault(warning, []).append(MODELS[law.name].label)
    return ours | ARTICLE_PRIOR | {f"warning, {', '.join(laws)}": text for text, laws in warned.items()}


def name_of(law: str) -> str:
    """Return a law of ours, the test's repeat ("repeat") or a model of the article ("article initial") in words."""
    if law == "repeat":
        return REPEAT["label"]
    return MODELS[law].label if law in MODELS else law.replace("article ", "article, ")


def look(law: str) -> dict[str, Any]:
    """Return colour and marker of what `name_of` names: squares for the article, dots for ours."""
    if law.startswith("article"):
        return {"color": BLUE if law == "article initial" else BLACK, "marker": "s", "mfc": "none"}
    return {"color": (MODELS[law].line if law in MODELS else REPEAT)["color"], "marker": "o"}


def cases(study: Study, level: float) -> list[StudyCase]:
    """Return every law on every engine under the excitation of a level's first record, and last the test's repeat.

    The repeat is the second record compared with the first, as law "repeat" on engine "rig". RecordError if no record
    has the level.
    """
    if level not in study.levels:
        known = ", ".join(f"{known:g}" for known in study.levels)
        raise RecordError(f"{study.dataset.path}: no validation record has level {level:g}; there are {known}")
    first, second = study.records(level)[:2]
    repeat = StudyCase("repeat", "rig", second, study.test(second), study.repeatability[level], {})
    return [*study.simulated(records=[first]), repeat]


def main_cases(all_cases: list[StudyCase]) -> list[StudyCase]:
    """Return the cases of the main engine, which is the first, one for each law, without the repeat."""
    return [case for case in all_cases if case.engine == all_cases[0].engine]


def rows_of(all_cases: list[StudyCase], table: str) -> pd.DataFrame:
    """Return ``per_mode`` or ``per_sensor`` of the cases' comparisons in one frame, with law and engine in front."""
    frames = [getattr(case.comparison, table).assign(law=case.law, engine=case.engine) for case in all_cases]
    return pd.concat(frames, ignore_index=True)


def decibel(frf: FRF) -> np.ndarray:
    """Return the magnitudes of an FRF in dB, (n_sensors, n_f)."""
    return 20 * np.log10(np.abs(frf.functions))


def clearance_of(rig: Rig, sensor: Sensor) -> int | None:
    """Return the number, from 1, of the clearance in which a sensor sits."""
    within = (i for i, b in enumerate(rig.bushings, 1) if b.holds(sensor.position))
    return next(within, None)


def position(rig: Rig, row: int) -> str:
    """Return a sensor of the rig in words: its number, and the clearance it sits in or its position."""
    sensor = rig.sensors[row]
    clearance = clearance_of(rig, sensor)
    return f"sensor {sensor.node}, " + (f"clearance {clearance}" if clearance else f"{sensor.position:g} m")


def test_words(study: Study, level: float) -> str:
    """Return what the models are compared with, in words."""
    name = study.records(level)[0].name
    return f"{level:g} m/s² RMS, record {name} of the virtual rig (synthetic)"
