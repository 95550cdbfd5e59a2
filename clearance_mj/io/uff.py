"""Universal files: time functions and FRFs in data sets 58, text or binary (58b).

Every size that a file declares is compared with the bytes that it holds before anything is allocated. Data sets 58 are
read and written here rather than by pyuff, whose version 2.5.8 drops the sets that a truncated file cuts off, takes
garbage for an empty file, writes double precision under a single-precision header, half the byte count for complex
values, today's date, and zero for nan. pyuff writes the plain headers (151, 164) and checks our files in the tests.
"""

from __future__ import annotations

import itertools
import re
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

import numpy as np
import pyuff

from ..errors import RecordError
from ..frf import FRF
from .files import replacing

__all__ = ["DIRECTIONS", "QUANTITIES", "Channel", "ChannelHeader", "read_uff", "scan_uff", "write_uff"]

_AXES = ("X", "Y", "Z", "RX", "RY", "RZ")
DIRECTIONS = {f"{s}{a}": int(f"{s}{i}") for s in "+-" for i, a in enumerate(_AXES, 1)} | {"S": 0}
"""Direction codes of data set 58; R for rotations, S for a scalar."""
QUANTITIES = {"displacement": 8, "velocity": 11, "acceleration": 12, "force": 13}
"""Specific data types of data set 58."""

_UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2", "force": "N"}
_TIME_FUNCTION, _FRF, _COHERENCE = 1, 4, 6
_TIME, _FREQUENCY, _UNKNOWN = 17, 18, (0, 1)
_REAL32, _REAL64, _COMPLEX32, _COMPLEX64 = 2, 4, 5, 6
_NAME_LIMIT = 72
"""Characters. A longer name could end its 80-character line in "    -1", where readers see a delimiter."""

_BLANK = re.compile(rb"\s*")
_OPEN = re.compile(rb"-1[ \t]*\r?\n")
_CLOSE = re.compile(rb"(?:\r?\n)? {4}-1[ \t]*(?:\r?\n|\Z)")
_CLOSING_LINE = re.compile(rb"^ {4}-1[ \t]*(?:\r?\n|\Z)", re.MULTILINE)
_KIND = re.compile(rb" *(\d{1,6})([bB]?)")
_INTEGER = re.compile(r"[+-]?[0-9]{1,10}")
_REAL = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)(E[+-]?[0-9]{1,3})?")
_DOF = re.compile(r"([0-9]{1,9}):(\S+)")


@dataclass(frozen=True, eq=False)
class Channel:
    """One measured time function in SI units.

    Raises
    ------
    RecordError
        For a value that no channel can have; the message names the channel.
    """

    name: str
    node: int
    direction: str
    """ "+X" to "-RZ", or "S" for a scalar"""
    quantity: str
    """ "acceleration" (m/s²), "velocity" (m/s), "displacement" (m) or "force" (N)"""
    value: np.ndarray
    """(n_t,)"""
    fs: float
    """samples per second"""
    start: float = 0.0
    """s, time of the first sample"""

    def __post_init__(self):
        name, value = self.name, np.ascontiguousarray(self.value, dtype=float)
        if not name or len(name) > _NAME_LIMIT or not name.isprintable() or name != name.strip():
            raise RecordError(f"channel name {name!r} must be 1 to {_NAME_LIMIT} printable characters")
        if not 0 <= self.node < 10**9:
            raise RecordError(f'channel "{name}": node {self.node} must be a whole number of at most 9 digits')
        if self.direction not in DIRECTIONS:
            raise RecordError(f'channel "{name}": direction "{self.direction}" is unknown; use {", ".join(DIRECTIONS)}')
        if self.quantity not in QUANTITIES:
            raise RecordError(f'channel "{name}": quantity "{self.quantity}" is unknown; use {", ".join(QUANTITIES)}')
        if value.ndim != 1 or not value.size:
            raise RecordError(f'channel "{name}" must be one row of samples, got shape {value.shape}')
        _require_finite(value, f'channel "{name}"')
        if not 0 < self.fs < np.inf or not np.isfinite(self.start):
            raise RecordError(f'channel "{name}": fs must be > 0 Hz and start finite, got {self.fs}, {self.start}')
        object.__setattr__(self, "value", value)

    @property
    def label(self) -> str:
        """Degree of freedom, such as "3:+Z"."""
        return f"{self.node}:{self.direction}"

    @property
    def size(self) -> int:
        """Number of samples."""
        return self.value.size


