"""Checks of records to identify from, and warnings of what they do not identify."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence

import numpy as np

from ...core.errors import RecordError
from ...io.dataset import Record
from ...rig import Rig
from .dropouts import describe_dropouts, zero_error
from .prepared import EXCITATION, PreparedRecord, prepared

__all__ = [
    "IdentifiabilityWarning", "check_length", "check_records", "reached", "warn", "warn_of_dropouts",
    "warn_of_no_contact",
]  # fmt: skip


class IdentifiabilityWarning(UserWarning):
    """Records do not identify everything that is asked for; the message says what they do."""


def warn(message: str) -> None:
    """Warn of what records do not identify.

    Parameters
    ----------
    message : str
        The warning, a whole sentence.
    """
    warnings.warn(message, IdentifiabilityWarning, stacklevel=2)


def check_records(records: Sequence[Record | PreparedRecord]) -> tuple[PreparedRecord, ...]:
    """Return records prepared; refuse those with a channel that cannot be used; warn of dropouts.

    Parameters
    ----------
    records : sequence of Record
        Records of one rig.

    Raises
    ------
    RecordError
        Names a channel that cannot be used, and what still can be identified without it.
    """
    usable, faults = [], []
    for record in records:
        try:
            checked = prepared(record)
        except RecordError as error:  # its file, read only now
            faults.append(str(error))
            continue
        if checked.faults:
            channel, fault = min(checked.faults.items(), key=lambda each: each[0] != EXCITATION)  # which matters most
            faults.append(f"{fault}; {_remedy(channel)}")
        else:
            usable.append(checked)
    if faults:
        sound = ", ".join(f'"{record.name}"' for record in usable)
        remaining = f"; without it, the rest ({sound}) can be identified from" if sound else ""
        raise RecordError(f"{faults[0]}{remaining}")
    for record in usable:
        warn_of_dropouts(record)
    return tuple(usable)


def _remedy(channel: str) -> str:
    """Return in words what can be identified from a record without a channel."""
    kind, _, label = channel.partition(" ")
    if kind == EXCITATION:
        return "nothing can be identified from this record"
    if kind == "probe":
        return "without the probes, bench, output-error and constant still can be used"
    return f'with left_out = ["{label}"] for this record in dataset.toml everything still can be identified'


def check_length(records: Sequence[Record], needed: float, methods: Mapping[str, float]) -> None:
    """Refuse records that are all shorter than a method needs; say for which methods one is long enough.

    Parameters
    ----------
    records : sequence of Record
        To identify from.
    needed : float
        Seconds that a record must last.
    methods : mapping of str to float
        Seconds that each method needs, by its name.

    Raises
    ------
    RecordError
        If no record is long enough.
    """
    longest = max(records, key=lambda r: r.duration)
    if longest.duration < needed:
        enough = ", ".join(f"{name} ({s:.3g} s)" for name, s in methods.items() if s <= longest.duration)
        raise RecordError(
            f'the longest record, "{longest.name}", lasts {longest.duration:.3g} s; this method needs {needed:.3g} s; '
            f"{'long enough for ' + enough if enough else 'too short for any method'}"
        )


def warn_of_dropouts(record: PreparedRecord) -> None:
    """Warn of dropouts and spikes, and of probes whose zero is off: results with them are off, too.

    Parameters
    ----------
    record : PreparedRecord
        The record.
    """
    described = describe_dropouts(record.signals.T, record.fs)
    if said := [f"{name} {words}" for name, words in zip(record.channels, described) if words]:
        warn(f'record "{record.name}": {", ".join(said)}: as of a loose cable; repair the record, or leave it out')
    probes = () if record.displacement is None or record.rig.is_loaded else tuple(record.displacement)
    for j, (signal, bushing) in enumerate(zip(probes, record.rig.bushings)):
        if words := zero_error(signal, bushing.gap):
            warn(
                f'record "{record.name}": probe at bushings[{j}] {words}, beside a gap of {1e3 * bushing.gap:.3g} mm; '
                "probes read zero where the shaft rests, and walls are found where they say: subtract it"
            )


def reached(records: Sequence[PreparedRecord], rig: Rig) -> np.ndarray | None:
    """Return how far (n_bushings,), m, the shaft comes from the middle of its clearances; None without probes.

    Parameters
    ----------
    records : sequence of PreparedRecord
        Of one rig.
    rig : Rig
        With the offsets of a rig in a plane; in space the middle is that of the motion, as its rest is not known.
    """
    if not (probes := [d for record in records if (d := record.displacement) is not None]):
        return None
    reaches = [
        [np.ptp(d[rows], axis=1).max() / 2 if rig.is_loaded else np.abs(d[rows] + b.offset).max() for d in probes]
        for rows, b in zip(rig.clearance_rows, rig.bushings)
    ]
    return np.max(reaches, axis=1)


def warn_of_no_contact(records: Sequence[PreparedRecord], rig: Rig) -> None:
    """Warn where the shaft stays in the gaps of a rig, as far as probes show it.

    Parameters
    ----------
    records : sequence of PreparedRecord
        Of one rig.
    rig : Rig
        With the identified gaps, or those of the rig file where a method takes it for exact.
    """
    if (far := reached(records, rig)) is None:
        return
    gaps = np.array([b.gap for b in rig.bushings])
    moves = ", ".join(
        f"bushings[{j}] moves up to {1e3 * x:.3g} mm in a gap of {1e3 * d:.3g} mm"
        for j, (x, d) in enumerate(zip(far, gaps))
        if x <= d
    )
    if np.all(far <= gaps):
        warn(f"no contact: {moves}; contact stiffness and damping cannot be identified, the filling's still can")
    elif moves:
        warn(f"no contact at one bushing: {moves}; its contact is taken from the others, its filling is its own")
