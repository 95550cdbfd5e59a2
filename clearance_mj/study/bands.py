"""FRF bands from the uncertainty of a study's laws."""

from __future__ import annotations

import numpy as np

from ..core.cache import ResultCache
from ..identify.records.in_test import in_test
from ..io.dataset import Record
from ..statistics.frf_bands import Band, frf_band, paired_error
from . import stored
from .identified import IdentifiedModel

__all__ = ["law_band"]

ENGINE = "modal"  # the cheapest


def law_band(
    law: IdentifiedModel, record: Record, resolution: float, cache: ResultCache | None
) -> tuple[Band, np.ndarray]:
    """Return the FRF band of a law under a record's excitation, and the record's random error about the fitted law.

    Parameters
    ----------
    law : IdentifiedModel
        With models drawn about it.
    record : Record
        Whose excitation is simulated.
    resolution : float
        Hz, of the FRFs.
    cache : ResultCache or None
        Where the band is kept for the next study.
    """
    tested, turning = record.tested_rig, record.turning()
    model, *drawn = (in_test(each, tested, turning) for each in (law.model, *law.drawn))

    def compute() -> tuple[Band, np.ndarray]:
        excitation = record.excitation()
        band = frf_band(model, excitation, drawn, resolution=resolution, misfit=law.misfit)
        return band, paired_error(record.response(), model.simulate(excitation, ENGINE), resolution)

    models, misfit = [each.content() for each in (model, *drawn)], law.to_dict()["misfit"]
    inputs = [models, misfit, resolution, stored.record_digest(record)]
    return stored.band(cache, f"band_{law.name}", inputs, compute)
