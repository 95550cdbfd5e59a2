"""FRF matrices of a rig in space, and its directional FRFs: test and laws."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.lines import Line2D

from ...rig import Rig
from ...signals.frf import FRF
from ...study import Study
from ...study.matrices import FRFMatrices
from ..style import COLOURS, REPEAT, TEST, Drawing, decibel, finite, frequency_axis, letters, sheet, tidy
from .looks import Looks

__all__ = ["directional", "frf_matrix"]

MOST_NODES = 4
AXES = "YZ"


def frf_matrix(study: Study, matrices: FRFMatrices) -> list[Drawing]:
    """Draw the magnitude of every FRF of a matrix: a figure for each node, rows along y and z, columns to y and z."""
    looks = Looks(study)
    references = [next(r for r in matrices.test.references if r.endswith(axis)) for axis in AXES]
    drawn = []
    for node in _nodes(study.dataset.rig, matrices.test):
        of_node = [label for label in matrices.test.responses if label.split(":")[0] == node]
        rows = [next(label for label in of_node if label.endswith(axis)) for axis in AXES]
        figure = sheet(1.75 * len(rows), _handles(study, matrices))
        axes = figure.subplots(len(rows), 2, squeeze=False, sharex=True, gridspec_kw={"hspace": 0.3, "wspace": 0.14})
        for letter, ax, (row, column) in zip(letters(axes.size), axes.flat, np.ndindex(axes.shape)):
            seen = []
            for source, frf in matrices.frfs.items():
                i, j = frf.responses.index(rows[row]), frf.references.index(references[column])
                seen.append(decibel(frf.value[i, j]))
                ax.plot(frf.frequency, seen[-1], **_line_style(looks, source))
            lowest = min(np.percentile(finite(each), 0.5) for each in seen)
            ax.set_ylim(lowest - 2, max(finite(each).max() for each in seen) + 2)
            title = f"{letter} along {rows[row][-1].lower()}, to {matrices.kind} along {AXES[column].lower()}"
            tidy(ax, title, f"|H| ({looks.magnitude})" if column == 0 else "")
            frequency_axis(ax, (matrices.test.frequency[0], matrices.test.frequency[-1]), row == len(rows) - 1)
        words = _label(study, matrices)
        caption = f"FRF matrix of node {node} at {words}: what couples y and z is beside the diagonal."
        alt = f"Magnitudes of {axes.size} FRFs of node {node}: test and laws {looks.laws}."
        first = node == _nearest_node(study, matrices)
        drawn.append(Drawing(f"frf_matrix_{node}{_file_suffix(matrices)}", figure, caption, alt, first, chart=True))
    return drawn


def directional(study: Study, matrices: FRFMatrices) -> Drawing:
    """Draw normal and reverse directional FRFs of the nodes, backward on the left and forward on the right."""
    looks, frfs = Looks(study), matrices.directional
    points = frfs["test"].points[:MOST_NODES]
    figure = sheet(1.75 * len(points), _handles(study, matrices))
    axes = figure.subplots(len(points), 2, squeeze=False, sharex=True, gridspec_kw={"hspace": 0.3, "wspace": 0.14})
    for letter, ax, (row, column) in zip(letters(axes.size), axes.flat, np.ndindex(axes.shape)):
        name, seen = ("normal", "reverse")[column], []
        for source, frf in frfs.items():
            seen.append(decibel(getattr(frf, name)[frf.points.index(points[row])]))
            # A line from the last backward to the first forward frequency would be none of the FRF.
            gap = np.searchsorted(frf.frequency, 0.0)
            x, y = np.insert(frf.frequency, gap, 0.0), np.insert(seen[-1], gap, np.nan)
            ax.plot(x, y, **_line_style(looks, source))
        top = max(finite(each).max() for each in seen)
        ax.set_ylim(max(min(np.percentile(finite(each), 1) for each in seen), top - 90) - 2, top + 2)
        ax.axvline(0, color=REPEAT, lw=0.6)
        if matrices.spin_rpm:
            for sign in (-1, 1):
                ax.axvline(sign * matrices.spin_rpm / 60, color=COLOURS[5 % len(COLOURS)], lw=0.7, ls=":")
        ax.set_xlim(frf.frequency[0], frf.frequency[-1])
        label = "Frequency (Hz): backward < 0 < forward" if row == len(points) - 1 else ""
        tidy(ax, f"{letter} node {points[row]}, {name}", f"|H| ({looks.magnitude})" if column == 0 else "", label)
    caption = (
        f"Directional FRFs at {_label(study, matrices)}: normal, of circles that go round as the excitation does, and "
        "reverse, of those that go round against it, which are nothing where y and z are alike. Dotted: the spin."
    )
    alt = f"Directional FRFs of {len(points)} nodes: test and laws {looks.laws}."
    return Drawing(f"directional{_file_suffix(matrices)}", figure, caption, alt, chart=True)


def _line_style(looks: Looks, source: str) -> dict[str, Any]:
    if source == "test":
        return {"color": TEST, "lw": 2.0, "label": "test"}
    if source == "repeat":
        return {"color": REPEAT, "lw": 0.9, "label": "test, other seed"}
    return looks.line(source, looks.study.main_engine)


def _handles(study: Study, matrices: FRFMatrices) -> list[Line2D]:
    return Looks(study).key("test", "" if matrices.repeat is None else "test, other seed", engines=False)


def _nodes(rig: Rig, frf: FRF) -> list[str]:
    """Return the nodes with responses along y and z."""
    nodes = dict.fromkeys(label.split(":")[0] for label in frf.responses)
    return [n for n in nodes if {label[-1] for label in frf.responses if label.split(":")[0] == n} >= set(AXES)]


def _nearest_node(study: Study, matrices: FRFMatrices) -> str:
    """Return the node that is nearest to a bushing."""
    rig, nodes = study.dataset.rig, _nodes(study.dataset.rig, matrices.test)
    bushings = [b.position for b in rig.bushings if isinstance(b.position, float)]
    away = {
        str(s.node): min((abs(s.position - x) for x in bushings), default=0.0)
        for s in rig.sensors
        if isinstance(s.position, float) and str(s.node) in nodes
    }
    return min(away, key=lambda node: away[node]) if away else nodes[0]


def _file_suffix(matrices: FRFMatrices) -> str:
    return f"_level_{matrices.level:g}_{matrices.spin_rpm:.0f}rpm" + ("_force" if matrices.kind == "force" else "")


def _label(study: Study, matrices: FRFMatrices) -> str:
    turning = f"{matrices.spin_rpm:.4g} rev/min" if matrices.spin_rpm else "no spin"
    unit = "N" if matrices.kind == "force" else "m/s²"
    return f"{matrices.level:g} {unit} RMS and {turning}, {Looks(study).test} and laws"
