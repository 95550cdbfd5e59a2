"""Audit of the article: every derived number recomputed from its published tables, and its equations checked.

The claims are the article's words; the numbers they are held against come from the tables and from calculation, and
the verdicts from comparing the two by the rules of `VERDICTS`.
"""

from __future__ import annotations

import csv
import functools
import itertools
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np
import scipy.optimize

from .errors import RecordError
from .identify.oscillator import CONDITIONS, free_decay, rms_error, sdof
from .report import html
from .report.article import FOLDERS
from .report.tables import Column, Table

__all__ = ["VERDICTS", "Claim", "audit", "to_html", "to_markdown"]

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
LEAST_CHANCE = 1e-4
"""Chance below which equal differences of two columns are not taken for an accident"""
SPEED = 120 / 3.6  # m/s
BAND = (50.0, 110.0)  # Hz, of the article's decays

_TABLES = {
    1: "table1_natural_frequency.csv",
    2: "table2_frf_errors.csv",
    3: "table3_72kmh.csv",
    4: "table4_120kmh.csv",
    5: "table5_120kmh_peaks.csv",
}


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
        """Whether nothing is wrong with it."""
        return self.verdict.split(";")[0] in ("ok", "ok within the table's rounding")


def audit(folder=None) -> tuple[Claim, ...]:
    """Recompute the article's derived numbers and check its equations.

    Parameters
    ----------
    folder : str or Path, optional
        Where its tables are, as CSV files; default: the published ones.

    Returns
    -------
    tuple of Claim
        In the order of the article's tables, then of its equations.

    Raises
    ------
    RecordError
        If a table is missing, or lacks a number that is needed; the message names the file and the place.
    """
    tables = {number: _Printed.load(_table_file(folder, name)) for number, name in _TABLES.items()}
    claims = [
        *_table1(tables[1]),
        *_table2(tables[2]),
        *_table3(tables[3]),
        *_table4(tables[4]),
        *_table5(tables[5]),
        *_beam(),
        *_identification(),
    ]
    return tuple(_with_contradictions(claims))


def _with_contradictions(claims) -> Iterator[Claim]:
    """Claims of one text that are printed with other digits in another place say so."""
    for claim in claims:
        same = [other.printed for other in claims if (other.part, other.text) == (claim.part, claim.text)]
        others = sorted({printed for printed in same if not _agree(printed, claim.printed)})
        yield replace(claim, verdict="; ".join([claim.verdict, *(f"elsewhere {printed}" for printed in others)]))


def _agree(a, b) -> bool:
    """Whether two printed numbers are one to the digits that both have."""
    a, b = a.removesuffix(" %"), b.removesuffix(" %")
    return a.startswith(b) or b.startswith(a)


# The tables as printed.


def _table_file(folder, name) -> Path:
    folders = FOLDERS if folder is None else (Path(folder),)
    found = [path for path in (f / name for f in folders) if path.is_file()]
    if not found:
        raise RecordError(f"{folders[0] / name}: the article's table is not there")
    return found[0]


@dataclass(frozen=True)
class _Printed:
    """A table by row and column, numbers with the digits they are printed with."""

    path: Path
    rows: dict[str, dict[str, str]]

    @classmethod
    def load(cls, path) -> _Printed:
        try:
            with path.open(newline="", encoding="utf-8") as file:
                header, *rows = csv.reader(file)
        except (OSError, ValueError, csv.Error) as error:
            raise RecordError(f"{path}: cannot be read as a table: {error}") from None
        return cls(path, {row[0]: dict(zip(header[1:], row[1:])) for row in rows if row})

    def text(self, row, column) -> str:
        try:
            return self.rows[row][column]
        except KeyError:
            raise RecordError(f"{self.path}: has no {column} of {row}") from None

    def number(self, row, column) -> Decimal:
        text = self.text(row, column)
        try:
            value = Decimal(text)
        except InvalidOperation:
            raise RecordError(f"{self.path}: {column} of {row} is {text!r}, not a number") from None
        if not value.is_normal() or abs(value.adjusted()) > 6:
            raise RecordError(f"{self.path}: {column} of {row} is {text}; changes need sizes from 1e-6 to 1e6")
        return value

    def column(self, name, rows) -> list[Decimal]:
        return [self.number(row, name) for row in rows]

    def row(self, index) -> str:
        """Name of a row by its place, for rows whose name is itself in question."""
        if index >= len(self.rows):
            raise RecordError(f"{self.path}: has {len(self.rows)} rows, {index + 1} are needed")
        return list(self.rows)[index]


