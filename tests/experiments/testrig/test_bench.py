import ast
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.signal

import experiments.testrig
from clearance_mj import Excitation, ExcitationError, excitation
from experiments.testrig import RIGS, Truth, simulate_rig
from experiments.testrig.fem import FiniteElements

from ...conftest import dense

FS = 2048.0


def shaken(rig, level, duration, seed=5):
    shake = excitation.random(duration, FS, (5.0, 220.0), rms=level, seed=seed, kind="base")
    return simulate_rig(rig, Truth(), shake, seed)


def coherence(response):
    """Mean ordinary coherence of the accelerometers with the base, 5-220 Hz."""
    f, value = scipy.signal.coherence(response.excitation, response.acceleration, FS, nperseg=4096)
    return value[:, (f >= 5) & (f <= 220)].mean()


@pytest.fixture(scope="module")
def runs(rig):
    plan = {0.3: 2, 1.0: 6, 2.0: 6, 5.0: 8}
    return {level: shaken(rig, level, duration) for level, duration in plan.items()}


def test_imports_no_physics_of_the_package():
    """Pages that are drawn of its records, `other_rigs`, are no part of the rig."""
    allowed = {"version", "core.errors", "core.jit", "core.quantities", "io.channels", "io.dataset", "rig"}
    modules = set()
    for file in Path(experiments.testrig.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                modules |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and file.name != "other_rigs.py":
                modules.add(node.module or ".")
    used = {name.partition(".")[2] for name in modules if name.startswith("clearance_mj")}
    assert {name for name in used if not name.startswith("signals")} <= allowed


def test_linear_rig_has_the_frf_of_its_matrices(rig):
    """H = 1 - N (K - ω² M + iω C)⁻¹ (-ω²) M r with the grease as a spring and damper; a pulse that dies out."""
    linear = replace(Truth(), elastic_ratio=1.0, film_height=1e6, film_damping=12.0, drift=0.0, contact_stiffness=0.0)
    pulse = np.zeros(int(12 * FS))
    pulse[100:141] = scipy.signal.windows.hann(41)
    response = simulate_rig(rig, linear, Excitation(pulse, FS), 0)
    bins = np.arange(5 * 12, 220 * 12 + 1, 5)
    frf = np.fft.rfft(response.acceleration.T, axis=0)[bins] / np.fft.rfft(pulse)[bins, None]

    elements = FiniteElements.of_shaft(rig.beam, rig.point_masses)
    m, k = dense(elements.mass), dense(elements.stiffness)
    at = elements.points([b.position for b in rig.bushings]).dense(elements.count)
    sensors = elements.points([s.position for s in rig.sensors]).dense(elements.count)
    c = rig.beam.rayleigh[0] * m + rig.beam.rayleigh[1] * k + 12.0 * at.T @ at
    k, expected = k + linear.grease_stiffness * at.T @ at, np.empty_like(frf)
    for row, omega in zip(expected, 2 * np.pi * bins / 12):
        motion = np.linalg.solve(k - omega**2 * m + 1j * omega * c, -elements.inertia)
        row[:] = 1 - omega**2 * sensors @ motion
    error = np.abs(frf - expected) / np.abs(expected).max(axis=0)
    assert error.max() < 1.5e-3 and np.sqrt(np.mean(error**2)) < 2e-4


def test_a_force_moves_the_shaft_statically_as_far_as_a_spring(rig):
    """A slow force at the tip: deflection F l³/(3 EI) without bushings' forces."""
    free = replace(Truth(), grease_stiffness=0.0, film_damping=0.0, contact_stiffness=0.0)
    shaker, beam = replace(rig.shaker, kind="force", position=1.0), replace(rig.beam, rayleigh=(30.0, 1e-4))
    rig = rig.replace(shaker=shaker, beam=beam)
    response = simulate_rig(rig, free, Excitation(0.05 * np.clip(np.arange(4 * FS) / FS, 0, 1), FS, kind="force"), 0)
    at = rig.bushings[1].position
    expected = 0.05 * at**2 * (3 - at) / (6 * rig.beam.bending_stiffness)
    assert response.displacement[1, -200] == pytest.approx(expected, rel=2e-3) and response.reference == "200:+Z"


def test_response_is_complete(runs):
    response, n = runs[0.3], int(2 * FS)
    assert response.acceleration.shape == (8, n)
    assert response.displacement.shape == response.contact_force.shape == response.grease_force.shape == (2, n)
    assert response.responses == tuple(f"{i}:+Z" for i in range(1, 9)) and response.band == (5.0, 220.0)
    assert "synthetic" in response.provenance["source"]


def test_contact_grows_with_the_level(runs):
    fractions = {level: run.provenance["contact_fraction"] for level, run in runs.items()}
    assert fractions[0.3] == [0.0, 0.0] and fractions[2.0][1] >= 0.15 and fractions[5.0][1] >= 0.40


def test_peaks_stay_visible(runs):
    assert coherence(runs[1.0]) >= 0.9 and coherence(runs[5.0]) >= 0.6


def test_force_needs_a_shaker(rig):
    with pytest.raises(ExcitationError, match=r"shaker\.position"):
        simulate_rig(rig, Truth(), Excitation(np.ones(10), FS, kind="force"), 0)


def test_same_seed_same_bits_in_any_thread(rig):
    with ThreadPoolExecutor(2) as pool:
        first, second, other = pool.map(lambda seed: shaken(rig, 2.0, 0.5, seed), (1, 1, 2))
    for name in ("acceleration", "displacement", "contact_force", "grease_force"):
        assert np.array_equal(getattr(first, name), getattr(second, name))
    assert not np.array_equal(first.acceleration, other.acceleration)


def test_each_bushing_may_be_different(rig):
    """One truth serves all bushings; with one each, a bushing without grease and contact gives no force."""
    shake = excitation.random(0.5, FS, (5.0, 220.0), rms=8.0, seed=3, kind="base")
    greased, empty = Truth(), replace(Truth(), grease_stiffness=0.0, film_damping=0.0, contact_stiffness=0.0)
    for_all, one_each = (simulate_rig(rig, truth, shake, 1) for truth in (greased, (greased, greased)))
    assert np.array_equal(for_all.acceleration, one_each.acceleration)
    unlike = simulate_rig(rig, (greased, empty), shake, 1)
    assert np.abs(unlike.grease_force[0]).max() > 0.1
    assert not unlike.grease_force[1].any() and not unlike.contact_force[1].any()


@pytest.mark.parametrize("name", ["iwan", "lugre", "mixed"])
def test_other_rigs_are_free_at_the_lowest_level_and_touch_at_the_highest(name):
    virtual = RIGS[name]()
    for level, touching in ((0.3, False), (8.0, True)):
        shake = excitation.random(2.0, FS, (5.0, 220.0), rms=level, seed=6, kind="base")
        fractions = simulate_rig(virtual.rig, virtual.truth, shake, 1).provenance["contact_fraction"]
        assert (min(fractions) > 0.02) if touching else (max(fractions) < 0.02)
