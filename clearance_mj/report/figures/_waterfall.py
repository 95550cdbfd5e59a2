"""FRFs of test and best law over level."""

from __future__ import annotations

from typing import Any

from matplotlib.lines import Line2D

from ...study import Study
from ..style import COLOURS, FONT, TEST, Drawing, decibel
from ..waterfall import STEP, draw_levels
from ._looks import Looks

_PAIR: tuple[dict[str, Any], ...] = ({"color": TEST, "lw": 2.0}, {"color": COLOURS[1], "lw": 0.9})


def study_waterfall(study: Study) -> Drawing:
    """Draw FRFs of the test and of the best law at the bushings' sensors over the levels of a study."""
    law, engine, curves = study.best_law, study.main_engine, {}
    for level in study.levels:
        pair = study.test(study.records(level)[0]), study.case(law, engine, level).frf
        curves[level] = [(frf.frequency, decibel(frf.functions)) for frf in pair]
    looks = Looks(study)
    figure = draw_levels(study.dataset.rig, curves, "|H|", looks.magnitude, study.unit, looks=_PAIR)
    of = looks.test
    handles = [Line2D([], [], **_PAIR[0], label=of), Line2D([], [], **_PAIR[1], label=f"law “{law}”, engine {engine}")]
    figure.legend(handles=handles, loc="outside upper center", ncols=2, fontsize=FONT, frameon=False)
    caption = (
        f"FRFs over level, {of} and the best law: each pair {STEP:g} dB above the one of the level before. Resonances "
        "shift and flatten where the shaft begins to touch its bushings."
    )
    alt = f"FRF magnitudes of the {of} and law {law} at {len(study.levels)} levels, one above the other."
    return Drawing("waterfall", figure, caption, alt)
