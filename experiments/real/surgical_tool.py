"""Surgical tools: what the jaw of a cable drive does, from angle and torque at the motor's end alone.

Three tools are identified from runs at some frequencies, with both ends measured, and predicted at others from the
motor's end. Runs are named by two digits: frequency (0 to 4: 0.1 to 0.5 Hz) and load (0 to 3: 10 to 40 %).

    python -m experiments.real.surgical_tool FOLDER --identify 0,2,4 --predict 1,3 --out results/real_surgical_tool
"""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from clearance_mj.core.errors import RecordError
from clearance_mj.core.files import replacing, to_json, write_text
from clearance_mj.drives import DriveFit, DriveRecord, fit_drive
from clearance_mj.drives.diagram import draw_loops

from .script import run

TOOLS = ("tool_4_maryland_l_2", "tool_5_maryland_l_2", "tool_4_maryland_r_5")
COLUMNS = {
    "time": "time_s", "motor_angle": "back_angle_rad", "motor_torque": "-back_torque_Nm",
    "load_angle": "front_angle_rad", "load_torque": "-front_torque_Nm",
}  # fmt: skip
"""Torques as recorded are those on the motor and on the drive: the drive would give more work than it gets"""


def runs_of(folder: Path, tool: str, frequencies: Sequence[str]) -> list[DriveRecord]:
    """Runs of a tool at frequencies that are named by their digits."""
    folder = folder / "surgical_tool" if (folder / "surgical_tool").is_dir() else folder
    files = sorted(path for f in frequencies for path in (folder / tool).glob(f"{f}[0-9].csv.gz"))
    if not files:
        raise RecordError(f"{folder / tool}: No such file: runs {', '.join(f'{f}0.csv.gz ...' for f in frequencies)}")
    return [DriveRecord.read(path, COLUMNS) for path in files]


def analyse(folder: Path, identify: str = "0,2,4", predict: str = "1,3") -> dict:
    """Drives of all tools, and how far each is from runs that it was not found from."""
    fits, rows, across, shown = {}, [], [], {}
    for tool in TOOLS:
        fits[tool] = fit_drive(runs_of(folder, tool, identify.split(",")))
    for tool in TOOLS:
        validation = runs_of(folder, tool, predict.split(","))
        shown[tool] = validation[-1]
        for record in validation:
            angle, torque = fits[tool].drive.errors(record)
            rows.append({
                "tool": tool, "run": record.name, "angle_rms_deg": math.degrees(angle), "torque_rms_mNm": 1e3 * torque
            })  # fmt: skip
        for other in TOOLS:
            errors = [_errors_of_another(fits[other], other, tool, record) for record in validation]
            angle, torque = np.sqrt(np.mean(np.square(errors), axis=0))
            across.append({
                "drive of": other, "runs of": tool, "angle_rms_deg": math.degrees(angle), "torque_rms_mNm": 1e3 * torque
            })  # fmt: skip
    return {"fits": fits, "rows": rows, "across": across, "shown": shown}


def _errors_of_another(fit: DriveFit, tool: str, of: str, record: DriveRecord) -> tuple[float, float]:
    """Return errors of one tool's drive in a run of another, each about its zero; right-hand tools are mirrored."""
    sign = 1.0 if ("_r_" in tool) == ("_r_" in of) else -1.0
    angle, torque = fit.drive.follow(
        DriveRecord(record.name, record.fs, sign * record.motor_angle, sign * record.motor_torque)
    )
    return float(np.std(sign * angle - record.load_angle)), float(np.std(sign * torque - record.load_torque))


def draw(result: dict) -> Figure:
    """One row a tool: the jaw's torque and what its angle lacks, over the motor's angle; errors of all runs."""
    figure = Figure(figsize=(11, 9), layout="constrained")
    axes = figure.subplots(len(TOOLS), 3)
    for row, tool in zip(axes, TOOLS):
        record = result["shown"][tool]
        draw_loops(row, record, result["fits"][tool].drive)
        row[0].set_title(f"{tool}, run {record.name}", fontsize=9)
        of_tool = [r for r in result["rows"] if r["tool"] == tool]
        names = [r["run"] for r in of_tool]
        row[2].bar(names, [r["angle_rms_deg"] for r in of_tool], width=0.4, align="edge", label="angle, degrees RMS")
        row[2].bar(names, [r["torque_rms_mNm"] for r in of_tool], width=-0.4, align="edge", label="torque, mN m RMS")
        row[2].set_title("errors of runs that the drive was not found from", fontsize=9)
    for ax in axes[-1, :2]:
        ax.set_xlabel("motor's angle, degrees")
    for ax in axes[0]:
        ax.legend(fontsize=7)
    return figure


def write(result: dict, folder: Path) -> None:
    """Write tool.json and tool.png, and print the errors of each tool."""
    folder.mkdir(parents=True, exist_ok=True)
    data = {
        "rows": result["rows"], "across": result["across"],
        "tools": {tool: fit.to_dict() for tool, fit in result["fits"].items()},
    }  # fmt: skip
    write_text(folder / "tool.json", to_json(data))
    with replacing(folder / "tool.png") as path:
        draw(result).savefig(path, format="png", dpi=110)
    for tool in TOOLS:
        errors = [(r["angle_rms_deg"], r["torque_rms_mNm"]) for r in result["rows"] if r["tool"] == tool]
        angle, torque = np.sqrt(np.mean(np.square(errors), axis=0))
        size = result["fits"][tool].estimates.value.size
        print(f"{tool}: angle {angle:.2f} degrees, torque {torque:.2f} mN m RMS, {size} parameters")


def main(arguments: Sequence[str] | None = None) -> int:
    """Identify, predict, write; status 2 without the records."""
    return run(
        analyse, write, __doc__ or "", "The records of the surgical tools", arguments,
        identify={"default": "0,2,4", "help": "digits of the frequencies to identify from"},
        predict={"default": "1,3", "help": "digits of the frequencies to predict"},
    )  # fmt: skip


if __name__ == "__main__":
    raise SystemExit(main())
