"""FRFs and criteria of models and test over frequency, sensor by sensor: Figures 7 to 10."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from clearance_mj.report.style import Drawing
from clearance_mj.report.tables import Column, Table
from clearance_mj.signals.correlation import rmse_db
from clearance_mj.study import Study, StudyCase

from .models import MODELS, REPEAT, TEST, cases, decibel, main_cases, name_of, position, prior_information, test_words
from .published import MODELS as ARTICLE_MODELS
from .published import Printed
from .result import Item, Result, legend, panel, rounded, sheet, to_table

SPLIT = 65.0  # Hz, between the second mode and the third
ROOM = 3.0  # dB


# Figures 7 and 8.


def overlay(item: Item, study: Study, nodes: Sequence[int], columns: int, level: float | None = None) -> Result:
    """Overlay the FRFs of test and models at some sensors in so many columns; default: at the middle level."""
    level = study.main_level if level is None else level
    all_cases, test = cases(study, level), decibel(study.test(study.records(level)[0]))
    of_rig = [s.node for s in study.dataset.rig.sensors]
    rows = [of_rig.index(node) for node in nodes]
    errors, words = _errors(study, all_cases, level, nodes, rows), test_words(study, level)
    caption = (
        f"Magnitude of acceleration over base acceleration, engine {study.engines[0]}; test: {words}. Closest to the "
        f"test: {_closest(errors, study.engines[0])}."
    )
    alt = f"FRF magnitudes of test and models at sensors {', '.join(map(str, nodes))}."
    levels = {"test_db": test, "repeat_db": decibel(all_cases[-1].frf)}
    levels |= {f"{case.law} {case.engine}_db": decibel(case.frf) for case in all_cases[:-1]}
    return Result(
        method=(
            f"Every model is driven by the measured base acceleration of {words}, which no law has seen. H1 with Hann "
            "window, half overlap, lines every 0.5 Hz from 5 to 220 Hz, for test and models alike."
        ),
        shows=_overlay_shows(errors, study.engines[0]),
        drawings=(Drawing(item.name, _draw_overlay(study, all_cases, test, rows, columns), caption, alt),),
        data={
            item.name: _over_frequency(nodes, rows, all_cases[0].frf.frequency, levels),
            f"{item.name}_errors": errors,
        },
        tables=(_error_table(errors, nodes),),
        prior_information=prior_information(study),
    )


def _over_frequency(nodes: Sequence[int], rows: Sequence[int], frequency: np.ndarray, curves: dict) -> pd.DataFrame:
    """Curves of sensors, arrays (n_sensors, n_f), below each other."""
    frames = [
        pd.DataFrame({"sensor": node, "frequency_hz": frequency} | {name: curve[row] for name, curve in curves.items()})
        for node, row in zip(nodes, rows)
    ]
    return rounded(pd.concat(frames, ignore_index=True), 6).astype({"sensor": int})


def _errors(
    study: Study, all_cases: list[StudyCase], level: float, nodes: Sequence[int], rows: Sequence[int]
) -> pd.DataFrame:
    """RMSE in dB of every model, and of the test's repeat, at the sensors: whole band, modes 1-2, modes 3-4."""
    test = study.test(study.records(level)[0])
    bands = {"": test.frequency > 0, "_below_65_hz": test.frequency < SPLIT, "_above_65_hz": test.frequency >= SPLIT}
    frames = []
    for case in all_cases:
        errors = {
            f"rmse_db{band}": rmse_db(test.functions[rows][:, lines], case.frf.functions[rows][:, lines])
            for band, lines in bands.items()
        }
        frames.append(pd.DataFrame({"law": case.law, "engine": case.engine, "sensor": nodes} | errors))
    return pd.concat(frames, ignore_index=True)


