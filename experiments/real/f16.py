"""F-16: a wing with a loose payload, its response predicted at levels that no fit saw.

A structure of modes with two joints that slip is identified from multisines at several levels and simulated under the
measured force alone. Beside it stand predictions by FRFs: that of the lowest level (the linear model), of the nearest,
and between the neighbouring ones. Sweeps are no part of any fit. Where no record of a level to predict is in the
folder, each of the levels at hand is left out once and predicted from the others.

    python -m experiments.real.f16 FOLDER --identify 1,3,5,7 --predict 2,4,6 --out results/real_f16
"""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

import clearance_mj as cm
from clearance_mj import Excitation, RecordError, Response, rmse_db
from experiments.joints.jointed_structure import JointedStructure, fit_jointed_structure

from .records import read_f16
from .script import run

SAMPLES = 8192  # of a period, at 400 Hz
DROP = 1  # periods with the transient
OUTPUTS = ("shaker", "wing", "payload")
RELATIVE = ("3:+Z", "2:+Z")  # payload less wing
FREE, AT_SENSORS = "free", "payload-wing"
SWEEP, MULTISINE = "SineSw", "FullMSine"
COLORS = {
    "measured": "#000000", "law": "#d55e00", "linear": "#8c8c8c", "interpolation": "#0072b2", "nearest": "#56b4e9",
}  # fmt: skip


def numbers(text: str) -> list[int]:
    """Whole numbers between commas."""
    return [int(part) for part in text.split(",") if part.strip()]


def record_of(folder: Path, kind: str, level: int) -> Response | None:
    """The record of a level, None if it is not in the folder; those of the benchmark's tests have longer names."""
    paths = sorted(folder.glob(f"F16Data_{kind}_Level{level}[!0-9]*mat"))
    if not paths:
        return None
    record = read_f16(paths[0])
    if kind == MULTISINE and record.excitation.size % SAMPLES:
        raise RecordError(f"{paths[0]}: {record.excitation.size} samples are no whole periods of {SAMPLES}")
    return record


class Levels:
    """Multisines by level: spectra of the steady periods at the excited lines."""

    def __init__(self, records: dict[int, Response]):
        self.records = records
        frequency = np.fft.rfftfreq(SAMPLES, 1 / 400)
        self.lines = np.flatnonzero((frequency >= 2.0 - 1e-9) & (frequency <= 15.0 + 1e-9))
        self.frequency = frequency[self.lines]
        self.rms = {level: float(np.std(record.excitation)) for level, record in records.items()}
        self.force = {level: self.periods(record.excitation[None]) for level, record in records.items()}
        self.measured = {level: self.periods(record.acceleration) for level, record in records.items()}

    def periods(self, signals: np.ndarray) -> np.ndarray:
        """(n, periods, lines) spectra, the transient left out where there is more than one period."""
        split = signals.reshape(len(signals), -1, SAMPLES)
        return np.fft.rfft(split[:, DROP if split.shape[1] > 1 else 0 :])[..., self.lines]

    def frf(self, level: int, spectra: np.ndarray | None = None) -> np.ndarray:
        """(3, lines) best linear approximation of a level's record, or of other spectra under its force."""
        spectra = self.measured[level] if spectra is None else spectra
        return spectra.mean(axis=1) / self.force[level].mean(axis=1)

    def by_frfs(self, level: int, known: Sequence[int]) -> dict[str, tuple[np.ndarray, list[int]]]:
        """FRFs (3, lines) that stand for a level, made of other levels, and which these are."""
        ranked = sorted(known, key=lambda k: self.rms[k])
        nearest = min(known, key=lambda k: abs(self.rms[k] - self.rms[level]))
        predictions = {"linear": (self.frf(ranked[0]), [ranked[0]]), "nearest": (self.frf(nearest), [nearest])}
        below = [k for k in ranked if self.rms[k] < self.rms[level]]
        above = [k for k in ranked if self.rms[k] > self.rms[level]]
        if below and above:
            a, b = below[-1], above[0]
            fraction = (self.rms[level] - self.rms[a]) / (self.rms[b] - self.rms[a])
            predictions["interpolation"] = ((1 - fraction) * self.frf(a) + fraction * self.frf(b), [a, b])
        return predictions


def rms_of(spectra: np.ndarray) -> np.ndarray:
    """(n,) RMS of what spectra (n, periods, lines) of whole periods hold."""
    return np.sqrt(2 * np.mean(np.sum(np.abs(spectra) ** 2, axis=-1), axis=-1)) / SAMPLES


def steady_rms(signals: np.ndarray) -> np.ndarray:
    """(n,) RMS of records without the transient, of all frequencies."""
    split = signals.reshape(len(signals), -1, SAMPLES)
    return np.sqrt(np.mean(split[:, DROP if split.shape[1] > 1 else 0 :] ** 2, axis=(1, 2)))


