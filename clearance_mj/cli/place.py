"""clearance-mj place: where sensors tell a rig's modes best."""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

from ..errors import ClearanceError
from ..files import replacing, to_json
from .command import add_command

__all__ = ["add"]


def add(commands):
    """Add the command.

    Parameters
    ----------
    commands : argparse subparsers
        Where to add it.
    """
    parser = add_command(
        commands, "place", _run, "place sensors where they tell the modes best, by Fisher information",
        default=Path("results/placement"),
        help="folder for placement.csv, .json and .png (default: %(default)s)",
    )  # fmt: skip
    parser.add_argument("rig", type=Path, help="rig file (TOML)")
    parser.add_argument("--sensors", type=int, default=8, help="how many (default: %(default)s)")
    parser.add_argument(
        "--candidates", type=int, default=24,
        help="evenly spaced positions outside the bushings; their distance is the least between sensors "
        "(default: %(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--at", type=float, action="append", default=[], metavar="X",
        help="position that gets a sensor in any case, m; may be repeated",
    )  # fmt: skip
    parser.add_argument("--modes", type=_numbers(int), default=[1, 2, 3, 4], help="wanted modes (default: 1,2,3,4)")
    parser.add_argument(
        "--unwanted", type=_numbers(int), default=[], metavar="MODES", help="modes that disturb the readings, as 5,6"
    )
    parser.add_argument(
        "--weights", type=_numbers(float), default=1.0, help="size of each mode's motion, as 3,1,1,0.5 (default: 1)"
    )
    parser.add_argument(
        "--noise", default="1",
        help="standard deviation of a reading: a number, or a CSV file with columns position_m and std, which is "
        "interpolated (default: %(default)s)",
    )  # fmt: skip
    parser.add_argument("--criterion", default="determinant", help="determinant or trace (default: %(default)s)")
    parser.add_argument(
        "--method", default="exchange", help="exchange, backward, forward or exhaustive (default: %(default)s)"
    )


def _numbers(kind):
    def parse(text):
        try:
            return [kind(part) for part in text.split(",")]
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a list such as 1,2,3") from None

    return parse


def _run(options):
    import numpy as np

    from ..placement import candidates, grid, place_sensors
    from ..report.placement import draw
    from ..report.tables import write_csv
    from ..rig import Rig

    if options.out.is_file():
        raise ClearanceError(f"--out {options.out} is a file; give a folder")
    rig = Rig.load(options.rig)
    position = np.union1d(grid(rig, options.candidates), options.at)
    noise = _noise(options.noise, position)
    places = candidates(rig, position, options.modes, options.weights, noise, options.unwanted)
    required = np.searchsorted(position, options.at).tolist()
    found = place_sensors(places, options.sensors, options.criterion, options.method, required)
    result = found.to_dict() | {"modes": options.modes, "criterion": options.criterion, "method": options.method}
    with replacing(options.out / "placement.json") as temporary:
        temporary.write_text(to_json(result), encoding="utf-8")
    write_csv(options.out / "placement.csv", found.rows())
    with replacing(options.out / "placement.png") as temporary:
        temporary.write_bytes(draw(rig, places, found, options.modes).png())
    if not options.json:
        _print(found, options.out)
    return result | {"out": str(options.out)}


def _noise(text, position):
    import numpy as np

    try:
        return float(text)
    except ValueError:
        pass
    try:
        with Path(text).open(newline="", encoding="utf-8-sig") as file:
            rows = [(float(row["position_m"]), float(row["std"])) for row in csv.DictReader(file)]
        known, std = np.array(sorted(rows)).T
    except OSError as error:
        raise ClearanceError(f"--noise {text}: neither a number nor a file ({error.strerror})") from None
    except (ValueError, KeyError, TypeError):
        raise ClearanceError(f"--noise {text}: must be CSV with columns position_m and std, all numbers") from None
    return np.interp(position, known, std)


def _print(found, out):
    import numpy as np

    for x, share, growth in zip(found.position, found.contribution, found.std_growth.max(axis=1)):
        cost = f"standard deviations grow up to {growth:.2f} times" if growth < np.inf else "a mode is no longer told"
        print(f"{x:.4f} m  carries {share:.3f}; without it the determinant is {1 - share:.3f} of this, {cost}")
    print(f"determinant {found.determinant:.4g}, trace {found.trace:.4g}, condition {found.condition:.3g}, "
          f"largest MAC between modes {found.worst_mac:.3f}")  # fmt: skip
    print(f"layout: {out / 'placement.csv'}")
