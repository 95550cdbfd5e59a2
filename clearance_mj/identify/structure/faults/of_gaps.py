"""Gaps that the rig file has grossly wrong: the restoring force bends where the shaft meets its walls."""

from __future__ import annotations

import numpy as np

from ....core.errors import RecordError
from ...forces.restoring import NO_PROBES_BAND, RestoringForce, restoring_force
from ...records.prepared import PreparedRecord
from ..rig_update import RigUpdate
from .assessment import Fault

__all__ = ["bend_of", "gap_faults"]

SOUND_RATIO = (
    0.6,
    2.1,
)  # gap found over that of the rig file, beyond which it is a fault; of sound benches 0.73 to 1.9
BENT = 0.9  # of the square of what a straight line leaves of a restoring force, below which it bends
IMPULSIVE = 9.0  # kurtosis of a motion, above which it is in contact too seldom to show the wall, as after hits
HIGH = 440.0  # Hz, up to which restoring forces are taken
STRIDE = 8  # samples of a restoring force, of which one counts


def gap_faults(update: RigUpdate) -> list[Fault]:
    """Return the gaps that are far from where the restoring force bends.

    Parameters
    ----------
    update : RigUpdate
        Update of a rig whose structure and instruments are sound.
    """
    gaps = [bushing.gap for bushing in update.start.bushings]
    bends = np.min([_bends(record, update) for record in update.records], axis=0)
    faults = []
    for j, (bend, gap) in enumerate(zip(bends.tolist(), gaps)):
        if SOUND_RATIO[0] * gap <= bend <= SOUND_RATIO[1] * gap or bend == np.inf:
            continue
        ratio, which = (bend / gap, "small") if bend > gap else (gap / bend, "large")
        words = f"bushings[{j}].gap is {ratio:.1f} times too {which} in the rig file"
        where = f"its restoring force bends at about {1e3 * bend:.2g} mm, the rig file says {1e3 * gap:.3g} mm"
        faults.append(Fault(words, where, bend / gap))
    return faults


def _bends(record: PreparedRecord, update: RigUpdate) -> np.ndarray:
    """(n_bushings,) displacement at which the restoring force bends, m; infinite where it does not."""
    rig, low = update.rig, 0.0 if update.probes else NO_PROBES_BAND
    try:
        force = restoring_force(record, min(HIGH, 0.4 * record.fs), low, rig, update.values)
    except RecordError:  # too short
        return np.full(len(rig.bushings), np.inf)
    return np.array([bend_of(force, j) for j in range(len(rig.bushings))])


def bend_of(force: RestoringForce, bushing: int) -> float:
    """Return the wall, m, at which a spring leaves least of the force, beside spring, dashpot and friction; or inf."""
    x, v, f = (part[bushing, force.valid][::STRIDE] for part in (force.displacement, force.velocity, force.force))
    if np.mean((x - x.mean()) ** 4) > IMPULSIVE * np.var(x) ** 2:
        return np.inf
    grease = np.column_stack((x, v, np.clip(v / np.std(v), -0.1, 0.1)))
    largest = float(np.abs(x).max())
    walls = largest * np.geomspace(0.03, 0.95, 30)
    found = [_residual(np.column_stack((grease, np.sign(x) * np.maximum(np.abs(x) - w, 0.0))), f) for w in walls]
    squares = [left if stiffer > 0 else np.inf for left, stiffer in found]  # grease that slides bends the other way
    return float(walls[np.argmin(squares)]) if min(squares) < BENT * _residual(grease, f)[0] else np.inf


def _residual(columns: np.ndarray, target: np.ndarray) -> tuple[float, float]:
    """Sum of squares that columns leave of a target, and the sign of the last one's part."""
    columns = columns / np.linalg.norm(columns, axis=0)
    factors = np.linalg.lstsq(columns, target)[0]
    return float(np.sum((target - columns @ factors) ** 2)), float(factors[-1])
