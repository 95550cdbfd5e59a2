"""Laws read from files and plain data; `Law.save` and `Law.to_dict` write them."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..core.errors import LawError
from ..core.files import plain_file
from ..core.validation import from_plain, json_schema
from ..rig import Grease
from .contact import CONTACTS
from .grease import GREASES
from .law import AmplitudeLaw, ConstantLaw, ContactLaw, Law, TimeLaw

__all__ = ["law_from_dict", "law_schema", "load_law"]

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
        return law_from_dict(json.loads(plain_file(path).read_text(encoding="utf-8")))
    except LawError as error:
        raise LawError(f"{path}: {error}") from None
    except OSError as error:
        raise LawError(f"{path}: cannot be read ({error.strerror})") from None
    except (ValueError, RecursionError) as error:
        raise LawError(f"{path}: not a law file (JSON): {error}") from None


def law_from_dict(data: dict[str, Any]) -> Law:
    """Build a law from the plain data that `Law.to_dict` returns; `LawError` if it is none."""
    if not isinstance(data, dict) or str(data.get("kind")) not in _KINDS:
        raise LawError(f'not a law file; needs "kind" to be one of {", ".join(_KINDS)}')
    values = {name: value for name, value in data.items() if name not in ("kind", "provenance")}
    kind = _KINDS[data["kind"]]
    try:
        known: dict[str, Mapping[str, type]] = {"grease": {"bouc-wen": Grease, **GREASES}, "contact": CONTACTS}
        for name, models in known.items():
            if values.get(name) is not None:
                if isinstance(values[name], Mapping):
                    raise LawError(f'"{name}" must be a list, of one model or one for each bushing')
                default = "bouc-wen" if name == "grease" else None
                parts = enumerate(values[name])
                values[name] = tuple(_model(part, f"{name}[{i}]", models, default) for i, part in parts)
        return kind(**values)
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        raise LawError(f"not a whole law file of kind {kind.kind}: {error}") from None


def _model(data: object, where: str, models: Mapping[str, type], default: str | None) -> Any:
    """Return a contact or grease model from plain data."""
    if not isinstance(data, Mapping):
        raise LawError(f"{where} must be a table of keys, got {data!r}")
    values = dict(data)
    name = values.pop("model", default)
    if not isinstance(name, str) or name not in models:
        raise LawError(f"{where}.model {name!r} is unknown; use {', '.join(models)}")
    return from_plain(models[name], values, where, LawError)


def law_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a law file, with every registered contact and grease model."""
    number = {"type": "number", "minimum": 0}
    table = {"type": "array", "minItems": 1, "items": {"anyOf": [number, {"type": "array", "items": number}]}}
    greases = [_model_schema(None, Grease), *(_model_schema(name, model) for name, model in GREASES.items())]
    contacts = [_model_schema(name, model) for name, model in CONTACTS.items()]
    parts = {
        "grease": {"anyOf": [{"type": "null"}, {"type": "array", "minItems": 1, "items": {"anyOf": greases}}]},
        "contact": {"type": "array", "minItems": 1, "items": {"anyOf": contacts}},
        "release": {"type": "number", "exclusiveMinimum": 0},
        "period": {"type": "number", "exclusiveMinimum": 0},
    }
    kinds = []
    for name, law in _KINDS.items():
        fields = dataclasses.fields(law)  # type: ignore[arg-type]
        properties: dict[str, Any] = {"kind": {"const": name}, "provenance": {"type": "object"}}
        properties |= {f.name: parts.get(f.name, table) for f in fields}
        required = ["kind", *(f.name for f in fields if f.default is dataclasses.MISSING)]
        kinds.append({"type": "object", "properties": properties, "required": required, "additionalProperties": False})
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "clearance_mj law", "oneOf": kinds}


def _model_schema(name: str | None, model: type) -> dict[str, Any]:
    """Return the schema of a model with its name; a rig's grease needs none."""
    schema = json_schema(model, name or "bouc-wen")
    schema["properties"]["model"] = {"const": name or "bouc-wen"}
    return schema | {"required": [*schema.get("required", []), *(["model"] if name else [])]}
