"""Brake-Reuss beam: forced responses predicted from a ring-down and one forced curve, by a joint that slips.

Frequency and damping of the first mode over its amplitude come from the ring-down by wavelet ridges of two
accelerometers, a third one at the mode's node confirms them. A mode with Iwan's joint is fitted to them and to the
stepped sine at 0.2 N; every other curve of forced.csv is then predicted: amplitudes under the measured force where the
force was controlled, the force that holds the measured amplitude where the response was.

    python -m experiments.real.brb FOLDER --out results/real_brb
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from clearance_mj.core.errors import RecordError
from clearance_mj.identify import decay, ridge
from clearance_mj.signals.free_decay import Decay
from experiments.joints.jointed_mode import ForcedCurve, ForcedTest, JointedMode, JointedModeFit, fit_jointed_mode

from .records import HammerRecord, SteppedSine, read_hammer, read_stepped_sines
from .script import run

BAND = (70.0, 92.0)  # Hz, around mode 1; the next one is at 298 Hz
SENSORS = {1: (10.0, 0.1), 3: (10.0, 0.1), 2: (60.0, 0.3)}
"""ω0 of the wavelet, rad, and window, s: the more of it, the later it sees; accelerometer 2 is at the mode's node"""
FITTED = (1, 3)  # accelerometers; the forced test's amplitudes are taken for those of the first
FORCE = 0.2  # N, of the force-controlled curve that is fitted
DRAWS, CONFIDENCE = 200, (2.5, 97.5)
COLORS = {1: "#0072b2", 3: "#e69f00", 2: "#000000"}
LAW = "#d55e00"


def decays_of(record: HammerRecord) -> dict[int, Decay]:
    """Amplitude (m/s²), frequency and damping over time by accelerometer."""
    decays = {}
    for sensor, (omega0, window) in SENSORS.items():
        line = ridge(record.acceleration[sensor - 1], record.fs, BAND if omega0 < 20 else (76.0, 85.0), omega0)
        decays[sensor] = decay(line, window, record.fs)
    return decays


def ratio(decays: dict[int, Decay], sensor: int) -> float:
    """Return the ratio of the mode at the first accelerometer to that at another, from both decays."""
    first, other = decays[FITTED[0]], decays[sensor]
    return float(
        np.exp(np.median(np.interp(other.time, first.time, np.log(first.amplitude)) - np.log(other.amplitude)))
    )


def in_metres(free_decay: Decay, factor: float) -> Decay:
    """Displacements at the first accelerometer."""
    return replace(free_decay, amplitude=factor * free_decay.amplitude / (2 * np.pi * free_decay.frequency) ** 2)


def as_curve(sine: SteppedSine) -> ForcedCurve:
    return ForcedCurve(sine.frequency, sine.force, sine.amplitude * np.exp(1j * sine.phase))


def held(sine: SteppedSine) -> bool:
    """True if the controller held the response constant."""
    return sine.control.startswith("Response")


def fitted_sine(sines: list[SteppedSine]) -> SteppedSine:
    """The force-controlled curve nearest 0.2 N."""
    forced = [sine for sine in sines if not held(sine)]
    if not forced:
        raise RecordError(f"no force-controlled curve near {FORCE:g} N to fit to")
    return min(forced, key=lambda sine: abs(sine.force.mean() - FORCE))


def predicted(sine: SteppedSine, mode: JointedMode, test: ForcedTest) -> np.ndarray:
    """(n,) amplitude under the measured force, m/s²; or the force, N, that holds the measured amplitude."""
    if held(sine):
        return test.force(mode, sine.frequency, sine.amplitude)
    return np.abs(test.response(mode, sine.frequency, sine.force))


def peak(sine: SteppedSine, line: np.ndarray, mode: JointedMode, test: ForcedTest) -> tuple[float, float, float]:
    """Amplitude, m/s², frequency, Hz, and force, N, at the resonance of what was predicted; nan where nothing was.

    It is the line with the largest amplitude; where the response is held, that with the least force, and the amplitude
    is what the least measured force reaches there.
    """
    if np.isnan(line).all():
        return np.nan, np.nan, np.nan
    at = int(np.nanargmin(line) if held(sine) else np.nanargmax(line))
    if not held(sine):
        return float(line[at]), float(sine.frequency[at]), float(sine.force[at])
    answer = test.response(mode, sine.frequency[at : at + 1], np.array([sine.force.min()]))
    return float(np.abs(answer[0])), float(sine.frequency[at]), float(line[at])


