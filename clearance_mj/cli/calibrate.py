"""clearance-mj calibrate: dimensions, stiffnesses and masses of a rig from measured frequencies, shapes or FRFs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .command import command, write_results
from .options import hertz

if TYPE_CHECKING:
    from ..calibrate import Calibration, FRFTarget, ModalTarget


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    option("rig", type=Path, help="rig file (TOML): where to start, and all that is not free")
    words = "CSV of natural frequencies (frequency_hz or test_hz; mode, std_hz, shape_NODE if known), or UFF of FRFs"
    option("targets", type=Path, nargs="+", help=words)
    option(
        "--free", type=_free, action="append", required=True, metavar="PATH[=LOW:HIGH]",
        help="free parameter as in the rig file, such as bushings[0].position, with bounds in SI units; "
        "bushings.grease.stiffness is one value for all bushings; may be repeated",
    )  # fmt: skip
    option("--starts", type=int, default=8, help="starts of the search (default: %(default)s)")
    option("--seed", type=int, default=0, help="of the starts (default: %(default)s)")
    words = "relative standard deviation of a frequency where the file does not say (default: %(default)s)"
    option("--std", type=float, default=1e-3, help=words)
    words = "what to fit of FRFs: natural frequencies and shapes, or the magnitude, which depends on damping too"
    option("--fit", choices=("modes", "frf"), default="modes", help=words)
    option("--modes", type=int, default=4, help="modes to extract from FRFs (default: %(default)s)")
    option("--band", type=hertz, nargs=2, metavar=("LOW", "HIGH"), help="lines of the FRFs to use, Hz")


def _free(text: str) -> tuple[str, tuple[float, float] | None]:
    path, given, bounds = text.partition("=")
    if not given:
        return path, None
    try:
        low, high = map(float, bounds.split(":"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not PATH or PATH=LOW:HIGH") from None
    return path, (low, high)


@command(
    "calibrate", "find a rig's parameters from measured natural frequencies, shapes or FRFs", _options,
    out=Path("results/calibration"),
    out_help="folder for rig.toml, calibration.json and calibration.png (default: %(default)s)",
    writes=("rig.toml", "calibration.json", "calibration.png"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..calibrate import calibrate
    from ..report.calibration import draw
    from ..rig import Rig

    rig, targets = Rig.load(options.rig), [_target(path, options) for path in options.targets]
    found = calibrate(rig, targets, dict(options.free), options.starts, options.seed, not options.quiet)
    found.rig.copied(options.new / "structure").save(options.new / "rig.toml")
    _print(found, options.out)
    return write_results(options, "calibration", found.to_dict(), None, draw(found))


def _target(path: Path, options: argparse.Namespace) -> ModalTarget | FRFTarget:
    from ..calibrate import modal_target, read_frequencies, read_frf

    if path.suffix.lower() == ".csv":
        return read_frequencies(path, options.std)
    target = read_frf(path, tuple(options.band) if options.band else None)
    return target if options.fit == "frf" else modal_target(target, options.modes, options.std)


def _print(found: Calibration, out: Path) -> None:
    fit = found.estimates
    for path, value, std in zip(fit.names, fit.value, fit.std):
        print(f"{path:32s} {value:.6g} ± {std:.2g}")
    for row in found.to_dict()["modes"]:
        print("mode {mode:.0f}  {test_hz:.3f} Hz, started {start_hz:.3f}, calibrated {calibrated_hz:.3f}".format(**row))
    for words in found.warnings:
        print(f"warning: {words}")
    print(f"rig: {out / 'rig.toml'}")
