"""Run the fuzzing: ``python -m tests.fuzz``; status 1 if a reader crashed, hung, or let anything but an error out."""

import argparse
import json
import sys
import time
from pathlib import Path

from clearance_mj.files import replacing

from .page import fill
from .readers import readers
from .run import fuzz


def main() -> int:
    known = readers()
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument(
        "--out", type=Path, default=Path("results/fuzz"), help="folder for fuzz.json and what was found"
    )
    parser.add_argument("--reader", action="append", choices=[*known], help="default: all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--share", type=float, default=1.0, help="of the full number of inputs")
    parser.add_argument("--first", type=int, default=0, help="index of the first input of each reader")
    parser.add_argument("--count", type=int, help="inputs of each reader, in place of --share")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--page", type=Path, help="page whose table of inputs is written anew")
    options = parser.parse_args()
    began = time.monotonic()
    chosen = [known[name] for name in options.reader or known]
    outcomes = fuzz(
        chosen, options.seed, options.out / "found", options.share, options.workers, options.first, options.count
    )
    found = {name: outcome.summary() for name, outcome in outcomes.items()}
    summary = _with_other_readers(options.out / "fuzz.json", options.seed, found)
    summary["seconds"] = round(time.monotonic() - began, 1)
    with replacing(options.out / "fuzz.json") as temporary:
        temporary.write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")
    if options.page:
        fill(options.page, summary)
    for name, outcome in outcomes.items():
        for index, what, detail, file in outcome.findings:
            print(f"{name} {index}: {what}: {detail} [{file}]")
    findings = sum(len(outcome.findings) for outcome in outcomes.values())
    print(f"{sum(o.inputs for o in outcomes.values())} inputs, {findings} findings: {options.out / 'fuzz.json'}")
    return int(findings > 0)


def _with_other_readers(path, seed, found) -> dict:
    """What was found, beside what earlier runs of the same seed found with other readers."""
    before = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    kept = before["readers"] if before.get("seed") == seed else {}
    rows = kept | found
    counts = {key: sum(row[key] for row in rows.values()) for key in ("inputs", "distinct")}
    return {"seed": seed, **counts, "findings": sum(len(row["findings"]) for row in rows.values()), "readers": rows}


if __name__ == "__main__":
    sys.exit(main())
