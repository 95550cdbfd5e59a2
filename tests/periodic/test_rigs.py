"""Periodic responses of rigs. Truth: the linear FRF, and harmonic stiffnesses."""

import numpy as np
import pytest

from clearance_mj import ClearanceError, Contact, ExcitationError, Grease, LawError, Model, RigError, periodic
from clearance_mj.beam import linear_frf
from clearance_mj.clearance import AmplitudeLaw, ConstantLaw, TimeLaw, harmonic
from clearance_mj.clearance.greases.bouc_wen import BoucWen
from clearance_mj.periodic import continuation
from clearance_mj.structure import Matrices

from ..conftest import TABLE1
from ..refusals import assert_refused
from .lost import until
from .one_mass import one_mass

LAW = ConstantLaw(7.8e3, 4.0)
LEVEL = 6.0  # m/s²


def test_in_the_gap_it_is_the_linear_response():
    """Two harmonics at once, at a level that never touches."""
    branch = periodic.follow_response(Model(TABLE1, LAW), (0.1, 0.05j), (35, 50), 4, n_modes=16)
    assert not branch.contact_force.any() and branch.stable.all() and not branch.special
    for order, level in ((1, 0.1), (2, 0.05j)):
        known = linear_frf(TABLE1, order * branch.frequency).T * level
        np.testing.assert_allclose(branch.acceleration[:, :, order], known, rtol=1e-6)


def test_contact_begins_when_the_linear_response_fills_the_gap():
    quiet = periodic.follow_response(Model(TABLE1, LAW), 1e-3, (30, 40), 1)
    level = 1e-3 * TABLE1.bushings[0].gap / np.abs(quiet.clearance_displacement[:, :, 1]).max()
    for factor in (0.95, 1.05):
        branch = periodic.follow_response(Model(TABLE1, LAW), factor * level, (30, 40))
        assert branch.contact_force.any() == (factor > 1)


@pytest.mark.parametrize("level", [1e-4, 0.3])
def test_bouc_wen_is_what_its_describing_function_says(level, monkeypatch):
    """With one harmonic force over displacement is `harmonic_stiffness`; in the small it is the stiffness k."""
    monkeypatch.setattr(harmonic, "PERIODS", 20)  # its mean has not died away after two
    grease = Grease(1000.0, elastic_ratio=0.3, beta=400.0, gamma=200.0, exponent=1.0)
    model = Model(one_mass(4e3, 0.5, grease=grease), ConstantLaw(0.0, 0.0))
    branch = periodic.follow_response(model, level, (9, 13), 1, 1024, stability=False)
    i = np.abs(branch.clearance_displacement[:, 0, 1]).argmax()
    x, omega = branch.clearance_displacement[i, 0, 1], 2 * np.pi * branch.frequency[i]
    stiffness = branch.grease_force[i, 0, 1] / x
    assert stiffness == pytest.approx(harmonic.harmonic_stiffness(BoucWen(grease), [abs(x)], omega)[0], rel=2e-4)
    if level < 1e-3:
        assert stiffness == pytest.approx(1000.0, rel=1e-2)
    assert x * (stiffness + 4e3 - omega**2 + 0.5j * omega) == pytest.approx(level, rel=1e-6)


def test_a_linear_grease_need_not_be_sampled(monkeypatch):
    branch = periodic.follow_response(Model(TABLE1, LAW), LEVEL, (44, 48), stability=False)
    monkeypatch.setattr(BoucWen, "is_linear", lambda self: False)
    sampled = periodic.follow_response(Model(TABLE1, LAW), LEVEL, (44, 48), stability=False)
    ends = [0, -1]  # both at one frequency
    np.testing.assert_allclose(branch.acceleration[ends], sampled.acceleration[ends], atol=1e-6)
    assert branch.contact_force[ends].any()


def test_it_jumps_where_a_slow_sweep_does():
    """Folds of the table-1 rig at 6 m/s², between which three vibrations are possible, the middle one unstable."""
    branch = periodic.follow_response(Model(TABLE1, LAW), LEVEL, (30, 60))
    up, down = (point for point in branch.special if point.kind == "fold")
    assert up.frequency > down.frequency
    between = (down.frequency + up.frequency) / 2
    crossings = np.flatnonzero(np.diff(np.sign(branch.frequency - between)))
    assert list(branch.stable[crossings]) == [True, False, True]
    back = periodic.follow_response(Model(TABLE1, LAW), LEVEL, (60, 30))
    folds = [p.frequency for p in back.special[::-1] if p.kind == "fold"]
    assert folds == pytest.approx([up.frequency, down.frequency], rel=1e-6)


def test_it_begins_with_the_vibration_that_grows_out_of_rest():
    """Where three are possible, the smallest one: it is below the gap's end, as the branch from above comes to it."""
    branch = periodic.follow_response(Model(TABLE1, LAW), LEVEL, (46.2, 46.3), stability=False)
    whole = periodic.follow_response(Model(TABLE1, LAW), LEVEL, (60, 46.2), stability=False)
    np.testing.assert_allclose(branch.acceleration[0], whole.acceleration[-1], atol=1e-6)
    # At 11 Hz the fourth harmonic is resonant, and the level folds twice on its way.
    assert not periodic.follow_response(Model(TABLE1, LAW), 20.0, (11, 11.2), stability=False).ended


def test_a_motion_from_wall_to_wall_within_a_sample():
    """Two stiff walls with next to no gap between them are a spring: amplitude of the linear oscillator with it."""
    model = Model(one_mass(4e3, 0.5, gap=1e-7), ConstantLaw(1000.0, 0.0))
    branch = periodic.follow_response(model, 1.0, (12, 13), 3, stability=False)
    omega = 2 * np.pi * branch.frequency
    known = 1.0 / (5000.0 - omega**2 + 0.5j * omega)
    np.testing.assert_allclose(np.abs(branch.displacement[:, 0, 1]), np.abs(known), rtol=1e-3)


