"""The shaft against closed forms. Frequencies, and deflections under forces that stand still."""

import dataclasses

import mujoco
import numpy as np
import pytest
import scipy.linalg

from clearance_mj import ConstantLaw, Excitation, Sensor, Shaker, beam, linear_model
from clearance_mj.engines import Links, Modal, build_links, simulate
from clearance_mj.structure.beam import cantilever_roots
from experiments.testrig.fem import FiniteElements

from ..conftest import dense
from ..engines.alike import with_bushings
from .modal_mj import ModalMujoco
from .test_beam_fe import RIG

BARE = RIG.replace(masses=(), bushings=())
SHAFT = RIG.beam
ROOTS = (1.875104068711961, 4.694091132974175, 7.854757438237613, 10.995540734875467, 14.137168391046471)
TIP = "F l³/(3EI)"
AT_BUSHINGS = "(I + G K)⁻¹ G F, G = a²(3b - a)/(6EI)"


def flexibility(x, y):
    """Deflection at x under a unit force at y of the bare cantilever: a²(3b - a)/(6EI), a the nearer of the two."""
    near, far = np.minimum.outer(x, y), np.maximum.outer(x, y)
    return near**2 * (3 * far - near) / (6 * SHAFT.bending_stiffness)


def test_roots(measured):
    """To the last digit or the one before."""
    for i, (computed, root) in enumerate(zip(cantilever_roots(5), ROOTS), 1):
        measured.equal(f"λ{i}", computed, root, "cos λ cosh λ = -1", rel=3e-16)


def test_frequencies_of_the_bare_shaft(measured):
    scale = np.sqrt(SHAFT.bending_stiffness / SHAFT.mass_per_length) / (2 * np.pi * SHAFT.length**2)
    elements = FiniteElements.of_shaft(SHAFT)
    squares = scipy.linalg.eigh(dense(elements.stiffness), dense(elements.mass), eigvals_only=True)[:5]
    rows, source = zip(ROOTS, beam.natural_frequencies(BARE, 5), np.sqrt(squares) / (2 * np.pi)), "λ² √(EI/ρA)/(2π l²)"
    for i, (root, ritz, virtual_rig) in enumerate(rows, 1):
        measured.equal(f"f{i} of the bare shaft, Ritz model (Hz)", ritz, root**2 * scale, source, rel=1e-9)
        measured.equal(f"f{i} of the bare shaft, virtual rig (Hz)", virtual_rig, root**2 * scale, source, rel=2e-6)


def test_tip_under_a_force(measured):
    """1 N at the tip, which carries the lever's mass as in Table 1."""
    expected = SHAFT.length**3 / (3 * SHAFT.bending_stiffness)
    ritz = linear_model(RIG.replace(bushings=()))
    tip = np.sum((ritz.shapes([SHAFT.length])[0] / ritz.omega) ** 2)
    measured.equal("tip under 1 N, Ritz model (m)", tip, expected, TIP, rel=1e-9)
    elements = FiniteElements.of_shaft(SHAFT)
    load = elements.points([SHAFT.length]).dense(elements.count)[0]
    tip = load @ scipy.linalg.solveh_banded(elements.stiffness, load, lower=True)
    measured.equal("tip under 1 N, virtual rig (m)", tip, expected, TIP, rel=1e-8)


@pytest.mark.parametrize("links", [20, 40])
def test_tip_of_the_hinge_chain_under_a_force(links, measured):
    """By MuJoCo's matrices: the lever of the sensor's site at the tip over the hinges' stiffness."""
    model = build_links(BARE.replace(sensors=(Sensor(1, SHAFT.length),)), links).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    jacobian = np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, jacobian, None, 0)
    tip = np.sum(jacobian[2] ** 2 / model.jnt_stiffness)
    expected = SHAFT.length**3 / (3 * SHAFT.bending_stiffness)
    measured.equal(f"tip under 1 N, {links} links in MuJoCo (m)", tip, expected, TIP, rel=2e-4)


@pytest.mark.parametrize("engine", [Modal(), ModalMujoco(), Links()], ids=lambda engine: engine.name)
def test_bushings_under_a_force(engine, measured):
    """A force at the tip that rises over a second and then stands still; the shaft stays inside its gaps."""
    grease = dataclasses.replace(RIG.bushings[0].grease, damping=30.0)  # rings out sooner
    rig = with_bushings(RIG, grease=grease).replace(shaker=Shaker("force", SHAFT.length))
    place, force, fs = [b.position for b in rig.bushings], 0.2, 512.0
    time = np.arange(round(4 * fs)) / fs
    drive = Excitation(force * np.sin(np.pi / 2 * np.minimum(time, 1.0)) ** 2, fs, "force")
    response = simulate(rig, drive, ConstantLaw(7.8e3, 4.0), engine)
    assert not response.contact_force.any()
    at_tip, between = flexibility(place, [SHAFT.length])[:, 0], flexibility(place, place)
    expected = force * np.linalg.solve(np.eye(2) + grease.stiffness * between, at_tip)
    for j, at_bushing in enumerate(response.displacement[:, time > 3.5].mean(axis=1)):
        what = f"{engine.name}: deflection at bushings[{j}] under {force} N at the tip (m)"
        measured.equal(what, at_bushing, expected[j], AT_BUSHINGS, rel=1e-3)
