"""Run the fuzzing: ``python -m tests.fuzz``; status 1 if a reader crashed, hung, or let anything but an error out."""

import argparse
import json
import re
import sys
from pathlib import Path

from clearance_mj.cli.options import load_plugin, plugin
from clearance_mj.core.files import replacing

from .readers import readers
from .run import FINDINGS, fuzz

COLUMNS = "inputs", "read", "refused", "findings"
TABLE = re.compile(r"(<!-- fuzz -->\n).*?(<!-- /fuzz -->)", re.DOTALL)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("results/fuzz"), help="folder for fuzz.json and findings")
    parser.add_argument("--reader", action="append", help="default: all")
    plugin("a file format").add(parser)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--share", type=float, default=1.0, help="of the full number of inputs")
    parser.add_argument("--first", type=int, default=0, help="index of the first input of each reader")
    parser.add_argument("--count", type=int, help="inputs of each reader, in place of --share")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--page", type=Path, help="page whose table of inputs is written anew")
    options = parser.parse_args()
    load_plugin(options.plugin)
    known = readers()
    if missing := set(options.reader or ()) - known.keys():
        parser.error(f"--reader {missing.pop()} is unknown; use {', '.join(known)}")
    chosen = [known[name] for name in options.reader or known]
    extent = options.share, options.workers, options.first, options.count
    outcomes = fuzz(chosen, options.seed, options.out / "found", *extent)
    path = options.out / "fuzz.json"
    before = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    rows = before["readers"] if before.get("seed") == options.seed else {}  # of other readers
    rows |= {name: outcome.summary() for name, outcome in outcomes.items()}
    with replacing(path) as temporary:
        temporary.write_text(json.dumps({"seed": options.seed, "readers": rows}, indent=1) + "\n", encoding="utf-8")
    if options.page:
        text = options.page.read_text(encoding="utf-8")
        options.page.write_text(TABLE.sub(lambda marks: marks[1] + table(rows) + marks[2], text), encoding="utf-8")
    findings = [(name, *finding) for name, outcome in outcomes.items() for finding in outcome.findings]
    for name, index, what, detail, file in findings:
        print(f"{name} {index}: {what}: {detail} [{file}]")
    print(f"{sum(o.inputs for o in outcomes.values())} inputs, {len(findings)} findings: {path}")
    return int(bool(findings))


def table(readers) -> str:
    """Rows of Markdown, one for each reader, then the sums; what all of them together took."""
    rows = {name: [*(counts[key] for key in COLUMNS[:3]), sum(counts[key] for key in FINDINGS)]
            for name, counts in readers.items()}  # fmt: skip
    sums = [sum(column) for column in zip(*rows.values())]
    lines = [f"| reader | {' | '.join(COLUMNS)} |", f"|---|{'---:|' * len(COLUMNS)}"]
    lines += [f"| {name} | {' | '.join(f'{v:,}' for v in row)} |" for name, row in (*rows.items(), ("sum", sums))]
    distinct = sum(counts["distinct"] for counts in readers.values())
    growth = max(counts["memory_growth_mb"] for counts in readers.values())
    total = f"{distinct:,} inputs are distinct; the memory of a process grew by at most {growth:,} MB."
    return "\n" + "\n".join([*lines, "", total]) + "\n\n"


if __name__ == "__main__":
    sys.exit(main())
