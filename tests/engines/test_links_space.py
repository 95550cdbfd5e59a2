"""The links engine in space beside the planar one, the modal one and closed forms; its MuJoCo model."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Literal

import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose

import clearance_mj as cm
from clearance_mj import physical
from clearance_mj.clearance import nominal_law
from clearance_mj.engines import Links, build_links
from clearance_mj.engines.linkage import linkage
from clearance_mj.engines.links_run import LinksRun
from clearance_mj.linear import linear_model
from clearance_mj.physical.rows import softness_of
from clearance_mj.rig import Bushing, Contact, Friction, Grease, OilFilm, Rig, Sensor, Shaker, Spin, Unbalance
from clearance_mj.rotors import campbell
from clearance_mj.structure import Disc, Material, Section, Shaft, Spring, Support

from ..physical.stepping import mass_matrix
from .alike import GREASED, with_bushings
from .tube import tube_and_shaft

TABLE1 = Rig.load(Path(__file__).parents[2] / "models" / "table1_rig.toml")
SPACE = TABLE1.with_shape("round")
STEEL = Material(2.1e11, 7850.0)
FREQUENCY = 2048.0


def noise(level: float, seconds: float = 0.5, kind: str = "base") -> cm.Excitation:
    return cm.excitation.random(seconds, FREQUENCY, band=(5, 220), rms=level, seed=3, kind=kind)


def still(seconds: float, kind: str = "base") -> cm.Excitation:
    return cm.Excitation(np.zeros(int(seconds * FREQUENCY)), FREQUENCY, kind)


def close(computed: np.ndarray | None, reference: np.ndarray | None, tolerance: float) -> None:
    """Two histories differ by less than a share of the largest value of the second one."""
    assert computed is not None and reference is not None
    assert_allclose(computed, reference, rtol=0, atol=tolerance * np.abs(reference).max())


def started(rig: Rig, links: int = 16) -> LinksRun:
    """A run at its largest step."""
    engine, law = Links(links=links), nominal_law(rig)
    run = engine.start(rig, law, rig.shaker.kind, engine.largest_step(rig, law))
    assert isinstance(run, LinksRun)
    return run


@pytest.mark.parametrize(("level", "law", "tolerance"), [(0.05, None, 1e-10), (3.0, None, 1e-4), (3.0, GREASED, 1e-3)])
def test_a_motion_in_the_plane_is_the_planar_one(level: float, law: cm.ContactLaw | None, tolerance: float) -> None:
    """To rounding in the gap; impacts magnify what distance and height of a point on the links differ by."""
    plane, space = (cm.simulate(rig, noise(level), law, "links") for rig in (TABLE1, SPACE))
    assert plane.contact_force is not None and plane.contact_force.any() == (level > 1)
    close(space.acceleration, plane.acceleration, tolerance)
    for name in ("displacement", "contact_force", "grease_force"):
        computed, reference = getattr(space, name), getattr(plane, name)
        close(computed[1::2], reference, tolerance)
        assert not computed[::2].any()


def test_a_turned_excitation_gives_the_turned_response() -> None:
    across, along = np.sin(0.7), np.cos(0.7)
    turned = SPACE.replace(shaker=Shaker(direction=(0.0, across, along)))
    straight, response = (cm.simulate(rig, noise(3.0, 0.25), GREASED, "links") for rig in (SPACE, turned))
    for name in ("displacement", "contact_force", "grease_force"):
        reference = getattr(straight, name)[1::2]
        close(getattr(response, name)[::2] / across, reference, 2e-3)
        close(getattr(response, name)[1::2] / along, reference, 2e-3)


def test_frequency_responses_in_the_gap_are_those_of_modes() -> None:
    """As far from the modal engine's as in the plane, which is 0.1 dB (root mean square) from 5 to 200 Hz."""
    shock, band = np.zeros(2048), slice(20, 800)
    shock[1] = 1.0
    space = SPACE.replace(shaker=Shaker(direction=(0.0, 1.0, 0.0)), sensors=_along_y(SPACE))

    def differences(rig: Rig) -> np.ndarray:
        """(n_sensors, n_lines) dB."""
        both = [cm.simulate(rig, cm.Excitation(shock, FREQUENCY), engine=e).acceleration for e in ("links", "modal")]
        links, modal = np.abs(np.fft.rfft(both, 8192))[..., band]
        return np.asarray(20 * np.log10(links / modal))

    error = differences(space)
    assert_allclose(error, differences(TABLE1), rtol=0, atol=1e-6)
    assert np.sqrt(np.mean(error**2)) < 0.1