def measured_peak(sine: SteppedSine) -> tuple[float, float, float]:
    """The same of the measurement."""
    at = int(sine.force.argmin() if held(sine) else sine.amplitude.argmax())
    return float(sine.amplitude[at]), float(sine.frequency[at]), float(sine.force[at])


def scaled(sine: SteppedSine, known: SteppedSine) -> np.ndarray:
    """(n,) what a linear beam would show, whose acceleration over force is that of the fitted curve; nan beyond it."""
    over_force = np.interp(sine.frequency, known.frequency, known.amplitude / known.force, left=np.nan, right=np.nan)
    return sine.amplitude / over_force if held(sine) else sine.force * over_force


def rows_of(
    sine: SteppedSine, fit: JointedModeFit, draws, known: SteppedSine, reached: float
) -> tuple[list[dict], pd.DataFrame]:
    """Two rows of peaks, measured and predicted, and a table of all lines."""
    best = predicted(sine, fit.mode, fit.test)
    lines = np.array([predicted(sine, *drawn) for drawn in draws])
    peaks = np.array([peak(sine, line, *drawn) for line, drawn in zip(lines, draws)])
    low, high = np.nanpercentile(lines, CONFIDENCE, axis=0)
    ends = np.nanpercentile(peaks, CONFIDENCE, axis=0)
    names = ("peak_amplitude", "peak_frequency", "peak_force")
    about = {"control": sine.control, "index": sine.index, "fitted": sine is known}
    model = dict(zip(names, peak(sine, best, fit.mode, fit.test)))
    bands = {f"{n}_{end}": float(v) for end, values in zip(("low", "high"), ends) for n, v in zip(names, values)}
    beyond = {"beyond_decay": bool(model["peak_amplitude"] > reached)}
    rows = [about | {"source": "measured"} | dict(zip(names, measured_peak(sine))),
            about | {"source": "predicted"} | model | bands | beyond]  # fmt: skip
    table = pd.DataFrame(
        {"control": sine.control, "index": sine.index, "frequency_Hz": sine.frequency, "force_N": sine.force,
         "amplitude_m_s2": sine.amplitude, "predicts": "force_N" if held(sine) else "amplitude_m_s2",
         "predicted": best, "low": low, "high": high, "linear": scaled(sine, known)}
    )  # fmt: skip
    return rows, table


def along_decay(decays: dict[int, Decay], fit: JointedModeFit) -> pd.DataFrame:
    """Measured and modelled frequency and damping, accelerometer by accelerometer."""
    parts = []
    for sensor, free_decay in decays.items():
        frequency, damping = fit.mode.backbone(in_metres(free_decay, ratio(decays, sensor)).amplitude)
        parts.append(pd.DataFrame(
            {"accelerometer": sensor, "time_s": free_decay.time, "amplitude_m_s2": free_decay.amplitude,
             "at_first_m_s2": free_decay.amplitude * ratio(decays, sensor), "frequency_Hz": free_decay.frequency,
             "damping": free_decay.damping, "law_frequency_Hz": frequency, "law_damping": damping}
        ))  # fmt: skip
    return pd.concat(parts, ignore_index=True)


def agreement(decays: dict[int, Decay], sensor: int) -> tuple[float, float]:
    """Largest difference to the first accelerometer at the same time: frequency, Hz, and damping ratio."""
    first, other = decays[FITTED[0]], decays[sensor]
    both = (other.time >= first.time[0]) & (other.time <= first.time[-1])
    return tuple(
        float(np.abs(np.interp(other.time[both], first.time, getattr(first, name)) - getattr(other, name)[both]).max())
        for name in ("frequency", "damping")
    )


