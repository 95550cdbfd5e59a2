"""Records of another rig or set-up than the others, told from their rigs before any long search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....beam import natural_frequencies
from ....core.errors import RecordError
from ....core.overview import few
from ....rig import Rig
from ...records.prepared import PreparedRecord
from ..misfit import relative_error
from ..rig_fit import RigFit
from ..rig_update import RigUpdate
from ..spectra import rms
from .assessment import SOUND_SHARE, SUSPECT_MISFIT, Assessment

__all__ = ["require_one_rig"]

THIN = 10  # every so many-th spectral line tells whether records are of one rig
SUSPECT = SUSPECT_MISFIT / 100
APART = 3.0  # times the misfit of a rig fitted to a record alone, beyond which another does not fit; sound benches: 1.3
LISTED = 4  # channels, records and natural frequencies that are named


@dataclass
class _RigRecords:
    """Records of one rig."""

    update: RigUpdate  #: the rig, updated to some of them
    records: list[PreparedRecord]
    missed: list[np.ndarray]  #: (n_channels,) misfit of each of them on a rig fitted to it alone, or on this one


def require_one_rig(rig: Rig, records: Sequence[PreparedRecord]) -> None:
    """Refuse records that are of several rigs: each fits another rig, and no rig fits all.

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
        If there are; names the records that do not fit, and the channels and natural frequencies that tell it.
    """
    if not all(record.probes for record in records):
        records = [record.without_probes() for record in records]
    groups, contradicted, largest = list[_RigRecords](), set[str](), 0.0
    for record in records if len(records) > 1 else ():
        shares = [_misfit(group.update, record) for group in groups]
        if fitting := [i for i, ratio in enumerate(shares) if np.nanmax(ratio) <= SUSPECT]:
            groups[fitting[0]].records.append(record)
            groups[fitting[0]].missed.append(shares[fitting[0]])
            continue
        alone = RigFit(rig, [record], THIN).run()
        own_misfit = alone.misfit[0].relative_error
        if np.nanquantile(own_misfit, SOUND_SHARE) <= SUSPECT < np.nanmax(own_misfit):
            continue  # a channel of this record is wrong, not its rig
        for group in groups:
            together = RigFit(rig, [*group.records, record], THIN).run()
            missed = np.array([m.relative_error for m in together.misfit])
            far = np.where(missed > APART * np.array([*group.missed, own_misfit]), missed, 0.0).max(axis=0)
            if far.max() <= SUSPECT:
                group.update = together
                group.records.append(record)
                group.missed.append(own_misfit)
                break
            contradicted |= {name for name, ratio in zip(together.channels, far.tolist()) if ratio > SUSPECT}
            largest = max(largest, float(far.max()))
        else:
            groups.append(_RigRecords(alone, [record], [own_misfit]))
    if len(groups) > 1:
        raise RecordError(_words(sorted(groups, key=_rank), sorted(contradicted), largest))


def _misfit(update: RigUpdate, record: PreparedRecord) -> np.ndarray:
    """Return the misfit (n_channels,) of a record on a rig that was updated to others, over the channels' levels."""
    fit = RigFit(update.start, [record], THIN)
    (spectra,), (projection,) = fit.spectra, fit.projected(fit.problem.at(update.values))
    return relative_error(rms(projection.fitted(fit.noise[0]) - spectra.measured), spectra.level)


def _rank(group: _RigRecords) -> tuple[int, float]:
    """Return the number of a rig's records and, to decide between equals, its distance to the rig file, negative."""
    return len(group.records), -max(map(abs, Assessment(group.update).shift.values()))


def _words(groups: Sequence[_RigRecords], channels: Sequence[str], missed: float) -> str:
    *others, last = groups
    theirs, ours = ([f'"{r.name}"' for g in part for r in g.records] for part in (others, [last]))
    who = f"record {theirs[0]} is" if len(theirs) == 1 else f"records {few(theirs, LISTED)} are"
    lowest = [natural_frequencies(group.update.rig, LISTED).tolist() for group in (others[0], last)]
    modes = " Hz against ".join(", ".join(f"{f:.3g}" for f in frequencies) for frequencies in lowest)
    most = max(float(np.nanmax(group.missed)) for group in groups)
    return (
        f"{who} not of the rig or set-up of {few(ours, LISTED)}: one rig for both misses "
        f"{few(channels, LISTED)} by up to {100 * missed:.0f} % of the level, one for each at most {100 * most:.1f} %; "
        f"their lowest natural frequencies are {modes} Hz; give each rig a dataset of its own"
    )
