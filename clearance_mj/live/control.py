"""One thing that can be moved on the page."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Control", "Value"]

Value = float | str


@dataclass(frozen=True)
class Control:
    """A slider with a field, or a choice."""

    name: str  #: such as "bushings[0].gap"
    group: str  #: under whose heading it stands
    label: str  #: in words
    value: Value  #: as the rig and the law were given: what "reset" brings back
    unit: str = ""  #: as shown
    scale: float = 1.0  #: shown value over the value in SI units
    low: float = 0.0  #: left end of the slider; the field takes what the rig or the law takes
    high: float = 0.0  #: right end
    log: bool = False  #: the slider moves the logarithm
    whole: bool = False  #: takes whole numbers only
    choices: tuple[str, ...] = ()  #: of a choice; empty: a number
