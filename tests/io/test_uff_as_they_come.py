"""Universal files as programs write them: other quantities, no reference, no units, several kinds of things in one.

Data sets are laid out by hand from the published format (`uff_by_hand`); the deviations are those of files of LMS,
Simcenter, Artemis, Oros, catman, VibControl, OROS and the UFF libraries.
"""

import dataclasses
import struct

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.io import formats
from clearance_mj.io.channels import UNKNOWN
from clearance_mj.io.uff import FileWarning
from clearance_mj.signals import accelerance, align, with_quantity

from .refusals import assert_refused
from .uff_by_hand import ROWS, by_hand, coherence_by_hand, frf_by_hand, units_by_hand

# Quantities


@pytest.mark.parametrize("code", [0, 1, 2, 3, 15, 21])
def test_any_quantity_of_a_time_record(write, code):
    """Values and unit as they are in the file; data set 164 does not change them."""
    (tip,) = cm.read_uff(write(units_by_hand(1e3, 1e3) + by_hand(ROWS, numerator=code, unit="V")))
    assert (tip.quantity, tip.unit, tip.label) == (UNKNOWN, "V", "3:+Z")
    np.testing.assert_array_equal(tip.value, np.arange(12.0))


@pytest.mark.parametrize("unit", ["ft/lbf", "N"])
def test_unit_that_is_none_of_the_quantity(write, unit):
    with pytest.warns(FileWarning, match=f'data set 1: unit "{unit}" of acceleration is not known'):
        (tip,) = cm.read_uff(write(by_hand(ROWS, unit=unit)))
    assert (tip.quantity, tip.unit) == (UNKNOWN, unit)


def test_unit_in_latin_1(write):
    (tip,) = cm.read_uff(write(by_hand(ROWS, unit="m/s²").decode().encode("latin-1")))
    assert tip.quantity == "acceleration"


@pytest.mark.parametrize("changes, quantity, unit", [
    ({"numerator": 15, "unit": "Pa"}, "unknown/force", "Pa"),
    ({"numerator": 2, "unit": "MPa/N"}, "unknown/force", "MPa/N"),
    ({"denominator": 0}, "acceleration/unknown", "unknown unit"),
    ({"numerator": 0, "denominator": 0, "unit": "(m/s)/N"}, "unknown/unknown", "(m/s)/N"),
])  # fmt: skip
def test_any_quantity_of_an_frf(tmp_path, write, changes, quantity, unit):
    got = cm.read_uff(write(frf_by_hand(**changes)))
    assert (got.quantity, got.unit) == (quantity, unit)
    np.testing.assert_array_equal(got.functions, [[1 + 2j, 3 - 4j]])
    for suffix in (".uff", ".nc"):
        formats.write(tmp_path / f"again{suffix}", got)
        assert cm.read(tmp_path / f"again{suffix}") == got


def test_calculations_ask_for_the_quantity_and_take_it(write):
    frf = cm.read_uff(write(frf_by_hand(numerator=0, denominator=0, unit="g/N")))
    asked = r"quantity of the FRFs is unknown/unknown \(unit g/N\); say what they are: clearance-mj convert FILE"
    known = with_quantity(frf, "acceleration/force", "g/N")
    for calculation in (cm.extract_modes, accelerance, cm.structure.modes_from_frf, lambda f: align(f, known)):
        assert_refused(asked, calculation, frf)
    np.testing.assert_allclose(known.functions, 9.80665 * np.array([[1 + 2j, 3 - 4j]]), rtol=1e-15)
    assert with_quantity(frf, "acceleration/force") == known  # by the label of the file
    assert_refused("the FRFs are acceleration/force, as their file says", with_quantity, known, "velocity/force")
    assert_refused('quantity "stress/force" is unknown; needs two of displacement', with_quantity, frf, "stress/force")


def test_real_frf(write):
    rows = [f"{1:20.12E}{2:20.12E}"]
    got = cm.read_uff(write(by_hand(rows, kind=4, ordinate=4, count=2, axis=18, denominator=13, dof=(8, 3, 5, 3))))
    np.testing.assert_array_equal(got.functions, [[1, 2]])


# Places


@pytest.mark.parametrize("reference", [(-1, 0), (0, 0), (-7, 99)])
def test_time_record_without_a_reference(write, reference):
    (tip,) = cm.read_uff(write(by_hand(ROWS, dof=(3, 3, *reference))))
    assert tip.label == "3:+Z"


@pytest.mark.parametrize("reference", [(-1, 0), (0, 0)])
def test_frf_without_a_reference(tmp_path, write, reference):
    got = cm.read_uff(write(frf_by_hand(dof=(8, 3, *reference))))
    assert got.references == ("0:S",)
    cm.write_uff(tmp_path / "again.uff", got)
    assert cm.read_uff(tmp_path / "again.uff") == got


@pytest.mark.parametrize("node", [-1, 0])
def test_record_without_a_place(write, node):
    (tip,) = cm.read_uff(write(by_hand(ROWS, dof=(node, 3, 0, 0))))
    assert not tip.placed and tip.name == "tip"


