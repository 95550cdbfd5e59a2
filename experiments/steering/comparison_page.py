"""The page of the comparison of steering controllers: its words and tables."""

from collections.abc import Iterator, Sequence
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
from experiments.steering.comparison_statistics import OBSERVERS, PAIRS, Paired, below_both, names_of, paired, values

PAGE = "vehicle_comparison"
EFFORT = ("servo_rms_rate", "servo_fast_rate", "servo_reversals", "contact_reversals")


def write_page(rows: pd.DataFrame, sensors: str, folder: Path) -> None:
    """Write the page and its figures into a folder."""
    found = paired(rows)
    drawings = [*(peaks(rows, regime) for regime in REGIMES), worth(found), chatter(rows)]
    for drawing in drawings:
        drawing.write(folder)
    text = "\n\n".join(_page(rows, sensors, found, drawings))
    write_text(folder / f"{PAGE}.md", text + "\n")


def _page(rows: pd.DataFrame, sensors: str, found: list[Paired], drawings: Sequence[Drawing]) -> Iterator[str]:
    yield "# Steering controllers compared"
    yield _method(rows, sensors)
    yield "## Where each controller wins, and where the clearance model does not pay"
    *errors, pairs, effort = drawings
    if found:
        yield markdown_table(_counts(rows))
        yield "On the same vehicles and noises:\n\n" + "\n".join(_pairs_in_words(found))
        yield _shown(pairs)
    yield markdown_table(_winners(rows, found))
    yield "## Lateral error"
    for regime, drawing in zip(REGIMES, errors):
        yield _shown(drawing)
        yield markdown_table(_peaks_table(rows, regime))
    yield "## What it costs"
    yield _shown(effort)
    for regime in REGIMES:
        yield markdown_table(_effort_table(rows, regime))
    yield markdown_table(_layer_table(rows))
    yield "Made by `make steering` (`python -m experiments.steering.comparison`); each run is a row of its runs.csv."


def _shown(drawing: Drawing) -> str:
    return f"![{drawing.alt}]({drawing.name}.png)\n\n{drawing.caption}"


def _method(rows: pd.DataFrame, sensors: str) -> str:
    driven = "; ".join(
        f"{m.label}: {m.speed:g} km/h, needs {m.path().needed_acceleration(m.speed / 3.6):.1f} m/s²"
        for m in map(MANOEUVRES.get, rows["manoeuvre"].unique())
    )
    torque, friction = REGIMES.values()
    return (
        f"{rows['seed'].nunique()} vehicles (mass ± 10 %, cornering stiffness ± 15 %, friction 0.8 to 1 of nominal), "
        "each with its own noise, road and gusts, the same for every controller; multi-body plant, "
        f"{sensors} sensors, half-gap {np.degrees(GAP):.1f}° at the road wheel. Torque-driven: trail "
        f"{1e3 * torque.trail:g} mm, no friction; friction-driven: trail {1e3 * friction.trail:g} mm, "
        f"{friction.friction:g} N m of friction. No controller is tuned on any of the manoeuvres; what they are "
        "tuned on, and SMC-CM-DOB and MPC-CM-DOB, were settled after looking at these with other vehicles (101 to "
        f"108). {driven}. "
        "Controllers with a clearance model are told the true gap, those with a twin begin with half of it. A run that "
        "leaves the path by 5 m, or whose vehicle lifts a wheel, counts as the worst in every median. Intervals "
        "are the exact 95 % ones of the median (order statistics)."
    )


def _number(value: float, form: str) -> str:
    if np.isnan(value):
        return "none"
    return "left" if np.isinf(value) else format(value, form)


def _interval(found: Median, form: str) -> str:
    return f"{_number(found.value, form)} ({_number(found.low, form)} to {_number(found.high, form)})"


def _counts(rows: pd.DataFrame) -> Table:
    """How often a clearance model is below both observers."""
    total = rows["manoeuvre"].nunique()
    columns = [Column("Controller"), Column("Knows of the clearance")]
    for regime in REGIMES:
        columns += [Column(f"{regime}-driven", f"of {total}"), Column("without more reversals", f"of {total}")]
    body = []
    for name in (name for name, _ in PAIRS if {name, *OBSERVERS} <= set(rows["controller"])):
        counts = (str(count) for regime in REGIMES for count in below_both(rows, regime, name))
        body.append([CONTROLLERS[name].label, CONTROLLERS[name].prior, *counts])
    caption = "Manoeuvres on which the median peak error is below both SMC-DOB's and MPC-DOB's"
    return to_table("counts", caption, columns, body)


