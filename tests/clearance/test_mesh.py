"""The law of meshes with one or two pairs of teeth in contact."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from clearance_mj.clearance import ConstantLaw, mesh_law
from clearance_mj.core.errors import LawError
from clearance_mj.rig import Bushing, Contact, Grease, Rig, Sensor, Shaker, Spin
from clearance_mj.structure import Gears, Inertia

IDLER = Rig(
    "idler", None,
    (Bushing("1:X", 5e-5, 0.0, Grease(0.0), Contact(1e8, 300.0), to="2:X"),
     Bushing("2:RX", 1e-2, 0.0, Grease(0.0), Contact(1e4, 0.5), to="4:RX"),
     Bushing("3:X", 4e-5, 0.0, Grease(0.0), Contact(6e7, 200.0), to="2:X")),
    (Sensor(1, "1:X"),),
    structure=Gears((*(Inertia(i, 1e-3, 0.04) for i in (1, 2, 3)), Inertia(4, 1e-3))), shaker=Shaker("force", "1:RX"),
    spin=Spin(-80.0),
)  # fmt: skip


def test_pairs_in_contact():
    """Two pairs for the share ε - 1 of 2π/(z Ω), their mean the file's stiffness; what is no mesh stays."""
    law = mesh_law(IDLER, 20, (1.6, 1.4), (0.0, 0.25), rise=0.01)
    assert law.period == pytest.approx(2 * np.pi / (20 * 80.0))
    turn = (np.arange(20000) + 0.5) / 20000
    k = np.array([np.interp(turn * law.period, law.t, row, period=law.period) for row in law.k.T])
    for row, mean, ratio, phase in zip(k[[0, 2]], (1e8, 6e7), (1.6, 1.4), (0.0, 0.25)):
        assert_allclose([row.min(), row.max(), row.mean()], np.array([1, 2, ratio]) * mean / ratio, rtol=1e-4)
        double = (turn - phase) % 1 < ratio - 1
        far = np.abs((turn - phase + 0.5) % 1 - 0.5) > 0.005
        far &= np.abs((turn - phase - ratio + 1.5) % 1 - 0.5) > 0.005
        assert_allclose(row[far], np.where(double, 2, 1)[far] * mean / ratio, rtol=1e-12)
    assert np.all(k[1] == 1e4)
    assert_allclose(law.c, np.tile([300.0, 0.5, 200.0], (len(law.t), 1)))


def test_figures():
    """Over one period; cycles of gears without shafts need a frequency, as they have none of their own."""
    law = mesh_law(IDLER, 20, 1.5)
    drawn = law.plot(IDLER).axes[0].lines[0].get_xydata()
    assert drawn[0, 0] == 0.0 and drawn[-1, 0] == law.period and drawn[0, 1] == drawn[-1, 1]
    with pytest.raises(LawError, match="has no natural frequency in its gaps; give frequency, Hz, of the cycles"):
        ConstantLaw(1e8, 0.0).plot(IDLER)
    assert ConstantLaw(1e8, 0.0).plot(IDLER, frequency=50.0).axes


@pytest.mark.parametrize(("rig", "ratio", "words"), [
    (IDLER.replace(bushings=IDLER.bushings[1:2]), 1.5, "has no mesh: no clearance between two base circles"),
    (IDLER.replace(spin=None), 1.5, r"has no steady spin, rad/s, of the gear with 20 teeth: give \[spin\] its speed"),
    (IDLER.replace(spin=Spin(80.0, 5.0)), 1.5, "has no steady spin"),
    (IDLER, 2.1, r"contact_ratio must be between 1 \+ rise and 2 - rise, got 2.1 and rise 0.02"),
    (IDLER, (1.5, 1.0), "contact_ratio must be"),
])  # fmt: skip
def test_refusals(rig, ratio, words):
    with pytest.raises(LawError, match=words):
        mesh_law(rig, 20, ratio)
