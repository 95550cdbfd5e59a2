"""Figures of contact: what is given is drawn, labelled with units, inside the canvas."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from clearance_mj import TimeLaw
from clearance_mj.identify.laws.contact_over_time import ContactParameters
from clearance_mj.report import contact as draw
from clearance_mj.signals.wavelet import ridge, scalogram

from .conftest import assert_drawn_within, assert_units

FS, GAPS = 512.0, (3e-4, 4e-4)
TIME = np.arange(int(8 * FS)) / FS
BAND = (4.0, 24.0)


@pytest.fixture(scope="module")
def contact():
    n, rng = 60, np.random.default_rng(3)
    k = 5000 + 500 * rng.standard_normal((n, 2))
    k[:10] = np.nan
    c, amplitude = k / 1000, 3e-4 + 2e-4 * rng.random((n, 2))
    return ContactParameters(np.arange(n) / 8, k, c, 0.1 * k, 0.2 * c, 0.3 * np.ones((n, 2)), amplitude, ())


@pytest.fixture(scope="module")
def figures(contact):
    decay = np.exp(-0.4 * TIME) * np.cos(2 * np.pi * 9.25 * TIME)
    planes = [scalogram(a * decay, FS, BAND) for a in (1e-3, 4e-4)]
    ridges = [ridge(a * decay, FS, BAND) for a in (1e-3, 4e-4)]
    schedule = TimeLaw([0.0, 8.0], [[4e3, 5e3], [6e3, 7e3]], [[1.0, 2.0], [3.0, 4.0]])
    amplitude = np.linspace(3e-4, 6e-4, 20)
    curve = draw.AmplitudeCurve("law", amplitude, *(np.outer(f * amplitude, (1.0, 2.0)) for f in (1e7, 1e4)))
    return {"scalograms": draw.scalograms("decay", planes, ridges, GAPS),
            "contact over time": draw.contact_over_time("both", contact, schedule),
            "contact over time, windows": draw.contact_over_time("windows", contact, None),
            "contact over time, ridge": draw.contact_over_time("ridge", None, schedule),
            "contact over amplitude": draw.contact_over_amplitude([contact], [curve], GAPS)}  # fmt: skip


NAMES = [
    "scalograms", "contact over time", "contact over time, windows", "contact over time, ridge",
    "contact over amplitude",
]  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_nothing_is_cut_off_at_the_edge_and_axes_have_units(figures, name):
    canvas = FigureCanvasAgg(figures[name])
    canvas.draw()
    assert_drawn_within(np.asarray(canvas.buffer_rgba())[..., :3] / 255)
    assert_units(figures[name], "s|Hz|mm|N|N/m|N s/m", 4)


def lines(ax):
    return {line.get_label(): line for line in ax.lines}


def test_ridge_is_dotted_where_it_is_not_valid(figures):
    frequency = lines(figures["scalograms"].axes[0])
    valid, rest = frequency["valid"].get_ydata(), frequency["not valid"].get_ydata()
    np.testing.assert_allclose(valid[np.isfinite(valid)], 9.25, rtol=2e-3)
    assert np.array_equal(np.isfinite(valid), np.isnan(rest))
    masked = TIME[np.isnan(valid)]
    # 4 σ_t at both ends, σ_t = ω0/ω with ω0 = 5
    assert masked[masked < 4].max() == pytest.approx(4 * 5 / (2 * np.pi * 9.25), rel=0.1)


def test_contact_curves_are_what_was_given(figures, contact):
    for ax, values in zip(figures["contact over time"].axes, (contact.k, contact.c)):
        np.testing.assert_array_equal(lines(ax)[draw.WINDOWS].get_ydata(), values[:, 0])
    stiffness = lines(figures["contact over amplitude"].axes[2])
    np.testing.assert_allclose(stiffness["law"].get_ydata(), 2e7 * stiffness["law"].get_xdata() / 1e3)
    assert stiffness["gap"].get_xdata()[0] == pytest.approx(0.4)
