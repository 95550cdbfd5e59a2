"""The sampling rate in the lines above a table."""

from __future__ import annotations

import re
from collections.abc import Sequence

from .layout import Style

__all__ = ["find_rate"]

_RATE = (
    r"(?:(?:data|acquisition|scan|sampl\w*|channel|daq)?[ _-]*(?:rate|freq(?:uency|\.)?)|f_?s|samples? per second"
    r"|abtast(?:rate|frequenz)|fr[ée]quence d['’ ][ée]chantillonnage)"
)
_STEP = (
    r"(?:d_?t|delta[ _]?[tx]|(?:sampl\w*|scan|time|data)[ _-]*(?:interval|period|step|increment|time|spacing)"
    r"|abtast(?:intervall|zeit|periode)|wf_increment)"
)
_RATES = {"hz": 1.0, "khz": 1e3, "mhz": 1e6, "s/s": 1.0, "ks/s": 1e3, "ms/s": 1e6, "sa/s": 1.0, "samples/s": 1.0,
          "sps": 1.0, "ksps": 1e3, "1/s": 1.0, "samples/sec": 1.0, "samples/second": 1.0}  # fmt: skip
_STEPS = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9}
_NAMED_UNIT = r"\s*[\[(]\s*([^\[\]()]{1,16}?)\s*[\])]"
_VALUE = r'([+-]?[\d.,]*\d(?:[eE][+-]?\d+)?)"?[\s;,"]*([^\d\s;,"][^\s;,"]*)?["\s;,]*'
_ENTRY = rf'"?(?:{_NAMED_UNIT})?"?\s*[:=;,\t ]\s*["\t;, ]*{_VALUE}'
_LINES = tuple(
    (re.compile(rf'[\s#%/!"]*{key}{_ENTRY}', re.IGNORECASE), units, is_step)
    for key, units, is_step in ((_RATE, _RATES, False), (_STEP, _STEPS, True))
)


def find_rate(lines: Sequence[str], style: Style) -> tuple[float, int] | None:
    """Return samples per second and the number of the line, from 1, that says so; None if no line does."""
    for number, line in enumerate(lines, 1):
        for pattern, units, is_step in _LINES:
            if not (match := pattern.fullmatch(line[:200])):
                continue
            named, text, after = match.groups()
            unit = (after or named or "").strip("[]()").lower()
            factor = units.get(unit, 1.0 if not unit else None)
            text = text.replace(",", ".") if "." not in text and style.point == "," else text.replace(",", "")
            try:
                value = float(text) * (factor or 0.0)
            except ValueError:
                continue
            if 0 < value < 1e12:
                return (1 / value if is_step else value), number
    return None
