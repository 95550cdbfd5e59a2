"""Tables of bearings over the spin, read from files: CSV, sheets as ROSS reads them (XLTRC2's too), and ROSS' own TOML.

A header names the columns: "speed", or "frequency", and coefficients such as "kyz" or "cxx". A shaft along z, as ROSS
has it, whose bearings have x and y, has them along y and z here. Units stand in the header, in brackets, or in the row
beneath it; without any they are SI units, and rad/s.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ..core.checks import naming
from ..core.errors import RecordError, RigError
from ..core.units import unit_factor
from ..core.validation import read_plain

__all__ = ["read_bearing_table", "with_bearing_tables"]

_COEFFICIENT = re.compile(r"([kc])([xyz])([xyz])\b\W*(.*?)\W*", re.IGNORECASE)
_SPEED = re.compile(r"(?:speed|spin|frequency|omega|rpm)\b\W*(.*?)\W*", re.IGNORECASE)
_UNITS = {"k": "N/m", "c": "N s/m", "": "rad/s"}
_SHEETS = (".xlsx", ".xls", ".ods")


def with_bearing_tables(data: dict[str, Any], named: Callable[[str], str]) -> dict[str, Any]:
    """Return plain data of a rig with the numbers of the tables that its bearings name.

    Parameters
    ----------
    data : dict
        Plain data as of a rig file.
    named : callable
        Returns the path of a file that the rig file names.

    Raises
    ------
    RigError
        If a table cannot be read.
    """
    bearings = data.get("bearings")
    if not isinstance(bearings, list | tuple):
        return data
    filled = []
    for bearing in bearings:
        if isinstance(bearing, dict) and isinstance(bearing.get("table"), str):
            fields = {name: value for name, value in bearing.items() if name != "table"}
            bearing = fields | read_bearing_table(named(bearing["table"]))
        filled.append(bearing)
    return data | {"bearings": filled}


def read_bearing_table(path: str | Path) -> dict[str, Any]:
    """Read stiffness and damping of a bearing over the spin; the module describes the files.

    Parameters
    ----------
    path : str or Path
        A .csv, .xlsx, .xls or .ods file, or a .toml file that ROSS saved.

    Returns
    -------
    dict
        "spin" (n,) rad/s, "stiffness" (n, 4) N/m and "damping" (n, 4) N s/m, rows as of `Bearing`.

    Raises
    ------
    RigError
        If it holds no such table, or a table with a hole in it.
    """
    with naming(path, RigError):
        is_toml = Path(path).suffix.lower() == ".toml"
        return _bearing_fields(_saved_by_ross(path) if is_toml else _columns(_cells(Path(path))))


def _cells(path: Path) -> list[list[Any]]:
    """Return the rows of the first sheet, or of a text table."""
    try:
        if path.suffix.lower() in _SHEETS:
            import pandas as pd

            return pd.read_excel(path, header=None, dtype=object, na_filter=False, engine="calamine").values.tolist()
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise RigError(f"cannot be read ({error.strerror})") from None
    except ImportError:
        raise RigError("is a sheet, which the package python-calamine reads; install it, or save as CSV") from None
    except ValueError as error:  # pandas' and the decoder's
        raise RigError(f"is no table ({error})") from None
    delimiter = max(",;\t", key=text.count)
    return [row for row in csv.reader(text.splitlines(), delimiter=delimiter) if any(cell.strip() for cell in row)]


def _saved_by_ross(path: str | Path) -> dict[str, list[float]]:
    """Return the columns of the only bearing in a file of ROSS' elements, in SI units."""
    tables = [table for table in read_plain(path, RigError).values() if isinstance(table, dict) and "kxx" in table]
    if len(tables) != 1:
        raise RigError(f"holds {len(tables)} tables with kxx; a bearing has one")
    columns = {n: v if isinstance(v, list) else [v] for n, v in tables[0].items()}
    names = (name for name in columns if _COEFFICIENT.fullmatch(name) or name == "frequency")
    return {"" if name == "frequency" else name: columns[name] for name in names if columns[name] != [None]}


def _columns(rows: Sequence[Sequence[Any]]) -> dict[str, list[float]]:
    """Return the numbers under each name in SI units, "" for the speed."""
    heads = (i for i, row in enumerate(rows) if any(_COEFFICIENT.fullmatch(str(cell).strip()) for cell in row))
    if (head := next(heads, None)) is None:
        raise RigError("has no header with coefficients such as kyy, kyz, cyy; name the columns")
    units, first = [""] * len(rows[head]), head + 1
    if first < len(rows) and all(_number(cell) is None for cell in rows[first]):
        units, first = [str(cell).strip(" []()") for cell in rows[first]], first + 1
    # Sheets of XLTRC2 may say their units anywhere: ROSS looks for these words, too.
    words = " ".join(str(cell).lower() for row in rows[:first] for cell in row)
    default_units = {"": "rpm" * ("rpm" in words)} | ({"k": "lbf/in", "c": "lbf s/in"} if "lb" in words else {})
    columns: dict[str, list[float]] = {}
    for i, cell in enumerate(rows[head]):
        text = str(cell).strip()
        if match := _COEFFICIENT.fullmatch(text):
            name, unit = "".join(match.groups()[:3]).lower(), match[4]
        elif match := _SPEED.fullmatch(text):
            name, unit = "", match[1]
        else:
            continue
        unit = unit or units[i] or default_units.get(name[:1], "")
        with naming(text, RecordError, RigError):
            scale = unit_factor(unit, _UNITS[name[:1]]) if unit else 1.0
        values = [_number(row[i]) if i < len(row) else None for row in rows[first:]]
        if None in values:
            hole = values.index(None)
            raise RigError(f"row {first + hole + 1} has no number for {text}; a table has one in every row")
        columns[name] = [scale * v for v in values if v is not None]
    return columns


def _number(cell: Any) -> float | None:
    try:
        value = float(cell)
    except (TypeError, ValueError):
        return None
    return value if math.isfinite(value) else None


def _bearing_fields(columns: dict[str, list[float]]) -> dict[str, Any]:
    """Return a bearing's fields; missing coefficients are 0, the second direct one is that of the first direction."""
    across = "xy" if any("x" in name for name in columns) else "yz"
    size = max(map(len, columns.values()), default=0)
    fields: dict[str, Any] = {"spin": columns.get("", [])}
    for kind, name in (("k", "stiffness"), ("c", "damping")):
        known = {f"{kind}{2 * across[1]}": columns.get(kind + 2 * across[0])} | columns
        coefficients = (known.get(f"{kind}{a}{b}") or [0.0] * size for a in across for b in across)
        fields[name] = [list(row) for row in zip(*coefficients)]
    return fields
