"""CSAC and CSF over frequency: over all sensors, and of each."""

from __future__ import annotations

from ...study import Study
from ..style import REPEAT, Drawing, frequency_axis, letters, sensor_title, sheet, tidy
from .looks import Looks


def correlation(study: Study, level: float) -> Drawing:
    """Draw standard CSAC and CSF over all sensors."""
    looks = Looks(study)
    figure = sheet(3.4, looks.repeat_key(level), titled=0.08)
    axes = figure.subplots(2, 1, gridspec_kw={"hspace": 0.1})
    for ax, field in zip(axes, ("csac", "csf")):
        if repeat := study.repeatability.get(level):
            ax.plot(repeat.frequency, getattr(repeat, field), color=REPEAT, linewidth=1.5, label="repeatability")
        for case in looks.cases(level):
            of_case = case.comparison
            ax.plot(of_case.frequency, getattr(of_case, field), **looks.line(case.law, case.engine))
        tidy(ax, ylabel=f"{field.upper()} over all sensors (1)")
        ax.set_ylim(0, 1.04)
        frequency_axis(ax, _band(study, level), field == "csf")
    caption = f"CSAC and CSF as published, over all sensors at each line. {looks.words(level)}"
    alt = f"CSAC and CSF over all sensors against frequency, laws {looks.laws}, {looks.level_words(level)}."
    return Drawing(looks.name("correlation", level), figure, caption, alt, level == study.main_level, chart=True)


def csac_sensors(study: Study, level: float) -> Drawing:
    """Draw the windowed CSAC of every sensor."""
    return _draw_per_sensor(study, level, "csac")


def csf_sensors(study: Study, level: float) -> Drawing:
    """Draw the windowed CSF of every sensor."""
    return _draw_per_sensor(study, level, "csf")


def _draw_per_sensor(study: Study, level: float, name: str) -> Drawing:
    looks, label, engine = Looks(study), name.upper(), study.main_engine
    n = len(looks.rig.sensors)
    n_lines = -(-n // 2)
    figure = sheet(1.45 * n_lines, looks.repeat_key(level, engines=False))
    grid = figure.add_gridspec(n_lines, 2, hspace=0.28, wspace=0.14)
    shown = [(looks.line(law, engine), study.case(law, engine, level).comparison) for law in study.methods]
    if repeat := study.repeatability.get(level):
        shown.insert(0, ({"color": REPEAT, "label": "repeatability"}, repeat))
    for row, letter in enumerate(letters(n)):
        ax = figure.add_subplot(grid[row // 2, row % 2])
        for look, of_case in shown:
            ax.plot(of_case.frequency, getattr(of_case, f"{name}_per_sensor")[row], **look | {"linewidth": 1.0})
        tidy(ax, f"{letter} {sensor_title(looks.rig, row)}", f"{label} (1)" if row % 2 == 0 else "")
        ax.set_ylim(0, 1.04)
        frequency_axis(ax, _band(study, level), row >= n - 2)
    caption = (
        f"{label} of every sensor over frequency by our variant that takes a window of nine lines in place of the "
        f"responses; engine {engine}. Level {looks.level_words(level)} record {study.records(level)[0].name}."
    )
    alt = f"{label} over frequency for each of {n} sensors, laws {looks.laws}, {looks.level_words(level)}."
    return Drawing(looks.name(f"{name}_sensors", level), figure, caption, alt, level == study.main_level, chart=True)


def _band(study: Study, level: float) -> tuple[float, float]:
    frequency = study.test(study.records(level)[0]).frequency
    return float(frequency[0]), float(frequency[-1])
