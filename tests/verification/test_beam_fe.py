"""The shaft against finite elements. The beam model against Hermite elements and the article's test column.

The elements are those of the virtual rig, which share no code with the beam model and are held to closed forms in
tests/testrig. With 240 of them the discretisation error of the first eight frequencies is below 1e-7.
"""

import functools

import numpy as np
import pytest
import scipy.linalg

from clearance_mj import Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor, Shaker, beam
from experiments.testrig.fem import FiniteElements

from ..conftest import TABLE1 as RIG
from ..conftest import dense

ELEMENTS = 240
SOURCE = "240 Hermite elements"


def at(rig, x, n=ELEMENTS):
    """(n_x, 2 n) deflection at x from the deflections and slopes of the nodes, the clamped one left out."""
    elements = FiniteElements.of_shaft(rig.beam, rig.point_masses, n)
    return elements.points(x).dense(elements.count)


def greased(rig, matrix, name="stiffness"):
    """Add the springs of the bushings' grease, or their dashpots, to a matrix."""
    points = at(rig, [b.position for b in rig.bushings], len(matrix) // 2)
    return matrix + (points.T * [getattr(b.grease, name) for b in rig.bushings]) @ points


@functools.cache
def frequencies_and_shapes(rig, n, elements=ELEMENTS):
    """First n natural frequencies, Hz, and shapes (columns) of unit modal mass by finite elements.

    Solved for 1/ω², which keeps the digits of the lowest frequencies: the usual form loses ω_max²/ω² of them.
    """
    shaft = FiniteElements.of_shaft(rig.beam, rig.point_masses, elements)
    last = (shaft.count - n, shaft.count - 1)
    value, vector = scipy.linalg.eigh(dense(shaft.mass), greased(rig, dense(shaft.stiffness)), subset_by_index=last)
    omega, vector = 1 / np.sqrt(value[::-1]), vector[:, ::-1] * np.sign(vector[-2, ::-1])
    return omega / (2 * np.pi), omega * vector


def three_bushings():
    """A rectangular steel shaft through three unlike bushings, its sensors and lever heavy."""
    greases = {0.2: Grease(3e3, 2.0), 0.33: Grease(8e3, 1.0), 0.51: Grease(1e3, 4.0)}
    bushings = tuple(Bushing(x, 2e-4, 0.02, grease, Contact(1e4, 2.0)) for x, grease in greases.items())
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
    source = "the article, Table 1, test column"
    for i, (natural_hz, expected) in enumerate(zip(beam.natural_frequencies(RIG, 4), (9.25, 39.75, 92.85, 188.85)), 1):
        measured.equal(f"f{i} of the shipped rig (Hz)", natural_hz, expected, source, rel=1e-4)


@all_rigs
def test_mode_shapes(rig, measured):
    x = np.linspace(0.01, 1, 34) * rig.beam.length
    _, vector = frequencies_and_shapes(rig, 6)
    expected = at(rig, x) @ vector
    error = np.max(np.abs(beam.mode_shapes(rig, x, 6) - expected)) / np.max(np.abs(expected))
    measured.below(f"mode shapes 1-6, {NAMES[rig]}: error", error, 1e-5, SOURCE)


@pytest.mark.parametrize("shaker", [Shaker(), Shaker("force", 0.25)], ids=["base", "force"])
@all_rigs
def test_linear_frf(rig, shaker, measured):
    """Direct complex solution of the elements' equations at every line."""
    name, rig = NAMES[rig], rig.replace(shaker=shaker)
    frequency = np.arange(5, 220.1, 1.0)
    shaft = FiniteElements.of_shaft(rig.beam, rig.point_masses, ELEMENTS)
    mass, stiffness, (eta1, eta2) = dense(shaft.mass), dense(shaft.stiffness), rig.beam.rayleigh
    damping, stiffness = greased(rig, eta1 * mass + eta2 * stiffness, "damping"), greased(rig, stiffness)
    base = shaker.kind == "base"
    load = -shaft.inertia if base else at(rig, [shaker.position])[0]
    at_sensors = at(rig, [s.position for s in rig.sensors])
    expected = np.empty((len(rig.sensors), frequency.size), complex)
    for i, w in enumerate(2 * np.pi * frequency):
        expected[:, i] = -(w**2) * at_sensors @ solve_banded(stiffness + 1j * w * damping - w**2 * mass, load) + base
    frf = beam.linear_frf(rig, frequency)
    error, phase = 20 * np.log10(np.abs(frf / expected)), np.angle(frf / expected)
    what, source = f"linear FRF, {name}, {shaker.kind}", f"{SOURCE}, direct solution at every line"
    measured.below(f"{what}: RMS of magnitude", np.sqrt(np.mean(error**2)), 0.005, source, "dB")
    # As much in radian as in neper.
    measured.below(f"{what}: RMS of phase", np.sqrt(np.mean(phase**2)), 0.005 / 8.686, source, "rad")


def solve_banded(matrix, load):
    bands = np.array([np.pad(np.diagonal(matrix, k), (max(k, 0), max(-k, 0))) for k in range(3, -4, -1)])
    return scipy.linalg.solve_banded((3, 3), bands, load.astype(complex))