def _along_y(rig: Rig) -> tuple[Sensor, ...]:
    return tuple(dataclasses.replace(s, direction=(0.0, 1.0, 0.0)) for s in rig.sensors)


def rubbing(rig: Rig, friction: Friction) -> Rig:
    return with_bushings(rig, friction=friction)


RESTING = rubbing(SPACE, Friction(0.1)).replace(gravity=(0.0, -3.0, -9.81))


def rotor(**changes: object) -> Rig:
    """A disc on an elastic shaft, whose supports differ in y and z, in one bushing."""
    supports = (Support(0.0, "pinned"), Support(0.3, "elastic", 2e5, translation_y=1e5))
    shaft = Shaft((Section(0.3, 0.02),), supports, (Disc(0.2, 2.0, 0.002),), STEEL, (1.0, 0.0), theory="euler")
    bushing = Bushing(0.15, 1e-4, 0.02, Grease(0.0), Contact(1e5, 50.0), shape="round")
    sensors = (Sensor(1, 0.2, direction=(0.0, 1.0, 0.0)), Sensor(2, 0.2))
    return Rig("rotor", None, (bushing,), sensors, **{"structure": shaft, "gravity": (0.0, 0.0, -9.81)} | changes)


@pytest.mark.parametrize(
    "rig",
    [
        rotor(spin=Spin(300.0), unbalances=(Unbalance(0.2, 2e-5),)),
        rubbing(rotor(spin=Spin(300.0), unbalances=(Unbalance(0.2, 2e-4, 0.3),)), Friction(0.15, damping=20.0)),
        rubbing(rotor(spin=Spin(300.0, rate=300.0, until=330.0)), Friction(0.2)).replace(
            unbalances=(Unbalance(0.2, 1e-4),)
        ),
        rubbing(rotor(spin=Spin(300.0, inertia=2e-3), unbalances=(Unbalance(0.2, 2e-4),)), Friction(0.15)),
    ],
    ids=["in the gap", "rub", "ramp", "coasting"],
)
def test_a_shaft_that_turns_moves_as_its_modes_do(rig: Rig) -> None:
    """Unbalance, friction and gyroscopic moments beside the modal engine, whose scheme is another one."""
    links, modal = (cm.simulate(rig, still(0.15), engine=e) for e in ("links", "modal"))
    for name in ("displacement", "contact_force", "acceleration"):
        close(getattr(links, name), getattr(modal, name), 5e-3)
    close(links.spin, modal.spin, 1e-5)


@pytest.mark.parametrize("width", ["short", "finite"])
def test_an_oil_film_carries_as_it_does_with_modes(width: Literal["short", "finite"]) -> None:
    rig = rotor(spin=Spin(300.0), unbalances=(Unbalance(0.2, 1e-4),))
    rig = with_bushings(rig, film=OilFilm(0.02, asperities=1e-6, width=width))
    links, modal = (cm.simulate(rig, still(0.15), engine=e) for e in ("links", "modal"))
    for name in ("displacement", "grease_force", "acceleration"):
        close(getattr(links, name), getattr(modal, name), 1e-3)


def test_in_contact_responses_are_those_of_modes() -> None:
    """Rattle under gravity with friction: levels of every sensor within 2 %, time in contact within 1 %."""
    links, modal = (cm.simulate(RESTING, noise(3.0, 2.0), engine=e) for e in ("links", "modal"))
    assert_allclose(*[np.sqrt(np.mean(r.acceleration**2, axis=1)) for r in (links, modal)], rtol=0.02)
    assert_allclose(links.contact_share, modal.contact_share, atol=0.01)
    assert modal.contact_share is not None and modal.contact_share.max() > 0.5


IN_A_TUBE = tube_and_shaft(shape="round")


