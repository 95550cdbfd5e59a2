"""Universal files that other programs wrote, against pyuff: the same numbers to the last bit, or the reason why not."""

import re
import warnings

import numpy as np
import pytest
import pyuff

import clearance_mj as cm
from clearance_mj.io.contents import FileContents
from clearance_mj.io.uff import FileWarning
from clearance_mj.universal import SI, contents, scan
from clearance_mj.universal.dataset_58 import samples
from experiments.foreign_files import FOLDER, ROOT, TABLE, UNIVERSAL, files, row, summary

GEOMETRY = {15, 18, 82, 2411, 2412, 2420}
FILES = [path for path in files() if path.suffix.lower() in UNIVERSAL]
WHY = f"no folder of files of other programs at {FOLDER}; CLEARANCE_FOREIGN_FILES names it"


def holding(*kinds):
    """Files with data sets of some kinds, all without one."""
    paths = [path for path in FILES if not kinds or kinds_of(path) & {*kinds}]
    paths = paths or [pytest.param(None, marks=pytest.mark.skip(reason=WHY))]
    return pytest.mark.parametrize("path", paths, ids=lambda path: path and path.name)


def kinds_of(path):
    return {int(kind) for kind in re.findall(rb"^    -1[ \t]*\r?\n *(\d+)", path.read_bytes(), re.MULTILINE)}


POUND, INCH = 4.4482216152605, 0.0254
SCALES = (1.0, 9.80665, INCH / POUND)
"""SI units in one of a file's: none, g, inch/s² per pound force (data set 164 has 17 digits of the last two)"""


def parts(path):
    """Everything that is read of a file, by kind."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FileWarning)
        contents = cm.read(path)
    if isinstance(contents, FileContents):
        return contents
    name = {list: "channels", cm.FRF: "frfs"}.get(type(contents), type(contents).__name__.lower())
    values = {"channels": tuple(contents)} if isinstance(contents, list) else {}
    names = {"frfs": "frfs", "spectra": "spectra", "modes": "mode_sets"}
    values |= {names[name]: (contents,)} if name in names else {}
    values |= {"geometry": contents} if name == "geometry" else {}
    return FileContents(**values)


def pyuffs(path):
    """Data sets as pyuff reads them; empty where it fails."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            sets = pyuff.UFF(str(path)).read_sets()
        except Exception as error:  # pyuff: Exception("Error when reading data-set(s).")
            assert "reading data-set" in str(error)
            return []
    return [one for one in (sets if isinstance(sets, list) else [sets]) if isinstance(one, dict)]


@holding()
def test_everything_that_can_be_used_is_read(path):
    """Functions, modes and geometry; otherwise the message names every data set that is there, and none else."""
    functions, blocks, _ = scan(contents(path), SI)
    kinds = {block.kind for block in blocks}
    modal = any(block.kind in (55, 2414) and block.lines[5 if block.kind == 55 else 8].split()[1] in "237"
                and (block.kind == 55 or block.lines[2].split()[0] == "1") for block in blocks)  # fmt: skip
    if not functions and not kinds & GEOMETRY and not modal:
        with pytest.raises(cm.RecordError) as caught:
            cm.read(path)
        assert all(f"{kind} (" in str(caught.value) for kind in kinds)
        return
    read = parts(path)
    count = len(read.channels) + sum(len(f.functions) for f in read.frfs) + sum(len(s.value) for s in read.spectra)
    coherences = sum(np.isfinite(f.coherence).any(axis=2).sum() for f in read.frfs if f.coherence is not None)
    assert count + coherences == len(functions) and bool(read.mode_sets) == modal
    assert (read.geometry is not None) == bool(kinds & GEOMETRY)


def numbers(contents):
    """Every function that was read: abscissa (None: of a record, whose rate is rounded) and values."""
    yield from ((None, channel.value) for channel in contents.channels)
    for frf in contents.frfs:
        yield from ((frf.frequency, value) for value in frf.functions)
        coherences = () if frf.coherence is None else frf.coherence[:, 0]
        yield from ((frf.frequency, value) for value in coherences)
    yield from ((spectra.abscissa, value) for spectra in contents.spectra for value in spectra.value)


def same(ours, theirs):
    """The same bits in SI units; rounded once more where two units are divided."""
    if ours.shape != theirs.shape:
        return False
    exact = any(np.array_equal(ours, theirs * scale) for scale in SCALES[:2])
    return exact or np.allclose(ours, theirs * SCALES[2], rtol=1e-14, atol=0)


