"""Headers of columns as loggers write them: a name and a unit in brackets, or after a comma or a stroke."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ...core.checks import NAME_LIMIT
from ...core.units import UNITS, is_angular, quantity_of

__all__ = ["LONGEST", "is_index", "is_time", "is_unit", "split_header", "unique_names"]

LONGEST = 1000  # characters of a header in which a unit is looked for
_BRACKETS = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*(?:\([^()]*\)[^()]*)*)\))")
_AFTER = re.compile(r"(.*?\S)\s*[,/;]\s*\(?([^\s,/;()][^\s,;()]*)\)?")
_UNIT = r"(?:milli|micro|nano)s(?:ec(?:ond)?s?)?"
_TIME = re.compile(
    r"(?:rel(?:ative|\.)?|abs(?:olute|\.)?|elapsed|sample|test|local|utc|unix|epoch|posix|system|log(?:ger)?)?[ _-]?"
    r"(?:(?-i:t)|ts|epoch|elapsed|stamp|(?:time(?:[ _-]?(?:stamp|axis|base))?|zeit(?:stempel|achse)?|temps|tiempo|tempo"
    r"|x[ _]?values?)(?:[ _-]?\d+)?|uhrzeit|clock|date[ /_-]?(?:and[ _])?time|datum[ /_-]?(?:und[ _])?(?:uhr)?zeit"
    r"|seconds?|secs?)(?:[ _]since[ _][a-z]+?)?"
    rf"(?:[ _-]?(?:in[ _])?((?<=[ _-])s|secs?|seconds|[mnuµμ]s(?:ec)?|{_UNIT}))?|({_UNIT})",
    re.IGNORECASE,
)
_INDEX = re.compile(r"(?:samples?|scan|index|idx|point|row|record|n|nr|no|#)\.?(?: ?(?:no|nr|number|#)\.?)?", re.I)
_NOT_MASS = [quantity for quantity in UNITS if quantity != "mass"]  # "t" is the name of time
OTHER_UNITS = frozenset((
    "v", "mv", "a", "ma", "°c", "c", "degc", "deg c", "k", "°f", "pa", "kpa", "mpa", "bar", "mbar", "psi", "%", "rpm",
    "1/min", "hz", "khz", "rad", "rad/s", "deg", "°", "°/s", "ue", "µe", "με", "µm/m", "um/m", "mm/m", "strain", "nm",
    "knm", "w", "db", "eu", "-", "1", "mv/v", "ml", "l", "kg", "volt", "volts", "pc", "h", "hh:mm:ss", "datetime",
    "utc", "raw", "none", "n/a",
))  # fmt: skip
"""Labels, in lower case, that are a unit where they stand in round brackets or in a row of units"""


def is_unit(label: str) -> bool:
    """Return True if a label is a unit: one that this package knows, or one that loggers write."""
    return bool(quantity_of(label, _NOT_MASS)) or is_angular(label) or label.lower() in OTHER_UNITS


def split_header(cell: str) -> tuple[str, str]:
    """Return name and unit of a column, such as "Accel 3" and "m/s^2" of "Accel 3 (m/s^2)"; "" for no unit."""
    if len(cell) > LONGEST:
        return cell.strip(), ""
    if match := _BRACKETS.fullmatch(cell):
        name, square, curved = match.groups()
        if square is not None or is_unit(curved):
            unit = (curved if square is None else square).strip()
            again = _BRACKETS.fullmatch(name)  # a row of units repeats what the header says
            plain = again[1] if again and unit in (again[2], again[3]) else name
            return plain.removesuffix("/").strip(), unit  # "v / (mm/s)" is as ISO 80000-1 has it
    if (match := _AFTER.fullmatch(cell)) and is_unit(match[2]):
        return match[1], match[2]
    if (match := _TIME.fullmatch(cell)) and (unit := match[1] or match[2]):
        return cell, unit
    return cell.strip(), ""


def is_time(name: str) -> bool:
    """Return True if a name is one that loggers give to the column of time."""
    return bool(_TIME.fullmatch(name))


def is_index(name: str) -> bool:
    """Return True if a name is one that loggers give to the number of a sample."""
    return bool(_INDEX.fullmatch(name))


def unique_names(names: Sequence[str], notes: list[str]) -> list[str]:
    """Return valid channel names: printable, not too long, none empty, none twice; notes say which changed."""
    unique: list[str] = []
    for number, name in enumerate(names, 1):
        plain = "".join(c if c.isprintable() else " " for c in name).strip()
        new = plain if len(plain) <= NAME_LIMIT else f"{plain[: NAME_LIMIT - 3].rstrip()}..."
        new = new or f"column {number}"
        original, count = new, 1
        while new in unique:
            count += 1
            end = f" ({count})"
            new = original[: NAME_LIMIT - len(end)].rstrip() + end
        if new != name.strip():
            notes.append(f'column {number} is named "{new}"')
        unique.append(new)
    return unique
