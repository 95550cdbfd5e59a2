"""Where branches begin: oscillators with one slider, a rig that turns back, round clearances.

Truth: small time steps of the oscillator with its slider, and the modal engine's march.
"""

import itertools

import numpy as np
import pytest

from clearance_mj import ClearanceError, Model, periodic
from clearance_mj.clearance import ConstantLaw, ContactLaw, KelvinVoigt, MaxwellSlip
from clearance_mj.periodic.condensed import condensed
from clearance_mj.periodic.continuation import NoConvergence
from clearance_mj.periodic.solver import Solver
from clearance_mj.periodic.starts import NEARBY, Start, marched
from clearance_mj.rig import Contact, Spin, Unbalance

from ..conftest import TABLE1
from .jeffcott import STIFFNESS, jeffcott, replaced
from .one_mass import one_mass

BAND = 0.5 / (2 * np.pi), 0.8 / (2 * np.pi)  # Hz; the oscillator's frequency without slider is 1 rad/s
CASES = list(itertools.product((1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0), (0.0, 0.02, 0.1), (0.1, 0.3, 0.6)))


def with_slider(spring: float, damping: float, force: float) -> Model:
    """J. P. Den Hartog, Trans. ASME 53, 1931, with a spring in series with the friction."""
    law = ContactLaw(KelvinVoigt(1.0), MaxwellSlip(springs=(spring,), forces=(force,)))
    return Model(one_mass(damping=damping, gap=1e3), law)


def in_small_steps(spring: float, damping: float, force: float, omega: float, periods: int = 60, steps: int = 4096):
    """Fundamental and half of the extent of the vibration under a unit force, by velocity Verlet from rest."""
    step = 2 * np.pi / (omega * steps)
    x, v, z, a, limit = 0.0, 0.0, 0.0, 1.0, force / spring
    last, drive = [], np.cos(2 * np.pi * np.arange(steps) / steps).tolist()
    for i in range(periods * steps):
        half = v + 0.5 * step * a
        z = min(max(z + step * half, -limit), limit)
        x += step * half
        pushed = drive[(i + 1) % steps] - x - spring * z
        v = (half + 0.5 * step * pushed) / (1 + 0.5 * step * damping)
        a = pushed - damping * v
        if i >= (periods - 1) * steps:
            last.append(x)
    last = np.array(last)
    angle = 2 * np.pi * (np.arange(steps) + 1) / steps
    return abs(2 * np.mean(last * np.exp(-1j * angle))), np.ptp(last) / 2


@pytest.mark.parametrize(
    "cases", [CASES[::3], pytest.param(CASES, marks=pytest.mark.slow)], ids=["least friction", "all"]
)
def test_a_slider_of_any_stiffness_begins(cases):
    """Springs of 1 to 1000 times the structure's, without damping and at resonances of harmonics, too."""
    for case in cases:
        branch = periodic.follow_response(with_slider(*case), 1.0, BAND, n_harmonics=13, n_samples=512)
        assert branch.frequency.min() == pytest.approx(BAND[0], rel=2e-5), case
        assert branch.frequency[-1] == pytest.approx(BAND[1], rel=1e-9) and not branch.ended, case


@pytest.mark.parametrize(
    ("case", "omega"),
    [((1.0, 0.1, 0.3), 0.5), ((10.0, 0.02, 0.1), 0.7), ((30.0, 0.1, 0.6), 0.5), ((100.0, 0.1, 0.3), 0.5)],
)
def test_it_vibrates_as_in_small_time_steps(case, omega, measured):
    ends = omega / (2 * np.pi), (omega + 0.02) / (2 * np.pi)
    branch = periodic.follow_response(with_slider(*case), 1.0, ends, n_harmonics=41, n_samples=2048, stability=False)
    extents = abs(branch.clearance_displacement[0, 0, 1]), branch.excursion()[0, 0]
    off = np.abs(np.divide(extents, in_small_steps(*case, omega)) - 1).max()
    measured.below("harmonic balance with a slider: fundamental and extent", off, 1e-3, "small time steps")


def test_a_round_clearance_with_a_stiff_slider_begins():
    """In a direction across the shaft it vibrates as the planar oscillator; both stand in units of the structure."""
    rig = replaced(jeffcott(damping=0.02), gap=1.0, contact=Contact(STIFFNESS))
    for spring, force in ((10.0, 0.6), (100.0, 0.6), (1000.0, 0.6)):
        law = ContactLaw(KelvinVoigt(STIFFNESS), MaxwellSlip(springs=(spring * STIFFNESS,), forces=(force,)))
        ends = 60 * BAND[0], 60 * BAND[1]
        whole = periodic.follow_response(Model(rig, law), 1.0, ends, n_harmonics=7, n_samples=256, stability=False)
        plane = periodic.follow_response(with_slider(spring, 0.02, force), 1.0, BAND, 7, 256, stability=False)
        assert not whole.ended and whole.frequency[-1] == pytest.approx(ends[1])
        for at in (0, -1):
            orbit = STIFFNESS * abs(whole.clearance_displacement[at, 1, 1])
            assert orbit == pytest.approx(abs(plane.clearance_displacement[at, 0, 1]), rel=1e-3)


