"""DROPBEAR: frequencies of a cantilever whose roller support moves, predicted from the position sensor alone.

A cantilever with one elastic support has four parameters here: its bending scale, the support's stiffness, and offset
and slope of the position sensor. They are fitted to the first two frequencies on the plateaus of steps10_test0; those
of steps10_test1 and of the random dwells are then predicted, and compared with the frequencies tracked by wavelet
ridges while the roller moves.

    python -m experiments.real.dropbear --out results/real_dropbear
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import scipy.optimize
import scipy.signal
from matplotlib.figure import Figure

from clearance_mj.signals.wavelet import Ridge, ridge
from clearance_mj.structure.beam import cantilever_mode, cantilever_roots

from .records import DropbearRecord, read_dropbear
from .script import run

FIT, PREDICT = "steps10_test0", ("steps10_test1", "random_dwell_set0_test0")
BANDS = ((20.0, 60.0), (120.0, 320.0))  # Hz, of the two frequencies
OMEGA0 = (5.0, 12.0)  # wavelet centre for each: the second mode dies out fast and needs a narrower band against noise
STILL = 0.2  # V/s, slower than which the roller counts as still
MOVING = 0.5  # V/s, faster than which it moves
SHORTEST = 0.2  # s, shortest plateau
SETTLE = 0.03  # s left out at each end of a plateau
MODES = 30
LINES = 1 << 19
CLEAR = 15.0  # peak over median of the spectrum within the band, below which a plateau shows no frequency


@dataclass(frozen=True)
class Plateau:
    """A stretch of a record in which the roller is still."""

    start: int
    stop: int
    position: float  #: V, median of the sensor
    frequency: np.ndarray  #: (2,) Hz, peaks of the spectrum; nan where there is none


@dataclass(frozen=True)
class Cantilever:
    """Uniform cantilever with one elastic support at a = offset + slope V, all in units of the length."""

    scale: float  #: Hz, √(EI/ρA)/(2π l²)
    support: float  #: k l³/EI
    offset: float
    slope: float  #: 1/V

    def frequencies(self, position) -> np.ndarray:
        """(n, 2) Hz at roller positions (n,) in V: eigenvalues of diag(λ⁴) + κ Y(a) Y(a)ᵀ, Y with ∫Y² = 1."""
        a = np.clip(self.offset + self.slope * np.asarray(position, dtype=float), 1e-3, 1.0)
        y = cantilever_mode(a, MODES)
        k = np.diag(cantilever_roots(MODES) ** 4) + self.support * y[:, :, None] * y[:, None, :]
        return self.scale * np.sqrt(np.maximum(np.linalg.eigvalsh(k)[:, :2], 0))


def smooth_position(record: DropbearRecord) -> np.ndarray:
    """Roller position with the sensor's noise averaged over 50 ms, centred: without delay."""
    width = round(0.05 * record.fs) | 1
    padded = np.pad(record.position, width // 2 + 25, mode="edge")
    return np.convolve(scipy.signal.medfilt(padded, 51)[25:-25], np.full(width, 1 / width), "valid")


def plateaus(record: DropbearRecord) -> list[Plateau]:
    """Stretches in which the roller is still, after its first motion: the beam is at rest before it."""
    still = np.abs(np.gradient(smooth_position(record), record.time)) < STILL
    # short excursions of the sensor while it rests are no motion
    half = round(0.06 * record.fs)
    still = scipy.signal.medfilt(np.pad(still.astype(float), half, mode="edge"), 2 * half + 1)[half:-half] > 0.5
    edges = np.flatnonzero(np.diff(np.concatenate(([0], still, [0])))).reshape(-1, 2)
    settle = round(SETTLE * record.fs)
    segments = []
    for start, stop in edges[edges[:, 0] > 0] + [settle, -settle]:
        if stop - start >= SHORTEST * record.fs:
            at = float(np.median(record.position[start:stop]))
            frequency = [spectrum_peak(record.acceleration[start:stop], record.fs, band) for band in BANDS]
            segments.append(Plateau(int(start), int(stop), at, np.array(frequency)))
    return segments


def spectrum_peak(signal, fs, band) -> float:
    """Frequency of the largest line of a Hann-windowed, zero-padded spectrum within a band, Hz; nan if unclear."""
    size = max(LINES, signal.size)
    spectrum = np.abs(np.fft.rfft((signal - signal.mean()) * scipy.signal.get_window("hann", signal.size), size))
    frequency = np.arange(spectrum.size) * fs / size
    inside = np.flatnonzero((frequency > band[0]) & (frequency < band[1]))
    peak = inside[np.argmax(spectrum[inside])]
    edge = peak in (inside[0], inside[-1])
    return np.nan if edge or spectrum[peak] < CLEAR * np.median(spectrum[inside]) else float(frequency[peak])


def fit(steps: list[Plateau]) -> Cantilever:
    """Least squares on the relative errors of both frequencies, from several starts."""
    position = np.array([p.position for p in steps])
    measured = np.array([p.frequency for p in steps])
    seen = np.isfinite(measured)

    def residual(theta):
        model = Cantilever(np.exp(theta[0]), np.exp(theta[1]), theta[2], theta[3])
        return (model.frequencies(position) / measured - 1)[seen]

    starts = [(np.log(6.0), np.log(k), a, b) for k in (1e2, 1e3, 1e4) for a, b in ((0.0, 0.1), (-0.05, 0.12))]
    solutions = [
        scipy.optimize.least_squares(residual, s, loss="soft_l1", f_scale=0.005, x_scale="jac") for s in starts
    ]
    best = min(solutions, key=lambda s: s.cost).x
    return Cantilever(float(np.exp(best[0])), float(np.exp(best[1])), float(best[2]), float(best[3]))


def track(record: DropbearRecord) -> list[Ridge]:
    """Follow both frequencies through the whole record."""
    return [ridge(record.acceleration, record.fs, band, omega0) for band, omega0 in zip(BANDS, OMEGA0)]


def on_plateau(line: Ridge, plateau: Plateau) -> float:
    """Median frequency of a ridge over a plateau, Hz, weighted as in its spectrum: by amplitude and window."""
    inside = slice(plateau.start, plateau.stop)
    window = scipy.signal.get_window("hann", plateau.stop - plateau.start)
    weight = np.where(line.valid[inside], line.amplitude[inside] * window, 0.0)
    if not weight.any():
        return np.nan
    omega = line.omega[inside]
    order = np.argsort(omega)
    return float(omega[order][np.searchsorted(np.cumsum(weight[order]), weight.sum() / 2)] / (2 * np.pi))


def bandwidth(omega0: float, frequency: float) -> float:
    """Modulation frequency of which a tracked frequency keeps 71 %, Hz: exp(-(ω_m σ_t)²/2) with σ_t = ω0/ω."""
    return float(np.sqrt(np.log(2)) * frequency / omega0)


def look_ahead(omega0: float, frequency: float) -> float:
    """Return the delay after which a frequency is known, s: 4 σ_t, the half of the wavelet that lies in the future."""
    return 4 * omega0 / (2 * np.pi * frequency)


def lag_behind(tracked, predicted, use, fs) -> float:
    """Lag of a tracked frequency behind a predicted one, s, where their median difference is least, within ±60 ms."""
    lags = np.arange(-round(0.06 * fs), round(0.06 * fs) + 1, 5)
    cost = [np.median(np.abs(tracked[use] / np.roll(predicted, lag)[use] - 1)) for lag in lags]
    return float(lags[int(np.argmin(cost))] / fs)


def analyse(folder: Path) -> dict:
    """Return the results of this experiment: rows for the table, ridges and predictions for the figure."""
    records = {name: read_dropbear(folder / "dropbear" / f"{name}.txt.gz") for name in (FIT, *PREDICT)}
    steps = {name: plateaus(record) for name, record in records.items()}
    model = fit(steps[FIT])
    ridges = {name: track(record) for name, record in records.items()}
    curves = {name: model.frequencies(smooth_position(record)[::10]) for name, record in records.items()}
    rows = []
    for name, record in records.items():
        for p in steps[name]:
            predicted = model.frequencies([p.position])[0]
            for mode in (0, 1):
                rows.append(
                    {"record": name, "from_s": p.start / record.fs, "to_s": p.stop / record.fs,
                     "position_V": p.position, "mode": mode + 1, "spectrum_Hz": p.frequency[mode],
                     "predicted_Hz": predicted[mode], "ridge_Hz": on_plateau(ridges[name][mode], p)}
                )  # fmt: skip
    return {"records": records, "model": model, "ridges": ridges, "curves": curves, "rows": rows}


def median_error(rows, record, mode, column, against="spectrum_Hz") -> float:
    """Median |relative error| of one column of the table."""
    errors = [abs(r[column] / r[against] - 1) for r in rows if r["record"] == record and r["mode"] == mode]
    return float(np.nanmedian(errors))


def moving(results, name, mode) -> dict:
    """Tracked against predicted frequency while the roller moves: median error and lag, and how much the mask keeps.

    Every move knocks the beam, so the ridge's mask keeps little of it; the errors are therefore given of all samples
    ("error") and of those within the mask ("valid_error").
    """
    record, line = results["records"][name], results["ridges"][name][mode]
    predicted = np.interp(record.time, record.time[::10], results["curves"][name][:, mode])
    moves = np.abs(np.gradient(smooth_position(record), record.time)) > MOVING
    tracked = line.omega / (2 * np.pi)
    error = np.abs(tracked / predicted - 1)
    both = moves & line.valid
    return {
        "error": float(np.median(error[moves])), "valid_error": float(np.median(error[both])) if both.any() else np.nan,
        "valid_share": float(both.sum() / moves.sum()), "lag_s": lag_behind(tracked, predicted, moves, record.fs),
    }  # fmt: skip


def draw(results) -> Figure:
    figure = Figure(figsize=(10, 9), layout="constrained")
    axes = figure.subplots(len(results["records"]), 2, squeeze=False)
    for row, (name, record) in zip(axes, results["records"].items()):
        for mode, ax in enumerate(row):
            line = results["ridges"][name][mode]
            frequency = np.where(line.valid, line.omega / (2 * np.pi), np.nan)
            ax.plot(record.time, line.omega / (2 * np.pi), color="#8c8c8c", lw=0.5, label="outside its mask")
            ax.plot(record.time, frequency, color="#0072b2", lw=0.8, label="wavelet ridge")
            ax.plot(record.time[::10], results["curves"][name][:, mode], color="#d55e00", lw=0.8,
                    label="predicted from position", zorder=3)  # fmt: skip
            spectra = [r for r in results["rows"] if r["record"] == name and r["mode"] == mode + 1]
            ax.plot([(r["from_s"] + r["to_s"]) / 2 for r in spectra], [r["spectrum_Hz"] for r in spectra], "k.",
                    label="plateau spectrum")  # fmt: skip
            ax.set(title=f"{name}, mode {mode + 1}", xlabel="time (s)", ylabel="frequency (Hz)")
            ax.set_ylim(results["curves"][name][:, mode].min() * 0.9, results["curves"][name][:, mode].max() * 1.1)
    axes[0, 0].legend(fontsize=7, loc="lower center")
    return figure


def write(results: dict, out: Path) -> None:
    """Write the table and the figure into a folder and print what was found."""
    out.mkdir(parents=True, exist_ok=True)
    pd.DataFrame(results["rows"]).to_csv(out / "dropbear.csv", index=False)
    draw(results).savefig(out / "dropbear.png", dpi=120)
    print(results["model"])
    for name in results["records"]:
        for mode in (0, 1):
            rows, motion = results["rows"], moving(results, name, mode)
            middle = np.median(results["curves"][name][:, mode])
            print(
                f"{name} mode {mode + 1}: predicted {100 * median_error(rows, name, mode + 1, 'predicted_Hz'):.2f} %, "
                f"ridge on plateaus {100 * median_error(rows, name, mode + 1, 'ridge_Hz'):.2f} %, while moving "
                f"{100 * motion['error']:.1f} % (within the mask {100 * motion['valid_error']:.2f} %, "
                f"{100 * motion['valid_share']:.0f} % of the samples), lag {1e3 * motion['lag_s']:+.0f} ms; "
                f"bandwidth {bandwidth(OMEGA0[mode], middle):.1f} Hz, "
                f"known {1e3 * look_ahead(OMEGA0[mode], middle):.0f} ms later"
            )


def main(arguments=None) -> int:
    return run(analyse, write, __doc__, "the DROPBEAR data set", arguments)


if __name__ == "__main__":
    raise SystemExit(main())
