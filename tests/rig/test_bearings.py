"""Bearings with stiffness and damping in two directions: what tables say, in which units, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from clearance_mj.core.errors import RigError
from clearance_mj.rig import Bearing
from clearance_mj.rig.bearing_tables import read_bearing_table

from ..io.sheets_by_hand import ods, xlsx
from ..refusals import assert_refused

HEAD = "speed (rpm),kyy (N/m),kyz (N/m),kzy (N/m),kzz (N/m),cyy (N s/m),czz (N s/m)\n"


def write(folder: Path, text: str, name: str = "seal.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_a_table_has_a_row_for_every_spin(tmp_path: Path) -> None:
    table = read_bearing_table(write(tmp_path, HEAD + "1000,1e6,2e5,-2e5,1.1e6,100,110\n2000,2e6,4e5,-4e5,2e6,90,95\n"))
    assert_allclose(table["spin"], np.array([1000, 2000]) * np.pi / 30)
    assert table["stiffness"] == [[1e6, 2e5, -2e5, 1.1e6], [2e6, 4e5, -4e5, 2e6]]
    assert table["damping"] == [[100.0, 0.0, 0.0, 110.0], [90.0, 0.0, 0.0, 95.0]]


def test_units_may_stand_beneath_or_above_and_directions_may_be_those_of_a_shaft_along_z(tmp_path: Path) -> None:
    """ROSS' x and y are y and z here; without kyy both directions are alike; 1 lbf/in = 4.4482216/0.0254 N/m."""
    beneath = read_bearing_table(write(tmp_path, "frequency;kxx;kxy;cxx\nrpm;lbf/in;lbf/in;lbf-s/in\n60;100;10;1\n"))
    above = read_bearing_table(write(tmp_path, "in rpm,and lb\nSpeed,Kxx,Kxy,Cxx\n60,100,10,1\n"))
    factor = 4.4482216152605 / 0.0254
    for table in (beneath, above):
        assert_allclose(table["spin"], [2 * np.pi])
        assert_allclose(table["stiffness"], [[100 * factor, 10 * factor, 0, 100 * factor]])
        assert_allclose(table["damping"], [[factor, 0, 0, factor]])


@pytest.mark.parametrize("writer", [xlsx, ods])
def test_sheets_are_read_as_ross_reads_them(tmp_path: Path, writer: Callable[..., None]) -> None:
    """A title, names in one row, units beneath, numbers: XLTRC2's sheet, whose x and y are y and z here."""
    pytest.importorskip("python_calamine")
    rows = [
        ["Bearing, two-axial-groove"], ["Speed", "Kxx", "Kxy", "Kyx", "Kyy", "Cxx", "Cxy", "Cyx", "Cyy"],
        ["rpm", *["N/m"] * 4, *["N-s/m"] * 4], [1000, 1e7, 2e6, -3e6, 1.5e7, 1e4, 10, 20, 2e4],
        [2000, 2e7, 3e6, -4e6, 2.5e7, 3e4, 30, 40, 4e4],
    ]  # fmt: skip
    path = tmp_path / f"bearing.{writer.__name__}"
    writer(path, Bearing=rows)
    table = read_bearing_table(path)
    assert_allclose(table["spin"], np.array([1000, 2000]) * np.pi / 30)
    assert table["stiffness"] == [[1e7, 2e6, -3e6, 1.5e7], [2e7, 3e6, -4e6, 2.5e7]]
    assert table["damping"] == [[1e4, 10.0, 20.0, 2e4], [3e4, 30.0, 40.0, 4e4]]


def test_what_ross_saved_is_read(tmp_path: Path) -> None:
    text = "[Other_0]\nn = 1\n\n[BearingElement_seal]\nn = 6\nkxx = [1e6, 2e6]\nkyx = [1.0, 2.0]\ncxx = [3.0, 4.0]\n"
    table = read_bearing_table(write(tmp_path, text + "frequency = [10.0, 20.0]\n", "seal.toml"))
    assert table == {
        "spin": [10.0, 20.0], "stiffness": [[1e6, 0.0, 1.0, 1e6], [2e6, 0.0, 2.0, 2e6]],
        "damping": [[3.0, 0.0, 0.0, 3.0], [4.0, 0.0, 0.0, 4.0]],
    }  # fmt: skip


@pytest.mark.parametrize(("text", "words"), [
    (HEAD + "1000,1e6,2e5,,1e6,1,1\n", r"seal.csv: row 2 has no number for kzy \(N/m\); a table has one in every"),
    (HEAD + "1000,1e6,nan,0,1e6,1,1\n", r"row 2 has no number for kyz"),
    ("speed,stiffness\n1,2\n", r"has no header with coefficients such as kyy, kyz, cyy"),
    ("speed,kyy (m)\n1,2\n", r'unit "m" of N/m is unknown'),
])  # fmt: skip
def test_a_table_with_a_hole_in_it_is_refused_in_a_line(text: str, words: str, tmp_path: Path) -> None:
    assert_refused(RigError, words, read_bearing_table, write(tmp_path, text))


def test_between_rows_a_curve_and_beyond_them_nothing() -> None:
    rows = [[k, 0.0, 0.0, k] for k in (1.0, 2.0, 4.0)]
    bearing = Bearing(0.1, rows, spin=(0.0, 10.0, 20.0))  # type: ignore[arg-type]
    assert bearing.at(10.0).stiffness[0, 0] == 2.0 and 1.0 < bearing.at(5.0).stiffness[1, 1] < 2.0
    assert not bearing.at(5.0).damping.any()
    constant = Bearing(0.1, [rows[0]] * 3, spin=(0.0, 10.0, 20.0))  # type: ignore[arg-type]
    assert_allclose(constant.at(7.3).stiffness, Bearing(0.1, 1.0).at(7.3).stiffness, rtol=0, atol=0)  # type: ignore[arg-type]
    words = r"bearing at 0\.1 is known from 0 to 20 rad/s, not at 30 rad/s; extend its table"
    assert_refused(RigError, words, bearing.at, 30.0)


@pytest.mark.parametrize(("fields", "words"), [
    ({"stiffness": [[1.0, 0.0, 0.0, 1.0]] * 2}, "stiffness has 2 rows and spin 0 speeds; give one row for each"),
    ({"stiffness": [[1.0, 0, 0, 1.0]] * 2, "spin": (2.0, 1.0)}, "spin must rise from row to row"),
    ({}, "holds nothing; give stiffness or damping"),
    ({"stiffness": [[1.0, 2.0], [3.0]]}, "stiffness"),
])  # fmt: skip
def test_a_bearing_that_cannot_be_is_refused_in_a_line(fields: dict, words: str) -> None:
    assert_refused(RigError, words, Bearing, 0.1, **fields)
