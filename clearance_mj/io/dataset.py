"""Datasets: a folder with a rig and the records that were measured on it.

``rig.toml``, ``dataset.toml`` with one ``[[records]]`` table per record, and one universal file per record. Loading
checks every file's structure against its size; the samples of a record are parsed when they are first used.
"""

from __future__ import annotations

import dataclasses
import math
import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import tomli_w

from ..errors import RecordError
from ..files import replacing
from ..rig import BASE_NODE, SHAKER_NODE, Rig
from ..signals.excitation import Excitation
from ..signals.response import Response
from .channels import Channel, ChannelHeader
from .uff import read_uff, scan_uff, write_uff

__all__ = ["BASE_NODE", "ROLES", "SHAKER_NODE", "Dataset", "Record", "bushing_nodes", "write_dataset"]

ROLES = ("identify", "validate")

_EXCITATIONS = {"base": (BASE_NODE, "acceleration"), "force": (SHAKER_NODE, "force")}
_NEEDS = "a dataset is a folder with rig.toml, dataset.toml and the .uff file of each record that it lists"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
_RATE_TOLERANCE = 1e-5  # A universal file writes six digits of the time step.


@dataclass(frozen=True, eq=False)
class Record:
    """One test: what was measured on a rig, and how it was driven.

    Raises
    ------
    RecordError
        If the channels do not fit each other, the rig or the excitation; the message names the record.
    """

    name: str
    """letters, digits, ".", "_", "-": it is also the name of its file"""
    role: str
    """ "identify" or "validate" """
    rig: Rig
    """what was measured"""
    fs: float
    """samples per second"""
    channels: Sequence[Channel]
    """time functions of one length and rate"""
    excitation_kind: str = "base"
    """ "base": acceleration of node 100; "force": force of node 200"""
    description: str = ""
    """the excitation in words"""
    level: float | None = None
    """RMS of the excitation, m/s² or N"""
    seed: int | None = None
    """of the excitation, if it was random"""
    band: tuple[float, float] | None = None
    """of the excitation, Hz"""
    provenance: dict = field(default_factory=dict)
    """where it comes from; plain data"""

    def __post_init__(self):
        try:
            self._check()
        except RecordError as error:
            raise RecordError(f'record "{self.name}": {error}') from None
        if not isinstance(self.channels, _FileChannels):
            object.__setattr__(self, "channels", tuple(self.channels))

    def _check(self):
        if not _NAME.fullmatch(self.name):
            raise RecordError("name must be letters, digits, '.', '_' and '-', at most 64")
        if self.role not in ROLES:
            raise RecordError(f'role "{self.role}" is unknown; use {" or ".join(ROLES)}')
        if self.excitation_kind not in _EXCITATIONS:
            raise RecordError(f'kind "{self.excitation_kind}" is unknown; use {" or ".join(_EXCITATIONS)}')
        if not 0 < self.fs < math.inf:
            raise RecordError(f"fs must be > 0 Hz, got {self.fs!r}")
        if self.level is not None and not 0 <= self.level < math.inf:
            raise RecordError(f"level must be >= 0, got {self.level!r}")
        if self.band is not None:
            low, high = self.band
            if not 0 <= low < high < math.inf:
                raise RecordError(f"band {low:g} to {high:g} must be two increasing frequencies in Hz")
            if self.fs < 2 * high:
                raise RecordError(f"fs {self.fs:g} Hz is below twice the band's upper end {high:g} Hz")
        self._check_channels(self._headers)

    def _check_channels(self, headers):
        if not headers:
            raise RecordError("has no channels")
        first, places = headers[0], {}
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
            other = places.setdefault((h.node, h.direction.lstrip("+-"), h.quantity), h)
            if other is not h:
                raise RecordError(
                    f'channels "{other.name}" and "{h.name}" both are {h.quantity} at node {h.node} along '
                    f"{h.direction.lstrip('+-')}"
                )
        node, quantity = _EXCITATIONS[self.excitation_kind]
        if (node, "Z", quantity) not in places:
            raise RecordError(
                f'has no {quantity} at node {node} along Z, which drives a record of kind "{self.excitation_kind}"'
            )
        for sensor in self.rig.sensors:
            if (sensor.node, "Z", "acceleration") not in places:
                raise RecordError(f"has no acceleration at node {sensor.node} along Z, a sensor of the rig")

    @property
    def _headers(self) -> Sequence[Channel | ChannelHeader]:
        return self.channels.headers if isinstance(self.channels, _FileChannels) else tuple(self.channels)

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
        """Return the measured excitation, to drive a simulation."""
        node, quantity = _EXCITATIONS[self.excitation_kind]
        description = {"generator": "record", "record": self.name, "excitation": self.description}
        description |= {k: v for k in ("level", "seed") if (v := getattr(self, k)) is not None}
        return Excitation(self._along_z(node, quantity), self.fs, self.excitation_kind, self.band, description)

    def response(self) -> Response:
        """Return what the rig's sensors measured.

        Returns
        -------
        Response
            ``acceleration`` (n_t, n_sensors) in the order of the rig's sensors; ``displacement`` (n_t, n_bushings) if
            every bushing has a probe: a displacement channel at the node of the sensor that sits in the bushing. A
            channel along -Z is turned round.
        """
        acceleration = [self._along_z(s.node, "acceleration") for s in self.rig.sensors]
        probes = [self._along_z(node, "displacement") for node in bushing_nodes(self.rig)]
        fitted = probes and all(p is not None for p in probes)
        node, quantity = _EXCITATIONS[self.excitation_kind]
        return Response(
            fs=self.fs,
            excitation=self._along_z(node, quantity),
            acceleration=np.stack(acceleration, axis=1),
            displacement=np.stack(probes, axis=1) if fitted else None,
            kind=self.excitation_kind,
            band=self.band,
            responses=tuple(self.rig.sensor_labels),
            reference=f"{node}:+Z",
            provenance={"record": self.name, "rig": self.rig.name, **self.provenance},
        )

    def _along_z(self, node, quantity) -> np.ndarray | None:
        """(n_t,) samples of a channel, positive along +Z."""
        for c in self.channels:
            if (c.node, c.quantity) == (node, quantity) and c.direction in ("+Z", "-Z"):
                return c.value if c.direction == "+Z" else -c.value
        return None


