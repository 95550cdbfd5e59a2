"""Force of a self-energising band brake with dead travel along a motion, and travel since a reversal, compiled."""

import numpy as np

from clearance_mj.core.jit import jit

STICK = 0.1  # travel over which the friction beside the band turns over, as a share of the charge travel
NEWTON = 40  # steps, at most, that the slip between two samples takes
CLOSE = 1e-9  # excess of the spring's force over the capacity, as a share of the slide force, that is taken as none


@jit
def band_brake_force(
    x: np.ndarray, speed: np.ndarray, first: float, pull: np.ndarray, push: np.ndarray, rest: np.ndarray
) -> np.ndarray:
    """Force (n,), N, along x (n,), m, at its speed (n,), m/s, from the state in which the first force was ``first``.

    pull, push: slide, start, rise, elastic, exponent of `BrakeSide`; rest: gap, dead stiffness, damping, friction,
    force zero, charge travel and charge at the start. Deflection and charge depend on the reversals of x alone, not on
    the samples between them, so that any step is exact.
    """
    gap, soft, damping, friction, zero, travel, charge = rest
    force = np.empty(x.size)
    f = first - zero - damping * speed[0]
    z = _deflection(f, gap, soft, pull) if f >= 0.0 else -_deflection(-f, gap, soft, push)
    beside, last = 0.0, x[0]
    for i in range(x.size):
        step = x[i] - last
        last = x[i]
        z += step
        if z > 0.0:
            slip = _slip(z, charge, gap, soft, travel, pull)
            z -= slip
            charge = min(charge + slip / travel, 1.0)
        else:
            slip = _slip(-z, 1.0 - charge, gap, soft, travel, push)
            z += slip
            charge = max(charge - slip / travel, 0.0)
        beside = min(max(beside + step / (STICK * travel), -1.0), 1.0)
        elastic = _spring(z, gap, soft, pull) if z > 0.0 else -_spring(-z, gap, soft, push)
        force[i] = elastic + damping * speed[i] + friction * beside + zero
    return force


@jit
def _spring(u: float, gap: float, soft: float, side: np.ndarray) -> float:
    """Force at a deflection u >= 0."""
    return soft * u + (side[0] * ((u - gap) / side[3]) ** side[4] if u > gap else 0.0)


@jit
def _deflection(f: float, gap: float, soft: float, side: np.ndarray) -> float:
    """Deflection >= 0 at a force f >= 0; where there is none the least one."""
    low, high = 0.0, gap + side[3] * (f / side[0]) ** (1.0 / side[4])
    for _ in range(60):
        middle = 0.5 * (low + high)
        if _spring(middle, gap, soft, side) < f:
            low = middle
        else:
            high = middle
    return high if f > 0.0 else 0.0


@jit
def _slip(u: float, charge: float, gap: float, soft: float, travel: float, side: np.ndarray) -> float:
    """Travel that the band slips at a deflection u until the spring carries no more than its capacity."""
    slide, start, rise, elastic, exponent = side
    slip = 0.0
    for i in range(NEWTON):
        v, s = u - slip, min(charge + slip / travel, 1.0)
        excess = _spring(v, gap, soft, side) - slide * (start + (1.0 - start) * s**rise)
        if (excess <= 0.0 and i == 0) or abs(excess) <= CLOSE * slide:
            break
        slope = soft + (slide * exponent / elastic * ((v - gap) / elastic) ** (exponent - 1.0) if v > gap else 0.0)
        if s < 1.0:
            slope += slide * (1.0 - start) * rise * s ** (rise - 1.0) / travel
        slip = min(max(slip + excess / slope, 0.0), u)
    return slip


@jit
def reversal_travel(x: np.ndarray, least: float) -> np.ndarray:
    """Distance (n,) from the last reversal of a motion x (n,); a reversal counts once it is left by ``least``."""
    travel = np.empty(x.size)
    direction, extreme, reversal = 0.0, x[0], x[0]
    for i in range(x.size):
        if direction == 0.0:
            if abs(x[i] - x[0]) > least:
                direction = np.sign(x[i] - x[0])
                extreme = x[i]
        elif direction * (x[i] - extreme) > 0.0:
            extreme = x[i]
        elif direction * (extreme - x[i]) > least:
            direction, reversal, extreme = -direction, extreme, x[i]
        travel[i] = abs(x[i] - reversal)
    return travel
