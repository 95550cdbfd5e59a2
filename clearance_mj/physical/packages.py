"""Error message for a missing optional package."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from ..core.errors import ModelError

__all__ = ["naming_package"]


@contextlib.contextmanager
def naming_package(what: str, brings: str = "clearance-mj", of: str = "clearance_mj.physical") -> Iterator[None]:
    """Replace an import error by one that names what needs the package, and the distribution that brings it.

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
