"""The benchmarks' figures as Markdown tables; where a part makes several, by name."""

import re

from .options import STAGES


def study(summary):
    """One row a level: RMSE (dB) / FRAC of every law on links, or the engine there is, and of the rig's own repeat."""
    rows = {(r["level"], r["law"], r["engine"]): r for r in summary["results"]}
    laws = [law["name"] for law in summary["laws"]]
    engines = {key[2] for key in rows} - {"rig"}
    engine = "links" if "links" in engines else min(engines)
    columns = [(law, engine) for law in laws] + [("repeat", "rig")]
    cells = [
        (f"{level:g}", *("{rmse_db:.2f} / {frac:.3f}".format(**rows[level, *column]) for column in columns))
        for level in sorted({key[0] for key in rows})
    ]
    return _table(("level (m/s² RMS)", *laws, "repeat of the rig"), cells)


def speed(rows):
    return _table(("ratio", "median (range)"), ((r["name"], _median(r, ".2f")) for r in rows))


def rotors(result):
    return {"rotors": _rows(result)}


def space(result):
    return {"space": _rows(result)}


def periodic(result):
    return {"periodic": _rows(result)}


def softener(result):
    named = r"(?P<row>.+?)(?: \((?P<size>\d+ elements), (?P<step>[\d.]+) µs a step\))?: (?P<column>.+)"
    return {"softener": _pivot(result, named, "model: median (range)", {"size": "elements", "step": "step, µs"})}


def drives(result):
    named = r"(?P<row>\d+, [^(:]+?)(?: \((?P<step>[\d.]+) µs a step without play\))?: (?P<column>.+)"
    return {"drives": _pivot(result, named, "joints, state: median (range)", {"step": "step without play, µs"})}


def bushings(result):
    named = r"(?P<row>.+): (?P<column>(?:stiffness|time) .+)"
    return {"bushings": _pivot(result, named, "ratio: median (range)", {})}


def productions(result):
    return {"productions": _rows(result)}


def _rows(result):
    cells = [(_with_unit(r), _median(r, ".3g"), r["target"]) for r in result["rows"]]
    cells += [(name, why, "") for name, why in result["skipped"].items()]
    return _table(("quantity", "median (range)", "target"), cells)


def _with_unit(row):
    return row["name"] if row["unit"] == "x" else f"{row['name']}, {row['unit']}"


def _median(row, digits):
    """Return the median with smallest and largest value, where they differ."""
    low, high = f"{row['low']:{digits}}", f"{row['high']:{digits}}"
    limits = f"{low} to {high}" if low.startswith("-") else f"{low}–{high}"
    return f"{row['median']:{digits}}" + ("" if low == high else f" ({limits})")


def _pivot(result, named, head, details):
    """Return a table with a column for each kind of quantity, whose names match ``row`` and ``column``.

    ``details`` are groups of the pattern that describe a row, with their heading. A column's target is in its heading.
    """
    rows, columns = {}, {}
    for measured in result["rows"]:
        parts = re.fullmatch(named, measured["name"])
        cells = rows.setdefault(parts["row"], {name: "" for name in details})
        cells |= {name: parts[name].removesuffix(" elements") for name in details if parts[name]}
        cells[parts["column"]] = _median(measured, ".3g")
        unit = ", %" if measured["unit"] == "%" else ""
        target = f", target {measured['target']}" if measured["target"] else ""
        columns[parts["column"]] = f"{parts['column']}{unit}{target}"
    cells = [(name, *(of_row.get(key, "") for key in (*details, *columns))) for name, of_row in rows.items()]
    cells += [(name, why, *[""] * (len(details) + len(columns) - 1)) for name, why in result["skipped"].items()]
    return _table((head, *details.values(), *columns.values()), cells)


def alternatives(result):
    links = result["best"]["links"]["cost"]
    best = sorted(result["best"].values(), key=lambda row: row["cost"])
    rows = [(r["method"], r["setting"], f"{r['error']:.2f}", *_costs(r["cost"], links)) for r in best]
    raw = result["raw_loop"]
    rows.append(("mj_step in C, nothing read", raw["setting"], "", *_costs(raw["cost"], links)))
    rows += [(name, why, "", "", "") for name, why in result["skipped"].items()]
    heads = ("method", "cheapest setting within 0.5 dB", "error (dB)", "ms per simulated s")
    checks = [(name, f"{error:.4f}") for name, error in result["reference"]["checks"].items()]
    return {
        "alternatives": _table((*heads, "time, links = 1"), rows),
        "reference": _table(("reference against", "dB"), checks),
    }


def _costs(cost, links):
    return f"{1e3 * cost:.1f}", f"{cost / links:.2f}"


def scaling(result):
    rows = []
    for s in result["series"]:
        ends = f"{s['values'][0]:g}–{s['values'][-1]:g} {s['unit']}"
        rows.append((s["name"], ends, f"{s['exponent']:.2f}"))
    return {"scaling": _table(("time", "range", "exponent"), rows)}


def memory(result):
    rows = [(r["simulations"], f"{r['seconds']:g}", f"{r['peak'] / 1e6:.0f}") for r in result["rows"]]
    peaks = {(r["way"], r["seconds"]): f"{r['peak'] / 1e6:.0f}" for r in result["runs"]}
    runs = [(f"{s}", *(peaks.get((way, s), "") for way in ("whole", "blocks"))) for s in sorted({k[1] for k in peaks})]
    return {
        "memory": _table(("simulations", "seconds each", "peak (MB)"), rows),
        "long run": _table(("seconds", "whole, peak (MB)", "in blocks, peak (MB)"), runs),
    }


def links(result):
    """Return rows of a CSV file: costs of MuJoCo's functions, of its options and of armatures in the engine links."""
    stages = {**STAGES, "mj_step": "a whole step", "engine": "a step of the engine, all updates and outputs included"}
    profile = result["profile"]["links"]
    return [
        ("kind", "item", "time per step, µs", "time per simulated s, ms", "FRF error, dB"),
        *(("function", f"{stage}: {text}", f"{profile[stage]:.2f}", "", "") for stage, text in stages.items()),
        *(("option", r["option"], *_outcome(r)) for r in result["options"] if r["engine"] == "links"),
        *(("armature", r["option"], *_outcome(r)) for r in result["armature"]),
    ]


def _outcome(row):
    if "failed" in row:
        return "failed", "", ""
    return f"{1e6 * row['per_step']:.1f}", f"{1e3 * row['cost']:.0f}", f"{row['error']:.3f}"


def _table(heads, rows):
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)
