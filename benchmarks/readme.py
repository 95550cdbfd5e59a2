"""Put the figures of the last study and benchmark into README.md: ``python -m benchmarks.readme``."""

import json
import re
import shutil
from pathlib import Path

from clearance_mj.io.files import replacing

README = Path("README.md")
STUDY, BENCH = Path("results/study"), Path("results/bench.json")


def main():
    text = README.read_text(encoding="utf-8")
    if (STUDY / "summary.json").exists():
        text = put(text, "study", study_table(json.loads((STUDY / "summary.json").read_text())))
        shutil.copyfile(STUDY / "figures" / "frf_bushings_level_2.png", "docs/frf_bushings.png")
    if BENCH.exists():
        text = put(text, "bench", bench_table(json.loads(BENCH.read_text())))
    with replacing(README) as temporary:
        temporary.write_text(text, encoding="utf-8")


def put(text, name, table):
    """Replace what stands between the two comments of a name."""
    pattern = re.compile(f"(<!-- {name} -->\n).*?(<!-- /{name} -->)", re.DOTALL)
    return pattern.sub(lambda found: f"{found[1]}\n{table}\n{found[2]}", text)


def study_table(summary):
    """One row a level: RMSE (dB) / FRAC of every law on the links engine, and of the rig's own repeat."""
    rows = {(r["level"], r["law"], r["engine"]): r for r in summary["results"]}
    laws = [law["name"] for law in summary["laws"]]
    columns = [(law, "links") for law in laws] + [("repeat", "rig")]
    heads = [*laws, "repeat of the rig"]
    lines = ["| level (m/s² RMS) | " + " | ".join(heads) + " |", "|---" * (len(heads) + 1) + "|"]
    for level in sorted({key[0] for key in rows}):
        cells = [rows[level, law, engine] for law, engine in columns]
        values = [f"{cell['rmse_db']:.2f} / {cell['frac']:.3f}" for cell in cells]
        lines.append(f"| {level:g} | " + " | ".join(values) + " |")
    return "\n".join(lines)


def bench_table(bench):
    lines = ["| what | median | range |", "|---|---|---|"]
    for row in bench["benchmarks"]:
        lines.append(f"| {row['name']} | {row['median']:.2f} x | {row['low']:.2f} to {row['high']:.2f} |")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