@dataclass(frozen=True)
class ChannelHeader:
    """What a file says of a time function, without its samples; the fields are those of `Channel`."""

    name: str
    node: int
    direction: str
    quantity: str
    size: int
    fs: float
    start: float


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
        functions = _functions(data)
        if functions[0].kind == _TIME_FUNCTION:
            return [_channel(data, f) for f in functions]
        return _frf(data, functions)
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
        functions = _functions(data)
        if functions[0].kind != _TIME_FUNCTION:
            raise RecordError("holds FRFs, needs time functions (data sets 58, function type 1)")
        return [_channel_header(data, f) for f in functions]
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
        blocks = _frf_blocks(obj) if isinstance(obj, FRF) else _channel_blocks(obj)
    except RecordError as error:
        raise RecordError(f"{path}: cannot be written: {error}") from None
    with replacing(path) as temporary:
        pyuff.UFF(str(temporary)).write_sets(_preamble(getattr(obj, "name", "NONE")), mode="overwrite")
        with temporary.open("ab") as file:
            file.writelines(blocks)


# Structure of a file


@dataclass(frozen=True)
class _Header:
    """Data set 58 without its samples."""

    name: str
    kind: int
    """function type"""
    response: str
    """degree of freedom, "3:+Z" """
    reference: str
    ordinate: int
    """precision of the samples: _REAL32 ..."""
    size: int
    even: bool
    first: float
    """abscissa of the first sample, if even"""
    step: str
    """abscissa increment as it is written: its digits tell how far it can be trusted"""
    abscissa_type: int
    numerator: int
    """specific data type"""
    denominator: int
    unit: str = "NONE"
    """label of the ordinate's unit"""

    @property
    def is_complex(self) -> bool:
        return self.ordinate in (_COMPLEX32, _COMPLEX64)

    @property
    def is_double(self) -> bool:
        return self.ordinate in (_REAL64, _COMPLEX64)

    @property
    def per_sample(self) -> int:
        """Numbers stored for each sample."""
        return 1 + self.is_complex + (not self.even)


@dataclass(frozen=True)
class _Function(_Header):
    """Data set 58 and where in the file its samples are."""

    number: int = 0
    """of the data set in the file, from 1"""
    begin: int = 0
    end: int = 0
    """bytes begin:end of the file are the samples"""
    dtype: str | None = None
    """of a binary body; None: text"""
    factors: tuple[float, float] = (1.0, 1.0)
    """units of length and force of the file in one SI unit"""

    @property
    def scale(self) -> float:
        """What to divide the samples by to have them in SI units."""
        length, force = self.factors
        units = dict.fromkeys(QUANTITIES.values(), length) | {QUANTITIES["force"]: force}
        return units.get(self.numerator, 1.0) / units.get(self.denominator, 1.0)


def _contents(path) -> bytes:
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise RecordError(f"{path}: cannot be read ({error.strerror})") from None


def _functions(data: bytes) -> list[_Function]:
    """Find the functions to read: all of time, or FRFs and coherences."""
    found = _scan(data)
    kinds = {f.kind for f in found}
    if _TIME_FUNCTION in kinds and _FRF in kinds:
        raise RecordError("holds both time functions and FRFs; put them into two files")
    if not kinds & {_TIME_FUNCTION, _FRF}:
        raise RecordError(
            "holds no time function (type 1) and no FRF (type 4) in data sets 58, "
            f"only function types {sorted(kinds) or 'none'}"
        )
    wanted = (_TIME_FUNCTION,) if _TIME_FUNCTION in kinds else (_FRF, _COHERENCE)
    return [f for f in found if f.kind in wanted]


