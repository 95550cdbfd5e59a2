"""How the models are named and drawn. The article's figures have the initial model blue, the updated one black and the
test red; here the models between them have colours of their own.
"""

from __future__ import annotations

from dataclasses import dataclass

from clearance_mj.rig import Rig, Sensor
from clearance_mj.study import Case

from .context import Context
from .style import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILION

__all__ = [
    "ARTICLE_KNOWS",
    "MODELS",
    "REPEAT",
    "TEST",
    "Model",
    "clearance_of",
    "knows",
    "look",
    "main_cases",
    "name_of",
    "place",
    "test_words",
]


@dataclass(frozen=True)
class Model:
    """A law's name in words and its looks."""

    label: str
    """name in legends and tables"""
    line: dict
    """keywords of a line"""


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
ARTICLE_KNOWS = {
    "article, initial": "constant stiffness and damping; where their values come from is not said",
    "article, updated": (
        "stiffness and damping over time from the wavelet ridge; it is not said of which record, nor whether the test "
        "it is compared with is another"
    ),
}


def knows(context: Context) -> dict[str, str]:
    """Return what each model was allowed to know, ours and the article's.

    Parameters
    ----------
    context : Context
        Gives the laws.
    """
    ours = {MODELS[k.name].label: k.prior_information for k in context.laws}
    for name, warnings in context.warnings.items():
        ours[MODELS[name].label] += "".join(f". Warning: {warning}" for warning in warnings)
    return ours | ARTICLE_KNOWS


def name_of(law: str) -> str:
    """Return a law of ours, the test's repeat or a model of the article in words.

    Parameters
    ----------
    law : str
        Such as "ridge", "repeat" or "article initial".
    """
    if law == "repeat":
        return REPEAT["label"]
    return MODELS[law].label if law in MODELS else law.replace("article ", "article, ")


def look(law: str) -> dict:
    """Return colour and marker of what `name_of` names: squares for the article, dots for ours.

    Parameters
    ----------
    law : str
        As `name_of` takes it.
    """
    if law.startswith("article"):
        return {"color": BLUE if law == "article initial" else BLACK, "marker": "s", "mfc": "none"}
    return {"color": (MODELS[law].line if law in MODELS else REPEAT)["color"], "marker": "o"}


def main_cases(context: Context, level: float) -> list[Case]:
    """Return the cases of the main engine, one for each law.

    Parameters
    ----------
    context : Context
        Gives the cases.
    level : float
        m/s².
    """
    return [case for case in context.cases(level) if case.engine == context.engines[0]]


def clearance_of(rig: Rig, sensor: Sensor) -> int | None:
    """Return the number, from 1, of the clearance in which a sensor sits.

    Parameters
    ----------
    rig : Rig
        The rig.
    sensor : Sensor
        One of its sensors.
    """
    within = (i for i, b in enumerate(rig.bushings, 1) if b.ends[0] <= sensor.position <= b.ends[1])
    return next(within, None)


def place(context: Context, row: int) -> str:
    """Return a sensor in words: its number, and the clearance it sits in or its position.

    Parameters
    ----------
    context : Context
        Gives the rig.
    row : int
        Of the sensor in the rig.
    """
    rig = context.dataset.rig
    sensor = rig.sensors[row]
    clearance = clearance_of(rig, sensor)
    return f"sensor {sensor.node}, " + (f"clearance {clearance}" if clearance else f"{sensor.position:g} m")


def test_words(context: Context, level: float) -> str:
    """Return what the models are compared with, in words.

    Parameters
    ----------
    context : Context
        Gives the records.
    level : float
        m/s².
    """
    name = context.records(level)[0].name
    return f"{level:g} m/s² RMS, validation record {name} of the virtual rig (synthetic, not measured)"
