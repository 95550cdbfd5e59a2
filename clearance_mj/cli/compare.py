"""clearance-mj compare: compare two FRF files."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.checks import naming
from ..core.errors import ClearanceError, RecordError
from ..core.files import to_json, write_text
from ..core.overview import few
from .command import command, provenance, say
from .options import add_columns, add_plugin, hertz, parse_columns

if TYPE_CHECKING:  # a command imports what it needs when it runs
    from ..report.style import Drawing
    from ..signals.alignment import Alignment
    from ..signals.comparison import Comparison
    from ..signals.frf import FRF


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    option("test", type=Path, help="file with the test's FRFs: .uff, .csv, .mat, .nc, .h5")
    option("model", type=Path, help="file with the model's FRFs")
    option("--band", type=hertz, nargs=2, metavar=("LO", "HI"), help="band to compare, Hz (default: all)")
    option("--modes", type=int, default=4, help="how many modes to compare, 0 for none (default: %(default)s)")
    option("--repeat", type=Path, help="file with the test's FRFs once more, from another record of the same level")
    add_columns(parser, "--test-column", "the test's CSV or MATLAB file")
    add_columns(parser, "--model-column", "the model's CSV or MATLAB file")
    add_plugin(parser, "a file format")


@command(
    "compare", "compare the FRFs of two files, whatever wrote them (test first)", _options,
    out_help="folder for comparison.json, comparison.html and the figures (default: none is written)",
    writes=("comparison.json", "comparison.html"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..io.formats import read_frf
    from ..signals.alignment import align

    test = read_frf(options.test, parse_columns(options.test_column, "--test-column"))
    model = read_frf(options.model, parse_columns(options.model_column, "--model-column"))
    with naming(f"{options.test}, {options.model}", ClearanceError):
        aligned = align(test, model)
        if options.band:
            aligned = aligned.within(options.band)
        repeat = _repeat(aligned, options)
        result, comparison, drawings = _compared(aligned, repeat, options)
    _tell(result)
    if options.out:
        from ..report.comparison import write_page

        drawn = drawings()
        result["provenance"] = provenance(options)
        result["figures"] = [str(options.out / drawing.write(options.new).name) for drawing in drawn]
        result["report"] = str(options.out / write_page(comparison, drawn, result["notes"], options.new).name)
        write_text(options.new / "comparison.json", to_json(result))
    _print(result)
    return result


def _repeat(aligned: Alignment, options: argparse.Namespace) -> FRF | None:
    """The repeat of the test on the lines and responses that are compared; one that lacks some is refused."""
    from ..io.formats import read_frf
    from ..signals.alignment import align

    if options.repeat is None:
        return None
    found = read_frf(options.repeat, parse_columns(options.test_column, "--test-column"))
    beside = align(aligned.test, found)
    if beside.only_test or beside.test.frequency.size < aligned.test.frequency.size:
        raise RecordError(f"--repeat {options.repeat}: does not hold every line and response of the test")
    return beside.model


def _tell(result: dict[str, Any]) -> None:
    for note in result["notes"]:
        say(note)
    for who in ("test", "model"):
        if left := result[f"only_{who}"]:
            say(f"only the {who} has {few(left)}: left out", "warning")


def _compared(
    aligned: Alignment, repeat: FRF | None, options: argparse.Namespace
) -> tuple[dict[str, Any], Comparison, Callable[[], list[Drawing]]]:
    """The comparison as plain data, itself, and how to draw it."""
    from ..report.comparison import draw
    from ..signals.alignment import accelerance
    from ..signals.compared_modes import distinct_modes, mac_of_modes
    from ..signals.comparison import compare, compare_modes
    from ..signals.ema import MIN_LINES, NO_MODES

    frequency, rows = aligned.test.frequency, len(aligned.test.labels)
    n_modes = options.modes if frequency.size >= MIN_LINES else 0
    notes = list(aligned.notes)
    if n_modes < options.modes:
        notes.append(f"modes are not looked for: they need {MIN_LINES} common lines, there are {frequency.size}")
    if rows == 1:
        notes.append("CSAC and MAC of one response are 1 by definition: undefined")
    elif len(aligned.test.references) > 1:
        notes.append("CSAC, CSF and MAC are over all pairs of response and reference")
    if frequency.size == 1:
        notes.append("FRAC of one line is 1 by definition: undefined")
    # Modes are looked for in accelerations, whatever the test measured; all else is given in the test's quantity.
    test, model = accelerance(aligned.test), accelerance(aligned.model)
    comparison = compare(aligned.test, aligned.model, compare_modes(test, model, n_modes), repeat)
    test_modes, model_modes = (distinct_modes(frf, n_modes) if n_modes else NO_MODES for frf in (test, model))
    matrix = mac_of_modes(test_modes, model_modes)
    result = comparison.summary() | {
        "test": str(options.test),
        "model": str(options.model),
        "quantity": aligned.test.quantity,
        "reference": ", ".join(aligned.test.references),
        "band": [float(frequency[0]), float(frequency[-1])],
        "lines": int(frequency.size),
        "beside": comparison.beside(),
        "notes": notes,
        "only_test": list(aligned.only_test),
        "only_model": list(aligned.only_model),
        "per_sensor": comparison.per_sensor.to_dict("list"),
        "per_mode": comparison.per_mode.to_dict("list"),
        "mac_matrix": {
            "test_hz": test_modes.frequency.tolist(),
            "model_hz": model_modes.frequency.tolist(),
            "mac": matrix.tolist(),
        },
    }
    return result, comparison, lambda: draw(aligned, comparison, test_modes, model_modes, matrix, repeat)


BESIDE = ("random_db", "random_both_db", "repeat_db")
MEASURES = ("rmse_db", "mre", "frac", "csac", "csf")


def _print(result: dict[str, Any]) -> None:
    low, high = result["band"]
    print(f"{result['quantity']} to {result['reference']}, {result['lines']} lines from {low:g} to {high:g} Hz")
    sensors = result["per_sensor"]
    beside = [name for name in BESIDE if math.isfinite(result[name])]
    means = [result[name] for name in ("rmse_db", "mre", "frac", "csac_per_sensor", "csf_per_sensor", *beside)]
    width = max(map(len, (*sensors["sensor"], "sensor"))) + 2
    shown, widths = (*MEASURES, *beside), [10] * len(MEASURES) + [16] * len(beside)
    lines = [("sensor", *shown)]
    lines += [(label, *(_number(sensors[name][i]) for name in shown)) for i, label in enumerate(sensors["sensor"])]
    for label, *cells in (*lines, ("mean", *map(_number, means))):
        print(f"{label:{width}s}" + "".join(f"{cell:>{wide}s}" for cell, wide in zip(cells, widths)))
    print(f"RMSE {_number(result['rmse_db'])} dB; {result['beside']}")
    print(f"CSAC {_number(result['csac'])}, CSF {_number(result['csf'])} over the responses, mean of the lines")
    modes = result["per_mode"]
    for row in (dict(zip(modes, values)) for values in zip(*modes.values())):
        if words := _mode(row):
            print(f"mode {row['mode']}: {words}")
    for path in result.get("figures", []):
        print(f"figure: {path}")
    if "report" in result:
        print(f"report: {result['report']}")


def _mode(row: dict[str, Any]) -> str:
    """A mode in words; "" of an empty row."""
    test, model, why = row["test_hz"], row["model_hz"], row["why"]
    known = [f"{name}{hz:.5g} Hz" for name, hz in (("", test), ("model ", model)) if math.isfinite(hz)]
    if not known:
        return ""
    if why:
        return f"{', '.join(known)}; not compared: {why}"
    return (
        f"{', '.join(known)} ({100 * (model / test - 1):+.3g} %), MAC {_number(row['mac'])}, "
        f"damping {row['test_damping']:.3g}, model {row['model_damping']:.3g}"
    )


def _number(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "undefined"
