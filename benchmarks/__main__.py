"""Measure speed as ratios, side by side in one run: ``python -m benchmarks --out results/bench.json``."""

import argparse
import json
import os
import platform
import statistics
import time
from pathlib import Path

from clearance_mj import __version__
from clearance_mj.io.files import replacing

from .speed import BENCHMARKS


def main():
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("results/bench.json"), help="JSON file (default: %(default)s)")
    parser.add_argument("--repeat", type=int, default=5, help="pairs of runs, of which the median counts")
    options = parser.parse_args()
    rows = []
    print(f"{'benchmark':64s} {'A':>9s} {'B':>9s} {'median':>8s} {'range':>15s}  target")
    for name, a, b, combine, unit, target in BENCHMARKS():
        pairs = [(_time(a), _time(b)) for _ in range(options.repeat + 1)][1:]  # the first compiles and warms up
        values = [combine(*pair) for pair in pairs]
        middle = [statistics.median(t) for t in zip(*pairs)]
        row = {"name": name, "a_seconds": middle[0], "b_seconds": middle[1], "unit": unit, "target": target}
        rows.append(row | {"median": statistics.median(values), "low": min(values), "high": max(values)})
        spread = f"{min(values):.3g}..{max(values):.3g}"
        print(
            f"{name:64s} {middle[0]:8.3f}s {middle[1]:8.3f}s {rows[-1]['median']:8.3g} {spread:>15s}  {unit} {target}"
        )
    machine = {"processors": os.cpu_count(), "machine": platform.machine(), "python": platform.python_version()}
    with replacing(options.out) as temporary:
        temporary.write_text(json.dumps({"version": __version__, **machine, "benchmarks": rows}, indent=1) + "\n")
    print(f"written to {options.out}")


def _time(call) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


if __name__ == "__main__":
    main()
