"""The page of a drive identified from logs: catalogue values, the runs they come from, hysteresis loops."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..drives import DriveFit, DriveRecord, HeldServo, MotorSideFit
from ..drives.diagram import draw_runs
from ..drives.held import TURN
from ..estimate import Estimates
from . import html
from .style import COLOURS, Drawing, canvas, tidy
from .tables import Column, Table
from .writer import ReportWriter

__all__ = ["write_drive", "write_held", "write_motor_side"]


def write_drive(
    fit: DriveFit, runs: Sequence[DriveRecord], held_out: Sequence[DriveRecord], folder: Path
) -> dict[str, Any]:
    """Write ``index.html`` and its figures, and return what they hold as plain data.

    Parameters
    ----------
    fit : DriveFit
        The drive.
    runs : sequence of DriveRecord
        Runs from which it was identified.
    held_out : sequence of DriveRecord
        Further runs, whose load's end is predicted.
    folder : Path
        Gets the files.
    """
    errors = [
        {"run": run.name, "angle_rms_deg": math.degrees(angle), "torque_rms_Nm": torque}
        for run in held_out if run.any_end for angle, torque in (fit.drive.errors(run),)
    ]  # fmt: skip
    result = fit.to_dict() | {"predicted": errors}
    writer = ReportWriter(folder)
    summary = _catalogue(fit) + writer.figure(_draw_hysteresis(fit))
    beside = _error_table(fit, errors) + writer.figure(_draw_runs(fit, runs, held_out))
    sections = [
        html.PageSection("summary", "What the drive is like", summary),
        html.PageSection("runs", "Runs beside the model", beside),
        html.PageSection("numbers", "Numbers and parts", _number_tables(fit)),
    ]
    writer.page(f"Drive from {', '.join(fit.runs)}", sections)
    return result


def write_motor_side(fit: MotorSideFit, folder: Path) -> dict[str, Any]:
    """Write ``index.html`` of a drive identified from its motor's side, and return its contents as plain data.

    Parameters
    ----------
    fit : MotorSideFit
        Of logs of the motor's side alone.
    folder : Path
        Gets the files.
    """
    result = fit.to_dict() | {"predicted": []}
    zeros = {"load zero": "angle", "load torque zero": "torque"}
    seen = [channel for zero, channel in zeros.items() if zero in fit.estimates.names]
    load_channels = f" and the load's {' and '.join(seen)}" if seen else " alone"
    hidden = "" if seen else " The ratio to the load and the load's own angle do not show there."
    words = (
        f"From the motor's angle and torque{load_channels}, in {', '.join(fit.runs)}: all numbers are those that "
        f"the motor feels.{hidden} The teeth changed sides {fit.crossings} times."
    )
    body = html.sentences([words]) + html.sentences(fit.not_told, "note") + _estimate_table(fit.estimates)
    sections = [html.PageSection("summary", "What the motor tells of its drive", body)]
    ReportWriter(folder).page(f"Drive from {', '.join(fit.runs)}", sections)
    return result


def write_held(by_log: Mapping[str, Sequence[HeldServo]], folder: Path) -> dict[str, Any]:
    """Write ``index.html`` of servos that held while others pulled, and return what it holds as plain data.

    Parameters
    ----------
    by_log : mapping of str to sequence of HeldServo
        By the name of the log.
    folder : Path
        Gets the files.
    """
    rows = tuple(
        (log, servo.servo, when, lost.ticks, lost.low, lost.high, 360 / TURN * lost.ticks)
        for log, servos in by_log.items() for servo in servos
        for when, lost in (("stretched", servo.stretched), ("let go", servo.let_go))
    )  # fmt: skip
    columns = (
        Column("Log"), Column("Servo"), Column("Pullers"), Column("Lost", "ticks", ".2f"),
        Column("From", "95 %", ".2f"), Column("To", "95 %", ".2f"), Column("Lost", "degrees", ".3f"),
    )  # fmt: skip
    caption = "Between the pulls to both sides: lost motion of gear and loop at the output, where the encoder sits."
    not_told = [words for servos in by_log.values() for servo in servos for words in servo.not_told]
    body = html.table(Table("held", caption, columns, rows)) + html.sentences(not_told, "note")
    sections = [html.PageSection("summary", "What they lose", body)]
    ReportWriter(folder).page(f"Servos held in {', '.join(by_log)}", sections)
    table = {
        f"{log}, servo {number}, {when}, ticks (95 %: {low:.3g} to {high:.3g})": ticks
        for log, number, when, ticks, low, high, _ in rows
    }
    servos = [{"log": log} | servo.to_dict() for log, each in by_log.items() for servo in each]
    return {"table": table, "servos": servos, "not_told": not_told, "runs": list(by_log), "predicted": []}


def _catalogue(fit: DriveFit) -> str:
    rows = tuple((name.partition(",")[0], name.rpartition(", ")[2] if "," in name else "", value)
                 for name, value in fit.table().items())  # fmt: skip
    columns = Column("At the load's end, motor held"), Column("Unit"), Column("Value", "", ".4g")
    shown = html.table(Table("catalogue", "The drive as catalogues of gears describe one.", columns, rows))
    return shown + html.sentences(fit.not_told, "note")


def _draw_hysteresis(fit: DriveFit) -> Drawing:
    torque, angle = fit.drive.hysteresis(fit.largest_torque)
    figure = canvas(3.0)
    ax = figure.subplots()
    ax.plot(torque, np.degrees(angle), color=COLOURS[0], lw=1.2)
    for end in (-0.03, 0.03):
        ax.axvline(end * fit.largest_torque, color="0.7", lw=0.8, ls=":")
    tidy(ax, "", "Load's angle (degrees)", "Load's torque (N m)")
    caption = (
        "Hysteresis of the drive with its motor held, as it follows from what was found: the load's angle while its "
        "torque goes to the largest of the runs and back; dotted: 3 % of it, between which lost motion is measured."
    )
    return Drawing("hysteresis", figure, caption, "Loop of the load's angle over its torque, with the motor held.")


def _draw_runs(fit: DriveFit, runs: Sequence[DriveRecord], held_out: Sequence[DriveRecord]) -> Drawing:
    origin = "Runs from which no drive was found" if held_out else "The runs that it was found from"
    caption = f"{origin}: the load's end as measured, and as it follows from the motor's end."
    return Drawing("runs", draw_runs(held_out or runs, fit.drive), caption, caption)


def _error_table(fit: DriveFit, errors: Sequence[Mapping[str, Any]]) -> str:
    if not errors:
        return html.paragraph("No run was kept back: how well the drive predicts others is not measured here.", "note")
    rows = tuple((row["run"], row["angle_rms_deg"], row["torque_rms_Nm"]) for row in errors)
    columns = Column("Run"), Column("Angle", "degrees RMS", ".3g"), Column("Torque", "N m RMS", ".3g")
    caption = f"Errors of the load's end, predicted from the motor's; found from {', '.join(fit.runs)}."
    return html.table(Table("predicted", caption, columns, rows))


def _estimate_table(estimates: Estimates) -> str:
    names = "name", "unit", "value", "low", "high", "posterior_over_prior"
    rows = tuple(tuple(row[name] for name in names) for row in estimates.beside_priors())
    columns = (
        Column("Number"), Column("Unit"), Column("Value", "", ".4g"), Column("From", "95 %", ".4g"),
        Column("To", "95 %", ".4g"), Column("Posterior over prior", "", ".2f"),
    )  # fmt: skip
    caption = "All that was fitted, at the motor unless its name says otherwise; near 1 in the last column: not told."
    return html.table(Table("numbers", caption, columns, rows))


def _number_tables(fit: DriveFit) -> str:
    numbers = _estimate_table(fit.estimates)
    if not fit.parts:
        return numbers + html.paragraph("No part beside ratio, elasticity, play and friction was worth its parameters.")
    parts = tuple(zip(fit.parts, fit.gains))
    caption = "Parts that were accepted, in this order, and by how much each raised the logarithm of the evidence."
    return numbers + html.table(Table("parts", caption, (Column("Part"), Column("Gain", "", ".1f")), parts))
