"""A digital twin of a bench: gap, contact stiffness and contact damping of its clearances along a record.

The linear rig is updated to the first part of the record, the forces in the clearances follow from all channels, and
the belief about each clearance is refined window by window: every window begins with the last belief, widened by a
random walk. A change beyond what the windows' covariances explain is an alarm.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from tqdm import tqdm

from ...beam import natural_frequencies
from ...core.errors import RecordError
from ...core.kinds import checks_kinds
from ...estimate.parameter import Parameter
from ...io.dataset import Record
from ...linear.refusals import refuse_across
from ...model import Model
from ...rig import Rig
from ..forces.restoring import SETTLE, restoring_force
from ..forces.windows import WindowForces
from ..laws.families import families_of
from ..laws.measured_motion import FORCE_ERROR
from ..records.checks import warn_of_dropouts
from ..records.prepared import PreparedRecord, prepared
from ..structure.faults.contradictions import contradictions_of_rig, contradictions_of_update
from ..structure.priors import priors
from ..structure.updating import update_from
from .history import Twin
from .tracker import BLOCK, ClearanceTracker

__all__ = ["twin"]

MIN_PERIODS = 4  # of the lowest mode, in the shortest window


@checks_kinds
def twin(
    record: Record, model: Model | None = None, window: float = 2.0, learn: float = 10.0, rig_exact: bool = False,
    progress: bool = False,
) -> Twin:  # fmt: skip
    """Track the clearances of a bench over the time of a record.

    Parameters
    ----------
    record : Record
        Accelerometers, a displacement probe at every clearance, and the excitation.
    model : Model, optional
        Its rig is taken instead of the record's; the families of its law are tracked, and their fit begins at its
        values. By default the record's rig and the likeliest of all families, as method "bench" compares them.
    window : float
        s, between two values.
    learn : float
        s, first part of the record, to which the linear rig is updated and the clearances' laws are fitted. The law of
        a clearance that does not touch there is fitted to the last so many seconds, once it does.
    rig_exact : bool
        Take the rig for exact instead of updating it.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Twin

    Raises
    ------
    RecordError
        If the record is too short or lacks what is needed; the message says what.
    LawError
        If the law has a model without a family, or changes by itself.
    """
    refuse_across(model.rig if model else record.rig, "the twin of a bench")
    whole = _checked_record(dataclasses.replace(record, rig=model.rig) if model else record, window, learn)
    first = dataclasses.replace(whole, signals=whole.signals[: round(learn * whole.fs)])
    update = None if rig_exact else update_from(whole.rig, [first])
    warnings = contradictions_of_update(update) if update else contradictions_of_rig(whole.rig, [first])
    linear, probes = (update.rig, update.values) if update else (whole.rig, {})
    noise = restoring_force(first, rig=linear, probes=probes).noise
    windows = WindowForces(whole, linear, probes, noise, window)
    drawn = [windows.on(*each) for each in (update.drawn if update else ())]
    law_families = families_of(model.law, whole.rig) if model else [None] * len(linear.bushings)
    fitted_windows = max(2, round(learn / windows.seconds))
    trackers = [
        ClearanceTracker(linear, j, _gap_priors(whole.rig, j), families, fitted_windows, windows.seconds, drawn)
        for j, families in enumerate(law_families)
    ]
    return _track(windows, trackers, (*warnings, *(update.warnings if update else ())), progress)


def _track(
    windows: WindowForces, trackers: Sequence[ClearanceTracker], warnings: Sequence[str], progress: bool
) -> Twin:
    """Give every window to all trackers, and return their estimates as a twin."""
    count, n = len(windows), len(trackers)
    mean, std = np.full((2, 3, count, n), np.nan)
    contact, misfit = np.full((2, count, n), np.nan)
    time, alarms = SETTLE + windows.seconds * np.arange(1, count + 1), []
    for i, force in enumerate(tqdm(windows, total=count, desc="twin", unit="window", disable=not progress)):
        for j, tracker in enumerate(trackers):
            if estimate := tracker.take(force, i, float(time[i])):
                mean[:, i, j], std[:, i, j], contact[i, j], misfit[i, j], alarm = estimate
                alarms += [alarm] if alarm else []
    depth = np.array([tracker.depth for tracker in trackers])
    words = (*warnings, *filter(None, map(_warning, trackers)))
    return Twin(
        windows.name, windows.rig, time, windows.seconds, depth, mean, std, contact, misfit, tuple(alarms), words
    )


def _warning(tracker: ClearanceTracker) -> str:
    """Say that a clearance never touched, or that its law misses more than laws are expected to."""
    if tracker.fit is None:
        return f"bushings[{tracker.number}] hardly touches: gap and contact are not known"
    if tracker.fit.misfit <= 1.0:
        return ""
    return (
        f"bushings[{tracker.number}]: the likeliest law misses {100 * FORCE_ERROR * tracker.fit.misfit:.2g} % of the "
        f"force that it was fitted to, over {100 * FORCE_ERROR:g} %: gap and contact may be wrong by much more than "
        "the bands say"
    )


def _gap_priors(rig: Rig, number: int) -> list[Parameter]:
    """Priors of gap and offset; those that the rig file says to be exact have the usual ones, because they wear."""
    names = [f"bushings[{number}].{field}" for field in ("gap", "offset")]
    stated, usual = ({p.name: p for p in priors(each)} for each in (rig, rig.replace(tolerances=())))
    return [stated.get(name) or usual[name] for name in names]


def _checked_record(record: Record, window: float, learn: float) -> PreparedRecord:
    """Refuse a record from which nothing can be tracked; return it prepared."""
    where = f'record "{record.name}"'
    if not record.rig.bushings:
        raise RecordError(f"{where}: its rig has no bushings, so there is no clearance to follow")
    frequencies = natural_frequencies(record.rig, 1)
    shortest = max(2 * BLOCK, MIN_PERIODS / float(frequencies[0]) if frequencies[0] > 0 else 0.0)
    if not window >= shortest:
        raise RecordError(
            f"{where}: a window of {window:g} s is too short: it must hold {MIN_PERIODS} periods of the lowest mode "
            f"({frequencies[0]:.3g} Hz), {shortest:.3g} s or more"
        )
    if not learn >= 2 * window:
        raise RecordError(f"{where}: learns from {learn:g} s; needs two windows of {window:g} s or more")
    needed = learn + 2 * window + 2 * SETTLE
    if record.duration < needed:
        raise RecordError(
            f"{where}: lasts {record.duration:.4g} s; {needed:.4g} s are needed to learn from {learn:g} s "
            f"and to follow two windows of {window:g} s"
        )
    missing = [f"bushings[{j}] (node {label.partition(':')[0]})" for j, label in record.missing_probes]
    if missing and record.response().displacement is None:
        raise RecordError(
            f"{where}: has no displacement probe at {', '.join(missing)}; each clearance needs one, or its gap is not "
            'known (in a table, column "disp:NODE")'
        )
    whole = prepared(record)
    whole.require_usable()
    warn_of_dropouts(whole)
    return whole
