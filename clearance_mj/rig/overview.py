"""Words of a rig's overview: structure, excitation, natural frequencies and clearances."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core.errors import RigError
from ..core.overview import few
from ..structure import Beam, Structure
from ..structure.base import StructureOfFiles, is_rotation
from .clearance import Bushing
from .instruments import Shaker

__all__ = ["bushing_rows", "frequencies_in_words", "inputs_in_words", "structure_in_words"]

SHOWN_FREQUENCIES = 4  # in a rig's overview


def structure_in_words(structure: Structure) -> str:
    """Return the kind of a structure and the length of its shafts."""
    shafts = structure.shafts
    kind = "cantilever" if isinstance(structure, Beam) else f"{len(shafts)} shafts" if len(shafts) > 1 else "shaft"
    if not shafts:
        return str(getattr(structure, "kind", type(structure).__name__))
    return f"{kind}, {structure.span[1] - structure.span[0]:.4g} m"


def inputs_in_words(inputs: Sequence[Shaker]) -> str:
    """Return kind and place of a rig's excitation."""
    words = {"base": "base acceleration", "force": "force"}
    return "; ".join(f"{words[shaker.kind]}, {shaker.label(shaker.kind)}" for shaker in inputs)


def frequencies_in_words(rig: Any) -> str:
    """Return the lowest natural frequencies of a `Rig`, where they are computed at once: matrices may be large."""
    if isinstance(rig.linear, StructureOfFiles):
        return ""
    try:
        with np.errstate(all="ignore"):
            omega = rig.reduction(16 + SHOWN_FREQUENCIES, grease=True).omega[:SHOWN_FREQUENCIES]
    except RigError:
        return ""
    return f"{few([f'{w / (2 * np.pi):.4g}' for w in omega])} Hz in the gaps"


def bushing_rows(labels: Sequence[str], bushings: Sequence[Bushing]) -> list[tuple[str, ...]]:
    """Return the head and the rows of a table of clearances; no row at all without any."""
    head = ("bushing", "at", "gap (mm)", "datasheet contact (N/m, N s/m)", "datasheet grease (N/m, N s/m)")
    rows = []
    for label, b in zip(labels, bushings):
        gap = f"{1e3 * b.gap:.4g}{' mrad' if is_rotation(b.position) else ''}"
        contact, grease = (f"{part.stiffness:.4g}, {part.damping:.4g}" for part in (b.contact, b.grease))
        rows.append((label, b.where, gap, contact, grease))
    return [head, *rows] if rows else []