def of_rectangles(*supports: Support) -> Rig:
    """A tapered rectangle, whose hinges along y and z are at places of their own."""
    height = (0.015, 0.015)
    sections = Section(0.3, width=(0.01, 0.01), height=height), Section(0.3, width=(0.01, 0.006), height=height)
    shaft = Shaft(sections, supports, (), STEEL, (0.5, 1e-5), theory="euler")
    bushing = Bushing(0.4, 1e-4, 0.02, Grease(500.0, 3.0), Contact(5e4, 5.0), offset_y=2e-5, shape="round")
    sensors = (Sensor(1, 0.25, direction=(0.0, 1.0, 0.0)), Sensor(2, 0.55, direction=(0.0, 1.0, 1.0)))
    return Rig("rectangles", None, (bushing,), sensors, structure=shaft, shaker=Shaker(direction=(0.0, 1.0, 2.0)))


ELASTIC = (
    Support(0.0, "elastic", 1e6, 1e3, translation_y=5e5, translation_damping=5.0),
    Support(0.5, "elastic", 2e5, 0.0, 20.0, translation_y=1e5),
)


@pytest.mark.parametrize(
    ("rig", "level"),
    [(IN_A_TUBE, 3.0), (of_rectangles(Support(0.0, "clamped")), 1.0), (of_rectangles(*ELASTIC), 2.0)],
    ids=["tube", "tapered rectangle", "elastic supports"],
)
def test_structures_of_all_kinds_move_as_their_modes_do(rig: Rig, level: float) -> None:
    links, modal = (cm.simulate(rig, noise(level, 0.25), engine=e) for e in ("links", "modal"))
    close(links.displacement, modal.displacement, 0.02)
    close(links.grease_force, modal.grease_force, 0.02)


def test_a_clearance_between_two_shafts_touches_as_in_the_plane() -> None:
    rigs = IN_A_TUBE.with_shape(None), IN_A_TUBE
    plane, space = (cm.simulate(rig, noise(12.0, 0.25), engine="links") for rig in rigs)
    assert plane.contact_force is not None and space.contact_force is not None
    assert np.abs(plane.contact_force).max() > 5.0
    close(space.contact_force[1::2], plane.contact_force, 0.05)


def test_a_force_pushes_in_its_direction() -> None:
    rig = of_rectangles(*ELASTIC).replace(shaker=Shaker("force", 0.3, (0.0, 1.0, 2.0)))
    links, modal = (cm.simulate(rig, noise(2.0, 0.25, "force"), engine=e) for e in ("links", "modal"))
    close(links.displacement, modal.displacement, 0.02)


@pytest.mark.parametrize(
    "rig", [RESTING, RESTING.replace(bushings=()), rotor(spin=Spin(300.0))], ids=["in contact", "free", "turning"]
)
def test_a_rig_at_rest_stays_there(rig: Rig) -> None:
    """It begins where it rests in MuJoCo's own geometry: nothing accelerates."""
    run = started(rig)
    motion, before = run.advance(np.zeros(4000)), run.before()
    n = len(rig.sensors)
    assert np.abs(motion[:, :n]).max() < 1e-4 * 9.81
    assert_allclose(motion[:, n:], np.tile(before[n:], (4000, 1)), rtol=0, atol=2e-4 * max(1e-9, np.abs(before).max()))


def test_a_cantilever_sags_under_its_weight() -> None:
    """w l⁴/8EI at the tip (Roark, table 8.1, case 2a), along y and z; slopes of 1e-2 change it by some 1e-4."""
    beam = TABLE1.beam
    assert beam is not None
    rig = SPACE.replace(bushings=(), masses=(), gravity=(0.0, 3.0, -9.81), sensors=(Sensor(1, 0.5),))
    tip = beam.mass_per_length * beam.length**4 / (8 * beam.bending_stiffness)
    assert_allclose(started(rig).rest.deflection([beam.length])[0], [3.0 * tip, -9.81 * tip], rtol=2e-3)


def roller(**changes: object) -> Rig:
    """A stiff shaft that nothing but two bushings holds, under gravity."""
    shaft = Shaft((Section(0.2, 0.03),), (), (), STEEL, theory="euler")
    bushings = tuple(Bushing(x, 1e-4, 0.0, Grease(0.0), Contact(2e6, 1e3), shape="round") for x in (0.04, 0.16))
    more = {"gravity": (0.0, 0.0, -9.81), "shaker": Shaker("force", 0.1)} | changes
    return Rig("roller", None, bushings, (Sensor(1, 0.1),), structure=shaft, **more)


