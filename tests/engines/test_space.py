"""The modal engine in space against the planar one, closed forms of a Jeffcott rotor and a shaft at rest."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import clearance_mj as cm
from clearance_mj.engines import Modal, simulate_together, static_equilibrium
from clearance_mj.engines.modal import ModalRun
from clearance_mj.report.energy import draw
from clearance_mj.rig import Bushing, Contact, Friction, Grease, OilFilm, Rig, Sensor, Shaker, Spin, Unbalance
from clearance_mj.structure import Disc, Material, Section, Shaft, Spring, Support
from clearance_mj.structure.attached import Housing, Oscillator

from ..verification.page import Measured
from .alike import GREASED, HISTORIES, assert_alike, with_bushings

TABLE1 = Rig.load(Path(__file__).parents[2] / "models" / "table1_rig.toml")
SPACE = TABLE1.with_shape("round")
NOISE = cm.excitation.random(1.0, 2048.0, band=(5, 220), rms=6.0, seed=3)


@pytest.mark.parametrize("law", [None, GREASED])
def test_a_motion_in_the_plane_is_the_planar_one(law: cm.ContactLaw | None, measured: Measured) -> None:
    plane, space = (cm.simulate(rig, NOISE, law, "modal") for rig in (TABLE1, SPACE))
    assert plane.contact_force is not None and plane.contact_force.any()
    for name in HISTORIES:
        value, known = getattr(space, name), getattr(plane, name)
        value = value if name == "acceleration" else value[1::2]
        what = f"motion in a plane, {'greased' if law else 'nominal law'}: {name.replace('_', ' ')}, largest difference"
        measured.below(what, np.abs(value - known).max() / np.abs(known).max(), 1e-9, "the planar engine")
    assert not space.displacement[::2].any()
    assert_allclose(space.contact_share, plane.contact_share, atol=1e-9)


def test_a_motion_in_the_plane_is_the_planar_one_on_housings_with_springs_and_oscillators() -> None:
    attached = with_bushings(TABLE1, housing=Housing(4e5, 0.12, 4.0))
    attached = attached.replace(
        springs=(Spring(0.5, 300.0, damping=0.5),), oscillators=(Oscillator(0.7, 0.05, 90.0, 0.03, 0.05),)
    )
    plane, space = (cm.simulate(attached.with_shape(shape), NOISE, engine="modal") for shape in (None, "round"))
    assert plane.contact_force is not None and plane.contact_force.any()
    for value, known in ((space.acceleration, plane.acceleration), (space.displacement[1::2], plane.displacement)):
        assert_allclose(value, known, rtol=0, atol=1e-9 * np.abs(known).max())
    assert not space.displacement[::2].any()


@pytest.mark.parametrize("law", [None, GREASED])
def test_a_turned_excitation_gives_the_turned_response(law: cm.ContactLaw | None, measured: Measured) -> None:
    angle = 0.7
    turned = SPACE.replace(shaker=Shaker(direction=(0.0, np.sin(angle), np.cos(angle))))
    straight, directed = (cm.simulate(rig, NOISE, law, "modal") for rig in (SPACE, turned))
    for name in ("displacement", "contact_force", "grease_force"):
        known = np.exp(1j * (np.pi / 2 - angle)) * getattr(straight, name)[1::2]
        places = getattr(directed, name)[::2] + 1j * getattr(directed, name)[1::2]
        what = f"turned excitation, {'greased' if law else 'nominal law'}: {name.replace('_', ' ')}, largest difference"
        measured.below(what, np.abs(places - known).max() / np.abs(known).max(), 1e-9, "the turned response")


def test_probes_may_be_turned() -> None:
    turned = with_bushings(SPACE, probe_angle=np.pi / 2)
    straight, turned = (cm.simulate(rig, NOISE, engine="modal") for rig in (SPACE, turned))
    assert_allclose(turned.displacement[::2], straight.displacement[1::2], atol=1e-15)


def test_a_cantilever_sags_under_its_weight() -> None:
    """w l⁴/8EI at the tip (Roark, table 8.1, case 2a); in both directions that gravity has."""
    beam = dataclasses.replace(TABLE1.beam, clamp=None)
    rig = SPACE.replace(beam=beam, bushings=(), masses=(), gravity=(0.0, 3.0, -9.81), sensors=(Sensor(1, 0.5),))
    tip = beam.mass_per_length * beam.length**4 / (8 * beam.bending_stiffness)
    rest = static_equilibrium(rig, n_modes=16)
    assert_allclose(rest.deflection([beam.length])[0], [3.0 * tip, -9.81 * tip], rtol=1e-6)


def test_a_rig_at_rest_stays_there() -> None:
    rig = SPACE.replace(gravity=(0.0, -4.0, -9.81))
    rest = static_equilibrium(rig)
    assert rest.contact_force.any()
    still = cm.simulate(rig, dataclasses.replace(NOISE, value=np.zeros(2048)), engine="modal")
    scale = np.abs(rest.displacement).max()
    assert_allclose(still.displacement, np.tile(rest.displacement[:, None], 2048), atol=2e-4 * scale)
    # What all bushings and the clamp carry is the weight: the clamp's share is what bending leaves.
    total = rest.contact_force + rest.grease_force
    assert (total.reshape(-1, 2) * (4.0, 9.81) < 0).all()


FREQUENCY, MASS, GAP = 60.0, 3.0, 1e-4  # rad/s, kg, m
STIFFNESS = MASS * FREQUENCY**2
LIGHT = Modal(modes=1, resolution=3.0)


def jeffcott(damping: float = 0.1, contact: float = 20.0, **changes: object) -> Rig:
    """m = k = δ = 1 in units of mass, frequency and gap; a light shaft with its disc in the bushing."""
    diameter = (64 * STIFFNESS / (48 * 2.1e11 * np.pi)) ** 0.25
    shaft = Shaft(
        (Section(1.0, diameter),), tuple(Support(x, "pinned") for x in (0.0, 1.0)), (Disc(0.5, MASS),),
        Material(2.1e11, 1e-3), (damping * FREQUENCY, 0.0), theory="euler",
    )  # fmt: skip
    bushing = Bushing(0.5, GAP, 0.0, Grease(0.0), Contact(contact * STIFFNESS), shape="round")
    rig = Rig("jeffcott", None, (bushing,), (Sensor(1, 0.5),), structure=shaft, shaker=Shaker("force", 0.5))
    return rig.replace(**changes)


def rubbing(rig: Rig, friction: float, **of_friction: float) -> Rig:
    """The same with friction."""
    return with_bushings(rig, friction=Friction(friction, **of_friction))


def begun(rig: Rig, engine: Modal) -> ModalRun:
    law = cm.clearance.nominal_law(rig)
    run = engine.start(rig, law, "force", engine.largest_step(rig, law))
    assert isinstance(run, ModalRun)
    return run


def started(rig: Rig, place: complex, speed: complex, engine: Modal = LIGHT) -> ModalRun:
    """A run that begins with the bushings' middles y + i z off their rest, m, and with a speed, m/s."""
    run, n = begun(rig, engine), len(rig.bushings)
    inverse = np.linalg.pinv(run.model.at_bushings)
    run.motion.q[:] += inverse @ np.tile([place.real, place.imag], n)
    run.motion.v[:] += inverse @ np.tile([speed.real, speed.imag], n)
    run.motion.q_before[:] = run.motion.q
    return run


