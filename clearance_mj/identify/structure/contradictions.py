"""What records say against the rig that a method takes for exact, so that no lie of either passes in silence."""

from __future__ import annotations

import numpy as np

from ...core.errors import RecordError
from ...io.dataset import Dataset
from .diagnosis import diagnose
from .hypothesis import Trial
from .updating import RigUpdate, _Fit, _rms, _Spectra

__all__ = ["contradictions", "missed_as_told"]

TOLD = 0.1
"""of a channel's level: what a rig as told may miss; of rigs that records were simulated with, up to 0.06"""


def contradictions(dataset: Dataset, update: RigUpdate | None = None) -> tuple[str, ...]:
    """Return in words what contradicts the rig, and the likeliest cause; none: nothing does, or nothing can.

    Parameters
    ----------
    dataset : Dataset
        Rig and records; records with role "validate" are never opened.
    update : RigUpdate, optional
        The rig that is used in place of the rig file's.
    """
    if update:
        return diagnose(dataset, update).words if Trial(dataset, update).missed() else ()
    if (missed := missed_as_told(dataset)) is None or missed.max() < TOLD:
        return ()
    return diagnose(dataset).words or (
        f"the rig file, which this method takes for exact, misses a channel by {100 * missed.max():.0f} % of its "
        "level; method bench, or update-rig, corrects it",
    )


def missed_as_told(dataset: Dataset) -> np.ndarray | None:
    """(n_channels,) what the rig file misses of each channel over its level, RMS over the records to identify.

    Under the forces in the clearances that meet all sensors best; None where sensors are not more than such forces.
    """
    records, rig = dataset.to_identify(), dataset.rig
    try:
        probes = all(record.response().displacement is not None for record in records) and bool(rig.bushings)
        if len(rig.sensors) + len(rig.bushings) * probes <= len(rig.bushings):
            return None
        fit = _Fit(rig, [_Spectra(record, probes) for record in records], probes)
    except RecordError:
        return None  # what cannot be read is said elsewhere
    found = fit._projected(fit.gains(np.zeros(fit.width.size)))
    left = [_rms(f.fitted(n) - s.measured) / _rms(s.measured) for f, n, s in zip(found, fit.noise, fit.spectra)]
    return np.asarray(np.sqrt(np.mean(np.square(left), axis=0)))
