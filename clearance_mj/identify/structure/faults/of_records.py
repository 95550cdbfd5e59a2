"""Records of another rig or set-up than the others, told from their rigs before any long search."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ....beam import natural_frequencies
from ....core.errors import RecordError
from ....core.overview import few
from ....rig import Rig
from ...records.prepared import PreparedRecord
from ..rig_fit import RigFit
from ..updating import rig_file_misfit
from .assessment import SOUND_SHARE, SUSPECT_MISFIT

__all__ = ["require_one_rig"]

THIN = 10  # every so many-th spectral line tells whether records are of one rig
APART = 3.0
"""Times what a rig of its own misses of a record, beyond which another rig does not fit; of sound benches up to 1.3,
of records along y and along z, which tell different things, up to 2.9."""
LISTED = 4  # channels, records and natural frequencies that are named


def require_one_rig(rig: Rig, records: Sequence[PreparedRecord]) -> None:
    """Refuse records that are of several rigs: each fits a rig of its own, and no rig fits all.

    The forces in the clearances are unknowns of each record, so their levels may differ.

    Parameters
    ----------
    rig : Rig
        The rig file's.
    records : sequence of PreparedRecord
        Records to identify.

    Raises
    ------
    RecordError
        If there are; names the records that do not fit the others, and the channels and natural frequencies that tell it.
    """
    if len(records) < 2:
        return
    together, suspicious = RigFit(rig, records, THIN).run(), SUSPECT_MISFIT / 100
    missed = np.array([m.share for m in together.misfit])
    if not np.nanmax(missed) > suspicious:
        return
    alone = [RigFit(rig, [record], THIN).run() for record in together.records]
    own = np.array([update.misfit[0].share for update in alone])
    differ, worst = (missed > suspicious) & (missed > APART * own), np.nanmax(own, axis=1)
    fits = np.nanquantile(own, SOUND_SHARE, axis=1) <= suspicious
    if not differ.any() or (fits & (worst > suspicious)).any():  # a channel of one record is wrong, not its rig
        return
    limits = np.maximum(APART * worst, suspicious)
    groups = [
        [rig_file_misfit(update.rig, [record]).max() <= limit for record, limit in zip(together.records, limits)]
        for update, fit in zip(alone, fits) if fit
    ]  # fmt: skip
    same = np.array(max(groups, key=sum, default=[True] * len(records)))
    if same.all():
        return
    others, rest = (few([f'"{r.name}"' for r in np.array(records)[group]], LISTED) for group in (~same, same))
    channels = few([name for name, told in zip(together.channels, differ.any(axis=0)) if told], LISTED)
    lowest = [natural_frequencies(alone[group.argmax()].rig, LISTED).tolist() for group in (~same, same)]
    modes = " Hz against ".join(", ".join(f"{f:.3g}" for f in frequencies) for frequencies in lowest)
    who = f"record {others} is" if sum(~same) == 1 else f"records {others} are"
    raise RecordError(
        f"{who} not of the rig or set-up of {rest}: one rig for all misses {channels} by up to "
        f"{100 * missed[differ].max():.0f} % of the level, one for each record at most {100 * worst.max():.1f} %; "
        f"their lowest natural frequencies are {modes} Hz; give each rig a dataset of its own"
    )
