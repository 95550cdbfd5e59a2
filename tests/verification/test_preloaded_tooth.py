"""A tooth of a gear pair that a mean torque presses on its flank: x'' + 2ζ x' + f(x) = F_m + F_a cos ωt, ζ = 0.05.

f = x - 1, 0, x + 1 beyond, between and below ±1 (Kahraman & Singh, J. Sound Vib. 142, 1990). Extremes of its periodic
responses were joined from the closed form of each piece, by shooting with Newton's method to 1e-11. Nothing but the
tooth's contact, which has no damping, holds the mass, and everything has the units kg, m, s.
"""

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.rig import Bushing, Contact, Grease, Load, Rig, Sensor, Shaker
from clearance_mj.structure import Matrices

FS, MEAN = 200.0, 0.1
RAMP, DWELL = 30, 80  # periods from one frequency to the next, and there
TOOTH = Rig(
    "tooth", None, (Bushing("1:Z", 1.0, 0.0, Grease(0.0), Contact(1.0)),), (Sensor(1, "1:Z"),),
    structure=Matrices(mass=[[1.0]], stiffness=[[0.0]], damping=[[0.1]], dofs=["1:Z"], units="m-kg-s"),
    shaker=Shaker("force", "1:Z"), loads=(Load("1:Z", force=MEAN),),
)  # fmt: skip
SINGLE_SIDED = {
    1.2: (0.992652, 1.206746), 1.1: (0.951161, 1.237328), 1.0: (0.895288, 1.269254), 0.9: (0.816059, 1.305968),
    0.8: (0.700497, 1.350121), 0.7: (0.527276, 1.405209), 0.6: (0.261210, 1.476520), 0.5: (-0.140215, 1.571651),
}  # fmt: skip
"""Least and largest x over ω of the upper branch at F_a = 0.05, stable down to its fold at ω = 0.450539"""


def swept_down(amplitude, omegas):
    """Return the displacement of the last four periods at each of some falling frequencies, simulated as one record."""
    rate, ends = [np.zeros(0)], []
    for before, omega in zip((omegas[0], *omegas), omegas):
        period = 2 * np.pi / omega * FS
        rate += [np.linspace(before, omega, round(RAMP * period)), np.full(round(DWELL * period), omega)]
        ends.append((sum(map(len, rate)), round(4 * period)))
    force = amplitude * np.cos(np.cumsum(np.concatenate(rate)) / FS)
    x = cm.simulate(TOOTH, cm.Excitation(force, FS, "force"), engine="modal").displacement[0]
    return [x[end - length : end] for end, length in ends]


def test_upper_branch_of_single_sided_impacts(measured):
    for (omega, extremes), x in zip(SINGLE_SIDED.items(), swept_down(0.05, tuple(SINGLE_SIDED))):
        for what, extreme, expected in zip(("least", "largest"), (x.min(), x.max()), extremes):
            what = f"preloaded tooth, F_a = 0.05, ω = {omega}: {what} x"
            measured.equal(what, extreme, expected, "pieces in closed form, shooting", abs=1e-4)


@pytest.mark.parametrize(("amplitude", "omega"), [(0.05, 1.25), (0.05, 0.7), (0.2, 1.75)])
def test_no_impact(amplitude, omega):
    """Beside the mean 1 + F_m the linear amplitude, where it is below F_m: the lower branch too, begun from rest."""
    (x,) = swept_down(amplitude, (omega,))
    linear = amplitude / abs(1 - omega**2 + 0.1j * omega)
    assert linear < MEAN
    np.testing.assert_allclose((x.min(), x.max()), (1.1 - linear, 1.1 + linear), atol=1e-5)


def test_the_period_doubles(measured):
    """At F_a = 0.2 between ω = 1.605 and 1.600."""
    one, two = ([part.max() for part in np.array_split(x, 4)] for x in swept_down(0.2, (1.65, 1.55)))
    measured.below("preloaded tooth, F_a = 0.2, ω = 1.65: change from period to period", np.ptp(one), 1e-4, "period 1")
    assert np.ptp(two) > 0.01
    np.testing.assert_allclose(two[:2], two[2:], atol=1e-4)
