"""Outputs of a case on structures of few modes, against the eigenvalues of their matrices."""

import numpy as np
import pytest
import scipy.linalg

from clearance_mj import ConstantLaw, simulate
from clearance_mj.core.runner import Runner
from clearance_mj.rig import Rig, Spin, Unbalance
from clearance_mj.statistics import contact_statistics
from clearance_mj.sweep import run_sweep
from clearance_mj.sweep.case import linear_frequencies, windows_around_modes

from ..structures import GREASE, MASS, STIFFNESS, chain
from .plans import EXCITATION, OUTPUTS, RIG, loaded, text, varied


def test_a_structure_of_fewer_modes_than_are_asked_for():
    """Three masses on the springs of structure and grease: three frequencies, and three peaks up to the band's end."""
    between = np.array([-1.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    stiffness = STIFFNESS + GREASE.stiffness * sum(np.outer(row, row) for row in between)
    known = np.sqrt(scipy.linalg.eigvalsh(stiffness, MASS)) / (2 * np.pi)
    np.testing.assert_allclose(linear_frequencies(chain(), ConstantLaw(8e3, 5.0), 4), [*known, np.nan], rtol=1e-9)
    windows = windows_around_modes(chain(), 4, (5.0, 220.0))
    assert len(windows) == 3 and windows[0][0] == 5.0 and windows[-1][1] == 220.0
    assert all(low < f < high for (low, high), f in zip(windows, known))
    assert windows[1][1] == pytest.approx(np.sqrt(known[1] * known[2]))


def test_a_sweep_in_space_has_a_number_for_each_bushing(tmp_path):
    """RMS of the displacement along both directions together, and of how much of the time it touches."""
    spatial = Rig.load(RIG).with_shape("round").replace(spin=Spin(50.0), unbalances=(Unbalance(0.5, 1e-3),))
    spatial.save(tmp_path / "rotor.toml")
    tables = EXCITATION, '[design]\nmethod = "grid"\n', OUTPUTS, varied("rig.spin.speed", [50.0, 70.0])
    head = 'engine = { name = "modal", modes = 4 }'
    plan = loaded(tmp_path, text(*tables, head=head, rig=tmp_path / "rotor.toml"))
    swept = run_sweep(plan, tmp_path / "out", Runner(1))
    rig, law, excitation = plan.case(1)
    response = simulate(rig, excitation, law, plan.engine)
    y, z = response.displacement[::2], response.displacement[1::2]
    assert swept["displacement_rms"].shape == (2, 2)
    np.testing.assert_allclose(swept["displacement_rms"][1], np.hypot(y.std(axis=1), z.std(axis=1)), rtol=1e-9)
    np.testing.assert_array_equal(swept["contact_share"][1], response.contact_share)
    statistics = contact_statistics(response)
    np.testing.assert_allclose(statistics["displacement_peak"], np.hypot(y, z).max(axis=1), rtol=1e-12)
    force = np.hypot(response.contact_force[::2], response.contact_force[1::2])
    np.testing.assert_allclose(statistics["contact_peak"], force.max(axis=1), rtol=1e-12)
