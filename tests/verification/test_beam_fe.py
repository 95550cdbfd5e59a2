"""The shaft against finite elements. The beam model against Hermite elements and the article's test column.

The elements are the cubic ones of Przemieniecki, Theory of Matrix Structural Analysis (1968), tables 5.2 and 11.1. With
240 of them, assembled here, the discretisation error of the first eight frequencies is below 1e-7.
"""

import functools
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

from clearance_mj import beam
from clearance_mj.rig import Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor, Shaker

RIG = Rig.load(Path(__file__).parents[2] / "models" / "table1_rig.toml")
ELEMENTS = 240
SOURCE = "240 Hermite elements"


def hermite(x, length, elements=ELEMENTS):
    """(n_x, 2 * elements) deflection at x from the deflections and slopes of the nodes, the clamped one left out."""
    h = length / elements
    rows = np.zeros((len(x), 2 * elements + 2))
    for row, position in zip(rows, x):
        e = min(int(position / h), elements - 1)
        u = position / h - e
        row[2 * e : 2 * e + 4] = (
            1 - 3 * u**2 + 2 * u**3,
            h * u * (1 - u) ** 2,
            3 * u**2 - 2 * u**3,
            h * u**2 * (u - 1),
        )
    return rows[:, 2:]


def shaft(beam, point_masses=(), elements=ELEMENTS):
    """Consistent mass and stiffness of the clamped shaft, and its load under a unit acceleration of the base."""
    h, n = beam.length / elements, 2 * elements + 2
    mass, stiffness, load = np.zeros((n, n)), np.zeros((n, n)), np.zeros(n)
    m = [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h**2, 13 * h, -3 * h**2]]
    m += [[54, 13 * h, 156, -22 * h], [-13 * h, -3 * h**2, -22 * h, 4 * h**2]]
    k = [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2]]
    k += [[-12, -6 * h, 12, -6 * h], [6 * h, 2 * h**2, -6 * h, 4 * h**2]]
    for i in range(0, 2 * elements, 2):
        mass[i : i + 4, i : i + 4] += beam.mass_per_length * h / 420 * np.array(m)
        stiffness[i : i + 4, i : i + 4] += beam.bending_stiffness / h**3 * np.array(k)
        load[i : i + 4] += beam.mass_per_length * h * np.array([1 / 2, h / 12, 1 / 2, -h / 12])
    mass, stiffness, load = mass[2:, 2:], stiffness[2:, 2:], load[2:]
    for point in point_masses:
        at = hermite([point.position], beam.length, elements)[0]
        mass += point.mass * np.outer(at, at)
        load += point.mass * at
    return mass, stiffness, load


def greased(rig, matrix, name="stiffness"):
    """Add the springs of the bushings' grease, or their dashpots, to a matrix."""
    at = hermite([b.position for b in rig.bushings], rig.beam.length, len(matrix) // 2)
    return matrix + (at.T * [getattr(b.grease, name) for b in rig.bushings]) @ at


@functools.cache
def frequencies_and_shapes(rig, n, elements=ELEMENTS):
    """First n natural frequencies, Hz, and shapes (columns) of unit modal mass by finite elements.

    Solved for 1/ω², which keeps the digits of the lowest frequencies: the usual form loses ω_max²/ω² of them.
    """
    mass, stiffness, _ = shaft(rig.beam, rig.point_masses, elements)
    last = (len(mass) - n, len(mass) - 1)
    value, vector = scipy.linalg.eigh(mass, greased(rig, stiffness), subset_by_index=last)
    omega, vector = 1 / np.sqrt(value[::-1]), vector[:, ::-1] * np.sign(vector[-2, ::-1])
    return omega / (2 * np.pi), omega * vector


def three_bushings():
    """A rectangular steel shaft through three unlike bushings, its sensors and lever heavy."""
    bushings = tuple(
        Bushing(x, 2e-4, 0.02, Grease(k, c), Contact(1e4, 2.0))
        for x, k, c in ((0.2, 3e3, 2.0), (0.33, 8e3, 1.0), (0.51, 1e3, 4.0))
    )
    sensors = (Sensor(1, 0.1, 0.02), Sensor(2, 0.4, 0.05), Sensor(3, 0.6))
    steel = Beam(0.6, 205e9, 7800.0, width=0.02, height=0.006, rayleigh=(1.0, 2e-5))
    return Rig("three bushings", steel, bushings, sensors, (PointMass(0.55, 0.3, "lever"),))


RIGS = {"table 1": RIG, "three bushings": three_bushings(), "no bushing": RIG.replace(bushings=())}
NAMES = {rig: name for name, rig in RIGS.items()}
all_rigs = pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS.keys())


