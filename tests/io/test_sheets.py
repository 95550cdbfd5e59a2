"""Sheets of Excel and OpenDocument, laid out by hand from ECMA-376 and OASIS OpenDocument 1.3."""

import zipfile

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.core.errors import RecordError
from clearance_mj.core.notes import RecordNote

pytest.importorskip("python_calamine")
N, FS = 50, 100.0
VALUE = np.round(np.sin(np.arange(N)), 6)
TABLE = [["time [s]", "A [g]", "Force (lbf)"], *([i / FS, a, -a] for i, a in enumerate(VALUE.tolist()))]


def xlsx(path, **sheets):
    """Numbers as <v>, texts as inline strings, errors as Excel has them."""
    names = [*sheets]
    spread = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    package = "http://schemas.openxmlformats.org/package/2006"
    kinds = "".join(
        f'<Override PartName="/xl/worksheets/sheet{i}.xml" '
        'ContentType="application/vnd.openxmlformats-officedocument.spreadsheetml.worksheet+xml"/>'
        for i in range(len(names))
    )
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr(
            "[Content_Types].xml",
            f'<Types xmlns="{package}/content-types"><Default Extension="rels" '
            'ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
            '<Override PartName="/xl/workbook.xml" '
            'ContentType="application/vnd.openxmlformats-officedocument.spreadsheetml.sheet.main+xml"/>'
            f"{kinds}</Types>",
        )
        file.writestr(
            "_rels/.rels",
            f'<Relationships xmlns="{package}/relationships"><Relationship Id="r" Type="{office}/officeDocument" '
            'Target="xl/workbook.xml"/></Relationships>',
        )
        file.writestr(
            "xl/workbook.xml",
            f'<workbook xmlns="{spread}" xmlns:r="{office}"><sheets>'
            + "".join(f'<sheet name="{name}" sheetId="{i + 1}" r:id="r{i}"/>' for i, name in enumerate(names))
            + "</sheets></workbook>",
        )
        file.writestr(
            "xl/_rels/workbook.xml.rels",
            f'<Relationships xmlns="{package}/relationships">'
            + "".join(
                f'<Relationship Id="r{i}" Type="{office}/worksheet" Target="worksheets/sheet{i}.xml"/>'
                for i in range(len(names))
            )
            + "</Relationships>",
        )
        for i, rows in enumerate(sheets.values()):
            body = "".join(
                f'<row r="{r}">{"".join(_cell(f"{chr(65 + c)}{r}", cell) for c, cell in enumerate(row))}</row>'
                for r, row in enumerate(rows, 1)
            )
            file.writestr(
                f"xl/worksheets/sheet{i}.xml", f'<worksheet xmlns="{spread}"><sheetData>{body}</sheetData></worksheet>'
            )


def _cell(place, value):
    if value is None:
        return ""
    if isinstance(value, str) and value.startswith("#"):
        return f'<c r="{place}" t="e"><v>{value}</v></c>'
    if isinstance(value, str):
        return f'<c r="{place}" t="inlineStr"><is><t>{value}</t></is></c>'
    return f'<c r="{place}"><v>{value!r}</v></c>'


def ods(path, **sheets):
    head = " ".join(
        f'xmlns:{name}="urn:oasis:names:tc:opendocument:xmlns:{name}:1.0"' for name in ("office", "table", "text")
    )
    tables = ""
    for name, rows in sheets.items():
        tables += f'<table:table table:name="{name}">'
        for row in rows:
            cells = (
                f'<table:table-cell office:value-type="string"><text:p>{cell}</text:p></table:table-cell>'
                if isinstance(cell, str)
                else f'<table:table-cell office:value-type="float" office:value="{cell!r}"/>'
                for cell in row
            )
            tables += f"<table:table-row>{''.join(cells)}</table:table-row>"
        tables += "</table:table>"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet", zipfile.ZIP_STORED)
        file.writestr("META-INF/manifest.xml", '<manifest xmlns="urn:oasis:names:tc:opendocument:xmlns:manifest:1.0"/>')
        file.writestr(
            "content.xml",
            f"<office:document-content {head}><office:body><office:spreadsheet>{tables}</office:spreadsheet>"
            "</office:body></office:document-content>",
        )


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
    with pytest.raises(RecordError, match=r'a\.xlsx: sheet "Notes": holds no records'):
        cm.read(tmp_path / "a.xlsx")
    for name in ("b.xlsx", "b.ods", "b.xls"):
        (tmp_path / name).write_bytes(b"PK no spreadsheet")
        with pytest.raises(RecordError, match=f"{name}: not a whole spreadsheet"):
            cm.read(tmp_path / name)
    with zipfile.ZipFile(tmp_path / "c.xlsx", "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("xl/workbook.xml", bytes(10**8))
    with pytest.raises(RecordError, match="unpacks to more than"):
        cm.read(tmp_path / "c.xlsx")
