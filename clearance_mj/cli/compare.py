"""clearance-mj compare: compare two FRF files."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from ..core.checks import naming
from ..core.errors import ClearanceError, RecordError
from ..core.overview import few
from ..io.formats import read_frf
from ..report.comparison import draw, write_page
from ..signals.alignment import Alignment, accelerance, align
from ..signals.compared_modes import distinct_modes, mac_of_modes
from ..signals.comparison import Comparison, compare, compare_modes
from ..signals.ema import MIN_LINES, NO_MODES
from ..signals.frf import FRF
from .command import Options, Result, command, inform, option
from .options import band, columns, plugin

BESIDE = ("random_db", "random_both_db", "repeat_db")
MEASURES = ("rmse_db", "mre", "frac", "csac", "csf")


@command(
    "compare",
    option("test", "file with the test's FRFs: .uff, .csv, .mat, .nc, .h5", Path),
    option("model", "file with the model's FRFs", Path),
    band("band to compare, Hz (default: all)"),
    option("--modes", "how many modes to compare, 0 for none", int, 4),
    option("--repeat", "file with the test's FRFs once more, from another record of the same level", Path),
    columns("--test-column", "the test's CSV or MATLAB file"),
    columns("--model-column", "the model's CSV or MATLAB file"), plugin("a file format"),
    out_help="folder for comparison.json, comparison.html and the figures (default: none is written)", out="",
    base="comparison", writes=("*.json", "*.html"),
)  # fmt: skip
def run(options: Options) -> Result:
    """Compare the FRFs of two files, whatever wrote them (test first)."""
    test, model = read_frf(options.test, options.test_column), read_frf(options.model, options.model_column)
    with naming(f"{options.test}, {options.model}", ClearanceError):
        aligned = align(test, model)
        if options.band:
            aligned = aligned.within(options.band)
        repeat, frequency = _read_repeat(aligned, options), aligned.test.frequency
        n_modes = options.modes if frequency.size >= MIN_LINES else 0
        # Modes are looked for in accelerations, whatever the test measured; all else is given in the test's quantity.
        test, model = accelerance(aligned.test), accelerance(aligned.model)
        comparison = compare(aligned.test, aligned.model, compare_modes(test, model, n_modes), repeat)
        of_test, of_model = (distinct_modes(frf, n_modes) if n_modes else NO_MODES for frf in (test, model))
        matrix, notes = mac_of_modes(of_test, of_model), _notes(aligned, options.modes)
    data: dict[str, Any] = comparison.summary() | {
        "test": str(options.test), "model": str(options.model), "quantity": aligned.test.quantity,
        "reference": ", ".join(aligned.test.references), "band": frequency[[0, -1]].tolist(),
        "lines": frequency.size, "beside": comparison.beside(), "notes": notes,
        "only_test": list(aligned.only_test), "only_model": list(aligned.only_model),
        "per_sensor": comparison.per_sensor.to_dict("list"), "per_mode": comparison.per_mode.to_dict("list"),
        "mac_matrix": {"test_hz": of_test.frequency.tolist(), "model_hz": of_model.frequency.tolist(),
                       "mac": matrix.tolist()},
    }  # fmt: skip
    for note in notes:
        inform(note)
    for side in ("test", "model"):
        if missing_labels := data[f"only_{side}"]:
            inform(f"only the {side} has {few(missing_labels)}: left out", "warning")
    if not options.out:
        return Result(data, _report(data, comparison))
    drawings = draw(aligned, comparison, of_test, of_model, matrix, repeat)
    data["report"] = str(options.out / write_page(comparison, drawings, notes, options.new).name)
    return Result(data, _report(data, comparison), drawings=drawings)


def _read_repeat(aligned: Alignment, options: Options) -> FRF | None:
    """Return the repeat on the lines and responses compared; raise an error if it lacks some."""
    if options.repeat is None:
        return None
    repeat = align(aligned.test, read_frf(options.repeat, options.test_column))
    if repeat.only_test or repeat.test.frequency.size < aligned.test.frequency.size:
        raise RecordError(f"--repeat {options.repeat}: does not hold every line and response of the test")
    return repeat.model


def _notes(aligned: Alignment, n_modes: int) -> list[str]:
    """Return notes on data not compared, or not over responses alone."""
    notes, size = list(aligned.notes), aligned.test.frequency.size
    if n_modes and size < MIN_LINES:
        notes.append(f"modes are not looked for: they need {MIN_LINES} common lines, there are {size}")
    if len(aligned.test.labels) == 1:
        notes.append("CSAC and MAC of one response are 1 by definition: undefined")
    elif len(aligned.test.references) > 1:
        notes.append("CSAC, CSF and MAC are over all pairs of response and reference")
    if size == 1:
        notes.append("FRAC of one line is 1 by definition: undefined")
    return notes


def _report(data: dict[str, Any], comparison: Comparison) -> Iterator[str]:
    low, high = data["band"]
    yield f"{data['quantity']} to {data['reference']}, {data['lines']} lines from {low:g} to {high:g} Hz"
    shown = [*MEASURES, *(name for name in BESIDE if math.isfinite(data[name]))]
    sensors = comparison.per_sensor.set_index("sensor")[shown]
    table = pd.concat([sensors, sensors.mean(skipna=False).to_frame("mean").T])
    yield table.rename_axis(columns="sensor").to_string(float_format=_number_text, na_rep="undefined")
    yield f"RMSE {_number_text(data['rmse_db'])} dB; {data['beside']}"
    yield f"CSAC {_number_text(data['csac'])}, CSF {_number_text(data['csf'])} over the responses, mean of the lines"
    for row in comparison.per_mode.to_dict("records"):
        if words := _mode_text(row):
            yield f"mode {row['mode']}: {words}"


def _mode_text(row: dict[Any, Any]) -> str:
    """Return a mode in words; "" for an empty row."""
    test, model, why = row["test_hz"], row["model_hz"], row["why"]
    known = [f"{name}{hz:.5g} Hz" for name, hz in (("", test), ("model ", model)) if math.isfinite(hz)]
    if not known:
        return ""
    if why:
        return f"{', '.join(known)}; not compared: {why}"
    return (
        f"{', '.join(known)} ({100 * (model / test - 1):+.3g} %), MAC {_number_text(row['mac'])}, "
        f"damping {row['test_damping']:.3g}, model {row['model_damping']:.3g}"
    )


def _number_text(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "undefined"