@pytest.mark.parametrize(
    ("friction", "square"), [(None, 9.81 / 1e-4), (Friction(0.3, 2e6, 1e3), 2 * 9.81 / 3e-4)], ids=["slides", "rolls"]
)
def test_a_shaft_swings_in_its_bushings(friction: Friction | None, square: float) -> None:
    """It slides with √(g/δ), and rolls with √(2g/3δ), δ 0.1 mm: 49.8 and 40.7 Hz."""
    rig = roller()
    mass = rig.total_mass
    assert mass is not None
    if friction:
        rig = rubbing(rig, friction).replace(spin=Spin(0.0, inertia=mass * 0.015**2 / 2))
    run = started(rig, 3)
    run.data.qvel[run.maps.order[0]] = 1e-4  # slides along y
    way = run.advance(np.zeros(int(0.12 / run.step)))[:, 1]
    size = int(1e-3 / run.step)
    smooth = np.convolve(way, np.full(size, 1 / size), "valid")  # without the ringing of the shaft itself
    period = np.diff(np.flatnonzero(np.diff(np.sign(smooth)) > 0)).mean() * run.step
    sunk = mass * 9.81 / 4e6  # the circle that the shaft's middle swings on is wider by what the contact gives
    assert_allclose(2 * np.pi / period, np.sqrt(square * 1e-4 / (1e-4 + sunk)), rtol=5e-3)


def test_friction_slows_a_shaft_that_coasts() -> None:
    """By μ m g R/I cos(arctan μ) while it slides in the angle of friction."""
    rig = rubbing(roller(spin=Spin(60.0, inertia=2e-4)), Friction(0.1))
    mass = rig.total_mass
    assert mass is not None
    run = started(rig, 3)
    spin = run.advance(np.zeros(4000))[:, -1]
    slowing = 0.1 * mass * 9.81 * 0.015 / 2e-4 * np.cos(np.arctan(0.1))
    assert_allclose((spin[0] - spin[-1]) / (3999 * run.step), slowing, rtol=1e-3)


def overhung(spin: float) -> Rig:
    shaft = Shaft((Section(0.3, 0.02),), (Support(0.0, "clamped"),), (Disc(0.3, 2.0, 0.02),), STEEL, theory="euler")
    sensors = (Sensor(1, 0.3, direction=(0.0, 1.0, 0.0)), Sensor(2, 0.3))
    return Rig("overhung", None, (), sensors, structure=shaft, spin=Spin(spin))


@pytest.mark.parametrize("spin", [900.0, *(pytest.param(s, marks=pytest.mark.slow) for s in (200.0, 3000.0))])
def test_whirl_of_an_overhung_disc(spin: float) -> None:
    """Free vibration whirls forward and backward at the frequencies of the Campbell diagram, within 0.1 %."""
    rig = overhung(spin)
    run = started(rig, 8)
    run.data.qvel[run.maps.order] = 1e-3 * np.random.default_rng(0).standard_normal(run.model.nv)
    rows = run.advance(np.zeros(int(2.0 / run.step)))
    motion = (rows[:, 0] + 1j * rows[:, 1]) * np.hanning(len(rows))
    diagram = campbell(rig, [spin], 4)
    for frequency, sense in zip(diagram.frequency[:, 0], diagram.sense[:, 0]):
        near = np.sign(sense) * frequency * np.linspace(0.97, 1.03, 601)
        time = np.arange(len(rows)) * run.step
        lines = np.abs([motion[::8] @ np.exp(-2j * np.pi * f * time[::8]) for f in near])
        assert 0 < lines.argmax() < 600
        assert_allclose(abs(near[lines.argmax()]), frequency, rtol=1e-3)


def test_gyroscopic_moments_do_no_work() -> None:
    """The scheme's own energy, ½ v M v + ½ q K q of the places before and after, stays over 300 periods."""
    run = started(overhung(900.0), 4)
    order, stiffness = run.maps.order, run.plant.whole.whole_stiffness
    run.data.qvel[order] = 1e-2 * np.random.default_rng(0).standard_normal(run.model.nv)

    def energy() -> float:
        before = run.data.qpos[order].copy()
        run.advance(np.zeros(1))
        mass = mass_matrix(run.model, run.data)
        speed, after = run.data.qvel[order], run.data.qpos[order]
        return float(speed @ mass[np.ix_(order, order)] @ speed + before @ stiffness @ after) / 2

    start = energy()
    run.advance(np.zeros(int(300 / 19.57 / run.step)))
    assert_allclose(energy(), start, rtol=1e-5)


