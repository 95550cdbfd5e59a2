"""Compare the numbers of two result folders, table by table: `python -m benchmarks.compare_results BEFORE AFTER`.

Reads every CSV file, every JSON file and every table of the Markdown pages that both folders hold under the same name
(the results of a study, of `make reproduce`, a verification page). A difference is relative to the largest magnitude
of its column in BEFORE, so that a value that is zero to rounding does not count. Columns that hold times of computing
are left out. Where a CSV file has other rows than before, those are compared that both have, by the leading columns
that tell rows apart, and a note says how many came or went.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from pathlib import Path

import numpy as np
import pandas as pd

NOT_RESULTS = re.compile(r"(^|_)(cpu|elapsed|seconds|time_ms|worst_ms|median_ms|version|versions)$")
NUMBER = re.compile(r"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")


def main(arguments=None) -> int:
    """Print a row per table; status 1 if a table is missing or differs by more than ``--tolerance``."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path)
    parser.add_argument("--tolerance", type=float, default=1e-6, help="largest relative difference (1e-6)")
    parser.add_argument("--csv", type=Path, help="write the rows to this file too")
    options = parser.parse_args(arguments)
    rows = pd.DataFrame(compare_folders(options.before, options.after))
    with pd.option_context("display.width", 160, "display.max_rows", None, "display.max_colwidth", 90):
        print(rows.to_string(index=False))
    if options.csv:
        rows.to_csv(options.csv, index=False)
    worst = rows["difference"].max()
    changed = rows["note"].astype(bool).sum()
    print(f"{len(rows)} tables, largest relative difference {worst:.2g}, {changed} with a note")
    return int(not worst <= options.tolerance or changed > 0)


def compare_folders(before: Path, after: Path) -> list[dict]:
    """Return a row per table of ``before``: its name, how many numbers, the largest difference and where it is."""
    if before.is_file():
        return [compare_tables(before.name, read_table(before), read_table(after))]
    rows = []
    for path in sorted(p for p in before.rglob("*") if p.suffix in (".csv", ".json", ".md")):
        name = path.relative_to(before)
        if {"cache", ".cache"} & set(name.parts):
            continue
        if not (after / name).is_file():
            rows.append({"table": str(name), "numbers": 0, "difference": 0.0, "where": "", "note": "missing"})
            continue
        old, new, note = _common_rows(read_table(path), read_table(after / name))
        row = compare_tables(str(name), old, new)
        rows.append(row | {"note": "; ".join(filter(None, (note, row["note"])))[:80]})
    return rows


def _common_rows(before, after):
    """Rows of both tables, where they have other numbers of rows, and a note on the others."""
    lengths = [{len(values) for values in table.values()} for table in (before, after)]
    if lengths[0] == lengths[1] or any(len(counts) != 1 for counts in lengths):
        return before, after, ""
    old, new = pd.DataFrame(before), pd.DataFrame(after)
    shared = [name for name in old if name in new]
    keys = next((shared[:n] for n in range(1, len(shared)) if not old.duplicated(shared[:n]).any()), shared)
    old, new = old.set_index(keys, drop=False), new.set_index(keys, drop=False)
    both = old.index.intersection(new.index)
    note = f"{len(old) - len(both)} rows went, {len(new) - len(both)} came"
    return *({str(name): list(table.loc[both, name]) for name in table} for table in (old, new)), note


def compare_tables(name: str, before: dict[str, list], after: dict[str, list]) -> dict:
    """Compare columns of values that two files hold under the same names."""
    numbers, worst, where, notes = 0, 0.0, "", []
    for column, old in before.items():
        if NOT_RESULTS.search(column):
            continue
        new = after.get(column)
        if new is None or len(new) != len(old):
            notes.append(f"{column}: {len(old)} values, now {'none' if new is None else len(new)}")
            continue
        a, b = (np.array([_number(v) for v in values]) for values in (old, new))
        words = [(u, v) for u, v, x, y in zip(old, new, a, b) if np.isnan(x) and np.isnan(y) and str(u) != str(v)]
        if words:
            notes.append(f"{column}: {words[0][0]!r} is {words[0][1]!r}")
        if (np.isnan(a) != np.isnan(b)).any():
            notes.append(f"{column}: numbers came or went")
        scale = np.nanmax(np.abs(a), initial=0.0)
        numbers += int(np.isfinite(a).sum())
        difference = np.nanmax(np.abs(b - a), initial=0.0) / scale if scale > 0 else np.nanmax(np.abs(b), initial=0.0)
        if difference > worst:
            worst, where = float(difference), column
    return {"table": name, "numbers": numbers, "difference": worst, "where": where, "note": "; ".join(notes)[:80]}


def read_table(path: Path) -> dict[str, list]:
    """Read a file as columns of values by name."""
    if path.suffix == ".csv":
        table = pd.read_csv(path, dtype=str, keep_default_na=False, comment=None)
        return {str(name): list(table[name]) for name in table}
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".json":
        columns: dict[str, list] = {}
        _flatten(json.loads(text), "", columns)
        return columns
    columns = {}
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if line.startswith("|") and not set("".join(cells)) <= set("-: "):
            columns.setdefault(cells[0], []).extend(NUMBER.findall(" ".join(cells[1:])))
    return columns


def _flatten(value, name, columns):
    """Collect the leaves of nested JSON, those of a list under one name."""
    if isinstance(value, dict):
        for key, inner in value.items():
            _flatten(inner, f"{name}.{key}" if name else str(key), columns)
    elif isinstance(value, list):
        for inner in value:
            _flatten(inner, name, columns)
    else:
        columns.setdefault(name, []).append(value)


def _number(value) -> float:
    try:
        return float("nan") if isinstance(value, bool) else float(value)
    except (TypeError, ValueError):
        return float("nan")


if __name__ == "__main__":
    sys.exit(main())
