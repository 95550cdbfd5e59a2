"""Files of what the live page shows: rig and law, the FRFs as numbers, and figures to print."""

from __future__ import annotations

import io
import json
import tempfile
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..core.files import sha256, to_json
from ..core.provenance import made_from
from ..report.style import COLOURS, FONT, TEST, canvas, phase, sensor_title, tidy
from ..report.whirl import draw_orbits, draw_spectra
from ..rotors import whirl
from ..signals.frf import FRF
from ..structure.base import is_rotation
from .session import SettingResult

__all__ = ["exported"]

TURNS = 8  # last ones of a shaft that turns
README = """Made by clearance-mj live. rig.toml and law.json belong together: clearance-mj simulate FOLDER
setting.json: every slider, SI units. provenance.json: versions, digests of all files.
frf.csv: magnitude, phase (degrees) and coherence of every sensor.
"""


def exported(shown: SettingResult, test: FRF | None = None, inputs: Iterable[Path] = ()) -> bytes:
    """Return a zip archive of what is shown, with a test's FRFs in its figures if there are any.

    It holds rig.toml, law.json, setting.json, the numbers as CSV, figures as SVG and PNG, and provenance.json:
    versions, and the digests of the files that the page was made of, ``inputs``, and of all others in the archive.
    """
    buffer = io.BytesIO()
    with tempfile.TemporaryDirectory() as name, zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        folder = Path(name)
        shown.model.save(folder)
        (folder / "setting.json").write_text(json.dumps(shown.values, indent=1) + "\n", encoding="utf-8")
        (folder / "README.txt").write_text(README, encoding="utf-8")
        figures = _whirl_figures(shown) | _displacement_figure(shown)
        if shown.frf is not None:
            (folder / "frf.csv").write_text(_table(shown.frf), encoding="utf-8")
            figures["frf"] = _frf_figure(shown, shown.frf, test)
        for title, figure in figures.items():
            for kind in ("svg", "png"):
                figure.savefig(folder / f"{title}.{kind}", dpi=150)
        digests = {path.relative_to(folder).as_posix(): sha256(path) for path in folder.rglob("*") if path.is_file()}
        provenance_ = made_from(inputs, "live") | {"files": digests}
        (folder / "provenance.json").write_text(to_json(provenance_), encoding="utf-8")
        for path in sorted(folder.rglob("*")):
            if path.is_file():
                archive.write(path, path.relative_to(folder).as_posix())
    return buffer.getvalue()


def _table(frf: FRF) -> str:
    columns: dict[str, Any] = {"frequency_hz": frf.frequency}
    for i, label in enumerate(frf.responses):
        columns[f"{label}_magnitude"] = np.abs(frf.value[i, 0])
        columns[f"{label}_phase_deg"] = np.degrees(np.angle(frf.value[i, 0]))
        if frf.coherence is not None:
            columns[f"{label}_coherence"] = frf.coherence[i, 0]
    rows = (",".join(f"{x:.10g}" for x in row) for row in zip(*columns.values()))
    return "\n".join((",".join(columns), *rows)) + "\n"


def _frf_figure(shown: SettingResult, frf: FRF, test: FRF | None) -> Figure:
    """Return the FRF's figure, all sensors in each panel: a column for every sensor would be too wide."""
    figure = canvas(6.5)
    above, middle, below = figure.subplots(3, sharex=True, height_ratios=(3, 2, 1.4))
    for i, label in enumerate(frf.responses):
        colour, name = COLOURS[i % len(COLOURS)], sensor_title(shown.model.rig, i)
        if test is not None and label in test.responses:
            row = test.responses.index(label)
            words = "test, same colours" if not i else None
            above.semilogy(test.frequency, np.abs(test.value[row, 0]), ":", color=colour, lw=0.9, label=words)
        above.semilogy(frf.frequency, np.abs(frf.value[i, 0]), color=colour, lw=0.9, label=name)
        middle.plot(frf.frequency, phase(frf.value[i, 0]), color=colour, lw=0.7)
        if frf.coherence is not None:
            below.plot(frf.frequency, frf.coherence[i, 0], color=colour, lw=0.7)
    unit = "1" if frf.quantity.endswith("acceleration") else "(m/s²)/N"
    tidy(above, shown.model.rig.name, f"Magnitude ({unit})")
    tidy(middle, "", "Phase (°)")
    tidy(below, "", "Coherence", "Frequency (Hz)")
    above.legend(fontsize=FONT - 2, ncols=3, frameon=False)
    return figure


def _whirl_figures(shown: SettingResult) -> dict[str, Figure]:
    """Return figures of orbits and full spectra in round clearances."""
    if not any(b.is_round for b in shown.model.rig.bushings):
        return {}
    end = whirl(shown.model.rig, shown.response).ending(1.0, TURNS)
    return {"orbits": draw_orbits(end, TURNS).figure, "full_spectra": draw_spectra(end, 1.0).figure}


def _displacement_figure(shown: SettingResult) -> dict[str, Figure]:
    """Return a figure of displacements in clearances along one coordinate."""
    response, rig = shown.response, shown.model.rig
    slots = [(i, b, rows.start) for i, (b, rows) in enumerate(zip(rig.bushings, rig.clearance_rows)) if not b.is_round]
    if not slots:
        return {}
    figure = canvas(0.6 + 1.6 * len(slots))
    axes = figure.subplots(len(slots), sharex=True, squeeze=False)[:, 0]
    for ax, (i, bushing, row) in zip(axes, slots):
        ax.plot(response.time, 1e3 * np.asarray(response.displacement)[row], color=COLOURS[i % len(COLOURS)], lw=0.4)
        for wall in filter(np.isfinite, bushing.walls):
            ax.axhline(1e3 * wall, color=TEST, lw=0.7, ls="--")
        words = "Angle (mrad)" if is_rotation(bushing.position) else "Displacement (mm)"
        tidy(ax, bushing.where, words, "Time (s)" if ax is axes[-1] else "")
    return {"displacement": figure}
