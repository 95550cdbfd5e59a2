"""Laws read from files and plain data; `Law.save` and `Law.to_dict` write them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import LawError
from ..rig import Grease
from ..validation import from_plain
from .contact import CONTACTS
from .grease import GREASES
from .law import AmplitudeLaw, ConstantLaw, ContactLaw, Law, TimeLaw

__all__ = ["law_from_dict", "load_law"]

_KINDS: dict[str, type[Law]] = {law.kind: law for law in (ConstantLaw, TimeLaw, AmplitudeLaw, ContactLaw)}


def load_law(path: str | Path) -> Law:
    """Read a law that `Law.save` wrote.

    Parameters
    ----------
    path : str or Path
        JSON file.

    Raises
    ------
    LawError
        If the file is missing, not a law, or holds impossible values.
    """
    path = Path(path)
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise LawError(f"{path}: cannot be read ({error.strerror})") from None
    except (ValueError, RecursionError) as error:
        raise LawError(f"{path}: not a law file (JSON): {error}") from None
    try:
        return law_from_dict(data)
    except LawError as error:
        raise LawError(f"{path}: {error}") from None


def law_from_dict(data: dict[str, Any]) -> Law:
    """Build a law from the plain data that `Law.to_dict` returns.

    Parameters
    ----------
    data : dict
        Nested plain data.

    Raises
    ------
    LawError
        If it is not a law, or holds impossible values.
    """
    if not isinstance(data, dict) or str(data.get("kind")) not in _KINDS:
        raise LawError(f'not a law file; needs "kind" to be one of {", ".join(_KINDS)}')
    values = {name: value for name, value in data.items() if name != "kind"}
    kind = _KINDS[data["kind"]]
    try:
        known: dict[str, Mapping[str, type]] = {"grease": {"bouc-wen": Grease, **GREASES}, "contact": CONTACTS}
        for name, models in known.items():
            if values.get(name) is not None:
                default = "bouc-wen" if name == "grease" else None
                parts = enumerate(values[name])
                values[name] = tuple(_model(part, f"{name}[{i}]", models, default) for i, part in parts)
        return kind(**values)
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        raise LawError(f"not a whole law file of kind {kind.kind}: {error}") from None


def _model(data: object, where: str, models: Mapping[str, type], default: str | None) -> Any:
    """A contact or grease model out of plain data."""
    if not isinstance(data, Mapping):
        raise LawError(f"{where} must be a table of keys, got {data!r}")
    values = dict(data)
    name = values.pop("model", default)
    if not isinstance(name, str) or name not in models:
        raise LawError(f"{where}.model {name!r} is unknown; use {', '.join(models)}")
    return from_plain(models[name], values, where, LawError)
