"""The classic hinge chain, as published. It is assembled here; the links engine's descends from it."""

import dataclasses

import mujoco
import numpy as np
import pytest
import scipy.linalg

from clearance_mj.clearance import ConstantLaw
from clearance_mj.engines import Links, build_links
from clearance_mj.engines.plant import ARMATURE

from .test_beam_fe import RIG
from .test_closed_forms import ROOTS

PUBLISHED = "published figure, against λ²"
"""The frequencies' errors are against the roots of cos λ cosh λ = -1."""


def chain(hinges, compliance):
    """Mass and stiffness matrix in the hinge angles of a chain with l = EI = ρA = 1: δ(x) = Σ max(x - h_i, 0) θ_i."""
    edges = np.unique(np.concatenate((hinges, [0.0, 1.0])))
    node, weight = np.polynomial.legendre.leggauss(2)  # exact for products of straight levers
    x = (edges[:-1, None] + np.diff(edges)[:, None] * (node + 1) / 2).ravel()
    lever = np.maximum(np.subtract.outer(x, hinges), 0)
    mass = (lever.T * np.outer(np.diff(edges), weight / 2).ravel()) @ lever
    return mass, np.diag(1 / compliance)


def classic(n, first=()):
    """n cells with a hinge in the middle of each; the compliance of the first ones as a share of Δ/EI."""
    share = np.ones(n)
    share[: len(first)] = first
    return chain((np.arange(n) + 0.5) / n, share / n)


def errors(mass, stiffness):
    omega = np.sqrt(scipy.linalg.eigh(stiffness, mass, eigvals_only=True, subset_by_index=(0, 3)))
    return np.abs(omega / np.array(ROOTS[:4]) ** 2 - 1)


def test_equal_hinges(measured):
    """Second order."""
    coarse, fine = errors(*classic(20)), errors(*classic(40))
    for i, published in enumerate((5.7e-4, 2.0e-3, 3.3e-3, 4.5e-3)):
        what = f"f{i + 1}, equal hinges"
        measured.equal(f"{what}: error with 20 links", coarse[i], published, PUBLISHED, rel=0.03)
        measured.equal(f"{what}: order, 20 to 40 links", np.log2(coarse[i] / fine[i]), 2, "midpoint rule", abs=0.02)


def test_end_corrected_hinges(measured):
    """25/24 and 23/24 of Δ/EI at the first two hinges (Euler-Maclaurin): third order."""
    coarse, fine = errors(*classic(20, (25 / 24, 23 / 24))), errors(*classic(40, (25 / 24, 23 / 24)))
    for i, published in enumerate((4.0e-5, 4.8e-4, 1.3e-3, 2.5e-3)):
        what = f"f{i + 1}, end-corrected hinges"
        measured.equal(f"{what}: error with 20 links", coarse[i], published, PUBLISHED, rel=0.03)
        measured.equal(f"{what}: order, 20 to 40 links", np.log2(coarse[i] / fine[i]), 3, "Euler-Maclaurin", abs=0.1)
    for i, published in ((0, 4.9e-6), (3, 3.1e-4)):
        what = f"f{i + 1}, end-corrected hinges: error with 40 links"
        measured.equal(what, fine[i], published, PUBLISHED, rel=0.03)


def test_hinges_at_the_ends_of_the_links(measured):
    """The first one at the clamp, which is the rectangle rule: 3 to 5 % with 20 links."""
    for i, found in enumerate(errors(*chain(np.arange(20) / 20, np.full(20, 1 / 20)))):
        measured.equal(f"f{i + 1}, hinges at link ends: error with 20 links", found, 0.04, PUBLISHED, abs=0.01)


@pytest.mark.parametrize("n", [20, 40])
def test_fastest_mode(n, measured):
    """ω_max ≈ 6.9 N² √(EI/ρA)/l², here with the mass of Table 1's lever at the tip.

    Without a mass there the last link, half as long as the others, is on its own: 8.87.
    """
    mass, stiffness = classic(n)
    lever = 1 - (np.arange(n) + 0.5) / n
    ratio = RIG.masses[0].mass / (RIG.beam.mass_per_length * RIG.beam.length)
    found = np.sqrt(scipy.linalg.eigvalsh(stiffness, mass + ratio * np.outer(lever, lever))[-1]) / n**2
    measured.equal(f"ω_max l² √(ρA/EI)/N², {n} links and a mass at the tip", found, 6.9, PUBLISHED, rel=5e-3)


def test_limit_of_the_explicit_step(measured):
    """MuJoCo's links without contact and damping: bounded below the limit of their step, growing above.

    With an armature of a h² K it is 2/ω_max of M + a h² K: 2/ω_max/√(1 - 4a) with ω_max of M alone.
    """
    rig = RIG.replace(bushings=(), beam=dataclasses.replace(RIG.beam, rayleigh=(0.0, 0.0)))
    model = build_links(rig, 20).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass = np.zeros((20, 20))
    mujoco.mj_fullM(model, data, mass)
    value, vector = scipy.linalg.eigh(np.diag(model.jnt_stiffness), mass)
    limit = 2 / np.sqrt(value[-1]) / np.sqrt(1 - 4 * ARMATURE)

    def grows(step):
        model.opt.timestep = step
        model.dof_armature[:] = ARMATURE * step**2 * model.jnt_stiffness
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
    source = "2/ω_max of its matrices, armature included"
    measured.equal("largest stable step of 20 links in MuJoCo (s)", low, limit, source, rel=1e-3)
    assert Links(20, safety=0.8).largest_step(rig, ConstantLaw(0.0, 0.0)) == pytest.approx(0.8 * limit, rel=1e-3)
