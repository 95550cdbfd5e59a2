"""Forces window by window are those of the whole record."""

import numpy as np
import pytest

from clearance_mj.identify.forces.restoring import SETTLE, restoring_force
from clearance_mj.identify.forces.windows import WindowForces
from clearance_mj.identify.records.prepared import prepared

from ..conftest import record_of


@pytest.fixture(scope="module")
def record(rig):
    return record_of(rig, "level", "identify", 5.0, 3, 8.0)


def test_windows_are_pieces_of_the_record(record):
    whole = restoring_force(record)
    windows = WindowForces(prepared(record), record.rig, {}, whole.noise, 2.0)
    assert len(windows) == 3
    for i, force in enumerate(windows):
        first = round(SETTLE * record.fs) + i * windows.step
        part = slice(first, first + windows.step)
        for name in ("displacement", "velocity", "force", "ends"):
            window, all_ = getattr(force, name)[..., force.valid], getattr(whole, name)[..., part]
            error = np.sqrt(np.mean((window - all_) ** 2) / np.mean(all_**2))
            assert error < 5e-3, (name, i)
        assert force.force_std == pytest.approx(whole.force_std, rel=0.1)
