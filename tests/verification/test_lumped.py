"""Published cases run as structures by the engine ``modal``: lumped ones of kind "matrices", a beam of kind "shaft".

code_aster validation manual V5.01.108 (SDND108b) and V5.01.101 (SDND101); the two masses with a one-sided spring are an
example of NLvib 1.3 (Krack & Gross, Harmonic Balance for Nonlinear Vibration Problems, Springer 2019), whose shooting
method found the periodic responses in Octave 7.3.
"""

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj import Bushing, Contact, Grease, Modal, Rig, Sensor, Shaker
from clearance_mj.clearance.contacts.kelvin_voigt import KelvinVoigt
from clearance_mj.structure import Material, Matrices, Section, Shaft, Support


def lumped(mass, stiffness, bushing, excited="base", sensor="1:Z", **more):
    dofs = [f"{i}:Z" for i in range(1, len(mass) + 1)]
    structure = Matrices(mass=mass, stiffness=stiffness, dofs=dofs, units="m-kg-s", **more)
    return Rig("lumped", None, (bushing,), (Sensor(1, sensor),), structure=structure, shaker=Shaker(excited, sensor))


def wall(gap, stiffness, damping=0.0, **more):
    return Bushing("1:Z", gap, 0.0, Grease(0.0), Contact(stiffness, damping), **more)


def march(rig, law, excitation, step):
    """Acceleration of the sensor, displacement and contact force in the clearance after each step."""
    out = Modal(modes=len(rig.structure.mass)).start(rig, law, rig.shaker.kind, step).advance(excitation)
    return out[:, 0], out[:, 1], out[:, 2]


@pytest.mark.parametrize("omega, amplitude, start, tolerance", [
    (0.8, 0.0706091893, 1, 3e-6), (0.579294894, 0.621351468, 1, 3e-6), (0.651757038, 0.695145236, 1, 3e-5),
    (0.70696328, 0.796058546, 4, 3e-5), (0.727763345, 0.860909605, 4, 3e-5),
])  # fmt: skip
def test_two_masses_with_a_one_sided_spring(measured, omega, amplitude, start, tolerance):
    """Stable responses of two unit masses, free of the spring and against it, after 500 periods."""
    stiffness = np.array([[1.0, -1.0], [-1.0, 2.0]])
    rig = lumped(np.eye(2), stiffness, wall(1.0, 100.0, stops="upper"), "force", "2:Z", damping=0.03 * stiffness)
    count = 1600
    k = np.arange(500 * count)
    force = 0.1 * np.cos(2 * np.pi * k / count) * np.where(k < 60 * count, start, 1.0)
    acceleration, _, _ = march(rig, cm.ConstantLaw(100.0, 0.0), force, 2 * np.pi / (omega * count))
    last = acceleration[-20 * count :] * np.exp(-2j * np.pi * np.arange(20 * count) / count)
    computed = 2 * abs(last.mean()) / omega**2
    what = f"Two masses, one-sided spring: amplitude at {omega} 1/s (m)"
    measured.equal(what, computed, amplitude, "NLvib 1.3", rel=tolerance)


def test_sdnd101_mass_and_spring_hit_a_stop(measured):
    """100 kg on 1e4 N/m thrown at 1 m/s against a stop of 1e6 N/m that it touches: F_max = K v/ω, π/ω, 2 K v/ω²."""
    h = 1e-5
    rig = lumped([[100.0]], [[1e4]], wall(1.0, 1e6, stops="upper", offset=1 - 1e-12), "force")
    push = np.zeros(50_000)
    push[0] = 100.0 / h
    force = march(rig, cm.ConstantLaw(1e6, 0.0), push, h)[2]
    edges = np.flatnonzero(np.diff(force > 0))
    second = force[edges[2] + 1 : edges[3] + 1]
    source = "code_aster V5.01.101"
    measured.equal("SDND101 as matrices: largest force (N)", second.max(), 9950.0, source, rel=1e-4)
    measured.equal("SDND101 as matrices: duration of a shock (s)", second.size * h, 0.03126, source, abs=2e-5)
    measured.equal("SDND101 as matrices: impulse (N s)", second.sum() * h, 198.02, source, rel=1e-4)


def test_sdnd108b_mass_bounces_off_a_damped_support(measured):
    """1 kg falls at 10 m/s² on 100 N/m and 5 N s/m, which holds on until the mass is back at its height, z = -2 m.

    It falls from z = 0 with 1 m/s downwards: from rest 0.1 s earlier and 0.05 m higher.
    """
    h = 2e-6  # an impact is met up to half a step late
    law = cm.ContactLaw(KelvinVoigt(100.0, 5.0, adhesion=True))
    rig = lumped([[1.0]], [[0.0]], wall(2.05, 100.0, 5.0, stops="lower"))
    pull = np.full(600_001, 10.0)
    pull[0] /= 2  # a step's kick acts around its instant, and the base moves from then on
    _, place, force = march(rig, law, pull, h)
    source = "code_aster V5.01.108"
    lift_off = (np.flatnonzero(force)[-1] + 0.5) * h - 0.1
    measured.equal("SDND108b as matrices: lift-off (s)", lift_off, 0.92403882542, source, abs=h)
    for end, expected in ((1.0, -1.88214079833), (1.1, -1.81496422497)):
        height = 0.05 + place[round((end + 0.1) / h)]
        measured.equal(f"SDND108b as matrices: height at {end:g} s (m)", height, expected, source, abs=2e-6)


def test_sdnl104_beam_hits_an_elastic_stop(measured):
    """A clamped beam under a step of -1000 N at its tip, which stops of 1e8 N/m hold after 0.1 mm.

    The reference has ten elements and Newmark's scheme at 1e-4 s, and its figures depend on both. Ours moves by 0.1 %
    between 10 and 40 modes and steps of 1e-4 and 2e-6 s, and differs by 0.8 %.
    """
    h, steel = 1e-5, Material(1e10, 1e6)
    shaft = Shaft((Section(1.0, diameter=0.2),), (Support(0.0, "clamped"),), material=steel, theory="euler")
    stop = Bushing(1.0, 1e-4, 0.0, Grease(0.0), Contact(1e8, 0.0))
    rig = Rig("SDNL104", None, (stop,), (Sensor(1, 1.0),), structure=shaft, shaker=Shaker("force", 1.0))
    push = np.full(16_001, -1000.0)
    push[0] /= 2
    place = Modal(modes=20).start(rig, cm.ConstantLaw(1e8, 0.0), "force", h).advance(push)[:, 1]
    measured.equal("SDNL104 as shaft: tip at 0.1315 s (m)", place[13150], -1.85334e-6, "code_aster V5.02.104", rel=0.01)
