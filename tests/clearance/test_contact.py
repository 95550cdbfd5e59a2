"""Contact forces at single points; restitution is in verification/test_impact.py."""

import pytest

from clearance_mj.clearance import Flores, HuntCrossley, KelvinVoigt, LankaraniNikravesh
from clearance_mj.errors import LawError


def test_kelvin_voigt():
    """Eq. 10: k δ + c δ̇, no pull at release unless it adheres, nothing outside the contact."""
    contact = KelvinVoigt(2e4, 6.0)
    assert contact.force(1e-4, 0.05) == pytest.approx(2.0 + 0.3, rel=1e-14)
    assert contact.force(1e-4, -0.05) == pytest.approx(2.0 - 0.3, rel=1e-14)
    assert contact.force(1e-4, -0.5) == 0
    assert KelvinVoigt(2e4, 6.0, adhesion=True).force(1e-4, -0.5) == pytest.approx(-1.0, rel=1e-14)
    assert contact.force(-1e-4, 1.0) == 0
    assert KelvinVoigt(2e4, 6.0, adhesion=True).force(-1e-4, 1.0) == 0


@pytest.mark.parametrize(("model", "kappa"), [(HuntCrossley, 0.45), (LankaraniNikravesh, 0.3825), (Flores, 0.48 / 0.7)])
def test_hertz_damped(model, kappa):
    """K δⁿ (1 + κ δ̇/v_i) with κ = 3(1-e)/2, 3(1-e²)/4, 8(1-e)/(5e) at e = 0.7 (physics.md, section 3)."""
    contact = model(1e6, 0.7)
    assert contact.kappa == pytest.approx(kappa, rel=1e-14)
    hertz = 1e6 * (4e-4) ** 1.5
    assert contact.force(4e-4, 0.0, 0.2) == pytest.approx(hertz, rel=1e-14)
    assert contact.force(4e-4, 0.1, 0.2) == pytest.approx(hertz * (1 + kappa / 2), rel=1e-14)
    assert contact.force(4e-4, -0.1, 0.2) == pytest.approx(hertz * (1 - kappa / 2), rel=1e-14)
    assert contact.force(4e-4, -10.0, 0.2) == 0
    assert contact.force(-4e-4, 0.1, 0.2) == 0
    assert model(1e6, 0.7, exponent=1.0).force(4e-4, 0.1, 0.2) == pytest.approx(400 * (1 + kappa / 2), rel=1e-14)


@pytest.mark.parametrize("model", [HuntCrossley, LankaraniNikravesh, Flores])
def test_elastic(model):
    """e = 1 has no damping."""
    assert model(1e6, 1.0).kappa == 0


def test_a_contact_without_impact_speed_stays_finite():
    assert HuntCrossley(1e6, 0.7).force(1e-4, 1e-6, 0.0) == pytest.approx(1.45, rel=1e-12)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: KelvinVoigt(0.0, 1.0), "stiffness must be > 0, got 0"),
        (lambda: KelvinVoigt(float("nan")), "stiffness must be finite, got nan"),
        (lambda: KelvinVoigt(1e4, -1.0), "damping must be >= 0, got -1"),
        (lambda: HuntCrossley(-1.0, 0.5), "stiffness must be > 0, got -1"),
        (lambda: LankaraniNikravesh(1e4, 0.0), "restitution must be > 0, got 0"),
        (lambda: Flores(1e4, 1.2), "restitution must be <= 1, got 1.2"),
        (lambda: HuntCrossley(1e4, 0.5, 0.9), "exponent must be >= 1, got 0.9"),
        (lambda: KelvinVoigt(float("inf")), "stiffness must be finite, got inf"),
    ],
)
def test_refusals(make, message):
    with pytest.raises(LawError, match=rf"contact\.{message}"):
        make()
