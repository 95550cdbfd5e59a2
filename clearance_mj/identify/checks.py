"""Whether records can be identified from, and what they cannot tell."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence

import numpy as np

from ..beam import natural_frequencies
from ..errors import RecordError
from ..io.dataset import Record
from ..rig import Rig
from .channels import check_channel
from .wavelet import ridge

__all__ = ["IdentifiabilityWarning", "check_length", "check_records", "ridge_band", "warn_of_no_ridge"]


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