def path(run: ModalRun, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Displacements y + i z of the first bushing over steps, m, and whether it touches."""
    path = run.advance(np.zeros(int(seconds / run.step)))
    return path[:, 1] + 1j * path[:, 2], path[:, 1 + 6 * len(run.rig.bushings)]


def turning(rig: Rig, speed: float, eccentricity: float = 0.2) -> Rig:
    """The rig under unbalance at a speed, in units of the shaft's frequency."""
    return rig.replace(spin=Spin(speed * FREQUENCY), unbalances=(Unbalance(0.5, MASS * eccentricity * GAP),))


@pytest.mark.parametrize(("speed", "touches"), [(0.9240, False), (0.9264, True), (1.1020, True), (1.1044, False)])
def test_first_contact(speed: float, touches: bool) -> None:
    """The free circle e ω²/(1 - ω² + i c ω) reaches the gap between ω = 0.9252 and 1.1032."""
    circle = 0.2 * speed**2 / (1 - speed**2 + 0.1j * speed) * GAP
    run = started(turning(jeffcott(), speed), circle, 1j * speed * FREQUENCY * circle)
    assert path(run, 12 * 2 * np.pi / (speed * FREQUENCY))[1].any() == touches


@pytest.mark.parametrize(("friction", "radius"), [(0.0, 1.008635), (0.01, None)])
def test_the_radius_of_a_synchronous_rub(friction: float, radius: float | None, measured: Measured) -> None:
    """[(k + k_c - mω²) r - k_c δ]² + [(cω + μ k_c) r - μ k_c δ]² = (m e ω²)²; at ω = 1 and μ = 0, r = 1.008635."""
    r = max(np.roots([20**2 + (0.1 + 20 * friction) ** 2, -2 * (400 + (0.1 + 20 * friction) * 20 * friction),
                      400 + 400 * friction**2 - 0.04]).real)  # fmt: skip
    assert radius is None or abs(r - radius) < 1e-6
    force = (20 * r - 20) + 1j * ((0.1 + 20 * friction) * r - 20 * friction)
    circle = r * GAP * 0.2 / force / abs(0.2 / force)
    run = started(rubbing(turning(jeffcott(), 1.0), friction), circle, 1j * FREQUENCY * circle)
    way, touches = path(run, 40 * 2 * np.pi / FREQUENCY)
    settled = np.abs(way[-way.size // 20 :])
    assert touches.all() and np.ptp(settled) < 1e-5 * GAP
    measured.equal(f"synchronous rub, μ = {friction:g}: radius in gaps", settled.mean() / GAP, r, "circle", rel=2e-6)


@pytest.mark.parametrize(("faster", "grows"), [(1.03, True), (0.97, False)])
def test_dry_whirl(faster: float, grows: bool) -> None:
    """ω* = [c/μ + √((c/μ)² + 4 m k)]/2m = 1.10499, r* = δ/(1 - c ω*/(μ k_c)) = 1.01117, backward."""
    whirl, radius = 1.10499, 1.01117 * GAP
    assert_allclose(whirl, (0.2 + np.sqrt(0.04 + 4)) / 2, rtol=1e-5)
    rig = rubbing(jeffcott(0.02), 0.1).replace(spin=Spin(3.0 * FREQUENCY))  # its surface slides fast
    way, _ = path(started(rig, radius, -1j * faster * whirl * FREQUENCY * radius), 20 * 2 * np.pi / FREQUENCY)
    assert (np.abs(way[-way.size // 10 :]).max() > 1.005 * radius) == grows


@pytest.mark.parametrize(("friction", "rolls"), [(0.1, True), (0.04, False)])
def test_a_shaft_rolls_in_its_bushing(friction: float, rolls: bool, measured: Measured) -> None:
    """With ω r = Ω R = 50 and m ω² = k + k_c (1 - δ/r): ω = 4.387, r = 11.40, backward; c = 0.2 needs μ > 0.048."""
    rig = rubbing(jeffcott(0.2), friction, damping=50.0)
    rig = rig.replace(spin=Spin(50 * FREQUENCY * GAP / rig.linear.shafts[0].half_depth(0.5)))
    whirl, radius = 4.387 * FREQUENCY, 11.40 * GAP
    run = started(rig, radius, -1j * whirl * radius)
    way, _ = path(run, 20 * 2 * np.pi / whirl)
    last = way[-way.size // 5 :]
    turned = np.unwrap(np.angle(last))
    rate = -(turned[-1] - turned[0]) / ((last.size - 1) * run.step)
    if rolls:
        closed = "ω r = Ω R, m ω² = k + k_c (1 - δ/r)"
        measured.equal("rolling whirl: ω", rate / FREQUENCY, 4.387, closed, rel=1e-3)
        measured.equal("rolling whirl: radius in gaps", np.abs(last).mean() / GAP, 11.40, closed, rel=1e-3)
    else:
        assert abs(rate / whirl - 1) > 1e-3 or abs(np.abs(last).mean() / radius - 1) > 1e-3


def resting(**changes: object) -> Rig:
    """A stiff roller in two bushings on springs that hardly hold it, under gravity."""
    shaft = Shaft((Section(0.2, 0.03),), (), (), Material(2.1e11, 7850.0), theory="euler")
    bushings = tuple(Bushing(x, GAP, 0.0, Grease(0.0), Contact(2e7, 2e3), shape="round") for x in (0.02, 0.18))
    more = {"gravity": (0.0, 0.0, -9.81), "shaker": Shaker("force", 0.1)} | changes
    return Rig("roller", None, bushings, (Sensor(1, 0.1),), structure=shaft).replace(**more)


def test_a_shaft_swings_in_its_bushings(measured: Measured) -> None:
    """It slides with √(g/δ), and rolls with √(2g/3δ), δ 0.1 mm: 49.8 and 40.7 Hz."""
    slides = resting()
    mass, surface = slides.total_mass, 0.015
    rolls = rubbing(resting(spin=Spin(0.0, inertia=mass * surface**2 / 2)), 0.3, stiffness=2e7, damping=2e3)
    sunk = mass * 9.81 / 4e7
    for rig, known in ((slides, np.sqrt(9.81 / GAP)), (rolls, np.sqrt(2 * 9.81 / (3 * GAP)))):
        assert_allclose(static_equilibrium(rig).displacement, 2 * [0.0, -GAP - sunk], rtol=1e-6, atol=1e-9)
        run = started(rig, 0.0, 1e-4 + 0j, Modal(modes=4))
        way, touches = path(run, 0.25)
        smooth = np.convolve(way.real, np.full(801, 1 / 801), "valid")  # without the ringing of the shaft itself
        period = np.diff(np.flatnonzero(np.diff(np.sign(smooth)) > 0)).mean() * run.step
        assert touches.all()
        # The circle that its middle swings on is wider by what the contact gives.
        frequency, known = 1 / period, known / (2 * np.pi) * np.sqrt(GAP / (GAP + sunk))
        how = "slides, √(g/δ)" if rig is slides else "rolls, √(2g/3δ)"
        measured.equal(f"shaft that rests in a bushing and {how} (Hz)", frequency, known, "closed form", rel=3e-3)


def test_damping_that_turns_with_the_shaft() -> None:
    """A shaft whirls by itself above Ω = ω (1 + c_e/c_i), with c_i = η2 k and c_e = η1 m."""
    outer, inner = 0.02 * FREQUENCY, 0.01 / FREQUENCY
    rig = jeffcott().replace(bushings=())
    shaft = dataclasses.replace(rig.structure, rayleigh=(outer, inner))
    threshold = FREQUENCY * (1 + 0.02 / 0.01)
    for ratio, grows in ((0.97, False), (1.03, True)):
        run = begun(rig.replace(structure=shaft, spin=Spin(ratio * threshold)), LIGHT)
        run.motion.q[[0, 2]] = 1e-5
        run.advance(np.zeros(int(2.0 / run.step)))
        first = np.abs(run.motion.q[0] + 1j * run.motion.q[2])
        run.advance(np.zeros(int(6 * np.pi / FREQUENCY / run.step)))
        assert (np.abs(run.motion.q[0] + 1j * run.motion.q[2]) > first) == grows


def test_gyroscopic_moments_keep_the_energy(measured: Measured) -> None:
    """An overhung disc that turns and nothing damps: its energy after a thousand periods is that of the start."""
    shaft = Shaft((Section(0.4, 0.02),), (Support(0.0, "clamped"),), (Disc(0.4, 4.0, 0.02),), Material(2.1e11, 7850.0))
    given = {"structure": shaft, "spin": Spin(800.0), "shaker": Shaker("force", 0.4)}
    run = begun(Rig("overhung", None, (), (Sensor(1, 0.4),), **given), Modal(modes=3))
    run.motion.v[0] = 0.1

    def energy() -> float:
        return float(1 / run.linear.inverse_mass @ (run.motion.v**2 + run.model.omega**2 * run.motion.q**2))

    start = energy()
    run.advance(np.zeros(int(1000 * 2 * np.pi / run.model.omega[0] / run.step)))
    measured.below("gyroscopic moments, 1000 periods: change of energy", abs(energy() / start - 1), 1e-6, "no work")


@pytest.mark.parametrize(("ratio", "grows"), [(0.97, False), (1.03, True)])
def test_a_journal_whirls_in_oil(ratio: float, grows: bool) -> None:
    """A rigid rotor in two short bearings is stable at ε = 0.5 up to Ω √(C/g) = 2.54 (2.539, Childs 1993)."""
    clearance, g = 5e-5, 9.81
    speed = ratio * 2.54 * np.sqrt(g / clearance)
    base = resting(bushings=())
    mass, surface, length = base.total_mass, 0.015, 0.01
    # Ocvirk: S (L/D)² = (1-ε²)²/(π ε √(π² (1-ε²) + 16 ε²)), S = μ N L D/W (R/C)²
    number = (1 - 0.25) ** 2 / (np.pi * 0.5 * np.sqrt(np.pi**2 * 0.75 + 16 * 0.25)) / (length / (2 * surface)) ** 2
    per_viscosity = speed / (2 * np.pi) * length * 2 * surface / (mass * g / 2) * (surface / clearance) ** 2
    given = {"grease": Grease(0.0), "contact": Contact(1e7), "film": OilFilm(number / per_viscosity), "shape": "round"}
    rig = base.replace(bushings=tuple(Bushing(x, clearance, length, **given) for x in (0.02, 0.18)), spin=Spin(speed))
    rest = static_equilibrium(rig)
    assert_allclose(np.hypot(*rest.displacement[:2]), 0.5 * clearance, rtol=1e-6)
    way, _ = path(started(rig, 0.0, 1e-5 + 0j, Modal(modes=2)), 60 * 2 * np.pi / speed)
    off = np.abs(way - complex(*rest.displacement[:2]))
    early, late = off[off.size // 6 : off.size // 3].max(), off[-off.size // 6 :].max()
    assert (late > early) == grows


def test_energies_add_up(measured: Measured) -> None:
    turning_up = {"spin": Spin(300.0, rate=50.0), "unbalances": (Unbalance(0.5, 1e-4),)}
    rig = rubbing(SPACE, 0.2, damping=0.5).replace(gravity=(0.0, -5.0, -9.81), **turning_up)
    balance = cm.energy_balance(rig, NOISE, GREASED, engine="modal")
    measured.below("energy balance with friction, spin, hysteresis, weight: residual", balance.imbalance, 1e-3, "0")
    for part in (balance.friction, balance.contact_loss, balance.hysteresis):
        assert part is not None and part[..., -1].any() and (np.diff(part, axis=-1) > -1e-9 * part.max()).all()
    assert balance.drive is not None and balance.unbalance is not None and balance.weight is not None
    assert balance.drive[-1] > 0 and balance.impacts
    assert re.search(r"contact \d+ %, friction \d+ %", draw(balance).caption)


def test_friction_slows_a_shaft_that_coasts() -> None:
    """What friction takes from the turning, ½ I Ω², is what it and all else lose."""
    rig = rubbing(resting(spin=Spin(60.0, inertia=2e-4)), 0.1)
    quiet = cm.excitation.random(0.4, 4096.0, band=(5, 200), rms=1e-6, seed=0, kind="force")
    response = cm.simulate(rig, quiet, engine="modal")
    assert response.spin is not None
    # μ m g R/I rad/s² while it slides; the rest about which it slides changes with nothing.
    slowing = 0.1 * rig.total_mass * 9.81 * 0.015 / 2e-4 * np.cos(np.arctan(0.1))
    assert_allclose(response.spin[0] - response.spin[800], slowing * 800 / 4096.0, rtol=1e-3)


def test_rigs_side_by_side_are_each_what_they_are_alone() -> None:
    """In lanes, the last of which repeats: with impacts, friction, weight, spin and probes of their own each."""
    rigs = []
    for i in range(3):
        turned = with_bushings(SPACE, probe_angle=i / 10, friction=Friction(i / 10))
        rubs = tuple(dataclasses.replace(b, gap=b.gap * (1 + i / 20)) for b in turned.bushings)
        turns = {"spin": Spin(100.0 + 50 * i), "unbalances": (Unbalance(0.5, 1e-5),), "gravity": (0.0, 0.0, -9.81)}
        rigs.append(SPACE.replace(bushings=rubs, **turns))
    rigs.append(rigs[0].replace(spin=Spin(60.0, rate=20.0)))  # gyroscopic moments that change: on its own
    laws = [cm.clearance.nominal_law(rigs[0])] * 2 + [GREASED] * 2
    for rig, law, together in zip(rigs, laws, simulate_together(list(zip(rigs, laws)), NOISE)):
        alone = cm.simulate(rig, NOISE, law, "modal")
        assert together.contact_share.any()
        assert_alike(together, alone, 1e-9, (*HISTORIES, "contact_share", "spin"))
