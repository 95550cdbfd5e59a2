"""A digital twin of a bench: gap, contact stiffness and contact damping of its clearances along a record.

The linear rig is corrected by the first part of the record, the forces in the clearances follow from all channels
(`restoring_force`), and what is known of each clearance is refined window by window (`recursive`): every window begins
with the last belief, widened by a random walk. A change beyond what the windows' covariances explain is an alarm.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from tqdm import tqdm

from ...beam import natural_frequencies
from ...clearance.law import Law
from ...core.errors import RecordError
from ...estimate.parameter import Parameter
from ...io.dataset import Record
from ...rig import Rig
from ..forces.restoring import SETTLE, restoring_force
from ..forces.windows import WindowForces
from ..laws.force_fit import MODEL
from ..laws.law_families import families_of
from ..records.checks import warn_of_dropouts
from ..records.prepared import prepared
from ..structure.faults.contradictions import contradictions_of_rig, contradictions_of_update
from ..structure.priors import priors, rig_with
from ..structure.rig_update import RigUpdate
from ..structure.updating import update_from
from .tracker import BLOCK, QUANTITIES, Followed

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Alarm", "Twin", "twin"]

DRAWN = 8
"""rigs, by which it is found how wrong what is learnt may be"""
PERIODS = 4
"""of the lowest mode, in the shortest window"""
_UNITS = {
    "gap": "m", "stiffness": "N/m", "damping": "Ns/m", "grease stiffness": "N/m", "grease damping": "Ns/m",
}  # fmt: skip
NORMAL95 = 1.959963984540054


@dataclass(frozen=True)
class Alarm:
    """A change that a record shows."""

    time: float
    """s, end of the window that shows it"""
    since: float
    """s, beginning of the window in which it most likely began"""
    bushing: int
    """number"""
    quantity: str
    """ "gap", "stiffness" or "damping" """
    before: float
    """value, m, N/m or N s/m"""
    after: float
    """the same since"""

    def to_dict(self) -> dict[str, Any]:
        """Return the alarm as plain data, SI units."""
        return dataclasses.asdict(self)

    def __str__(self) -> str:
        scale, unit = (1e3, "mm") if self.quantity == "gap" else (1.0, _UNITS[self.quantity])
        return (
            f"{self.time:.4g} s: {self.quantity} of bushings[{self.bushing}] changed by "
            f"{100 * (self.after / self.before - 1):+.1f} % since {self.since:.4g} s, "
            f"{scale * self.before:.4g} to {scale * self.after:.4g} {unit}"
        )


@dataclass(frozen=True, eq=False)
class Twin:
    """What a record tells of its clearances over time, each value from what was measured by then.

    Stiffness and damping are those of the contact at `depth`: force over penetration, and its slope by speed.
    """

    record: str
    """name"""
    rig: Rig
    """as corrected by the first part of the record"""
    time: np.ndarray
    """(n,) s, ends of the windows"""
    window: float
    """s"""
    depth: np.ndarray
    """(n_bushings,) penetration, m, RMS of the part that was learnt from; nan if it never touched"""
    mean: np.ndarray
    """(3, n, n_bushings) logarithms of gap, stiffness and damping; nan while the gap is not known"""
    std: np.ndarray
    """(3, n, n_bushings) their standard deviations"""
    contact: np.ndarray
    """(n, n_bushings) share of the time in contact"""
    misfit: np.ndarray
    """(n, n_bushings) what the law misses of the force, over what it missed when it was learnt"""
    alarms: tuple[Alarm, ...]
    """in their order"""
    warnings: tuple[str, ...]
    """plain words on what not to rely on"""

    def value(self, quantity: str) -> np.ndarray:
        """Return the most likely values (n, n_bushings) of "gap", m, "stiffness", N/m, or "damping", N s/m.

        Parameters
        ----------
        quantity : str
            Its name.
        """
        return np.exp(self.mean[QUANTITIES.index(quantity)])

    def band(self, quantity: str) -> np.ndarray:
        """Return the limits (2, n, n_bushings) within which a quantity lies with a probability of 95 %.

        Parameters
        ----------
        quantity : str
            As of `value`.
        """
        number = QUANTITIES.index(quantity)
        half = NORMAL95 * self.std[number]
        return np.exp(self.mean[number] + np.array([-half, half]))

    def words(self) -> list[str]:
        """Say in a line for each clearance what is known of it at the end."""
        found = []
        for j in range(self.depth.size):
            known = np.flatnonzero(np.isfinite(self.mean[0, :, j]))
            if known.size:
                i, half = known[-1], NORMAL95 * self.std[:, known[-1], j]
                gap, k, c = np.exp(self.mean[:, i, j])
                found.append(
                    f"bushings[{j}] at {self.time[i]:.4g} s: gap {1e3 * gap:.4g} mm ± {100 * half[0]:.2g} %, stiffness "
                    f"{k:.4g} N/m ± {100 * half[1]:.2g} %, damping {c:.3g} N s/m ± {100 * half[2]:.2g} % "
                    f"(95 %, {1e3 * self.depth[j]:.3g} mm beyond the gap)"
                )
        return found

    def rows(self) -> list[dict[str, float]]:
        """Return a row of plain data for each window and clearance that is known: values with 95 % limits, SI units."""
        shown = {q: (self.value(q), *self.band(q)) for q in QUANTITIES}
        return [
            {"time_s": float(self.time[i]), "bushing": int(j)}
            | {
                f"{q}{end}_{_UNITS[q]}": float(values[i, j])
                for q, parts in shown.items()
                for end, values in zip(("", "_low", "_high"), parts)
            }
            | {"contact": float(self.contact[i, j]), "misfit": float(self.misfit[i, j])}
            for i, j in zip(*np.nonzero(np.isfinite(self.mean[0])))
        ]

    def to_xarray(self) -> xr.Dataset:
        """Return the histories as an xarray dataset: quantities by limit, time and bushing; SI units."""
        import xarray as xr

        data: dict[str, Any] = {
            q: (("limit", "time", "bushing"), np.stack((self.value(q), *self.band(q))), {"units": _UNITS[q]})
            for q in QUANTITIES
        }
        data |= {name: (("time", "bushing"), getattr(self, name), {"units": "1"}) for name in ("contact", "misfit")}
        coordinates: dict[str, Any] = {"limit": ["value", "low", "high"], "time": ("time", self.time, {"units": "s"})}
        coordinates |= {"bushing": np.arange(self.depth.size)}
        return xr.Dataset(data, coordinates, {"record": self.record, "rig": self.rig.name})


def twin(
    record: Record, rig: Rig | None = None, law: Law | None = None, window: float = 2.0, learn: float = 10.0,
    rig_exact: bool = False, progress: str | None = None,
) -> Twin:  # fmt: skip
    """Follow the clearances of a bench along a record.

    Parameters
    ----------
    record : Record
        Accelerometers, a displacement probe at every clearance, and the excitation.
    rig : Rig, optional
        Instead of the record's.
    law : Law, optional
        Whose kinds of contact and grease are followed, and where learning begins; by default the likeliest of the
        twelve families that method "bench" of `identify` compares.
    window : float
        s, between two values.
    learn : float
        s, first part of the record, from which the linear rig is corrected and the clearances' laws are learnt. A
        clearance that does not touch there is learnt from the last so many seconds, once it does.
    rig_exact : bool
        Take the rig for exact instead of correcting it.
    progress : str, optional
        Show a progress bar with this name.

    Returns
    -------
    Twin

    Raises
    ------
    RecordError
        If the record is too short or lacks what is needed; the message says what.
    LawError
        If the law is of a kind that cannot be followed.
    """
    record = record if rig is None else dataclasses.replace(record, rig=rig)
    _check(record, window, learn)
    whole = prepared(record)
    whole.require_usable()
    warn_of_dropouts(whole)
    first = dataclasses.replace(whole, signals=whole.signals[: round(learn * whole.fs)])
    update = None if rig_exact else update_from(record.rig, [first])
    said = contradictions_of_update(update) if update else contradictions_of_rig(record.rig, [first])
    linear, probes = (update.rig, update.values) if update else (record.rig, {})
    noise = restoring_force(first, rig=linear, probes=probes).noise
    windows = WindowForces(whole, linear, probes, noise, window)
    drawn = [windows.on(*each) for each in _drawn(update)]
    wanted = max(2, round(learn / windows.seconds))
    told: list[Any] = [(None, dict[str, float]())] * len(linear.bushings)
    if law:
        told = [((contact, grease), values) for contact, grease, values in families_of(law, record.rig)]
    followed = [
        Followed(linear, j, _of_gap(record.rig, j), families, values, wanted, windows.seconds, drawn)
        for j, (families, values) in enumerate(told)
    ]
    return _along(record, windows, followed, update, said, progress)


def _along(
    record: Record,
    windows: WindowForces,
    followed: list[Followed],
    update: RigUpdate | None,
    said: Sequence[str],
    progress: str | None,
) -> Twin:
    count, n = len(windows), len(followed)
    mean, std = np.full((2, 3, count, n), np.nan)
    contact, misfit = np.full((2, count, n), np.nan)
    time, alarms = SETTLE + windows.seconds * np.arange(1, count + 1), list[Alarm]()
    for i, force in enumerate(tqdm(windows, total=count, desc=progress, unit="window", disable=progress is None)):
        for j, one in enumerate(followed):
            if (seen := one.take(force, i)) is None:
                continue
            mean[:, i, j], std[:, i, j], contact[i, j], misfit[i, j] = seen[:4]
            if seen.alert:
                kind, since, before, after = seen.alert
                alarms.append(Alarm(float(time[i]), float(time[i] - since * windows.seconds), j, kind, before, after))
    never = [f"bushings[{j}] hardly touches: gap and contact are not known" for j in range(n) if not followed[j].fit]
    depth = np.array([one.depth for one in followed])
    words = (*said, *(update.warnings if update else ()), *never, *filter(None, map(_foreign, followed)))
    return Twin(
        record.name, windows.rig, time, windows.seconds, depth, mean, std, contact, misfit, tuple(alarms), words
    )


def _foreign(one: Followed) -> str:
    """Say that a clearance's law misses more than laws are expected to."""
    if one.fit is None or one.fit.misfit <= 1.0:
        return ""
    return (
        f"bushings[{one.number}]: the likeliest law misses {100 * MODEL * one.fit.misfit:.2g} % of the force where it "
        f"was learnt, over {100 * MODEL:g} %: gap and contact may be wrong by much more than the bands say"
    )


