"""Blocks of MDF files: whether all that are linked are there, before a reader follows them.

ASAM MDF 4.1: the header block begins at byte 64. A block has four characters "##HD", its length, the number of its
links, and the links: bytes in the file of other blocks, or 0. The first link of most leads to the next of its kind.
Blocks of MDF 3.3 and before have two characters "HD", their length and as many links as their kind has.
"""

from __future__ import annotations

import struct

from ..core.errors import RecordError

__all__ = ["require_whole"]

_HEAD = 64  # bytes before the header block
_HEADER = struct.Struct("<4s4xQQ")
_LINKS = {b"HD": 3, b"DG": 3, b"CG": 3, b"CN": 5}  # of MDF 3 that lead to blocks
_LISTS = (b"DG", b"CG", b"CN", b"##DG", b"##CG", b"##CN", b"##CH", b"##AT", b"##EV", b"##FH", b"##DL", b"##LD")
"""Kinds whose first link leads to the next in a list; one that leads back has no end"""


def require_whole(data: bytes) -> None:
    """Refuse a file that is no MDF, is cut off, or whose links lead nowhere or round in a circle."""
    if data[:3] != b"MDF":
        raise RecordError("not an MDF file")
    block = _old_block if data[8:9] in b"23" else _block
    todo, links_of = [_HEAD], dict[int, tuple[bytes, tuple[int, ...]]]()
    while todo:
        at = todo.pop()
        if at in links_of:
            continue
        kind, links = links_of[at] = block(data, at)
        todo += [link for link in links if link]
    for at, (kind, _) in links_of.items():
        seen, here = set[int](), at
        while here and kind in _LISTS:
            if here in seen:
                raise RecordError(f"not a whole MDF file: its list of blocks at byte {at} leads back to itself")
            seen.add(here)
            known, links = links_of[here]
            here = links[0] if known == kind and links else 0


def _old_block(data: bytes, at: int) -> tuple[bytes, tuple[int, ...]]:
    """Return kind and links of a block of MDF 3."""
    kind = data[at : at + 2]
    count = _LINKS.get(kind, 0)
    if at + 4 + 4 * count > len(data):
        raise RecordError(f"not a whole MDF file: a block at byte {at} lies behind its end, {len(data)}")
    return kind, struct.unpack_from(f"{'>' if data[24:26] != bytes(2) else '<'}{count}I", data, at + 4)


def _block(data: bytes, at: int) -> tuple[bytes, tuple[int, ...]]:
    """Return kind and links of a block."""
    if at + _HEADER.size > len(data):
        raise RecordError(f"not a whole MDF file: a block at byte {at} lies behind its end, {len(data)}")
    kind, length, count = _HEADER.unpack_from(data, at)
    if kind[:2] != b"##":
        raise RecordError(f"not a whole MDF file: no block begins at byte {at}")
    if at + length > len(data) or _HEADER.size + 8 * count > length:
        raise RecordError(f"not a whole MDF file: the block at byte {at} ends behind the file or its links")
    return kind, struct.unpack_from(f"<{count}Q", data, at + _HEADER.size)
