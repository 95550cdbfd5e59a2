"""Published records, which are not part of the project, and the experiments that read them."""

from pathlib import Path

import pytest

from experiments.real.records import real_folder


@pytest.fixture(scope="session")
def real_data() -> Path:
    """The folder of the records, or skip."""
    folder = real_folder() or (Path(__file__).parents[3] / "shared" / "data" / "real")
    if not folder.is_dir():
        pytest.skip("published records are missing: name their folder in CLEARANCE_REAL_DATA (README tells the source)")
    return folder
