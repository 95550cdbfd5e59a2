"""Measure speed, cost and error: ``python -m benchmarks --out results/bench.json`` runs all, or the named parts."""

import argparse
import importlib
import json
import os
import platform
from pathlib import Path

from clearance_mj import __version__
from clearance_mj.core.files import replacing

PARTS = (
    "speed", "alternatives", "scaling", "options", "memory", "ridge", "periodic", "softener", "drives", "bushings",
    "rotors", "space", "productions",
)  # fmt: skip


def main():
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("parts", nargs="*", help=f"of {', '.join(PARTS)} (default: all)")
    parser.add_argument("--out", type=Path, default=Path("results/bench.json"), help="JSON file (default: %(default)s)")
    given = parser.parse_args()
    if unknown := set(given.parts) - set(PARTS):
        parser.error(f"unknown: {', '.join(sorted(unknown))}; known: {', '.join(PARTS)}")
    machine = {"processors": os.cpu_count(), "machine": platform.machine(), "python": platform.python_version()}
    for name in given.parts or PARTS:
        measured = importlib.import_module(f"benchmarks.{name}").measure()
        kept = json.loads(given.out.read_text()) if given.out.exists() else {}
        with replacing(given.out) as temporary:
            text = json.dumps(kept | {"version": __version__, **machine, name: measured}, indent=1)
            temporary.write_text(text + "\n")
        print(f"{name}: written to {given.out}")


if __name__ == "__main__":
    main()