def _draw_overlay(
    study: Study, all_cases: list[StudyCase], test: np.ndarray, rows: Sequence[int], columns: int
) -> Figure:
    lines = -(-len(rows) // columns)
    figure = sheet(0.5 + (2.6 if columns == 1 else 1.9) * lines)
    axes = figure.subplots(lines, columns, sharex=True, squeeze=False)
    frequency, repeat = all_cases[0].frf.frequency, decibel(all_cases[-1].frf)
    curves = {case.law: decibel(case.frf) for case in main_cases(all_cases)}
    for i, (ax, row) in enumerate(zip(axes.flat, rows)):
        ax.plot(frequency, test[row], **TEST)
        ax.plot(frequency, repeat[row], **REPEAT)
        _draw_models(ax, frequency, {law: curve[row] for law, curve in curves.items()})
        drawn, known = np.concatenate([curve[row] for curve in curves.values()]), test[row]
        ax.set_ylim(min(known.min(), np.percentile(drawn, 0.5)) - ROOM, max(known.max(), drawn.max()) + ROOM)
        ax.set_xlim(0, frequency[-1])
        _title(ax, study, i, row, i >= len(rows) - columns, "|H| (dB re 1)" if i % columns == 0 else "")
    legend(figure, axes[0, 0], 4)
    return figure


def _draw_models(ax: Axes, frequency: np.ndarray, curves: dict[str, np.ndarray]) -> None:
    for law, curve in curves.items():
        ax.plot(frequency, curve, label=MODELS[law].label, **MODELS[law].line)


def _title(ax: Axes, study: Study, i: int, row: int, last: bool, label: str) -> None:
    panel(ax, f"({chr(ord('a') + i)}) {position(study.dataset.rig, row)}", "Frequency (Hz)" if last else "", label)


def _overlay_shows(errors: pd.DataFrame, engine: str) -> str:
    means = errors[errors["engine"].isin((engine, "rig"))].groupby("law", sort=False).mean(numeric_only=True)
    parts = (
        f"{name_of(law)} {row['rmse_db_below_65_hz']:.2f} / {row['rmse_db_above_65_hz']:.2f} dB"
        for law, row in means.iterrows()
    )
    return (
        f"RMS difference from the test on {engine}, mean of these sensors, below / above {SPLIT:g} Hz (modes 1-2 / "
        f"3-4): {'; '.join(parts)}."
    )


def _closest(errors: pd.DataFrame, engine: str) -> str:
    """Return the law with the smallest mean error on an engine, in words."""
    return name_of(errors[errors["engine"] == engine].groupby("law")["rmse_db"].mean().idxmin())


def _error_table(errors: pd.DataFrame, nodes: Sequence[int]) -> Table:
    columns = (Column("Model"), Column("Engine"), *(Column(f"sensor {n}", "", ".3f", "RMSE, dB (ours)") for n in nodes))
    sensors = Printed.load(2).numbers.loc[[str(node) for node in nodes]]
    rows = [(f"article, {kind} (unit not given)", "", *sensors[f"{kind}_rmse"]) for kind in ARTICLE_MODELS]
    for (law, engine), of_model in errors.groupby(["law", "engine"], sort=False):
        rows.append((name_of(law), engine, *of_model["rmse_db"]))
    return to_table("errors", "RMSE of the FRF: published (Table 2) and ours", columns, rows)


# Figures 9 and 10.


def criterion(item: Item, study: Study, criterion: str, level: float | None = None) -> Result:
    """Draw "csac" or "csf" over frequency for every sensor; default: at the middle level."""
    level = study.main_level if level is None else level
    all_cases, label, words = cases(study, level), criterion.upper(), test_words(study, level)
    means, nodes = _means(study, all_cases, criterion), [s.node for s in study.dataset.rig.sensors]
    caption = (
        f"{label} over a window of nine lines (4 Hz), engine {study.engines[0]}; test: {words}. 1 is full agreement."
    )
    curves = {_column(case): _per_sensor(case, criterion) for case in (all_cases[-1], *all_cases[:-1])}
    alone = "1 by definition" if criterion == "csac" else "a ratio of magnitudes only"
    drawing = Drawing(item.name, _draw_criterion(study, all_cases, criterion), caption, f"{label} of each sensor.")
    frequency = all_cases[0].comparison.frequency
    return Result(
        method=(
            f"{label} sums over responses, and one response alone gives {alone}. For one sensor a window of nine lines "
            "around each line takes the place of the responses. Models and test as in Figure 7."
        ),
        shows=_criterion_shows(means, label, study.engines[0]),
        drawings=(drawing,),
        data={item.name: _over_frequency(nodes, range(len(nodes)), frequency, curves), f"{item.name}_means": means},
        tables=(_mean_table(means, label),),
        prior_information=prior_information(study),
    )


def _column(case: StudyCase) -> str:
    return case.law if case.law == "repeat" else f"{case.law} {case.engine}"


def _per_sensor(case: StudyCase, criterion: str) -> np.ndarray:
    return getattr(case.comparison, f"{criterion}_per_sensor")


def _means(study: Study, all_cases: list[StudyCase], criterion: str) -> pd.DataFrame:
    """Mean over the lines of each model and sensor, the article's first."""
    published, nodes = Printed.load(2).numbers, [str(s.node) for s in study.dataset.rig.sensors]
    rows = [
        {"law": f"article {kind}", "engine": ""}
        | {f"sensor_{node}": value for node, value in published[f"{kind}_{criterion}"].items()}
        for kind in ARTICLE_MODELS
    ]
    for case in all_cases:
        means = _per_sensor(case, criterion).mean(axis=1)
        row = {"law": case.law, "engine": case.engine} | {f"sensor_{n}": m for n, m in zip(nodes, means)}
        row |= {"sensor_mean": means.mean(), "over_all_sensors": getattr(case.comparison, criterion).mean()}
        rows.append(row)
    return pd.DataFrame(rows)


def _draw_criterion(study: Study, all_cases: list[StudyCase], criterion: str) -> Figure:
    n, columns, frequency = len(study.dataset.rig.sensors), 2, all_cases[0].comparison.frequency
    figure = sheet(0.5 + 1.35 * -(-n // columns))
    axes = figure.subplots(-(-n // columns), columns, sharex=True, sharey=True)
    for row, ax in zip(range(n), axes.flat):
        ax.plot(frequency, _per_sensor(all_cases[-1], criterion)[row], **REPEAT)
        _draw_models(ax, frequency, {c.law: _per_sensor(c, criterion)[row] for c in main_cases(all_cases)})
        label = f"{criterion.upper()} (1)" if row % columns == 0 else ""
        _title(ax, study, row, row, row >= n - columns, label)
        ax.set(xlim=(0, frequency[-1]), ylim=(0, 1.05))
    legend(figure, axes[0, 0], 3)
    return figure


def _criterion_shows(means: pd.DataFrame, label: str, engine: str) -> str:
    ours = means[means["engine"] == engine].set_index("law")["sensor_mean"]
    return f"{name_of(ours.idxmax())} has the highest mean {label} on {engine}, {ours.max():.4f}."


def _mean_table(means: pd.DataFrame, label: str) -> Table:
    columns = (
        Column("Model"), Column("Engine"), Column("Each sensor, mean", "", ".4f"), Column("All sensors", "", ".4f"),
    )  # fmt: skip
    shown = means.assign(law=means["law"].map(name_of))[["law", "engine", "sensor_mean", "over_all_sensors"]]
    shown = shown.astype(object).where(shown.notna(), None)  # the article has none over all sensors
    return to_table("means", f"Mean {label} over the lines: published (Table 2) and ours", columns, shown)