def simulate(fit: JointedStructure, record: Response) -> Response:
    """The law under the measured force alone."""
    excitation = Excitation(record.excitation, record.fs, "force", record.band)
    return cm.simulate(fit.rig, excitation, fit.law, engine="modal")


def linear_response(fit: JointedStructure, record: Response) -> np.ndarray:
    """(3, n) accelerations of the modes of the lowest level."""
    rig = fit.rig.replace(bushings=(), structure=fit.linear)
    return cm.simulate(rig, Excitation(record.excitation, record.fs, "force", record.band), cm.ConstantLaw(0.0, 0.0),
                       engine="modal").acceleration  # fmt: skip


def rows_of(levels: Levels, level: int, fit: JointedStructure, known: Sequence[int], role: str) -> list[dict]:
    """A row for each output and method: what each knew, and what it missed."""
    measured, record = levels.measured[level], levels.records[level]
    got = simulate(fit, record).acceleration
    predicted = {"law": (levels.periods(got), list(known))}
    if role != "fitted":
        predicted |= {name: (frf[:, None] * levels.force[level], of)
                      for name, (frf, of) in levels.by_frfs(level, known).items()}  # fmt: skip
    whole, rows = steady_rms(record.acceleration), []
    for method, (spectra, of) in predicted.items():
        error, size = rms_of(spectra - measured), rms_of(measured)
        decibels = rmse_db(levels.frf(level), levels.frf(level, spectra))
        # what lies outside of the excited lines no FRF predicts
        outside = whole**2 - size**2 if method != "law" else steady_rms(got - record.acceleration) ** 2 - error**2
        full = np.sqrt(np.maximum(error**2 + outside, 0.0))
        rows += [
            {"level": level, "force_rms_N": levels.rms[level], "output": output, "method": method, "role": role,
             "knew": "levels " + ", ".join(map(str, of)), "e_rms": float(error[i]),
             "relative": float(error[i] / size[i]), "frf_rmse_db": float(decibels[i]),
             "e_rms_all_frequencies": float(full[i]), "relative_all_frequencies": float(full[i] / whole[i])}
            for i, output in enumerate(OUTPUTS)
        ]  # fmt: skip
    return rows


def sweep_rows(fit: JointedStructure, level: int, record: Response) -> list[dict]:
    """Return the errors of the law and of the linear model on a sweep, between 2 and 15 Hz."""
    frequency = np.fft.rfftfreq(record.excitation.size, 1 / record.fs)
    band = (frequency >= 2.0) & (frequency <= 15.0)
    size = np.linalg.norm(np.fft.rfft(record.acceleration)[:, band], axis=1)
    rows = []
    for method, got in (("law", simulate(fit, record).acceleration), ("linear", linear_response(fit, record))):
        missed = np.linalg.norm(np.fft.rfft(got - record.acceleration)[:, band], axis=1) / size
        rows += [{"level": level, "output": output, "method": method, "relative": float(value)}
                 for output, value in zip(OUTPUTS, missed)]  # fmt: skip
    return rows


def identified(levels: Levels, known: Sequence[int], joints: str) -> JointedStructure:
    """Fit to the levels that may be known."""
    kinds = [joint.strip() for joint in joints.split(",")]
    if unknown := set(kinds) - {FREE, AT_SENSORS}:
        raise RecordError(f"a joint is {FREE!r} or {AT_SENSORS!r}, not {unknown.pop()!r}")
    places = [None if kind == FREE else RELATIVE for kind in kinds]
    return fit_jointed_structure([levels.records[k] for k in known], SAMPLES / 400, places, drop=DROP, progress=True)


def analyse(folder: Path, identify: list[int], predict: list[int], joints: str = "free,free") -> dict:
    """Return the results of this experiment."""
    folder = folder / "f16" if (folder / "f16").is_dir() else folder
    records = {level: record_of(folder, MULTISINE, level) for level in sorted({*identify, *predict})}
    if missing := [level for level in identify if records[level] is None]:
        raise RecordError(f"{folder}/F16Data_{MULTISINE}_Level{missing[0]}.mat: No such file")
    if len(identify) < 2:
        raise RecordError("--identify needs two levels or more")
    levels = Levels({level: record for level, record in records.items() if record is not None})
    tested = [level for level in predict if level in levels.records and level not in identify]
    fit = identified(levels, identify, joints)
    fits = {level: (fit, identify, "fitted") for level in identify} | {
        level: (fit, identify, "predicted") for level in tested
    }
    rows = [row for level, of in fits.items() for row in rows_of(levels, level, *of)]
    if not tested and len(identify) > 2:
        for level in identify:
            others = [k for k in identify if k != level]
            fits[level] = identified(levels, others, joints), others, "left out"
            rows += rows_of(levels, level, *fits[level])
    sweeps = {level: record_of(folder, SWEEP, level) for level in levels.records}
    swept = [row for level, record in sweeps.items() if record is not None for row in sweep_rows(fit, level, record)]
    return {"levels": levels, "fit": fit, "fits": fits, "rows": rows, "sweeps": sweeps, "swept": swept}