# Numbers against numbers.


def _last_digit(number: Decimal) -> Decimal:
    """One unit of the last printed digit."""
    return Decimal(1).scaleb(number.as_tuple().exponent)


def _agrees(printed: Decimal, value: Decimal) -> bool:
    """Whether a value, rounded or cut off, is the printed one."""
    return abs(printed - value) < _last_digit(printed)


def _misprint(printed: Decimal, values: dict[str, Decimal]) -> str:
    """Verdict on a number that fits nothing: of which value it may be a misprint."""
    for name, value in values.items():
        right = str(value.quantize(_last_digit(printed)))
        if len(right) == len(str(printed)) and sum(a != b for a, b in zip(right, str(printed))) == 1:
            return f"wrong; perhaps a misprint of {right}, {name}"
    return "wrong"


def _changes(old: Decimal, new: Decimal) -> tuple[Decimal, Decimal]:
    """Change in percent of the old value, and of the new one."""
    return 100 * (new - old) / old, 100 * (new - old) / new


def _ranges(old: Decimal, new: Decimal) -> list[tuple[Decimal, Decimal]]:
    """Least and largest of `_changes` for values that round to those printed."""
    ends = [(value - _last_digit(value) / 2, value + _last_digit(value) / 2) for value in (old, new)]
    return [(min(changes), max(changes)) for changes in zip(*itertools.starmap(_changes, itertools.product(*ends)))]


def _judge_change(printed: Decimal, old: Decimal, new: Decimal, others: dict) -> str:
    """Verdict on a change in percent; ``others`` are old and new of the table's other rows."""
    (of_old, of_new), ranges = _changes(old, new), _ranges(old, new)
    if _agrees(printed, of_old):
        return "ok"
    low, high = ranges[0]
    if low <= printed <= high:
        return "ok within the table's rounding"
    low, high = ranges[1]
    if low <= printed <= high:
        return "divides by the new value"
    direction = "a decrease" if new < old else "an increase"
    if _agrees(-printed, of_old):
        return direction
    for name, values in others.items():
        if _agrees(abs(printed), abs(_changes(*values)[0])):
            return f"that of the {name}" + (f"; {direction}" if printed * of_old < 0 else "")
    return _misprint(printed, {"relative to the old value": of_old, "which divides by the new value": of_new})


def _change(part, where, text, printed, old, new, others=None) -> Claim:
    """Claim of a change in percent."""
    verdict = _judge_change(Decimal(printed), old, new, others or {})
    recomputed = _changes(old, new)[0].quantize(min(_last_digit(Decimal(printed)), Decimal("0.1")))
    return Claim(part, where, text, f"{Decimal(printed):+} %", f"{recomputed:+} %", verdict)


def _plain(part, where, text, printed, value: Decimal, unit="") -> Claim:
    """Claim of a number that has one reading."""
    shown = value.quantize(_last_digit(Decimal(printed)))
    verdict = "ok" if _agrees(Decimal(printed), value) else "wrong"
    return Claim(part, where, text, f"{printed}{unit}", f"{shown}{unit}", verdict)


def _maximum(part, where, text, printed, values, unit="") -> Claim:
    """Claim that a number is the largest of a column."""
    number, most, least = Decimal(printed), max(values), min(values)
    if _agrees(number, most):
        verdict = "ok"
    elif _agrees(number, least):
        verdict = "the minimum"
    else:
        verdict = _misprint(number, {"the maximum": most, "the minimum": least})
    return Claim(part, where, text, f"{printed}{unit}", f"{most}{unit} (minimum {least}{unit})", verdict)


def _at_least(part, where, text, limit, values) -> Claim:
    """Claim that no number of a column is below a limit."""
    verdict = "ok" if min(values) >= Decimal(limit) else "wrong"
    return Claim(part, where, text, f"> {limit}", f"minimum {min(values)}", verdict)


