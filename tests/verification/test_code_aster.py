"""Published cases of code_aster. They are run by the virtual rig's integrator.

Data: code_aster validation manual V5.02.104 (SDNL104), V5.01.108 (SDND108), V5.01.101 (SDND101) and the command
files of those tests (astest/sdnl104a.comm, sdnd108b.comm, sdnd101a.comm).
"""

import numpy as np

from clearance_mj.rig import Beam
from experiments.testrig import integrator
from experiments.testrig.bench import greases
from experiments.testrig.fem import FiniteElements, Points

from ..conftest import dense

NO_GREASE, NO_CONTACT = greases(()), integrator.Contacts(*np.zeros((5, 0)))


def masses(mass, stiffness, rayleigh=(0.0, 0.0)):
    """Four equal oscillators side by side, the smallest system of the banded solver; the first is the case."""
    bands = np.zeros((2, 4, 4))
    bands[:, 0] = np.array([[mass], [stiffness]])
    return FiniteElements(*bands, np.zeros(4), rayleigh, 1.0)


def test_sdnl104_beam_hits_an_elastic_stop(measured):
    """Ten elements, average acceleration at Δt = 1e-4 s: the scheme of the reference, whose figures depend on it."""
    elements = FiniteElements.of_shaft(Beam(1.0, 1e10, 1e6, diameter=0.2), elements=10)
    tip = elements.points([1.0])
    load = tip.dense(elements.count)[0]
    scheme = integrator.scheme(elements, load, tip, 1e-4)
    motion = integrator.at_rest(elements, load, tip, NO_GREASE, excitation=-1000.0)
    stop = integrator.Contacts(*np.array([[1e-4], [0.0], [1e8], [1.0], [0.0]]))
    place, speed = np.zeros(1601), np.zeros(1601)
    for i in range(1, 1601):
        assert integrator.step(scheme, motion, stop, NO_GREASE, -1000.0)
        place[i], speed[i] = motion.displacement[-2], motion.velocity[-2]
    source = "code_aster V5.02.104"
    measured.equal("SDNL104: tip at 0.1315 s (m)", place[1315], -1.85334e-6, source, rel=5e-6)
    measured.equal("SDNL104: tip's velocity at 0.1566 s (m/s)", speed[1566], -4.63284e-3, source, rel=5e-6)
    kinetic = motion.velocity @ dense(elements.mass) @ motion.velocity / 2
    measured.equal("SDNL104: kinetic energy at 0.16 s (J)", kinetic, 0.0514081, source, rel=5e-6)


def test_sdnd108b_mass_bounces_off_a_damped_support(measured):
    """Kelvin-Voigt support that holds on until the mass is back at its height: 1 kg, 100 N/m, 5 N s/m, 10 m/s².

    In contact the support is linear, C = 0.05 s K. The height is measured from the support, at z = -2 m.
    """
    fall = 0.54031242374
    elements, nowhere = masses(1.0, 100.0, (0.0, 0.05)), Points(np.zeros(0, dtype=np.int64), np.zeros((0, 4)))
    load, h = np.array([1.0, 0.0, 0.0, 0.0]), 1e-5
    scheme = integrator.scheme(elements, load, nowhere, h)
    motion = integrator.at_rest(elements, load, nowhere, NO_GREASE)
    motion.velocity[0] = -1.0 - 10.0 * fall
    motion.acceleration[0] = -10.0 - 5.0 * motion.velocity[0]
    states = [(fall, 0.0, motion.velocity[0])]
    while len(states) < 3 or states[-1][1] < 0:
        assert integrator.step(scheme, motion, NO_CONTACT, NO_GREASE, -10.0)
        states.append((states[-1][0] + h, motion.displacement[0], motion.velocity[0]))
    (_, low, _), (_, high, _) = states[-2:]
    fraction_of_step = low / (low - high)
    lift_off, _, speed = (a + fraction_of_step * (b - a) for a, b in zip(*states[-2:]))
    source = "code_aster V5.01.108"
    measured.equal("SDND108b: lift-off (s)", lift_off, 0.92403882542, source, abs=2e-9)
    for end, expected in ((1.0, -1.88214079833), (1.1, -1.81496422497)):
        height = -2.0 + speed * (end - lift_off) - 5.0 * (end - lift_off) ** 2
        measured.equal(f"SDND108b: height at {end:g} s (m)", height, expected, source, abs=1e-8)


def test_sdnd101_mass_and_spring_hit_a_stop(measured):
    """100 kg on 1e4 N/m thrown at 1 m/s against a stop of 1e6 N/m that it touches.

    ω = √((k + K)/m): F_max = K v/ω, duration π/ω, impulse 2 K v/ω². Our stops stand on both sides, so the origin is
    moved by the gap of 1 m, more than the mass swings.
    """
    first = Points(np.array([0]), np.array([[1.0, 0.0, 0.0, 0.0]]))
    elements, load, h = masses(100.0, 1e4), np.array([1e4, 0.0, 0.0, 0.0]), 1e-5
    scheme = integrator.scheme(elements, load, first, h)
    motion = integrator.at_rest(elements, load, first, NO_GREASE)
    motion.displacement[0], motion.velocity[0] = 1.0, 1.0
    stop = integrator.Contacts(*np.array([[1.0], [0.0], [1e6], [1.0], [0.0]]))
    force = np.zeros(50_000)
    for i in range(force.size):
        assert integrator.step(scheme, motion, stop, NO_GREASE, 1.0)
        force[i] = motion.force[0]
    # The second shock, whole within 0.5 s, as in the reference.
    edges = np.flatnonzero(np.diff(force > 0))
    second = force[edges[1] + 1 : edges[2] + 1]
    source = "code_aster V5.01.101"
    measured.equal("SDND101: largest force (N)", second.max(), 9950.0, source, rel=1e-4)
    measured.equal("SDND101: duration of a shock (s)", second.size * h, 0.03126, source, abs=2e-5)
    measured.equal("SDND101: impulse (N s)", second.sum() * h, 198.02, source, rel=1e-4)
    # Half a contact, half a swing of √(k/m) = 10 rad/s, and half a contact again: 0.361 s.
    peak = (edges[1] + 1 + second.argmax()) * h
    measured.equal("SDND101: instant of the second shock's peak (s)", peak, 0.361, source, abs=5e-4)
