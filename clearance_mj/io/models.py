"""Rig files (TOML) and law files (JSON) among the formats."""

from __future__ import annotations

from pathlib import Path

from ..clearance.law import Law
from ..clearance.law_files import load_law
from ..rig import Rig
from .registry import Format, register

__all__: list[str] = []


def _save(path: Path, obj: Rig | Law) -> None:
    obj.save(path)


register(Format("TOML", (".toml",), (Rig,), Rig.load, _save, note="a rig"))
register(Format("JSON", (".json",), (Law,), load_law, _save, note="a law"))
