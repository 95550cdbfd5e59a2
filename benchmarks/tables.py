"""The benchmarks' figures as Markdown tables; where a part makes several, by name."""

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
    cells = ((r["name"], f"{r['median']:.2f} x", f"{r['low']:.2f} to {r['high']:.2f}") for r in rows)
    return _table(("what", "median", "range"), cells)


def rotors(found):
    return {"rotors": _rows(found)}


def space(found):
    return {"space": _rows(found)}


def periodic(found):
    return {"periodic": _rows(found)}


def softener(found):
    return {"softener": _rows(found)}


def drives(found):
    return {"drives": _rows(found)}


def bushings(found):
    return {"bushings": _rows(found)}


def productions(found):
    return {"productions": _rows(found)}


def _rows(found):
    cells = [
        (r["name"], f"{r['median']:.3g} {r['unit']}", f"{r['low']:.3g} to {r['high']:.3g}", r["target"])
        for r in found["rows"]
    ]
    cells += [(name, why, "", "") for name, why in found["skipped"].items()]
    return _table(("what", "median", "range", "target"), cells)


def alternatives(found):
    links = found["best"]["links"]["cost"]
    best = sorted(found["best"].values(), key=lambda row: row["cost"])
    rows = [(r["method"], r["setting"], f"{r['error']:.2f}", *_costs(r["cost"], links)) for r in best]
    raw = found["raw_loop"]
    rows.append(("mj_step in C, nothing read", raw["setting"], "", *_costs(raw["cost"], links)))
    rows += [(name, why, "", "", "", "") for name, why in found["skipped"].items()]
    heads = ("method", "cheapest setting within 0.5 dB", "error (dB)", "ms per simulated s", "times real time")
    checks = [(name, f"{error:.4f}") for name, error in found["reference"]["checks"].items()]
    return {
        "alternatives": _table((*heads, "time, links = 1"), rows),
        "reference": _table(("reference against", "dB"), checks),
    }


def _costs(cost, links):
    return f"{1e3 * cost:.1f}", f"{1 / cost:.1f}", f"{cost / links:.2f}"


def scaling(found):
    rows = []
    for s in found["series"]:
        ends = f"{s['values'][0]:g} to {s['values'][-1]:g} {s['unit']}"
        rows.append((s["name"], ends, f"{_time(s['seconds'][0])} to {_time(s['seconds'][-1])}", f"{s['exponent']:.2f}"))
    return {"scaling": _table(("what", "from, to", "time", "exponent"), rows)}


def memory(found):
    rows = [(r["simulations"], f"{r['seconds']:g}", f"{r['peak'] / 1e6:.0f}") for r in found["rows"]]
    peaks = {(r["way"], r["seconds"]): f"{r['peak'] / 1e6:.0f}" for r in found["runs"]}
    runs = [(f"{s}", *(peaks.get((way, s), "") for way in ("whole", "blocks"))) for s in sorted({k[1] for k in peaks})]
    return {
        "memory": _table(("simulations", "seconds each", "peak (MB)"), rows),
        "long run": _table(("seconds", "whole, peak (MB)", "in blocks, peak (MB)"), runs),
    }


def options(found):
    stages = {**STAGES, "mj_step": "a whole step", "engine": "a step of the engine, all updates and outputs included"}
    engines = list(found["profile"])
    profile = [(f"`{s}`", text, *(f"{found['profile'][e][s]:.2f}" for e in engines)) for s, text in stages.items()]
    rows = [(r["engine"], r["option"], *_outcome(r)) for r in found["options"]]
    scaled = [(r["option"], *_outcome(r)) for r in found["armature"]]
    heads = ("µs per step", "ms per simulated s", "error (dB)")
    return {
        "profile": _table(("function", "what it does", *(f"{e} (µs)" for e in engines)), profile),
        "options": _table(("engine", "option", *heads), rows),
        "armature": _table(("chain", *heads), scaled),
    }


def _outcome(row):
    if "failed" in row:
        return "failed", "", ""
    return f"{1e6 * row['per_step']:.1f}", f"{1e3 * row['cost']:.0f}", f"{row['error']:.3f}"


def _time(seconds):
    for unit, scale in (("s", 1.0), ("ms", 1e3), ("µs", 1e6)):
        if seconds * scale >= 0.1:
            return f"{seconds * scale:.3g} {unit}"
    return f"{seconds * 1e6:.2g} µs"


def _table(heads, rows):
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)