def analyse(folder: Path) -> dict:
    """Return the results of this experiment."""
    folder = folder / "brb" if (folder / "brb").is_dir() else folder
    decays = decays_of(read_hammer(folder / "HammerImpact.mat"))
    sines = read_stepped_sines(folder / "forced.csv")
    known = fitted_sine(sines)
    shaken = [in_metres(decays[sensor], ratio(decays, sensor)) for sensor in FITTED]
    fit = fit_jointed_mode(shaken, as_curve(known), float(max(d.amplitude.max() for d in shaken)))
    draws = fit.draw(DRAWS)
    reached = max(float(decays[sensor].amplitude.max() * ratio(decays, sensor)) for sensor in FITTED)
    parts = [rows_of(sine, fit, draws, known, reached) for sine in sines]
    return {
        "decays": decays, "sines": sines, "known": known, "fit": fit, "draws": draws, "reached": reached,
        "rows": [row for rows, _ in parts for row in rows], "along": along_decay(decays, fit),
        "lines": pd.concat([table for _, table in parts], ignore_index=True),
    }  # fmt: skip


def misses(result: dict) -> dict[int, tuple[float, float]]:
    """Largest error of the law along each fitted decay: frequency, Hz, and damping ratio."""
    table, worst = result["along"], {}
    for sensor in FITTED:
        part = table[table["accelerometer"] == sensor]
        frequency, damping = part["law_frequency_Hz"] - part["frequency_Hz"], part["law_damping"] - part["damping"]
        worst[sensor] = float(frequency.abs().max()), float(damping.abs().max())
    return worst


def draw_decay(result: dict) -> Figure:
    """Frequency and damping over the amplitude of the ring-down, and the law with its band."""
    figure = Figure(figsize=(10, 4.2), layout="constrained")
    axes, fit = figure.subplots(1, 2), result["fit"]
    grid = np.geomspace(0.4, result["reached"], 60)
    metres = grid / (2 * np.pi * fit.mode.frequency) ** 2
    every = np.array([fit.mode.backbone(metres), *(mode.backbone(metres) for mode, _ in result["draws"])])
    for ax, values, column, factor in zip(axes, np.moveaxis(every, 1, 0), ("frequency_Hz", "damping"), (1, 100)):
        for sensor, part in result["along"].groupby("accelerometer"):
            scaled = f" x {ratio(result['decays'], sensor):.3g}" if sensor != FITTED[0] else ""
            ax.semilogx(part["at_first_m_s2"], factor * part[column], "." if sensor in FITTED else "x", ms=4,
                        color=COLORS[sensor], zorder=2 if sensor in FITTED else 3,
                        label=f"accelerometer {sensor}{scaled}")  # fmt: skip
        ax.fill_between(grid, *(factor * np.percentile(values[1:], CONFIDENCE, axis=0)), color=LAW, alpha=0.2, lw=0)
        ax.plot(grid, factor * values[0], color=LAW, lw=1, label="law, 95 %")
        ax.set_xlabel("amplitude at accelerometer 1 (m/s²)")
    axes[0].set(ylabel="frequency (Hz)", ylim=(80.2, 80.7))
    axes[1].set(ylabel="damping ratio (%)", ylim=(0.1, 0.3))
    axes[0].legend(fontsize=8)
    return figure


