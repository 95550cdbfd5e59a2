"""Shaker cantilever: bending frequencies read from an impact spectrum, against a cantilever with a mass at its end.

Size and material are stated by the authors (759 x 50.66 x 5.14 mm, steel), the mass of the accelerometer near the end
is not: it is taken from the first frequency, and the second and third are then predicted. It comes out at 80 to 110 g,
more than an accelerometer: what the clamp gives way is in it too.

    python -m experiments.real.cantilever --out results/real_cantilever
"""

from pathlib import Path

import numpy as np
import pandas as pd
import scipy.optimize
import scipy.signal
from matplotlib.figure import Figure

from clearance_mj.io.lvm import read_lvm
from clearance_mj.structure.beam import cantilever_mode, cantilever_roots

from .script import run

LENGTH, WIDTH, HEIGHT = 0.759, 0.05066, 0.00514  # m
YOUNG, DENSITY = 205e9, 7850.0  # Pa and kg/m³ of steel; 195 to 210 GPa are common
READ_BY_AUTHORS = (6.62, 41.4, 117.5)  # Hz
BANDS = ((4.0, 12.0), (30.0, 60.0), (100.0, 130.0))  # Hz, in which each frequency is looked for
MODES = 30


def cantilever_frequencies(mass: float, young: float = YOUNG) -> np.ndarray:
    """First three frequencies with a point mass at the end, Hz: λ⁴ q = ω² (1 + μ Y(l) Y(l)ᵀ) q, Y with ∫Y² = 1."""
    scale = np.sqrt(young * HEIGHT**2 / (12 * DENSITY)) / (2 * np.pi * LENGTH**2)
    at_end = cantilever_mode([1.0], MODES)[0]
    flexibility = cantilever_roots(MODES) ** -2.0  # symmetric form: the lowest frequencies keep their digits
    inertia = np.eye(MODES) + mass / beam_mass() * np.outer(at_end, at_end)
    return scale / np.sqrt(np.linalg.eigvalsh(flexibility[:, None] * inertia * flexibility)[::-1][:3])


def beam_mass() -> float:
    """Mass of the beam, kg."""
    return DENSITY * LENGTH * WIDTH * HEIGHT


def mass_of_first(frequency: float, young: float = YOUNG) -> float:
    """Mass at the end that gives the first frequency, kg."""
    return float(scipy.optimize.brentq(lambda m: cantilever_frequencies(m, young)[0] - frequency, 0.0, 1.0))


def peak(frequency, level, band) -> float:
    """Frequency of the highest line in a band, Hz, by a parabola through the levels in dB of it and its neighbours."""
    inside = np.flatnonzero((frequency >= band[0]) & (frequency <= band[1]))
    top = inside[np.argmax(level[inside])]
    before, at, after = level[top - 1 : top + 2]
    shift = 0.5 * (before - after) / (before - 2 * at + after)
    return float(frequency[top] + shift * (frequency[1] - frequency[0]))


def analyse(folder: Path) -> dict:
    """Frequencies read, and those of the cantilever for three moduli of steel."""
    [segment] = read_lvm(folder / "shaker_cantilever" / "impact_fft.lvm.gz")
    frequency, level = segment.x, segment.value[0]
    read = np.array([peak(frequency, level, band) for band in BANDS])
    models = {}
    for young in (200e9, YOUNG, 210e9):
        mass = mass_of_first(read[0], young)
        models[young] = (mass, cantilever_frequencies(mass, young))
    return {"frequency": frequency, "level": level, "read": read, "bare": cantilever_frequencies(0.0), "models": models}


def table(result) -> list[dict]:
    """One row per frequency."""
    mass, model = result["models"][YOUNG]
    return [
        {"mode": i + 1, "read_Hz": read, "authors_Hz": authors, "read_error": read / authors - 1, "bare_Hz": bare,
         "with_mass_Hz": with_mass, "with_mass_error": with_mass / read - 1, "mass_kg": mass}
        for i, (read, authors, bare, with_mass)
        in enumerate(zip(result["read"], READ_BY_AUTHORS, result["bare"], model))
    ]  # fmt: skip


def draw(result) -> Figure:
    figure = Figure(figsize=(9, 4), layout="constrained")
    ax = figure.subplots()
    shown = result["frequency"] <= 200
    ax.plot(result["frequency"][shown], result["level"][shown], "k", lw=0.6, label="impact spectrum")
    for i, (read, model) in enumerate(zip(result["read"], result["models"][YOUNG][1])):
        ax.axvline(model, color="#d55e00", lw=0.8, label="cantilever with mass" if i == 0 else None)
        ax.annotate(f"{read:.2f} Hz", (read, -55), ha="center", fontsize=8)
    ax.set(xlabel="frequency (Hz)", ylabel="acceleration (dB re 1 g)")
    ax.legend(loc="lower right")
    return figure


def write(result: dict, out: Path) -> None:
    """Write the table and the figure into a folder and print what was found."""
    rows = table(result)
    out.mkdir(parents=True, exist_ok=True)
    pd.DataFrame(rows).to_csv(out / "cantilever.csv", index=False)
    draw(result).savefig(out / "cantilever.png", dpi=120)
    for row in rows:
        print(
            f"mode {row['mode']}: read {row['read_Hz']:.2f} Hz (authors {row['authors_Hz']:g}, "
            f"{100 * row['read_error']:+.2f} %), bare cantilever {row['bare_Hz']:.2f}, "
            f"with mass {row['with_mass_Hz']:.2f} Hz ({100 * row['with_mass_error']:+.2f} %)"
        )
    for young, (mass, model) in result["models"].items():
        errors = 100 * (model[1:] / result["read"][1:] - 1)
        print(f"E = {young / 1e9:g} GPa: {1e3 * mass:.0f} g, modes 2 and 3 {errors[0]:+.2f}, {errors[1]:+.2f} %")


def main(arguments=None) -> int:
    return run(analyse, write, __doc__, "the impact spectrum", arguments)


if __name__ == "__main__":
    raise SystemExit(main())
