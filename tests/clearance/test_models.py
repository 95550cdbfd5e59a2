"""Contact and grease models in closed forms and beside independent implementations; engines in tests/verification."""

import dataclasses
import functools

import numpy as np
import pytest
import scipy.integrate
import scipy.optimize

from clearance_mj import clearance as models
from clearance_mj.clearance.along import forces_along
from clearance_mj.clearance.record import clearance_records
from clearance_mj.core.errors import LawError
from clearance_mj.rig import Bushing, Contact, Grease
from experiments.testrig import physics

from ..conftest import TABLE1

GAP = 3e-4
FIRST_ORDER = functools.partial(models.HuntCrossley, first_order=True)
HERTZ = models.HuntCrossley1975(3e5, 6.75e5)
CUBIC = models.Cubic(2e4, 5e11, 6.0)
IMPACT = models.AdamsImpact(4e6, 1.5, 40.0, 1e-4)
SLIP = models.MaxwellSlip((4000.0, 2000.0, 1000.0), (0.4, 0.6, 0.5), elastic=500.0, damping=3.0, film_height=8e-4)


def loop(law, x, v, grease=None, step=1e-4, **place):
    """Forces of contact and grease of one bushing along a motion of all its points, as compiled loops find them."""
    bushing = Bushing(0.5, GAP, 0.01, grease if isinstance(grease, Grease) else Grease(0.0), Contact(1.0), **place)
    rig, law = TABLE1.replace(bushings=(bushing,)), dataclasses.replace(law, grease=grease)
    moved = (np.repeat(each, 3).reshape(-1, 3, 1) for each in (x, v))
    return forces_along(clearance_records(rig, law, step), 0, *moved)[:, 0]


def motion(n=4000):
    phase = np.linspace(0, 6 * np.pi, n)
    return 4e-4 * np.sin(phase) + 2e-4 * np.sin(2.3 * phase), 0.03 * np.cos(phase) + 0.02 * np.cos(2.3 * phase)


def test_kelvin_voigt():
    """Eq. 10: k δ + c δ̇, no pull at release unless it adheres, nothing outside the contact."""
    contact = models.KelvinVoigt(2e4, 6.0)
    assert contact.force(1e-4, 0.05) == pytest.approx(2.0 + 0.3, rel=1e-14)
    assert contact.force(1e-4, -0.05) == pytest.approx(2.0 - 0.3, rel=1e-14)
    assert contact.force(1e-4, -0.5) == 0
    assert models.KelvinVoigt(2e4, 6.0, adhesion=True).force(1e-4, -0.5) == pytest.approx(-1.0, rel=1e-14)
    assert contact.force(-1e-4, 1.0) == 0
    assert models.KelvinVoigt(2e4, 6.0, adhesion=True).force(-1e-4, 1.0) == 0


@pytest.mark.parametrize(
    ("model", "kappa"), [(FIRST_ORDER, 0.45), (models.LankaraniNikravesh, 0.3825), (models.Flores, 0.48 / 0.7)]
)
def test_hertz_damped(model, kappa):
    """K δⁿ (1 + κ δ̇/v_i) with κ = 3(1-e)/2, 3(1-e²)/4, 8(1-e)/(5e) at e = 0.7 (physics.md, section 3)."""
    contact = model(1e6, 0.7)
    assert contact.kappa == pytest.approx(kappa, rel=1e-14)
    assert model(1e6, 1.0).kappa == 0
    hertz = 1e6 * (4e-4) ** 1.5
    assert contact.force(4e-4, 0.0, 0.2) == pytest.approx(hertz, rel=1e-14)
    assert contact.force(4e-4, 0.1, 0.2) == pytest.approx(hertz * (1 + kappa / 2), rel=1e-14)
    assert contact.force(4e-4, -0.1, 0.2) == pytest.approx(hertz * (1 - kappa / 2), rel=1e-14)
    assert contact.force(4e-4, -10.0, 0.2) == 0
    assert contact.force(-4e-4, 0.1, 0.2) == 0
    assert model(1e6, 0.7, exponent=1.0).force(4e-4, 0.1, 0.2) == pytest.approx(400 * (1 + kappa / 2), rel=1e-14)


