"""The engines that are verified: the package's, and modes in MuJoCo beside them."""

import pytest

from . import modal_mj


@pytest.fixture(params=["links", "modal", modal_mj.ModalMujoco.name])
def engine(request) -> str:
    """Name of an engine."""
    return request.param
