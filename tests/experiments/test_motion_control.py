"""Stiffness of a law's contact as a controller takes it."""

import pytest

from clearance_mj import AmplitudeLaw, ConstantLaw, ContactLaw, TimeLaw
from clearance_mj.clearance import HuntCrossley
from clearance_mj.core.errors import ManoeuvreError
from experiments.article.motion_control import secant_stiffness


@pytest.mark.parametrize(("law", "expected"), [
    (ConstantLaw(7e3, 1.0), 7e3),
    (TimeLaw([0.0, 1.0, 2.0], [6e3, 9e3, 6e3], [1.0, 1.0, 1.0]), 7e3),
    (ContactLaw(HuntCrossley(3e5, 0.5, 1.5)), 3e5 ** (2 / 3) * 1.6 ** (1 / 3)),
    (AmplitudeLaw([4e-4, 6e-4], [6e3, 10e3], [1.0, 1.0]), 8e3),
], ids=["constant", "mean over time", "Hertz", "amplitude"])  # fmt: skip
def test_secant_stiffness(rig, law, expected):
    """Under 1.6 N. Hertz: F = K δ^1.5, so F/δ = K^(2/3) F^(1/3). Amplitude: k(0.3 mm + 0.2 mm) = 8 kN/m, and so δ."""
    assert secant_stiffness(law, rig, 1, 1.6) == pytest.approx(expected, rel=1e-6)


def test_law_without_contact(rig):
    with pytest.raises(ManoeuvreError, match=r"contact at bushings\[1\] does not carry 2 N"):
        secant_stiffness(ConstantLaw(0.0, 0.0), rig, 1, 2.0)