def test_a_contact_without_impact_speed_stays_finite():
    assert FIRST_ORDER(1e6, 0.7).force(1e-4, 1e-6, 0.0) == pytest.approx(1.45, rel=1e-12)


def test_hunt_crossley_1975_is_the_test_rig_s_contact():
    """K δⁿ (1 + 1.5 α δ̇), whose λ is 1.5 α K; both ends together."""
    x, v = motion()
    expected = [physics.contact(a, b, GAP, 3e5, 1.5, 1.5)[0] for a, b in zip(x, v)]
    assert np.count_nonzero(expected) > 1000
    np.testing.assert_allclose(loop(models.ContactLaw(HERTZ), x, v), expected, rtol=1e-12, atol=1e-12)


def test_cubic():
    """k δ + k₃ δ³ + c δ̇, without pull; k₃ = 0 is Kelvin-Voigt's contact."""
    x, v = motion()
    side, depth = np.sign(x), np.maximum(np.abs(x) - GAP, 0)
    expected = np.where(depth > 0, side * np.maximum(2e4 * depth + 5e11 * depth**3 + 6.0 * side * v, 0), 0)
    assert np.any((depth > 0) & (expected == 0))
    np.testing.assert_allclose(loop(models.ContactLaw(CUBIC), x, v), expected, rtol=1e-12, atol=1e-12)
    linear = models.Cubic(2e4, 0.0, 6.0), models.KelvinVoigt(2e4, 6.0)
    np.testing.assert_array_equal(*(loop(models.ContactLaw(model), x, v) for model in linear))


def test_adams_impact():
    """k δᵉ + c_max s²(3 - 2s) δ̇ with s = δ/d up to 1: half of c_max at half of d, and no pull."""
    for depth, damping in ((2.5e-5, 40 * 10 / 64), (5e-5, 20.0), (1e-4, 40.0), (3e-4, 40.0)):
        spring = 4e6 * depth**1.5
        assert IMPACT.force(depth, 0.01) == pytest.approx(spring + damping * 0.01, rel=1e-13)
        assert IMPACT.force(depth, -0.01) == pytest.approx(spring - damping * 0.01, rel=1e-13)
    assert IMPACT.force(1e-4, -1.0) == IMPACT.force(-1e-4, 1.0) == 0
    assert models.AdamsImpact(2e4, 1.0, 6.0, 1e-9).force(1e-4, 0.05) == models.KelvinVoigt(2e4, 6.0).force(1e-4, 0.05)
    x, v = motion()
    side, depth = np.sign(x), np.maximum(np.abs(x) - GAP, 0)
    ramp = np.minimum(depth / 1e-4, 1)
    expected = side * np.maximum(4e6 * depth**1.5 + 40 * ramp**2 * (3 - 2 * ramp) * side * v, 0)
    np.testing.assert_allclose(loop(models.ContactLaw(IMPACT), x, v), expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("model", [HERTZ, CUBIC, IMPACT, models.KelvinVoigt(2e4, 6.0)], ids=lambda model: model.name)
def test_energy_is_the_integral_of_the_force(model):
    for depth in (1e-5, 3e-4, 1e-3):
        expected = scipy.integrate.quad(lambda d: model.force(d, 0.0, 1.0), 0, depth, epsrel=1e-11, epsabs=0)[0]
        assert model.energy(model.parameters(), depth) == pytest.approx(expected, rel=1e-9)


def rebound(model, mass, speed):
    """Speed off the wall over that into it, by an ODE solver that stops where the mass leaves."""

    def leaves(_, y):
        return y[0]

    leaves.terminal, leaves.direction = True, -1

    def rate(_, y):
        return y[1], -model.force(y[0], y[1], speed) / mass

    options = {"rtol": 1e-11, "atol": 1e-15, "max_step": 2e-4}
    return -scipy.integrate.solve_ivp(rate, (0, 1.0), (0.0, speed), events=leaves, **options).y[1, -1] / speed


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.2])
def test_restitution_of_hunt_crossley_1975(exponent, measured):
    """κ(1 + e) = ln[(1 + κ)/(1 - κe)], κ = λ v/K, for any exponent (Hunt & Crossley 1975); 1 - 2κ/3 for a slow one."""
    for ratio in (0.05, 0.6, 1.5):
        model = models.HuntCrossley1975(1e5, ratio * 1e5 / 0.2, exponent)
        top = min(1.0, (1 - 1e-12) / ratio)
        exact = scipy.optimize.brentq(lambda e, k=ratio: k * (1 + e) - np.log((1 + k) / (1 - k * e)), 1e-3, top)
        what = f"restitution, Hunt-Crossley 1975, λv/K = {ratio}, n = {exponent}"
        measured.equal(what, rebound(model, 1.0, 0.2), exact, "κ(1 + e) = ln[(1 + κ)/(1 - κe)]", rel=1e-6)
    slow = models.HuntCrossley1975(1e5, 1e3 / 0.2, exponent)
    assert rebound(slow, 1.0, 0.2) == pytest.approx(1 - 2 / 3 * 0.01, abs=1e-4)


