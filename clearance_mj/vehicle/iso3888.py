"""Gates of ISO 3888, parts 1 and 2, and paths through them.

They are made for a vehicle of 4.51 by 1.61 m, none of whose corners touches a cone on any of the paths.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

from .curves import check_positive, lane_changes
from .path import Path

__all__ = [
    "Gate",
    "iso3888_2_gates",
    "iso3888_gates",
    "iso_lane_change",
    "obstacle_avoidance",
    "swift_obstacle_avoidance",
]

LANE_OFFSET = 3.5  # m between the centre lines of the two lanes of ISO 3888-1
SHARE_IN_GATE = 1 / 6  # share of a lane change that lies within each of the two gates it connects
SWIFT_CHANGES = ((7.13, 33.22, 3.42), (33.22, 59.65, -0.05))
"""M: where the lane changes of `swift_obstacle_avoidance` begin, end and lead to."""


class Gate(NamedTuple):
    """A stretch of lane between cones."""

    start: float  # m along X
    end: float  # m along X
    centre: float  # m along Y
    width: float  # m


def iso3888_gates(width: float = 1.61, length_factor: float = 1.0) -> tuple[Gate, ...]:
    """Gates of the double lane change of ISO 3888-1: 15 m, 25 m in the other lane, 30 m back; 30 and 25 m between them.

    Their widths are 1.1, 1.2 and 1.3 times the vehicle's plus 0.25 m; the lanes' centre lines are taken as 3.5 m apart.
    Lengths along X are scaled; 1 is the standard's.
    """
    check_positive(width=width, length_factor=length_factor)
    lanes = ((0.0, 15.0, 0.0, 1.1), (45.0, 70.0, LANE_OFFSET, 1.2), (95.0, 125.0, 0.0, 1.3))
    return tuple(Gate(a * length_factor, b * length_factor, y, factor * width + 0.25) for a, b, y, factor in lanes)


def iso3888_2_gates(width: float = 1.61) -> tuple[Gate, ...]:
    """Gates of the obstacle avoidance of ISO 3888-2:2011: 12, 11 and 12 m long, 13.5 and 12.5 m between them.

    Their widths are 1.1 times the vehicle's plus 0.25 m, the vehicle's plus 1 m, and 1.3 times the vehicle's plus 0.25
    m but at least 3 m. The second begins 1 m to the left of the first one's left edge; the right edges of the first and
    the third are in line.
    """
    check_positive(width=width)
    first, second, third = 1.1 * width + 0.25, width + 1, max(1.3 * width + 0.25, 3.0)
    return (
        Gate(0.0, 12.0, 0.0, first),
        Gate(25.5, 36.5, first / 2 + 1 + second / 2, second),
        Gate(49.0, 61.0, (third - first) / 2, third),
    )


def iso_lane_change(length_factor: float = 1.0) -> Path:
    """Smooth path through the ISO 3888-1 gates: straights joined by quintic lane changes; lengths along X are scaled.

    Each lane change Y = 3.5 m (10 u³ - 15 u⁴ + 6 u⁵) has a sixth of its length within each of its gates, where the
    path is off the centre by at most 0.124 m, less than the free width on either side.
    """
    gates = iso3888_gates(length_factor=length_factor)
    name, before = f"iso-3888-1 x {length_factor:g}", 30.0 * length_factor
    return lane_changes(name, _between_centres(gates), -before, gates[-1].end + before)


def obstacle_avoidance() -> Path:
    """Path along the centres of the ISO 3888-2 gates; each lane change has a sixth of its length within each gate."""
    return lane_changes("iso-3888-2 centres", _between_centres(iso3888_2_gates()), -20.0, 90.0)


def swift_obstacle_avoidance() -> Path:
    """Return the path through the ISO 3888-2 gates that makes use of their widths, for higher speeds.

    Its two quintic lane changes have the least curvature that leaves a vehicle of 4.51 by 1.61 m at least 0.1 m from
    every cone (found by differential evolution over where they begin, end and lead to).
    """
    return lane_changes("iso-3888-2", SWIFT_CHANGES, -20.0, 90.0)


def _between_centres(gates: Sequence[Gate]) -> list[tuple[float, float, float]]:
    """Lane changes between the centres of gates, of which `SHARE_IN_GATE` is within each of the two."""
    changes = []
    for gate, following in itertools.pairwise(gates):
        reach = SHARE_IN_GATE / (1 - 2 * SHARE_IN_GATE) * (following.start - gate.end)
        changes.append((gate.end - reach, following.start + reach, following.centre))
    return changes
