"""Title of each item, what the article says of it, and what differs here: ``texts.toml``."""

from __future__ import annotations

import functools
import tomllib
from pathlib import Path

__all__ = ["texts"]


@functools.cache
def _read() -> dict[str, dict[str, str]]:
    return tomllib.loads(Path(__file__).with_name("texts.toml").read_text(encoding="utf-8"))


def texts(name: str) -> dict[str, str]:
    """Return title, article and differs, as `Result` takes them.

    Parameters
    ----------
    name : str
        The item.
    """
    return _read()[name]