def test_maxwell_slip_is_the_test_rig_s_iwan():
    """Elements of equal stiffness whose yields are evenly spread, with a squeeze film, at unlike steps."""
    n, largest, k, ratio, height = 12, 3e-4, 5200.0, 0.6, 6e-4
    yields = largest * (np.arange(n) + 0.5) / n
    spring = (1 - ratio) * k / n
    slip = models.MaxwellSlip((spring,) * n, tuple(spring * yields), ratio * k, 3.0, height, 0.2)
    x, v = motion(400)
    state, before, expected = np.zeros(n), 0.0, []
    for a, b in zip(x, v):
        z, _ = physics.iwan(a - before, state.copy(), yields, state)
        before = a
        expected.append(k * (ratio * a + (1 - ratio) * z) + physics.squeeze_film(a, b, 3.0, height, 0.2)[0])
    np.testing.assert_allclose(loop(models.ConstantLaw(0.0, 0.0), x, v, slip), expected, rtol=1e-10, atol=1e-12)


def test_friction_falls_with_speed():
    """In steady sliding Σ Wᵢ (1 + (r - 1) exp(-(v/v_s)²)); Iwan's force where no Stribeck speed is given."""
    grease = models.MaxwellSlip((4000.0, 2000.0, 1000.0), (0.4, 0.6, 0.5), static_ratio=1.5, stribeck_speed=0.02)
    for speed in (1e-4, 0.01, 0.02, 0.5):
        for side in (1, -1):
            x, v = side * np.linspace(0, 0.01, 2000), np.full(2000, side * speed)
            force = loop(models.ConstantLaw(0.0, 0.0), x, v, grease, step=0.01 / 1999 / speed)
            assert force[-1] == pytest.approx(side * 1.5 * (1 + 0.5 * np.exp(-((speed / 0.02) ** 2))), rel=1e-9)
    with pytest.raises(LawError, match="stribeck_speed is missing"):
        models.MaxwellSlip((4000.0,), (0.4,), static_ratio=1.5)


