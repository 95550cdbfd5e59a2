"""Tables 3 to 5: vehicle control."""

import math
from collections.abc import Iterator
from dataclasses import replace

from ..published import Printed
from . import judge
from .judge import Claim

SPEED = 120 / 3.6  # m/s
_CONTROLLERS = {"smc_cm": "SMC-CM", "smc": "SMC", "mpc": "MPC"}


def table3(table: Printed) -> Iterator[Claim]:
    """Claims of Table 3: peaks at 72 km/h."""
    part = "Table 3, 72 km/h"
    for where, row, words, printed in (
        ("Section 4.3, conclusion 3", "lateral_position_error_peak", "lateral position error", "-21.2"),
        ("Section 4.3, conclusion 3", "yaw_velocity_peak", "yaw velocity (“reliability”)", "-12.7"),
    ):
        old, new = table.number(row, "smc"), table.number(row, "smc_cm")
        claim = judge.change(part, where, f"change of the peak {words} against SMC", printed, old, new)
        low, high = judge.ranges(old, new)[0]
        yield claim if claim.holds else replace(claim, recomputed=f"{claim.recomputed} ({low:.1f} to {high:.1f})")


def table4(table: Printed) -> Iterator[Claim]:
    """Claims of Table 4: tracking errors at 120 km/h."""
    part, rows = "Table 4, 120 km/h", {"lateral position error": table.row(0), "heading error": table.row(1)}
    printed = {
        ("abstract", "lateral position error"): {"mpc": "-35.7", "smc": "-14.3"},
        ("abstract", "heading error"): {"mpc": "-50", "smc": "-15.6"},
        ("Section 4.3, conclusion 3", "lateral position error"): {"mpc": "-50", "smc": "-14.3"},
        ("Section 4.3, conclusion 3", "heading error"): {"mpc": "-35.7", "smc": "-15.6"},
    }
    yield from _against_controllers(table, part, rows, printed)
    row = rows["heading error"]
    unit = table.text(row, "unit_as_printed")
    right = "heading" in row and unit in ("deg", "rad")
    verdict = "ok" if right else f"row is labelled {_words(row)}, {unit}"
    yield Claim(part, "Table 4", "second row is the heading error of the text", "heading", _words(row), verdict)


def table5(table: Printed) -> Iterator[Claim]:
    """Claims of Table 5: peaks of the motion at 120 km/h."""
    part, rows = "Table 5, 120 km/h", {"lateral acceleration": table.row(0), "yaw velocity": table.row(1)}
    printed = {
        ("Section 4.3", "lateral acceleration"): {"mpc": "27.8", "smc": "-18.8"},
        ("Section 4.3", "yaw velocity"): {"mpc": "23.5", "smc": "-3.7"},
        ("conclusion 3", "lateral acceleration"): {"mpc": "-27.8", "smc": "-18.8"},
        ("conclusion 3", "yaw velocity"): {"mpc": "-23.5", "smc": "-3.7"},
    }
    yield from _against_controllers(table, part, rows, printed)
    unit = table.text(rows["lateral acceleration"], "unit_as_printed")
    verdict = "ok" if unit == "m/s^2" else "unit should be m/s²"
    yield Claim(part, "Table 5", "unit of the lateral acceleration", unit, "m/s^2", verdict)
    for controller in ("smc_cm", "smc", "mpc"):
        acceleration, yaw = (abs(table.number(row, controller)) for row in rows.values())
        steady = SPEED * math.radians(yaw)
        verdict = "ok" if steady / 2 <= acceleration <= 2 * steady else "inconsistent with the yaw velocity"
        text = f"peak lateral acceleration of {_CONTROLLERS[controller]}, against speed times yaw velocity"
        computed = f"{SPEED:.1f} m/s × {yaw} deg/s = {steady:.2f} m/s²"
        yield Claim(part, "Table 5", text, f"{acceleration} m/s²", computed, verdict)


def _against_controllers(table, part, rows, printed) -> Iterator[Claim]:
    """Changes of peaks from another controller to SMC-CM; ``rows`` are the table's by the words of the text."""
    peaks = {
        (words, controller): abs(table.number(row, controller))
        for words, row in rows.items()
        for controller in ("smc_cm", "smc", "mpc")
    }
    for (where, words), changes in printed.items():
        for controller, change in changes.items():
            old, new = peaks[words, controller], peaks[words, "smc_cm"]
            others = {w: (peaks[w, controller], peaks[w, "smc_cm"]) for w in rows if w != words}
            text = f"change of the peak {words} against {_CONTROLLERS[controller]}"
            yield judge.change(part, where, text, change, old, new, others)


def _words(row) -> str:
    return row.replace("_", " ")
