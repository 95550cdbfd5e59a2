"""The figure of a structure that was found, at a bench of few channels."""

from types import SimpleNamespace

import numpy as np
import pytest

from clearance_mj.report.structure_section import draw_misfits


@pytest.mark.parametrize("count", [2, 5])
def test_the_colour_bar_is_labelled_within_the_figure(count):
    lines = np.ones((count, 30))
    piece = SimpleNamespace(frequency=np.linspace(5, 200, 30), measured=lines, fitted=1.1 * lines)
    names = tuple(f"accelerometer {i}:+Z" for i in range(count))
    structure = SimpleNamespace(as_drawn=(piece,))
    figure = draw_misfits(SimpleNamespace(channels=names, structure=structure, misfit=(piece,))).figure
    figure.draw_without_rendering()
    label = figure.axes[-1].yaxis.label.get_window_extent()
    assert label.y0 >= 0 and label.y1 <= figure.bbox.height and label.x1 <= figure.bbox.width
