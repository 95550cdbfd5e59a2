"""FRFs of the models over those of the test, sensor by sensor: Figures 7 and 8."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from clearance_mj.report.figures import Drawing
from clearance_mj.report.tables import Column, Table
from clearance_mj.signals.correlation import rmse_db

from .context import Context
from .models import MODELS, REPEAT, TEST, knows, main_cases, name_of, place, test_words
from .result import Result
from .style import FONT, panel, sheet
from .texts import texts

__all__ = ["frf_overlay"]

SPLIT = 65.0  # Hz, between the second mode and the third
ROOM = 3.0  # dB


def frf_overlay(context: Context, name: str, nodes: Sequence[int], columns: int, level) -> Result:
    """Overlay the FRFs of test and models.

    Parameters
    ----------
    context : Context
        Gives test and models.
    name : str
        The item.
    nodes : sequence of int
        Sensors, one panel each.
    columns : int
        Of panels.
    level : float or None
        m/s²; the middle level for None.
    """
    words, level = texts(name), context.main_level if level is None else level
    of_rig = [s.node for s in context.dataset.rig.sensors]
    rows = [of_rig.index(node) for node in nodes]
    errors = _errors(context, level, rows)
    caption = (
        f"{words['title']}: magnitude of acceleration over base acceleration. Engine {context.engines[0]}; test: "
        f"{test_words(context, level)}. Dips of a model far below the test are cut."
    )
    alt = f"FRF magnitudes of test and models at sensors {', '.join(map(str, nodes))}."
    return Result(
        **words,
        method=(
            f"Every model is driven by the measured base acceleration of {test_words(context, level)}, which no law "
            "has seen. H1, Hann window, half overlap, lines every 0.5 Hz from 5 to 220 Hz, estimated alike for test "
            f"and models. Engines: {', '.join(context.engines)}; on links stiffness and damping are set before every "
            "step."
        ),
        shows=_shows(errors, context.engines[0]),
        drawings=(Drawing(name, _draw(context, level, rows, columns), caption, alt),),
        data={name: _spectra(context, level, rows), f"{name}_errors": errors},
        tables=(_table(context, errors, nodes),),
        knows=knows(context),
    )


def _decibel(value) -> np.ndarray:
    return 20 * np.log10(np.abs(value))


def _errors(context, level, rows) -> list[dict]:
    """RMSE in dB of every model, and of the test's repeat, at the sensors: whole band, modes 1-2, modes 3-4."""
    test, repeat = (context.tests[r.name] for r in context.records(level)[:2])
    runs = [(case.law, case.engine, case.frf) for case in context.cases(level)] + [("repeat", "rig", repeat)]
    bands = {"": test.frequency > 0, "_below_65_hz": test.frequency < SPLIT, "_above_65_hz": test.frequency >= SPLIT}
    table = []
    for law, engine, frf in runs:
        errors = {band: rmse_db(test.value[rows][:, lines], frf.value[rows][:, lines]) for band, lines in bands.items()}
        for i, row in enumerate(rows):
            found = {"law": law, "engine": engine, "sensor": context.dataset.rig.sensors[row].node}
            table.append(found | {f"rmse_db{band}": float(error[i]) for band, error in errors.items()})
    return table


def _spectra(context, level, rows) -> list[dict]:
    frf = dict(zip(("test_db", "repeat_db"), (context.tests[r.name] for r in context.records(level)[:2])))
    frf |= {f"{case.law} {case.engine}_db": case.frf for case in context.cases(level)}
    frequency = frf["test_db"].frequency
    levels = {name: _decibel(value.value[rows]) for name, value in frf.items()}
    return [
        {"sensor": context.dataset.rig.sensors[row].node, "frequency_hz": f"{frequency[line]:g}"}
        | {name: f"{value[i, line]:.6g}" for name, value in levels.items()}
        for i, row in enumerate(rows)
        for line in range(frequency.size)
    ]


def _draw(context, level, rows, columns) -> Figure:
    lines = -(-len(rows) // columns)
    figure = sheet(0.5 + (2.6 if columns == 1 else 1.9) * lines)
    axes = figure.subplots(lines, columns, sharex=True, squeeze=False)
    test, repeat = (context.tests[r.name] for r in context.records(level)[:2])
    for i, (ax, row) in enumerate(zip(axes.flat, rows)):
        ax.plot(test.frequency, _decibel(test.value[row]), **TEST)
        ax.plot(repeat.frequency, _decibel(repeat.value[row]), **REPEAT)
        for case in main_cases(context, level):
            model = MODELS[case.law]
            ax.plot(test.frequency, _decibel(case.frf.value[row]), label=model.label, **model.line)
        drawn = np.concatenate([_decibel(case.frf.value[row]) for case in main_cases(context, level)])
        known = _decibel(test.value[row])
        ax.set_ylim(min(known.min(), np.percentile(drawn, 0.5)) - ROOM, max(known.max(), drawn.max()) + ROOM)
        ax.set_xlim(0, test.frequency[-1])
        last, first = i >= len(rows) - columns, i % columns == 0
        title = f"({chr(ord('a') + i)}) {place(context, row)}"
        panel(ax, title, "Frequency (Hz)" if last else "", "|H| (dB re 1)" if first else "")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4, fontsize=FONT - 1, frameon=False)
    return figure


def _shows(errors, engine) -> str:
    parts = []
    for law, on in dict.fromkeys((e["law"], e["engine"]) for e in errors if e["engine"] in (engine, "rig")):
        found = [e for e in errors if (e["law"], e["engine"]) == (law, on)]
        low, high = (np.mean([e[f"rmse_db_{side}_65_hz"] for e in found]) for side in ("below", "above"))
        parts.append(f"{name_of(law)} {low:.2f} / {high:.2f} dB")
    return (
        f"RMS difference from the test on {engine}, mean of these sensors, around modes 1-2 (below {SPLIT:g} Hz) / "
        f"around modes 3-4 (above): {'; '.join(parts)}."
    )


def _table(context, errors, nodes) -> Table:
    columns = (Column("Model"), Column("Engine"), *(Column(f"sensor {n}", "", ".3f", "RMSE, dB (ours)") for n in nodes))
    rows = []
    for kind in ("initial", "updated"):
        values = [context.article.sensors[str(node)][f"{kind}_rmse"] for node in nodes]
        rows.append((f"{name_of(f'article {kind}')} (unit not given)", "", *values))
    for law, engine in dict.fromkeys((e["law"], e["engine"]) for e in errors):
        values = [e["rmse_db"] for e in errors if (e["law"], e["engine"]) == (law, engine)]
        rows.append((name_of(law), engine, *values))
    return Table("errors", "RMSE of the FRF: published (Table 2) and ours", columns, tuple(rows))
