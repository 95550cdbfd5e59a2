"""Orders of convergence in the time step. Of the loops against known answers, of the engines against their own limit.

Semi-implicit Euler (MuJoCo) is of first order, Strang splitting (modal) of second. A damped contact begins with a jump
of its force, which is of first order whatever the scheme.
"""

import numpy as np
import pytest

from clearance_mj import ConstantLaw, Excitation, Links, Modal, simulate

from .modal_mj import ModalMujoco
from .test_impact import RELEASED, FreeMass, damping, gap_oscillator, rebound, ring_down_error
from .test_two_gap_beam import DAMPING, EXCITATION, FS, RIG, STIFFNESS

STEPS = np.array([8e-3, 4e-3, 2e-3, 1e-3])
LAW = ConstantLaw(STIFFNESS, DAMPING)
FACTORS = np.array([8, 16, 32])  # Steps per sample at 8192 Hz


def order(steps, errors):
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


@pytest.mark.parametrize(("loop", "expected"), [("modal", 2), ("mujoco", 1)])
def test_grease(loop, expected, measured):
    slope = order(STEPS, [ring_down_error(loop, step) for step in STEPS])
    measured.equal(f"{loop} loop, ring-down in grease: order", slope, expected, "ODE solver at 1e-10", abs=0.1)


@pytest.mark.parametrize("loop", ["modal", "mujoco"])
def test_gap_oscillator(loop, measured):
    """Without damping both are of second order."""
    exact = 4 * (np.pi / 2 + 1)
    slope = order(STEPS, [abs(np.mean(gap_oscillator(loop, step)[0]) - exact) for step in STEPS])
    measured.equal(f"{loop} loop, period of the gap oscillator: order", slope, 2, "4[π/2 + 1/(X-1)]", abs=0.1)


@pytest.mark.parametrize("loop", ["modal", "mujoco"])
def test_damped_contact(loop, measured):
    masses = [FreeMass(loop, ConstantLaw(1.0, damping(0.3)), 1.0, step, 0.9, 0.5) for step in STEPS]
    errors = [abs(rebound(mass) / RELEASED[0.3] - 1) for mass in masses]
    what = f"{loop} loop, restitution of a Kelvin-Voigt contact, ζ = 0.3: order"
    measured.equal(what, order(STEPS, errors), 1, "closed form, release where the force is zero", abs=0.1)


ENGINES = {
    "links": (lambda setting: Links(safety=setting), 1),
    "modal": (lambda setting: Modal(resolution=setting), 2),
    "modal-mj": (lambda setting: ModalMujoco(safety=setting), 1),
}  # Each with its setting of the step, and its order


def engine_order(make, level):
    """From the changes of the bushings' displacements, 0.11 s from rest, when the step is halved."""
    excitation, halved = Excitation(level * EXCITATION.value, FS), []
    for factor in FACTORS:
        setting = 1 / (FS * factor * make(1.0).largest_step(RIG, LAW))
        response = simulate(RIG, excitation, LAW, make(setting * (1 + 1e-6)))
        assert response.provenance["step"] == pytest.approx(1 / (FS * factor))
        halved.append(response.displacement)
    assert response.contact_force.any() == (level == 1)
    return order(1 / FACTORS[1:], [np.std(a - b) for a, b in zip(halved, halved[1:])])


@pytest.mark.parametrize("name", ENGINES)
def test_engine_in_the_gap(name, measured):
    make, expected = ENGINES[name]
    slope = engine_order(make, 0.05)
    measured.equal(f"{name}, shaft inside its gaps: order", slope, expected, "the scheme's, steps halved", abs=0.05)


@pytest.mark.parametrize("name", ENGINES)
def test_engine_in_contact(name, measured):
    slope = engine_order(ENGINES[name][0], 1.0)
    measured.above(f"{name}, shaft hitting both bushings: order", slope, 0.9, "1 of the damped contact, steps halved")