@holding(58)
def test_functions_are_pyuffs(path):
    """pyuff takes numbers that fill the last line of a text for samples: 1602 of 1600."""
    functions = scan(contents(path), SI).functions
    theirs = [one for one in pyuffs(path) if one["type"] == 58]
    if not theirs:  # pyuff fails on a date such as "17-Jun-20 - 14:40:10"
        data = contents(path)
        theirs = [{"data": samples(data, f), "x": None, "num_pts": f.size} for f in functions]
    assert len(theirs) == len(functions)
    ours = [*numbers(parts(path))]
    for one, function in zip(theirs, functions):
        value = one["data"][: function.size]
        match = next((x for x, y in ours if same(y, value)), False)
        assert match is not False, f"data set {function.number}"
        if match is not None and one["x"] is not None:
            # pyuff adds up the steps of even abscissas in another order.
            np.testing.assert_allclose(match, one["x"][: function.size], rtol=1e-12, atol=1e-12)


@holding(*GEOMETRY)
def test_geometry_is_pyuffs(path):
    sets = [one for one in pyuffs(path) if one["type"] in GEOMETRY]
    geometry = parts(path).geometry
    nodes = [one for one in sets if one["type"] in (15, 2411)]
    numbers_of_nodes = np.concatenate([np.ravel(one["node_nums"]) for one in nodes]) if nodes else []
    np.testing.assert_array_equal(geometry.numbers, numbers_of_nodes)
    if nodes:  # every system of definition in these files is the global one
        position = np.concatenate([np.stack([one[axis] for axis in "xyz"], axis=1) for one in nodes])
        np.testing.assert_array_equal(geometry.position, position)
    lines = [one for one in sets if one["type"] == 82]
    assert [line for line in geometry.lines] == [tuple(map(int, one["nodes"][: int(one["n_nodes"])])) for one in lines]
    elements = {
        (e["element_nums"], e["fe_descriptor"], *e["nodes_nums"])
        for one in sets if one["type"] == 2412
        for kind, of_kind in one.items() if isinstance(kind, int) for e in of_kind
    }  # fmt: skip
    assert {(e.number, e.kind, *e.nodes) for e in geometry.elements} == elements
    local = [one for one in sets if one["type"] == 18]
    assert [s.origin for s in geometry.systems if local] == [tuple(o) for one in local for o in one["ref_o"]]
    for one in sets:
        if one["type"] == 2420:
            np.testing.assert_array_equal([np.vstack((s.axes, s.origin)) for s in geometry.systems], one["CS_matrices"])


@holding(55)
def test_modes_are_pyuffs(path):
    """Translations of data sets 55; pyuff has the eigenvalue of complex modes, and 2414 as one array at each node."""
    sets = [one for one in pyuffs(path) if one["type"] == 55 and one["analysis_type"] in (2, 3, 7)]
    (modes,) = parts(path).mode_sets

    def of(one):
        return abs(one["eig"]) / 2 / np.pi if "eig" in one else one["freq"]

    sets.sort(key=of)
    np.testing.assert_allclose(modes.frequency, [of(one) for one in sets], rtol=1e-14)
    for column, one in zip(modes.shape.T, sets):
        their = {f"{int(node)}:+{axis}": one[f"r{i}"][row]
                 for row, node in enumerate(one["node_nums"]) for i, axis in enumerate("XYZ", 1)}  # fmt: skip
        np.testing.assert_array_equal(column, [their[dof] for dof in modes.responses])


@pytest.mark.skipif(not FILES, reason=WHY)
def test_table_of_the_page():
    """Folders that the page lists and that are here have the rows that the code makes; their place is not named."""
    listed = TABLE.search((ROOT / "docs" / "files.md").read_text(encoding="utf-8"))[0]
    for line in summary([row(path) for path in files()]).splitlines():
        assert str(FOLDER) not in line
        assert line in listed or line.split(" | ")[0] not in listed


def test_objects_of_a_folder_are_counted():
    of_tests = [
        ("lab/a.unv", "Oros", "55 (data at nodes)", "2 auto spectra: unknown in Pa, 9 samples; geometry: 3 nodes"),
        ("lab/b.unv", "", "164 (units)", "holds data sets 164 (units) only; there is no function, mode or node in it"),
        ("lab/c.lvm", "LabVIEW", "LVM, 9 bytes", '"A": its times are uneven at sample 1'),
    ]
    assert summary(of_tests).splitlines()[2:] == ["| `lab` | 3 | LabVIEW, Oros | 2 auto spectra, 1 geometry | 1 | 1 |"]
