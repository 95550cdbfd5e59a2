"""Numbers against numbers: whether a printed value, change or extreme is that of the table."""

import itertools
from dataclasses import dataclass
from decimal import Decimal


@dataclass(frozen=True)
class Claim:
    """Something the article says, and what comes out when it is computed again."""

    part: str
    """what it is about: a table, or the equations"""
    where: str
    """place in the article"""
    text: str
    """what it says, in words"""
    printed: str
    """the value as printed"""
    recomputed: str
    """the value that comes out here"""
    verdict: str
    """such as "ok" or "wrong" """

    @property
    def holds(self) -> bool:
        """True if nothing is wrong with it."""
        return self.verdict.split(";")[0] in ("ok", "ok within the table's rounding")


VERDICTS = {
    "ok": "the recomputed value, rounded or cut off to the digits printed",
    "ok within the table's rounding": "what some values that round to those of the table give",
    "divides by the new value": "a change relative to the new value, where it should be to the old one",
    "a decrease, an increase": "the right value with the wrong sign",
    "that of X": "the value of another row of the same table",
    "wrong; perhaps a misprint of X": "one character away from a value that would fit",
    "wrong": "nothing of the above",
}
"""How printed changes and extremes are judged, the first that applies; other verdicts say themselves what is wrong"""


def changes(old: Decimal, new: Decimal) -> tuple[Decimal, Decimal]:
    """Return the change in percent of the old value, and of the new one."""
    return 100 * (new - old) / old, 100 * (new - old) / new


def ranges(old: Decimal, new: Decimal) -> list[tuple[Decimal, Decimal]]:
    """Least and largest of `changes` for values that round to those printed."""
    ends = [(value - _last_digit(value) / 2, value + _last_digit(value) / 2) for value in (old, new)]
    return [(min(values), max(values)) for values in zip(*itertools.starmap(changes, itertools.product(*ends)))]


def change(part, where, text, printed, old, new, others=None) -> Claim:
    """Return the claim of a change in percent; others: old and new of the table's other rows, by the words for them."""
    verdict = _judge_change(Decimal(printed), old, new, others or {})
    recomputed = changes(old, new)[0].quantize(min(_last_digit(Decimal(printed)), Decimal("0.1")))
    return Claim(part, where, text, f"{Decimal(printed):+} %", f"{recomputed:+} %", verdict)


def plain(part, where, text, printed, value: Decimal, unit="") -> Claim:
    """Claim of a number that has one reading."""
    shown = value.quantize(_last_digit(Decimal(printed)))
    verdict = "ok" if _agrees(Decimal(printed), value) else "wrong"
    return Claim(part, where, text, f"{printed}{unit}", f"{shown}{unit}", verdict)


def maximum(part, where, text, printed, values, unit="") -> Claim:
    """Claim that a number is the largest of a column."""
    number, most, least = Decimal(printed), max(values), min(values)
    if _agrees(number, most):
        verdict = "ok"
    elif _agrees(number, least):
        verdict = "the minimum"
    else:
        verdict = _misprint(number, {"the maximum": most, "the minimum": least})
    return Claim(part, where, text, f"{printed}{unit}", f"{most}{unit} (minimum {least}{unit})", verdict)


def at_least(part, where, text, limit, values) -> Claim:
    """Claim that no number of a column is below a limit."""
    verdict = "ok" if min(values) >= Decimal(limit) else "wrong"
    return Claim(part, where, text, f"> {limit}", f"minimum {min(values)}", verdict)


def _judge_change(printed: Decimal, old: Decimal, new: Decimal, others: dict) -> str:
    """Verdict on a change in percent; ``others`` are old and new of the table's other rows."""
    (of_old, of_new), (over_old, over_new) = changes(old, new), ranges(old, new)
    if _agrees(printed, of_old):
        return "ok"
    low, high = over_old
    if low <= printed <= high:
        return "ok within the table's rounding"
    low, high = over_new
    if low <= printed <= high:
        return "divides by the new value"
    direction = "a decrease" if new < old else "an increase"
    if _agrees(-printed, of_old):
        return direction
    for name, values in others.items():
        if _agrees(abs(printed), abs(changes(*values)[0])):
            return f"that of the {name}" + (f"; {direction}" if printed * of_old < 0 else "")
    return _misprint(printed, {"relative to the old value": of_old, "which divides by the new value": of_new})


def _misprint(printed: Decimal, values: dict[str, Decimal]) -> str:
    """Verdict on a number that fits nothing: of which value it may be a misprint."""
    for name, value in values.items():
        right = str(value.quantize(_last_digit(printed)))
        if len(right) == len(str(printed)) and sum(a != b for a, b in zip(right, str(printed))) == 1:
            return f"wrong; perhaps a misprint of {right}, {name}"
    return "wrong"


def _agrees(printed: Decimal, value: Decimal) -> bool:
    """Return True if a value, rounded or cut off, is the printed one."""
    return abs(printed - value) < _last_digit(printed)


def _last_digit(number: Decimal) -> Decimal:
    """One unit of the last printed digit."""
    return Decimal(1).scaleb(number.as_tuple().exponent)
