"""clearance-mj place: where sensors tell a rig's modes best."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..core.errors import ClearanceError
from ..core.files import plain_file
from ..placement import Placement, candidates, grid, place_sensors
from ..report.placement import draw
from ..rig import Rig
from .command import RESULTS, Options, Result, command, option
from .options import number_list_parser, point

WHOLE, ANY_NUMBER = (number_list_parser(kind, "such as 1,2,3") for kind in (int, float))


def _parse_points(text: str) -> int | list[float | str]:
    return int(text) if text.lstrip("-").isdigit() else [point(part) for part in text.split(",")]


@command(
    "place",
    option("rig", "rig file (TOML)", Path),
    option("--sensors", "how many", int, 8),
    option("--candidates", "how many positions, evenly spaced outside the bushings (their distance is the least "
           "between sensors), or the points themselves, as 1:+Z,2:+Z", _parse_points, 24),
    option("--at", "position that gets a sensor in any case, m, or a point such as 1:+Z", point, action="append",
           metavar="X"),
    option("--modes", "wanted modes (default: 1,2,3,4)", WHOLE, [1, 2, 3, 4]),
    option("--unwanted", "modes that disturb the readings, as 5,6 (default: none)", WHOLE, [], metavar="MODES"),
    option("--weights", "size of each mode's motion, as 3,1,1,0.5 (default: 1)", ANY_NUMBER, 1.0),
    option("--noise", "standard deviation of a reading: a number, or a CSV file with columns position_m and std, which "
           "is interpolated", default="1"),
    option("--criterion", "determinant or trace", default="determinant"),
    option("--method", "exchange, backward, forward or exhaustive", default="exchange"),
    out="results/placement", writes=RESULTS,
)  # fmt: skip
def run(options: Options) -> Result:
    """Place sensors where they identify the modes best, by Fisher information."""
    rig = Rig.load(options.rig)
    spread = options.candidates if isinstance(options.candidates, list) else grid(rig, options.candidates).tolist()
    position = sorted({*spread, *options.at}, key=lambda x: (isinstance(x, str), x))
    noise = _read_noise(options.noise, position)
    places = candidates(rig, position, options.modes, options.weights, noise, options.unwanted)
    required = [position.index(x) for x in options.at]
    placement = place_sensors(places, options.sensors, options.criterion, options.method, required)
    data = placement.to_dict() | {"modes": options.modes, "criterion": options.criterion, "method": options.method}
    return Result(data, _report(placement), placement.table, [draw(rig, places, placement, options.modes)])


def _read_noise(text: str, position: list[float | str]) -> float | np.ndarray:
    try:
        return float(text)
    except ValueError:
        pass
    try:
        with plain_file(text).open(newline="", encoding="utf-8-sig") as file:
            rows = [(float(row["position_m"]), float(row["std"])) for row in csv.DictReader(file)]
        known, std = np.array(sorted(rows)).T
    except OSError as error:
        raise ClearanceError(f"--noise {text}: neither a number nor a file ({error.strerror})") from None
    except (ValueError, KeyError, TypeError):
        raise ClearanceError(f"--noise {text}: must be CSV with columns position_m and std, all numbers") from None
    if any(isinstance(x, str) for x in position):
        raise ClearanceError(f"--noise {text}: a table over positions needs candidates on one shaft; give a number")
    return np.interp(np.array(position, dtype=float), known, std)


def _report(placement: Placement) -> Iterator[str]:
    for label, info, growth in zip(placement.labels, placement.contribution, placement.std_growth.max(axis=1)):
        grown = f"standard deviations grow up to {growth:.2f} times"
        cost = grown if growth < np.inf else "a mode is no longer identifiable"
        yield f"{label:9} carries {info:.3f}; without it the determinant is {1 - info:.3f} of this, {cost}"
    yield (
        f"determinant {placement.determinant:.4g}, trace {placement.trace:.4g}, condition {placement.condition:.3g}, "
        f"largest MAC between modes {placement.worst_mac:.3f}"
    )
