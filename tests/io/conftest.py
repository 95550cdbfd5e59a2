"""What tests of files share."""

import pytest


@pytest.fixture
def write(tmp_path):
    def write(data):
        path = tmp_path / "file.uff"
        path.write_bytes(data)
        return path

    return write
