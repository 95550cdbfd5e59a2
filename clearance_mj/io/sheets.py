"""Sheets of Excel and OpenDocument, tables as in CSV files; by the package python-calamine."""

from __future__ import annotations

import io
import zipfile
from os import PathLike

from ..core.checks import naming
from ..core.errors import RecordError
from ..core.files import TOO_DENSE, most_unpacked, read_bytes
from ..core.notes import note
from ..signals.frf import FRF
from .channels import Channel
from .columns import Columns, Contents
from .csv_tables import read_table
from .registry import Format, register
from .time_axis import Rate, Rates
from .waveforms import MeasurementProgram, whole

__all__ = ["read_sheet"]

CALAMINE = MeasurementProgram("python-calamine", "python_calamine", "spreadsheet", "sheets")


def read_sheet(path: str | PathLike[str], columns: Columns = None, fs: Rate = None, resample: Rate = None) -> Contents:
    """Read the time records or the FRFs of the first sheet that holds a table, as `read_csv` reads those of a text."""
    import pandas as pd

    reasons: list[str] = []
    with naming(path):
        CALAMINE.require()
    data = io.BytesIO(read_bytes(path))
    with naming(path):
        with whole("spreadsheet file"):
            if zipfile.is_zipfile(data):
                with zipfile.ZipFile(data) as file:
                    if sum(part.file_size for part in file.infolist()) > most_unpacked(data.getbuffer().nbytes):
                        raise RecordError(TOO_DENSE)
            sheets = pd.read_excel(data, None, header=None, dtype=object, na_filter=False, engine="calamine")
        for name, frame in sheets.items():
            info = [f'sheet "{name}" of {len(sheets)}'] if len(sheets) > 1 else []
            try:
                table = frame.to_csv(sep="\t", header=False, index=False).encode()
                contents = read_table(table, columns or {}, Rates(fs, resample, info))
            except RecordError as error:
                reasons.append(f'sheet "{name}": {error}')
            else:
                note(path, info)
                return contents
        raise RecordError("; ".join(reasons) or "holds no sheet")


register(Format(
    "Excel", (".xlsx", ".xlsm", ".xlsb", ".xls", ".ods"), (Channel, FRF), read_sheet,
    options=("columns", "fs", "resample"),
    note='the first sheet with a table; needs python-calamine: `pip install "clearance-mj[sheets]"`',
))  # fmt: skip