def shown(result: dict) -> list[int]:
    """Levels that were predicted, or fitted where none was."""
    predicted = [level for level, (_, _, role) in result["fits"].items() if role != "fitted"]
    return sorted(predicted or result["fits"])


def draw_frfs(result: dict) -> Figure:
    """FRFs of every output at the levels that were predicted."""
    levels, at = result["levels"], shown(result)
    figure = Figure(figsize=(4 * len(at), 9), layout="constrained")
    axes = figure.subplots(3, len(at), sharex=True, sharey="row", squeeze=False)
    for column, level in zip(axes.T, at):
        fit, known, role = result["fits"][level]
        lines = {"measured": levels.frf(level)}
        lines |= {name: frf for name, (frf, _) in levels.by_frfs(level, known).items() if name != "nearest"}
        lines["law"] = levels.frf(level, levels.periods(simulate(fit, levels.records[level]).acceleration))
        for name, frf in lines.items():
            for ax, row in zip(column, frf):
                ax.semilogy(levels.frequency, np.abs(row), color=COLORS[name], lw=1.4 if name == "measured" else 0.8,
                            label=name)  # fmt: skip
        column[0].set_title(f"level {level} ({levels.rms[level]:.0f} N), {role}", fontsize=9)
        column[-1].set_xlabel("frequency (Hz)")
    for ax, output in zip(axes[:, 0], OUTPUTS):
        ax.set_ylabel(f"{output} (m/s²/N)")
    max(axes[0], key=lambda ax: len(ax.lines)).legend(fontsize=8)
    return figure


def draw_errors(result: dict) -> Figure:
    """Relative errors by level, output and method."""
    table = pd.DataFrame(result["rows"])
    predicted = table[table["role"] != "fitted"]
    table = predicted if len(predicted) else table
    figure = Figure(figsize=(11, 3.6), layout="constrained")
    axes = figure.subplots(1, 3, sharey=True)
    methods = [name for name in COLORS if name in set(table["method"])]
    for ax, output in zip(axes, OUTPUTS):
        part = table[table["output"] == output].pivot(index="level", columns="method", values="relative")
        for i, method in enumerate(methods):
            place = np.arange(len(part)) + 0.8 * (i - (len(methods) - 1) / 2) / len(methods)
            ax.bar(place, part[method], 0.8 / len(methods), color=COLORS[method], label=method)
        ax.set_xticks(range(len(part)), [f"level {level}" for level in part.index])
        ax.set_title(output)
    axes[0].set_ylabel("RMS of the error over RMS")
    axes[0].legend(fontsize=8)
    return figure


def draw_joints(result: dict) -> Figure:
    """Draw the places of the joints, and their force over deformation at the highest level."""
    fit, levels = result["fit"], result["levels"]
    figure = Figure(figsize=(12, 3.8), layout="constrained")
    n = len(fit.rig.bushings)
    axes = figure.subplots(1, 1 + n, squeeze=False)[0]
    structure = fit.rig.structure
    joints = [np.subtract(*structure.assemble((), 0).rows(b.joined)) if b.to else
              structure.assemble((), 0).rows([b.position])[0] for b in fit.rig.bushings]  # fmt: skip
    relative = np.subtract(*structure.assemble((), 0).rows(RELATIVE))
    sign = np.sign(structure.assemble((), 0).rows(["1:+Z"])[0])
    rows = [*((f"joint {j + 1}", psi) for j, psi in enumerate(joints)), ("payload less wing", relative)]
    inside = np.array(structure.frequencies) < 15
    place = np.arange(inside.sum())
    for i, (name, psi) in enumerate(rows):
        value = (sign * psi)[inside]
        axes[0].bar(place + 0.8 * (i - (len(rows) - 1) / 2) / len(rows), value / np.abs(value).max(), 0.8 / len(rows),
                    label=name)  # fmt: skip
    axes[0].set_xticks(place, [f"{f:.1f}" for f in np.array(structure.frequencies)[inside]])
    axes[0].set(xlabel="mode (Hz)", ylabel="deformation per mode, largest 1")
    axes[0].legend(fontsize=8)
    for level in sorted(levels.records, key=lambda k: -levels.rms[k]):
        got = simulate(fit, levels.records[level])
        last = slice(-SAMPLES, None)
        for ax, x, force in zip(axes[1:], got.displacement[:, last], got.grease_force[:, last]):
            ax.plot(1e3 * x, force, lw=0.3, label=f"level {level}")
    for j, ax in enumerate(axes[1:]):
        ax.set(title=f"joint {j + 1}", xlabel="deformation (mm, by convention)", ylabel="force (N)")
        for line in ax.legend(fontsize=8).get_lines():
            line.set_linewidth(1.5)
    return figure


