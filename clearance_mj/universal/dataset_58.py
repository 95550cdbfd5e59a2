"""Data set 58, text or binary (58b): its header and its samples."""

from __future__ import annotations

import itertools
import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..core.checks import DIRECTIONS, NAME_LIMIT, NOWHERE, require_finite
from ..core.errors import RecordError
from .fields import DELIMITER, FileUnits, closing_line, decoded, read_dof, read_integer, read_real, with_exponents

TIME_FUNCTION, CROSS_SPECTRUM, FREQUENCY_RESPONSE, TRANSMISSIBILITY, COHERENCE = 1, 3, 4, 5, 6
TIME, FREQUENCY, UNSTATED_TYPES = 17, 18, (0, 1)
REAL32, REAL64, COMPLEX32, COMPLEX64 = 2, 4, 5, 6
CLOSE = re.compile(rb"(?:\r?\n)? {4}-1[ \t]*(?:\r?\n|\Z)")
_NUMBER = re.compile(rb"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:E[+-]?[0-9]{2,3}(?=[0-9]\.|[-+\s]|$))?")
REFERRED = (CROSS_SPECTRUM, FREQUENCY_RESPONSE, TRANSMISSIBILITY)  # function types that have a reference
FUNCTION_TYPES = (
    "general function", "time response", "auto spectrum", "cross spectrum", "frequency response function",
    "transmissibility", "coherence", "auto correlation", "cross correlation", "power spectral density",
    "energy spectral density", "probability density", "spectrum", "cumulative frequency distribution",
    "peaks and valleys", "stress over cycles", "strain over cycles", "orbit", "mode indicator function",
    "force pattern", "partial power", "partial coherence", "eigenvalue", "eigenvector", "shock response spectrum",
    "impulse response filter", "multiple coherence", "order function", "phase compensation",
)  # fmt: skip
"""Names of function types by their numbers"""
FIELDS = {
    "kind": (6, 0, 5, "function type"), "ordinate": (7, 0, 10, "ordinate data type"),
    "size": (7, 10, 20, "number of samples"), "even": (7, 20, 30, "abscissa spacing"),
    "abscissa_type": (8, 0, 10, "abscissa type"), "numerator": (9, 0, 10, "ordinate type"),
    "denominator": (10, 0, 10, "denominator type"),
}  # fmt: skip
"""Whole numbers of the header: record, columns and name of each"""
TEXTS = {
    "name": (1, 0, 80), "note": (2, 0, 80), "unit": (9, 46, 67), "unit_below": (10, 46, 67), "unit_title": (9, 25, 46),
    "axis_label": (8, 25, 46), "axis_unit": (8, 46, 67), "entity": (6, 31, 41),
}  # fmt: skip
"""Texts of the header: record and columns of each"""
CHOICES = {"ordinate": ((2, 4, 5, 6), "2, 4, 5 or 6"), "even": ((0, 1), "0 (uneven) or 1 (even)")}


@dataclass(frozen=True)
class Header:
    """Data set 58 without its samples."""

    kind: int  #: function type
    ordinate: int  #: precision of the samples: REAL32 ...
    size: int
    even: bool
    first: float  #: abscissa of the first sample, if even
    step: str  #: abscissa increment as it is written: its digits give its precision
    abscissa_type: int
    name: str = ""
    response: str = NOWHERE  #: degree of freedom, "3:+Z"
    reference: str = NOWHERE
    numerator: int = 0  #: specific data type
    denominator: int = 0
    unit: str = "NONE"  #: label of the ordinate's unit
    unit_below: str = "NONE"  #: label of the denominator's unit
    axis_label: str = "NONE"  #: quantity of the abscissa
    axis_unit: str = "NONE"
    entity: str = "NONE"  #: name of the place that responds
    unit_title: str = "NONE"  #: quantity of the ordinate
    note: str = "NONE"  #: second line of its description

    @property
    def type_name(self) -> str:
        """Function type in words."""
        return FUNCTION_TYPES[self.kind] if 0 <= self.kind < len(FUNCTION_TYPES) else f"function of type {self.kind}"

    def is_over(self, abscissa_type: int) -> bool:
        """Return True if its abscissa is of a type, or of an unstated one."""
        return self.abscissa_type in (abscissa_type, *UNSTATED_TYPES)

    @property
    def is_frf(self) -> bool:
        """True if it is a ratio over frequency."""
        return self.kind in (FREQUENCY_RESPONSE, TRANSMISSIBILITY) and self.is_over(FREQUENCY)

    @property
    def is_complex(self) -> bool:
        """True if the samples are complex."""
        return self.ordinate in (COMPLEX32, COMPLEX64)

    @property
    def is_double(self) -> bool:
        """True if they are of double precision."""
        return self.ordinate in (REAL64, COMPLEX64)

    @property
    def per_sample(self) -> int:
        """Numbers stored for each sample."""
        return 1 + self.is_complex + (not self.even)


