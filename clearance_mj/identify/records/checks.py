"""Whether records can be identified from, and what they leave open."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence

import numpy as np

from ...beam import natural_frequencies
from ...core.errors import RecordError
from ...io.dataset import Dataset, Record
from ...rig import Rig, Sensor
from ..ridges.wavelet import ridge
from ..structure.contradictions import contradictions
from .channels import check_channel
from .dropouts import channels_of, lapses, zero_error

__all__ = ["IdentifiabilityWarning"]


class IdentifiabilityWarning(UserWarning):
    """Records do not identify everything that is asked for; the message says what they do."""


def check_records(records: Sequence[Record]) -> None:
    """Refuse records with a channel that cannot be used, saying what can; warn where the shaft stays in the gap."""
    faults = {record.name: fault for record in records if (fault := _fault(record))}
    if faults:
        sound = ", ".join(f'"{r.name}"' for r in records if r.name not in faults)
        rest = f"; without it, the rest ({sound}) can be identified from" if sound else ""
        raise RecordError(f"{next(iter(faults.values()))}{rest}")
    for record in records:
        warn_of_lapses(record)
    _warn_of_no_contact(records)


def warn_of_contradictions(dataset: Dataset) -> None:
    """Warn where the records contradict the rig file, with the likeliest cause."""
    for words in contradictions(dataset):
        _warn(words)


def check_length(records: Sequence[Record], needed: float, methods: Mapping[str, float]) -> None:
    """Refuse records that are all shorter than needed, s; say for which methods one is long enough."""
    longest = max(records, key=lambda r: r.duration)
    if longest.duration < needed:
        enough = ", ".join(f"{name} ({s:.3g} s)" for name, s in methods.items() if s <= longest.duration)
        raise RecordError(
            f'the longest record, "{longest.name}", lasts {longest.duration:.3g} s; this method needs {needed:.3g} s; '
            f"{'long enough for ' + enough if enough else 'too short for any method'}"
        )


def ridge_band(rig: Rig) -> tuple[float, float]:
    """Hz, where the ridge of the lowest mode is looked for: it stiffens in contact.

    Motion without a restoring force is no mode; a structure of one mode is followed up to twice its frequency.
    """
    found = natural_frequencies(rig, 8)
    first, *others = found[found > 0]
    return float(first / 2), float((first + (others[0] if others else 3 * first)) / 2)


def warn_of_no_ridge(record: Record) -> None:
    """Warn of probes whose lowest mode has no ridge above the noise."""
    probes, band, without = record.response().displacement, ridge_band(record.rig), []
    for j, signal in enumerate([] if probes is None else probes):
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


def _fault(record: Record) -> str:
    """What makes a record useless, and what of it is still of use; "" if nothing does."""
    try:
        response = record.response()
    except RecordError as error:  # its file, read only now
        return str(error)
    probes = np.empty((0, 0)) if response.displacement is None else response.displacement
    channels = [
        ("excitation", response.excitation, "nothing can be identified from this record"),
        *(
            (f"accelerometer {name}", signal, _without(record.rig, sensor))
            for name, sensor, signal in zip(response.responses, record.rig.sensors, response.acceleration)
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


def warn_of_lapses(record: Record) -> None:
    """Warn of dropouts and spikes, and of probes whose zero is off: what is found with them is off, too."""
    names, signals = zip(*channels_of(record))
    said = [f"{name} {words}" for name, words in zip(names, lapses(signals, record.fs)) if words]
    if said:
        _warn(f'record "{record.name}": {", ".join(said)}: as of a loose cable; repair the record, or leave it out')
    probes = [signal for name, signal in zip(names, signals) if name.startswith("probe")]
    for j, (signal, bushing) in enumerate(zip(probes, record.rig.bushings)):
        if words := zero_error(signal, bushing.gap):
            _warn(
                f'record "{record.name}": probe at bushings[{j}] {words}, beside a gap of {1e3 * bushing.gap:.3g} mm; '
                "probes read zero where the shaft rests, and walls are found where they say: subtract it"
            )


def _without(rig: Rig, sensor: Sensor) -> str:
    if sensor.label in rig.probe_labels:
        return (
            f"without node {sensor.node} in the rig file the probe there is lost too; constant and output-error still "
            "can be identified"
        )
    return f"without node {sensor.node} in the rig file everything still can be identified"


def _warn_of_no_contact(records: Sequence[Record]) -> None:
    probes = [d for record in records if (d := record.response().displacement) is not None]
    if not probes:
        return
    gaps, offsets = np.array([(b.gap, b.offset) for b in records[0].rig.bushings]).T
    reached = np.max([np.abs(d + offsets[:, None]).max(axis=1) for d in probes], axis=0)
    moves = ", ".join(
        f"bushings[{j}] moves up to {1e3 * x:.3g} mm in a gap of {1e3 * d:.3g} mm"
        for j, (x, d) in enumerate(zip(reached, gaps))
        if x <= d
    )
    if np.all(reached <= gaps):
        _warn(f"no contact: {moves}; contact stiffness and damping cannot be identified, the grease still can")
    elif moves:
        _warn(f"no contact at one bushing: {moves}; its contact is taken from the others, its grease is its own")


def _warn(message: str) -> None:
    warnings.warn(message, IdentifiabilityWarning, stacklevel=2)
