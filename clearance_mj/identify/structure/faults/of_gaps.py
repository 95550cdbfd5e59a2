"""Gaps that are grossly wrong in the rig file: the restoring force bends where the shaft meets its walls."""

from __future__ import annotations

import numpy as np

from ....core.errors import RecordError
from ...forces.restoring import NO_PROBES_BAND, RestoringForce, restoring_force
from ...records.prepared import PreparedRecord
from ..rig_update import RigUpdate
from .assessment import Fault

__all__ = ["bends_of", "gap_faults"]

SOUND_RATIO = 0.6, 2.1
"""Identified gap over that of the rig file, beyond which it is a fault, of a gap known within `TOLERANCE`."""
TOLERANCE = 0.2  # 1 σ of a gap's logarithm
SOUND_OFFSET = 2.0  # standard deviations, by which one wall alone may be nearer or farther
BENT = 0.9  # of the squared residual of a restoring force without a wall, below which it bends there
IMPULSIVE = 9.0  # kurtosis of a motion, above which it is in contact too seldom to show the wall, as after hits
HIGH = 440.0  # Hz, up to which restoring forces are taken
STRIDE = 8  # samples of a restoring force, of which one counts


def gap_faults(update: RigUpdate) -> list[Fault]:
    """Return the gaps that are far from where the restoring force bends, whatever the offsets within their tolerances.

    Parameters
    ----------
    update : RigUpdate
        Update of a rig whose structure and instruments are sound.
    """
    bends, faults = np.min([_bends(record, update) for record in update.records], axis=0), []
    tolerance = {p.name: p.prior_std for p in update.clearance_priors}
    for j, (walls, bushing) in enumerate(zip(bends, update.start.bushings)):
        met, gap = walls[np.isfinite(walls)], bushing.gap
        if not met.size:
            continue
        wider = max(1.0, tolerance.get(f"bushings[{j}].gap", 0.0) / TOLERANCE)
        nearer = abs(bushing.offset) + SOUND_OFFSET * tolerance.get(f"bushings[{j}].offset", 0.0)
        fraction = nearer / gap if met.size == 1 else 0.0
        low, high = SOUND_RATIO[0] ** wider * (1 - fraction) * gap, SOUND_RATIO[1] ** wider * (1 + fraction) * gap
        if low <= (gap_seen := float(met.mean())) <= high:
            continue
        ratio, size = (gap_seen / gap, "small") if gap_seen > gap else (gap / gap_seen, "large")
        words = f"bushings[{j}].gap is {ratio:.1f} times too {size} in the rig file"
        bend_words = " and ".join(f"{sign}{1e3 * wall:.2g}" for sign, wall in zip("+-", walls) if np.isfinite(wall))
        where = f"its restoring force bends at about {bend_words} mm, the rig file says {1e3 * gap:.3g} mm"
        faults.append(Fault(words, where, gap_seen / gap))
    return faults


def _bends(record: PreparedRecord, update: RigUpdate) -> np.ndarray:
    """(n_bushings, 2) displacements at which the restoring force bends, m; infinite where it does not."""
    rig, low = update.rig, 0.0 if update.probes else NO_PROBES_BAND
    try:
        force = restoring_force(record, min(HIGH, 0.4 * record.fs), low, rig, update.values)
    except RecordError:  # too short
        return np.full((len(rig.bushings), 2), np.inf)
    return np.array([bends_of(force, j) for j in range(len(rig.bushings))])


def bends_of(force: RestoringForce, bushing: int) -> np.ndarray:
    """Return how far from rest walls (2,) are, m, upwards and downwards; infinite where the force does not bend.

    Springs there, with spring, dashpot and friction, leave the smallest residual force.
    """
    x, v, f = (part[bushing, force.valid][::STRIDE] for part in (force.displacement, force.velocity, force.force))
    walls_met = np.full(2, np.inf)
    if np.mean((x - x.mean()) ** 4) > IMPULSIVE * np.var(x) ** 2:
        return walls_met
    basis = np.linalg.qr(np.column_stack((x, v, np.clip(v / np.std(v), -0.1, 0.1))))[0]
    walls = np.abs(x).max() * np.geomspace(0.03, 0.95, 30)
    springs = np.hstack([sign * np.maximum(sign * x[:, None] - walls, 0.0) for sign in (1, -1)])
    springs, f = (part - basis @ (basis.T @ part) for part in (springs, f))
    square, dots = springs.T @ springs, springs.T @ f
    norms, (up, down) = np.diag(square), (slice(walls.size), slice(walls.size, None))
    # Of one wall, and of two as stiff; grease that slides bends the other way.
    of_two = np.add.outer(dots[up], dots[down]), np.add.outer(norms[up], norms[down]) + 2 * square[up, down]
    one_wall, two_walls = (
        np.divide(np.maximum(force, 0.0) ** 2, size, out=np.zeros_like(size), where=size > 0)
        for force, size in ((dots, norms), of_two)
    )
    residual = f @ f - np.array([0.0, one_wall.max(), two_walls.max()])
    if residual[2] < BENT * residual[1]:
        return walls[np.array(np.unravel_index(np.argmax(two_walls), two_walls.shape))]
    if residual[1] < BENT * residual[0]:
        side, wall = divmod(int(np.argmax(one_wall)), walls.size)
        walls_met[side] = walls[wall]
    return walls_met