def test_records_that_share_a_title(write):
    """A map of channels goes by their names: place, name of the place, or number tell records of one title apart."""
    named = by_hand(ROWS, dof=(0, 0, 0, 0)).replace(b"NONE               0   0 NONE", b"Mic 2              0   0 NONE")
    data = by_hand(ROWS) + by_hand(ROWS, dof=(4, -1, 0, 0)) + named + 2 * by_hand(ROWS, dof=(0, 0, 0, 0))
    assert [c.name for c in cm.read_uff(write(data))] == ["tip, 3:+Z", "tip, 4:-X", "tip, Mic 2", "tip", "tip (2)"]
    (one,) = cm.read_uff(write(by_hand(ROWS)))
    assert one.name == "tip"


# Layouts


@pytest.mark.parametrize(("kind", "letters"), [(4, ("fd", "dd")), (6, ("fdd", "ddd"))])
@pytest.mark.parametrize("order", [1, 2])
def test_both_lengths_of_uneven_binary_samples(write, kind, letters, order):
    """12 and 20 bytes where abscissas are of single precision, 16 and 24 where they are of double, in both orders."""
    mark = "<" if order == 1 else ">"
    frequency, value = (1.0, 1.5, 2.5), (1.0 + 0.25j, 2.0 - 1.0j, 3.0)
    for letter in letters:
        rows = [(f, v) if kind == 4 else (f, complex(v).real, complex(v).imag) for f, v in zip(frequency, value)]
        rows = [(f, complex(v).real) for f, v in rows] if kind == 4 else rows
        body = b"".join(struct.pack(mark + letter, *row) for row in rows)
        assert len(body) == 3 * {"fd": 12, "dd": 16, "fdd": 20, "ddd": 24}[letter]
        head = f"b{order:6d}{2:6d}{11:12d}{len(body):12d}"
        layout = {"kind": 4, "ordinate": kind, "count": 3, "spacing": 0, "axis": 18, "denominator": 13}
        got = cm.read_uff(write(by_hand(body, binary=head, dof=(8, 3, 5, 3), **layout)))
        np.testing.assert_array_equal(got.frequency, frequency)
        np.testing.assert_array_equal(got.functions[0], np.real(value) if kind == 4 else value)
    with pytest.raises(
        cm.RecordError, match=r"declares 3 samples, which is (48 or 36|72 or 60) bytes, but 30 bytes fol"
    ):
        cm.read_uff(write(by_hand(body[:30], binary=head, dof=(8, 3, 5, 3), **layout)))


def test_lines_of_a_sweep_down(write):
    """Uneven lines that fall come out rising, each value with its frequency and coherence."""
    rows = [f"{f:13.5E}{f:20.12E}{-f:20.12E}" for f in (9.0, 4.0, 1.0)]
    layout = {"spacing": 0, "count": 3, "axis": 18, "dof": (8, 3, 5, 3), "denominator": 13}
    frf = by_hand(rows, kind=4, ordinate=6, **layout)
    coherence = by_hand(["".join(f"{f:13.5E}{f / 10:13.5E}" for f in (9.0, 4.0, 1.0))], kind=6, **layout)
    contents = cm.read(write(frf + coherence + by_hand(rows, kind=12, ordinate=6, **layout)))
    np.testing.assert_array_equal(contents.frf.frequency, [1.0, 4.0, 9.0])
    np.testing.assert_array_equal(contents.frf.functions, [[1 - 1j, 4 - 4j, 9 - 9j]])
    np.testing.assert_array_equal(contents.frf.coherence[0], [[0.1, 0.4, 0.9]])
    np.testing.assert_array_equal(contents.spectra[0].value, [[1 - 1j, 4 - 4j, 9 - 9j]])


def test_uneven_and_complex_time(write):
    """No record, whose steps are even and whose samples are real, but a function of time; both are said."""
    t = np.arange(12) / 100
    t[7] += 0.004
    rows = ["".join(f"{t[i]:13.5E}{i:13.5E}" for i in range(j, j + 3)) for j in (0, 3, 6, 9)]
    path = write(by_hand(rows, spacing=0, unit="g"))
    with pytest.warns(FileWarning, match="data set 1: its times are uneven at sample 7.*; read as a function of time"):
        got = cm.read_uff(path)
    assert (got.kind, got.axis, got.axis_unit) == ("time response", "time", "s")
    np.testing.assert_allclose(got.abscissa, t, rtol=1e-12)
    np.testing.assert_allclose(got.value, 9.80665 * np.arange(12)[None], rtol=1e-15)
    with pytest.warns(FileWarning), pytest.raises(cm.RecordError, match="holds spectra, needs time records"):
        formats.read_channels(path)
    with pytest.warns(FileWarning, match="its samples are complex"):
        got = cm.read_uff(write(by_hand(ROWS, ordinate=5, count=6)))
    np.testing.assert_array_equal(got.value[0], np.arange(0, 12, 2) + 1j * np.arange(1, 12, 2))
    (real,) = cm.read_uff(write(by_hand(["".join(f"{v:13.5E}" for v in (1, 0, 2, 0))], ordinate=5, count=2)))
    np.testing.assert_array_equal(real.value, [1.0, 2.0])


