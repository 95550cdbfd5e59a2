"""What a law makes of a measured motion, to lay beside what was measured."""

from __future__ import annotations

import numpy as np
import scipy.signal

from ...clearance.cycle import fill_forces
from ...clearance.kernel import clearance_records
from ...clearance.law import Law
from .restoring import RestoringForce

__all__ = ["law_force"]

FINER = 4  # factor by which motions are interpolated: contact begins and ends between samples


def law_force(measured: RestoringForce, law: Law) -> np.ndarray:
    """Return the force (n_bushings, n_t) of grease and contact, N, that a law gives along the measured motion.

    Positive against positive displacement, as `RestoringForce.force`; the grease is the law's, or else the rig's.
    """
    rig, n, step = measured.rig, measured.time.size, 1 / (measured.fs * FINER)
    points = np.concatenate((measured.displacement[:, None], measured.ends), axis=1)
    x = scipy.signal.resample(points, n * FINER, axis=2)
    v, fine = np.gradient(x, axis=2) * (measured.fs * FINER), np.zeros((len(x), n * FINER))
    fill_forces(x, v, clearance_records(rig, law, step), fine)
    return scipy.signal.resample(fine, n, axis=1)