def test_maxwell_slip_loop(measured):
    """A cycle ± X loses 4 Wᵢ (X - Wᵢ/kᵢ) in each element that slides (Iwan 1966); at its end the force is known."""
    amplitude, turn = 6e-4, 2 * np.pi * 5
    time = np.arange(3 * 4000) / 4000 / 5
    x, v = amplitude * np.sin(turn * time), np.zeros(time.size)
    slip = models.MaxwellSlip(SLIP.springs, SLIP.forces, SLIP.elastic)
    force = loop(models.ConstantLaw(0.0, 0.0), x, v, slip, time[1])
    last = slice(2 * 4000 - 1, 3 * 4000)
    loss = np.sum((force[last][1:] + force[last][:-1]) / 2 * np.diff(x[last]))
    springs, forces = np.array(SLIP.springs), np.array(SLIP.forces)
    assert list(amplitude > forces / springs) == [True, True, True]
    exact = np.sum(4 * forces * (amplitude - forces / springs))
    measured.equal("Maxwell-slip loop: energy of a cycle, J", loss, exact, "Σ 4 Wᵢ (X - Wᵢ/kᵢ)", rel=1e-5)
    assert force.max() == pytest.approx(forces.sum() + 500.0 * amplitude, rel=1e-6)
    state, before, out, lost = [0.0] * 3, [0.0] * 3, [0.0, 0.0], 0.0
    for a, b in zip(x[1:], x[:-1]):
        before[:] = state
        slip.law(slip.parameters(), state, (a,), (a - b,), 0.0, time[1], out)
        slip.energy(slip.parameters(), before, state, (a,), (a - b,), out)
        stored, lost = out[0], lost + out[1]
    assert stored == pytest.approx(np.sum(np.square(state) * springs) / 2 + 250.0 * x[-1] ** 2, rel=1e-12)
    work = np.sum((force[1:] + force[:-1]) / 2 * np.diff(x))
    measured.equal("Maxwell-slip: work, J", work, lost + stored, "lost and stored", rel=1e-4)


def test_largest():
    """Tangent stiffness and damping at one gap of penetration; of grease before it slides, with the thinnest film."""
    assert HERTZ.largest(4e-4) == pytest.approx((1.5 * 3e5 * 0.02, 6.75e5 * 8e-6), rel=1e-14)
    assert IMPACT.largest(4e-4) == pytest.approx((1.5 * 4e6 * 0.02, 40.0), rel=1e-14)
    assert CUBIC.largest(1e-3) == pytest.approx((2e4 + 1.5e6, 6.0), rel=1e-14)
    assert SLIP.largest() == pytest.approx((7500.0, 75.0), rel=1e-14) and SLIP.small_motion() == (7500.0, 3.0)


@pytest.mark.parametrize(("make", "message"), [
    (lambda: models.KelvinVoigt(0.0, 1.0), "stiffness must be > 0, got 0"),
    (lambda: models.KelvinVoigt(float("nan")), "stiffness must be finite, got nan"),
    (lambda: models.KelvinVoigt(1e4, -1.0), "damping must be >= 0, got -1"),
    (lambda: models.HuntCrossley(-1.0, 0.5), "stiffness must be > 0, got -1"),
    (lambda: models.LankaraniNikravesh(1e4, 0.0), "restitution must be > 0, got 0"),
    (lambda: models.Flores(1e4, 1.2), "restitution must be <= 1, got 1.2"),
    (lambda: models.HuntCrossley(1e4, 0.5, 0.9), "exponent must be >= 1, got 0.9"),
    (lambda: models.KelvinVoigt(float("inf")), "stiffness must be finite, got inf"),
    (lambda: models.HuntCrossley1975(0.0), "stiffness must be > 0, got 0"),
    (lambda: models.HuntCrossley1975(1.0, -1.0), "damping must be >= 0, got -1"),
    (lambda: models.HuntCrossley1975(1.0, exponent=0.5), "exponent must be >= 1, got 0.5"),
    (lambda: models.AdamsImpact(1.0, 0.9, 1.0, 1.0), "exponent must be >= 1, got 0.9"),
    (lambda: models.AdamsImpact(1.0, 1.5, 1.0, 0.0), "depth must be > 0, got 0"),
    (lambda: models.Cubic(1.0, -1.0), "cubic must be >= 0, got -1"),
    (lambda: models.MaxwellSlip((), ()), "springs must hold 1 or more"),
    (lambda: models.MaxwellSlip((1.0, 2.0), (1.0,)), "forces must be 2 numbers, one for each spring, got 1"),
    (lambda: models.MaxwellSlip((1.0,), (0.0,)), r"forces\[0\] must be > 0, got 0"),
    (lambda: models.MaxwellSlip((1.0,), (1.0,), film_limit=2.0), "film_limit must be <= 1, got 2"),
])  # fmt: skip
def test_refusals(make, message):
    with pytest.raises(LawError, match=message):
        make()
