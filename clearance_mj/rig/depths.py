"""Predicted depths of a shaft in a bushing's wall, and warnings of depths that no wall bears."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .rig import Rig

__all__ = ["depth_words", "wall_depths"]

DEEP = 0.2  # of the gap: a contact so deep is softer than a wall, and its stiffness decides in place of the gap


def wall_depths(rig: Rig, displacement: np.ndarray) -> np.ndarray:
    """Return the largest depths (n_bushings,) in the walls, m; 0 where none is touched.

    Parameters
    ----------
    rig : Rig
        The rig.
    displacement : ndarray, shape (n_rows, n_t)
        Relative to the bushings, m, from rest, see `Rig.clearance_rows`.
    """
    depths = []
    for bushing, rows in zip(rig.bushings, rig.clearance_rows):
        x = displacement[rows]
        if bushing.is_round:
            depths.append(np.hypot(x[0] + bushing.offset_y, x[1] + bushing.offset).max() - bushing.gap)
        else:
            lower, upper = bushing.walls
            depths.append(max(lower - x.min(), x.max() - upper))
    return np.maximum(depths, 0.0)


def depth_words(rig: Rig, depth: Sequence[float] | np.ndarray) -> list[str]:
    """Return warnings where a wall is pressed deeper than it bears, or than a fifth of the gap.

    Parameters
    ----------
    rig : Rig
        The rig.
    depth : sequence of float
        (n_bushings,) m, as predicted; nan: not known.
    """
    warnings = []
    for name, bushing, value in zip(rig.clearance_labels, rig.bushings, depth):
        words = f"clearance {name}: the shaft is {1e3 * value:.2g} mm deep in the wall"
        if value > (bearable := bushing.contact.bearable_depth or math.inf):
            warnings.append(f"{words}, and from {1e3 * bearable:.2g} mm on the bushing yields: forces are then smaller")
        elif value > DEEP * bushing.gap:
            words += f", beyond a fifth of the gap ({1e3 * bushing.gap:.3g} mm): the contact's stiffness decides "
            warnings.append(f"{words}what is predicted; clearance-mj new --bushing-material proposes one")
    return warnings
