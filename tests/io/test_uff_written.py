"""Universal files as this package writes them, read by pyuff and by the rules of UFFFiles.jl.

UFFFiles.jl (`src/read_write_uff.jl`, `src/datasets/dataset58b.jl`, `dataset2412.jl` of maucejo/UFFFiles.jl) is a reader
in Julia; its rules are laid down here: a data set begins and ends with a line that is "    -1" and nothing else, its
type is in the first seven columns of the next line; a binary one declares little endian (1), IEEE 754 (2), eleven lines
and the number of bytes, which are read as they are declared; elements of kinds 11, 21, 22, 23 and 24 have a record of
their orientation.
"""

import dataclasses

import numpy as np
import pytest
import pyuff

import clearance_mj as cm
from clearance_mj.io.contents import FileContents
from clearance_mj.io.uff import DIRECTIONS
from clearance_mj.signals import Modes, join_references
from tests.fuzz import samples_uff

from .uff_by_hand import RNG, assert_same_channels, channels, frf

LINES = np.arange(1.0, 33.0)


def spectra(kind, factor=1.0, lines=LINES, **labels):
    return cm.Spectra(kind, lines, factor * (RNG.random((2, lines.size)) + 0.1), ("3:+Z", "4:-X"), **labels)


def unknown_frf():
    return dataclasses.replace(frf(), quantity="unknown/force", unit_label="Pa/N", references=("0:S",))


MIC = cm.Channel("mic", 0, "S", "unknown", np.arange(8.0), 100.0, unit="Pa")
MODES = Modes([9.5, 40.0], [0.01, 0.02], RNG.random((3, 2)) * (1 + 0.1j), ("1:+Z", "2:+Y", "8:+X"))
TO_TWO = join_references([frf(coherence=False), dataclasses.replace(frf(coherence=False), references=("5:-Y",))])
WRITTEN = {
    "records": channels(),
    "record of unknown quantity": [MIC],
    "FRFs with coherence": frf(),
    "FRFs over uneven lines": frf(np.geomspace(5, 220, 50)), "FRF at one line": frf(np.array([7.0]), coherence=False),
    "FRFs over even lines of many digits": frf(3 + np.arange(400) * (2048 / 4200)),
    "FRFs to two references": TO_TWO,
    "FRFs of unknown quantity, without a reference": unknown_frf(),
    "auto spectra": spectra("auto spectrum", quantities=("acceleration", "unknown"), units=("(m/s²)²", "Pa^2")),
    "cross spectra": spectra("cross spectrum", 1j, references=("5:+Z", "5:+Z"), units=("g*N", "")),
    "densities over uneven lines": spectra("power spectral density", lines=np.geomspace(1, 99, 7)),
    "geometry": samples_uff.geometry(),
    "modes": MODES,
    "several": FileContents((MIC,), (TO_TWO,), (spectra("coherence"),), (MODES,), cm.Geometry((1,), [(1, 0, 0)])),
}  # fmt: skip
everything = pytest.mark.parametrize("name", WRITTEN)


def rows(obj):
    """Abscissa (None: of a record), values and place of every function, in the order in which they are written."""
    for part in obj.parts.values() if isinstance(obj, FileContents) else [obj]:
        if isinstance(part, list):
            yield from ((None, channel.value, channel.label) for channel in part)
        elif isinstance(part, cm.Spectra):
            yield from ((part.abscissa, *row) for row in zip(part.value, part.responses))
        elif isinstance(part, cm.FRF):
            for one in map(part.to_reference, part.references):
                values = [*one.functions, *(() if one.coherence is None else one.coherence[:, 0])]
                yield from ((one.frequency, *row) for row in zip(values, 2 * one.responses))


