"""The data elements of MATLAB files of version 5 to 7, checked before scipy reads them.

scipy 1.17 takes the type of a damaged element as an index and the process dies; compressed elements are unpacked here
to be looked at. MathWorks, MAT-File Format, 2023: a header of 128 bytes, then elements of a tag (type, size) and their
data; an array (type 14) is made of elements itself.
"""

from __future__ import annotations

import math
import struct
import zlib

from ..errors import RecordError
from ..files import TOO_DENSE, most_unpacked

__all__ = ["plain_arrays"]

ARRAY, COMPRESSED = 14, 15
LEAVES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
"""Bytes of one number or character, by type"""
CELL, CHARACTERS, NUMERIC = 1, 4, range(6, 16)
"""Classes of arrays; structures, objects, sparse matrices and functions are passed over"""
HEADER = 128
DEPTH = 8


def plain_arrays(data: bytes) -> bytes:
    """Return a file with the numeric, character and cell arrays of a file, uncompressed.

    Parameters
    ----------
    data : bytes
        A file of version 5 to 7.

    Raises
    ------
    RecordError
        If an element is damaged or cut short.
    """
    order = {b"IM": "<", b"MI": ">"}.get(data[126:HEADER])
    if order is None or data[124:126] not in (b"\x00\x01", b"\x01\x00"):
        raise RecordError("has no header of version 5 to 7")
    kept, position, room = [data[:HEADER]], HEADER, most_unpacked(len(data))
    while position < len(data):
        kind, begin, end = _element(data, position, len(data), order)
        if kind == COMPRESSED:
            array = _unpacked(data[begin:end], room)
            room -= len(array)
            inner, begin_inner, end_inner = _element(array, 0, len(array), order)
            array, kind = array[:end_inner], inner
        else:
            begin_inner, end_inner, array = begin - position, end - position, data[position:end]
        if kind != ARRAY:
            raise RecordError(f"holds an element of type {kind} where an array is expected")
        if _is_plain(array, begin_inner, end_inner, order, DEPTH):
            kept.append(array)
        position = end
    return b"".join(kept)


def _element(data, position, limit, order):
    """Type of the element at a position, and where its data begin and end."""
    if position + 8 > limit:
        raise RecordError("is cut short in the tag of an element")
    kind, size = struct.unpack_from(f"{order}II", data, position)
    begin = position + 8
    if kind >> 16:  # up to four bytes of data within the tag
        kind, size, begin = kind & 0xFFFF, kind >> 16, position + 4
        limit = min(limit, position + 8)
    if begin + size > limit:
        raise RecordError(f"is cut short: an element of {size} bytes, but {limit - begin} follow")
    if kind not in LEAVES and kind not in (ARRAY, COMPRESSED):
        raise RecordError(f"holds an element of the unknown type {kind}")
    return kind, begin, begin + size


def _unpacked(data, room) -> bytes:
    stream = zlib.decompressobj()
    try:
        array = stream.decompress(data, room + 1)
    except zlib.error as error:
        raise RecordError(f"a compressed element is damaged ({error})") from None
    if len(array) > room:
        raise RecordError(TOO_DENSE)
    if not stream.eof:
        raise RecordError("a compressed element is cut short")
    return array


def _is_plain(data, begin, end, order, depth) -> bool:
    """Check the elements of an array; whether it and all in it are numbers, characters and cells."""
    if not depth:
        raise RecordError(f"holds cells more than {DEPTH} deep")
    parts, position = [], begin
    while position < end:
        kind, first, last = _element(data, position, end, order)
        parts.append((kind, first, last))
        # Each begins at a multiple of eight bytes.
        position = min(end, -(-(last - begin) // 8) * 8 + begin)
    if not parts:
        return False  # an empty cell
    if parts[0][0] != 6 or parts[0][2] - parts[0][1] != 8:
        raise RecordError("an array does not begin with its flags")
    flags = struct.unpack_from(f"{order}I", data, parts[0][1])[0]
    kind = flags & 0xFF
    if kind == CELL and len(parts) >= 3:
        _require_room(data, parts[1], len(parts) - 3, order)
        return all(k == ARRAY and _is_plain(data, a, b, order, depth - 1) for k, a, b in parts[3:])
    if kind != CHARACTERS and kind not in NUMERIC:
        return False
    if len(parts) != 4 + bool(flags & 0x800) or any(k not in LEAVES for k, _, _ in parts):
        raise RecordError("an array does not hold its flags, size, name and numbers")
    _require_room(data, parts[1], end - begin, order)
    return True


def _require_room(data, size, most, order):
    """Refuse an array whose size says more than ``most`` elements; scipy would make room for them."""
    _, begin, end = size
    n = math.prod(struct.unpack(f"{order}{(end - begin) // 4}I", data[begin : end - (end - begin) % 4]))
    if n > most:
        raise RecordError(f"an array declares {n} elements, which do not follow")
