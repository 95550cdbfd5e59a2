"""clearance-mj compare: compare two FRF files."""

from __future__ import annotations

import sys
from pathlib import Path

from ..errors import ClearanceError
from ..io.files import replacing, to_json
from .columns import add_columns, parse_columns
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
        commands, "compare", _run, "compare the FRFs of two files, whatever wrote them (test first)",
        default=None, help="folder for comparison.json and the figures (default: none is written)",
    )  # fmt: skip
    parser.add_argument("test", type=Path, help="file with the test's FRFs: .uff, .csv, .mat, .nc or .h5")
    parser.add_argument("model", type=Path, help="file with the model's FRFs")
    parser.add_argument("--band", type=float, nargs=2, metavar=("LO", "HI"), help="band to compare, Hz (default: all)")
    parser.add_argument("--modes", type=int, default=4, help="how many modes to compare (default: %(default)s)")
    add_columns(parser, "--test-column", "the test's CSV or MATLAB file")
    add_columns(parser, "--model-column", "the model's CSV or MATLAB file")


def _run(options):
    from ..io.formats import read_frf
    from ..matching import match

    if options.out and options.out.is_file():
        raise ClearanceError(f"--out {options.out} is a file; give a folder")
    test = read_frf(options.test, dict(parse_columns(options.test_column, "--test-column")))
    model = read_frf(options.model, dict(parse_columns(options.model_column, "--model-column")))
    try:
        matched = match(test, model)
        if options.band:
            matched = matched.within(options.band)
        result, drawings = _compared(matched, options)
    except ClearanceError as error:
        raise type(error)(f"{options.test}, {options.model}: {error}") from None
    _tell(matched)
    if options.out:
        result["figures"] = _write(options.out, drawings())
        with replacing(options.out / "comparison.json") as temporary:
            temporary.write_text(to_json(result), encoding="utf-8")
    if not options.json:
        _print(result)
    return result


def _tell(matched):
    for note in matched.notes:
        print(f"clearance-mj: note: {note}", file=sys.stderr)
    for who, left in (("test", matched.only_test), ("model", matched.only_model)):
        if left:
            print(f"clearance-mj: warning: only the {who} has {', '.join(left)}: left out", file=sys.stderr)


def _compared(matched, options):
    """The comparison as plain data, and how to draw it."""
    from ..correlation import compare, mac, with_modes
    from ..matching import accelerance
    from ..modes import extract_modes
    from ..report.comparison import draw

    # Modes are looked for in accelerations, whatever the test measured; all else is told in the test's quantity.
    of_modes = [accelerance(frf) for frf in (matched.test, matched.model)]
    per_mode = compare(*of_modes, options.modes).per_mode
    comparison = with_modes(matched.test, matched.model, per_mode)
    modes = [extract_modes(frf, options.modes) for frf in of_modes]
    matrix = mac(modes[0].shape, modes[1].shape)
    frequency = matched.test.frequency
    result = comparison.summary() | {
        "test": str(options.test),
        "model": str(options.model),
        "quantity": matched.test.quantity,
        "reference": matched.test.reference,
        "band": [float(frequency[0]), float(frequency[-1])],
        "lines": int(frequency.size),
        "notes": list(matched.notes),
        "only_test": list(matched.only_test),
        "only_model": list(matched.only_model),
        "per_sensor": _plain(comparison.per_sensor),
        "per_mode": _plain(comparison.per_mode),
        "mac_matrix": {
            "test_hz": modes[0].frequency.tolist(),
            "model_hz": modes[1].frequency.tolist(),
            "mac": matrix.tolist(),
        },
    }
    return result, lambda: draw(matched, comparison, *modes, matrix)


def _plain(columns) -> dict:
    return {name: [getattr(v, "item", lambda v=v: v)() for v in column] for name, column in columns.items()}


def _write(folder, drawings) -> list[str]:
    for drawing in drawings:
        with replacing(folder / f"{drawing.name}.png") as temporary:
            temporary.write_bytes(drawing.png())
    return [str(folder / f"{drawing.name}.png") for drawing in drawings]


MEASURES = ("rmse_db", "mre", "frac", "csac", "csf")


def _print(result):
    low, high = result["band"]
    print(f"{result['quantity']} to {result['reference']}, {result['lines']} lines from {low:g} to {high:g} Hz")
    print(f"{'sensor':10s}" + "".join(f"{name:>10s}" for name in MEASURES))
    sensors = result["per_sensor"]
    for i, label in enumerate(sensors["sensor"]):
        print(f"{label:10s}" + "".join(f"{sensors[name][i]:10.4g}" for name in MEASURES))
    print(f"{'mean':10s}" + "".join(f"{result[name]:10.4g}" for name in ("rmse_db", "mre", "frac")), end="")
    print("".join(f"{result[f'{name}_per_sensor']:10.4g}" for name in ("csac", "csf")))
    print(f"CSAC {result['csac']:.4g}, CSF {result['csf']:.4g} over the responses, mean of the lines")
    modes = result["per_mode"]
    for i, number in enumerate(modes["mode"]):
        test, model = modes["test_hz"][i], modes["model_hz"][i]
        print(
            f"mode {number}: {test:.5g} Hz, model {model:.5g} Hz ({100 * (model / test - 1):+.3g} %), "
            f"MAC {modes['mac'][i]:.4g}, damping {modes['test_damping'][i]:.3g}, model {modes['model_damping'][i]:.3g}"
        )
    for path in result.get("figures", []):
        print(f"figure: {path}")
