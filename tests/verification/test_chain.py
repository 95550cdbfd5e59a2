"""The hinge chain of the links engine against finite elements, and its matrices against MuJoCo's."""

import dataclasses

import mujoco
import numpy as np
import pytest
import scipy.linalg

from clearance_mj import ConstantLaw, PointMass, Sensor
from clearance_mj.engines import Links, build_links
from clearance_mj.engines.linkage import linkage
from clearance_mj.engines.plant import ARMATURE
from clearance_mj.structure.beam import cantilever_roots

from ..physical.stepping import mass_matrix, with_data
from .test_beam_fe import RIG, RIGS, at, frequencies_and_shapes

BARE = RIG.replace(masses=(), bushings=())
RIGS = {**RIGS, "bare": BARE}
ELEMENTS = 120  # Error of the first four frequencies: below 1e-7
SOURCE = f"{ELEMENTS} Hermite elements"
NAMES = {rig: name for name, rig in RIGS.items()}
all_rigs = pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS.keys())


def matrices(rig, n):
    """Mass and stiffness matrix of a chain of n links in its hinge angles, grease included."""
    shaft = linkage(rig, n)
    lift = shaft.along_own([b.position for b in rig.bushings])
    return shaft.mass, np.diag(shaft.stiffness) + (lift.T * [b.grease.stiffness for b in rig.bushings]) @ lift


def frequencies(mass, stiffness, n=4):
    return np.sqrt(scipy.linalg.eigh(stiffness, mass, eigvals_only=True, subset_by_index=(0, n - 1))) / (2 * np.pi)


def error(rig, n, expected):
    return np.abs(frequencies(*matrices(rig, n)) / expected - 1)


@all_rigs
def test_convergence(rig, measured):
    """f1..f4 of the whole rig: of order 3.5 at least.

    Masses that are no end of an element sit on straight links and leave a small term of second order.
    """
    expected, _ = frequencies_and_shapes(rig, 4, ELEMENTS)
    for n, limit in ((12, 6e-3), (16, 2.5e-3), (20, 5e-4), (40, 4e-5)):
        measured.below(f"f1 to f4, {n} links, {NAMES[rig]}: error", np.max(error(rig, n, expected)), limit, SOURCE)
    sizes = np.array([20, 28, 40, 56, 80])
    order = -np.polyfit(np.log(sizes), np.log([np.max(error(rig, n, expected)) for n in sizes]), 1)[0]
    measured.above(f"order of convergence, 20 to 80 links, {NAMES[rig]}", order, 3.5, SOURCE)


def test_hinges():
    """Gauss's two points in ten elements of a bare shaft, each with half of an element's compliance."""
    shaft = linkage(BARE, 20).members[0].chain
    element = BARE.beam.length / 10
    first = element * (1 - 1 / np.sqrt(3)) / 2
    np.testing.assert_allclose(shaft.hinges[:4], [first, element - first, element + first, 2 * element - first])
    np.testing.assert_allclose(shaft.stiffness, BARE.beam.bending_stiffness / (element / 2))


@pytest.mark.parametrize("n", [12, 15, 16])
@all_rigs
def test_statics(rig, n):
    """Under a force at the tip: F x² (3l - x)/(6EI). Its curvature is a straight line, which two hinges hold.

    Links and shaft meet at the ends of elements, in place and slope, and the bushings' middles are such ends.
    """
    shaft, length = linkage(rig, n).members[0].chain, rig.beam.length

    def expected(x):
        return x**2 * (3 * length - x) / (6 * rig.beam.bending_stiffness)

    x, ends = np.linspace(0, length, 50), np.array([e.end for e in shaft.elements])
    angle = (length - shaft.hinges) / shaft.stiffness
    np.testing.assert_allclose(shaft.motion(x) @ angle, expected(x), atol=1e-12 * expected(length))
    np.testing.assert_allclose(shaft.motion(ends, straight=True) @ angle, expected(ends), rtol=1e-12)
    assert all(np.isclose(ends, b.position, rtol=1e-12).any() for b in rig.bushings)
    assert shaft.hinges.size == n and min(e.hinges.size for e in shaft.elements) >= 2


