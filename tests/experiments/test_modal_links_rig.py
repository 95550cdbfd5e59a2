"""The engines against the virtual rig, which shares no code with them: small version of the experiment."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg

from clearance_mj import ContactLaw, Grease, Model
from clearance_mj.clearance import HuntCrossley
from clearance_mj.study import IdentifiedModel
from experiments.article import ITEMS
from experiments.article.modal_links_rig import GREASE_ONLY, NAME, QUICK, run

pytestmark = pytest.mark.slow

GREASE = Grease(4352.0, 4.02, elastic_ratio=0.8, beta=9.8e6, gamma=9.8e6, film_height=7.5e-4)
LAW = ContactLaw(HuntCrossley(2.46e5, 0.95, 1.47), grease=GREASE)
"""As identified from the shipped records by output error"""
SETUP = replace(QUICK, sweeps={"as it is": (9.0, 12.0), "reduced": (9.0, 9.75, 11.0)}, amplitudes=(0.05, 0.4, 3.2))


@pytest.fixture(scope="module")
def result(rig):
    laws = (IdentifiedModel("output-error", Model(rig, LAW), "what its test says"),)
    return run(ITEMS[NAME], SimpleNamespace(dataset=SimpleNamespace(rig=rig), laws=laws), True, SETUP)


def by(rows, value, *keys):
    return rows.set_index(list(keys))[value].to_dict()


def test_backbones_of_rig_and_engine(result):
    """Frequency within 0.5 % and damping within 10 % at each level, and both go up with level in mode 1."""
    for quantity, tolerance in (("frequency_hz", 0.005), ("damping", 0.1)):
        values = by(result.data[NAME], quantity, "system", "level_m_s2", "mode")
        assert len(values) == 2 * 2 * 4
        for (system, level, mode), value in values.items():
            assert value == pytest.approx(values["rig", level, mode], rel=tolerance), system
        assert values["rig", 4.0, 1] > 1.05 * values["rig", 0.5, 1]


def test_backbones_start_at_the_natural_frequencies_in_the_gap(result):
    values = by(result.data[NAME], "frequency_hz", "system", "level_m_s2", "mode")
    measured = [values["rig", 0.5, mode] for mode in range(1, 5)]
    np.testing.assert_allclose(measured, [9.25, 39.75, 92.85, 188.85], rtol=0.01)


def test_shapes(result):
    values = by(result.data[f"{NAME}_mac"], "mac", "system", "level_m_s2", "rig_mode", "system_mode")
    for level in SETUP.levels:
        assert min(values["modal", level, mode, mode] for mode in range(1, 5)) > 0.99
        assert all(values["rig", level, mode, mode] == pytest.approx(1) for mode in range(1, 5))


def test_harmonics(result):
    """Odd ones alone by symmetry; contact limits the motion that the grease alone would allow."""
    values = by(result.data[f"{NAME}_harmonics"], "displacement_m", "system", "amplitude_m_s2", "harmonic")
    for order in (1, 3):
        assert values["modal", 3.2, order] == pytest.approx(values["rig", 3.2, order], rel=0.05)
    assert values["modal", 3.2, 2] < 1e-3 * values["modal", 3.2, 1]
    assert values[GREASE_ONLY, 3.2, 1] > 1.2 * values["modal", 3.2, 1]
    assert values[GREASE_ONLY, 0.05, 1] == pytest.approx(values["modal", 0.05, 1], rel=1e-6)


def test_two_motions_at_one_frequency_with_reduced_grease(result):
    values = by(result.data[f"{NAME}_jumps"], "displacement_m", "grease", "system", "frequency_hz", "direction")
    for system in ("rig", "modal"):
        assert values["reduced", system, 9.75, "up"] > 2 * values["reduced", system, 9.75, "down"]
        for state, frequency in (("reduced", 11.0), ("as it is", 9.0), ("as it is", 12.0)):
            up, down = (values[state, system, frequency, way] for way in ("up", "down"))
            assert up == pytest.approx(down, rel=0.05)


def test_distortion_is_no_noise(result):
    """At 4 m/s² what the phases change is far above what the periods change, on rig and engine alike."""
    (table,) = [table for table in result.tables if table.name == "scatter"]
    scatter = {row[:2]: row[2:] for row in table.rows}
    for system in ("rig", "modal"):
        noise, distortion = scatter[system, 4.0]
        assert distortion > noise + 20 and distortion > scatter[system, 0.5][1] + 10
    assert scatter["modal", 4.0][1] == pytest.approx(scatter["rig", 4.0][1], abs=1)


def test_figures_are_labelled_and_whole(result):
    assert len(result.drawings) == 5
    for figure in (drawing.figure for drawing in result.drawings):
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        whole = figure.get_tightbbox(canvas.get_renderer())
        assert whole.min.min() >= -0.02 and np.all(whole.max <= figure.get_size_inches() + 0.02)
        labels = [label for ax in figure.findobj(Axes) for label in (ax.get_xlabel(), ax.get_ylabel()) if label]
        assert labels and all(re.search(r"\S \(.+\)", label) for label in labels)


def test_words_hold_numbers_only(result):
    for words in (result.method, result.shows):
        assert words and "nan" not in words
