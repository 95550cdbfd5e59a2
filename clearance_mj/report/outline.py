"""Outlines of shafts, for drawings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..structure import Shaft

__all__ = ["outline", "position_label"]


def outline(shaft: Shaft) -> np.ndarray:
    """Return (3, 2 n_sections) position, half the outer height and half the bore, m, at both ends of every section."""
    edges = shaft.start + np.concatenate(([0.0], np.cumsum([s.length for s in shaft.sections])))
    outer = [s.diameter or s.height or (0.0, 0.0) for s in shaft.sections]
    bore = [s.inner_diameter or (0.0, 0.0) for s in shaft.sections]
    return np.array((np.repeat(edges, 2)[1:-1], np.ravel(outer) / 2, np.ravel(bore) / 2))


def position_label(shafts: Sequence[Shaft]) -> str:
    """Return what an axis of positions on shafts says: they are distances from a clamp, or along the shaft."""
    clamped = all(s.start == 0 and any(x.kind == "clamped" and x.position == 0 for x in s.supports) for s in shafts)
    return "Distance from the clamp (m)" if clamped else "Position along the shaft (m)"