@pytest.mark.parametrize("n", [6, 15, 20, 40])
@all_rigs
def test_mujoco_has_the_same_matrices(rig, n):
    """Mass matrix by mj_fullM at rest, hinge stiffness, and damping η2 of it."""
    shaft, model = linkage(rig, n), build_links(rig, n).compile()
    mass = mass_matrix(model)
    # MuJoCo adds an armature only where asked; spheres and plates have no mass.
    np.testing.assert_allclose(shaft.mass, mass, rtol=0, atol=1e-12 * mass.max())
    np.testing.assert_allclose(model.jnt_stiffness, shaft.stiffness, rtol=1e-12)
    np.testing.assert_allclose(model.dof_damping, rig.beam.rayleigh[1] * shaft.stiffness, rtol=1e-12)


@all_rigs
def test_frequencies_of_the_compiled_model(rig, measured):
    """The whole of it out of MuJoCo: mass by mj_fullM, bushings' lifts by the sites' Jacobians, hinges by the model."""
    n = 40
    model = build_links(rig, n).compile()
    data, jacobian = mujoco.MjData(model), np.zeros((3, n))
    mass = mass_matrix(model, data)
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
    """Anywhere along the shaft the curve that the chain stands for is of fourth order, the chain of second."""
    x = np.linspace(0.1, 0.99, 500)
    expected = at(RIG, x, ELEMENTS) @ frequencies_and_shapes(RIG, 4, ELEMENTS)[1][:, mode]
    errors = {"curved": [], "straight": []}
    for n in (20, 40, 80):
        mass, stiffness = matrices(RIG, n)
        vector = scipy.linalg.eigh(stiffness, mass)[1][:, mode]
        for name in errors:
            shape = linkage(RIG, n).along_own(x, straight=name == "straight") @ vector
            errors[name].append(np.max(np.abs(shape * np.sign(shape @ expected) - expected)))
    order = {name: np.mean(-np.diff(np.log2(values))) for name, values in errors.items()}
    what = f"order of shape {mode + 1}, 20 to 80 links"
    measured.above(f"{what}, as the engine reads it", order["curved"], 3.5, SOURCE)
    measured.equal(f"{what}, on the straight links", order["straight"], 2, SOURCE, abs=0.5)


@pytest.mark.parametrize("n", [16, 20])
def test_armature(n, measured):
    """Frequencies of the time stepping itself, out of its matrices: 2/h asin(ωh/2) with ω of M + a h² K.

    At a = 1/12 the error in time would be of fourth order; the engine's leaves (1/24 - a/2) (ωh)².
    """
    mass, stiffness = matrices(BARE, n)
    exact = 2 * np.pi * frequencies(mass, stiffness)
    h = 1e-4
    for armature in (0.0, 1 / 12, ARMATURE):
        omega = 2 * np.pi * frequencies(mass + armature * h**2 * stiffness, stiffness)
        measured_error = (2 / h * np.arcsin(omega * h / 2) / exact - 1)[3]
        expected = (1 / 24 - armature / 2) * (exact[3] * h) ** 2
        what = f"error in time of f4, {n} links, armature {armature:.3g} h² K"
        measured.equal(what, measured_error, expected, "(1/24 - a/2) (ωh)²", abs=(exact[3] * h) ** 4 / 50)


def test_masses_sit_on_their_links():
    """One at the exact boundary of two links, too near to a bushing to be the end of an element, and one at the tip."""
    hinges = linkage(RIG, 20).members[0].chain.hinges
    last = np.searchsorted(hinges, RIG.bushings[0].position)
    rig = RIG.replace(sensors=(Sensor(1, hinges[last], 0.3), Sensor(2, 1.0, 0.2), Sensor(3, 0.01, 0.7)))
    np.testing.assert_array_equal(linkage(rig, 20).members[0].chain.hinges, hinges)
    model, shaft = build_links(rig, 20).compile(), rig.beam.mass_per_length
    assert model.body(f"link{last - 1}").mass == pytest.approx(shaft * (hinges[last] - hinges[last - 1]))
    assert model.body(f"link{last}").mass == pytest.approx(shaft * (hinges[last + 1] - hinges[last]) + 0.3)
    # Not what is before the first hinge.
    assert model.body_subtreemass[1] == pytest.approx(shaft * (1 - hinges[0]) + 0.434 + 0.3 + 0.2, rel=1e-12)


