"""Whether records can be identified from, and what they cannot tell."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence

import numpy as np

from ..beam import natural_frequencies
from ..errors import RecordError
from ..io.dataset import Record
from ..rig import Rig
from .wavelet import ridge

__all__ = ["IdentifiabilityWarning", "check_channel", "check_length", "check_records", "ridge_band", "warn_of_no_ridge"]

CLIPPED = 4
"""samples at the extreme of a channel, in runs of two or more, that count as clipping"""
NEAR = 0.9
"""of the extreme: from here on the channel's resolution is taken"""
STEEP = 10
"""resolutions: a smooth peak falls by less from its highest samples to the next, a clipped one by more"""
REST = 0.5
"""of the RMS about the median: an extreme nearer to the median is where the channel rests"""


class IdentifiabilityWarning(UserWarning):
    """Records do not tell everything that is to be identified; the message says what they still tell."""


def check_records(records: Sequence[Record]):
    """Refuse records with a channel that cannot be used; warn where the shaft never leaves the gap.

    Parameters
    ----------
    records : sequence of Record
        Records to identify from, of one rig.

    Raises
    ------
    RecordError
        For a channel that is not finite, constant or clipped. The message names record, channel and instant, and what
        can still be identified.

    Warns
    -----
    IdentifiabilityWarning
        If a probe never moves by its gap.
    """
    faults = {record.name: fault for record in records if (fault := _fault(record))}
    if faults:
        sound = ", ".join(f'"{r.name}"' for r in records if r.name not in faults)
        rest = f"; without it, the rest ({sound}) can be identified from" if sound else ""
        raise RecordError(f"{next(iter(faults.values()))}{rest}")
    _warn_of_no_contact(records)


def check_length(records: Sequence[Record], needed: float, methods: Mapping[str, float]):
    """Refuse records that are all too short.

    Parameters
    ----------
    records : sequence of Record
        Records to identify from.
    needed : float
        s, that one of them must last.
    methods : mapping of str to float
        What every method needs, s, to name those for which a record is long enough.

    Raises
    ------
    RecordError
        If none is.
    """
    longest = max(records, key=lambda r: r.duration)
    if longest.duration < needed:
        enough = ", ".join(f"{name} ({s:.3g} s)" for name, s in methods.items() if s <= longest.duration)
        raise RecordError(
            f'the longest record, "{longest.name}", lasts {longest.duration:.3g} s; this method needs {needed:.3g} s; '
            f"{'long enough for ' + enough if enough else 'too short for any method'}"
        )


def ridge_band(rig: Rig) -> tuple[float, float]:
    """Hz, where the ridge of the lowest mode is looked for: it stiffens in contact.

    Parameters
    ----------
    rig : Rig
        The rig.
    """
    first, second = natural_frequencies(rig, 2)
    return float(first / 2), float((first + second) / 2)


def warn_of_no_ridge(record: Record):
    """Warn of probes whose lowest mode has no ridge above the noise.

    Parameters
    ----------
    record : Record
        With a probe at every bushing; others are passed over.

    Warns
    -----
    IdentifiabilityWarning
        Naming the bushings.
    """
    probes, band, without = record.response().displacement, ridge_band(record.rig), []
    for j, signal in enumerate([] if probes is None else probes.T):
        try:
            ridge(signal, record.fs, band)
        except RecordError:
            without.append(f"bushings[{j}]")
    if without:
        _warn(
            f'record "{record.name}": no ridge above the noise between {band[0]:.3g} and {band[1]:.3g} Hz at '
            f"{', '.join(without)}: forcing, noise or heavy damping hide the free vibration, and k(t), c(t) follow the "
            "largest component instead; force-balance, amplitude and output-error do not need a ridge"
        )