@all_rigs
def test_natural_frequencies(rig, measured):
    expected, _ = frequencies_and_shapes(rig, 8)
    error = np.max(np.abs(beam.natural_frequencies(rig, 8) / expected - 1))
    measured.below(f"natural frequencies 1-8, {NAMES[rig]}: error", error, 1e-6, SOURCE)


def test_natural_frequencies_of_the_article(measured):
    for i, (found, expected) in enumerate(zip(beam.natural_frequencies(RIG, 4), (9.25, 39.75, 92.85, 188.85)), 1):
        measured.equal(f"f{i} of the shipped rig (Hz)", found, expected, "the article, Table 1, test column", rel=1e-4)


@all_rigs
def test_mode_shapes(rig, measured):
    x = np.linspace(0.01, 1, 34) * rig.beam.length
    _, vector = frequencies_and_shapes(rig, 6)
    expected = hermite(x, rig.beam.length) @ vector
    error = np.max(np.abs(beam.mode_shapes(rig, x, 6) - expected)) / np.max(np.abs(expected))
    measured.below(f"mode shapes 1-6, {NAMES[rig]}: error", error, 1e-5, SOURCE)


@pytest.mark.parametrize("shaker", [Shaker(), Shaker("force", 0.25)], ids=["base", "force"])
@all_rigs
def test_linear_frf(rig, shaker, measured):
    """Direct complex solution of the elements' equations at every line."""
    name, rig = NAMES[rig], rig.replace(shaker=shaker)
    frequency = np.arange(5, 220.1, 1.0)
    mass, stiffness, base_load = shaft(rig.beam, rig.point_masses)
    eta1, eta2 = rig.beam.rayleigh
    damping = greased(rig, eta1 * mass + eta2 * stiffness, "damping")
    stiffness = greased(rig, stiffness)
    base = shaker.kind == "base"
    load = -base_load if base else hermite([shaker.position], rig.beam.length)[0]
    at_sensors = hermite([s.position for s in rig.sensors], rig.beam.length)
    expected = np.empty((len(rig.sensors), frequency.size), complex)
    for i, w in enumerate(2 * np.pi * frequency):
        dynamic = stiffness + 1j * w * damping - w**2 * mass
        expected[:, i] = -(w**2) * at_sensors @ solve_banded(dynamic, load) + base
    found = beam.linear_frf(rig, frequency)
    error, phase = 20 * np.log10(np.abs(found / expected)), np.angle(found / expected)
    what = f"linear FRF, {name}, {shaker.kind}"
    source = f"{SOURCE}, direct solution at every line"
    measured.below(f"{what}: RMS of magnitude", np.sqrt(np.mean(error**2)), 0.005, source, "dB")
    # As much in radian as in neper.
    measured.below(f"{what}: RMS of phase", np.sqrt(np.mean(phase**2)), 0.005 / 8.686, source, "rad")


def solve_banded(matrix, load):
    bands = np.array([np.pad(np.diagonal(matrix, k), (max(k, 0), max(-k, 0))) for k in range(3, -4, -1)])
    return scipy.linalg.solve_banded((3, 3), bands, load.astype(complex))
