"""The page of the comparison of steering controllers: its words and tables."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

from clearance_mj.core.files import write_text
from clearance_mj.report.style import Drawing
from clearance_mj.report.tables import Column, Table
from clearance_mj.report.vehicle import METRICS
from clearance_mj.vehicle.experiment import CONTROLLERS, GAP, REGIMES
from clearance_mj.vehicle.manoeuvres import MANOEUVRES
from experiments.article.motion import Median, median
from experiments.article.pages import markdown_table
from experiments.article.result import to_table
from experiments.steering.comparison_figures import chatter, peaks, worth
from experiments.steering.comparison_statistics import OBSERVERS, Paired, below_both, names_of, paired, values

PAGE = "vehicle_comparison"
VERDICTS = ("better", "better, more reversals", "no difference", "worse")
LAYER_LIMIT = 2.0
"""Fraction of the time outside the boundary layer, %, up to which a sliding mode is linear feedback."""
EFFORT = ("servo_rms_rate", "servo_fast_rate", "servo_reversals")


def write_page(rows: pd.DataFrame, sensors: str, folder: Path) -> None:
    """Write the page and its figures into a folder."""
    comparisons = paired(rows)
    drawings = [*(peaks(rows, regime) for regime in REGIMES), worth(comparisons), chatter(rows)]
    for drawing in drawings:
        drawing.write(folder)
    write_text(folder / f"{PAGE}.md", "\n\n".join(_page(rows, sensors, comparisons, drawings)) + "\n")


def _page(rows: pd.DataFrame, sensors: str, comparisons: list[Paired], drawings: Sequence[Drawing]) -> Iterator[str]:
    yield "# Steering controllers compared"
    yield _method(rows, sensors)
    yield "## Where does the clearance model pay?"
    *errors, pairs, effort = drawings
    if comparisons:
        yield markdown_table(_counts(rows, comparisons))
        yield _shown(pairs)
        yield markdown_table(_pairs_table(rows, comparisons))
    yield "## Lateral error"
    for drawing in errors:
        yield _shown(drawing)
    yield markdown_table(_peaks_table(rows))
    yield "## Steering effort"
    yield _shown(effort)
    yield markdown_table(_effort_table(rows))
    yield _layer_in_words(rows)
    yield "`make steering` makes this page; `runs.csv` has each run in a row."


def _shown(drawing: Drawing) -> str:
    return f"![{drawing.alt}]({drawing.name}.png)\n\n{drawing.caption}"


def _method(rows: pd.DataFrame, sensors: str) -> str:
    torque, friction = REGIMES.values()
    return (
        "This page shows which controller keeps the path best if the steering has clearance. "
        f"{rows['seed'].nunique()} vehicles (mass ± 10 %, cornering stiffness ± 15 %, friction 0.8 to 1 of nominal) "
        "drive the [manoeuvres](vehicle.md#which-paths-can-i-drive), with the same noise, road and gusts for every "
        f"[controller](vehicle.md#controllers): multi-body plant, {sensors} sensors, half-gap "
        f"{np.degrees(GAP):.1f}° at the road wheel. Torque-driven: trail {1e3 * torque.trail:g} mm, no friction; "
        f"friction-driven: trail {1e3 * friction.trail:g} mm, {friction.friction:g} N m of friction. No controller is "
        "tuned on these manoeuvres, but the tuning cases, and SMC-CM-DOB and MPC-CM-DOB, were chosen after results "
        "on them with other vehicles (101 to 108). Controllers with a clearance model know the gap; those "
        "with a twin begin with half of it. A run that leaves the path by 5 m, or whose vehicle lifts a wheel, counts "
        "as the worst. Intervals are exact 95 % intervals of the median."
    )


def _number(value: float, form: str) -> str:
    if np.isnan(value):
        return "none"
    return "left" if np.isinf(value) else format(value, form)


def _interval(interval: Median, form: str) -> str:
    return f"{_number(interval.value, form)} ({_number(interval.low, form)}…{_number(interval.high, form)})"


def _both(numbers: Iterable[str]) -> str:
    """Torque-driven and friction-driven."""
    return "/".join(numbers)


def _counts(rows: pd.DataFrame, comparisons: list[Paired]) -> Table:
    """Return how often a clearance model is below both observers, and the verdicts of its pairs."""
    total, pairs = rows["manoeuvre"].nunique(), list(dict.fromkeys((p.new, p.old) for p in comparisons))
    columns = [Column("Controller"), *(Column(f"{regime}-driven", f"of {total}") for regime in REGIMES)]
    columns += [Column(verdict.capitalize(), f"of {len(comparisons) // len(pairs)}") for verdict in VERDICTS]
    body = []
    for new, old in pairs:
        verdicts = [p.verdict for p in comparisons if (p.new, p.old) == (new, old)]
        cells = [*(_below_both(rows, regime, new) for regime in REGIMES), *(str(verdicts.count(v)) for v in VERDICTS)]
        body.append([CONTROLLERS[new].label, *cells])
    caption = (
        "Manoeuvres on which the median peak error is below both SMC-DOB's and MPC-DOB's (in brackets: without more "
        "reversals than the better of them), and cases in which it is better or worse than the observer of its kind"
    )
    return to_table("counts", caption, columns, body)


def _below_both(rows: pd.DataFrame, regime: str, controller: str) -> str:
    if not set(OBSERVERS) <= set(rows["controller"]):
        return ""
    return "{} ({})".format(*below_both(rows, regime, controller))


def _pairs_table(rows: pd.DataFrame, comparisons: list[Paired]) -> Table:
    """Return by how much the peak error is lower than with an observer; twins are in the figure."""
    pairs = [pair for pair in dict.fromkeys((p.new, p.old) for p in comparisons) if "twin" not in pair[0]]
    columns = [Column("Manoeuvre"), Column("Regime"), *(Column(CONTROLLERS[new].label, "%") for new, _ in pairs)]
    body = []
    for manoeuvre, regime in product(rows["manoeuvre"].unique(), REGIMES):
        here = {(p.new, p.old): p for p in comparisons if (p.manoeuvre, p.regime) == (manoeuvre, regime)}
        body.append([MANOEUVRES[manoeuvre].label, regime, *(_reduction(here[pair]) for pair in pairs)])
    caption = (
        "Reduction of the peak error against the disturbance observer (SMC-DOB or MPC-DOB) on the same vehicle and "
        "noise, with 95 % intervals; +: with more reversals of the servo"
    )
    return to_table("pairs", caption, columns, body)


def _reduction(pair: Paired) -> str:
    return _interval(pair.below, ".0f") + "+" * pair.verdict.endswith("more reversals")


def _peaks_table(rows: pd.DataFrame) -> Table:
    there = list(rows["manoeuvre"].unique())
    columns = [
        Column("Controller"), *(Column(MANOEUVRES[m].label, "mm") for m in there), Column("Left the path", "runs"),
    ]  # fmt: skip
    body = []
    for name in names_of(rows):
        peaks = {(m, r): 1e3 * values(rows, m, r, name, "peak_e_y") for m in there for r in REGIMES}
        cells = [_both(_number(median(peaks[m, r]).value, ".0f") for r in REGIMES) for m in there]
        left = _both(str(sum(int(np.isinf(peaks[m, r]).sum()) for m in there)) for r in REGIMES)
        body.append([CONTROLLERS[name].label, *cells, left])
    caption = f"Median peak lateral error, {'-driven/'.join(REGIMES)}-driven; left: half of the runs left the path"
    return to_table("peaks", caption, columns, body)


def _effort_table(rows: pd.DataFrame) -> Table:
    shown = ("rms_e_y", *EFFORT)
    columns = [Column("Controller")]
    columns += [Column(METRICS[m].label, METRICS[m].unit) for m in shown]
    body = []
    for name in names_of(rows):
        here = {r: rows[(rows["regime"] == r) & (rows["controller"] == name)] for r in REGIMES}
        cells = [
            _both(
                _number(METRICS[m].scale * np.median(here[r][m].to_numpy(dtype=float)), METRICS[m].form)
                for r in REGIMES
            )
            for m in shown
        ]
        body.append([CONTROLLERS[name].label, *cells])
    caption = (
        f"RMS error and steering effort, {'-driven/'.join(REGIMES)}-driven: medians over all manoeuvres and vehicles"
    )
    return to_table("effort", caption, columns, body)


def _layer_in_words(rows: pd.DataFrame) -> str:
    """Return in words how long sliding modes are outside their boundary layer, of runs that reached their end."""
    percent = 100 * rows["outside_layer"].replace(np.inf, np.nan)
    medians = percent.groupby([rows["controller"], rows["manoeuvre"], rows["regime"]]).median()
    outside = {name: medians[name] for name in names_of(rows) if medians[name].max() > LAYER_LIMIT}
    words = "".join(f"{CONTROLLERS[n].label} {of.min():.0f} to {of.max():.0f} %; " for n, of in outside.items())
    return (
        "Fraction of the time outside the boundary layer of the sliding mode, medians over vehicles: "
        f"{words}all others at most {LAYER_LIMIT:g} %, which is linear feedback."
    )
