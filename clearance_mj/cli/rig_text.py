"""A commented rig file: every field with its unit and, as a comment, its default."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterator, Mapping
from typing import Any

import tomli_w

from ..core.validation import descriptions
from ..rig import AppliedForce, Bearing, Bushing, Load, Order, PointMass, Rig, Shaker, Tolerance, Unbalance
from ..structure import Disc, Spring, Structure, Support

MAY_BE_ADDED = {
    "bushings": Bushing, "masses": PointMass, "also": AppliedForce, "supports": Support, "discs": Disc,
    "springs": Spring, "tolerances": Tolerance, "unbalances": Unbalance, "bearings": Bearing, "loads": Load,
    "orders": Order, "shakers": Shaker,
}  # fmt: skip
"""types of the entries that empty lists may get"""
TAPERED = ("diameter", "inner_diameter", "width", "height")
WIDTH = 32
EXAMPLE = "EXAMPLE, put in yours: "
MANY = 3  # items from which on a list has a line for each


def rig_lines(rig: Mapping[str, Any]) -> Iterator[str]:
    """Return the lines of a rig file from its fields; what is not among them, or at its default, is a comment.

    The numbers that ``examples`` name are marked.
    """
    return _lines(Rig, rig, rig.get("examples", ()))


def _lines(
    kind: type, values: Mapping[str, Any], examples: Collection[str], name: str = "", plural: bool = False
) -> Iterator[str]:
    """Yield the lines of a table of the file: its keys, ``kind`` first, then its subtables."""
    words = descriptions(kind)
    if name:
        yield from ("", f"[[{name}]]" if plural else f"[{name}]")
    fields = {f.name: f.default for f in dataclasses.fields(kind) if f.name not in ("beam", "structure")}
    if name == "structure":
        yield _line(f'kind = "{fields.pop("kind")}"', f"one of {', '.join(Structure.known)}")
    tables = {key: values[key] for key in ("beam", "structure") if values.get(key) is not None}
    for key, default in fields.items():
        value = values.get(key, default)
        value = None if value is dataclasses.MISSING else value
        if _is_table(value) or _is_list_of_tables(key, value):
            tables[key] = value
            continue
        if key in TAPERED and isinstance(value, tuple) and value[0] == value[1]:
            value = value[0]
        comment = "# " if value is None or value == default else ""
        mark = EXAMPLE if (f"{name}.{key}" if name else key) in examples else ""
        yield _line(f"{comment}{key} = {_toml_value(value)}", mark + words[key])
    for key, value in tables.items():
        path = f"{name}.{key}" if name else key
        for item in value if isinstance(value, tuple) else (value,):
            yield from _lines(*_parts(item), examples, path, isinstance(value, tuple))
        if value == ():
            yield from ("", f"# [[{path}]]")
            yield from (_line(f"# {n} =", text) for n, text in descriptions(MAY_BE_ADDED[key]).items())


def _line(text: str, words: str) -> str:
    return f"{text:{WIDTH - 1}s} # {' '.join(words.split())}"


def _is_list_of_tables(key: str, value: object) -> bool:
    return isinstance(value, tuple) and (all(map(_is_table, value)) if value else key in MAY_BE_ADDED)


def _is_table(value: object) -> bool:
    return dataclasses.is_dataclass(value) or (isinstance(value, dict) and "kind" in value)


def _parts(item: Any) -> tuple[type, Mapping[str, Any]]:
    """Return type and fields of an object, or of a structure's plain data."""
    return (Structure.known[item["kind"]], item) if isinstance(item, dict) else (type(item), vars(item))


def _toml_value(value: object) -> str:
    """Return a value as TOML writes it, numbers short: 15 digits, so that 0.6 × 0.03 is 0.018."""
    if isinstance(value, float):
        return f"{value:g}" if float(f"{value:g}") == value else f"{value:.15g}"
    if isinstance(value, tuple | list):
        items = [*map(_toml_value, value)]
        return "[\n  " + ",\n  ".join(items) + ",\n]" if len(items) > MANY else f"[{', '.join(items)}]"
    return "" if value is None else tomli_w.dumps({"": value}).partition(" = ")[2].strip()
