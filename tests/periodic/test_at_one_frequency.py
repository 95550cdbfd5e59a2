"""Branches over the level that are followed in compiled code. Truth: the same followed by `Follower.onwards`."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import clearance_mj as cm
from clearance_mj.periodic.at_one_frequency import LevelSolver
from clearance_mj.periodic.continuation import Motions, NoConvergence, Solver
from clearance_mj.periodic.map_rows import solver_at

from ..conftest import TABLE1


@pytest.mark.parametrize("frequency, folds", [(11.0, True), (30.0, False), (45.0, True)])
def test_motions_are_those_that_are_followed_in_python(frequency, folds):
    """Step by step, as long as no step is lengthened for being beyond the level."""
    omega, most = 2 * np.pi * frequency, 60
    made = solver_at(cm.Model(TABLE1), "base", 1.0, omega, 13, 256, 8)
    python, compiled = (kind(made.system, made.harmonics, made.samples) for kind in (Solver, LevelSolver))
    for solver in (python, compiled):
        solver.tolerance, solver.bent, solver.longest = 1e-10, 0.01, 0.1
    motions = []
    with pytest.raises(NoConvergence):  # after so many steps
        for motion in python.onwards(python.growing(omega), 0.0, np.inf, most, 5e-3):
            motions.append(motion)
    known = Motions.of(motions)
    found = compiled.followed(compiled.growing(omega), most, 5e-3, 0.0, np.inf, np.inf)
    count = known.omega.size
    assert found.omega.size == count > most / 2
    assert bool(np.any(np.diff(known.omega) < 0)) is folds
    assert_allclose(found.omega, known.omega, rtol=1e-5)
    assert_allclose(found.z, known.z, atol=1e-5 * known.scale.max())
    assert_allclose(found.tangent, known.tangent, atol=1e-3)
