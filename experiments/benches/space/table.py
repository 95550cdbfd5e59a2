"""Table of an oil film's forces over eccentricity and direction of motion, once computed for each width."""

import functools
import os
from pathlib import Path

import numpy as np
import scipy.interpolate

from ..film import force, grid

FOLDER = Path(__file__).parents[3] / "results" / "benches" / "films"
LARGEST = 0.97  # eccentricity; the film is held as it is there beyond it
ECCENTRICITIES, ANGLES = 19, 17  # at which Reynolds' equation is solved
FINE = (401, 721)  # of the table that is interpolated linearly
STEEP = 2  # the table holds forces times (1-ε²) to this power, which vary little


@functools.cache
def film_table(width: float) -> np.ndarray:
    """Return (2, n_ε, n_ψ) forces outwards and along, see `film.force`, times (1-ε²)^STEEP, for L/D = ``width``.

    ε goes from 0 to LARGEST and ψ from -π to π in equal steps. They are kept in a file for the next time.
    """
    path = FOLDER / f"width_{width:.4f}_{ECCENTRICITIES}_{ANGLES}.npy"
    if path.exists():
        coarse = np.load(path)
    else:
        coarse = _coarse(width)
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_name(f"{path.stem}.{os.getpid()}.npy")
        np.save(temporary, coarse)
        temporary.replace(path)
    psi = np.linspace(-np.pi, np.pi, FINE[1])
    table = np.empty((2, *FINE))
    # Seen from the other side of its line of centres a film turns the other way: ψ becomes π - ψ.
    for values, part, sign in zip(coarse, table, (1.0, -1.0)):
        around = np.concatenate((values, sign * values[:, -2::-1]), axis=1)
        around[:, -1] = around[:, 0] = (around[:, 0] + around[:, -1]) / 2
        angles = np.linspace(-np.pi / 2, 3 * np.pi / 2, around.shape[1])
        on_angles = scipy.interpolate.CubicSpline(angles, around, axis=1, bc_type="periodic")
        between = on_angles(np.where(psi < -np.pi / 2, psi + 2 * np.pi, psi))
        part[:] = scipy.interpolate.CubicSpline(_eccentricities(), between)(np.linspace(0.0, LARGEST, FINE[0]))
    return table


def _eccentricities() -> np.ndarray:
    """Closest to each other where the film is thinnest."""
    return LARGEST * np.sin(np.linspace(0.0, np.pi / 2, ECCENTRICITIES))


def _coarse(width: float) -> np.ndarray:
    """(2, ECCENTRICITIES, ANGLES) of ψ from -π/2 to π/2."""
    psi = np.linspace(-np.pi / 2, np.pi / 2, ANGLES)
    rows = []
    for e in _eccentricities():
        on = grid(float(e), width)
        rows.append([np.multiply(force(on, float(p)), (1 - e * e) ** STEEP) for p in psi])
    return np.moveaxis(np.array(rows), 2, 0)