# Ways to a first motion, each alone.


def starts(model: Model, level: float, ends: tuple[float, float], harmonics: int, samples: int) -> Start:
    def solver(h: int) -> Solver:
        return Solver(condensed(model, model.rig.shaker.kind, [level], h, 8), h, samples)

    return Start(solver(harmonics), 2 * np.pi * ends[0], 2 * np.pi * ends[1], solver)


def test_every_way_comes_to_the_vibration_that_grows_out_of_rest():
    """Between walls, below the resonance, where there is no other."""
    begins = starts(Model(TABLE1, ConstantLaw(8e3, 2.0)), 6.0, (25.0, 28.0), 21, 256)
    ways = [list(branch) for branch in begins._branches()]
    assert len(ways) == 3 + len(NEARBY)
    rest = ways[0][0]
    for way in ways[1:]:
        assert way[0].parameter == pytest.approx(rest.parameter, rel=2e-5)
        assert np.linalg.norm(way[0].z - rest.z) < 1e-3 * rest.scale
        assert np.all(np.diff([motion.parameter for motion in way]) > 0)
        assert way[-1].parameter == pytest.approx(ways[0][-1].parameter)
        assert all(motion.tangent[-1] > 0 for motion in way)


def test_one_way_after_the_other_is_tried(monkeypatch):
    """Without the branch over the level the march is left; without that, the refusal says what to change."""

    def refuse(*_):
        raise NoConvergence(2 * np.pi * 25.0)

    model = Model(TABLE1, ConstantLaw(8e3, 2.0))
    known = periodic.follow_response(model, 6.0, (25.0, 26.0), stability=False)
    monkeypatch.setattr(Solver, "first", refuse)
    branch = periodic.follow_response(model, 6.0, (25.0, 26.0), stability=False)
    np.testing.assert_allclose(branch.clearance_displacement[0], known.clearance_displacement[0], atol=1e-9)
    monkeypatch.setattr(Start, "_solve_after_march", refuse)
    with pytest.raises(ClearanceError, match=r"no periodic vibration was found at 25 Hz .* other numbers of harmonics"):
        periodic.follow_response(model, 6.0, (25.0, 26.0), stability=False)


def test_marches_in_space_come_to_the_orbits():
    """Under weight and a shaken base, and under an unbalance, whose phase and factor count."""
    rig = TABLE1.with_shape("round").replace(gravity=(0.0, 2.0, -9.81), spin=Spin(50.0))
    turned = rig.replace(unbalances=(Unbalance(rig.bushings[0].position, 1e-4, 0.7),))
    omega = 2 * np.pi * 25.0
    shaken = periodic.follow_response(Model(rig), 6.0, (25.0, 25.1), 21, 256, stability=False)
    swung = periodic.follow_unbalance(Model(turned), (omega, omega + 0.1), 21, 256, stability=False, factor=1.3)
    for branch, level, spin in ((shaken, 6.0, 50.0), (swung, 1.3, omega)):
        system = condensed(branch.model, branch.kind, [level], 21, 8, speed=spin)
        x = marched(system, omega, 256)[: branch.clearance_displacement.shape[1]]
        orbit = np.fft.rfft(x, axis=1)[:, :3] / x.shape[1]
        orbit[:, 1:] *= 2
        march = branch.clearance_displacement[0, :, :3]
        np.testing.assert_allclose(orbit, march, atol=2e-3 * np.abs(march[:, 1]).max())


# Branches that leave their range where they began.

GAP = one_mass(damping=0.1, gap=0.5, contact=Contact(20.0))


@pytest.mark.slow
def test_a_branch_from_a_closed_part_says_what_it_leaves_out():
    """Superharmonic resonances: at 0.0159 Hz all ways lead to a part that turns back at 0.0184 Hz; 1 % below not."""
    branch = periodic.follow_response(Model(GAP), 1.0, (0.0159, 0.4774), n_harmonics=31, stability=False)
    assert branch.ended.endswith("isolas (find_isolas, --isolas)") and " to 0.4774 Hz is not covered" in branch.ended
    whole = periodic.follow_response(Model(GAP), 1.0, (0.01574, 0.4774), n_harmonics=31, stability=False)
    assert whole.frequency[-1] == pytest.approx(0.4774) and not whole.ended


def test_a_branch_that_turns_back_says_what_it_leaves_out():
    branch = periodic.follow_response(Model(GAP), 1.0, (0.4774, 0.0159), n_harmonics=31, stability=False)
    assert branch.frequency[-1] == pytest.approx(0.4774)
    fold = next(point.frequency for point in branch.special if point.kind == "fold")
    words = f"it turns back and leaves the range at 0.4774 Hz, where it began: {fold:.6g} to 0.0159 Hz is not covered"
    assert branch.ended.startswith(words)
