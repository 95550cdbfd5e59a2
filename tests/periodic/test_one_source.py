"""Branches over the level that are followed in compiled code. Truth: the same source run by Python."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import clearance_mj as cm
from clearance_mj.periodic.balance import deepest_penetration, residual
from clearance_mj.periodic.loops import loops
from clearance_mj.periodic.map_rows import solver_at

from ..conftest import TABLE1


@pytest.mark.parametrize("frequency, folds", [(11.0, True), (30.0, False), (45.0, True)])
def test_motions_are_those_that_are_followed_in_python(frequency, folds):
    omega, most, motions = 2 * np.pi * frequency, 60, []
    for made in (None, loops(residual, deepest_penetration, False)):
        solver = solver_at(cm.Model(TABLE1), "base", 1.0, omega, 13, 256, 8)
        solver.tolerance, solver.bent, solver.longest = 1e-10, 0.01, 0.1
        solver.loops = made or solver.loops
        motions.append(solver.followed(solver.growing(omega), most, 5e-3, (0.0, np.inf), np.inf, np.inf))
    compiled, known = motions
    assert compiled.parameter.size == known.parameter.size > most / 2
    assert bool(np.any(np.diff(known.parameter) < 0)) is folds
    assert_allclose(compiled.parameter, known.parameter, rtol=1e-5)
    assert_allclose(compiled.z, known.z, atol=1e-5 * known.scale.max())
    assert_allclose(compiled.tangent, known.tangent, atol=1e-3)