# Tables 1 and 2.


def _table1(table) -> Iterator[Claim]:
    part, modes = "Table 1", ("1", "2", "3", "4")
    test = table.column("test_hz", modes)
    for model in ("initial", "updated"):
        found, errors = table.column(f"{model}_hz", modes), table.column(f"{model}_re_pct", modes)
        for mode, a, b, error in zip(modes, test, found, errors):
            text = f"relative error of mode {mode}, {model} model"
            yield _plain(part, "Table 1", text, str(error), abs(_changes(a, b)[0]), " %")
    errors, macs = ([table.column(f"{m}_{of}", modes) for m in ("initial", "updated")] for of in ("re_pct", "mac"))
    for mode, printed, old, new in zip(modes, ("0.54", "2.26", "4.09", "0.47"), *errors):
        text = f"reduction of mode {mode}'s relative error, percentage points"
        yield _plain(part, "Section 4.2", text, printed, old - new)
    for where, changes in (
        ("abstract", ("42.92", "31.08", "38.97", "50.74")),
        ("Section 4.2", ("42.923", "31.083", "38.97", "50.743")),
    ):
        for mode, printed, old, new in zip(modes, changes, *macs):
            yield _change(part, where, f"change of mode {mode}'s MAC", printed, old, new)
    for model, error, mac, of_errors, of_macs in zip(
        ("initial", "updated"), ("5.38", "1.29"), ("0.4173", "0.8492"), errors, macs
    ):
        yield _maximum(part, "conclusion 2", f"maximum frequency error, {model} model", error, of_errors, " %")
        yield _maximum(part, "conclusion 2", f"maximum MAC, {model} model", mac, of_macs)


_MEASURES = ("mre", "rmse", "frac", "csac", "csf")


def _table2(table) -> Iterator[Claim]:
    part, sensors = "Table 2", [row for row in table.rows if row != "mean"]
    if not sensors:
        raise RecordError(f"{table.path}: has no row of a sensor")
    for model, measure in itertools.product(("initial", "updated"), _MEASURES):
        values = table.column(f"{model}_{measure}", sensors)
        printed = str(table.number("mean", f"{model}_{measure}"))
        text = f"mean {measure.upper()}, {model} model"
        yield _plain(part, "Table 2", text, printed, sum(values) / len(values))
    means = {
        measure: [table.number("mean", f"{model}_{measure}") for model in ("initial", "updated")]
        for measure in _MEASURES
    }
    for where, measure, printed in (
        ("Section 4.2, conclusion 2", "mre", "-27.67"),
        ("Section 4.2, conclusion 2", "rmse", "-63.41"),
        ("Section 4.2", "frac", "15.79"),
        ("abstract, conclusion 2", "csac", "6.55"),
        ("Section 4.2", "csac", "6.65"),
        ("abstract, Section 4.2, conclusion 2", "csf", "12.37"),
    ):
        yield _change(part, where, f"change of the mean {measure.upper()}", printed, *means[measure])
    for measure, limit in (("frac", "0.94"), ("csac", "0.90"), ("csf", "0.90")):
        values = table.column(f"updated_{measure}", sensors)
        yield _at_least(part, "Section 4.2", f"every {measure.upper()} of the updated model", limit, values)
    for model in ("initial", "updated"):
        yield _independence(table, model, sensors)


def _independence(table, model, sensors) -> Claim:
    """Claim that a model's columns are measured one by one: the pair of columns with the most equal differences.

    The last two digits of the differences of independent measurements are as good as random: so many of n rows have
    one pair of digits with a chance of at most C(n, count) 100^(1 - count), for each pair of columns.
    """
    columns = {measure: table.column(f"{model}_{measure}", sensors) for measure in _MEASURES}
    pairs = [
        (Counter(a - b for a, b in zip(columns[one], columns[two])).most_common(1)[0], one, two)
        for one, two in itertools.permutations(_MEASURES, 2)
    ]
    (difference, count), one, two = max(pairs, key=lambda pair: (pair[0][1], pair[0][0]))
    chance = math.comb(len(_MEASURES), 2) * math.comb(len(sensors), count) * 100.0 ** (1 - count)
    found = f"{one.upper()} - {two.upper()} = {difference} in {count} of {len(sensors)} rows"
    verdict = f"not credible; by chance {chance:.0e}" if chance < LEAST_CHANCE else "ok"
    return Claim("Table 2", "Table 2", f"columns independent, {model} model", "implied", found, verdict)