def draw_forced(result: dict) -> Figure:
    """Every stepped sine, measured and predicted."""
    sines, columns = result["sines"], 3
    rows = -(-len(sines) // columns)
    figure = Figure(figsize=(12, 3.8 * rows), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for ax in axes[len(sines) :]:
        ax.set_axis_off()
    for ax, sine in zip(axes, sines):
        at = (result["lines"]["control"] == sine.control) & (result["lines"]["index"] == sine.index)
        part = result["lines"][at]
        ax.plot(sine.frequency, sine.force if held(sine) else sine.amplitude, "k.-", ms=4, lw=0.5, label="measured")
        ax.fill_between(sine.frequency, part["low"], part["high"], color=LAW, alpha=0.2, lw=0, label="95 %")
        name = "fitted" if sine is result["known"] else "predicted"
        ax.plot(sine.frequency, part["predicted"], color=LAW, lw=1, label=name)
        what = f"{np.median(sine.amplitude):.3g} m/s² held" if held(sine) else f"{sine.force.mean():.2g} N"
        ax.set_ylim(top=1.1 * max(part["high"].max(), ax.dataLim.y1))
        ax.plot(sine.frequency, part["linear"], ":", color="#8c8c8c", lw=1, label="linear beam")
        ax.set(title=f"{what}, {name}", xlabel="frequency (Hz)",
               ylabel="force (N)" if held(sine) else "acceleration (m/s²)")  # fmt: skip
        ax.legend(fontsize=8)
    return figure


def draw_seen(result: dict) -> Figure:
    """Frequency and damping that every measured point of the forced curves stands for, whatever the law."""
    figure = Figure(figsize=(10, 4.2), layout="constrained")
    axes, fit = figure.subplots(1, 2), result["fit"]
    styles = ("s", "o", "^", "v", "D", "P", "X")
    for i, sine in enumerate(result["sines"]):
        points = fit.test.seen(as_curve(sine))
        scale = (2 * np.pi * sine.frequency) ** 2
        for ax, value in zip(axes, (points.frequency + fit.test.shift, 100 * points.damping)):
            ax.plot(points.amplitude * scale, value, f"{styles[i % len(styles)]}-", ms=3, lw=0.5,
                    label=f"{sine.control} {sine.index}")  # fmt: skip
    grid = np.linspace(2, max(sine.amplitude.max() for sine in result["sines"]), 80)
    frequency, damping = fit.test.mode(fit.mode).backbone(grid / (2 * np.pi * fit.mode.frequency) ** 2)
    inside = grid <= result["reached"]
    for ax, value in zip(axes, (frequency, 100 * damping)):
        ax.plot(grid[inside], value[inside], color=LAW, label="law")
        ax.plot(grid[~inside], value[~inside], "--", color=LAW, label="law, beyond the ring-down")
        ax.set(xlabel="amplitude of the mode (m/s²)")
    axes[0].set(ylabel="frequency (Hz)", ylim=(79.9, 80.6))
    axes[1].set(ylabel="damping ratio (%)", ylim=(0.1, 0.5))
    axes[0].legend(fontsize=8)
    return figure


def write(result: dict, out: Path) -> None:
    """Write tables and figures into a folder and print what was found."""
    out.mkdir(parents=True, exist_ok=True)
    (out / "brb.json").write_text(json.dumps(result["rows"], indent=1) + "\n", encoding="utf-8")
    estimates = result["fit"].estimates
    pd.DataFrame(estimates.beside_priors()).to_csv(out / "brb_parameters.csv", index=False)
    result["along"].to_csv(out / "brb_decay.csv", index=False)
    result["lines"].to_csv(out / "brb_forced.csv", index=False)
    for name, draw in (("decay", draw_decay), ("forced", draw_forced), ("seen", draw_seen)):
        draw(result).savefig(out / f"brb_{name}.png", dpi=110)
    for sensor in SENSORS:
        if sensor != FITTED[0]:
            frequency, damping = agreement(result["decays"], sensor)
            print(f"accelerometer {sensor} against {FITTED[0]}: {frequency:.3f} Hz, {100 * damping:.3f} % at most")
    for sensor, (frequency, damping) in misses(result).items():
        print(f"law along the ring-down, accelerometer {sensor}: {frequency:.3f} Hz, {100 * damping:.3f} % at most")
    print("; ".join(f"{n} {v:.4g} ± {s:.1g}" for n, v, s in zip(estimates.names, estimates.value, estimates.std)))
    for measured, model in zip(result["rows"][::2], result["rows"][1::2]):
        kind = "fitted" if model["fitted"] else "predicted"
        beyond = f", beyond the ring-down's {result['reached']:.0f} m/s²" if model["beyond_decay"] else ""
        print(
            f"{model['control']} {model['index']}, {kind}: amplitude {model['peak_amplitude']:.2f} "
            f"({model['peak_amplitude_low']:.1f} to {model['peak_amplitude_high']:.1f}) m/s², measured "
            f"{measured['peak_amplitude']:.2f}; {model['peak_frequency']:.2f} ({model['peak_frequency_low']:.2f} to "
            f"{model['peak_frequency_high']:.2f}) Hz, measured {measured['peak_frequency']:.2f}; force "
            f"{model['peak_force']:.3f} N, measured {measured['peak_force']:.3f}{beyond}"
        )


def main(arguments=None) -> int:
    return run(analyse, write, __doc__, "the ring-down of the Brake-Reuss beam", arguments)


if __name__ == "__main__":
    raise SystemExit(main())