@dataclass(frozen=True)
class Function(Header):
    """Data set 58 and where in the file its samples are."""

    number: int = 0  #: of the data set in the file, from 1
    begin: int = 0
    end: int = 0  #: bytes begin:end of the file are the samples
    dtype: str | None = None  #: of the ordinate in a binary body; None: text
    axis_dtype: str | None = None  #: of the abscissa in it
    units: FileUnits = field(default_factory=FileUnits)


def read_function(data: bytes, begin: int, binary: bool, number: int, units: FileUnits) -> tuple[Function, int]:
    """Return one data set 58, whose header begins at byte ``begin``, and where the next data set begins."""
    lines, body = _header_lines(data, begin)
    header = _parse_header(lines)
    dtype = axis_dtype = None
    if binary:
        order = _byte_order(lines[0])
        wide, end, position = _binary_end(data, body, header)
        dtype = order + ("f8" if header.is_double else "f4")
        axis_dtype = order + ("f8" if wide else "f4")
    else:
        end, position = closing_line(data, body)
        total = header.size * header.per_sample
        rows = sum(1 for line in data[body:end].splitlines() if line.strip())
        needed = -(-total // len(_columns(header)))
        if rows != needed and len(data[body:end].split()) != total:
            raise RecordError(
                f"header declares {header.size} samples, which is {needed} lines, but {rows} lines follow"
            )
    placed: dict[str, Any] = dict(number=number, begin=body, end=end, dtype=dtype, axis_dtype=axis_dtype, units=units)
    return Function(**vars(header) | placed), position


def _header_lines(data: bytes, begin: int) -> tuple[list[str], int]:
    """Return the line with the type and the eleven records after it, and where the samples begin."""
    lines = []
    for _ in range(12):
        end = data.find(b"\n", begin)
        if end < 0:
            raise RecordError("header is cut short; needs eleven lines")
        # The fields end at column 80; a "line" of a damaged file can be as long as the file.
        lines.append(decoded(data[begin : min(end, begin + 160)]))
        begin = end + 1
    return lines, begin


def _byte_order(line: str) -> str:
    """Return the byte order that the first line of a binary data set declares."""
    order, layout = read_integer(line[7:13], "byte ordering"), read_integer(line[13:19], "floating-point format")
    if order not in (1, 2) or layout != 2:
        raise RecordError(
            f"byte ordering {order} and floating-point format {layout} cannot be read; "
            "needs 1 or 2 (little, big endian) and 2 (IEEE 754)"
        )
    return "<" if order == 1 else ">"


def _binary_end(data: bytes, begin: int, header: Header) -> tuple[bool, int, int]:
    """Return True if abscissas are of double precision, where the samples end and where the next data set begins."""
    # The closing "    -1" must come just there: the byte count in the header is wrong in files by pyuff and others,
    # and a search could stop inside the samples. The format has abscissas of single precision only; many writers give
    # them that of the ordinate. The length of the body tells.
    narrow = header.size * (header.per_sample - (not header.even)) * (8 if header.is_double else 4)
    sizes = {wide: narrow + header.size * (not header.even) * (8 if wide else 4) for wide in (header.is_double, False)}
    for wide, size in sizes.items():
        if begin + size <= len(data) and (closing := CLOSE.match(data, begin + size)):
            return wide, begin + size, closing.end()
    if len(data) - begin in sizes.values():
        raise RecordError("has no closing '    -1' after its samples; the file is cut short")
    delimiter = CLOSE.search(data, begin)
    present = (delimiter.start() if delimiter else len(data)) - begin
    declared = " or ".join(str(size) for size in dict.fromkeys(sizes.values()))
    raise RecordError(
        f"header declares {header.size} samples, which is {declared} bytes, but {present} bytes follow"
        + ("" if delimiter else " and no closing '    -1'; the file is cut short or the header wrong")
    )


def _parse_header(lines: list[str]) -> Header:
    """Read records 1 to 11 of data set 58; ``lines[i]`` is record i."""
    values: dict[str, Any] = {
        name: read_integer(lines[record][begin:end], what) for name, (record, begin, end, what) in FIELDS.items()
    }
    for name, (allowed, words) in CHOICES.items():
        if values[name] not in allowed:
            raise RecordError(f"{FIELDS[name][3]} {values[name]} is unknown; needs {words}")
    if values["size"] < 1:
        raise RecordError(f"header declares {values['size']} samples; needs at least 1")
    step = lines[7][43:56].strip().upper().replace("D", "E")
    increment = read_real(step, "abscissa increment")
    if values["even"] and values["size"] > 1 and not increment > 0 and values["kind"] in range(1, 11):
        raise RecordError(f"abscissa increment {increment:g} must be > 0 for even spacing")
    if 0 < increment < 1e-300:
        raise RecordError(f"abscissa increment {increment:g} is too small")
    place = lines[6][66:76], lines[6][76:80]
    values |= {name: _printable(lines[record][begin:end]) for name, (record, begin, end) in TEXTS.items()}
    return Header(
        **values | {"even": values["even"] == 1}, step=step,
        response=read_dof(lines[6][41:51], lines[6][51:55], "response"),
        reference=read_dof(*place, "reference") if values["kind"] in REFERRED else _reference(*place),
        first=read_real(lines[7][30:43], "abscissa minimum"),
    )  # fmt: skip


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in text).strip()[:NAME_LIMIT].strip()


