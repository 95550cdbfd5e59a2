"""Rattle maps of the Table-1 rig. Truth: branches of single levels, the linear response, the modal engine's marches."""

import numpy as np
import pytest

from clearance_mj import ClearanceError, ConstantLaw, ExcitationError, LawError, Model, RigError, periodic
from clearance_mj.beam import linear_frf

from ..conftest import TABLE1
from ..fuzz.samples import RIG
from ..refusals import assert_refused
from .test_rigs import BARE, LAW

LEVELS = (1.0, 6.0)
FREQUENCIES = np.sort(np.append(np.linspace(30, 60, 31), (46.2, 46.8)))
"""Hz; between the last two there are three vibrations at 6 m/s²"""


@pytest.fixture(scope="module")
def rattle():
    return periodic.map_rattle(Model(TABLE1, LAW), LEVELS, FREQUENCIES, workers=1)


@pytest.mark.parametrize("frequency", [36.0, 46.2, 46.8])
def test_a_cell_is_what_a_branch_comes_to(rattle, frequency, measured):
    """From below for a sweep upwards, from above for one downwards: branches end where they leave their range."""
    i = np.flatnonzero(FREQUENCIES == frequency)[0]
    off = []
    for sweep, start in enumerate((30, 60)):
        branch = periodic.follow_response(Model(TABLE1, LAW), 6.0, (start, frequency), stability=False)
        for name in ("acceleration", "clearance_displacement"):
            of_map = getattr(rattle, name.replace("clearance_", ""))[sweep, 0, 1, i]
            off.append(np.abs(of_map / branch.amplitude(name)[-1] - 1).max())
    what = f"rattle map at {frequency:g} Hz: amplitudes beside those of the branch"
    measured.below(what, max(off), 1e-3, "harmonic balance")


def test_it_rattles_where_the_linear_response_fills_the_gap(rattle):
    """At 1 m/s² nowhere; at 6 m/s² within the curve of first contact, and beyond it as far as the jump."""
    assert not rattle.rattles[0, 0].any() and rattle.unknown == 0 and not rattle.ended
    inside = rattle.first_contact[0] < 6.0
    jump = max(jump.frequency for jump in rattle.jumps)
    np.testing.assert_array_equal(rattle.rattles[0, 1], inside | ((FREQUENCIES > 40) & (FREQUENCIES < jump)))
    known = linear_frf(TABLE1, FREQUENCIES[:5]).T
    np.testing.assert_allclose(rattle.acceleration[0, 0, 0, :5], np.abs(known), rtol=1e-3)


def test_it_jumps_where_the_branch_folds(rattle):
    branch = periodic.follow_response(Model(TABLE1, LAW), 6.0, (30, 60), stability=False)
    up, down = (point.frequency for point in branch.special if point.kind == "fold")
    jumps = {jump.sweep: jump for jump in rattle.jumps}
    assert jumps["up"].frequency == pytest.approx(up, rel=1e-4) and jumps["up"].level == 6.0
    assert jumps["down"].frequency == pytest.approx(down, rel=1e-4)
    between = (FREQUENCIES > down) & (FREQUENCIES < up)
    np.testing.assert_array_equal(rattle.vibrations[0, 1], np.where(between, 3, 1))
    differ = np.any(rattle.penetration[0] != rattle.penetration[1], axis=-1)[0, 1]
    np.testing.assert_array_equal(differ, between)  # a sweep upwards rattles there, one downwards does not
    assert rattle.contact_share[0, 0, 1, between].all() and not rattle.contact_share[1, 0, 1, between].any()


def test_figure_and_dataset(rattle):
    axes = rattle.plot().axes
    assert axes[0].get_title() == "gap 0.3 mm" and axes[0].get_xlabel() == "frequency (Hz)"
    np.testing.assert_array_equal(axes[0].lines[0].get_ydata(), rattle.first_contact[0])
    assert_refused(ClearanceError, 'quantity "speed" is unknown', rattle.plot, "speed")
    assert_refused(ClearanceError, "row must be between 0 and 7", rattle.plot, "acceleration", row=8)
    assert_refused(ClearanceError, 'sweep must be "up", "down" or "larger"', rattle.plot, sweep="left")
    data = rattle.to_xarray()
    assert data.acceleration.dims == ("sweep", "gaps", "level", "frequency", "response")
    tip = data.sel(sweep="down", level=6.0, response="8:+Z").acceleration.values[0]
    assert tip == pytest.approx(rattle.acceleration[1, 0, 1, :, 7])


@pytest.mark.parametrize(("change", "error", "words"), [
    ({"amplitudes": 1.0}, ExcitationError, "amplitudes must be 1 or more numbers in a row"),
    ({"amplitudes": (1.0, 1e308)}, ExcitationError, "amplitudes must be > 0, at most 1e.12 and increasing"),
    ({"amplitudes": (2.0, 1.0)}, ExcitationError, "amplitudes must be > 0, at most 1e.12 and increasing"),
    ({"frequencies": (10.0,)}, ExcitationError, "frequencies must be 2 or more numbers in a row"),
    ({"frequencies": (0.0, 1.0)}, ExcitationError, "frequencies must be > 0, at most 1e.12 and increasing"),
    ({"gaps": []}, ClearanceError, "gaps is empty"),
    ({"gaps": [(1e-4, 1e-4, 1e-4)]}, RigError, "gap must be one value or 2, one for each bushing; got 3"),
    ({"gaps": [0.0]}, RigError, "gap"),
    ({"gaps": [1e-308]}, RigError, "each of gaps must be at least 1e-09 m, got 1e-308"),
    ({"kind": "sound"}, ExcitationError, 'kind must be "base" or "force"'),
    ({"kind": "force"}, ExcitationError, "rig 'table1' has no shaker.position"),
    ({"workers": 0}, ClearanceError, "workers must be 1 to 1024, got 0"),
    ({"n_harmonics": 0}, ClearanceError, "harmonics must be 1 or more"),
    ({"model": Model(BARE, LAW)}, RigError, "rig 'table1' has no clearance"),
    ({"model": Model(TABLE1, ConstantLaw([1e3] * 3, 1.0))}, LawError, "3 bushings, the rig has 2"),
])  # fmt: skip
def test_refusals(change, error, words):
    given = {"model": Model(TABLE1, LAW), "amplitudes": (1.0,), "frequencies": (10.0, 20.0), "workers": 1}
    assert_refused(error, words, periodic.map_rattle, **given | change)


def test_a_level_at_which_no_vibration_is_found():
    """Contacts of 8000 N/m, without damping, at a billion g: the map says where the row ends, and the others stay."""
    rattle = periodic.map_rattle(Model(RIG), (1.0, 1e11), (8.0, 9.0), n_harmonics=1, n_modes=2, workers=1)
    assert np.isnan(rattle.acceleration[:, :, 1]).all() and np.isfinite(rattle.acceleration[:, :, 0]).all()
    assert rattle.ended and all("level 1e+11 m/s²: no further periodic vibration" in words for words in rattle.ended)
