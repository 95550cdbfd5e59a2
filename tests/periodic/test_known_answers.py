"""Periodic vibrations with known answers: a gap with an offset, teeth of two stiffnesses, a slider, a line in a circle.

Truth: closed forms and products of exact pieces; of round clearances the slot's own vibrations.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import clearance_mj as cm
from clearance_mj import periodic
from clearance_mj.clearance import ContactLaw, KelvinVoigt, MaxwellSlip, TimeLaw
from clearance_mj.rig import Bushing, Contact, Grease, Load, Rig, Sensor, Shaker, Spin
from clearance_mj.structure import Disc, Gears, Inertia, Material, Section, Shaft, Support

from .one_mass import one_mass

TURN = 2 * np.pi


def extremes(harmonics):
    """Lowest and highest values (n,) of a period of harmonics (n, H + 1), at 16,384 samples."""
    values = np.fft.irfft(harmonics * np.append(1.0, np.full(harmonics.shape[-1] - 1, 0.5)), 16384) * 16384
    return values.min(axis=-1), values.max(axis=-1)


# A gap with an offset


def side_time(turn, wall, spring, contact):
    """Time from the middle to a turning point and back, of 1 kg on a spring that a wall stiffens beyond a distance.

    Beyond the wall x = x_c + (X - x_c) cos ω_1 t with ω_1² = k + k_c and x_c = k_c d / ω_1²; in the gap a sine of ω_0.
    """
    slow, fast = np.sqrt(spring), np.sqrt(spring + contact)
    if turn <= wall:
        return np.pi / slow
    middle = contact * wall / fast**2
    beyond = np.arccos((wall - middle) / (turn - middle)) / fast
    speed = fast * (turn - middle) * np.sin(fast * beyond)
    return 2 * (beyond + np.arctan(slow * wall / speed) / slow)


def other_turn(turn, near, far, spring, contact):
    """The turning point on the other side, at the same energy."""
    energy = spring * turn**2 / 2 + contact * max(turn - near, 0.0) ** 2 / 2
    free = np.sqrt(2 * energy / spring)
    if free <= far:
        return free
    a, b = spring + contact, contact * far
    return (b + np.sqrt(b**2 - a * (contact * far**2 - 2 * energy))) / a


def free_period(turn, near, far, spring, contact):
    """Period of the free vibration between two walls at `near` and `far` that turns beyond the near one at `turn`."""
    other = other_turn(turn, near, far, spring, contact)
    return side_time(turn, near, spring, contact) + side_time(other, far, spring, contact)


@pytest.mark.parametrize("turn", [0.6, 0.9, 1.5, 3.0])
def test_the_free_period_is_what_an_ode_solver_finds(turn):
    near, far, spring, contact = walls = 0.7, 1.3, 1.0, 9.0

    def rate(time, state):
        x, v = state
        return v, -spring * x - contact * (max(x - near, 0) - max(-far - x, 0))

    def slows(time, state):
        return state[1]

    slows.direction = -1
    solution = solve_ivp(rate, (0, 8), (turn, 0.0), "DOP853", events=slows, rtol=1e-11, atol=1e-12, max_step=0.01)
    back = next(t for t in solution.t_events[0] if t > 0.1)
    assert free_period(turn, *walls) == pytest.approx(back, rel=1e-7)
    assert -solution.y[0].min() == pytest.approx(other_turn(turn, *walls), rel=1e-4)


@pytest.mark.parametrize("offset", [3e-4, -3e-4])
def test_the_backbone_of_a_gap_with_an_offset(offset, measured):
    """Its walls stand at -g - o and g - o of the unloaded place: the mean moves away from the near one."""
    gap, spring, contact = 1e-3, 4e3, 2e4
    walls, law = (gap - abs(offset), gap + abs(offset), spring, contact), ContactLaw(KelvinVoigt(contact))
    model = cm.Model(one_mass(spring, gap=gap, offset=offset), law)
    curve = periodic.follow_backbone(model, 1, (0.5 * gap, 4 * gap), 61, 2048)
    assert not curve.ended
    low, high = extremes(curve.clearance_displacement[:, 0])
    turns = high if offset > 0 else -low  # on the side of the near wall
    known = np.array([free_period(turn, *walls) for turn in turns])
    touches = turns > walls[0]
    assert touches.sum() > 20 and not touches.all()
    off = np.abs(1 / curve.frequency / known - 1).max()
    measured.below(f"backbone, a gap with an offset of {offset:g} m: period over amplitude", off, 1e-3, "closed form")
    others = [other_turn(turn, *walls) for turn in turns]
    np.testing.assert_allclose(-low if offset > 0 else high, others, rtol=1e-3)
    np.testing.assert_allclose(curve.damping, 0, atol=1e-8)


# Teeth of two stiffnesses in turn: Meissner's equation


def meissner(omega, depth, damping):
    """Derivative (2, 2) of place and velocity after a period of x'' + c x' + (1 ± ε) x = 0 by those before.

    The stiffness is 1 + ε for half of the period 2π/ω and 1 - ε for the other half (E. Meissner, Über
    Schüttelerscheinungen in Systemen mit periodisch veränderlicher Elastizität, Schweizerische Bauzeitung 72, 1918).
    """
    whole = np.eye(2)
    for stiffness in (1 + depth, 1 - depth):
        decay, time = damping / 2, np.pi / omega
        root_ = np.sqrt(complex(stiffness - decay**2))
        c, s = np.cos(root_ * time), np.sin(root_ * time) / root_
        piece = np.array([[c + decay * s, s], [-stiffness * s, c - decay * s]])
        whole = np.exp(-decay * time) * piece.real @ whole
    return whole


def first_tongue(depth, damping):
    """Frequencies between which rest is not stable, about twice the natural one: where a multiplier is -1."""

    def left(omega):
        whole = meissner(omega, depth, damping)
        return 1 + np.trace(whole) + np.linalg.det(whole)

    grid = np.linspace(1.5, 2.6, 2001)
    values = [left(omega) for omega in grid]
    at = [i for i in range(grid.size - 1) if values[i] * values[i + 1] < 0]
    return tuple(brentq(left, grid[i], grid[i + 1], xtol=1e-14) for i in at)


@pytest.mark.parametrize("depth", [0.05, 0.2])
def test_the_tongue_without_damping_in_closed_form(depth):
    """cos a cos b - ½ (a/b + b/a) sin a sin b = -1 with a = √(1 + ε) π/ω and b = √(1 - ε) π/ω; width 4 ε/π."""
    ends = first_tongue(depth, 0.0)
    for omega in ends:
        a, b = np.sqrt(1 + depth) * np.pi / omega, np.sqrt(1 - depth) * np.pi / omega
        assert np.cos(a) * np.cos(b) - (a / b + b / a) / 2 * np.sin(a) * np.sin(b) == pytest.approx(-1, abs=1e-12)
    assert np.ptp(ends) == pytest.approx(4 * depth / np.pi, rel=depth**2)


def test_damping_closes_the_tongue_where_mathieus_does():
    """Of the square wave's fundamental 4 ε/π: below 4 ε/π = 4 ζ rest is stable at any frequency, to second order."""
    damping = 0.04
    assert not first_tongue(0.98 * np.pi * damping / 2, damping)
    ends = first_tongue(1.02 * np.pi * damping / 2, damping)
    assert len(ends) == 2 and np.mean(ends) == pytest.approx(2.0, abs=damping**2)


