"""Manoeuvres and their paths; `MANOEUVRES` are those that controllers are compared on, not tuned on."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ..core.errors import ManoeuvreError
from .commonroad import GRAVITY
from .disturbances import Crosswind, CrownedRoad, Disturbance
from .path import Path, clothoids, graph, lane, lane_changes

__all__ = [
    "MANOEUVRES", "Manoeuvre", "check_feasible", "clothoid_arc", "double_lane_change", "get_manoeuvre",
    "iso3888_2_gates", "iso3888_gates", "iso_lane_change", "obstacle_avoidance", "single_lane_change", "slalom",
    "straight", "swift_obstacle_avoidance",
]  # fmt: skip

# Gates of ISO 3888, parts 1 and 2, and paths through them.
#
# For a vehicle of 4.51 by 1.61 m; none of its corners touches a cone on any of the paths.

LANE_OFFSET = 3.5  # m between the centre lines of the two lanes of ISO 3888-1
SHARE_IN_GATE = 1 / 6  # fraction of a lane change within each of the two gates it connects
SWIFT_CHANGES = ((7.13, 33.22, 3.42), (33.22, 59.65, -0.05))
"""Begin, end and target of the lane changes of `swift_obstacle_avoidance`, m."""


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
    ManoeuvreError.require_positive(width=width, length_factor=length_factor)
    lanes = ((0.0, 15.0, 0.0, 1.1), (45.0, 70.0, LANE_OFFSET, 1.2), (95.0, 125.0, 0.0, 1.3))
    return tuple(Gate(a * length_factor, b * length_factor, y, factor * width + 0.25) for a, b, y, factor in lanes)


def iso3888_2_gates(width: float = 1.61) -> tuple[Gate, ...]:
    """Gates of the obstacle avoidance of ISO 3888-2:2011: 12, 11 and 12 m long, 13.5 and 12.5 m between them.

    Their widths are 1.1 times the vehicle's plus 0.25 m, the vehicle's plus 1 m, and 1.3 times the vehicle's plus 0.25
    m but at least 3 m. The second begins 1 m to the left of the first one's left edge; the right edges of the first and
    the third are in line.
    """
    ManoeuvreError.require_positive(width=width)
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
    name, lead = f"iso-3888-1 x {length_factor:g}", 30.0 * length_factor
    return lane_changes(name, _between_centres(gates), -lead, gates[-1].end + lead)


def obstacle_avoidance() -> Path:
    """Path along the centres of the ISO 3888-2 gates; each lane change has a sixth of its length within each gate."""
    return lane_changes("iso-3888-2 centres", _between_centres(iso3888_2_gates()), -20.0, 90.0)


def swift_obstacle_avoidance() -> Path:
    """Return a path through the ISO 3888-2 gates that uses their widths, for higher speeds.

    Its two quintic lane changes have the least curvature that leaves a vehicle of 4.51 by 1.61 m at least 0.1 m from
    every cone (by differential evolution over their begin, end and target).
    """
    return lane_changes("iso-3888-2", SWIFT_CHANGES, -20.0, 90.0)


def _between_centres(gates: Sequence[Gate]) -> list[tuple[float, float, float]]:
    """Return the lane changes between the centres of gates, with `SHARE_IN_GATE` of them in each of the two."""
    changes = []
    for gate, next_gate in itertools.pairwise(gates):
        reach = SHARE_IN_GATE / (1 - 2 * SHARE_IN_GATE) * (next_gate.start - gate.end)
        changes.append((gate.end - reach, next_gate.start + reach, next_gate.centre))
    return changes


SPEEDS = (5.0, 50.0)  # m/s, range within which the vehicle models hold


def check_feasible(path: Path, speed: float, friction: float) -> None:
    """Raise ManoeuvreError for a path that cannot be followed at a speed, m/s, and friction coefficient.

    The speed is outside `SPEEDS`, or the path needs more than the friction's lateral acceleration.
    """
    if not SPEEDS[0] <= speed <= SPEEDS[1]:
        low, high = (f"{3.6 * v:g}" for v in SPEEDS)
        raise ManoeuvreError(f"speed must be in {low}..{high} km/h, got {3.6 * speed:g}")
    needed, limit = path.needed_acceleration(speed), friction * GRAVITY
    if needed > limit:
        fastest = 3.6 * math.sqrt(limit / path.largest_curvature)
        raise ManoeuvreError(
            f"path {path.name!r} needs a lateral acceleration of {needed:.1f} m/s² at {3.6 * speed:g} km/h, friction "
            f"{friction:g} allows {limit:.1f}; drive at most {fastest:.0f} km/h or lengthen the path"
        )


def straight(length: float) -> Path:
    """Straight path along x, of a length in m."""
    ManoeuvreError.require_positive(length=length)
    return Path.of("straight", clothoids([(length, 0.0, 0.0)]))


def clothoid_arc(
    radius: float = 200.0, clothoid: float = 60.0, arc: float = 100.0, lead: float = 30.0, tail: float = 60.0
) -> Path:
    """Straight, clothoid, left-hand arc, clothoid, straight; lengths in m."""
    ManoeuvreError.require_positive(radius=radius, clothoid=clothoid, arc=arc, lead=lead, tail=tail)
    k = 1 / radius
    parts = [(lead, 0.0, 0.0), (clothoid, 0.0, k), (arc, k, k), (clothoid, k, 0.0), (tail, 0.0, 0.0)]
    return Path.of("clothoid-arc", clothoids(parts))


def double_lane_change(length_factor: float = 1.0) -> Path:
    """Double lane change with hyperbolic tangents.

    Y = dy1/2 (1 + tanh z1) - dy2/2 (1 + tanh z2), z_i = 2.4/dx_i (X - Xs_i) - 1.2, dx 25 and 21.95 m, dy 4.05 and
    5.7 m, Xs 27.19 and 56.46 m (Falcone et al., IEEE Trans. Control Syst. Technol. 15, 2007), with all lengths along X
    scaled; at 1 the path needs 10.9 m/s² at 72 km/h. It begins 30 m before X = 0, where its slope is below 1e-6.
    """
    ManoeuvreError.require_positive(length_factor=length_factor)
    dx, dy, start = np.array([25.0, 21.95]), np.array([4.05, -5.7]), np.array([27.19, 56.46])

    def derivatives(x: np.ndarray) -> list[np.ndarray]:
        x = x[:, None] / length_factor
        rate = 2.4 / dx / length_factor
        t = np.tanh(2.4 / dx * (x - start) - 1.2)
        sech2 = 1 - t**2
        orders = (1 + t, sech2 * rate, -2 * t * sech2 * rate**2, (6 * t**2 - 2) * sech2 * rate**3)
        return [order @ (dy / 2) for order in orders]

    first, last = length_factor * np.array([-30.0, 125.0])
    return Path.of(f"double-lane-change x {length_factor:g}", [graph(derivatives, first, last)])


def single_lane_change(length: float = 60.0, offset: float = 3.5, lead: float = 30.0, tail: float = 70.0) -> Path:
    """Quintic lane change to the left over a length, between straights; all in m."""
    ManoeuvreError.require_positive(length=length, offset=offset, lead=lead, tail=tail)
    return lane_changes("single-lane-change", [(0.0, length, offset)], -lead, length + tail)


def slalom(spacing: float = 36.0, amplitude: float = 1.2, cones: int = 5) -> Path:
    """Slalom around cones, Y = A cos(π X/D) from the first to the last of them, D apart; lengths in m.

    It needs A (π/D)² of curvature. Quintics over D lead from the straight to the first cone and from the last one back.
    """
    ManoeuvreError.require_positive(spacing=spacing, amplitude=amplitude, cones=cones)
    wave, last = math.pi / spacing, (cones - 1) * spacing
    bend = amplitude * (wave * spacing) ** 2 / 2
    rise = np.polynomial.Polynomial([0, 0, 0, 10 * amplitude - bend, 2 * bend - 15 * amplitude, 6 * amplitude - bend])
    side = math.cos(wave * last)

    def entry(x: np.ndarray) -> list[np.ndarray]:
        return [rise.deriv(k)(x / spacing + 1) / spacing**k for k in range(4)]

    def cosine(x: np.ndarray) -> list[np.ndarray]:
        return [amplitude * wave**k * np.cos(wave * x + k * math.pi / 2) for k in range(4)]

    def departure(x: np.ndarray) -> list[np.ndarray]:
        return [side * (-1) ** k * v for k, v in enumerate(entry(last - x))]

    ends = itertools.pairwise((-spacing - 20, -spacing, 0.0, last, last + spacing, last + spacing + 20))
    curves = lane(0.0), entry, cosine, departure, lane(0.0)
    return Path.of("slalom", [graph(curve, *between) for curve, between in zip(curves, ends)])


class Manoeuvre(NamedTuple):
    """A path to follow at a speed, with a disturbance of the vehicle."""

    label: str  # in tables and figures
    path: Callable[[], Path]
    speed: float  # km/h
    disturbance: Disturbance | None = None  # in addition to the road's moment on the wheels


MANOEUVRES = {
    "lane-change": Manoeuvre("Lane change", single_lane_change, 90.0),
    "slalom": Manoeuvre("Slalom", slalom, 80.0),
    "obstacle-40": Manoeuvre("ISO 3888-2, gates' centres", obstacle_avoidance, 40.0),
    "obstacle-60": Manoeuvre("ISO 3888-2, least curvature", swift_obstacle_avoidance, 60.0),
    "gusts": Manoeuvre(
        "Constant radius, crosswind", lambda: clothoid_arc(200.0, 50.0, 90.0, 20.0, 20.0), 80.0, Crosswind()
    ),
    "on-centre": Manoeuvre("Straight, crowned road", lambda: straight(240.0), 100.0, CrownedRoad()),
}  # Manoeuvres by name; no controller is tuned on them.


def get_manoeuvre(name: str) -> Manoeuvre:
    """Return the manoeuvre of a name; the message on an unknown one lists the known ones."""
    ManoeuvreError.require_known("manoeuvre", name, MANOEUVRES)
    return MANOEUVRES[name]
