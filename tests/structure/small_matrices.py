"""Matrices of a cantilever and of a mechanism that tests of structures share."""

import numpy as np

import clearance_mj as cm
from clearance_mj.rig import Rig, Sensor
from clearance_mj.structure import Matrices

LENGTH, COUNT = 1.0, 8


BENDING, LINE_MASS = 210e9 * np.pi * 0.01**4 / 64, 7850 * np.pi * 0.01**2 / 4


MOVES = [f"{node}:{axis}" for node in range(1, COUNT + 2) for axis in ("Z", "RY")]


MASS_2 = ((2.0, 0.0), (0.0, 1.0))


STIFFNESS_2 = ((300.0, -100.0), (-100.0, 100.0))


def hermite(count=COUNT):
    """M and K of a free beam of Hermite elements: deflection along Z and slope at each node (SI)."""
    h, n = LENGTH / count, 2 * count + 2
    k = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2]])
    k = np.vstack((k, -k[0], [6 * h, 2 * h**2, -6 * h, 4 * h**2])) * BENDING / h**3
    m = [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h**2, 13 * h, -3 * h**2]]
    m = np.vstack((m, [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h**2, -22 * h, 4 * h**2])) * LINE_MASS * h / 420
    mass, stiffness = np.zeros((2, n, n))
    for i in range(0, n - 2, 2):
        mass[i : i + 4, i : i + 4] += m
        stiffness[i : i + 4, i : i + 4] += k
    return mass, stiffness


def in_millimetres(matrix, per_mass_and_time):
    """The same in mm, t (or kg) and s: forces per displacement, moments per rotation in the units of the system."""
    unit = np.where([":R" in name for name in MOVES], 1e-3, 1.0)
    return matrix / np.outer(unit, unit) / per_mass_and_time


def small(**changes):
    """Two masses on springs."""
    given = {"mass": MASS_2, "stiffness": STIFFNESS_2, "dofs": ("1:X", "2:X"), "units": "m-kg-s"}
    return Matrices(**(given | changes))


def held(structure, sensors=("9:Z",), **more):
    return Rig("test", None, (), tuple(Sensor(i + 1, at) for i, at in enumerate(sensors)), structure=structure, **more)


def cantilever(**changes):
    given = dict(zip(("mass", "stiffness"), hermite())) | {"dofs": MOVES, "units": "m-kg-s", "fixed": ("1",)}
    return Matrices(**(given | changes))


def frequencies(structure, n=4, at="9:Z"):
    return cm.beam.natural_frequencies(held(structure, (at,)), n)