def _reference(node: str, direction: str) -> str:
    """Read the reference of a function that needs none, whatever a program left there."""
    try:
        return read_dof(node, direction, "reference")
    except RecordError:
        return NOWHERE


def _columns(header: Header) -> list[int]:
    """Return the widths of the numbers on one line of a text body."""
    if not header.is_double:
        return [13] * 6
    if header.even:
        return [20] * 4
    return [13, 20, 20] if header.is_complex else [13, 20, 13, 20]


def numbers(data: bytes, function: Function) -> np.ndarray:
    """Return (size, per_sample) numbers of the body as they are stored."""
    count = function.size * function.per_sample
    if function.dtype and (function.even or function.dtype == function.axis_dtype):
        values = np.frombuffer(data, function.dtype, count, function.begin)
    elif function.dtype:
        parts = np.dtype([("x", function.axis_dtype), ("y", function.dtype, (function.per_sample - 1,))])
        rows = np.frombuffer(data, parts, function.size, function.begin)
        values = np.column_stack((rows["x"], rows["y"])).ravel()
    else:
        values = _text_numbers(data[function.begin : function.end], _columns(function), count)
    place = f"data set {function.number}"
    if values.size != count:
        raise RecordError(f"{place}: holds {values.size} numbers, {function.size} samples need {count}")
    values = values.reshape(function.size, function.per_sample).astype(float)
    require_finite(values, place)
    return values