@everything
def test_pyuff_reads_it(tmp_path, name):
    obj = WRITTEN[name]
    cm.write_uff(tmp_path / "a.uff", obj)
    sets = pyuff.UFF(str(tmp_path / "a.uff")).read_sets()
    functions, nodes, modes = ([one for one in sets if one["type"] in kinds] for kinds in ((58,), (15, 2411), (55,)))
    for one, (x, value, label) in zip(functions, rows(obj), strict=True):
        np.testing.assert_array_equal(one["data"], value)
        assert x is None or np.allclose(one["x"], x, rtol=1e-12)
        node, direction = label.split(":")
        assert (one["rsp_node"], one["rsp_dir"]) == (int(node), DIRECTIONS[direction])
    for part in obj.parts.values() if isinstance(obj, FileContents) else [obj]:
        if isinstance(part, cm.Geometry):
            np.testing.assert_array_equal([nodes[0][axis] for axis in "xyz"], part.position.T)
            elements = [v for one in sets if one["type"] == 2412 for k, v in one.items() if isinstance(k, int)]
            assert sum(map(len, elements)) == len(part.elements)
        if isinstance(part, Modes):
            assert [abs(one["eig"]) / 2 / np.pi for one in modes] == pytest.approx(part.frequency, rel=1e-5)
            np.testing.assert_allclose([one["r3"][0] for one in modes], part.shape[0], rtol=1e-5)


def columns(record, *ends, of=int):
    """Numbers in columns of a record."""
    return [of(record[a:b]) for a, b in ends]


def walk(data):
    """Types of the data sets that UFFFiles.jl finds, in its way; fails where it would."""
    kinds, at = [], 0

    def line():
        nonlocal at
        end = data.index(b"\n", at)
        text, at = data[at:end], end + 1
        return text

    while at < len(data):
        assert line() == b"    -1"
        head = line()
        kinds.append(head[:7].strip().decode())
        if kinds[-1] == "58b":
            order, layout, lines, size = columns(head, (7, 13), (13, 19), (19, 31), (31, 43))
            assert (order, layout, lines) == (1, 2, 11)
            records = [line() for _ in range(lines)]
            columns(records[5], (0, 5), (5, 15), (15, 20), (20, 30), (41, 51), (51, 55), (66, 76), (76, 80))
            kind, count, even = columns(records[6], (0, 10), (10, 20), (20, 30))
            columns(records[6], (30, 43), (43, 56), (56, 69), of=float)
            assert size == count * (1 + (kind in (5, 6)) + (even == 0)) * (8 if kind in (4, 6) else 4)
            at += size
            assert line() == b"    -1"
            continue
        body = [*iter(line, b"    -1")]
        if kinds[-1] == "2412":
            elements(body)
    return kinds


def elements(body):
    """By the rules of `parse_dataset2412`; all records are used up."""
    rest = iter(body)
    for head in rest:
        kind, count = columns(head, (10, 20), (50, 60))
        if kind in (11, 21, 22, 23, 24):
            assert len(next(rest).split()) == 3
        while count > 0:
            count -= len(next(rest).split())
        assert count == 0


@everything
def test_ufffiles_reads_it(tmp_path, name):
    cm.write_uff(tmp_path / "a.uff", WRITTEN[name])
    kinds = walk((tmp_path / "a.uff").read_bytes())
    theirs = pyuff.UFF(str(tmp_path / "a.uff")).read_sets()
    assert [int(kind.rstrip("b")) for kind in kinds] == [one["type"] for one in theirs]
    assert kinds[:2] == ["151", "164"] and "58" not in kinds


@everything
def test_it_comes_back(tmp_path, name):
    """Every number; records in single precision, modes with six digits."""
    sent = WRITTEN[name]
    cm.write_uff(tmp_path / "a.uff", sent)
    got = cm.read(tmp_path / "a.uff")
    if isinstance(sent, list):
        assert_same_channels(got, sent)
        assert [c.unit for c in got] == [c.unit for c in sent]
    elif isinstance(sent, cm.FRF | cm.Geometry):
        assert got == sent
    elif isinstance(sent, cm.Spectra):
        np.testing.assert_array_equal(got.value, sent.value)
        assert (got.kind, got.responses, got.references) == (sent.kind, sent.responses, sent.references)
    elif isinstance(sent, FileContents):
        assert [*got.parts] == [*sent.parts]