@pytest.mark.parametrize("omega", [1.8, 1.95, 2.0, 2.2])
def test_the_product_of_pieces_is_what_an_ode_solver_finds(omega):
    depth, damping = 0.1, 0.02

    def rate(time, state):
        stiffness = 1 + depth * np.sign(np.sin(omega * time))
        return np.concatenate((state[2:], -damping * state[2:] - stiffness * state[:2]))

    state = np.eye(2).ravel()
    for half in (0, 1):
        ends = (half + 1e-12) * np.pi / omega, (half + 1 - 1e-12) * np.pi / omega
        state = solve_ivp(rate, ends, state, "DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    np.testing.assert_allclose(meissner(omega, depth, damping), state.reshape(2, 2), atol=1e-9)


@pytest.mark.parametrize("depth", [0.05, 0.2])
def test_a_pair_of_teeth_with_two_stiffnesses_loses_its_stability_where_meissners_does(depth, measured):
    """Under a load that keeps its teeth in contact; multipliers of all points, and doublings at the tongue's ends."""
    damping = 0.02
    rig = Rig(
        "teeth", None, (Bushing("1:X", 1.0, 0.0, Grease(0.0, damping), Contact(1.0)),), (Sensor(1, "1:X"),),
        structure=Gears((Inertia(1, 1.0, 1.0),)), loads=(Load("1:RX", torque=0.1),), spin=Spin(1.0),
    )  # fmt: skip
    edges, k = TURN * np.array([0.0, 0.49999, 0.5, 0.99999]), 1 + depth * np.array([[1.0], [1.0], [-1.0], [-1.0]])
    model = cm.Model(rig, TimeLaw(edges, k, np.zeros((4, 1)), period=TURN))
    branch = periodic.follow_unbalance(model, (2.6, 1.5), 21, 2048)
    ends = first_tongue(depth, damping)
    doublings = sorted(TURN * point.frequency for point in branch.special if point.kind == "period doubling")
    off = np.abs(np.array(doublings) / ends - 1).max()
    what = f"harmonic balance, teeth of stiffness 1 ± {depth:g}: ends of the tongue"
    measured.below(what, off, 1e-5, "Meissner 1918")
    for frequency, multipliers in zip(branch.frequency, branch.multipliers):
        known = np.linalg.eigvals(meissner(TURN * frequency, depth, damping))
        np.testing.assert_allclose(np.sort_complex(multipliers), np.sort_complex(known), atol=1e-5)


# A spring with a slider


def jenkins(amplitude, spring, limit):
    """First harmonic of a spring's force that slides beyond a limit, over the displacement's amplitudes (n,).

    Real part (k/π) (φ - sin φ cos φ) with cos φ = 1 - 2 F/(k X), and the area 4 F (X - F/k) of its loop over π X²
    (T. K. Caughey, J. Appl. Mech. 27 (1960) 640).
    """
    yields = limit / spring
    angle = np.arccos(1 - 2 * yields / np.maximum(amplitude, yields))
    lost = 4 * limit * np.maximum(amplitude - yields, 0.0) / (np.pi * amplitude**2)
    return spring / np.pi * (angle - np.sin(angle) * np.cos(angle)) + 1j * lost


def test_the_harmonic_of_a_slider_is_that_of_its_loop():
    """By quadrature over the loop, which the slider repeats from the first reversal on."""
    spring, limit = 3.0, 0.5
    for amplitude in (0.1, 0.2, 1.0):
        angle = TURN * np.arange(2**16) / 2**16
        x, slid, force = amplitude * np.cos(np.tile(angle, 2)), 0.0, []
        for place in x:
            slid = min(max(slid, place - limit / spring), place + limit / spring)
            force.append(spring * (place - slid))
        describing = np.mean(np.array(force[2**16 :]) * np.exp(-1j * angle)) * 2 / amplitude
        assert describing == pytest.approx(complex(jenkins(np.array([amplitude]), spring, limit)[0]), abs=1e-6)


@pytest.mark.parametrize(("spring", "limit"), [(1.0, 0.3), (10.0, 0.6), (0.3, 0.1)])
def test_a_slider_with_one_harmonic(spring, limit, measured):
    """X (k + k_eq - ω² + i (c ω + h)) = F: all points of a branch, that stick and that slide."""
    law = ContactLaw(KelvinVoigt(1.0), MaxwellSlip(springs=(spring,), forces=(limit,)))
    model = cm.Model(one_mass(1.0, 0.05, gap=1e3), law)
    branch = periodic.follow_response(model, 1.0, (0.3 / TURN, 5.0 / TURN), 1, 8192, stability=False)
    assert not branch.ended
    x, omega = branch.displacement[:, 0, 1], TURN * branch.frequency
    slides = np.abs(x) > limit / spring
    assert slides.any()
    force = x * (1 + jenkins(np.abs(x), spring, limit) - omega**2 + 0.05j * omega)
    what = f"harmonic balance, one slider of {spring:g} N/m and {limit:g} N, one harmonic: force"
    measured.below(what, np.abs(force - 1).max(), 1e-6, "closed form, Caughey 1960")


# A round clearance whose shaft moves along a line is a slot


def shaft(shape, **bushing):
    """A pinned shaft whose planes are alike, shaken along z in one or two clearances."""
    given = {"grease": Grease(2e3, 2.0), "contact": Contact(4e4, 4.0), "shape": shape, **bushing}
    bushings = Bushing(0.2, 1e-4, 0.0, **given), Bushing(0.35, 1.5e-4, 0.0, **given)
    pins, steel = (Support(0.0, "pinned"), Support(0.6, "pinned")), Material(2.1e11, 7850.0)
    bent = Shaft((Section(0.6, (0.012, 0.012)),), pins, (Disc(0.45, 0.4),), steel, (6.0, 1e-6), theory="euler")
    sensors = Sensor(1, 0.25), Sensor(2, 0.4)
    return Rig("line", None, bushings, sensors, structure=bent, shaker=Shaker("force", 0.3))


LINES = {
    "linear grease": {},
    "no grease": {"grease": Grease(0.0)},
    "squeeze film": {"grease": Grease(1e3, 2.0, film_height=4e-4)},
    "elastic contact": {"contact": Contact(4e4)},
}
JUMPS, CELLS = 3e-4, 5e-3
"""Relative differences of maps, which draw lines between points of branches: these need not be the same points"""
FORCE, LOW, HIGH = 6.0, 40.0, 90.0


def both(name):
    return [cm.Model(shaft(shape, **LINES[name])) for shape in ("round", None)]


def same(round_, slot, point):
    """All rows of one point."""
    for quantity in ("acceleration", "displacement", "clearance_displacement", "contact_force", "grease_force"):
        one, other = (getattr(each, quantity)[point] for each in (round_, slot))
        if len(one) != len(other):
            np.testing.assert_allclose(one[::2], 0, atol=1e-9 * np.abs(other).max())
            one = one[1::2]
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-6 * max(np.abs(other).max(), 1e-12), err_msg=quantity)


