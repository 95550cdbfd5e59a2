"""Forces of laws along motions: closed forms, quadrature, and a round clearance on a line, which is a slot."""

from types import SimpleNamespace

import numpy as np
import pytest
import scipy.integrate

from clearance_mj.clearance import AmplitudeLaw, ConstantLaw, ContactLaw, HuntCrossley, KelvinVoigt, TimeLaw
from clearance_mj.clearance.along import cycle_force, forces_along
from clearance_mj.clearance.harmonic import equivalent_contact
from clearance_mj.clearance.record import clearance_records
from clearance_mj.clearance.walls.oval import Oval
from clearance_mj.rig import Bushing, Contact, Friction, Grease

from ..engines.alike import with_bushings
from .laws import CONTACTS, FILLINGS, GAP

STEP = 1e-4


def bushing(**fields):
    return Bushing(0.5, GAP, 0.01, Grease(0.0), Contact(1e4), radius=0.01, **fields)


def along(bushing, law, x, v, spin=0.0):
    """Forces (n_t, d) of one bushing in a motion x, v (n_t, 3, d)."""
    return forces_along(clearance_records(SimpleNamespace(bushings=(bushing,)), law, STEP), 0, x, v, spin)


def on_a_line(n=3000):
    """A random motion (n, 3) of middle and ends along one direction, from the middle, and its velocity."""
    rng, time = np.random.default_rng(3), STEP * np.arange(n)
    x = np.zeros((n, 3))
    for frequency in rng.uniform(5, 60, 12):
        x += 2e-4 * rng.standard_normal(3) * np.sin(2 * np.pi * frequency * time + 6 * rng.random())[:, None]
    return x - x[0], np.gradient(x, STEP, axis=0)


@pytest.mark.parametrize("filling", FILLINGS, ids=lambda filling: type(filling).__name__)
@pytest.mark.parametrize("contact", CONTACTS, ids=lambda contact: contact.name)
def test_a_round_clearance_moved_on_a_line_is_a_slot(contact, filling):
    """Along z, and on a line at any angle, off the middle; friction does not act, since nothing slides."""
    law, (x, v) = ContactLaw(contact, filling), on_a_line()
    slot = along(bushing(offset=4e-5), law, x[..., None], v[..., None])[:, 0]
    assert np.abs(x[:, 1:]).max() > GAP
    for angle in (np.pi / 2, 0.7):
        to = np.array([np.cos(angle), np.sin(angle)])
        place = {"offset_y": 4e-5 * to[0], "offset": 4e-5 * to[1], "friction": Friction(0.2)}
        force = along(bushing(shape="round", **place), law, x[..., None] * to, v[..., None] * to)
        np.testing.assert_allclose(force, slot[:, None] * to, rtol=0, atol=1e-12 * np.abs(slot).max())


@pytest.mark.parametrize("law", [
    TimeLaw([0.0, 0.2], [1e4, 3e4], [3.0, 9.0], FILLINGS[1]),
    AmplitudeLaw([1e-4, 6e-4], [1e4, 3e4], [3.0, 9.0], grease=FILLINGS[2]),
], ids=lambda law: law.kind)  # fmt: skip
def test_laws_over_time_and_amplitude_on_a_line(law):
    x, v = (np.ascontiguousarray(each[..., None]) for each in on_a_line())
    slot, to = along(bushing(), law, x, v), np.array([0.6, 0.8])
    force = along(bushing(shape="round"), law, x * to, v * to)
    np.testing.assert_allclose(force, slot * to, rtol=0, atol=1e-12 * np.abs(slot).max())


def test_friction_of_a_slot_acts_across_its_coordinate():
    """On a shaft that turns it leaves the force along the slot as it is without friction."""
    law, (x, v) = ContactLaw(KelvinVoigt(2e4, 6.0)), on_a_line()
    slot = along(bushing(friction=Friction(0.2, stiffness=1e5, damping=0.1)), law, x[..., None], v[..., None], 30.0)
    still = along(bushing(), law, x[..., None], v[..., None], 30.0)
    np.testing.assert_allclose(slot, still, rtol=0, atol=1e-12 * np.abs(still).max())


