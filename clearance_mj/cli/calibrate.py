"""clearance-mj calibrate: dimensions, stiffnesses and masses of a rig from measured frequencies, shapes or FRFs."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

from ..calibrate import Calibration, FRFTarget, ModalTarget, calibrate, modal_target, read_frequencies, read_frf
from ..report.calibration import draw
from ..rig import Rig
from .command import Options, Result, command, option
from .options import SEED, band


def _parse_free(text: str) -> tuple[str, tuple[float, float] | None]:
    path, given, bounds = text.partition("=")
    if not given:
        return path, None
    try:
        low, high = map(float, bounds.split(":"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not PATH or PATH=LOW:HIGH") from None
    return path, (low, high)


@command(
    "calibrate",
    option("rig", "rig file (TOML): where to start, and all that is not free", Path),
    option("targets", "CSV of natural frequencies (frequency_hz or test_hz; mode, std_hz, shape_NODE if known), or UFF "
           "of FRFs", Path, nargs="+"),
    option("--free", "free parameter as in the rig file, such as bushings[0].position, with bounds in SI units; "
           "bushings.grease.stiffness is one value for all bushings", _parse_free, action="append", required=True,
           metavar="PATH[=LOW:HIGH]"),
    option("--starts", "starts of the search", int, 8),
    SEED,
    option("--std", "relative standard deviation of a frequency where the file does not say", float, 1e-3),
    option("--fit", "what to fit of FRFs: natural frequencies and shapes, or the magnitude, which depends on damping "
           "too", default="modes", choices=("modes", "frf")),
    option("--modes", "modes to extract from FRFs", int, 4),
    band("lines of the FRFs to use, Hz"),
    out="results/calibration", writes=("rig.toml", "*.json", "*.png"),
)  # fmt: skip
def run(options: Options) -> Result:
    """Find a rig's parameters from measured natural frequencies, shapes or FRFs."""
    rig, targets = Rig.load(options.rig), [_target(path, options) for path in options.targets]
    calibration = calibrate(rig, targets, dict(options.free), options.starts, options.seed, not options.quiet)
    calibration.rig.copied(options.new / "structure").save(options.new / "rig.toml")
    return Result(calibration.to_dict(), _report(calibration), drawings=[draw(calibration)])


def _target(path: Path, options: Options) -> ModalTarget | FRFTarget:
    if path.suffix.lower() == ".csv":
        return read_frequencies(path, options.std)
    target = read_frf(path, options.band)
    return target if options.fit == "frf" else modal_target(target, options.modes, options.std)


def _report(calibration: Calibration) -> Iterator[str]:
    fit = calibration.estimates
    for path, value, std in zip(fit.names, fit.value, fit.std):
        yield f"{path:32s} {value:.6g} ± {std:.2g}"
    for row in calibration.to_dict()["modes"]:
        yield "mode {mode:.0f}  {test_hz:.3f} Hz, started {start_hz:.3f}, calibrated {calibrated_hz:.3f}".format(**row)
    yield from (f"warning: {words}" for words in calibration.warnings)
