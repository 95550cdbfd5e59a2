"""A control of the page: a number or a choice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

__all__ = ["Control", "Value"]

Value = float | str
SPAN = 10.0  # ratio of a slider's ends to the identified value


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

    @classmethod
    def about(cls, name: str, group: str, label: str, value: float, unit: str, scale: float = 1.0) -> Self:
        """Return a slider over a decade each way from a value above 0."""
        return cls(name, group, label, value, unit, scale, value / SPAN, value * SPAN, log=True)