def test_the_model_in_a_file_has_the_datasheet_softness_and_both_planes() -> None:
    """Two hinges a joint, round tubes, an annular clearance at each end of a bushing; stable in a viewer."""
    model = mujoco.MjModel.from_xml_string(build_links(SPACE.replace(gravity=(0.0, 0.0, -9.81))).to_xml())
    assert (model.nv, model.ntendon, model.npair) == (32, 4, 0)
    assert physical.check(model) == ()
    assert_allclose([softness_of(model, "tendon", i) for i in range(4)], [(3.9e3, 2.0)] * 4, rtol=1e-5)
    assert_allclose(model.tendon_range, [[0.0, 3e-4]] * 4)
    data = mujoco.MjData(model)
    mass = mass_matrix(model, data)
    omega = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(mass, np.diag(model.jnt_stiffness))).real)[:6])
    modes = linear_model(SPACE.replace(bushings=(), gravity=(0.0, 1.0, 0.0)), 8)
    assert_allclose(omega, np.sort(modes.omega)[:6], rtol=3e-3)
    staves = [model.geom(f"bushing0_{stave}") for stave in range(24)]
    inner = [np.hypot(*stave.pos[1:]) - stave.size[1] for stave in staves]
    assert TABLE1.beam is not None and TABLE1.beam.diameter is not None
    assert_allclose(inner, TABLE1.beam.diameter / 2 + 3e-4, rtol=1e-4)
    mujoco.mj_step(model, data, nstep=round(0.5 / model.opt.timestep))
    assert not data.warning.number.any() and 3e-4 < np.max(data.ten_length) < 3e-3


def test_a_saved_model_of_two_shafts_keeps_its_softness() -> None:
    model = mujoco.MjModel.from_xml_string(build_links(IN_A_TUBE, 12).to_xml())
    clearances = [i for i in range(model.ntendon) if model.tendon(i).name.startswith("clearance")]
    assert_allclose([softness_of(model, "tendon", i) for i in clearances], [(2.5e4, 2.5)] * 2, rtol=1e-4)


DEEP = Shaft((Section(0.2, 0.05),), (Support(0.0, "clamped"),), (), STEEL)
THICK = Rig("thick", None, (), (Sensor(1, 0.2),), structure=DEEP, gravity=(0.0, 1.0, 0.0))


def test_refusals() -> None:
    """One line: what, where, what would be right."""
    sticky = cm.ContactLaw(cm.clearance.KelvinVoigt(2e4, 30.0, adhesion=True))
    axial = SPACE.replace(shaker=Shaker(direction=(1.0, 0.0, 0.0)))
    for rig, law, engine, words in (
        (SPACE, sticky, "links", "links engine cannot simulate adhesion.*use modal"),
        (THICK, None, "links", "'thick': links has no shear flexibility; use modal"),
        (axial, None, "links", "moves no mass of the structure; give another"),
    ):
        with pytest.raises(cm.ClearanceError, match=words) as error:
            cm.simulate(rig, still(0.1), law, engine)
        assert "\n" not in str(error.value)


def test_what_is_no_chain_of_links_is_simulated_by_its_modes() -> None:
    """Unless an engine is asked for: a deep shaft with shear, in the plane and in space, and what hangs on springs."""
    for rig, engine in ((THICK, "modal"), (TABLE1, "links"), (SPACE, "modal")):
        assert cm.simulate(rig, still(0.1)).provenance["engine"] == engine
        assert cm.Model(rig).simulate(still(0.1)).provenance["engine"] == engine


def test_a_chain_is_made_once() -> None:
    """What takes longest of a short simulation by links."""
    assert linkage(TABLE1, 20) is linkage(TABLE1, 20)


def test_a_spring_beside_a_shaft_acts_in_space_as_in_the_plane() -> None:
    """Stiff enough to raise the first frequency, and without it another motion."""
    with_spring = TABLE1.replace(springs=(Spring(0.5, 3e4, damping=5.0),))
    plane, space = (cm.simulate(with_spring.with_shape(shape), noise(0.5), engine="links") for shape in (None, "round"))
    close(space.acceleration, plane.acceleration, 1e-6)
    without = cm.simulate(SPACE, noise(0.5), engine="links")
    assert np.std(without.acceleration - space.acceleration) > 0.1 * np.std(space.acceleration)
