"""Universal files: time functions and FRFs (data sets 58, text or binary), modes (55, 2414), geometry (15, 82).

pyuff 2.5.8,
which checks our files in the tests, returns the sets before the cut of a truncated file, ends binary samples at bytes
that look like a delimiter, cuts at blanks where the format has columns and says "Error when reading data-set(s)." of
whatever is wrong; it writes half the byte count of complex values, today's date, and zero for nan.
"""

from __future__ import annotations

from collections.abc import Iterable
from os import PathLike

from ...core.checks import DIRECTIONS, QUANTITIES, naming
from ...core.errors import RecordError
from ...core.files import replacing
from ...rig import Rig
from ...signals.ema import Modes
from ...signals.frf import FRF
from ...universal import contents, scan
from ...universal.dataset_58 import COHERENCE, FREQUENCY_RESPONSE, TIME_FUNCTION, Function
from ...universal.dataset_164 import UNIT_SET
from ...universal.fields import Block, text_set
from ...universal.mode_shapes import KINDS, mode_sets, read_modes
from ..channels import Channel, ChannelHeader
from ..registry import Format, register
from .functions import channel_block, frf_blocks, read_channel, read_channel_header, read_frfs
from .geometry import Geometry, geometry_sets, read_geometry_blocks, rig_geometry

__all__ = [
    "DIRECTIONS",
    "QUANTITIES",
    "Channel",
    "ChannelHeader",
    "Geometry",
    "read_geometry",
    "read_uff",
    "scan_uff",
    "write_uff",
]


def read_uff(path: str | PathLike[str], reference: str | None = None) -> list[Channel] | FRF | Modes:
    """Read the time functions or the FRFs of a universal file, or the modes of a file without functions.

    Parameters
    ----------
    path : str or Path
        A file with data sets 58, text or binary, or with modes (55, 2414), of which translations are read. Units are
        those of its data set 164, SI if there is none, unless a function's own label says another, such as "g". Data
        sets of other kinds are passed over.
    reference : str, optional
        Reference, such as "5:+Z", to which FRFs are read; needed where others differ in lines or quantity.

    Returns
    -------
    list of Channel, FRF or Modes
        Channels of a file with time functions; an FRF of a file with frequency response functions; else modes.

    Raises
    ------
    RecordError
        If the file is missing, damaged, holds neither or both, or holds what this package cannot use (uneven time
        steps, unknown units); the message names the file and the data set.
    """
    data = contents(path)
    with naming(path):
        functions, blocks = scan(data)
        modes = [block for block in blocks if block.kind in KINDS]
        if modes and not functions:
            return _modes(modes)
        functions = _measured(functions)
        if functions[0].kind == TIME_FUNCTION:
            return [read_channel(data, f) for f in functions]
        return read_frfs(data, functions, reference)


def read_geometry(path: str | PathLike[str]) -> Geometry:
    """Read the nodes and trace lines of a universal file (data sets 15 and 82)."""
    data = contents(path)
    with naming(path):
        return read_geometry_blocks([block for block in scan(data).blocks if block.kind in (15, 82)])


def scan_uff(path: str | PathLike[str]) -> list[ChannelHeader]:
    """Check the structure of a universal file of time functions and return their headers; samples stay unread."""
    data = contents(path)
    with naming(path):
        functions = _measured(scan(data).functions)
        if functions[0].kind != TIME_FUNCTION:
            raise RecordError("holds FRFs, needs time functions (data sets 58, function type 1)")
        return [read_channel_header(data, f) for f in functions]


def write_uff(path: str | PathLike[str], obj: object, rig: Rig | None = None) -> None:
    """Write a universal file: header (151), SI units (164) and one data set 58b per function, or 55 per mode.

    The same object gives the same bytes: dates are fixed. Time functions are stored in single precision, FRFs (and
    their coherence) in double, modes with the six digits of the format. The time step has at most 8 digits, so a rate
    such as 2048.123456789 Hz is rounded.

    Parameters
    ----------
    path : str or Path
        The file; an existing one is replaced once the new one is whole.
    obj : sequence of Channel, Record, FRF or Modes
        Object that is written.
    rig : Rig, optional
        Rig whose nodes (15) and a trace line along each shaft (82) are written, too.

    Raises
    ------
    RecordError
        If ``obj`` is none of these, is empty, or holds values that the format cannot.
    """
    with naming(f"{path}: cannot be written"):
        if isinstance(obj, Modes):
            blocks = [text.encode() for text in mode_sets(obj)]
        elif isinstance(obj, FRF):
            blocks = frf_blocks(obj)
        else:
            blocks = [channel_block(c) for c in _channels(obj)]
    described = [_header(getattr(obj, "name", "NONE")), UNIT_SET, *(geometry_sets(rig_geometry(rig)) if rig else ())]
    with replacing(path) as temporary:
        temporary.write_bytes("".join(described).encode() + b"".join(blocks))


def _modes(blocks: list[Block]) -> Modes:
    """Shapes as they are scaled in the file, translations alone."""
    found = read_modes(blocks)
    rows = [i for i, dof in enumerate(found.dofs) if "R" not in dof]
    return Modes(found.frequency, found.damping, found.shape[rows], tuple(found.dofs[i] for i in rows))


def _header(title: str) -> str:
    """Data set 151, what the file is about, with fixed dates: the same object gives the same bytes."""
    moment, program = f"{'01-Jan-00':<10}{'00:00:00':<10}", f"{'clearance_mj':<80}"
    return text_set(151, (program, f"{title:<80}", program, moment + f"{0:10d}" * 3, moment, program, moment))


def _channels(obj: object) -> list[Channel]:
    found = getattr(obj, "channels", obj)
    channels: list[Channel] = []
    for item in found if isinstance(found, Iterable) else [found]:
        if not isinstance(item, Channel):
            raise RecordError(f"needs a sequence of Channel, a Record or an FRF, got {type(item).__name__}")
        channels.append(item)
    if not channels:
        raise RecordError("there is no channel")
    return channels


def _measured(found: list[Function]) -> list[Function]:
    """The functions to read: all of time, or FRFs and coherences."""
    kinds = {f.kind for f in found}
    if TIME_FUNCTION in kinds and FREQUENCY_RESPONSE in kinds:
        raise RecordError("holds both time functions and FRFs; put them into two files")
    if not kinds & {TIME_FUNCTION, FREQUENCY_RESPONSE}:
        raise RecordError(
            "holds no time function (type 1) and no FRF (type 4) in data sets 58, "
            f"only function types {sorted(kinds) or 'none'}"
        )
    wanted = (TIME_FUNCTION,) if TIME_FUNCTION in kinds else (FREQUENCY_RESPONSE, COHERENCE)
    return [f for f in found if f.kind in wanted]


register(Format(
    "UFF", (".uff", ".unv", ".uf"), (Channel, FRF, Modes), read_uff, write_uff, options=("reference",),
    geometry=True, note="universal files, text or binary (58b); with `--rig` also nodes and trace lines",
))  # fmt: skip