def _scan(data: bytes) -> list[_Function]:
    """Walk over the data sets of a file, from delimiter to delimiter."""
    found, factors, number = [], (1.0, 1.0), 0
    position = _BLANK.match(data).end()
    while position < len(data):
        number += 1
        opening = _OPEN.match(data, position)
        if not opening:
            what = "not a universal file" if number == 1 else f"stray bytes before data set {number}"
            raise RecordError(f"{what}: needs a line '    -1' at byte {position}")
        kind = _KIND.match(data, opening.end())
        if not kind:
            raise RecordError(f"data set {number}: has no type, needs a number such as 58 after its '    -1'")
        try:
            if kind[1] == b"58":
                function, position = _function(data, opening.end(), bool(kind[2]), number, factors)
                found.append(function)
            else:
                end, position = _closing_line(data, opening.end())
            if kind[1] == b"164":
                factors = _unit_factors(data[opening.end() : end])
        except RecordError as error:
            raise RecordError(f"data set {number}: {error}") from None
        position = _BLANK.match(data, position).end()
    return found


def _closing_line(data: bytes, begin: int) -> tuple[int, int]:
    """Return where the text of a data set ends and where the next data set begins."""
    closing = _CLOSING_LINE.search(data, begin)
    if not closing:
        raise RecordError("has no closing line '    -1'; the file is cut short")
    return closing.start(), closing.end()


def _unit_factors(text: bytes) -> tuple[float, float]:
    """Units of length and of force in the file's system that make one SI unit (data set 164)."""
    lines = text.decode("ascii", "replace").splitlines()
    values = " ".join(lines[2:]).split()
    if len(values) < 2:
        raise RecordError("units need two factors, of length and of force, on their second record")
    length, force = (_real(v, f"factor of {name}") for v, name in zip(values, ("length", "force")))
    if min(length, force) <= 0:
        raise RecordError(f"factors of length and force must be > 0, got {length:g} and {force:g}")
    return length, force


