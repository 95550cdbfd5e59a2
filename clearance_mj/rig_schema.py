"""What a rig file may hold, as a JSON Schema for editors: types, keys and descriptions from the dataclasses of `rig`.

The schema knows the range of every value by itself. Rules between values, such as bushings that overlap, are checked by
`rig.Rig` alone.
"""

from __future__ import annotations

import ast
import dataclasses
import functools
import inspect
import textwrap
import types
import typing

from .rig import BASE_NODE, SHAKER_NODE, Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor, Shaker

__all__ = ["descriptions", "rig_schema"]

_TYPES = {float: {"type": "number"}, int: {"type": "integer"}, str: {"type": "string"}}
_POSITIVE, _NOT_NEGATIVE, _SHARE = {"exclusiveMinimum": 0}, {"minimum": 0}, {"minimum": 0, "maximum": 1}
_RANGES = {
    Beam: {name: _POSITIVE for name in ("length", "young_modulus", "density", "diameter", "width", "height")},
    PointMass: {"position": _POSITIVE, "mass": _POSITIVE},
    Grease: {
        "stiffness": _NOT_NEGATIVE,
        "damping": _NOT_NEGATIVE,
        "elastic_ratio": _SHARE,
        "amplitude": _POSITIVE,
        "beta": _NOT_NEGATIVE,
        "exponent": {"minimum": 1},
        "film_height": _POSITIVE,
        "film_limit": {"exclusiveMinimum": 0, "maximum": 1},
    },
    Contact: {"stiffness": _POSITIVE, "damping": _NOT_NEGATIVE},
    Bushing: {"position": _POSITIVE, "gap": _POSITIVE, "length": _POSITIVE},
    Sensor: {
        "node": {"minimum": 1, "maximum": 999_999_999, "not": {"enum": [BASE_NODE, SHAKER_NODE]}},
        "position": _POSITIVE,
        "mass": _NOT_NEGATIVE,
    },
    Shaker: {"position": _POSITIVE},
    Rig: {"name": {"minLength": 1}, "sensors": {"minItems": 1}},
}
_ITEMS = {Beam: {"rayleigh": _NOT_NEGATIVE}}
_RULES = {
    Beam: {
        "oneOf": [
            {"required": ["diameter"], "properties": {"width": False, "height": False}},
            {"required": ["width", "height"], "properties": {"diameter": False}},
        ]
    },
    Shaker: {
        "if": {"properties": {"kind": {"const": "force"}}, "required": ["kind"]},
        "then": {"required": ["position"]},
    },
}


def rig_schema() -> dict:
    """Return the JSON Schema (draft 2020-12) of a rig file.

    Returns
    -------
    dict
        Plain data.
    """
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "clearance_mj rig"}
    return head | _table(Rig)


@functools.cache
def descriptions(kind: type) -> dict[str, str]:
    """Return what a dataclass says of its fields: the strings that follow them.

    Parameters
    ----------
    kind : type
        A dataclass of `rig`.

    Returns
    -------
    dict of str
        By the field's name.
    """
    body = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0].body
    return {
        field.target.id: words.value.value.strip()
        for field, words in zip(body, body[1:])
        if isinstance(field, ast.AnnAssign) and isinstance(words, ast.Expr)
    }


def _table(kind) -> dict:
    """Schema of a table of keys."""
    hints, words, fields = typing.get_type_hints(kind), descriptions(kind), dataclasses.fields(kind)
    required = [f.name for f in fields if f.default is dataclasses.MISSING and f.default_factory is dataclasses.MISSING]
    properties = {f.name: {"description": words[f.name]} | _property(kind, f, hints[f.name]) for f in fields}
    table = {"type": "object", "description": inspect.getdoc(kind).partition("\n\n")[0].replace("\n", " ")}
    table |= {"properties": properties, "required": required, "additionalProperties": False}
    return table | _RULES.get(kind, {})


def _property(kind, field, hint) -> dict:
    schema = _value(hint, _ITEMS.get(kind, {}).get(field.name, {})) | _RANGES[kind].get(field.name, {})
    if field.default not in (dataclasses.MISSING, None):
        schema["default"] = list(field.default) if isinstance(field.default, tuple) else field.default
    return schema


def _value(hint, of_items) -> dict:
    """Schema of a type as `rig.from_plain` reads it."""
    origin, args = typing.get_origin(hint), typing.get_args(hint)
    if origin is types.UnionType:  # an optional field
        return _value(args[0], of_items)
    if origin is typing.Literal:
        return {"enum": list(args)}
    if origin is tuple and args[-1] is Ellipsis:
        return {"type": "array", "items": _value(args[0], {}) | of_items}
    if origin is tuple:
        items = [_value(arg, {}) | of_items for arg in args]
        return {"type": "array", "prefixItems": items, "minItems": len(items), "maxItems": len(items)}
    return _table(hint) if dataclasses.is_dataclass(hint) else dict(_TYPES[hint])
