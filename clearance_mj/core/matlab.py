"""The data elements of MATLAB files of version 5 to 7: numbers, sparse matrices, text, cells and structures of them.

MathWorks, MAT-File Format, 2023: a header of 128 bytes, then elements of a tag (type, size) and their data; an array
(type 14) is made of elements itself: flags, size, name, then numbers. Read here because scipy 1.17 takes the type of a
damaged element as an index, which ends the process, and makes room for as many cells as a file declares.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from typing import Any, TypeAlias

import numpy as np
import scipy.sparse

from .errors import RecordError
from .files import TOO_DENSE, most_unpacked

ARRAY, COMPRESSED = 14, 15
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
TEXT = {1: "utf-8", 2: "utf-8", 16: "utf-8", 4: "utf-16", 17: "utf-16", 18: "utf-32"}
CELL, STRUCTURE, CHARACTERS, SPARSE, NUMERIC = 1, 2, 4, 5, range(6, 16)
"""Classes of arrays; objects and functions are passed over"""
COMPLEX = 0x800
HEADER = 128
DEPTH = 8
Value: TypeAlias = np.ndarray | scipy.sparse.csc_array | str | list[Any] | dict[str, Any] | None
Element = tuple[int, bytes]  # type and data


def arrays(data: bytes, room: int | None = None) -> dict[str, Value]:
    """Return numbers, sparse matrices, texts, cells, arrays of structures (lists), structures (dict) by name.

    Compressed elements may unpack to ``room`` bytes; None: to what records do.
    """
    order = {b"IM": "<", b"MI": ">"}.get(data[126:HEADER])
    if order is None or data[124:126] not in (b"\x00\x01", b"\x01\x00"):
        raise RecordError("has no header of version 5 to 7")
    variables, room = {}, most_unpacked(len(data)) if room is None else room
    for kind, content in _elements(data[HEADER:], order, padded=False):
        if kind == COMPRESSED:
            content = _unpack(content, room)
            room -= len(content)
            kind, content = next(_elements(content, order), (0, b""))
        if kind != ARRAY:
            raise RecordError(f"holds an element of type {kind} where an array is expected")
        name, value = _array(content, order, DEPTH)
        variables[name] = value
    return variables


def _elements(data: bytes, order: str, padded: bool = True) -> Iterator[Element]:
    """Yield elements one after another; those within an array begin at multiples of eight bytes."""
    position = 0
    while position < len(data):
        if position + 8 > len(data):
            raise RecordError("is cut short in the tag of an element")
        kind, size = struct.unpack_from(f"{order}II", data, position)
        begin, limit = position + 8, len(data)
        following = begin + (-(-size // 8) * 8 if padded else size)
        if kind >> 16:  # up to four bytes of data within the tag
            kind, size, begin, limit = kind & 0xFFFF, kind >> 16, position + 4, position + 8
            following = limit
        if begin + size > limit:
            raise RecordError(f"is cut short: an element of {size} bytes, but {limit - begin} follow")
        if kind not in NUMBERS and kind not in TEXT and kind not in (ARRAY, COMPRESSED):
            raise RecordError(f"holds an element of the unknown type {kind}")
        yield kind, data[begin : begin + size]
        position = following


def _unpack(data: bytes, room: int) -> bytes:
    stream = zlib.decompressobj()
    try:
        content = stream.decompress(data, room + 1)
    except zlib.error as error:
        raise RecordError(f"a compressed element is damaged ({error})") from None
    if len(content) > room:
        raise RecordError(TOO_DENSE)
    if not stream.eof:
        raise RecordError("a compressed element is cut short")
    return content


def _array(data: bytes, order: str, depth: int) -> tuple[str, Value]:
    """Return the name and the value of an array."""
    if not depth:
        raise RecordError(f"holds cells more than {DEPTH} deep")
    if not (parts := list(_elements(data, order))):
        return "", None  # an empty cell
    if parts[0][0] != 6 or len(parts[0][1]) != 8:
        raise RecordError("an array does not begin with its flags")
    flags = struct.unpack_from(f"{order}I", parts[0][1])[0]
    kind = flags & 0xFF
    if kind not in (CELL, STRUCTURE, CHARACTERS, SPARSE, *NUMERIC) or len(parts) < 3:
        return "", None
    (_, size), (_, name), *content = parts[1:]
    shape = struct.unpack(f"{order}{len(size) // 4}I", size[: len(size) // 4 * 4])
    value: Value
    if kind == CELL:
        _require_all(shape, len(content))
        value = [_array(cell, order, depth - 1)[1] for cell_kind, cell in content if cell_kind == ARRAY]
    elif kind == STRUCTURE:
        several = _structures(content, order, depth)
        value = several[0] if len(several) == 1 else several
    elif kind == SPARSE:
        value = _sparse(content, shape, order)
    elif len(content) != 1 + bool(flags & COMPLEX):
        raise RecordError("an array does not hold its flags, size, name and numbers")
    elif kind == CHARACTERS:
        encoding = TEXT.get(content[0][0], "utf-8")
        text = content[0][1].decode(encoding + {"<": "-le", ">": "-be"}[order] * (encoding != "utf-8"), "replace")
        rows = shape[0] if len(shape) == 2 and len(text) == math.prod(shape) else 1
        value = text if rows < 2 else [text[row::rows] for row in range(rows)]  # a list of texts of equal length
    else:
        value = _numbers(content[0], shape, order)
        if flags & COMPLEX:
            value = value + 1j * _numbers(content[1], shape, order)
    return name.decode("latin-1").rstrip("\0"), value


def _structures(content: list[Element], order: str, depth: int) -> list[dict[str, Value]]:
    """Length and names of the fields, then an array for each of every structure."""
    (_, length), (_, names), *fields = content if len(content) > 1 else [(0, b"")] * 2
    width = struct.unpack(f"{order}i", length[:4].ljust(4, b"\0"))[0]
    keys = [names[i : i + width].split(b"\0")[0].decode("latin-1") for i in range(0, len(names), max(width, 1))]
    _require_all((len(fields) // max(len(keys), 1), len(keys)), len(fields))
    values = [_array(field, order, depth - 1)[1] if kind == ARRAY else None for kind, field in fields]
    return [dict(zip(keys, values[i : i + len(keys)])) for i in range(0, len(fields), max(len(keys), 1))]


def _sparse(content: list[Element], shape: tuple[int, ...], order: str) -> scipy.sparse.csc_array:
    """Rows and beginnings of the columns, then the numbers; room for more of them may follow."""
    if len(content) not in (3, 4) or len(shape) != 2:
        raise RecordError("a sparse matrix does not hold its size, rows, columns and numbers")
    rows, columns, *values = (_numbers(part, None, order) for part in content)
    if columns.size != shape[1] + 1 or not 0 <= (count := int(columns[-1])) <= min(rows.size, values[0].size):
        raise RecordError(f"a sparse matrix of {shape[1]} columns does not hold its columns or numbers")
    numbers = values[0] if len(values) == 1 else values[0] + 1j * values[1]
    matrix = scipy.sparse.csc_array((numbers[:count], rows[:count].astype(int), columns.astype(int)), shape=shape)
    matrix.check_format(full_check=True)
    return matrix


def _numbers(part: Element, shape: tuple[int, ...] | None, order: str) -> np.ndarray:
    kind, data = part
    if kind not in NUMBERS:
        raise RecordError(f"holds numbers of the unknown type {kind}")
    dtype = np.dtype(order + NUMBERS[kind])
    values = np.frombuffer(data, dtype, len(data) // dtype.itemsize).astype(dtype.newbyteorder("="))
    if shape is None:
        return values
    _require_all(shape, values.size)
    return values.reshape(shape, order="F")


def _require_all(shape: tuple[int, ...], present: int) -> None:
    if (n := math.prod(shape)) != present:
        raise RecordError(f"an array declares {n} elements, which do not follow")
