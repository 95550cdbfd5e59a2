"""Reduced models against the whole one: sparse and dense routes, residual flexibility and Craig-Bampton."""

import dataclasses
import time

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg

from clearance_mj import Contact, Grease, PointMass, linear_model
from clearance_mj.structure import Assembly, reduction
from clearance_mj.structure.large import lowest_modes
from clearance_mj.structure.reduction import MassNormalisedModes, reduced
from experiments.space_frame import Bar, Frame
from tests.structures import chain

from ..refusals import assert_refused

MODES = 20


def lattice(nx, ny, held=True):
    """M and K of a grid of 20 mm steel bars in the plane X-Y, 100 mm apart, clamped on one side (SI)."""
    frame, bar = Frame(), Bar(0.02, 0.0, 210e9, 7850.0)
    frame.nodes = [np.array([0.1 * i, 0.1 * j, 0.0]) for i in range(nx) for j in range(ny)]
    across = [(k, k + ny) for k in range((nx - 1) * ny)]
    frame.elements = [(a, b, bar) for a, b in across + [(k, k + 1) for k in range(nx * ny) if (k + 1) % ny]]
    mass, stiffness = frame.matrices()
    first = 6 * ny if held else 0
    return mass[first:, first:], stiffness[first:, first:]


def loads_of(size):
    """A corner's deflection, and one node's less another's."""
    corner, middle, other = size - 4, size // 12 * 6 + 2, size // 24 * 6 + 2
    rows = np.zeros((2, size))
    rows[0, corner], rows[1, middle], rows[1, other] = 1.0, 1.0, -1.0
    return rows


def receptance_of_all(mass, stiffness, loads, omega):
    return loads @ scipy.sparse.linalg.splu(scipy.sparse.csc_array(stiffness - omega**2 * mass)).solve(loads.T)


def receptance(reduced, loads, omega):
    at = loads @ reduced.shapes
    return at / (reduced.omega**2 - omega**2) @ at.T


def of(mass, stiffness, loads, kind="residual-flexibility", modes=MODES):
    linear = Assembly(mass, stiffness, np.zeros((mass.shape[0], 3)), lambda points: loads, reduction=kind)
    return reduced(linear, [], [], list(loads), modes)


@pytest.fixture(params=["dense", "sparse"])
def route(request, monkeypatch):
    """Every model takes the route of small ones, or that of large ones."""
    monkeypatch.setattr(reduction, "MAX_DENSE", 0 if request.param == "sparse" else 1500)


@pytest.mark.parametrize("held", [True, False])
def test_lowest_modes_are_those_of_a_dense_solver(held):
    """LAPACK's generalized eigensolver; a free structure has six modes of frequency 0."""
    mass, stiffness = lattice(9, 8, held)
    expected = scipy.linalg.eigh(stiffness.toarray(), mass.toarray(), eigvals_only=True)[:MODES]
    squares, shapes, _, _ = lowest_modes(mass, stiffness, MODES)
    rigid = 0 if held else 6
    assert np.all(squares[:rigid] == 0)
    np.testing.assert_allclose(squares[rigid:], expected[rigid:], rtol=1e-7)
    np.testing.assert_allclose(shapes.T @ (mass @ shapes), np.eye(MODES), atol=1e-10)


@pytest.mark.parametrize("route", ["sparse"], indirect=True)
def test_static_shapes_make_a_held_structure_exact_at_rest(route):
    mass, stiffness = lattice(9, 8)
    loads = loads_of(mass.shape[0])
    reduced = of(mass, stiffness, loads)
    flexible = receptance_of_all(mass, stiffness, loads, 0.0)
    np.testing.assert_allclose(receptance(reduced, loads, 0.0), flexible, rtol=1e-8)


