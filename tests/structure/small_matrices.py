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


def beam_elements(nodes, bending, line_mass):
    """M and K of a free beam of Hermite elements between nodes (m): deflection along Z and slope at each (SI)."""
    m = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) / 420
    k = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]], dtype=float)
    mass, stiffness = np.zeros((2, 2 * len(nodes), 2 * len(nodes)))
    for i, h in enumerate(np.diff(nodes)):
        part, scale = np.s_[2 * i : 2 * i + 4, 2 * i : 2 * i + 4], np.outer([1, h, 1, h], [1, h, 1, h])
        mass[part] += line_mass * h * m * scale
        stiffness[part] += bending / h**3 * k * scale
    return mass, stiffness


def hermite(count=COUNT):
    """M and K of a free steel beam of equal elements."""
    return beam_elements(np.linspace(0.0, LENGTH, count + 1), BENDING, LINE_MASS)


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