def draw_sweeps(result: dict) -> Figure | None:
    """Accelerations of the wing during the sweeps, which no fit saw."""
    sweeps = {level: record for level, record in result["sweeps"].items() if record is not None}
    if not sweeps:
        return None
    figure = Figure(figsize=(11, 2 * len(sweeps)), layout="constrained")
    for ax, (level, record) in zip(np.atleast_1d(figure.subplots(len(sweeps), 1, sharex=True)), sweeps.items()):
        for name, signal in (("measured", record.acceleration), ("law", simulate(result["fit"], record).acceleration)):
            ax.plot(
                record.time, signal[1], color=COLORS[name], lw=0.3, label=name, alpha=1 if name == "measured" else 0.6
            )
        missed = {row["method"]: row["relative"] for row in result["swept"]
                  if (row["level"], row["output"]) == (level, "wing")}  # fmt: skip
        ax.set_title(
            f"level {level}: error {missed['law']:.2f}, of the linear model {missed['linear']:.2f}", fontsize=9
        )
        ax.set_ylabel("wing (m/s²)")
    ax.set_xlabel("time (s)")
    for line in ax.legend(fontsize=8, loc="upper right").get_lines():
        line.set_linewidth(1.5)
    return figure


def draw_rattle(result: dict) -> Figure:
    """Spectra of the payload up to half the sampling rate: the rattle that the modes of 2 to 15 Hz do not hold."""
    levels = result["levels"]
    at = sorted(levels.records, key=lambda k: levels.rms[k])
    figure = Figure(figsize=(11, 3.6), layout="constrained")
    frequency = np.fft.rfftfreq(SAMPLES, 1 / 400)
    for ax, level in zip(figure.subplots(1, 2, sharey=True), (at[0], at[-1])):
        record = levels.records[level]
        for name, signal in (("measured", record.acceleration), ("law", simulate(result["fit"], record).acceleration)):
            ax.semilogy(
                frequency, np.abs(np.fft.rfft(signal[2, -SAMPLES:])) * 2 / SAMPLES, color=COLORS[name], lw=0.4,
                label=name,
            )  # fmt: skip
        ax.set(title=f"level {level} ({levels.rms[level]:.0f} N)", xlabel="frequency (Hz)", ylim=(1e-7, 2))
    figure.axes[0].set_ylabel("payload (m/s²)")
    for line in figure.axes[0].legend(fontsize=8).get_lines():
        line.set_linewidth(1.5)
    return figure


def write(result: dict, out: Path) -> None:
    """Write tables, rig, law and figures into a folder and print what was found."""
    out.mkdir(parents=True, exist_ok=True)
    (out / "f16.json").write_text(json.dumps(result["rows"], indent=1) + "\n", encoding="utf-8")
    pd.DataFrame(result["rows"]).to_csv(out / "f16.csv", index=False)
    pd.DataFrame(result["swept"]).to_csv(out / "f16_sweeps.csv", index=False)
    fit = result["fit"]
    fit.rig.save(out / "rig.toml")
    fit.law.save(out / "law.json")
    drawn = {
        "frfs": draw_frfs, "errors": draw_errors, "joints": draw_joints, "sweeps": draw_sweeps, "rattle": draw_rattle,
    }  # fmt: skip
    for name, draw in drawn.items():
        if figure := draw(result):
            figure.savefig(out / f"f16_{name}.png", dpi=110)
    for (role, level, method), part in pd.DataFrame(result["rows"]).groupby(["role", "level", "method"]):
        errors = " ".join(f"{value:.3f}" for value in part["relative"])
        print(f"level {level}, {role}, {method} ({part['knew'].iloc[0]}): {errors} at {', '.join(OUTPUTS)}")
    for (level, method), part in pd.DataFrame(result["swept"]).groupby(["level", "method"]):
        print(f"sweep of level {level}, {method}: {' '.join(f'{value:.3f}' for value in part['relative'])}")
    frequencies = ", ".join(f"{f:.2f}" for f in fit.rig.structure.frequencies)
    print(f"modes with the joints slipped: {frequencies} Hz; {fit.simulations} simulations")


def main(arguments=None) -> int:
    return run(
        analyse, write, __doc__, "the ground vibration test of an F-16", arguments,
        identify={"type": numbers, "default": "1,3,5,7", "help": "levels that may be known"},
        predict={"type": numbers, "default": "2,4,6", "help": "levels to predict, where their records are there"},
        joints={"default": "free,free", "help": f"for each joint {FREE} or {AT_SENSORS}: where it acts"},
    )  # fmt: skip


if __name__ == "__main__":
    raise SystemExit(main())