def check_channel(where: str, signal, fs: float):
    """Refuse a channel that is not finite, constant or clipped.

    Clipping shows as samples at the very extreme, two or more in a row, to which the signal comes steeply: a smooth
    peak that a coarse converter rounds to equal samples falls off by a few of its steps only.

    Parameters
    ----------
    where : str
        Record and channel, for the message.
    signal : array_like, shape (n_t,)
        Samples.
    fs : float
        Samples per second.

    Raises
    ------
    RecordError
        Saying which, from when on.
    """
    signal = np.asarray(signal, dtype=float)
    finite = np.isfinite(signal)
    if not finite.all():
        raise RecordError(f"{where} is not a finite number at {np.argmin(finite) / fs:g} s")
    if np.ptp(signal) <= 1e-12 * np.abs(signal).max():
        raise RecordError(f"{where} is constant ({signal[0]:g}); is the sensor connected?")
    for side in (signal, -signal):
        runs = _runs_at_the_top(side)
        if sum(stop - start for start, stop in runs) >= CLIPPED:
            first = runs[0][0]
            raise RecordError(f"{where} is clipped at {signal[first]:g} from {first / fs:g} s on; use a larger range")


def _runs_at_the_top(signal) -> list[tuple[int, int]]:
    """First sample and end of each steep run of two or more samples at the maximum."""
    middle, top = np.median(signal), signal.max()
    if top - middle <= REST * np.sqrt(np.mean((signal - middle) ** 2)):
        return []
    levels = np.unique(signal[signal > middle + NEAR * (top - middle)])
    resolution = np.diff(levels).min() if levels.size > 1 else 0.0
    edges = np.flatnonzero(np.diff(np.concatenate(([False], signal == top, [False])))).reshape(-1, 2)
    runs = [(int(a), int(b)) for a, b in edges if b - a > 1]
    return [(a, b) for a, b in runs if top - signal[max(a - 1, 0) : b + 1].min() > STEEP * resolution]


def _fault(record) -> str:
    """What makes a record useless, and what of it is still of use; "" if nothing does."""
    try:
        response = record.response()
    except RecordError as error:  # its file, read only now
        return str(error)
    probes = np.empty((0, 0)) if response.displacement is None else response.displacement.T
    channels = [
        ("excitation", response.excitation, "nothing can be identified from this record"),
        *(
            (f"accelerometer {name}", signal, _without(record.rig, sensor))
            for name, sensor, signal in zip(response.responses, record.rig.sensors, response.acceleration.T)
        ),
        *(
            (f"probe at bushings[{j}]", signal, "without the probes, constant and output-error still can be identified")
            for j, signal in enumerate(probes)
        ),
    ]
    for name, signal, remedy in channels:
        try:
            check_channel(f'record "{record.name}": {name}', signal, record.fs)
        except RecordError as error:
            return f"{error}; {remedy}"
    return ""


def _without(rig, sensor) -> str:
    if any(b.ends[0] <= sensor.position <= b.ends[1] for b in rig.bushings):
        return (
            f"without node {sensor.node} in the rig file the probe there is lost too; constant and output-error still "
            "can be identified"
        )
    return f"without node {sensor.node} in the rig file everything still can be identified"


def _warn_of_no_contact(records):
    probes = [d for record in records if (d := record.response().displacement) is not None]
    if not probes:
        return
    gaps = np.array([b.gap for b in records[0].rig.bushings])
    reached = np.max([np.abs(d).max(axis=0) for d in probes], axis=0)
    told = ", ".join(
        f"bushings[{j}] moves up to {1e3 * x:.3g} mm in a gap of {1e3 * d:.3g} mm"
        for j, (x, d) in enumerate(zip(reached, gaps))
        if x <= d
    )
    if np.all(reached <= gaps):
        _warn(f"no contact: {told}; contact stiffness and damping cannot be identified, the grease still can")
    elif told:
        _warn(f"no contact at one bushing: {told}; its contact is taken from the others, its grease still told")


def _warn(message):
    warnings.warn(message, IdentifiabilityWarning, stacklevel=2)
