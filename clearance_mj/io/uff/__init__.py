"""Universal files: time functions and FRFs in data sets 58, text or binary (58b).

Every size that a file declares is compared with the bytes that it holds before anything is allocated. Data sets 58 are
read and written here rather than by pyuff, whose version 2.5.8 drops the sets that a truncated file cuts off, takes
garbage for an empty file, writes double precision under a single-precision header, half the byte count for complex
values, today's date, and zero for nan. pyuff writes the plain headers (151, 164) and checks our files in the tests.
"""

from __future__ import annotations

from pathlib import Path

import pyuff

from ...errors import RecordError
from ...frf import FRF
from ..files import replacing
from ._dataset_58 import TIME_FUNCTION
from ._fields import DIRECTIONS, QUANTITIES
from ._frfs import frf_blocks, read_frf
from ._scan import find_functions
from .channels import Channel, ChannelHeader, channel_blocks, read_channel, read_channel_header

__all__ = ["DIRECTIONS", "QUANTITIES", "Channel", "ChannelHeader", "read_uff", "scan_uff", "write_uff"]


def read_uff(path) -> list[Channel] | FRF:
    """Read the time functions or the FRFs of a universal file.

    Parameters
    ----------
    path : str or Path
        A file with data sets 58, text or binary. Units are those of its data set 164; SI if there is none. Data sets
        of other kinds are passed over.

    Returns
    -------
    list of Channel or FRF
        Channels of a file with time functions; an FRF of a file with frequency response functions.

    Raises
    ------
    RecordError
        If the file is missing, damaged, holds neither or both, or holds what this package cannot use (uneven time
        steps, units outside SI, several references); the message names the file and the data set.
    """
    data = _contents(path)
    try:
        functions = find_functions(data)
        if functions[0].kind == TIME_FUNCTION:
            return [read_channel(data, f) for f in functions]
        return read_frf(data, functions)
    except RecordError as error:
        raise RecordError(f"{path}: {error}") from None


def scan_uff(path) -> list[ChannelHeader]:
    """Check the structure of a universal file of time functions and return their headers; samples stay unread.

    Parameters
    ----------
    path : str or Path
        As for `read_uff`.

    Returns
    -------
    list of ChannelHeader

    Raises
    ------
    RecordError
        As `read_uff`, except for samples that are not finite; also if the file holds FRFs.
    """
    data = _contents(path)
    try:
        functions = find_functions(data)
        if functions[0].kind != TIME_FUNCTION:
            raise RecordError("holds FRFs, needs time functions (data sets 58, function type 1)")
        return [read_channel_header(data, f) for f in functions]
    except RecordError as error:
        raise RecordError(f"{path}: {error}") from None


def write_uff(path, obj):
    """Write a binary universal file: header (151), SI units (164) and one data set 58b per function.

    The same object gives the same bytes: dates are fixed. Time functions are stored in single precision, FRFs (and
    their coherence) in double. The time step has at most 8 digits, so a rate such as 2048.123456789 Hz is rounded.

    Parameters
    ----------
    path : str or Path
        The file; an existing one is replaced once the new one is whole.
    obj : sequence of Channel, Record or FRF
        What to write.

    Raises
    ------
    RecordError
        If ``obj`` is none of these, is empty, or holds values that the format cannot.
    """
    try:
        blocks = frf_blocks(obj) if isinstance(obj, FRF) else channel_blocks(obj)
    except RecordError as error:
        raise RecordError(f"{path}: cannot be written: {error}") from None
    with replacing(path) as temporary:
        pyuff.UFF(str(temporary)).write_sets(_preamble(getattr(obj, "name", "NONE")), mode="overwrite")
        with temporary.open("ab") as file:
            file.writelines(blocks)


def _contents(path) -> bytes:
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise RecordError(f"{path}: cannot be read ({error.strerror})") from None


def _preamble(title: str) -> list[dict]:
    """Header and SI units as pyuff writes them. Without dates it would put in the present time."""
    date, time = "01-Jan-00", "00:00:00"
    header = {
        "type": 151,
        "model_name": "clearance_mj",
        "description": title,
        "db_app": "clearance_mj",
        "program": "clearance_mj",
        "version_db1": 0,
        "version_db2": 0,
        "file_type": 0,
        "date_db_created": date,
        "time_db_created": time,
        "date_db_saved": date,
        "time_db_saved": time,
        "date_file_written": date,
        "time_file_written": time,
    }
    units = {
        "type": 164,
        "units_code": 1,
        "units_description": "SI: Meter (newton)",
        "temp_mode": 1,
        "length": 1.0,
        "force": 1.0,
        "temp": 1.0,
        "temp_offset": 273.15,
    }
    return [header, units]
