"""Files that are whole or not there: written under a temporary name, then renamed. JSON that every reader takes."""

import json
import math
import os
import tempfile
from contextlib import contextmanager
from pathlib import Path

__all__ = ["replacing", "to_json"]


@contextmanager
def replacing(path):
    """Yield a temporary path beside ``path``; on success it takes the place of ``path``.

    Parameters
    ----------
    path : str or Path
        The file to write. Its folder is made if needed. If the block fails, the old file stays as it was.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o644)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def to_json(data) -> str:
    """Return plain data as JSON text, numbers that are not finite as null.

    Parameters
    ----------
    data : dict, list or number
        Nested plain data.
    """
    return json.dumps(_finite(data), indent=1, allow_nan=False) + "\n"


def _finite(data):
    if isinstance(data, dict):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data
