"""The fit of the grease looks at no model beyond the bounds of its parameters, where Bouc-Wen's march may overflow."""

import numpy as np
import pytest

from clearance_mj.identify.forces.restoring import restoring_force
from clearance_mj.identify.laws import grease

from ..conftest import record_of


@pytest.fixture
def looked_at(monkeypatch):
    """Yield displacement over the gap, γ/β and d/h of every model that a fit looks at."""
    cases, columns = [], grease._columns

    def watched(force, bushing, yield_, ratio, film):
        cases.append((yield_ / force.rig.bushings[bushing].gap, ratio, film))
        return columns(force, bushing, yield_, ratio, film)

    monkeypatch.setattr(grease, "_columns", watched)
    return cases


def test_differences_at_a_bound_stay_within_it(rig, looked_at):
    """Linear grease does not slide: the search for how it slides looks at the widest yield; k and c are the record's.

    Where it does not slide, its loop's shape costs nothing: which of the other bounds are looked at hangs on the last
    bits, but the search never looks beyond them.
    """
    fit = grease.grease_parameters(restoring_force(record_of(rig, "quiet", "identify", 0.3, 3)))
    yields, ratio, film = np.array([each for each in looked_at if np.isfinite(each[0])]).T
    assert yields.max() == pytest.approx(10.0, abs=1e-9) and ratio.max() <= 1.0 + 1e-9
    assert yields.min() >= 0.03 * (1 - 1e-12) and ratio.min() >= -0.9 and film.max() <= 0.9
    for filling in fit.grease:
        assert (filling.stiffness, filling.damping) == pytest.approx((4000.0, 5.0), rel=0.01)
    assert not any(np.isnan(estimates.std).any() for estimates in fit.estimates)


def test_a_march_that_overflows_is_no_model(rig, monkeypatch):
    """Where the state overflows the search goes elsewhere, and what was found has no NaN."""
    columns = grease._columns

    def overflowing(force, bushing, yield_, ratio, film):
        series = columns(force, bushing, yield_, ratio, film)
        return np.full_like(series, np.nan) if ratio < 0.0 else series

    monkeypatch.setattr(grease, "_columns", overflowing)
    for filling in grease.grease_parameters(restoring_force(record_of(rig, "quiet", "identify", 0.3, 3))).grease:
        assert (filling.stiffness, filling.damping) == pytest.approx((4000.0, 5.0), rel=0.01)
