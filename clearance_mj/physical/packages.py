"""What is said when a package is missing that a part of this one needs."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from ..core.errors import ModelError

__all__ = ["naming_package"]


@contextlib.contextmanager
def naming_package(what: str, brings: str = "clearance-mj", of: str = "clearance_mj.physical") -> Iterator[None]:
    """Say what needs a package that is missing, and which distribution brings it.

    Raises
    ------
    ModelError
        Instead of a ModuleNotFoundError of another package.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        raise ModelError(
            f"{what} of {of} need the package {error.name}, which is not installed: pip install {brings} brings it"
        ) from error