def test_where_no_next_vibration_is_found_the_branch_so_far_is_kept(monkeypatch):
    monkeypatch.setattr(continuation.Continuation, "pieces", until(2 * np.pi * 35))
    branch = periodic.follow_response(Model(TABLE1, LAW), 2.0, (30, 60), 3, stability=False)
    last = branch.frequency[-1]
    assert branch.frequency[0] == pytest.approx(30) and last >= 35
    assert branch.ended == f"no further periodic vibration was found beyond {last:.6g} Hz and level 2 m/s²"


BARE = TABLE1.replace(bushings=())
FREE = Matrices("m-kg-s", mass=np.eye(2), stiffness=[[1.0, -1.0], [-1.0, 1.0]], dofs=["1:X", "2:X"])
RIGID = one_mass(gap=1e-3, contact=Contact(1e3)).replace(structure=FREE)
OVER = [0, 1], [1e3, 2e3], [1, 1]
DEFAULTS = {"model": Model(TABLE1, LAW), "amplitude": 1.0, "frequency_range": (10, 20)}


REFUSED = [
    ({"n_samples": 84}, ClearanceError, r"samples must be 85 or more for 21 harmonics \(4 H \+ 1\), got 84"),
    ({"n_modes": 0}, ClearanceError, "modes must be between 1 and 60"),
    ({"model": Model(BARE, LAW)}, RigError, "rig 'table1' has no clearance"),
    ({"model": Model(RIGID, LAW)}, RigError, "can move without any stiffness"),
    ({"model": Model(TABLE1, TimeLaw(*OVER))}, LawError, "a law over time has no periodic vibration"),
    ({"model": Model(TABLE1, AmplitudeLaw(*OVER))}, LawError, "a law over amplitude remembers"),
    ({"model": Model(TABLE1, ConstantLaw([1e3] * 3, 1.0))}, LawError, "3 bushings, the rig has 2"),
]  # by every call that finds periodic vibrations


@pytest.mark.parametrize(("change", "error", "words"), [
    ({"n_harmonics": 0}, ClearanceError, "harmonics must be 1 or more"),
    ({"n_harmonics": 2.5}, ClearanceError, "harmonics must be a whole number"),
    ({"amplitude": (1.0, 1.0), "n_harmonics": 1}, ClearanceError, "harmonics must be 2 or more"),
    ({"amplitude": 0.0}, ExcitationError, "amplitude must be finite and not zero"),
    ({"amplitude": float("nan")}, ExcitationError, "amplitude must be finite"),
    ({"amplitude": "loud"}, ExcitationError, "amplitude must be a number"),
    ({"frequency_range": (0, 10)}, ExcitationError, "frequency_range must be two different frequencies > 0 Hz"),
    ({"frequency_range": 10}, ExcitationError, "frequency_range is a pair"),
    ({"kind": "sound"}, ExcitationError, 'kind must be "base" or "force"'),
    ({"kind": "force"}, ExcitationError, "rig 'table1' has no shaker.position"),
    *REFUSED,
])  # fmt: skip
def test_refusals(change, error, words):
    assert_refused(error, words, periodic.follow_response, **DEFAULTS | change)


def test_figure_and_dataset():
    branch = periodic.follow_response(Model(TABLE1, LAW), LEVEL, (42, 50), 5)
    whole, stable = (line.get_ydata() for line in branch.plot("displacement", rows=[7]).axes[0].lines[:2])
    np.testing.assert_array_equal(whole, branch.amplitude("displacement")[:, 7])
    np.testing.assert_array_equal(np.isnan(stable), ~branch.stable)
    assert_refused(ClearanceError, 'quantity "speed" is unknown', branch.plot, "speed")
    assert_refused(ClearanceError, "rows must be between 0 and 1", branch.plot, "contact_force", rows=[2])
    labelled = branch.to_xarray()
    assert labelled.acceleration.dims == ("point", "response", "harmonic")
    assert labelled.sel(response="8:+Z", harmonic=1).displacement.values == pytest.approx(branch.displacement[:, 7, 1])
    assert list(labelled.special.values[[p.index for p in branch.special]]) == [p.kind for p in branch.special]
    assert labelled.acceleration.attrs["units"] == "m s-2" and labelled.attrs["kind"] == "base"


def test_results_carry_the_rig_s_own_unique_names_of_clearances():
    """Two stops at one degree of freedom, whose probes in records are called 1:+X and 301:+X."""
    upper, lower = (one_mass(grease=Grease(1.0), stops=stops).bushings[0] for stops in ("upper", "lower"))
    rig = one_mass(4e3, 0.5).replace(bushings=(upper, lower))
    names = ("1:X bushings[0]", "1:X bushings[1]")
    model = Model(rig, ConstantLaw(1e4, 1.0))
    branch = periodic.follow_response(model, 1.0, (9, 10), 3, stability=False)
    rattle = periodic.map_rattle(model, [1.0], [9.0, 10.0], n_harmonics=3, workers=1)
    curve = periodic.follow_backbone(model, n_harmonics=3)
    assert branch.clearances == rattle.clearances == curve.clearances == names
    assert tuple(branch.to_xarray().clearance.values) == names
    assert TABLE1.clearance_labels == ["6:+Z", "7:+Z"]
    assert rig.replace(bushings=(upper,)).clearance_labels == [upper.position]