# Tables 3 to 5: vehicle control.


def _table3(table) -> Iterator[Claim]:
    part = "Table 3, 72 km/h"
    for where, row, words, printed in (
        ("Section 4.3, conclusion 3", "lateral_position_error_peak", "lateral position error", "-21.2"),
        ("Section 4.3, conclusion 3", "yaw_velocity_peak", "yaw velocity (“reliability”)", "-12.7"),
    ):
        old, new = table.number(row, "smc"), table.number(row, "smc_cm")
        claim = _change(part, where, f"change of the peak {words} against SMC", printed, old, new)
        low, high = _ranges(old, new)[0]
        yield claim if claim.holds else replace(claim, recomputed=f"{claim.recomputed} ({low:.1f} to {high:.1f})")


def _table4(table) -> Iterator[Claim]:
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


def _table5(table) -> Iterator[Claim]:
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


_CONTROLLERS = {"smc_cm": "SMC-CM", "smc": "SMC", "mpc": "MPC"}


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
            yield _change(part, where, text, change, old, new, others)


def _words(row) -> str:
    return row.replace("_", " ")


# The beam's equations.

_FREE = ((1.0, 2), (1.0, 3))
"""Ends of the beam as (place over length, derivative that is zero)"""
_PRINTED_ENDS = ((0.0, 2), (0.0, 3), *_FREE)
_CLAMPED_FREE = ((0.0, 0), (0.0, 1), *_FREE)


def _beam() -> Iterator[Claim]:
    part = "Beam, Eqs 1-8"
    yield _boundary_conditions(part)
    root = _root(_CLAMPED_FREE, 1)
    product = np.cos(root) * np.cosh(root)
    verdict = "ok" if abs(product - 1) < 1e-6 else f"misprint of {product:+.0f}"
    found = f"{product:+.4f} at λ = {root:.4f}, the first of a clamped and free beam"
    yield Claim(part, "Eq. (8)", "cos λ ch λ", "+1", found, verdict)
    order = 6
    excess = round(2 * _root(_CLAMPED_FREE, order) / np.pi) - 2 * order
    form = f"(2i {'+' if excess > 0 else '-'} {abs(excess)})π/2"
    verdict = "ok" if excess == 1 else f"misprint of {form}"
    yield Claim(part, "Eq. (8)", "asymptote of λ", "(2i + 1)π/2", f"{form} at i = {order}", verdict)
    yield from _mode_shape(part)
    yield _second_stiffness(part)


def _boundary_conditions(part) -> Claim:
    """Rigid-body motions that the printed ends allow, and their first root."""
    motions = (
        np.array([(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 2, 0), (0, 0, 0, 6)]),
        np.array([(1, 1, 1, 1), (0, 1, 2, 3), (0, 0, 2, 6), (0, 0, 0, 6)]),
    )  # derivatives 0 to 3 of 1, x, x², x³ at x = 0 and at x = 1
    rigid = 4 - np.linalg.matrix_rank([motions[int(x)][order] for x, order in _PRINTED_ENDS])
    found = f"{rigid} rigid-body motions are left; first λ = {_root(_PRINTED_ENDS, 1):.4f}, "
    found += f"of a clamped and free beam {_root(_CLAMPED_FREE, 1):.4f}"
    verdict = "ok" if rigid == 0 else "free at both ends; a clamp needs Y(0) = Y'(0) = 0"
    printed = "Y''(0) = Y'''(0) = Y''(l) = Y'''(l) = 0"
    return Claim(part, "Eq. (2)", "ends of a cantilever", printed, found, verdict)


