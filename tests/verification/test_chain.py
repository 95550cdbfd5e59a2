"""The hinge chain of the links engine against finite elements, and its matrices against MuJoCo's."""

import dataclasses

import mujoco
import numpy as np
import pytest
import scipy.linalg

from clearance_mj.beam import cantilever_roots
from clearance_mj.clearance import ConstantLaw
from clearance_mj.engines import Links, build_links, links
from clearance_mj.rig import Sensor

from .test_beam_fe import RIG, RIGS, frequencies_and_shapes, hermite

BARE = RIG.replace(masses=(), bushings=())
RIGS = {**RIGS, "bare": BARE}
ELEMENTS = 120
"""Error of the first four frequencies: below 1e-7"""
SOURCE = f"{ELEMENTS} Hermite elements"
NAMES = {rig: name for name, rig in RIGS.items()}
all_rigs = pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS.keys())


def chain(rig, n):
    """Mass and stiffness matrix of a chain of n links in its hinge angles, grease included."""
    lever = links._curved_lever([b.position for b in rig.bushings], rig.beam, n)
    springs = (lever.T * [b.grease.stiffness for b in rig.bushings]) @ lever
    return links._mass_matrix(rig, n), np.diag(1 / links._compliance(rig.beam, n)) + springs


def frequencies(mass, stiffness, n=4):
    return np.sqrt(scipy.linalg.eigh(stiffness, mass, eigvals_only=True, subset_by_index=(0, n - 1))) / (2 * np.pi)


def error(rig, n, expected):
    return np.abs(frequencies(*chain(rig, n)) / expected - 1)


@all_rigs
def test_convergence(rig, measured):
    """f1..f4 of the whole rig: 0.05 % at 20 links, 0.006 % at 40, of order 3.5 at least.

    Masses between the ends sit on straight links and leave a small term of second order.
    """
    expected, _ = frequencies_and_shapes(rig, 4, ELEMENTS)
    for n, limit in ((20, 5e-4), (40, 6e-5)):
        measured.below(f"f1 to f4, {n} links, {NAMES[rig]}: error", np.max(error(rig, n, expected)), limit, SOURCE)
    if any(mass.position < rig.beam.length for mass in rig.point_masses):
        return
    sizes = np.array([20, 28, 40, 56, 80])
    errors = np.array([np.max(error(rig, n, expected)) for n in sizes])
    order = -np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    measured.above(f"order of convergence, 20 to 80 links, {NAMES[rig]}", order, 3.5, SOURCE)


def test_published_errors(monkeypatch, measured):
    """The bare chain at 20 links, end-corrected by two points (Euler-Maclaurin); ours is far better."""

    def two_point(beam, n):
        return np.concatenate(([25 / 24, 23 / 24], np.ones(n - 2))) * beam.length / n / beam.bending_stiffness

    expected, _ = frequencies_and_shapes(BARE, 4, ELEMENTS)
    ours = error(BARE, 20, expected)
    monkeypatch.setattr(links, "_compliance", two_point)
    theirs = error(BARE, 20, expected)
    source = "hinges of 25/24, 23/24 of Δ/(EI) at the clamp"
    for i, (found, published) in enumerate(zip(theirs, (4.0e-5, 4.8e-4, 1.3e-3, 2.5e-3)), 1):
        measured.equal(f"error of f{i}, 20 links, two-point correction", found, published, source, rel=0.05)
    for i, found, published in zip((1, 4), error(BARE, 40, expected)[[0, 3]], (4.9e-6, 3.1e-4)):
        measured.equal(f"error of f{i}, 40 links, two-point correction", found, published, source, rel=0.05)
    what = "error with the engine's three-point correction over that with two, largest of f1 to f4"
    measured.below(what, np.max(ours / theirs), 1 / 8, SOURCE)


def test_published_errors_without_end_correction(monkeypatch, measured):
    """With equal hinges of Δ/(EI) the order falls to two."""
    monkeypatch.setattr(links, "_compliance", lambda beam, n: np.full(n, beam.length / n / beam.bending_stiffness))
    expected, _ = frequencies_and_shapes(BARE, 4, ELEMENTS)
    coarse, fine = error(BARE, 20, expected), error(BARE, 40, expected)
    for i, (found, published) in enumerate(zip(coarse, (5.7e-4, 2.0e-3, 3.3e-3, 4.5e-3)), 1):
        source = "equal hinges of Δ/(EI)"
        measured.equal(f"error of f{i}, 20 links, no correction", found, published, source, rel=0.05)
        measured.equal(
            f"order of f{i}, 20 to 40 links, no correction", np.log2(found / fine[i - 1]), 2, source, abs=0.2
        )


def test_fastest_mode(measured):
    """ω_max = 6.9 N² √(EI/ρA)/l², here with a mass on the light last link.

    It limits the step of the explicit springs to 2/ω_max.
    """
    rig, shaft = RIGS["no bushing"], RIG.beam
    expected = 6.9 * 20**2 * np.sqrt(shaft.bending_stiffness / shaft.mass_per_length) / shaft.length**2
    found = np.sqrt(scipy.linalg.eigvalsh(*chain(rig, 20)[::-1])[-1])
    measured.equal("fastest mode, 20 links (rad/s)", found, expected, "6.9 N² √(EI/ρA)/l²", rel=5e-3)
    assert Links(20, safety=0.5).largest_step(rig, ConstantLaw(0.0, 0.0)) == pytest.approx(1 / expected, rel=5e-3)


