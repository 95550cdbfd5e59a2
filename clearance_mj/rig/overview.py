"""What a rig says of itself in print."""

from __future__ import annotations

from collections.abc import Sequence

from ..structure import Beam, Structure
from .clearance import Bushing

__all__ = ["bushing_rows", "structure_in_words"]


def structure_in_words(structure: Structure) -> str:
    """Return the kind of a structure, and how long its shafts reach."""
    shafts = structure.shafts
    kind = "cantilever" if isinstance(structure, Beam) else f"{len(shafts)} shafts" if len(shafts) > 1 else "shaft"
    if not shafts:
        return str(getattr(structure, "kind", type(structure).__name__))
    return f"{kind}, {structure.span[1] - structure.span[0]:.4g} m"


def bushing_rows(labels: Sequence[str], bushings: Sequence[Bushing]) -> list[tuple[str, ...]]:
    """Return the head and the rows of a table of clearances; no row at all without any."""
    head = ("bushing", "at", "gap (mm)", "datasheet contact (N/m, N s/m)", "datasheet grease (N/m, N s/m)")
    rows = [
        (
            label, b.where, f"{1e3 * b.gap:.4g}", f"{b.contact.stiffness:.4g}, {b.contact.damping:.4g}",
            f"{b.grease.stiffness:.4g}, {b.grease.damping:.4g}",
        )
        for label, b in zip(labels, bushings)
    ]  # fmt: skip
    return [head, *rows] if rows else []
