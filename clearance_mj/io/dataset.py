"""Datasets: a folder with a rig and the records that were measured on it.

``rig.toml``, ``dataset.toml`` with one ``[[records]]`` table per record, and one universal file per record. Loading
checks every file's structure against its size; the samples of a record are parsed when they are first used.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tomli_w
from pydantic import AfterValidator, Field

from ..core.checks import naming
from ..core.errors import RecordError
from ..core.files import write_text
from ..core.overview import HasOverview, Overview, few
from ..core.validation import NotNegative, Positive, Text, Whole, checked, from_plain, json_schema, read_plain, to_plain
from ..rig import BASE_NODE, SHAKER_NODE, Rig, Spin
from ..rig.instruments import Direction
from .record import RECORD_HEAD, Band, FileChannels, Kind, Record, RecordName, Role
from .uff import scan_uff, write_uff

__all__ = ["BASE_NODE", "ROLES", "SHAKER_NODE", "Dataset", "Record", "dataset_schema", "write_dataset"]

SHOWN_RECORDS = 20  # records that a dataset shows of itself in print
ROLES = ("identify", "validate", "sine", "orbit")

_NEEDS = "a dataset is a folder with rig.toml, dataset.toml and the .uff file of each record that it lists"


def _file_name(file: str) -> str:
    if Path(file).name != file or "\\" in file or not file.isprintable():
        raise ValueError(f'"{file}" must be the name of a file in the folder')
    return file


@dataclass(frozen=True, eq=False, repr=False)
class Dataset(HasOverview):
    """A rig and its records.

    Raises
    ------
    RecordError
        If there is no record, or two have the same name.
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
        # Names are file names, and some file systems do not tell "A" from "a".
        seen: set[str] = set()
        for name in (record.name for record in self.records):
            if name.lower() in seen:
                raise RecordError(
                    f'record name "{name}" is used twice; rename one, or delete its table in dataset.toml first'
                )
            seen.add(name.lower())

    def _overview(self) -> Overview:
        rows = [record.row() for record in self.records[:SHOWN_RECORDS]]
        hidden = len(self.records) - len(rows)
        facts = {
            "rig": f"{len(self.rig.bushings)} clearances, {len(self.rig.sensors)} sensors",
            "folder": "" if self.path is None else str(self.path),
            "records": f"{len(self.identify)} to identify, {len(self.validate)} to validate, {len(self.sines)} of sines"
            + (f", {len(self.orbits)} of orbits" if self.orbits else "")
            + (f"; the first {SHOWN_RECORDS}:" if hidden else ""),
        }
        return Overview(f"Dataset of rig “{self.rig.name}”", facts, [RECORD_HEAD, *rows])

    @property
    def identify(self) -> tuple[Record, ...]:
        """Records to identify from."""
        return tuple(r for r in self.records if r.role == "identify")

    def to_identify(self) -> tuple[Record, ...]:
        """Return the records to identify from, of which there must be one.

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

    @property
    def orbits(self) -> tuple[Record, ...]:
        """Records of a machine in operation, of which probes and keyphasor are known alone."""
        return tuple(r for r in self.records if r.role == "orbit")

    @property
    def is_synthetic(self) -> bool:
        """True if any record's provenance says that it was computed, not measured."""
        return any("synthetic" in str(r.provenance).lower() for r in self.records)

    @property
    def source(self) -> str:
        """Origin of the records in words: that of their provenance, or the files that they were read from."""
        sources = (r.provenance.get("source", r.provenance.get("file", "")) for r in self.records)
        return few(list(dict.fromkeys(str(name) for name in sources if name))) or "the dataset does not say"

    @property
    def sines(self) -> tuple[Record, ...]:
        """Records under stepped sines, to compare with a law's response to sines."""
        return tuple(r for r in self.records if r.role == "sine")

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
            raise RecordError(f"{path}: {_fault_of_folder(path)}; {_NEEDS}")
        data = read_plain(where, RecordError)
        rig = Rig.load(path / "rig.toml")
        try:
            entries = from_plain(_List, data, "", RecordError).records
            records = tuple(e.record(path, rig, f"records[{i}] ({e.file})") for i, e in enumerate(entries))
            return cls(rig, records, path)
        except RecordError as error:
            text = str(error)
            raise RecordError(text if text.startswith(str(path)) else f"{where}: {text}") from None


def _fault_of_folder(path: Path) -> str:
    if not path.is_dir():
        return "is not a folder" if path.exists() else "does not exist"
    return "has no dataset.toml" if any(path.iterdir()) else "is empty"


