"""One rig as shaft, as matrices and as modes. The shaft of Table 1 hits its bushings; all three give the same FRFs.

Matrices and modes are of the tests' own Hermite elements (Przemieniecki, Theory of Matrix Structural Analysis, 1968,
sections 5.6 and 11.5). Modes are those of the shaft with the lever's mass, as a test would find them: the lowest
14, and the flexibility that they leave at the clearances and the shaker.
Matrices are of the bare shaft, as the shaft is.
"""

import dataclasses
import functools

import numpy as np
import pytest
import scipy.linalg

from clearance_mj import ConstantLaw, Modal, Rig, Shaker, estimate_frf, simulate
from clearance_mj.signals.excitation import random
from clearance_mj.structure import Material, Matrices, ModalStructure, Section, Shaft, Support

from ..conftest import TABLE1
from ..structure.small_matrices import beam_elements

BEAM = TABLE1.beam
NODES = np.unique(np.round(np.append(np.linspace(0, BEAM.length, 81), [0.5484, 0.7918]), 9))
MODES = 14
LAW = ConstantLaw(7.8e3, 4.0)  # the datasheet's contact


def elements():
    """Mass and stiffness of deflections and slopes of all nodes but the clamped one."""
    return tuple(m[2:, 2:] for m in beam_elements(NODES, BEAM.bending_stiffness, BEAM.mass_per_length))


def dof(x):
    """Degree of freedom of the deflection at a node: positive slope is a rotation about -Y."""
    return f"{int(np.argmin(np.abs(NODES - x)))}:+Z"


def shaft():
    steel = Material(BEAM.young_modulus, BEAM.density)
    section = Section(BEAM.length, diameter=BEAM.diameter)
    return Shaft((section,), (Support(0.0, "clamped"),), (), steel, BEAM.rayleigh, theory="euler")


def matrices(folder):
    mass, stiffness = elements()
    names = [f"{node}:{axis}" for node in range(1, NODES.size) for axis in ("+Z", "-RY")]
    np.savez(folder / "fe.npz", M=mass, K=stiffness, dofs=names)
    return Matrices("m-kg-s", file=str(folder / "fe.npz"), rayleigh=BEAM.rayleigh)


def modes():
    mass, stiffness = elements()
    (lever,) = TABLE1.masses
    mass[-2, -2] += lever.mass
    value, vector = scipy.linalg.eigh(mass, stiffness)  # for 1/ω², which keeps the digits of the lowest
    omega = 1 / np.sqrt(value[::-1][:MODES])
    shapes = vector[:, ::-1][:, :MODES] * omega
    measured, loads = [0.15, 0.30, 0.40, 0.5484, 0.65, 0.7918, 0.90, 1.0], [0.30, 0.5484, 0.7918]
    at, under = ([2 * (int(dof(x).split(":")[0]) - 1) for x in places] for places in (measured, loads))
    rest = np.linalg.solve(stiffness, np.eye(len(mass))[:, under])[at] - (shapes[at] / omega**2) @ shapes[under].T
    ratios = tuple((BEAM.rayleigh[0] / omega + BEAM.rayleigh[1] * omega) / 2)
    participation = tuple((0.0, 0.0, g) for g in np.tile([1.0, 0.0], len(mass) // 2) @ mass @ shapes)
    return ModalStructure(
        tuple(omega / (2 * np.pi)), ratios, tuple(map(dof, measured)), tuple(map(tuple, shapes[at])),
        participation=participation, residual_flexibility=tuple(map(tuple, rest)), residual_dofs=tuple(map(dof, loads)),
    )  # fmt: skip


def rig_of(structure, kind):
    """The rig of Table 1, its bushings short: a degree of freedom is one point."""
    place = float if structure.shafts else dof

    def moved(items):
        return tuple(dataclasses.replace(item, position=place(item.position)) for item in items)

    bushings = tuple(dataclasses.replace(b, length=0.0) for b in TABLE1.bushings)
    shaker = Shaker() if kind == "base" else Shaker("force", place(0.30))
    masses = () if isinstance(structure, ModalStructure) else moved(TABLE1.masses)
    return Rig("3 ways", None, moved(bushings), moved(TABLE1.sensors), masses, shaker, structure=structure)


@functools.cache
def frf(structure, kind, level):
    noise = random(12.0, 2048.0, (5.0, 220.0), level, 4, kind)
    response = simulate(rig_of(structure, kind), noise, LAW, Modal(resolution=0.2))
    assert np.any(response.contact_force[-1])
    return estimate_frf(response, resolution=2.0).functions


SLOW = [pytest.param(kind, 1.0, marks=pytest.mark.slow) for kind in ("base", "force")]


@pytest.mark.parametrize(("kind", "level"), [*SLOW, ("base", 5.0)])
def test_the_same_frfs_in_contact(kind, level, measured, tmp_path_factory):
    """RMS over sensors and lines (2 Hz); base in m/s², force in N, rms."""
    expected = frf(shaft(), kind, level)
    for name, structure in (("matrices", matrices(tmp_path_factory.mktemp("fe"))), ("modes", modes())):
        error = np.sqrt(np.mean((20 * np.log10(np.abs(frf(structure, kind, level) / expected))) ** 2))
        what = f"{name} and shaft, FRFs in contact, {kind} at {level:g} {'m/s²' if kind == 'base' else 'N'}"
        measured.below(what, error, 0.05, "kind shaft", "dB")
