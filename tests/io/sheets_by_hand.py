"""Sheets of Excel and OpenDocument, laid out by hand from ECMA-376 and OASIS OpenDocument 1.3."""

import zipfile

import numpy as np

N, FS = 50, 100.0
VALUE = np.round(np.sin(np.arange(N)), 6)
TABLE = [["time [s]", "A [g]", "Force (lbf)"], *([i / FS, a, -a] for i, a in enumerate(VALUE.tolist()))]


def xlsx(path, **sheets):
    """Numbers as <v>, texts as inline strings, errors as Excel has them."""
    spread = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    package = "http://schemas.openxmlformats.org/package/2006"
    kind = "application/vnd.openxmlformats-officedocument.spreadsheetml."
    related = f'<Relationships xmlns="{package}/relationships">'
    kinds, listed, relations, files = "", "", "", {}
    for i, (name, rows) in enumerate(sheets.items()):
        kinds += f'<Override PartName="/xl/worksheets/sheet{i}.xml" ContentType="{kind}worksheet+xml"/>'
        listed += f'<sheet name="{name}" sheetId="{i + 1}" r:id="r{i}"/>'
        relations += f'<Relationship Id="r{i}" Type="{office}/worksheet" Target="worksheets/sheet{i}.xml"/>'
        cells = (
            "".join(_cell(f"{chr(65 + c)}{r}", cell) for c, cell in enumerate(row)) for r, row in enumerate(rows, 1)
        )
        body = "".join(f'<row r="{r}">{row}</row>' for r, row in enumerate(cells, 1))
        files[f"xl/worksheets/sheet{i}.xml"] = f'<worksheet xmlns="{spread}"><sheetData>{body}</sheetData></worksheet>'
    files["[Content_Types].xml"] = (
        f'<Types xmlns="{package}/content-types"><Default Extension="rels" '
        'ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        f'<Override PartName="/xl/workbook.xml" ContentType="{kind}sheet.main+xml"/>{kinds}</Types>'
    )
    target = f'<Relationship Id="r" Type="{office}/officeDocument" Target="xl/workbook.xml"/>'
    files["_rels/.rels"] = f"{related}{target}</Relationships>"
    files["xl/workbook.xml"] = f'<workbook xmlns="{spread}" xmlns:r="{office}"><sheets>{listed}</sheets></workbook>'
    files["xl/_rels/workbook.xml.rels"] = f"{related}{relations}</Relationships>"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in files.items():
            file.writestr(name, content)


def _cell(place, value):
    if value is None:
        return ""
    if isinstance(value, str) and not value.startswith("#"):
        return f'<c r="{place}" t="inlineStr"><is><t>{value}</t></is></c>'
    return (
        f'<c r="{place}" t="e"><v>{value}</v></c>' if isinstance(value, str) else f'<c r="{place}"><v>{value!r}</v></c>'
    )


def ods(path, **sheets):
    space = "urn:oasis:names:tc:opendocument:xmlns:"
    head = " ".join(f'xmlns:{name}="{space}{name}:1.0"' for name in ("office", "table", "text"))
    text = '<table:table-cell office:value-type="string"><text:p>{}</text:p></table:table-cell>'
    number = '<table:table-cell office:value-type="float" office:value="{!r}"/>'
    tables = ""
    for name, rows in sheets.items():
        cells = ("".join((text if isinstance(cell, str) else number).format(cell) for cell in row) for row in rows)
        body = "".join(f"<table:table-row>{row}</table:table-row>" for row in cells)
        tables += f'<table:table table:name="{name}">{body}</table:table>'
    body = f"<office:body><office:spreadsheet>{tables}</office:spreadsheet></office:body>"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet", zipfile.ZIP_STORED)
        file.writestr("META-INF/manifest.xml", f'<manifest xmlns="{space}manifest:1.0"/>')
        file.writestr("content.xml", f"<office:document-content {head}>{body}</office:document-content>")