def test_bushing_over_a_hinge():
    """A long one, with a collar on each of two links."""
    rig = RIG.replace(bushings=(dataclasses.replace(RIG.bushings[0], position=0.525, length=0.08),))
    model, hinges = build_links(rig, 20).compile(), linkage(rig, 20).members[0].chain.hinges
    bodies = [model.geom(f"collar{name}").bodyid[0] - 1 for name in ("0a", "0b")]
    assert bodies == [np.searchsorted(hinges, x) - 1 for x in (0.485, 0.565)] and bodies[0] < bodies[1]


def ends_of_elements(**changes):
    return [e.end for e in linkage(RIG.replace(**changes), 20).members[0].chain.elements]


def test_a_long_bushing():
    """Its ends are ends of elements too, so that chain and shaft meet where the contacts are."""
    bushing = dataclasses.replace(RIG.bushings[0], length=0.16)
    ends = ends_of_elements(bushings=(bushing,))
    assert all(np.isclose(ends, x).any() for x in (*bushing.ends, bushing.position))


def test_masses_along_the_shaft():
    """The heaviest is the end of an element, where the shaft's curvature has a kink; one close to it is not."""
    masses = (PointMass(0.3, 0.02, "light"), PointMass(0.32, 0.5, "heavy"), PointMass(1.0, 0.4, "tip"))
    ends = ends_of_elements(masses=masses)
    assert np.isclose(ends, 0.32).any() and not np.isclose(ends, 0.3).any()


def test_bushing_before_the_first_hinge():
    """Too near to the clamp to be the end of an element; the shaft is a thousand times stiffer than elsewhere."""
    rig = RIG.replace(bushings=(dataclasses.replace(RIG.bushings[0], position=0.015), RIG.bushings[1]))
    assert np.max(error(rig, 20, frequencies_and_shapes(rig, 4, ELEMENTS)[0])) < 3e-3
    build_links(rig, 20)


def test_roots_are_of_this_shaft(measured):
    """The reference of this file, once against λ²."""
    shaft = BARE.beam
    expected = cantilever_roots(4) ** 2 * np.sqrt(shaft.bending_stiffness / shaft.mass_per_length) / (2 * np.pi)
    error = np.max(np.abs(frequencies_and_shapes(BARE, 4, ELEMENTS)[0] / expected - 1))
    measured.below("the reference itself, f1 to f4 of the bare shaft: error", error, 1e-7, "λ² √(EI/ρA)/(2π l²)")


def test_limit_of_the_explicit_step(measured):
    """MuJoCo's links without contact and damping: bounded below the limit of their step, growing above.

    With an armature of a h² K it is 2/ω_max of M + a h² K: 2/ω_max/√(1 - 4a) with ω_max of M alone.
    """
    rig = RIG.replace(bushings=(), beam=dataclasses.replace(RIG.beam, rayleigh=(0.0, 0.0)))
    model, data = with_data(build_links(rig, 20).compile())
    value, vector = scipy.linalg.eigh(np.diag(model.jnt_stiffness), mass_matrix(model, data))
    limit = 2 / np.sqrt(value[-1]) / np.sqrt(1 - 4 * ARMATURE)

    def grows(step):
        model.opt.timestep, model.dof_armature[:] = step, ARMATURE * step**2 * model.jnt_stiffness
        mujoco.mj_resetData(model, data)
        data.qpos[:] = 1e-12 * vector[:, -1]
        for _ in range(100):
            mujoco.mj_step(model, data, 20)
            if np.max(np.abs(data.qpos)) > 1e-9 * np.max(np.abs(vector[:, -1])):
                return True
        return False

    low, high = 0.9 * limit, 1.1 * limit
    assert not grows(low) and grows(high)
    while high / low > 1.0002:
        middle = (low + high) / 2
        low, high = (low, middle) if grows(middle) else (middle, high)
    what, source = "largest stable step of 20 links in MuJoCo (s)", "2/ω_max of its matrices, armature included"
    measured.equal(what, low, limit, source, rel=1e-3)
    assert Links(20, safety=0.8).largest_step(rig, ConstantLaw(0.0, 0.0)) == pytest.approx(0.8 * limit, rel=1e-3)