def _drawn(update: RigUpdate | None) -> list[tuple[Rig, dict[str, float]]]:
    """Rigs, and gains and places of probes, drawn from what is known of them."""
    if update is None:
        return []
    values = [dict(zip(update.estimates.names, row)) for row in update.estimates.draw(DRAWN).tolist()]
    return [(rig_with(update.start, each), each) for each in values]


def _of_gap(rig: Rig, number: int) -> list[Parameter]:
    """What is known before of gap and offset; also of those that the rig file says to be exact: they wear."""
    names = [f"bushings[{number}].{field}" for field in ("gap", "offset")]
    told, usual = ({p.name: p for p in priors(each)} for each in (rig, rig.replace(tolerances=())))
    return [told.get(name) or usual[name] for name in names]


def _check(record: Record, window: float, learn: float) -> None:
    where = f'record "{record.name}"'
    if not record.rig.bushings:
        raise RecordError(f"{where}: its rig has no bushings, so there is no clearance to follow")
    found = natural_frequencies(record.rig, 1)
    shortest = max(2 * BLOCK, PERIODS / float(found[0]) if found[0] > 0 else 0.0)
    if not window >= shortest:
        raise RecordError(
            f"{where}: a window of {window:g} s is too short: it must hold {PERIODS} periods of the lowest mode "
            f"({found[0]:.3g} Hz), {shortest:.3g} s or more"
        )
    if not learn >= 2 * window:
        raise RecordError(f"{where}: learns from {learn:g} s; needs two windows of {window:g} s or more")
    needed = learn + 2 * window + 2 * SETTLE
    if record.duration < needed:
        raise RecordError(
            f"{where}: lasts {record.duration:.4g} s; {needed:.4g} s are needed to learn from {learn:g} s "
            f"and to follow two windows of {window:g} s"
        )
    if missing := _without_probe(record):
        raise RecordError(
            f"{where}: has no displacement probe at {', '.join(missing)}; each clearance needs one, or its gap is not "
            'known (in a table, column "disp:NODE")'
        )


def _without_probe(record: Record) -> list[str]:
    """Bushings without a probe, and its node."""
    if record.response().displacement is not None:
        return []
    nodes = [label.partition(":")[0] for label in record.rig.probe_labels]
    seen = {str(c.node) for c in record.channels if c.quantity == "displacement"}
    return [f"bushings[{j}] (node {node})" for j, node in enumerate(nodes) if node not in seen]