def write_dataset(path: str | Path, rig: Rig, records: Sequence[Record]) -> None:
    """Write a dataset, or add to one; each file is replaced once it is whole, the list of records last.

    Records that were read from the folder stay as they are, and so does its rig file if it holds the same rig; what is
    added is put to the end of the list, whose comments stay. Files that the rig's structure is read from are copied to
    the folder ``structure`` in it.

    Parameters
    ----------
    path : str or Path
        The folder; made if needed.
    rig : Rig
        The rig of all records.
    records : sequence of Record
        Records that were measured on the rig.

    Raises
    ------
    RecordError
        If a record is of another rig, two have one name, a provenance holds what TOML cannot, or a file is in the way
        that the folder's list of records does not name.
    """
    path = Path(path)
    with naming(path):
        records = Dataset(rig, tuple(records)).records
    for record in records:
        if record.rig != rig:
            raise RecordError(f'{path}: record "{record.name}" was measured on another rig, "{record.rig.name}"')
    stored = Dataset.load(path) if (path / "dataset.toml").exists() else None
    added = _records_to_append(records, stored) if stored else None
    new = [r for r in records if not _is_read_from(r, path / f"{r.name}.uff")] if added is None else added
    head = "" if added is None else (path / "dataset.toml").read_text(encoding="utf-8").rstrip() + "\n\n"
    with naming(f"{path}: a provenance holds what TOML cannot", TypeError, RecordError):
        text = head + tomli_w.dumps({"records": [_table(record) for record in (records if added is None else added)]})
    _refuse_foreign_files(path, rig, new, stored)
    if not (path / "rig.toml").exists() or (stored and stored.rig != rig):
        rig.copied(path / "structure").save(path / "rig.toml")
    for record in new:
        write_uff(path / f"{record.name}.uff", record)
    write_text(path / "dataset.toml", text)


def _records_to_append(records: Sequence[Record], stored: Dataset) -> list[Record] | None:
    """Return the records to append to a list whose others stay as they are; None if they do not, or it cannot go on."""
    first, new = records[: len(stored.records)], list(records[len(stored.records) :])
    if len(first) < len(stored.records) or not new or stored.path is None:
        return None
    for record, old in zip(first, stored.records):
        if not (_is_read_from(record, _file_of(old)) and _table(record) == _table(old)):
            return None
    last = (stored.path / "dataset.toml").read_text(encoding="utf-8").rpartition("[[")[2]
    return new if last.startswith("records]]") else None


def _file_of(record: Record) -> Path:
    assert isinstance(record.channels, FileChannels)
    return record.channels.path


def _is_read_from(record: Record, file: Path) -> bool:
    """Return True if the samples of a record are those of a file."""
    return isinstance(record.channels, FileChannels) and file.exists() and record.channels.path.samefile(file)


def _refuse_foreign_files(path: Path, rig: Rig, new: Sequence[Record], stored: Dataset | None) -> None:
    """Refuse to replace files that are not of the dataset in the folder."""
    listed_files = {_file_of(record).name for record in stored.records} if stored else set()
    for record in new:
        if os.path.lexists(path / f"{record.name}.uff") and f"{record.name}.uff" not in listed_files:
            raise RecordError(
                f"{path / record.name}.uff is there, but not in dataset.toml; move it away, or give another folder"
            )
    if stored is None and (path / "rig.toml").exists() and Rig.load(path / "rig.toml") != rig:
        raise RecordError(f"{path / 'rig.toml'} is there and holds another rig; move it away, or give another folder")


# The list of records, dataset.toml.


@checked(RecordError)
class _Entry:
    """A record of the list."""

    name: RecordName
    """letters, digits, ".", "_", "-" """
    file: Annotated[Text, AfterValidator(_file_name)]
    """universal file in the folder"""
    role: Role
    """identify: the clearance is identified from it; validate: kept back to test predictions on; sine: under a
    stepped sine, shown beside what a law does under sines; orbit: probes and keyphasor of a machine in operation"""
    fs: Positive
    """samples per second"""
    excitation: Text = ""
    """the excitation in words"""
    kind: Kind = "base"
    """base: acceleration of node 100; force: force of node 200; spin: the shaft's turning alone"""
    level: NotNegative | None = None
    """RMS of the excitation, m/s² or N"""
    seed: Whole | None = None
    """of the excitation, if it was random"""
    band: Band | None = None
    """of the excitation, Hz"""
    provenance: dict[str, Any] = field(default_factory=dict)
    """where it comes from"""
    direction: Direction | None = None
    """(x, y, z) along which the base moved or the force acted; None: that of the rig's shaker"""
    spin: Spin | None = None
    """how the shaft turned; None: as the rig file says"""
    left_out: tuple[Text, ...] = ()
    """accelerometers of the rig, such as "3:+Z", that were not recorded or cannot be used in this test"""

    def record(self, folder: Path, rig: Rig, where: str) -> Record:
        channels = FileChannels(folder / self.file, scan_uff(folder / self.file), self.fs)
        with naming(where):
            return Record(
                self.name, self.role, rig, self.fs, channels, self.kind, self.excitation, self.level, self.seed,
                self.band, self.provenance, self.direction, self.spin, self.left_out,
            )  # fmt: skip


@checked(RecordError)
class _List:
    """The records of a dataset."""

    records: Annotated[tuple[_Entry, ...], Field(min_length=1)]
    """one table for each record"""


def _table(record: Record) -> dict[str, Any]:
    """Return the table of a record in dataset.toml."""
    table: dict[str, Any] = {"name": record.name, "file": f"{record.name}.uff", "role": record.role}
    table |= {"excitation": record.description, "kind": record.excitation_kind}
    table |= {name: getattr(record, name) for name in ("fs", "level", "seed", "band", "provenance", "direction")}
    table |= {"spin": record.spin and to_plain(record.spin), "left_out": list(record.left_out) or None}
    return {key: value for key, value in table.items() if value is not None}


def dataset_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a dataset's list of records, dataset.toml."""
    return json_schema(_List, "clearance_mj dataset")