# Units


def test_factors_of_zero_are_taken_for_si(write):
    path = write(units_by_hand(0, 0) + by_hand(ROWS))
    with pytest.warns(
        FileWarning, match=r"1 \(164, units\) has factors 0 and 0 .* taken for SI .*convert --units mm,N"
    ):
        (tip,) = cm.read_uff(path)
    np.testing.assert_array_equal(tip.value, np.arange(12.0))
    (tip,) = cm.read(path, units="mm,N")
    np.testing.assert_allclose(tip.value, np.arange(12) / 1e3, rtol=1e-15)


def test_units_that_the_user_names(write):
    """1 in = 0.0254 m, 1 lbf = 4.4482216152605 N: BIPM, The International System of Units."""
    data = units_by_hand(1e3, 1.0) + by_hand(ROWS, numerator=8) + by_hand(ROWS, numerator=13)
    travel, force = cm.read(write(data), units="in,lbf")
    np.testing.assert_allclose(travel.value, 0.0254 * np.arange(12), rtol=1e-15)
    np.testing.assert_allclose(force.value, 4.4482216152605 * np.arange(12), rtol=1e-15)
    (tip,) = cm.read(write(units_by_hand(1e3, 1.0) + by_hand(ROWS, unit="g")), units="SI")
    np.testing.assert_allclose(tip.value, 9.80665 * np.arange(12), rtol=1e-15)
    words = 'units "yd,N" are unknown; use SI, or a length of m, mm, um, cm, in'
    assert_refused(words, cm.read, write(data), units="yd,N")
    assert_refused("units are for UFF files", cm.read, "models/table1_rig.toml", units="SI")


# Several things in one file


def test_functions_that_do_not_fit_each_other(write):
    """Other lines, another quantity, a pair that comes twice: several FRFs, in the order of the file."""
    others = [{"dof": (7, 3, 5, 3), "step": "2.00000E-02"}, {"dof": (7, 3, 5, 3), "numerator": 8}, {}]
    contents = cm.read_uff(write(b"".join(frf_by_hand(**changes) for changes in ({}, *others))))
    assert [(f.responses, f.quantity) for f in contents.frfs] == [
        (("8:+Z",), "acceleration/force"), (("7:+Z",), "acceleration/force"),
        (("7:+Z",), "displacement/force"), (("8:+Z",), "acceleration/force"),
    ]  # fmt: skip
    with pytest.raises(cm.RecordError, match='holds several "frf"; choose one of "frf 1"'):
        _ = contents.frf
    assert contents.pick("frf 3") is contents.frfs[2]


def test_what_a_file_holds_and_how_to_choose(tmp_path, write):
    spectrum = by_hand(ROWS, kind=9, axis=18, unit="g^2/Hz")
    path = write(by_hand(ROWS) + frf_by_hand() + coherence_by_hand(8, 5) + spectrum)
    contents = cm.read(path)
    assert [*contents.parts] == ["channels", "frf", "spectra"]
    for text in ('cm.read(path, what="channels")', "1 time records: tip", "density, 1 functions, 12 lines"):
        assert text in repr(contents)
    assert cm.read(path, what="frf") == formats.read_frf(path) == contents.frf
    assert contents.frf.coherence is not None
    assert formats.read_channels(path)[0].name == cm.read(path, what="channels")[0].name == "tip"
    words = r'holds no "modes"; choose one of "channels" \(1 time records: tip\), "frf"'
    assert_refused(words, cm.read, path, what="modes")
    assert_refused('holds no "modes"; it holds "rig"', cm.read, "models/table1_rig.toml", what="modes")
    cm.write(tmp_path / "all.uff", contents)
    again = cm.read(tmp_path / "all.uff")
    assert [*again.parts] == [*contents.parts] and again.frf == contents.frf
    placed = dataclasses.replace(contents, geometry=cm.Geometry((7,), [(0.0, 0.0, 0.0)]))
    assert placed.unplaced == ("8:+Z",) and "without a place  8:+Z" in repr(placed) and not contents.unplaced
    np.testing.assert_allclose(again.spectra[0].value, contents.spectra[0].value, rtol=1e-15)
    cm.write(tmp_path / "channels.mat", contents.channels)
    with pytest.raises(
        cm.RecordError, match=r'NetCDF files take one of "channels", "frf", "spectra"; choose it \(what=, --'
    ):
        cm.write(tmp_path / "one.nc", contents)


def test_what_is_there_where_nothing_is_read(write):
    unread = b"    -1\n  1858\n         0\n    -1\n    -1\n  9999\n         0\n    -1\n"
    said = r"holds data sets 164 \(units\), 1858 \(qualifiers of functions\), 9999 only; there is no function"
    assert_refused(said, cm.read_uff, write(units_by_hand(1, 1) + unread))
