"""Time of the live page from a slider's release until every figure is drawn: python -m benchmarks.live.

Headless Chromium without a network; the Table-1 rig, 8 sensors, records of 10 s at 2048 samples/s, all figures and a
record over them. Two measures, in the page's own clock: one step of a slider; and a slider that is dragged over a third
of its way in 20 moves, 30 ms apart, from its release on.
"""

from __future__ import annotations

import argparse
import json
import statistics
import tempfile
from pathlib import Path

from tests.live.browser import chromium, opened, served, settled, slide

ROOT = Path(__file__).parent.parent
DATASET = ROOT / "data" / "table1_rig"
SLIDERS = ("bushings[0].gap", "bushings[1].gap", "bushings[1].contact.k", "level", "bushings[0].grease.stiffness")


def measured(repeats: int) -> dict[str, list[float]]:
    """Milliseconds of every repeat."""
    times: dict[str, list[float]] = {"step": [], "drag": []}
    with tempfile.TemporaryDirectory() as folder, served(Path(folder), DATASET) as address, chromium() as browser:
        page, errors = opened(browser, address, viewport={"width": 1280, "height": 900})
        page.select_option("#record", "level_2_a")
        settled(page)
        for i in range(repeats):
            name = SLIDERS[i % len(SLIDERS)]
            slide(page, name, 380 + 37 * i % 240)
            settled(page)
            times["step"].append(page.evaluate("live.milliseconds"))
            for place in range(350, 650, 15):
                slide(page, name, place)
                page.wait_for_timeout(30)
            slide(page, name, 655 + i)
            settled(page)
            times["drag"].append(page.evaluate("live.milliseconds"))
        assert not errors, errors
    return times


def main() -> None:
    """Print median, 90 % quantile and the largest."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=30)
    parser.add_argument("--json", action="store_true", help="print every number")
    options = parser.parse_args()
    times = measured(options.repeats)
    if options.json:
        print(json.dumps(times))
        return
    for name, values in times.items():
        late = statistics.quantiles(values, n=10)[-1]
        print(f"{name}: median {statistics.median(values):.0f} ms, 90 % {late:.0f} ms, largest {max(values):.0f} ms")


if __name__ == "__main__":
    main()