def test_the_depth_in_an_oval_wall_is_the_distance_to_its_nearest_point(rng):
    """A polygon of a hundred thousand corners on the wall; inside of it the distance has the other sign."""
    wide, across, angle = 0.06 * GAP, -0.03 * GAP, np.linspace(0, 2 * np.pi, 100_001)
    radius = GAP + wide * np.cos(2 * angle) + across * np.sin(2 * angle)
    wall = np.stack((radius * np.cos(angle), radius * np.sin(angle)), axis=1)
    model, out = Oval(wide, across), [0.0] * 3
    for fraction, at in rng.uniform((0.6, 0.0), (1.6, 2 * np.pi), (200, 2)):
        r = fraction * GAP * np.array([np.cos(at), np.sin(at)])
        side, to = np.diff(wall, axis=0), r - wall[:-1]
        fraction = np.clip(np.sum(side * to, axis=1) / np.sum(side**2, axis=1), 0.0, 1.0)[:, None]
        away = to - fraction * side
        distance = np.hypot(*away.T)
        beyond = np.hypot(*r) > np.interp(at, angle, np.hypot(*wall.T))
        model.law(model.parameters(GAP), tuple(r.tolist()), out)
        assert out[0] == pytest.approx((1 if beyond else -1) * distance.min(), abs=1e-8 * GAP)
        np.testing.assert_allclose(out[0] * np.array(out[1:]), away[distance.argmin()], atol=1e-4 * GAP)
        assert np.hypot(*out[1:]) == pytest.approx(1.0, rel=1e-14)
    assert model.reach(GAP) == pytest.approx(np.hypot(*wall.T).min(), rel=1e-8)


def test_a_cycle_of_springs_and_dampers_is_the_closed_form(rig):
    """x = A sin ωt: grease k x + c ẋ, and beyond the gap the contact's k (x - d) + c ẋ, which never pulls."""
    law, omega = ConstantLaw([6e3, 8e3], 12.0, grease=Grease(stiffness=4e3, damping=5.0)), 2 * np.pi * 20
    x, force = cycle_force(with_bushings(rig, gap=GAP), law, np.array([2 * GAP, 0.5 * GAP]), 20.0)
    phase = np.linspace(0, 2 * np.pi, x.shape[1])
    v = omega * np.array([[2 * GAP], [0.5 * GAP]]) * np.cos(phase)
    np.testing.assert_allclose(x[1], 0.5 * GAP * np.sin(phase), atol=1e-12)
    depth, inwards = np.abs(x[0]) - GAP, np.sign(x[0]) * v[0]
    contact = np.where(depth > 0, np.maximum(6e3 * depth + 12 * inwards, 0), 0)
    np.testing.assert_allclose(force, 4e3 * x + 5 * v + [np.sign(x[0]) * contact, 0 * contact], atol=1e-9)


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

    for a, value in zip(amplitudes, k.ravel()):
        what = f"equivalent stiffness of Hertz contact, amplitude {a / GAP:g} gaps (N/m)"
        known = stiffness * mean(2.5, a) / mean(2, a)
        measured.equal(what, value, known, "∫K δ^2.5 dφ / ∫δ² dφ by quadrature", rel=1e-4)
    np.testing.assert_allclose(c.ravel(), 0, atol=1e-9)


def test_a_contact_that_changes_the_wall_within_a_step_begins_anew():
    """The second contact is damped by the speed at which it began, 0.2 m/s, not by that of the first one, 1 m/s."""
    contact = HuntCrossley(2.5e5, 0.6)
    x, v = (np.repeat(each, 3).reshape(3, 3, 1) for each in ([0.0, 2 * GAP, -2 * GAP], [0.0, 1.0, -0.2]))
    known = [0.0, contact.force(GAP, 1.0, 1.0), -contact.force(GAP, 0.2, 0.2)]
    np.testing.assert_allclose(along(bushing(), ContactLaw(contact, Grease(0.0)), x, v)[:, 0], known, rtol=1e-12)
