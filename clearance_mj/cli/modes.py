"""clearance-mj modes: make a structure, given by its modes, of measured FRFs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ..core.checks import naming
from ..core.errors import ClearanceError
from ..io.formats import read_frf
from ..report.style import Drawing
from ..structure import MeasuredModes, modes_from_frf
from .command import Options, Result, command, option, spelled
from .options import band, columns, plugin


@command(
    "modes",
    option("frfs", "files with FRFs per unit force, of one or several references: .uff, .csv, .mat, .nc, .h5", Path,
           nargs="+", metavar="FRFS"),
    option("--modes", "most modes to find", int, 10),
    band("band to use, Hz (default: all)"),
    option("--driving-point", "response that is measured where a force acts, if it is not named alike, such as "
           "200:+Z=5:+Z", action="append", metavar="REFERENCE=DOF"),
    columns(), plugin("a file format"),
    out="modes", writes=("modes.csv", "*.json", "synthesis.png"),
)  # fmt: skip
def run(options: Options) -> Result:
    """Make a structure of measured FRFs: modes of unit mass, residual flexibility, synthesis."""
    names = dict(_driving_points(options.driving_point))
    frfs = [read_frf(path, options.column) for path in options.frfs]
    with naming(", ".join(map(str, options.frfs)), ClearanceError):
        measured = modes_from_frf(frfs, options.modes, options.band, driving_points=names)
    measured.structure.write_csv(options.new / "modes.csv")
    caption = "Measured FRFs and what the structure gives for them."
    drawing = Drawing("synthesis", measured.figure(), caption, caption)
    return Result(measured.summary() | {"out": str(options.out)}, _report(measured, options.out), drawings=[drawing])


def _driving_points(pairs: list[str]) -> list[tuple[str, str]]:
    for pair in pairs:
        if pair.count("=") != 1:
            raise ClearanceError(f'--driving-point "{pair}": needs REFERENCE=DOF, such as 200:+Z=5:+Z')
    return [(reference.strip(), dof.strip()) for reference, dof in (pair.split("=") for pair in pairs)]


def _report(measured: MeasuredModes, out: Path) -> Iterator[str]:
    structure, below = measured.structure, measured.below
    yield "mode  frequency (Hz)  damping (%)  phase collinearity"
    modes = zip(structure.frequencies[below:], structure.ratios[below:], measured.collinearity)
    for i, (frequency, damping, mpc) in enumerate(modes, 1):
        yield f"{i:4d}  {frequency:14.3f}  {100 * damping:11.2f}  {mpc:18.3f}"
    for label, frac, error in zip(measured.measured.labels, measured.frac, measured.rmse_db):
        yield f"{label}: FRAC {frac:.4f}, RMSE {error:.2f} dB"
    if below:
        yield f"{below} more stand for modes below the band"
    if measured.left_out:
        yield f"left out, of negative mass at the driving point: {', '.join(f'{f:.3g} Hz' for f in measured.left_out)}"
    yield f"next: {spelled('new', 'NAME', '--kind', 'modes', '--file', out / 'modes.csv')}: a rig of this structure"