def bushing_nodes(rig: Rig) -> list[int | None]:
    """Node of the sensor that sits in each bushing, None where none does.

    Parameters
    ----------
    rig : Rig
        The rig.
    """
    nodes = []
    for bushing in rig.bushings:
        nearest = min(rig.sensors, key=lambda s: abs(s.position - bushing.position))
        inside = bushing.ends[0] <= nearest.position <= bushing.ends[1]
        nodes.append(nearest.node if inside else None)
    return nodes


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

    def __post_init__(self):
        if not self.records:
            raise RecordError("a dataset needs at least one record")
        seen = set()
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
    def load(cls, path) -> Dataset:
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
        tables = _read_list(path)
        rig = Rig.load(path / "rig.toml")
        where = path / "dataset.toml"
        records = tuple(_load_record(path, rig, f"{where}: records[{i}]", t) for i, t in enumerate(tables))
        try:
            return cls(rig, records, path)
        except RecordError as error:
            raise RecordError(f"{where}: {error}") from None


def write_dataset(path, rig: Rig, records: Sequence[Record]):
    """Write a dataset; each file is replaced once it is whole, the list of records last.

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
    rig.save(path / "rig.toml")
    for record in records:
        write_uff(path / f"{record.name}.uff", record)
    with replacing(path / "dataset.toml") as temporary:
        temporary.write_text(text, encoding="utf-8")


class _FileChannels(Sequence):
    """Channels of a file, read when the first of them is used."""

    def __init__(self, path: Path, headers: list[ChannelHeader], fs: float):
        self.path, self.headers, self.fs = path, headers, fs
        self._channels: tuple[Channel, ...] | None = None

    @property
    def opened(self) -> bool:
        return self._channels is not None

    def __len__(self):
        return len(self.headers)

    def __getitem__(self, index):
        if self._channels is None:
            # The list holds every digit of the rate, the file six.
            self._channels = tuple(dataclasses.replace(c, fs=self.fs) for c in read_uff(self.path))
        return self._channels[index]


# The list of records, dataset.toml: what a table may hold, and which of it must be there.

_REQUIRED = {"name": str, "file": str, "role": str, "fs": float}
_OPTIONAL = {
    "excitation": str,
    "kind": str,
    "level": float,
    "seed": int,
    "band": list,
    "provenance": dict,
}
_WORDS = {str: "a string", float: "a number", int: "a whole number", list: "a list of two numbers", dict: "a table"}


def _table(record: Record) -> dict:
    """Return what dataset.toml says of a record."""
    table = {
        "name": record.name,
        "file": f"{record.name}.uff",
        "role": record.role,
        "excitation": record.description,
        "kind": record.excitation_kind,
        "fs": float(record.fs),
    }
    if record.level is not None:
        table["level"] = float(record.level)
    if record.seed is not None:
        table["seed"] = int(record.seed)
    if record.band is not None:
        table["band"] = [float(f) for f in record.band]
    return table | {"provenance": dict(record.provenance)}


def _read_list(path: Path) -> list[dict]:
    """Read dataset.toml as far as the list of its tables."""
    where = path / "dataset.toml"
    try:
        data = tomllib.loads(where.read_text(encoding="utf-8"))
    except FileNotFoundError:
        missing = "is empty" if path.is_dir() and not any(path.iterdir()) else "has no dataset.toml"
        raise RecordError(f"{path}: {missing if path.is_dir() else 'does not exist'}; {_NEEDS}") from None
    except NotADirectoryError:
        raise RecordError(f"{path}: is not a folder; {_NEEDS}") from None
    except OSError as error:
        raise RecordError(f"{where}: cannot be read ({error.strerror})") from None
    except (ValueError, RecursionError) as error:
        raise RecordError(f"{where}: not valid TOML: {error}") from None
    tables = data.pop("records", None)
    if data:
        raise RecordError(f"{where}: {next(iter(data))} is not a known key; known: records")
    if not isinstance(tables, list) or not tables or not all(isinstance(t, dict) for t in tables):
        raise RecordError(f"{where}: needs a [[records]] table for each record")
    return tables


def _load_record(folder: Path, rig: Rig, where: str, table: dict) -> Record:
    try:
        values = _checked(table)
        file = values.pop("file")
        if Path(file).name != file or "\\" in file or not file.isprintable():
            raise RecordError(f'file "{file}" must be the name of a file in the folder')
    except RecordError as error:
        raise RecordError(f"{where}: {error}") from None
    headers = scan_uff(folder / file)
    try:
        return Record(
            rig=rig,
            channels=_FileChannels(folder / file, headers, values["fs"]),
            excitation_kind=values.pop("kind", "base"),
            description=values.pop("excitation", ""),
            **values,
        )
    except RecordError as error:
        raise RecordError(f"{where} ({file}): {error}") from None


def _checked(table: dict) -> dict:
    """Return the table with every value of the type that it needs."""
    types = _REQUIRED | _OPTIONAL
    for key in table:
        if key not in types:
            raise RecordError(f"{key} is not a known key; known: {', '.join(types)}")
    for key in _REQUIRED:
        if key not in table:
            raise RecordError(f"{key} is missing")
    values = {key: _typed(key, value, types[key]) for key, value in table.items()}
    if "band" in values:
        if len(values["band"]) != 2:
            raise RecordError(f"band must be {_WORDS[list]}, got {values['band']!r}")
        values["band"] = tuple(_typed("band", f, float) for f in values["band"])
    return values


def _typed(key, value, kind):
    fits = isinstance(value, int | float) if kind is float else isinstance(value, kind)
    if not fits or (isinstance(value, bool) and kind is not str):
        raise RecordError(f"{key} must be {_WORDS[kind]}, got {value!r}")
    if kind is not float:
        return value
    try:
        return float(value)
    except OverflowError:
        raise RecordError(f"{key} is a whole number too large to use") from None
