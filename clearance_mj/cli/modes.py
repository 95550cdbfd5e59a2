"""clearance-mj modes: make a structure, given by its modes, of measured FRFs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.checks import naming
from ..core.errors import ClearanceError
from .command import command, spelled, write_results
from .options import add_columns, add_plugin, hertz, parse_columns

if TYPE_CHECKING:  # a command imports what it needs when it runs
    from ..structure import MeasuredModes


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    words = "files with FRFs per unit force, of one or several references: .uff, .csv, .mat, .nc, .h5"
    option("frfs", nargs="+", type=Path, metavar="FRFS", help=words)
    option("--modes", type=int, default=10, help="most modes to find (default: %(default)s)")
    option("--band", type=hertz, nargs=2, metavar=("LO", "HI"), help="band to use, Hz (default: all)")
    words = "response that is measured where a force acts, if it is not named alike, such as 200:+Z=5:+Z"
    option("--driving-point", action="append", default=[], metavar="REFERENCE=DOF", help=words)
    add_columns(parser)
    add_plugin(parser, "a file format")


@command(
    "modes", "make a structure of measured FRFs: modes of unit mass, residual flexibility, synthesis", _options,
    out=Path("modes"), out_help="folder for modes.csv, modes.json and synthesis.png (default: %(default)s)",
    writes=("modes.csv", "modes.json", "synthesis.png"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..io.formats import read_frf
    from ..report.style import Drawing
    from ..structure import modes_from_frf

    columns = parse_columns(options.column)
    names = dict(_driving_points(options.driving_point))
    frfs = [read_frf(path, columns) for path in options.frfs]
    band = tuple(options.band) if options.band else None
    with naming(", ".join(map(str, options.frfs)), ClearanceError):
        found = modes_from_frf(frfs, options.modes, band, driving_points=names)
    found.structure.write_csv(options.new / "modes.csv")
    caption = "Measured FRFs and what the structure gives for them."
    drawing = Drawing("synthesis", found.figure(), caption, caption)
    _print(found, options.out)
    return write_results(options, "modes", found.summary() | {"out": str(options.out)}, None, drawing)


def _driving_points(pairs: list[str]) -> list[tuple[str, str]]:
    for pair in pairs:
        if pair.count("=") != 1:
            raise ClearanceError(f'--driving-point "{pair}": needs REFERENCE=DOF, such as 200:+Z=5:+Z')
    return [(reference.strip(), dof.strip()) for reference, dof in (pair.split("=") for pair in pairs)]


def _print(found: MeasuredModes, out: Path) -> None:
    structure, below = found.structure, found.below
    print("mode  frequency (Hz)  damping (%)  phase collinearity")
    modes = zip(structure.frequencies[below:], structure.ratios[below:], found.collinearity)
    for i, (frequency, damping, mpc) in enumerate(modes, 1):
        print(f"{i:4d}  {frequency:14.3f}  {100 * damping:11.2f}  {mpc:18.3f}")
    for label, share, error in zip(found.measured.labels, found.frac, found.rmse_db):
        print(f"{label}: FRAC {share:.4f}, RMSE {error:.2f} dB")
    if below:
        print(f"{below} more stand for modes below the band")
    if found.left_out:
        print(f"left out, of negative mass at the driving point: {', '.join(f'{f:.3g} Hz' for f in found.left_out)}")
    print(f"next: {spelled('new', 'NAME', '--kind', 'modes', '--file', out / 'modes.csv')}: a rig of this structure")
