"""What truncation costs, against closed forms: the cantilever's static deflection, and a contact on a spring."""

import dataclasses
import math

import pytest

from clearance_mj.structure import find_truncation
from clearance_mj.structure.beam import static_deflection

from ..conftest import TABLE1
from .test_modes import BEAM, DOFS, X, cantilever, residual, rig_of


@pytest.mark.parametrize("n", [3, 4, 6, 8, 12])
@pytest.mark.parametrize(("dof", "x"), [*zip(DOFS, X)])
def test_estimate_at_points_of_a_cantilever(n, dof, x):
    """What n closed-form modes leave of Roark's deflection (table 8.1, case 1a), within a factor of three."""
    rig = rig_of(cantilever(n))
    (truncation,) = find_truncation(rig.replace(bushings=(dataclasses.replace(rig.bushings[0], position=dof),)))
    exact = static_deflection(BEAM, [x], [x])[0, 0]
    assert truncation.kept + truncation.missing == pytest.approx(exact, rel=0.02)
    assert 1 / 3 < truncation.missing / (exact - truncation.kept) < 3
    assert truncation.stiffness_error == pytest.approx(7.8e3 * truncation.missing)


def test_nothing_is_missing_where_the_residual_flexibility_is_known():
    (truncation,) = find_truncation(rig_of(cantilever(4, residual_flexibility=residual(cantilever(4)))))
    assert truncation.missing == truncation.stiffness_error == 0
    assert truncation.kept + truncation.residual == pytest.approx(static_deflection(BEAM, [X[2]], [X[2]])[0, 0])


def test_two_modes_tell_nothing_of_the_others():
    (truncation,) = find_truncation(rig_of(cantilever(2)))
    assert math.isnan(truncation.missing)


def test_structures_with_static_shapes_lose_nothing():
    assert find_truncation(TABLE1) == ()