def _text_numbers(text: bytes, widths: list[int], count: int) -> np.ndarray:
    """Read ``count`` numbers: between blanks, in the columns of the format, or one after the other without either.

    Fortran leaves no blank between two numbers that fill their columns, and no E before an exponent of three digits;
    some programs use other columns, or fill the last line with zeros.
    """
    text = text.upper().replace(b"D", b"E")
    cuts = [slice(a, b) for a, b in itertools.pairwise(np.cumsum([0, *widths]))]
    attempts: list[np.ndarray] = []
    for cells in (
        text.split,
        lambda: with_exponents(text).split(),
        lambda: with_exponents(b"\n".join(line[cut].strip() for line in text.splitlines() for cut in cuts)).split(),
        lambda: _unseparated_numbers(text),
    ):
        words = cells()
        try:
            values = np.array(words, dtype=bytes).astype(float)
        except ValueError:
            values = np.full(len(words), np.nan)
        if count < len(words) < count + len(widths) and not values[count:].any():
            values = values[:count]
        if len(values) == count and np.isfinite(values).all():
            return values
        attempts.append(values)
    return next((values for values in attempts if values.size == count), attempts[0])


def _unseparated_numbers(text: bytes) -> list[bytes]:
    """Return numbers between which there may be no blanks; none if something else stands between them."""
    text = with_exponents(text, *([rb"(?=[0-9]\.|[-+\s]|$)"] * (b"E" in text)))
    words = _NUMBER.findall(text)
    return words if sum(map(len, words)) == len(b"".join(text.split())) else []


def samples(data: bytes, function: Function, scale: float = 1.0) -> np.ndarray:
    """Return (size,) ordinate of a function, times a scale."""
    parts = numbers(data, function)[:, not function.even :] * scale
    return (parts.view(complex) if function.is_complex else parts)[:, 0]


def function_block(header: Header, values: np.ndarray) -> bytes:
    """Return data set 58b, little endian."""
    node, direction = header.response.split(":")
    reference_node, reference_direction = header.reference.split(":")
    axis = {TIME: ("Time", "s"), FREQUENCY: ("Frequency", "Hz")}.get(header.abscissa_type)
    lines = [
        f"{58:6d}b{1:6d}{2:6d}{11:12d}{values.nbytes:12d}{0:6d}{0:6d}{0:12d}{0:12d}",
        *(f"{text:<80}" for text in (header.name, header.note, "NONE", "NONE", "NONE")),
        f"{header.kind:5d}{0:10d}{0:5d}{0:10d} {'NONE':<10}{int(node):10d}{DIRECTIONS[direction]:4d} "
        f"{'NONE':<10}{int(reference_node):10d}{DIRECTIONS[reference_direction]:4d}",
        f"{header.ordinate:10d}{header.size:10d}{header.even:10d}{header.first:13.5e}{header.step:>13}{0:13.5e}",
        _axis_line(header.abscissa_type, *axis or (header.axis_label, header.axis_unit)),
        _axis_line(header.numerator, "NONE", header.unit[:20]),
        _axis_line(header.denominator, "NONE", header.unit_below[:20]),
        _axis_line(0, "NONE", "NONE"),
    ]
    return (DELIMITER + "\n".join((*lines, ""))).encode() + values.tobytes() + DELIMITER.encode()


def spectrum_block(abscissa: np.ndarray, values: np.ndarray, **fields: Any) -> bytes:
    """Return the bytes of a data set of real or complex numbers in double precision; ``fields`` are of its `Header`.

    Its lines are even if six digits of the first and of their distance tell each exactly.
    """
    first, step = f"{abscissa[0]:.5e}", f"{np.ptp(abscissa[:2]):.5e}"
    lines = float(first) + np.arange(abscissa.size) * float(step)
    is_even = float(step) > 0 and np.array_equal(lines, abscissa)
    fields |= {"first": float(first), "step": step} if is_even else {"first": 0.0, "step": "0.0"}
    is_complex = np.iscomplexobj(values)
    header = Header(ordinate=COMPLEX64 if is_complex else REAL64, size=abscissa.size, even=is_even, **fields)
    columns = [*([] if is_even else [abscissa]), *([values.real, values.imag] if is_complex else [values])]
    return function_block(header, np.stack(columns, axis=1).astype("<f8"))


def _axis_line(kind: int, label: str, unit: str) -> str:
    return f"{kind:10d}{0:5d}{0:5d}{0:5d} {label:<20} {unit:<20}"
