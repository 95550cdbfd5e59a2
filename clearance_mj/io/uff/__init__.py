"""Universal files: functions (data sets 58, text or binary), modes (55, 2414), geometry (15, 18, 82, 2411, 2412, 2420).

pyuff 2.5.8,
which checks our files in the tests, returns the sets before the cut of a truncated file, ends binary samples at bytes
that look like a delimiter, cuts at blanks where the format has columns and says "Error when reading data-set(s)." of
whatever is wrong; it writes half the byte count of complex values, today's date, and zero for nan.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from os import PathLike
from typing import Any

from ...core.checks import DIRECTIONS, naming
from ...core.errors import RecordError
from ...core.files import replacing
from ...rig import Rig
from ...signals.ema import Modes
from ...signals.frf import FRF
from ...signals.spectra import Spectra
from ...structure.geometry import Geometry
from ...universal import contents, scan
from ...universal.dataset_58 import COHERENCE
from ...universal.dataset_164 import UNIT_SET, parse_units
from ...universal.fields import named_sets, text_set
from ...universal.mode_shapes import ModeShapes, mode_sets, read_modes
from ..channels import Channel, ChannelHeader
from ..contents import FileContents
from ..gaps import gapless_channels
from ..registry import Format, register
from .frfs import frf_blocks, read_frfs
from .functions import channel_block, distinct_names, is_of_time, read_channel_header, read_samples, why_no_record
from .geometry import GEOMETRY_SETS, geometry_sets, read_geometry_blocks, rig_geometry
from .spectra import read_spectra, spectra_blocks

__all__ = [
    "DIRECTIONS", "Channel", "ChannelHeader", "FileWarning", "Geometry", "read_geometry", "read_uff",
    "scan_uff", "write_uff",
]  # fmt: skip


class FileWarning(UserWarning):
    """Assumption about something that a file does not say."""


def read_uff(
    path: str | PathLike[str], reference: str | None = None, units: str | None = None, what: str | None = None
) -> list[Channel] | FRF | Spectra | Modes | Geometry | FileContents:
    """Read the time records or the FRFs of a universal file, or its other data.

    Parameters
    ----------
    path : str or Path
        A file with data sets 58, text or binary, modes (55, 2414), of which translations are read, or geometry (15, 18,
        82, 781, 2411, 2412, 2420). Units are those of its data set 164, SI if there is none, unless a function's own
        label says another, such as "g". Data sets of other kinds are passed over.
    reference : str, optional
        Reference, such as "5:+Z", to which FRFs are read.
    units : str, optional
        Units of the file, whatever its data set 164 says: "SI", or length and force, such as "mm,N".
    what : str, optional
        Part to return of a file that holds several, see `clearance_mj.io.contents.FileContents.pick`.

    Returns
    -------
    list of Channel, FRF, Spectra, Modes, Geometry or FileContents
        The time records or the FRFs if it holds one of them, whatever else it holds; otherwise its one kind of data,
        or all of several; `clearance_mj.read` returns all in any case. A quantity that is neither displacement,
        velocity, acceleration nor force is "unknown", its values as in the file.

    Raises
    ------
    RecordError
        If the file is missing, damaged, or holds none of these; the message names the file and the data set.
    """
    content = _read_contents(path, reference, units)
    with naming(path):
        if what:
            return content.pick(what)
        if bool(content.channels) != (len(content.frfs) == 1) and not len(content.frfs) > 1:
            return content.pick("channels" if content.channels else "frf")
    return _single_part(content)


def _read_contents(path: str | PathLike[str], reference: str | None, units: str | None) -> FileContents:
    data = contents(path)
    with naming(path):
        content, notes = _parse(data, reference, units)
    _warn(path, notes)
    return content


def _single_part(content: FileContents) -> list[Channel] | FRF | Spectra | Modes | Geometry | FileContents:
    parts = [*content.parts.values()]
    return parts[0] if len(parts) == 1 else content


def _read_all(
    path: str | PathLike[str], reference: str | None = None, units: str | None = None
) -> list[Channel] | FRF | Spectra | Modes | Geometry | FileContents:
    """Return all data of a universal file."""
    return _single_part(_read_contents(path, reference, units))


def _parse(data: bytes, reference: str | None, units: str | None) -> tuple[FileContents, list[str]]:
    """Return all data of a file, and notes on what was assumed."""
    functions, blocks, notes = scan(data, parse_units(units) if units else None)
    faults = {f.number: why_no_record(data, f) if is_of_time(f) else None for f in functions}
    records = [f for f in functions if faults[f.number] == ""]
    others = [f for f in functions if faults[f.number] != ""]
    words = "read as a function of time, not as a record"
    notes += [f"data set {number}: {fault}; {words}" for number, fault in faults.items() if fault]
    parts = [read_samples(data, f, notes, name) for f, name in zip(records, distinct_names(records))]
    channels = gapless_channels(parts, notes) if parts else []
    frfs, lone_coherences = read_frfs(data, others, reference, notes)
    other_functions = [f for f in others if not f.is_frf and f.kind != COHERENCE]
    spectra = read_spectra(data, [*other_functions, *lone_coherences]) if reference is None or not frfs else []
    geometry = read_geometry_blocks(blocks, notes)
    modes = tuple(_modes(shapes) for shapes in read_modes(blocks))
    content = FileContents(tuple(channels), tuple(frfs), tuple(spectra), modes, geometry)
    if not content.parts:
        kinds = named_sets(block.kind for block in blocks)
        raise RecordError(
            f"holds {f'data sets {kinds} only' if kinds else 'no data set'}; there is no function, mode or node in it"
        )
    return content, notes


def _warn(path: str | PathLike[str], notes: Sequence[str]) -> None:
    """Issue notes on what was assumed as warnings, of many only the first ones."""
    for note in notes[:MOST_NOTES]:
        warnings.warn(f"{path}: {note}", FileWarning, stacklevel=4)
    if len(notes) > MOST_NOTES:
        warnings.warn(f"{path}: and {len(notes) - MOST_NOTES} more notes like these", FileWarning, stacklevel=4)


MOST_NOTES = 5


def read_geometry(path: str | PathLike[str], units: str | None = None) -> Geometry:
    """Read the nodes, trace lines, elements and coordinate systems of a universal file.

    Parameters
    ----------
    path : str or Path
        The file.
    units : str, optional
        As `read_uff` takes it.
    """
    data = contents(path)
    with naming(path):
        _, blocks, notes = scan(data, parse_units(units) if units else None)
        if (geometry := read_geometry_blocks(blocks, notes)) is None:
            raise RecordError(f"holds no geometry (data sets {named_sets(GEOMETRY_SETS)})")
    _warn(path, notes)
    return geometry


def scan_uff(path: str | PathLike[str]) -> list[ChannelHeader]:
    """Check the structure of a universal file of time records and return their headers; samples stay unread."""
    data = contents(path)
    with naming(path):
        functions = scan(data).functions
        if records := [f for f in functions if is_of_time(f)]:
            return [read_channel_header(data, f, [], name) for f, name in zip(records, distinct_names(records))]
        kinds = ", ".join(dict.fromkeys(f"{f.kind} ({f.type_name})" for f in functions))
        raise RecordError(f"needs time records (data sets 58 of function type 1); its functions are {kinds or 'none'}")


def write_uff(path: str | PathLike[str], obj: object, rig: Rig | None = None) -> None:
    """Write a universal file: header (151), SI units (164) and one data set 58b per function, or 55 per mode.

    The same object gives the same bytes: dates are fixed. Time functions are stored in single precision, FRFs (and
    their coherence) and spectra in double, modes with the six digits of the format. The time step has at most 8 digits,
    so a rate such as 2048.123456789 Hz is rounded.

    Parameters
    ----------
    path : str or Path
        The file; an existing one is replaced once the new one is whole.
    obj : sequence of Channel, Record, FRF, Spectra, Modes, Geometry or FileContents
        Object that is written.
    rig : Rig, optional
        Rig whose nodes (15) and a trace line along each shaft (82) are written, too.

    Raises
    ------
    RecordError
        If ``obj`` is none of these, is empty, or holds values that the format cannot.
    """
    parts = list(obj.parts.values()) if isinstance(obj, FileContents) else [obj]
    with naming(f"{path}: cannot be written"):
        blocks = [block for part in parts for block in _blocks(part)]
    described = [_header(getattr(obj, "name", "NONE")), UNIT_SET, *(geometry_sets(rig_geometry(rig)) if rig else ())]
    with replacing(path) as temporary:
        temporary.write_bytes("".join(described).encode() + b"".join(blocks))


def _blocks(obj: Any) -> Iterable[bytes]:
    """Return the data sets of one object."""
    if isinstance(obj, Geometry):
        return [text.encode() for text in geometry_sets(obj)]
    if isinstance(obj, Modes):
        return [text.encode() for text in mode_sets(obj)]
    if isinstance(obj, FRF):
        return frf_blocks(obj)
    if isinstance(obj, Spectra):
        return [*spectra_blocks(obj)]
    return [channel_block(c) for c in _channels(obj)]


def _modes(shapes: ModeShapes) -> Modes:
    """Return shapes as they are scaled in the file, translations alone."""
    rows = [i for i, dof in enumerate(shapes.dofs) if "R" not in dof]
    return Modes(shapes.frequency, shapes.damping, shapes.shape[rows], tuple(shapes.dofs[i] for i in rows))


def _header(title: str) -> str:
    """Return data set 151, the file's title, with fixed dates: the same object gives the same bytes."""
    moment, program = f"{'01-Jan-00':<10}{'00:00:00':<10}", f"{'clearance_mj':<80}"
    return text_set(151, (program, f"{title:<80}", program, moment + f"{0:10d}" * 3, moment, program, moment))


def _channels(obj: object) -> list[Channel]:
    items = getattr(obj, "channels", obj)
    channels: list[Any] = [*items] if isinstance(items, Iterable) else [items]
    if wrong := [type(item).__name__ for item in channels if not isinstance(item, Channel)]:
        raise RecordError(f"needs a sequence of Channel, a Record or an FRF, got {wrong[0]}")
    if not channels:
        raise RecordError("there is no channel")
    return channels


register(Format(
    "UFF", (".uff", ".unv", ".uf", ".bunv", ".ufb"), (Channel, FRF, Spectra, Modes, Geometry), _read_all, write_uff,
    options=("reference", "units"), geometry=True,
    note="universal files, text or binary (58b); with `--rig` also nodes and trace lines",
))  # fmt: skip