def _pairs_in_words(found: list[Paired]) -> Iterator[str]:
    for new, old in dict.fromkeys((p.new, p.old) for p in found):
        verdicts = [p.verdict for p in found if (p.new, p.old) == (new, old)]
        counted = ", ".join(f"{verdict} in {verdicts.count(verdict)}" for verdict in sorted(set(verdicts)))
        yield f"- {CONTROLLERS[new].label} against {CONTROLLERS[old].label}: {counted} of {len(verdicts)} cases."


def _winners(rows: pd.DataFrame, found: list[Paired]) -> Table:
    pairs = list(dict.fromkeys((p.new, p.old) for p in found))
    columns = [Column("Manoeuvre"), Column("Regime"), Column("Smallest median peak", "mm")]
    columns += [Column(f"{CONTROLLERS[new].label} below {CONTROLLERS[old].label}", "%") for new, old in pairs]
    body = []
    for manoeuvre, regime in product(rows["manoeuvre"].unique(), REGIMES):
        peaks = {name: median(1e3 * values(rows, manoeuvre, regime, name, "peak_e_y")) for name in names_of(rows)}
        best = min(peaks, key=lambda name: peaks[name].value)
        cells = [MANOEUVRES[manoeuvre].label, regime, f"{CONTROLLERS[best].label}: {_interval(peaks[best], '.0f')}"]
        here = {(p.new, p.old): p for p in found if (p.manoeuvre, p.regime) == (manoeuvre, regime)}
        body.append([*cells, *(f"{_interval(here[pair].below, '.0f')}: {here[pair].verdict}" for pair in pairs)])
    return to_table("winners", "Who wins where, and paired comparisons on the same vehicles", columns, body)


def _peaks_table(rows: pd.DataFrame, regime: str) -> Table:
    there = list(rows["manoeuvre"].unique())
    columns = [
        Column("Controller"),
        *(Column(MANOEUVRES[m].label, "mm") for m in there),
        Column("Left the path", "runs"),
    ]
    body = []
    for name in names_of(rows):
        peaks = [median(1e3 * values(rows, m, regime, name, "peak_e_y")) for m in there]
        left = sum(int(np.isinf(values(rows, m, regime, name, "peak_e_y")).sum()) for m in there)
        body.append([CONTROLLERS[name].label, *(_interval(p, ".0f") for p in peaks), str(left)])
    return to_table(
        f"peaks_{regime}", f"Median peak lateral error, {regime}-driven, with 95 % intervals", columns, body
    )


def _effort_table(rows: pd.DataFrame, regime: str) -> Table:
    shown = ("rms_e_y", *EFFORT)
    columns = [Column("Controller")]
    columns += [Column(METRICS[m].label, METRICS[m].unit) for m in shown]
    body = []
    for name in names_of(rows):
        here = rows[(rows["regime"] == regime) & (rows["controller"] == name)]
        medians = [METRICS[m].scale * np.median(here[m].to_numpy(dtype=float)) for m in shown]
        body.append([CONTROLLERS[name].label, *(_number(v, METRICS[m].form) for v, m in zip(medians, shown))])
    caption = f"RMS error and steering effort, {regime}-driven: medians over all manoeuvres and vehicles"
    return to_table(f"effort_{regime}", caption, columns, body)


def _layer_table(rows: pd.DataFrame) -> Table:
    """How much of the time sliding modes are outside their boundary layer, of runs that reached their end."""
    there = list(rows["manoeuvre"].unique())
    share = 100 * rows["outside_layer"].replace(np.inf, np.nan)
    found = share.groupby([rows["controller"], rows["manoeuvre"], rows["regime"]]).median()
    body = []
    for name in names_of(rows):
        if found[name].notna().any():
            cells = (", ".join(_number(found.get((name, m, r), np.nan), ".0f") for r in REGIMES) for m in there)
            body.append([CONTROLLERS[name].label, *cells])
    caption = (
        f"Share of the time outside the boundary layer, {'-driven, '.join(REGIMES)}-driven: there the switching term "
        "has all its size, within the law is linear feedback. Medians over vehicles"
    )
    columns = [Column("Controller"), *(Column(MANOEUVRES[m].label, "%") for m in there)]
    return to_table("layer", caption, columns, body)