def same_maps(round_, slot, jumps, cells):
    """Maps whose jumps and cells differ by no more than steps between the points of branches make of them."""
    assert slot.rattles.any() and not slot.rattles.all()
    np.testing.assert_array_equal(round_.vibrations, slot.vibrations)
    np.testing.assert_allclose(round_.first_contact, slot.first_contact, rtol=1e-6)
    assert [j[:2] + j[3:] for j in round_.jumps] == [j[:2] + j[3:] for j in slot.jumps]
    np.testing.assert_allclose([j.frequency for j in round_.jumps], [j.frequency for j in slot.jumps], rtol=jumps)
    for quantity in ("contact_share", "penetration", "contact_force", "displacement", "acceleration"):
        known = getattr(slot, quantity)
        # Of 128 samples one at either end of a contact is by chance.
        atol = 2.01 / 128 if quantity == "contact_share" else cells * np.nanmax(np.abs(known))
        np.testing.assert_allclose(getattr(round_, quantity), known, rtol=0, atol=atol, err_msg=quantity)


@pytest.mark.parametrize("name", LINES)
class TestOnALine:
    def test_response_over_frequency(self, name):
        round_, slot = (periodic.follow_response(m, FORCE, (LOW, HIGH), stability=False) for m in both(name))
        for point in (0, -1):
            same(round_, slot, point)
        folds = [[p.frequency for p in each.special if p.kind == "fold"] for each in (round_, slot)]
        assert len(folds[1]) >= 2 and folds[0] == pytest.approx(folds[1], rel=1e-6)

    def test_multipliers(self, name):
        """Those of motions along z are among those of the round clearance's."""
        round_, slot = (periodic.follow_response(m, FORCE, (LOW, LOW + 1)) for m in both(name))
        for point in (0, -1):
            missed = np.abs(round_.multipliers[point] - slot.multipliers[point][:, None]).min(axis=1)
            assert slot.contact_force[point].any() and missed.max() < 1e-6

    def test_response_over_level(self, name):
        at = folded(name)
        round_, slot = (periodic.follow_response_over_level(m, at, (0.5, 3 * FORCE)) for m in both(name))
        for point in (0, -1):
            same(round_, slot, point)
        folds = [[p.level for p in each.special if p.kind == "fold"] for each in (round_, slot)]
        assert folds[1] and folds[0] == pytest.approx(folds[1], rel=1e-6)

    @pytest.mark.slow
    def test_folds(self, name):
        curves = []
        for model in both(name):
            branch = periodic.follow_response(model, FORCE, (LOW, HIGH), stability=False)
            pick = min if name == "squeeze film" else max  # whose other folds come in near pairs
            fold = pick((p for p in branch.special if p.kind == "fold"), key=lambda point: point.frequency)
            curves.append(periodic.follow_folds(branch, fold, 1.3 * FORCE))
        first, second = ((curve.frequency[-1], curve.value[-1]) for curve in curves)
        assert first == pytest.approx(second, rel=1e-6)

    def test_first_contact(self, name):
        frequencies = np.array([30.0, 55.0, 62.0, 80.0, 150.0])
        round_, slot = (periodic.find_first_contact(m, frequencies) for m in both(name))
        np.testing.assert_allclose(round_.value, slot.value, rtol=1e-6)

    def test_backbone(self, name):
        """The mode along z, which is one of two alike of the round clearance."""
        slot = periodic.follow_backbone(both(name)[1], 1, (2e-5, 2e-4))
        for mode in (1, 2):
            round_ = periodic.follow_backbone(both(name)[0], mode, (2e-5, 2e-4))
            for one, other in ((round_.frequency, slot.frequency), (round_.damping, slot.damping)):
                np.testing.assert_allclose(one[[0, -1]], other[[0, -1]], rtol=1e-6)
            along = np.abs(round_.clearance_displacement[-1]).reshape(2, 2, -1).max(axis=(0, 2)).argmax()
            if along == 1:
                same(round_, slot, -1)

    def test_rattle_map(self, name):
        frequencies = np.linspace(LOW, HIGH, 11)
        round_, slot = (periodic.map_rattle(m, (2.0, FORCE), frequencies, n_harmonics=7, workers=1) for m in both(name))
        same_maps(round_, slot, JUMPS, CELLS)


def folded(name):
    """A frequency at which the level folds: between both folds of the branch over frequency."""
    branch = periodic.follow_response(both(name)[1], FORCE, (LOW, HIGH), stability=False)
    return float(np.mean([p.frequency for p in branch.special if p.kind == "fold"]))
