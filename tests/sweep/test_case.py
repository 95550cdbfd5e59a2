"""Outputs of a case on structures of few modes, against the eigenvalues of their matrices."""

import numpy as np
import pytest
import scipy.linalg

from clearance_mj.clearance import ConstantLaw
from clearance_mj.sweep.case import linear_frequencies, windows_around_modes

from ..structures import GREASE, MASS, STIFFNESS, chain


def test_a_structure_of_fewer_modes_than_are_asked_for():
    """Three masses on the springs of structure and grease: three frequencies, and three peaks up to the band's end."""
    between = np.array([-1.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    stiffness = STIFFNESS + GREASE.stiffness * sum(np.outer(row, row) for row in between)
    known = np.sqrt(scipy.linalg.eigvalsh(stiffness, MASS)) / (2 * np.pi)
    found = linear_frequencies(chain(), ConstantLaw(8e3, 5.0), 4)
    np.testing.assert_allclose(found, [*known, np.nan], rtol=1e-9)
    windows = windows_around_modes(chain(), 4, (5.0, 220.0))
    assert len(windows) == 3 and windows[0][0] == 5.0 and windows[-1][1] == 220.0
    assert all(low < f < high for (low, high), f in zip(windows, known))
    assert windows[1][1] == pytest.approx(np.sqrt(known[1] * known[2]))
