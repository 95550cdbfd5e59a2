"""From where pictures in space are seen."""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = ["View"]


class View:
    """Where points of space lie in the picture: x to the right and away, y towards the eye, z up."""

    def __init__(self, around: float = 32.0, above: float = 14.0):
        self.cos, self.sin = np.cos(np.radians(around)), np.sin(np.radians(around))
        self.up, self.tilt = np.cos(np.radians(above)), np.sin(np.radians(above))

    def __call__(self, x: Any, y: Any, z: Any) -> np.ndarray:
        """Return (2, ...) right and up in the picture of points, in the unit of x, y and z."""
        x, y, z = np.broadcast_arrays(*(np.asarray(part, dtype=float) for part in (x, y, z)))
        return np.array((x * self.cos + y * self.sin, z * self.up + (x * self.sin - y * self.cos) * self.tilt))
