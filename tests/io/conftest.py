"""What tests of files share."""

import pytest

from clearance_mj import write_dataset

from .dataset_folders import RIG, channel, channels, record


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "rig one"
    hammer = [c for c in channels() if c.node != 100] + [channel(200, "force")]
    plain = {"level": None, "seed": None, "band": None, "provenance": {}}
    records = [record(), record("hammer", excitation_kind="force", channels=hammer, **plain),
               record("level-1", "validate", level=1.0)]  # fmt: skip
    write_dataset(path, RIG, records)
    return path


@pytest.fixture
def write(tmp_path):
    def write(data):
        path = tmp_path / "file.uff"
        path.write_bytes(data)
        return path

    return write
