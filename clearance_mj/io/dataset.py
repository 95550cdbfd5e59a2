"""Datasets: a folder with a rig and the records that were measured on it.

``rig.toml``, ``dataset.toml`` with one ``[[records]]`` table per record, and one universal file per record. Loading
checks every file's structure against its size; the samples of a record are parsed when they are first used.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal, overload

import numpy as np
import tomli_w
from pydantic import AfterValidator, Field, SkipValidation

from ..errors import RecordError
from ..files import replacing
from ..rig import BASE_NODE, SHAKER_NODE, Rig
from ..signals.excitation import Excitation
from ..signals.response import Response
from ..validation import NotNegative, Positive, Text, Whole, checked, from_plain, json_schema, read_plain
from .channels import Channel, ChannelHeader
from .uff import read_uff, scan_uff, write_uff

__all__ = ["BASE_NODE", "ROLES", "SHAKER_NODE", "Dataset", "Record", "dataset_schema", "write_dataset"]

ROLES = ("identify", "validate")

_QUANTITIES = {"base": "acceleration", "force": "force"}
_OTHER_SIGN = str.maketrans("+-", "-+")
_NEEDS = "a dataset is a folder with rig.toml, dataset.toml and the .uff file of each record that it lists"
_RATE_TOLERANCE = 1e-5  # A universal file writes six digits of the time step.


def _file_name(file: str) -> str:
    if Path(file).name != file or "\\" in file or not file.isprintable():
        raise ValueError(f'"{file}" must be the name of a file in the folder')
    return file


def _record_name(name: str) -> str:
    if not re.fullmatch(_NAME, name):
        raise ValueError("must be letters, digits, '.', '_' and '-', at most 64")
    return name


def _rising(band: tuple[float, float]) -> tuple[float, float]:
    if not band[0] < band[1]:
        raise ValueError(f"{band[0]:g} to {band[1]:g} must be two increasing frequencies in Hz")
    return band


_NAME = "[A-Za-z0-9][A-Za-z0-9._-]{0,63}"
_Name = Annotated[Text, Field(json_schema_extra={"pattern": f"^{_NAME}$"}), AfterValidator(_record_name)]
_Role = Literal["identify", "validate"]
_Kind = Literal["base", "force"]
_Band = Annotated[tuple[NotNegative, NotNegative], AfterValidator(_rising)]


@checked(RecordError, eq=False)
class Record:
    """One test: what was measured on a rig, and how it was excited.

    Raises
    ------
    RecordError
        If the channels do not fit each other, the rig or the excitation; the message names the record.
    """

    name: _Name
    """letters, digits, ".", "_", "-": it is also the name of its file"""
    role: _Role
    """ "identify" or "validate" """
    rig: Rig
    """what was measured"""
    fs: Positive
    """samples per second"""
    channels: SkipValidation[Sequence[Channel]]
    """time functions of one length and rate"""
    excitation_kind: _Kind = "base"
    """ "base": acceleration of node 100; "force": force of node 200"""
    description: Text = ""
    """the excitation in words"""
    level: NotNegative | None = None
    """RMS of the excitation, m/s² or N"""
    seed: Whole | None = None
    """of the excitation, if it was random"""
    band: _Band | None = None
    """of the excitation, Hz"""
    provenance: dict[str, Any] = field(default_factory=dict)
    """where it comes from; plain data"""

    def __post_init__(self) -> None:
        if not isinstance(self.channels, _FileChannels):
            object.__setattr__(self, "channels", tuple(self.channels))
        try:
            if self.band and self.fs < 2 * self.band[1]:
                raise RecordError(f"fs {self.fs:g} Hz is below twice the band's upper end {self.band[1]:g} Hz")
            self._check_channels(self._headers)
        except RecordError as error:
            raise RecordError(f'record "{self.name}": {error}') from None

    def _check_channels(self, headers: Sequence[Channel | ChannelHeader]) -> None:
        if not headers:
            raise RecordError("has no channels")
        first, seen = headers[0], dict[tuple[int, str, str], Channel | ChannelHeader]()
        for h in headers:
            if abs(h.fs / self.fs - 1) > _RATE_TOLERANCE:
                raise RecordError(f'channel "{h.name}" is sampled at {h.fs:g} Hz, the record at {self.fs:g} Hz')
            if h.size != first.size:
                raise RecordError(
                    f'channel "{h.name}" has {h.size} samples, channel "{first.name}" has {first.size}; '
                    "needs one length"
                )
            if abs(h.start - first.start) * self.fs > 0.01:
                raise RecordError(
                    f'channel "{h.name}" starts at {h.start:g} s, channel "{first.name}" at {first.start:g} s'
                )
            other = seen.setdefault((h.node, h.direction.lstrip("+-"), h.quantity), h)
            if other is not h:
                raise RecordError(
                    f'channels "{other.name}" and "{h.name}" both are {h.quantity} at node {h.node} along '
                    f"{h.direction.lstrip('+-')}"
                )
        label, quantity = self._driven
        needed = {(label, quantity): f'the excitation of a record of kind "{self.excitation_kind}"'}
        needed |= {(label, "acceleration"): "a sensor of the rig" for label in self.rig.sensor_labels}
        for (label, quantity), what in needed.items():
            node, _, axis = _split(label)
            if (node, axis, quantity) not in seen:
                raise RecordError(f"has no {quantity} at node {node} along {axis}, {what}")

    @property
    def _driven(self) -> tuple[str, str]:
        """Degree of freedom and quantity of the excitation."""
        return self.rig.shaker.label(self.excitation_kind), _QUANTITIES[self.excitation_kind]

    @property
    def _headers(self) -> Sequence[Channel | ChannelHeader]:
        return self.channels.headers if isinstance(self.channels, _FileChannels) else self.channels

    @property
    def opened(self) -> bool:
        """Whether the samples have been read from their file; always true of a record made in memory."""
        return not isinstance(self.channels, _FileChannels) or self.channels.opened

    @property
    def size(self) -> int:
        """Number of samples of each channel."""
        return self._headers[0].size

    @property
    def duration(self) -> float:
        """Duration in s."""
        return self.size / self.fs

    def excitation(self) -> Excitation:
        """Return the measured excitation, to simulate with."""
        description = {"generator": "record", "record": self.name, "excitation": self.description}
        description |= {k: v for k in ("level", "seed") if (v := getattr(self, k)) is not None}
        value = self._measured(self.channels)[self._driven]
        return Excitation(value, self.fs, self.excitation_kind, self.band, description)

    def response(self) -> Response:
        """Return what the rig's sensors measured.

        Returns
        -------
        Response
            ``acceleration`` (n_sensors, n_t) in the order of the rig's sensors; ``displacement`` (n_bushings, n_t) if
            every clearance has a probe, a displacement channel at its `Rig.probe_labels`. A channel of the other sign
            is turned round.
        """
        measured = self._measured(self.channels)
        probed = [(label, "displacement") for label in self.rig.probe_labels]
        has_probes = bool(probed) and all(probe in measured for probe in probed)
        return Response(
            fs=self.fs,
            excitation=measured[self._driven],
            acceleration=np.stack([measured[label, "acceleration"] for label in self.rig.sensor_labels]),
            displacement=np.stack([measured[probe] for probe in probed]) if has_probes else None,
            kind=self.excitation_kind,
            band=self.band,
            responses=tuple(self.rig.sensor_labels),
            reference=self._driven[0],
            provenance={"record": self.name, "rig": self.rig.name, **self.provenance},
        )

    @staticmethod
    def _measured(channels: Sequence[Channel]) -> dict[tuple[str, str], np.ndarray]:
        """(n_t,) samples of each degree of freedom, in either sign, and quantity."""
        found = {(c.label, c.quantity): c.value for c in channels}
        turned = {(f"{c.node}:{c.direction.translate(_OTHER_SIGN)}", c.quantity): -c.value for c in channels}
        return turned | found


def _split(label: str) -> tuple[int, str, str]:
    """Node, sign and axis of a degree of freedom."""
    node, direction = label.split(":")
    return int(node), direction[0], direction[1:]


@dataclass(frozen=True, eq=False)
class Dataset:
    """A rig and its records.

    Raises
    ------
    RecordError
        If there is no record or two share a name.
    """

    rig: Rig
    """the rig of all records"""
    records: tuple[Record, ...]
    """in the order of the list"""
    path: Path | None = None
    """the folder it was loaded from"""

    def __post_init__(self) -> None:
        if not self.records:
            raise RecordError("a dataset needs at least one record")
        seen: set[str] = set()
        for record in self.records:
            # Names are file names, and some file systems do not tell "A" from "a".
            if record.name.lower() in seen:
                raise RecordError(f'record name "{record.name}" is used twice')
            seen.add(record.name.lower())

    @property
    def identify(self) -> tuple[Record, ...]:
        """Records to identify from."""
        return tuple(r for r in self.records if r.role == "identify")

    def to_identify(self) -> tuple[Record, ...]:
        """Records to identify from, of which there must be one.

        Raises
        ------
        RecordError
            If there is none.
        """
        if not self.identify:
            raise RecordError(f'{self.path or "dataset"}: no record has role "identify", so nothing can be identified')
        return self.identify

    @property
    def validate(self) -> tuple[Record, ...]:
        """Records kept back, to test predictions on."""
        return tuple(r for r in self.records if r.role == "validate")

    @classmethod
    def load(cls, path: str | Path) -> Dataset:
        """Read a dataset and check it; the samples of a record are read when they are first used.

        Parameters
        ----------
        path : str or Path
            The folder.

        Raises
        ------
        RecordError
            If the folder, its list or a record's file is missing, damaged or contradicts the rest.
        RigError
            If the rig file is missing or impossible.
        """
        path = Path(path)
        where = path / "dataset.toml"
        if not where.exists():
            raise RecordError(f"{path}: {_what_is_wrong(path)}; {_NEEDS}")
        data = read_plain(where, RecordError)
        rig = Rig.load(path / "rig.toml")
        try:
            entries = from_plain(_List, data, "", RecordError).records
            records = tuple(e.record(path, rig, f"records[{i}] ({e.file})") for i, e in enumerate(entries))
            return cls(rig, records, path)
        except RecordError as error:
            text = str(error)
            raise RecordError(text if text.startswith(str(path)) else f"{where}: {text}") from None


def _what_is_wrong(path: Path) -> str:
    if not path.is_dir():
        return "is not a folder" if path.exists() else "does not exist"
    return "has no dataset.toml" if any(path.iterdir()) else "is empty"


def write_dataset(path: str | Path, rig: Rig, records: Sequence[Record]) -> None:
    """Write a dataset; each file is replaced once it is whole, the list of records last.

    Files that the rig's structure is read from are copied to the folder ``structure`` in it.

    Parameters
    ----------
    path : str or Path
        The folder; made if needed.
    rig : Rig
        The rig of all records.
    records : sequence of Record
        What was measured on it.

    Raises
    ------
    RecordError
        If a record is of another rig, two share a name, or a provenance holds what TOML cannot.
    """
    path = Path(path)
    try:
        records = Dataset(rig, tuple(records)).records
    except RecordError as error:
        raise RecordError(f"{path}: {error}") from None
    for record in records:
        if record.rig != rig:
            raise RecordError(f'{path}: record "{record.name}" was measured on another rig, "{record.rig.name}"')
    try:
        text = tomli_w.dumps({"records": [_table(record) for record in records]})
    except TypeError as error:
        raise RecordError(f"{path}: a provenance holds what TOML cannot: {error}") from None
    rig.copied(path / "structure").save(path / "rig.toml")
    for record in records:
        write_uff(path / f"{record.name}.uff", record)
    with replacing(path / "dataset.toml") as temporary:
        temporary.write_text(text, encoding="utf-8")


class _FileChannels(Sequence[Channel]):
    """Channels of a file, read when the first of them is used."""

    def __init__(self, path: Path, headers: list[ChannelHeader], fs: float) -> None:
        self.path, self.headers, self.fs = path, headers, fs
        self._channels: tuple[Channel, ...] | None = None

    @property
    def opened(self) -> bool:
        return self._channels is not None

    def __len__(self) -> int:
        return len(self.headers)

    @overload
    def __getitem__(self, index: int) -> Channel: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Channel]: ...
    def __getitem__(self, index: int | slice) -> Channel | Sequence[Channel]:
        if self._channels is None:
            found = read_uff(self.path)
            if not isinstance(found, list):
                raise RecordError(f"{self.path}: no longer holds time functions")
            # The list holds every digit of the rate, the file six.
            self._channels = tuple(dataclasses.replace(c, fs=self.fs) for c in found)
        return self._channels[index]


# The list of records, dataset.toml.


@checked(RecordError)
class _Entry:
    """A record of the list."""

    name: _Name
    """letters, digits, ".", "_", "-" """
    file: Annotated[Text, AfterValidator(_file_name)]
    """universal file in the folder"""
    role: _Role
    """identify: the clearance is identified from it; validate: kept back to test predictions on"""
    fs: Positive
    """samples per second"""
    excitation: Text = ""
    """the excitation in words"""
    kind: _Kind = "base"
    """base: acceleration of node 100; force: force of node 200"""
    level: NotNegative | None = None
    """RMS of the excitation, m/s² or N"""
    seed: Whole | None = None
    """of the excitation, if it was random"""
    band: _Band | None = None
    """of the excitation, Hz"""
    provenance: dict[str, Any] = field(default_factory=dict)
    """where it comes from"""

    def record(self, folder: Path, rig: Rig, where: str) -> Record:
        channels = _FileChannels(folder / self.file, scan_uff(folder / self.file), self.fs)
        of_excitation = self.kind, self.excitation, self.level, self.seed, self.band
        try:
            return Record(self.name, self.role, rig, self.fs, channels, *of_excitation, self.provenance)
        except RecordError as error:
            raise RecordError(f"{where}: {error}") from None


@checked(RecordError)
class _List:
    """The records of a dataset."""

    records: Annotated[tuple[_Entry, ...], Field(min_length=1)]
    """one table for each record"""


def _table(record: Record) -> dict[str, Any]:
    """Return what dataset.toml says of a record."""
    table = {
        "name": record.name,
        "file": f"{record.name}.uff",
        "role": record.role,
        "excitation": record.description,
        "kind": record.excitation_kind,
        "fs": record.fs,
        "level": record.level,
        "seed": record.seed,
        "band": record.band,
        "provenance": record.provenance,
    }
    return {key: value for key, value in table.items() if value is not None}


def dataset_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a dataset's list of records, dataset.toml."""
    return json_schema(_List, "clearance_mj dataset")
