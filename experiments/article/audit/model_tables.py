"""Tables 1 and 2: natural frequencies, MAC and FRFs of the initial and the updated model."""

import itertools
import math
from collections import Counter
from collections.abc import Iterator

from clearance_mj.core.errors import RecordError

from ..published import Printed
from . import judge
from .judge import Claim

MIN_CHANCE = 1e-4  # Chance below which equal differences of two columns are not taken for an accident
_MEASURES = ("mre", "rmse", "frac", "csac", "csf")


def table1(table: Printed) -> Iterator[Claim]:
    """Claims of Table 1: natural frequencies and MAC."""
    part, modes = "Table 1", ("1", "2", "3", "4")
    test = table.column("test_hz", modes)
    for model in ("initial", "updated"):
        model_hz, errors = table.column(f"{model}_hz", modes), table.column(f"{model}_re_pct", modes)
        for mode, a, b, error in zip(modes, test, model_hz, errors):
            text = f"relative error of mode {mode}, {model} model"
            yield judge.plain(part, "Table 1", text, str(error), abs(judge.changes(a, b)[0]), " %")
    errors, macs = ([table.column(f"{m}_{of}", modes) for m in ("initial", "updated")] for of in ("re_pct", "mac"))
    for mode, printed, old, new in zip(modes, ("0.54", "2.26", "4.09", "0.47"), *errors):
        text = f"reduction of mode {mode}'s relative error, percentage points"
        yield judge.plain(part, "Section 4.2", text, printed, old - new)
    for where, changes in (
        ("abstract", ("42.92", "31.08", "38.97", "50.74")),
        ("Section 4.2", ("42.923", "31.083", "38.97", "50.743")),
    ):
        for mode, printed, old, new in zip(modes, changes, *macs):
            yield judge.change(part, where, f"change of mode {mode}'s MAC", printed, old, new)
    for model, error, mac, of_errors, of_macs in zip(
        ("initial", "updated"), ("5.38", "1.29"), ("0.4173", "0.8492"), errors, macs
    ):
        yield judge.maximum(part, "conclusion 2", f"maximum frequency error, {model} model", error, of_errors, " %")
        yield judge.maximum(part, "conclusion 2", f"maximum MAC, {model} model", mac, of_macs)


def table2(table: Printed) -> Iterator[Claim]:
    """Claims of Table 2: errors of the FRFs."""
    part, sensors = "Table 2", [row for row in table.cells.index if row != "mean"]
    if not sensors:
        raise RecordError(f"{table.path}: has no row of a sensor")
    for model, measure in itertools.product(("initial", "updated"), _MEASURES):
        values = table.column(f"{model}_{measure}", sensors)
        printed = str(table.number("mean", f"{model}_{measure}"))
        text = f"mean {measure.upper()}, {model} model"
        yield judge.plain(part, "Table 2", text, printed, sum(values) / len(values))
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
        yield judge.change(part, where, f"change of the mean {measure.upper()}", printed, *means[measure])
    for measure, limit in (("frac", "0.94"), ("csac", "0.90"), ("csf", "0.90")):
        values = table.column(f"updated_{measure}", sensors)
        yield judge.at_least(part, "Section 4.2", f"every {measure.upper()} of the updated model", limit, values)
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
    recomputed = f"{one.upper()} - {two.upper()} = {difference} in {count} of {len(sensors)} rows"
    verdict = f"not credible; by chance {chance:.0e}" if chance < MIN_CHANCE else "ok"
    return Claim("Table 2", "Table 2", f"columns independent, {model} model", "implied", recomputed, verdict)
