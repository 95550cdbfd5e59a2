"""Files that a rig's structure is read from, in the rig's plain data."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..core.errors import RigError
from ..structure import Structure
from ..structure.files import content

__all__ = ["digest", "with_files"]


def digest(name: str) -> str:
    """Return the digest of a file's content."""
    try:
        return content([name], None)
    except OSError as error:
        raise RigError(f"{name}: cannot be read ({error.strerror})") from None


def with_files(data: dict[str, Any], named: Callable[[str], str]) -> dict[str, Any]:
    """Return plain data of a rig with other names of the files that its structure is read from."""
    structure = data.get("structure") if isinstance(data, dict) else None
    kind = str(structure.get("kind")) if isinstance(structure, dict) else ""
    if structure is None or kind not in Structure.known:
        return data
    files = Structure.known[kind].files
    names = {field: named(structure[field]) for field in files if isinstance(structure.get(field), str)}
    return data | {"structure": structure | names}
