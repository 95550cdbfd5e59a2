"""Damage: bytes changed, cut out, put in and repeated, numbers and plain data replaced by awkward ones."""

import copy
import gzip
import json
import re
import struct

import tomli_w

NUMBERS = (
    b"0", b"-1", b"1", b"2", b"3", b"58", b"100", b"200", b"-0.0", b"1e-320", b"1e308", b"-1e308", b"1e999", b"nan",
    b"inf", b"2147483647", b"-2147483648", b"4294967296", b"99999999999999999999", b"1_0", b"0e999", b"1.5", b"1d5",
)  # fmt: skip
TOKENS = (b"", b"\n", b"\r\n", b"\t", b",", b";", b'"', b"'", b"#", b"=", b"[", b"]", b"{", b"}", b"\0", b"\xff", b" ",
          b"\x1f\x8b", "ä".encode(), "\u2028".encode(), b"    -1\n", b"    58\n", b"    58b     1     2\n",
          b"***End_of_Header***\n", b"acc:1", b"time", b"[g]")  # fmt: skip
WORDS = tuple(struct.pack(order + kind, value) for order in "<>" for kind, values in (
    ("i", (0, 1, 2, 5, 6, 14, 15, 255, 2**31 - 1, -1)), ("d", (0.0, -1.0, 1e308, float("nan"), float("inf"))),
) for value in values)  # fmt: skip
PLAIN = (
    0, 1, -1, 2, 10**6, 10**400, 0.0, -1.0, 0.5, 1e-320, 1e-9, 1e9, 1e308, float("nan"), float("inf"), True, False, "",
    "a", "rig.toml", "none", "a\nb", "\0", "ä" * 200, [], [0.0], [1.0, 2.0], [2.0, 1.0], [[1.0, 2.0], [3.0, 4.0]],
    [None], ["a"], {}, {"a": 1}, {"stiffness": 1.0}, [{}], None,
)  # fmt: skip
_NUMBER = re.compile(rb"[-+]?[0-9][0-9.eE+-]*")


def damaged(rng, data: bytes, samples: list[bytes], text=False) -> bytes:
    """The bytes of a file with one to eight changes; most of those to a text are of text."""
    changes = _TEXT_CHANGES if text and rng.random() < 0.8 else _CHANGES
    for _ in range(rng.choice((1, 1, 1, 2, 2, 3, 5, 8))):
        data = rng.choice(changes)(rng, data, samples)
    return data


def _slice(rng, data):
    begin = rng.randrange(len(data) + 1)
    return begin, min(len(data), begin + int(rng.paretovariate(0.5)))


def _character(rng, data, _):
    place = rng.randrange(len(data) + 1)
    return data[:place] + bytes([rng.choice(b" -+.,;:0123456789EDeinx[]/#")]) + data[place + 1 :]


def _byte(rng, data, _):
    if not data:
        return b"-"
    place = rng.randrange(len(data))
    new = rng.choice((rng.randrange(256), data[place] ^ (1 << rng.randrange(8)), rng.choice(b" -+.0123456789ED\n,\t")))
    return data[:place] + bytes([new]) + data[place + 1 :]


def _cut_out(rng, data, _):
    begin, end = _slice(rng, data)
    return data[:begin] + data[end:]


def _repeat(rng, data, _):
    begin, end = _slice(rng, data)
    return data[:end] + data[begin:end][:4096] * rng.choice((1, 1, 2, 50)) + data[end:]


def _put_in(rng, data, _):
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.choice((rng.choice(TOKENS), rng.choice(NUMBERS), rng.randbytes(8))) + data[at:]


def _number(rng, data, _):
    """Another number in the columns of one."""
    matches = list(_NUMBER.finditer(data))
    if not matches:
        return data
    begin, end = rng.choice(matches).span()
    new = rng.choice(NUMBERS)
    if len(new) <= end - begin or rng.random() < 0.5:
        return data[:begin] + new.rjust(end - begin) + data[end:]
    return data[: max(0, end - len(new))] + new + data[end:]


def _word(rng, data, _):
    new = rng.choice(WORDS)
    at = rng.randrange(max(1, len(data) - len(new) + 1)) & rng.choice((~0, ~3))
    return data[:at] + new + data[at + len(new) :]


def _cut_off(rng, data, _):
    return data[: rng.randrange(len(data) + 1)]


def _join(rng, data, samples):
    other = rng.choice(samples)
    return data[: rng.randrange(len(data) + 1)] + other[rng.randrange(len(other) + 1) :]


def _lines(rng, data, _):
    lines = data.splitlines(keepends=True)
    if len(lines) < 2:
        return data
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[i], lines[j] = rng.choice(((lines[j], lines[i]), (lines[i], lines[i]), (b"", lines[j])))
    return b"".join(lines)


_TEXT_CHANGES = (_character, _character, _cut_out, _repeat, _number, _number, _number, _cut_off, _lines, _lines)
_CHANGES = (_byte, _byte, _cut_out, _repeat, _put_in, _number, _number, _number, _word, _cut_off, _join, _lines)


def packed(rng, data: bytes) -> bytes:
    """One file in ten compressed, and one of these damaged afterwards."""
    if rng.random() > 0.1:
        return data
    data = gzip.compress(data, 1, mtime=0)
    return data if rng.random() < 0.7 else _byte(rng, data, ())


def replanted(rng, data):
    """Nested plain data with one to three entries replaced, removed, repeated or added."""
    data = copy.deepcopy(data)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        places = list(_containers(data))
        if not places:
            break
        inside = rng.choice(places)
        key = rng.choice([*inside] if isinstance(inside, dict) else range(len(inside))) if inside else None
        change = rng.random()
        if key is None or change < 0.1:
            _add(rng, inside)
        elif change < 0.25:
            del inside[key]
        elif change < 0.35 and isinstance(inside, list):
            inside.append(copy.deepcopy(inside[key]))
        elif change < 0.55 and isinstance(inside[key], int | float) and abs(inside[key]) < 1e99:
            inside[key] = inside[key] * rng.choice((-1, 0, 2, 10, 1e-6, 1e3, 1e6))
        else:
            inside[key] = copy.deepcopy(rng.choice(PLAIN))
    return data


def _containers(data):
    if isinstance(data, dict | list):
        yield data
        for item in data.values() if isinstance(data, dict) else data:
            yield from _containers(item)


def _add(rng, inside):
    new = copy.deepcopy(rng.choice(PLAIN))
    if isinstance(inside, dict):
        inside[rng.choice(("a", "", "name", "kind", "a b", "x\ny", "position", "grease", "values", "samples"))] = new
    else:
        inside.append(new)


def toml(data) -> bytes:
    return tomli_w.dumps(_without_none(data)).encode()


def as_json(data) -> bytes:
    return json.dumps(data).encode()


def _without_none(data):
    """TOML has no null."""
    if isinstance(data, dict):
        return {key: _without_none(value) for key, value in data.items() if value is not None}
    return [_without_none(item) for item in data if item is not None] if isinstance(data, list) else data