def _function(data, begin, binary, number, factors):
    """Return one data set 58, whose header begins at byte ``begin``, and where the next data set begins."""
    lines, body = _header_lines(data, begin)
    header = _parse_header(lines)
    total = header.size * header.per_sample
    if binary:
        dtype = _byte_order(lines[0]) + ("f8" if header.is_double else "f4")
        end, position = _binary_end(data, body, header, np.dtype(dtype).itemsize * total)
    else:
        dtype = None
        end, position = _closing_line(data, body)
        rows = sum(1 for line in data[body:end].splitlines() if line.strip())
        needed = -(-total // len(_columns(header)))
        if rows != needed:
            raise RecordError(
                f"header declares {header.size} samples, which is {needed} lines, but {rows} lines follow"
            )
    return _Function(**vars(header), number=number, begin=body, end=end, dtype=dtype, factors=factors), position


def _header_lines(data: bytes, begin: int) -> tuple[list[str], int]:
    """Return the line with the type and the eleven records after it, and where the samples begin."""
    lines = []
    for _ in range(12):
        end = data.find(b"\n", begin)
        if end < 0:
            raise RecordError("header is cut short; needs eleven lines")
        # The fields end at column 80; a "line" of a damaged file can be as long as the file.
        lines.append(data[begin : min(end, begin + 160)].decode("utf-8", "replace"))
        begin = end + 1
    return lines, begin


def _byte_order(line: str) -> str:
    """Return the byte order that the first line of a binary data set declares."""
    order, layout = _integer(line[7:13], "byte ordering"), _integer(line[13:19], "floating-point format")
    if order not in (1, 2) or layout != 2:
        raise RecordError(
            f"byte ordering {order} and floating-point format {layout} cannot be read; "
            "needs 1 or 2 (little, big endian) and 2 (IEEE 754)"
        )
    return "<" if order == 1 else ">"


def _binary_end(data, begin, header, size) -> tuple[int, int]:
    """Return where a binary body of ``size`` bytes ends and where the next data set begins, if that fits the file."""
    # The closing "    -1" must come just there: the byte count in the header is wrong in files by pyuff and others,
    # and a search could stop inside the samples.
    closing = _CLOSE.match(data, begin + size) if begin + size <= len(data) else None
    if closing:
        return begin + size, closing.end()
    if len(data) == begin + size:
        raise RecordError("has no closing '    -1' after its samples; the file is cut short")
    found = _CLOSE.search(data, begin)
    present = (found.start() if found else len(data)) - begin
    raise RecordError(
        f"header declares {header.size} samples, which is {size} bytes, but {present} bytes follow"
        + ("" if found else " and no closing '    -1'; the file is cut short or the header wrong")
    )


def _parse_header(lines: list[str]) -> _Header:
    """Read records 1 to 11 of data set 58; ``lines[i]`` is record i."""
    kind = _integer(lines[6][0:5], "function type")
    ordinate, size = _integer(lines[7][0:10], "ordinate data type"), _integer(lines[7][10:20], "number of samples")
    spacing = _integer(lines[7][20:30], "abscissa spacing")
    if ordinate not in (_REAL32, _REAL64, _COMPLEX32, _COMPLEX64):
        raise RecordError(f"ordinate data type {ordinate} is unknown; needs 2, 4, 5 or 6")
    if size < 1:
        raise RecordError(f"header declares {size} samples; needs at least 1")
    if spacing not in (0, 1):
        raise RecordError(f"abscissa spacing {spacing} is unknown; needs 0 (uneven) or 1 (even)")
    first, step = _real(lines[7][30:43], "abscissa minimum"), lines[7][43:56].strip().upper().replace("D", "E")
    increment = _real(step, "abscissa increment")
    if spacing == 1 and not increment > 0 and kind in (_TIME_FUNCTION, _FRF, _COHERENCE):
        raise RecordError(f"abscissa increment {increment:g} must be > 0 for even spacing")
    if 0 < increment < 1e-300:
        raise RecordError(f"abscissa increment {increment:g} is too small")
    name = "".join(c if c.isprintable() else " " for c in lines[1][:80]).strip()[:_NAME_LIMIT].strip()
    return _Header(
        name=name,
        kind=kind,
        response=_dof(lines[6][41:51], lines[6][51:55], "response"),
        reference=_dof(lines[6][66:76], lines[6][76:80], "reference"),
        ordinate=ordinate,
        size=size,
        even=spacing == 1,
        first=first,
        step=step,
        abscissa_type=_integer(lines[8][0:10], "abscissa type"),
        numerator=_integer(lines[9][0:10], "ordinate type"),
        denominator=_integer(lines[10][0:10], "denominator type"),
        unit=lines[9][46:67].strip(),
    )


def _dof(node: str, direction: str, what: str) -> str:
    code = _integer(direction, f"{what} direction")
    names = [name for name, value in DIRECTIONS.items() if value == code]
    if not names:
        raise RecordError(f"{what} direction {code} is unknown; needs -6 to 6")
    number = _integer(node, f"{what} node")
    if not 0 <= number < 10**9:
        raise RecordError(f"{what} node {number} must be a whole number of at most 9 digits")
    return f"{number}:{names[0]}"


def _integer(text: str, what: str) -> int:
    text = text.strip()
    if text and not _INTEGER.fullmatch(text):
        raise RecordError(f"{what} is {text!r}, needs a whole number")
    return int(text or 0)  # Fortran reads a blank field as zero


def _real(text: str, what: str) -> float:
    text = text.strip().upper().replace("D", "E")
    if text and not _REAL.fullmatch(text):
        raise RecordError(f"{what} is {text!r}, needs a number")
    value = float(text or 0)
    if not np.isfinite(value):
        raise RecordError(f"{what} is {text!r}, needs a finite number")
    return value


# Samples


def _columns(header: _Header) -> list[int]:
    """Widths of the numbers on one line of a text body."""
    if not header.is_double:
        return [13] * 6
    if header.even:
        return [20] * 4
    return [13, 20, 20] if header.is_complex else [13, 20, 13, 20]


def _numbers(data: bytes, function: _Function) -> np.ndarray:
    """(size, per_sample) numbers of the body as they are stored."""
    count = function.size * function.per_sample
    if function.dtype:
        values = np.frombuffer(data, function.dtype, count, function.begin)
    else:
        values = _text_numbers(data[function.begin : function.end], _columns(function))
    if values.size != count:
        raise RecordError(
            f"data set {function.number}: holds {values.size} numbers, {function.size} samples need {count}"
        )
    values = values.reshape(function.size, function.per_sample).astype(float)
    _require_finite(values, f"data set {function.number}")
    return values


def _text_numbers(text: bytes, widths: list[int]) -> np.ndarray:
    """Cut fixed columns: Fortran leaves no blank between two numbers that fill theirs."""
    edges = np.cumsum([0, *widths])
    words = [
        word
        for line in text.upper().replace(b"D", b"E").splitlines()
        for a, b in itertools.pairwise(edges)
        if (word := line[a:b].strip())
    ]
    try:
        return np.array(words, dtype=bytes).astype(float)
    except ValueError:
        return np.full(len(words), np.nan)


def _samples(data: bytes, function: _Function) -> np.ndarray:
    """(size,) ordinate of a function in SI units."""
    parts = _numbers(data, function)[:, not function.even :] / function.scale
    return (parts.view(complex) if function.is_complex else parts)[:, 0]


def _require_finite(values: np.ndarray, what: str):
    finite = np.isfinite(values).reshape(len(values), -1).all(axis=1)
    if not finite.all():
        raise RecordError(f"{what}: sample {int(np.argmin(finite))} is not a finite number")


# Time functions


def _channel_header(data: bytes, function: _Function) -> ChannelHeader:
    try:
        quantity = _quantity(function.numerator, "ordinate")
        if function.is_complex:
            raise RecordError("a time function must be real, its ordinate data type is complex")
        if function.abscissa_type not in (_TIME, *_UNKNOWN):
            raise RecordError(f"abscissa type {function.abscissa_type} of a time function must be 17 (time)")
        _check_unit(function, (_UNITS[quantity],))
    except RecordError as error:
        raise RecordError(f"data set {function.number}: {error}") from None
    node, direction = function.response.split(":")
    fs, start = _timing(data, function)
    name = function.response if function.name in ("", "NONE") else function.name
    return ChannelHeader(name, int(node), direction, quantity, function.size, fs, start)


def _channel(data: bytes, function: _Function) -> Channel:
    header = _channel_header(data, function)
    value = _samples(data, function)
    return Channel(header.name, header.node, header.direction, header.quantity, value, header.fs, header.start)


def _quantity(code: int, what: str) -> str:
    for quantity, known in QUANTITIES.items():
        if code == known:
            return quantity
    known = ", ".join(f"{code} ({quantity})" for quantity, code in QUANTITIES.items())
    raise RecordError(f"{what} type {code} cannot be used; needs {known}")


def _check_unit(function: _Function, allowed: tuple[str, ...]):
    """Refuse a unit label that is not SI, such as "g": it overrides the file's unit factors."""
    plain = re.sub(r"[\s()\[\]^*]", "", function.unit.replace("²", "2")).lower()
    if plain in ("", "none"):
        return
    if plain not in [unit.replace("^", "").lower() for unit in allowed]:
        raise RecordError(f'unit "{function.unit}" is not SI; needs {" or ".join(allowed)}, or NONE')
    if function.factors != (1.0, 1.0):
        raise RecordError(f'unit "{function.unit}" contradicts the units of the file (data set 164), which are not SI')


def _timing(data: bytes, function: _Function) -> tuple[float, float]:
    """Sampling rate in Hz and time of the first sample in s."""
    if function.even:
        slack = 0.5 * 10.0 ** Decimal(function.step).as_tuple().exponent
        return _simplest_rate(float(function.step), slack), function.first
    time = _numbers(data, function)[:, 0]
    if time.size < 2:
        raise RecordError(f"data set {function.number}: needs two samples to tell its time step")
    step = (time[-1] - time[0]) / (time.size - 1)
    # Precision of the stored times: E13.5, single, double.
    digits = 5e-6 if not function.dtype else 6e-8 if not function.is_double else 1e-15
    slack = 2 * digits * np.abs(time).max()
    off = np.abs(time - (time[0] + step * np.arange(time.size))) > 1e-3 * step + slack
    if not step > slack or off.any():
        raise RecordError(
            f"data set {function.number}: its times are uneven at sample {int(np.argmax(off))} or have too few "
            "digits; needs one time step throughout"
        )
    return _simplest_rate(float(step), slack / (time.size - 1)), float(time[0])


def _simplest_rate(step: float, slack: float) -> float:
    """Return the rate with the fewest decimals whose time step is ``step`` within ``slack``.

    Six digits is all that the header holds of a time step: 1/2048 s is written as 4.88281e-04.
    """
    slack = 1.001 * min(slack, 1e-5 * step)
    for decimals in range(12):
        rate = round(1 / step, decimals)
        if rate > 0 and abs(1 / rate - step) <= slack:
            return rate
    return 1 / step


def _channel_blocks(obj) -> list[bytes]:
    try:
        channels = list(getattr(obj, "channels", obj))
    except TypeError:
        channels = [obj]
    for item in channels:
        if not isinstance(item, Channel):
            raise RecordError(f"needs a sequence of Channel, a Record or an FRF, got {type(item).__name__}")
    if not channels:
        raise RecordError("there is no channel")
    return [_channel_block(c) for c in channels]


def _channel_block(channel: Channel) -> bytes:
    if np.abs(channel.value).max() > np.finfo(np.float32).max:
        raise RecordError(f'channel "{channel.name}" exceeds single precision (3.4e38)')
    header = _Header(
        name=channel.name,
        kind=_TIME_FUNCTION,
        response=channel.label,
        reference="0:S",
        ordinate=_REAL32,
        size=channel.size,
        even=True,
        first=channel.start,
        step=_step_text(channel.fs),
        abscissa_type=_TIME,
        numerator=QUANTITIES[channel.quantity],
        denominator=0,
        unit=_UNITS[channel.quantity],
    )
    return _block(header, channel.value.astype("<f4"))


def _step_text(fs: float) -> str:
    """Write 1/fs in the usual six digits if reading gives fs again, or else in up to eight, which fill the field."""
    for digits in (5, 6, 7):
        text = f"{1 / fs:.{digits}e}"
        slack = 0.5 * 10.0 ** Decimal(text).as_tuple().exponent
        if _simplest_rate(float(text), slack) == fs:
            return text
    return text


# FRFs


def _frf(data: bytes, functions: list[_Function]) -> FRF:
    """Put the FRFs of a file, and their coherences, into one object."""
    parts = {}
    for f in functions:
        part = parts.setdefault(f.kind, {})
        if f.response in part:
            raise RecordError(f"data set {f.number}: response {f.response} comes twice")
        part[f.response] = f
    frfs, coherences = parts[_FRF], parts.get(_COHERENCE, {})
    first = next(iter(frfs.values()))
    quantity = _frf_quantity(first)
    frequency = _frequency(data, first)
    for f in functions:
        if f.kind == _FRF and f.reference != first.reference:
            raise RecordError(
                f"data set {f.number}: reference {f.reference}, data set {first.number} has {first.reference}; "
                "needs one reference per file"
            )
        if f.kind == _FRF and _frf_quantity(f) != quantity:
            raise RecordError(f"data set {f.number}: is {_frf_quantity(f)}, data set {first.number} is {quantity}")
        if not np.array_equal(_frequency(data, f), frequency):
            raise RecordError(f"data set {f.number}: its frequencies differ from data set {first.number}'s")
    value = np.array([_samples(data, f) for f in frfs.values()])
    coherence = None
    if coherences:
        missing = [label for label in frfs if label not in coherences]
        if missing or len(coherences) != len(frfs):
            raise RecordError(f"coherences and FRFs are not of the same responses: {missing or list(coherences)}")
        coherence = np.array([_samples(data, coherences[label]) for label in frfs])
    return FRF(frequency, value, coherence, tuple(frfs), first.reference, quantity)


def _frf_quantity(function: _Function) -> str:
    """Check that a function is an FRF of known quantities and name them "numerator/denominator"."""
    try:
        if not function.is_complex:
            raise RecordError("an FRF must be complex, its ordinate data type is real")
        if function.abscissa_type not in (_FREQUENCY, *_UNKNOWN):
            raise RecordError(f"abscissa type {function.abscissa_type} of an FRF must be 18 (frequency)")
        above, below = _quantity(function.numerator, "ordinate"), _quantity(function.denominator, "denominator")
        _check_unit(function, (_UNITS[above], f"{_UNITS[above]}/{_UNITS[below]}"))
    except RecordError as error:
        raise RecordError(f"data set {function.number}: {error}") from None
    return f"{above}/{below}"


def _frequency(data: bytes, function: _Function) -> np.ndarray:
    if function.even:
        return function.first + np.arange(function.size) * float(function.step)
    return _numbers(data, function)[:, 0]


def _frf_blocks(frf: FRF) -> list[bytes]:
    names = frf.quantity.split("/")
    if len(names) != 2 or not set(names) <= set(QUANTITIES):
        raise RecordError(f'quantity "{frf.quantity}" is unknown; needs two of {", ".join(QUANTITIES)} as a/b')
    _check_dof(frf.reference)
    # Six digits for the first frequency and the step, or every frequency in full.
    first, step = f"{frf.frequency[0]:.5e}", f"{np.ptp(frf.frequency[:2]):.5e}"
    even = np.array_equal(float(first) + np.arange(frf.frequency.size) * float(step), frf.frequency)
    even = even and float(step) > 0
    shared = {
        "reference": frf.reference,
        "size": frf.frequency.size,
        "even": bool(even),
        "first": float(first) if even else 0.0,
        "step": step if even else "0.0",
        "abscissa_type": _FREQUENCY,
    }
    numerator, denominator = (QUANTITIES[name] for name in names)
    unit = "{}/{}".format(*(f"({_UNITS[n]})" if "/" in _UNITS[n] else _UNITS[n] for n in names))
    blocks = []
    for label, value in zip(frf.responses, frf.value):
        _check_dof(label)
        _require_finite(value, f"FRF {label}")
        header = _Header(
            name=f"FRF {label} / {frf.reference}",
            kind=_FRF,
            response=label,
            ordinate=_COMPLEX64,
            numerator=numerator,
            denominator=denominator,
            unit=unit,
            **shared,
        )
        parts = (value.real, value.imag) if even else (frf.frequency, value.real, value.imag)
        blocks.append(_block(header, np.stack(parts, axis=1).astype("<f8")))
    for label, value in zip(frf.responses, () if frf.coherence is None else frf.coherence):
        _require_finite(value, f"coherence {label}")
        header = _Header(
            name=f"coherence {label} / {frf.reference}",
            kind=_COHERENCE,
            response=label,
            ordinate=_REAL64,
            numerator=0,
            denominator=0,
            **shared,
        )
        parts = (value,) if even else (frf.frequency, value)
        blocks.append(_block(header, np.stack(parts, axis=1).astype("<f8")))
    return blocks


def _check_dof(label: str):
    match = _DOF.fullmatch(label)
    if not match or match[2] not in DIRECTIONS:
        raise RecordError(f'degree of freedom "{label}" must be a node and a direction, such as "3:+Z"')


# Bytes


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


def _block(header: _Header, values: np.ndarray) -> bytes:
    """Data set 58b, little endian."""
    node, direction = header.response.split(":")
    reference_node, reference_direction = header.reference.split(":")
    axis = ("Time", "s") if header.abscissa_type == _TIME else ("Frequency", "Hz")
    lines = [
        f"{-1:6d}",
        f"{58:6d}b{1:6d}{2:6d}{11:12d}{values.nbytes:12d}{0:6d}{0:6d}{0:12d}{0:12d}",
        *(f"{text:<80}" for text in (header.name, "NONE", "NONE", "NONE", "NONE")),
        f"{header.kind:5d}{0:10d}{0:5d}{0:10d} {'NONE':<10}{int(node):10d}{DIRECTIONS[direction]:4d} "
        f"{'NONE':<10}{int(reference_node):10d}{DIRECTIONS[reference_direction]:4d}",
        f"{header.ordinate:10d}{header.size:10d}{header.even:10d}{header.first:13.5e}{header.step:>13}{0:13.5e}",
        _axis_line(header.abscissa_type, *axis),
        _axis_line(header.numerator, "NONE", header.unit),
        _axis_line(header.denominator, "NONE", "NONE"),
        _axis_line(0, "NONE", "NONE"),
    ]
    return "\n".join((*lines, "")).encode() + values.tobytes() + f"{-1:6d}\n".encode()


def _axis_line(kind: int, label: str, unit: str) -> str:
    return f"{kind:10d}{0:5d}{0:5d}{0:5d} {label:<20} {unit:<20}"
