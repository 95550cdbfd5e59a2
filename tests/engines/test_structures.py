"""Excitations and sensors at degrees of freedom of any direction, against the inverse of the dynamic stiffness."""

import numpy as np
import pytest

from clearance_mj.clearance import ConstantLaw
from clearance_mj.engines import simulate, simulate_batch
from clearance_mj.rig import AppliedForce, Bushing, Rig, Sensor, Shaker
from clearance_mj.signals.excitation import Excitation, random
from clearance_mj.signals.frf import estimate_frf
from clearance_mj.structure import Matrices

from ..structures import CONTACT, GREASE, chain

MASS = np.diag([0.5, 0.5, 0.3, 0.3])
DAMPING = np.array([[3.0, 0.5, -1.0, 0.0], [0.5, 4.0, 0.0, -1.0], [-1.0, 0.0, 2.0, 0.0], [0.0, -1.0, 0.0, 3.0]])
STIFFNESS = 1e3 * np.array([[9.0, 2, -3, 0], [2, 12, 1, -4], [-3, 1, 5, 1], [0, -4, 1, 7]])
DOFS = ("1:X", "1:Z", "2:X", "2:Z")
SENSED = np.array([[1.0, 0, 0, 0], [0, 0, 0, -1.0]])


def frame(shaker) -> Rig:
    """Two nodes that move along X and Z, and a clearance between them whose grease acts all the time."""
    structure = Matrices("m-kg-s", mass=MASS, stiffness=STIFFNESS, damping=DAMPING, dofs=DOFS)
    bushing = Bushing("2:+X", 0.1, 0.0, GREASE, CONTACT, to="1:+X")
    return Rig("frame", None, (bushing,), (Sensor(1, "1:+X"), Sensor(2, "2:-Z")), shaker=shaker, structure=structure)


TWICE = AppliedForce("2:+Z", 2.0)
SHAKERS = {
    "base": (Shaker(direction=(3.0, 0.0, 4.0)), MASS @ (-0.6, -0.8, -0.6, -0.8), np.array([0.6, -0.8]), "100:+Z"),
    "force": (Shaker("force", "1:-X", also=(TWICE,)), np.array([-1.0, 0, 0, 2.0]), np.zeros(2), "200:-X"),
}


@pytest.mark.parametrize("kind", SHAKERS)
def test_frfs_to_a_base_or_forces_in_any_direction(kind):
    shaker, load, on_base, reference = SHAKERS[kind]
    rig = frame(shaker)
    pulse = Excitation(np.where(np.arange(4096) // 8 == 20, 1.0, 0.0), 1024.0, kind)
    response = simulate(rig, pulse, ConstantLaw(8e3, 5.0), "modal")
    frf = estimate_frf(response, resolution=1.0)
    assert (frf.responses, frf.reference) == (("1:+X", "2:-Z"), reference)
    frequency = np.fft.rfftfreq(pulse.value.size, 1 / pulse.fs)
    near = (frequency > 3) & (frequency < 40)
    marched = np.fft.rfft(response.acceleration)[:, near] / np.fft.rfft(pulse.value)[near]
    omega = 2 * np.pi * frequency[near][:, None, None]
    between = np.outer((-1.0, 0, 1.0, 0), (-1.0, 0, 1.0, 0))
    stiffness, damping = STIFFNESS + GREASE.stiffness * between, DAMPING + GREASE.damping * between
    moved = np.linalg.solve(stiffness + 1j * omega * damping - omega**2 * MASS, load[:, None])[..., 0]
    known = (-(omega[:, 0] ** 2) * moved) @ SENSED.T + on_base
    assert np.all(np.abs(marched - known.T).max(axis=1) < 0.005 * np.abs(known).max(axis=0))


def test_a_batch_is_its_simulations():
    rig, excitations = chain(), [random(0.5, 1024.0, rms=rms, seed=2) for rms in (2.0, 6.0)]
    laws = [ConstantLaw(8e3, 5.0), ConstantLaw(2e4, 2.0)]
    for of_batch, excitation, law in zip(simulate_batch(rig, excitations, laws, "modal"), excitations, laws):
        alone = simulate(rig, excitation, law, "modal").displacement
        np.testing.assert_allclose(alone, of_batch.displacement, rtol=0, atol=1e-12)
