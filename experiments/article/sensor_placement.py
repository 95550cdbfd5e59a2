"""Best places of eight sensors for four modes, the contribution of each, and the layout of the rig file."""

from dataclasses import replace

import numpy as np
import pandas as pd

from clearance_mj.placement import Candidates, Placement, candidates, evaluate, grid, place_sensors
from clearance_mj.report.placement import draw
from clearance_mj.report.style import Drawing
from clearance_mj.report.tables import Column, Table
from clearance_mj.rig import Rig

from .result import BLACK, BLUE, GREY, Item, Result, panel, sheet, to_table

BEST, OURS, DISTURBED = "every layout tried", "exchange", "exchange, modes 5 and 6 disturb"


def run(item: Item, rig: Rig, sensors: int = 8, count: int = 24, modes=(1, 2, 3, 4), unwanted=(5, 6)) -> Result:
    """Place sensors for modes on so many candidates, evenly spaced outside the bushings; others disturb one layout."""
    x = grid(rig, count)
    at_bushings = [b.position for b in rig.bushings]
    # One list of positions for all, so that every layout is judged by the same information.
    every = np.unique(np.concatenate((x, at_bushings, [s.position for s in rig.sensors])))
    judge, places = candidates(rig, every, modes), candidates(rig, x, modes)
    layouts = {
        BEST: place_sensors(places, sensors, method="exhaustive").position,
        OURS: place_sensors(places, sensors).position,
        "effective independence (backward)": place_sensors(places, sensors, method="backward").position,
        "forward": place_sensors(places, sensors, method="forward").position,
        "trace": place_sensors(places, sensors, "trace").position,
        DISTURBED: place_sensors(candidates(rig, x, modes, unwanted=unwanted), sensors).position,
        "exchange, one in each bushing": _with_bushings(rig, x, at_bushings, sensors, modes).position,
        "rig file": np.array([s.position for s in rig.sensors]),
    }
    judged = {name: evaluate(judge, np.searchsorted(every, position)) for name, position in layouts.items()}
    rows = pd.DataFrame(_row(name, layout, judged[BEST], len(modes)) for name, layout in judged.items())
    ours = replace(draw(rig, places, judged[OURS], modes), name=item.name)
    return Result(
        method=(
            f"{count} candidates, evenly spaced outside the bushings, modes {', '.join(map(str, modes))} in the gap, "
            "equal noise. The determinant of the Fisher information Q = ΦᵀR⁻¹Φ is maximised. Effective independence "
            "deletes the sensor with the least contribution E one after the other (Kammer 1991), forward selection "
            "adds one after the other, exchange improves both by single exchanges; all layouts are tried as well. "
            "Every layout is judged by the same information, without disturbing modes."
        ),
        shows=_shows(rows, judged),
        drawings=(ours, _draw_layouts(rig, rows, judged)),
        data={
            item.name: pd.concat(
                [layout.table.assign(layout=name).set_index("layout").reset_index() for name, layout in judged.items()]
            ),
            f"{item.name}_layouts": rows,
        },
        tables=(_layout_table(rows), _sensor_table(judged[OURS])),
    )


def _with_bushings(rig, x, at_bushings, sensors, modes) -> Placement:
    positions = np.union1d(x, at_bushings)
    places: Candidates = candidates(rig, positions, modes)
    return place_sensors(places, sensors, required=np.searchsorted(positions, at_bushings).tolist())


def _row(name, layout, best, modes) -> dict:
    ratio = layout.determinant / best.determinant
    return {
        "layout": name, "positions_m": " ".join(f"{x:.4f}" for x in layout.position), "determinant_over_best": ratio,
        "efficiency": ratio ** (1 / modes), "trace": layout.trace, "condition": layout.condition,
        "worst_mac": layout.worst_mac, "worst_growth": float(layout.std_growth.max()),
    }  # fmt: skip


def _shows(rows, judged) -> str:
    percent = 100 * rows.set_index("layout")["determinant_over_best"]
    ours, drawn = judged[OURS], judged["rig file"]
    most, least = int(np.argmax(ours.contribution)), int(np.argmin(ours.contribution))
    return (
        f"The sensor at {ours.position[most]:.3f} m contributes most, the one at {ours.position[least]:.3f} m least. "
        f"The layout of the rig file has {percent['rig file']:.0f} % of the best determinant; in it the sensor at "
        f"{drawn.position[np.argmax(drawn.contribution)]:.4g} m contributes most."
    )


def _layout_table(rows) -> Table:
    columns = (
        Column("Layout"), Column("Determinant over best", "", ".4f"), Column("Efficiency per mode", "", ".4f"),
        Column("Trace", "", ".2f"), Column("Condition", "", ".2f"), Column("Largest MAC between modes", "", ".3f"),
        Column("Largest std ratio", "", ".2f"),
    )  # fmt: skip
    return to_table("layouts", "Layouts of eight sensors for four modes", columns, rows.drop(columns="positions_m"))


def _sensor_table(layout) -> Table:
    modes = range(1, layout.std.size + 1)
    columns = (
        Column("Sensor", "", "d"), Column("Position", "m", ".4f"), Column("Contribution E", "", ".4f"),
        Column("Determinant left", "", ".4f"), *(Column(f"Std ratio {mode}", "", ".3f") for mode in modes),
    )  # fmt: skip
    caption = "Contribution of each sensor; std ratio: standard deviation of a mode without it over that with it"
    return to_table("sensors", caption, columns, layout.table)


def _draw_layouts(rig, rows, judged) -> Drawing:
    figure = sheet(3.2)
    shaft, bars = figure.subplots(1, 2, sharey=True, width_ratios=(1.6, 1))
    for bushing in rig.bushings:
        shaft.axvspan(*bushing.ends, color=GREY, alpha=0.4, lw=0)
    lines = np.arange(len(rows))[::-1]
    for line, layout in zip(lines, judged.values()):
        shaft.plot([0, rig.beam.length], [line] * 2, color=GREY, lw=0.6)
        shaft.scatter(layout.position, np.full(layout.position.size, line), 200 * layout.contribution**2, color=BLUE)
    shares = rows["determinant_over_best"]
    bars.barh(lines, shares, 0.55, color=BLUE)
    for line, ratio in zip(lines, shares):
        bars.text(ratio + 0.02, line, f"{ratio:.3f}", va="center", fontsize=7, color=BLACK)
    panel(shaft, "sensors; area: contribution squared", "Distance from the clamp (m)")
    panel(bars, "determinant", "Determinant over the best (1)")
    shaft.set_yticks(lines, rows["layout"], fontsize=7)
    bars.set_xlim(0, 1.4)
    caption = "Layouts; grey bands: bushings. One sensor in each bushing exceeds 1, since bushings are no candidates."
    return Drawing("sensor_placement_layouts", figure, caption, "Positions and determinants of eight layouts.")
