"""What laws make of harmonic cycles, against closed forms and quadrature."""

import dataclasses

import numpy as np
import scipy.integrate

from clearance_mj.clearance import AmplitudeLaw, ConstantLaw, ContactLaw, HuntCrossley, KelvinVoigt
from clearance_mj.clearance.cycle import cycle_force, equivalent_contact, fill_forces
from clearance_mj.clearance.kernel import clearance_records
from clearance_mj.rig import Grease

GAP = 3e-4


def test_a_cycle_of_springs_and_dampers_is_the_closed_form(rig):
    """x = A sin ωt: grease k x + c ẋ, and beyond the gap the contact's k (x - d) + c ẋ, which never pulls."""
    bushings = [dataclasses.replace(b, gap=GAP) for b in rig.bushings]
    law, omega = ConstantLaw([6e3, 8e3], 12.0, grease=Grease(stiffness=4e3, damping=5.0)), 2 * np.pi * 20
    x, force = cycle_force(rig.replace(bushings=tuple(bushings)), law, np.array([2 * GAP, 0.5 * GAP]), 20.0)
    phase = np.linspace(0, 2 * np.pi, x.shape[1])
    v = omega * np.array([[2 * GAP], [0.5 * GAP]]) * np.cos(phase)
    np.testing.assert_allclose(x[1], 0.5 * GAP * np.sin(phase), atol=1e-12)
    np.testing.assert_allclose(force[1], 4e3 * x[1] + 5 * v[1], atol=1e-9)
    depth, inwards = np.abs(x[0]) - GAP, np.sign(x[0]) * v[0]
    contact = np.where(depth > 0, np.maximum(6e3 * depth + 12 * inwards, 0), 0)
    np.testing.assert_allclose(force[0], 4e3 * x[0] + 5 * v[0] + np.sign(x[0]) * contact, atol=1e-9)


def test_a_law_over_amplitude_is_its_table():
    law = AmplitudeLaw([1e-4, 3e-4], [[1e3, 2e3], [3e3, 6e3]], [1.0, 5.0])
    k, c = law.over_amplitude([GAP, GAP], np.array([5e-5, 2e-4, 9e-4]), np.array([60.0, 60.0]))
    np.testing.assert_allclose(k, [[1e3, 2e3], [2e3, 4e3], [3e3, 6e3]])
    np.testing.assert_allclose(c, [[1, 1], [3, 3], [5, 5]])


def test_a_contact_that_may_pull_is_its_own_equivalent():
    k, c = equivalent_contact([KelvinVoigt(7800.0, 4.0, adhesion=True)], [GAP], [0.9 * GAP, 2 * GAP], [60.0])
    np.testing.assert_allclose(k.ravel(), [np.nan, 7800.0], rtol=1e-9)
    np.testing.assert_allclose(c.ravel(), [np.nan, 4.0], rtol=1e-9)


def test_elastic_hertz_contact_by_quadrature(measured):
    """Without damping k = ∫K δ^2.5 dφ / ∫δ² dφ over the part of the cycle in contact."""
    stiffness, amplitudes = 2.5e5, np.array([1.2, 2.0, 4.0]) * GAP
    k, c = equivalent_contact([HuntCrossley(stiffness, 1.0)], [GAP], amplitudes, [60.0])

    def mean(power, a):
        return scipy.integrate.quad(lambda p: (a * np.cos(p) - GAP) ** power, 0, np.arccos(GAP / a))[0]

    expected = [stiffness * mean(2.5, a) / mean(2, a) for a in amplitudes]
    for amplitude, found, known in zip(amplitudes, k.ravel(), expected):
        what = f"equivalent stiffness of Hertz contact, amplitude {amplitude / GAP:g} gaps (N/m)"
        measured.equal(what, found, known, "∫K δ^2.5 dφ / ∫δ² dφ by quadrature", rel=1e-4)
    np.testing.assert_allclose(c.ravel(), 0, atol=1e-9)


def test_a_contact_that_changes_the_wall_within_a_step_begins_anew(rig):
    """The second contact is damped by the speed at which it began, 0.2 m/s, not by that of the first one, 1 m/s."""
    bushings = [dataclasses.replace(b, gap=GAP) for b in rig.bushings]
    contact = HuntCrossley(2.5e5, 0.6)
    law = ContactLaw(contact, grease=Grease(0.0))
    x, v = (np.broadcast_to(each, (2, 3, 3)).copy() for each in ([0.0, 2 * GAP, -2 * GAP], [0.0, 1.0, -0.2]))
    force = np.zeros((2, 3))
    fill_forces(x, v, clearance_records(rig.replace(bushings=tuple(bushings)), law, 1e-4), force)
    known = [0.0, contact.force(GAP, 1.0, 1.0), -contact.force(GAP, 0.2, 0.2)]
    np.testing.assert_allclose(force, [known, known], rtol=1e-12)