def _derivative(x, order, root) -> np.ndarray:
    """Derivatives, over root^order, of cosh, sinh, cos and sin at root x, (4,)."""
    z, turn = root * x, np.pi / 2 * order
    hyperbolic = [np.cosh(z), np.sinh(z)]
    return np.array([hyperbolic[order % 2], hyperbolic[1 - order % 2], np.cos(z + turn), np.sin(z + turn)])


def _determinant(root, ends) -> float:
    return np.linalg.det([_derivative(x, n, root) for x, n in ends])


def _root(ends, order) -> float:
    """The λ of the given order, from 1, at which a beam with these ends vibrates."""
    grid = np.arange(0.5, np.pi * (order + 1), 0.1)
    sign = np.sign([_determinant(root, ends) for root in grid])
    at = np.flatnonzero(sign[1:] != sign[:-1])[order - 1]
    return scipy.optimize.brentq(_determinant, grid[at], grid[at + 1], args=(ends,), xtol=1e-13)


def _eq7(root, sign) -> np.ndarray:
    """Coefficients of cosh, sinh, cos, sin in Eq. 7 with cos λ + sign ch λ in the denominator; -1 as printed."""
    ratio = (np.sin(root) - np.sinh(root)) / (np.cos(root) + sign * np.cosh(root))
    return np.array([-1.0, -ratio, 1.0, ratio])


def _mode_shape(part) -> Iterator[Claim]:
    """What the printed shape does at its ends, with the printed roots and with those of a cantilever."""
    cantilever = _root(_CLAMPED_FREE, 1)
    right = max(abs(_derivative(x, n, cantilever) @ _eq7(cantilever, 1)) for x, n in _CLAMPED_FREE) < 1e-9
    for roots, root in (("Eq. (8)", _root(_PRINTED_ENDS, 1)), ("a cantilever", cantilever)):
        values = [_derivative(x, n, root) @ _eq7(root, -1) for x, n in (*_CLAMPED_FREE, (1.0, 0))]
        start, slope, bending, shear, tip = np.round(values, 6) + 0.0
        found = f"Y(0) = {start:g}, Y'(0) = {slope:g}, Y(l) = {tip:.4g}, Y''(l) = {bending:.4g} β², "
        found += f"Y'''(l) = {shear:.4g} β³"
        wrong = "not free at x = l" + ("; cos λ + ch λ in the denominator is, for a cantilever" if right else "")
        verdict = "ok" if np.allclose(values[:4], 0, atol=1e-9) else wrong
        yield Claim(part, "Eq. (7)", f"mode shape 1 with the roots of {roots}", "cos λ - ch λ", found, verdict)


def _second_stiffness(part) -> Claim:
    """The two forms of Eq. 5 for the first mode of a cantilever of unit length, ∫Y² = 1."""
    root = _root(_CLAMPED_FREE, 1)
    shape = _eq7(root, 1)
    node, weight = np.polynomial.legendre.leggauss(40)
    y, y2, y3, y4 = (
        np.array([_derivative((1 + u) / 2, n, root) @ shape for u in node]) * root**n for n in (0, 2, 3, 4)
    )
    first, printed, right = (weight @ product / 2 for product in (y2**2, y * y3, y * y4))
    verdict = "ok" if math.isclose(first, printed, rel_tol=1e-6) else "misprint of Y (EI Y'')''"
    found = f"{printed:.2f} EI/l³, the first form {first:.2f}; with (Y'')'' {right:.2f}"
    return Claim(part, "Eq. (5)", "second form of K, mode 1", "Y EI (Y')''", found, verdict)


# The identification's equations.


@functools.cache
def _damping_errors() -> tuple[float, float, float]:
    """RMS error in percent of the damping of condition 2: corrected, by Eq. 12 and by Eq. 17 as printed."""
    decay = free_decay(CONDITIONS[2]).with_noise(100)
    forms = {}, {"correction": "none"}, {"damping": "as-printed"}
    found = [sdof(decay.signal, decay.fs, decay.mass, BAND, **form) for form in forms]
    return tuple(100 * rms_error(result.c, decay.c, result.valid) for result in found)