@pytest.mark.parametrize("held", [True, False])
def test_residual_flexibility_against_the_whole_model(held, route):
    """Between the lowest_modes resonances of bending; modes alone miss a hundred times as much."""
    mass, stiffness = lattice(9, 8, held)
    loads = loads_of(mass.shape[0])
    reduced = of(mass, stiffness, loads)
    modal = MassNormalisedModes(reduced.omega[:MODES], reduced.shapes[:, :MODES])
    for k in (7, 9):
        omega = (reduced.omega[k] + reduced.omega[k + 1]) / 2
        whole = receptance_of_all(mass, stiffness, loads, omega)
        error, without = (np.abs(receptance(m, loads, omega) - whole).max() for m in (reduced, modal))
        assert error < 1e-3 * np.abs(whole).max() and error < 1e-2 * without


def test_craig_bampton_against_the_whole_model(route):
    """Frequencies fall to the whole model's as modes are added; the flexibility at rest is exact with any number."""
    mass, stiffness = lattice(9, 8)
    loads = loads_of(mass.shape[0])
    expected = np.sqrt(scipy.linalg.eigh(stiffness.toarray(), mass.toarray(), eigvals_only=True)[:10])
    for modes, error in (MODES, 3e-3), (3 * MODES, 2e-4):
        reduced = of(mass, stiffness, loads, "craig-bampton", modes)
        assert reduced.omega.size == modes + 3  # three degrees of freedom are kept
        excess = reduced.omega[:10] / expected - 1
        assert np.all(excess > -1e-8) and np.all(excess < error)
        flexible = receptance_of_all(mass, stiffness, loads, 0.0)
        np.testing.assert_allclose(receptance(reduced, loads, 0.0), flexible, rtol=1e-8)


def test_craig_bampton_needs_a_structure_that_is_held_at_its_clearances():
    mass, stiffness = lattice(4, 4, held=False)
    words = r'can move while its clearances and forces are held.*"residual-flexibility"'
    assert_refused(ValueError, words, of, mass, stiffness, loads_of(mass.shape[0]), "craig-bampton")


def test_thirty_thousand_degrees_of_freedom_take_seconds():
    """A simply supported plate by finite differences: K = L², whose eigenvalues and eigenvectors are known sines."""
    n = 175
    second = scipy.sparse.diags_array([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)], offsets=(-1, 0, 1))
    laplacian = scipy.sparse.kronsum(second, second).tocsr()
    stiffness, mass = laplacian @ laplacian, scipy.sparse.eye_array(n * n, format="csr")
    load = np.zeros((1, n * n))
    load[0, n * 60 + 87] = 1.0
    start = time.process_time()
    reduced = of(mass, stiffness, load)
    assert time.process_time() - start < 10
    step = np.arange(1, n + 1)
    line = 4 * np.sin(step * np.pi / (2 * (n + 1))) ** 2
    exact = line[:, None] + line
    np.testing.assert_allclose(reduced.omega[:MODES], np.sort(exact.ravel())[:MODES], rtol=1e-8)
    sines = np.sqrt(2 / (n + 1)) * np.sin(np.pi * np.outer([61, 88], step) / (n + 1))
    static = np.sum((sines[0][:, None] * sines[1] / exact) ** 2)
    np.testing.assert_allclose(receptance(reduced, load, 0.0), static, rtol=1e-8)


def test_rigs_that_differ_in_their_clearances_alone_share_one_reduction():
    """Gap, contact, offset and grease act outside of the modes; point masses, loads and springs within them."""
    rig = chain()
    first, second = rig.bushings
    here = dataclasses.replace(first, gap=7e-4, offset=1e-4, contact=Contact(1e5), grease=Grease(50.0))
    other, same = rig.replace(bushings=(here, second)), linear_model(rig)
    assert linear_model(other).rig is other and linear_model(other).omega is same.omega
    stiffer = linear_model(other, grease=True).omega, linear_model(rig, grease=True).omega
    assert not np.allclose(*stiffer)
    assert linear_model(rig.replace(masses=(PointMass("3:+Z", 0.1),))).omega[0] < same.omega[0]
    moved = rig.replace(bushings=(dataclasses.replace(first, to="3:+Z"), second))
    np.testing.assert_allclose(linear_model(moved).at_bushings[0], same.at_sensors[1] - same.at_sensors[2], atol=1e-12)
