"""Sheets of Excel and OpenDocument; the numbers are those that they are laid out from."""

import zipfile

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.core.notes import RecordNote

from .refusals import assert_refused
from .sheets_by_hand import FS, TABLE, VALUE, N, ods, xlsx

pytest.importorskip("python_calamine")


@pytest.mark.parametrize("write", [xlsx, ods])
def test_a_sheet(tmp_path, recwarn, write):
    path = tmp_path / f"a.{write.__name__}"
    write(path, Data=TABLE)
    acceleration, force = cm.read(path)
    assert (acceleration.name, acceleration.fs, force.name, force.quantity) == ("A", FS, "Force", "force")
    np.testing.assert_array_equal(acceleration.value, 9.80665 * VALUE)
    np.testing.assert_allclose(force.value, -4.4482216152605 * VALUE, rtol=1e-15)
    assert not recwarn.list
    mapped, _ = cm.read(path, {"A [g]": "acc:3"})
    assert mapped.label == "3:+Z"


@pytest.mark.parametrize("write", [xlsx, ods])
def test_the_first_sheet_with_a_table(tmp_path, write):
    path = tmp_path / f"a.{write.__name__}"
    write(path, Notes=[["made by"], ["somebody"]], Data=[["Test 7"], ["Sample rate: 100 Hz"], *TABLE])
    with pytest.warns(RecordNote, match=r'sheet "Data" of 2; header in line 3'):
        assert [c.size for c in cm.read(path)] == [N, N]


@pytest.mark.parametrize("code", ["#N/A", "#DIV/0!", "OVL", None, -9999.0])
def test_codes_in_a_sheet(tmp_path, code):
    table = [list(row) for row in TABLE]
    for row in table[11:13]:
        row[1] = code
    xlsx(tmp_path / "a.xlsx", Data=table)
    with pytest.warns(RecordNote, match='"A" lacks 2 of 50 numbers .*, the first at 0.1 s'):
        channels = cm.read(tmp_path / "a.xlsx")
    np.testing.assert_array_equal(channels[0].value, 9.80665 * VALUE[12:])
    assert channels[0].start == 0.12


def test_sheets_that_cannot_be_read(tmp_path):
    xlsx(tmp_path / "a.xlsx", Notes=[["made by"], ["somebody"]])
    assert_refused(r'a\.xlsx: sheet "Notes": holds no records', cm.read, tmp_path / "a.xlsx")
    for name in ("b.xlsx", "b.ods", "b.xls"):
        (tmp_path / name).write_bytes(b"PK no spreadsheet")
        assert_refused(f"{name}: not a whole spreadsheet", cm.read, tmp_path / name)
    with zipfile.ZipFile(tmp_path / "c.xlsx", "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("xl/workbook.xml", bytes(10**8))
    assert_refused("unpacks to more than", cm.read, tmp_path / "c.xlsx")
