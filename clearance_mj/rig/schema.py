"""Rules of a rig file's JSON Schema that the fields' types do not say."""

from __future__ import annotations

from typing import Any

__all__ = ["BEAM_OR_STRUCTURE", "OF_BEARINGS", "OF_OLDER_FILES"]

_ON_BEAM = {"anyOf": [{"type": "number", "exclusiveMinimum": 0}, {"type": "string", "pattern": "^@"}]}
_OF_SHAKER = {"properties": {"position": _ON_BEAM, "also": {"items": {"properties": {"position": _ON_BEAM}}}}}
_POSITIONED = ("masses", "sensors", "oscillators", "loads", "orders")
_POINTS_ON_BEAM: dict[str, Any] = {
    **{kind: {"items": {"properties": {"position": _ON_BEAM}}} for kind in _POSITIONED},
    "bushings": {"items": {"properties": {"position": _ON_BEAM, "to": _ON_BEAM}}},
    "shaker": _OF_SHAKER, "shakers": {"items": _OF_SHAKER}, "structure": False,
}  # fmt: skip
BEAM_OR_STRUCTURE = {
    "required": ["name", "bushings", "sensors"], "if": {"required": ["structure"]},
    "then": {"properties": {"beam": False}}, "else": {"required": ["beam"], "properties": _POINTS_ON_BEAM},
}  # fmt: skip
OF_BEARINGS: dict[str, Any] = {
    "table": {"type": "string", "description": "file of a table over the spin, in the place of the coefficients"},
}
"""Keys whose files are read into other fields"""
OF_OLDER_FILES: dict[str, Any] = {"motion": {
    "enum": ["planar", "spatial"], "deprecated": True,
    "description": "of all clearances at once; now each has its shape",
}}  # fmt: skip
"""Keys that are read and never written"""
