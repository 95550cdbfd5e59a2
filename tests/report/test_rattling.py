"""The page of an identified model says of a gap that no record shows that it was not seen, and predicts nothing."""

import numpy as np

from clearance_mj import Dataset, Model
from clearance_mj.identify import Identified
from clearance_mj.report import ReportWriter
from clearance_mj.report.rattling import rattling_section

from ..conftest import record_of


def test_gaps_that_were_never_used_up(tmp_path, rig):
    """How far the shaft came is the largest size of the probes' readings, a part of the rig file's gap."""
    quiet = record_of(rig, "quiet", "identify", 0.3, 3)
    page = rattling_section(Identified(model=Model(rig)), Dataset(rig, (quiet,)), ReportWriter(tmp_path, False))
    far = 1e3 * np.abs(quiet.response().displacement).max(axis=1)
    assert np.all(far < 0.2)
    for j, reach in enumerate(far):
        assert f"The gap of bushings[{j}] was not seen: it is larger than {reach:.2g} mm" in page
    assert "0.3 mm is the rig file’s number" in page
    assert "touches from" not in page and not (tmp_path / "figures").exists()