def _identification() -> Iterator[Claim]:
    part = "Identification, Eqs 12-17"
    corrected, without, doubled = _damping_errors()
    verdict = "ok" if without < 1 else "biased where ω varies; -A'/A - ω'/(2ω) is not"
    found = f"{without:.1f} % RMS error of c, with ω'/(2ω) {corrected:.3f} %"
    yield Claim(part, "Eq. (12)", "damping of condition 2, SNR 100 dB", "-A'/A", found, verdict)
    verdict = "ok" if doubled < 1 else "twice too large" if abs(doubled - 100) < 1 else "wrong"
    found = f"{doubled:.1f} % RMS error of c, with 2mωζ {corrected:.3f} %"
    yield Claim(part, "Eq. (17)", "real part of c", "4mωζ", found, verdict)
    for text, start, slope, duration in (
        ("damping of condition 2 over 4 s", 0.02, 0.02, 4.0),
        ("damping of the scale study over 4 s", 0.06, 0.0002, 4.0),
    ):
        zero = start / slope
        verdict = "ok" if zero > duration else f"negative after {zero:g} s"
        yield Claim(part, "Section 3.2", text, f"{start} - {slope}t", f"{start - slope * duration:.4f} at 4 s", verdict)
    for exponent, printed in zip((6, 6.25, 6.5, 6.75, 7), (3200, 3800, 4400, 5200, 6400)):
        count = 1 + math.floor(1 / (4 * 2.0**-exponent) / 0.005 + 1e-9)
        verdict = "ok" if round(count, -2) == printed else "wrong"
        text = f"translations at a = 2^-{exponent:g}, to hundreds, T = 1 s"
        yield Claim(part, "Section 3.2", text, str(printed), str(count), verdict)


# Output.

_INTRODUCTION = (
    "Every derived number of the article is recomputed from its published tables, and its equations are checked by "
    "calculation. The article is *Prediction of Clearance Vibration for Intelligent Vehicles Motion Control* "
    "(Sustainability 14, 6698)."
)
_COLUMNS = ("where", "text", "printed", "recomputed", "verdict")
_HEADINGS = ("Where", "Claim", "Printed", "Recomputed", "Verdict")


def _parts(claims) -> Iterator[tuple[str, list[Claim]]]:
    for part, members in itertools.groupby(claims, key=lambda claim: claim.part):
        yield part, list(members)


def _summary(claims) -> str:
    return f"{sum(claim.holds for claim in claims)} of {len(claims)} claims hold."


def to_markdown(claims) -> str:
    """Return the audit as a page of Markdown.

    Parameters
    ----------
    claims : sequence of Claim
        Of `audit`.
    """
    lines = ["# Audit of the article", "", _INTRODUCTION, "", _summary(claims), ""]
    for part, members in _parts(claims):
        lines += [f"## {part}", "", _row(_HEADINGS), _row(["---"] * len(_HEADINGS))]
        lines += [_row(getattr(claim, name) for name in _COLUMNS) for claim in members] + [""]
    lines += ["## How numbers are judged", "", "The first that applies:", ""]
    lines += [f"- {verdict}: {meaning}." for verdict, meaning in VERDICTS.items()]
    return "\n".join([*lines, "", "Made by `clearance-mj audit`."]) + "\n"


def _row(cells) -> str:
    return "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |"


def to_html(claims) -> str:
    """Return the audit as one HTML file that needs nothing else.

    Parameters
    ----------
    claims : sequence of Claim
        Of `audit`.
    """
    columns = tuple(Column(heading) for heading in _HEADINGS)
    sections = [
        html.Section(f"part-{i}", part, html.table(
            Table(f"part-{i}", "", columns, tuple(tuple(getattr(c, n) for n in _COLUMNS) for c in members))))
        for i, (part, members) in enumerate(_parts(claims), 1)
    ]  # fmt: skip
    rules = "".join(f"<li>{html.formula(f'{verdict}: {meaning}')}</li>\n" for verdict, meaning in VERDICTS.items())
    sections.append(html.Section("rules", "How numbers are judged", f"<ul>\n{rules}</ul>\n"))
    introduction = html.paragraph(_INTRODUCTION.replace("*", "")) + html.paragraph(_summary(claims), "verdict")
    return html.page("Audit of the article", sections, introduction)
