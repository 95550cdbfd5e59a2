"""A synthetic modal test for the tutorial: FRFs of a pipe on two rubber mounts, by Hermite elements, with noise.

    python -m experiments.modal_test models/modal_test.uff

The elements are written here, so that what the tutorial finds is not what the library put in. A steel tube of
60 x 2.5 mm and 1.6 m carries a silencer of 3 kg; dashpots in the mounts make its modes slightly complex. Five
accelerometers and two points struck by a hammer.
"""

import sys
from pathlib import Path

import numpy as np

from clearance_mj import FRF, write_uff
from experiments.script import run

LENGTH, ELEMENTS = 1.6, 64
OUTER, INNER = 0.060, 0.055
YOUNG, DENSITY = 210e9, 7850.0
MOUNTS = ((0.1, 4.0e5, 60.0), (1.2, 1.5e5, 40.0))  # position m, stiffness N/m, damping N s/m
SILENCER = (0.8, 3.0, 0.02)  # position m, mass kg, inertia kg m²
RAYLEIGH = (2.0, 1e-6)
SENSORS = (0.1, 0.5, 0.9, 1.3, 1.6)  # m, nodes 1 to 5
STRUCK = (1, 3)  # sensors' indices
FREQUENCY = np.arange(2.0, 400.0, 0.5)
NOISE, SEED = 0.002, 0  # of each function's RMS


def matrices() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, damping and stiffness of deflections and slopes of all nodes."""
    area = np.pi / 4 * (OUTER**2 - INNER**2)
    inertia = np.pi / 64 * (OUTER**4 - INNER**4)
    h, size = LENGTH / ELEMENTS, 2 * (ELEMENTS + 1)
    scale = np.outer([1, h, 1, h], [1, h, 1, h])
    m = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) / 420 * scale
    k = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]) * scale
    mass, stiffness = np.zeros((2, size, size))
    for i in range(ELEMENTS):
        at = np.s_[2 * i : 2 * i + 4, 2 * i : 2 * i + 4]
        mass[at] += DENSITY * area * h * m
        stiffness[at] += YOUNG * inertia / h**3 * k
    damping = RAYLEIGH[0] * mass + RAYLEIGH[1] * stiffness
    for x, spring, dashpot in MOUNTS:
        stiffness[row(x), row(x)] += spring
        damping[row(x), row(x)] += dashpot
    x, lumped, rotary = SILENCER
    mass[row(x), row(x)] += lumped
    mass[row(x) + 1, row(x) + 1] += rotary
    return mass, damping, stiffness


def row(x: float) -> int:
    """Row of the deflection at a position, m."""
    return 2 * round(x / LENGTH * ELEMENTS)


def frfs(noise: float = NOISE) -> FRF:
    """Accelerance of the sensors under both blows."""
    mass, damping, stiffness = matrices()
    sensors = [row(x) for x in SENSORS]
    struck = [sensors[i] for i in STRUCK]
    omega = 2 * np.pi * FREQUENCY[:, None, None]
    dynamic = stiffness + 1j * omega * damping - omega**2 * mass
    blows = np.eye(len(mass))[:, struck]
    moved = np.linalg.solve(dynamic, blows)
    # Refined once by a residual of more digits: else the file's eighth digit would be the processor's.
    moved = moved + np.linalg.solve(dynamic, (blows - dynamic.astype(np.clongdouble) @ moved).astype(complex))
    value = (-(omega**2) * moved[:, sensors]).transpose(1, 2, 0)
    rng = np.random.default_rng(SEED)
    size = noise * np.sqrt(np.mean(np.abs(value) ** 2, axis=2, keepdims=True) / 2)
    value = value + size * (rng.standard_normal(value.shape) + 1j * rng.standard_normal(value.shape))
    labels = tuple(f"{i}:+Z" for i in range(1, len(SENSORS) + 1))
    return FRF(FREQUENCY, value, None, labels, tuple(labels[i] for i in STRUCK), "acceleration/force")


def main(path: Path) -> None:
    """Write the FRFs to a universal file."""
    write_uff(path, frfs())


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