@pytest.mark.parametrize("n", [6, 20, 40])
@all_rigs
def test_mujoco_has_the_same_matrices(rig, n):
    """Mass matrix by mj_fullM at rest, hinge stiffness, and damping η2 of it."""
    model = build_links(rig, n).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass = np.zeros((n, n))
    mujoco.mj_fullM(model, data, mass)
    # MuJoCo adds an armature only where asked; spheres and plates have no mass.
    np.testing.assert_allclose(links._mass_matrix(rig, n), mass, rtol=0, atol=1e-12 * mass.max())
    compliance = np.full(n, rig.beam.length / n / rig.beam.bending_stiffness)
    compliance[:3] *= np.array([26, 21, 25]) / 24
    np.testing.assert_allclose(model.jnt_stiffness, 1 / compliance, rtol=1e-12)
    np.testing.assert_allclose(model.dof_damping, rig.beam.rayleigh[1] / compliance, rtol=1e-12)


@all_rigs
def test_frequencies_of_the_compiled_model(rig, measured):
    """The whole of it out of MuJoCo: mass by mj_fullM, bushings' lifts by the sites' Jacobians, hinges by the model."""
    n = 40
    model = build_links(rig, n).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass, jacobian = np.zeros((n, n)), np.zeros((3, n))
    mujoco.mj_fullM(model, data, mass)
    stiffness = np.diag(model.jnt_stiffness)
    for j, bushing in enumerate(rig.bushings):
        mujoco.mj_jacSite(model, data, jacobian, None, model.site(f"bushing{j}").id)
        stiffness += bushing.grease.stiffness * np.outer(jacobian[2], jacobian[2])
    expected, _ = frequencies_and_shapes(rig, 4, ELEMENTS)
    # The sites sit on the chain, not on the curve that it stands for: not as good as test_convergence.
    what = f"f1 to f4 of MuJoCo's matrices, 40 links, {NAMES[rig]}"
    measured.below(f"{what}: error", np.max(np.abs(frequencies(mass, stiffness) / expected - 1)), 1e-3, SOURCE)


@pytest.mark.parametrize("mode", [0, 1, 2, 3])
def test_shapes_between_the_hinges(mode, measured):
    """Anywhere along the shaft the curve that the chain stands for is of third order or better, the chain of second."""
    x = np.linspace(0.1, 0.99, 500)
    expected = hermite(x, 1.0, ELEMENTS) @ frequencies_and_shapes(RIG, 4, ELEMENTS)[1][:, mode]
    errors = {"curved": [], "straight": []}
    for n in (20, 40, 80):
        mass, stiffness = chain(RIG, n)
        vector = scipy.linalg.eigh(stiffness, mass)[1][:, mode]
        levers = {
            "curved": links._curved_lever(x, RIG.beam, n),
            "straight": links._lever(x, links._hinges(RIG.beam, n)),
        }
        for name, lever in levers.items():
            shape = lever @ vector
            errors[name].append(np.max(np.abs(shape * np.sign(shape @ expected) - expected)))
    order = {name: np.mean(-np.diff(np.log2(values))) for name, values in errors.items()}
    what = f"order of shape {mode + 1}, 20 to 80 links"
    measured.above(f"{what}, as the engine reads it", order["curved"], 2.7, SOURCE)
    measured.equal(f"{what}, on the straight links", order["straight"], 2, SOURCE, abs=0.3)


def test_curved_lever_is_nothing_on_average():
    """It bends the shaft within each cell without moving the cell, so inertia is the chain's."""
    shaft, n = RIG.beam, 10
    node, weight = np.polynomial.legendre.leggauss(6)
    for cell in range(2, 9):
        halves = [(cell + half / 2 + (node + 1) / 4) / n for half in (0, 1)]
        x = np.concatenate(halves)
        bend = links._curved_lever(x, shaft, n) - links._lever(x, links._hinges(shaft, n))
        np.testing.assert_allclose(np.tile(weight, 2) @ bend, 0, atol=1e-15)


def test_masses_sit_on_their_links():
    """A heavy sensor at the exact boundary of two links, one at the tip and one before the first hinge."""
    sensors = (Sensor(1, 0.125, 0.3), Sensor(2, 1.0, 0.2), Sensor(3, 0.01, 0.7))
    rig = RIG.replace(sensors=sensors, bushings=())
    model = build_links(rig, 20).compile()
    shaft = rig.beam.mass_per_length
    expected = shaft * 0.975 + 0.434 + 0.3 + 0.2  # not the half cell before the first hinge, nor what it carries
    assert model.body_subtreemass[1] == pytest.approx(expected, rel=1e-12)


def test_bushing_over_a_hinge():
    """A collar on each of two links."""
    bushing = dataclasses.replace(RIG.bushings[0], position=0.525)
    model = build_links(RIG.replace(bushings=(bushing,)), 20).compile()
    bodies = [model.body(model.geom(f"collar{name}").bodyid[0]).name for name in ("0a", "0b")]
    assert bodies == ["link9", "link10"]


def test_bushing_before_the_first_hinge():
    """The chain is rigid there, so the bushing does nothing; the shaft is a thousand times stiffer than elsewhere."""
    bushing = dataclasses.replace(RIG.bushings[0], position=0.015)
    rig = RIG.replace(bushings=(bushing, RIG.bushings[1]))
    expected, _ = frequencies_and_shapes(rig, 4, ELEMENTS)
    assert np.max(error(rig, 20, expected)) < 3e-3
    build_links(rig, 20)


def test_roots_are_of_this_shaft(measured):
    """The reference of this file, once against λ²."""
    shaft = BARE.beam
    expected = cantilever_roots(4) ** 2 * np.sqrt(shaft.bending_stiffness / shaft.mass_per_length) / (2 * np.pi)
    error = np.max(np.abs(frequencies_and_shapes(BARE, 4, ELEMENTS)[0] / expected - 1))
    measured.below("the reference itself, f1 to f4 of the bare shaft: error", error, 1e-7, "λ² √(EI/ρA)/(2π l²)")
