"""The hinge chains of shafts of every kind, against high-order beam elements and the compiled modal engine.

The elements are checked against closed forms in tests/structure/test_shaft.py.
"""

import dataclasses
import functools

import mujoco
import numpy as np
import pytest

from clearance_mj import ConstantLaw, Excitation, RigError, energy_balance, estimate_frf
from clearance_mj.beam import natural_frequencies
from clearance_mj.engines import Links, Modal, build_links, simulate
from clearance_mj.engines.linkage import linkage
from clearance_mj.rig import Bushing, Contact, Grease, Rig, Sensor
from clearance_mj.structure import Disc, Material, Section, Shaft, Shafts, Spring, Support
from clearance_mj.structure.reduction import vibration_modes

from ..engines.alike import with_bushings
from ..refusals import assert_refused
from ..structures import chain
from .test_frf_engines import BAND, FS, noise, rms_db

STEEL, ROUND = Material(210e9, 7850.0), (Section(1.0, diameter=0.0086),)
GREASE, CONTACT, LAW = Grease(4369.0, 3.0), Contact(7.8e3, 4.0), ConstantLaw(2e4, 3.0)
STEPPED = Section(0.4, diameter=0.011), Section(0.35, diameter=0.0086), Section(0.25, diameter=0.007)
TAPERED = Section(0.6, diameter=(0.012, 0.008)), Section(0.4, diameter=0.008)
TUBE = (Section(1.0, diameter=0.02, inner_diameter=0.016),)


def shaft(*supports, sections=ROUND, discs=(), **more):
    more = {"rayleigh": (0.5, 1e-5), "theory": "euler", **more}
    return Shaft(sections, tuple(Support(*s) for s in supports), discs, STEEL, **more)


INNER = shaft((0.0, "clamped"), name="inner")
OUTER = shaft((0.0, "pinned"), (1.0, "pinned"), sections=TUBE, rayleigh=(0.3, 2e-5), name="outer")
SHAFTS = {
    "pinned-pinned": shaft((0.0, "pinned"), (1.0, "pinned")),
    "propped": shaft((0.0, "clamped"), (1.0, "pinned")),
    "clamped at the right end": shaft((1.0, "clamped")),
    "clamped-clamped": shaft((0.0, "clamped"), (1.0, "clamped")),
    "clamped-guided": shaft((0.0, "clamped"), (1.0, "guided")),
    "free-free": shaft(),
    "stepped": shaft((0.0, "pinned"), (1.0, "pinned"), sections=STEPPED),
    "tapered": shaft((0.0, "clamped"), sections=TAPERED),
    "with disc": shaft((0.0, "clamped"), discs=(Disc(0.7, 0.4, 2e-3),)),
    "elastic ends": shaft((0.0, "elastic", 2e4, 50.0, 5.0), (0.8, "elastic", 1e4, 0.0, 3.0)),
    "elastic between": shaft((0.0, "pinned"), (0.6, "elastic", 3e4, 20.0, 10.0, 0.01), (1.0, "elastic", 2e4)),
    "two spans": shaft((0.0, "pinned"), (0.45, "pinned"), (1.0, "pinned")),
    "overhung": shaft((0.2, "pinned"), (0.7, "pinned"), discs=(Disc(1.0, 0.3, 5e-4),)),
    "two shafts": Shafts((INNER, OUTER), (Spring("inner@0.9", 2e4, "outer@0.9", 1.0),), (0.2, 1e-6)),
}
all_shafts = pytest.mark.parametrize("name", SHAFTS)


def rig(name, at=(0.5484, 0.7918), **more):
    structure = SHAFTS[name]
    if isinstance(structure, Shafts):
        loose = Grease(1e3, 1.0)
        bushings = (
            Bushing("inner@0.55", 3e-4, 0.012, GREASE, CONTACT),
            Bushing("inner@0.3", 2e-4, 0.012, loose, CONTACT, to="outer@0.3"),
            Bushing("inner@0.75", 1e-4, 0.012, loose, CONTACT, to="outer@0.75"),
        )
        points = "inner@0.15", "inner@0.6", "outer@0.5", "outer@0.7"
    else:
        bushings, points = tuple(Bushing(x, 3e-4, 0.012, GREASE, CONTACT) for x in at), (0.15, 0.3, 0.65, 0.9)
    sensors = tuple(Sensor(i + 1, point) for i, point in enumerate(points))
    return Rig(name, None, bushings, sensors, structure=dataclasses.replace(structure, **more))


def chain_frequencies(of, links):
    """Hz, of motions that the supports allow, grease included."""
    whole, grease = linkage(of, links), [b.grease.stiffness for b in of.bushings]
    rows = whole.rows.at_bushings
    stiffness = whole.whole_stiffness + (rows.T * grease) @ rows
    return vibration_modes(*(whole.free.T @ m @ whole.free for m in (whole.mass, stiffness))).omega / (2 * np.pi)


@all_shafts
def test_frequencies(name, measured):
    """f1 to f5."""
    of = rig(name)
    expected = natural_frequencies(of, 5)
    for links, limit in ((16, 1e-2), (24, 1e-3), (32, 3e-4), (48, 6e-5)):
        error = np.max(np.abs(chain_frequencies(of, links)[:5] / expected - 1))
        measured.below(f"f1 to f5, {links} links, {name}: error", error, limit, "high-order beam elements")


@pytest.mark.parametrize("name", ["two spans", "clamped at the right end", "two shafts"])
def test_supports_hold(name):
    """Deflection and slope at rigid supports stay at rounding while the shaft rattles."""
    of, engine = rig(name), Links()
    run = engine.start(of, LAW, "base", engine.largest_step(of, LAW))
    run.advance(20 * np.sin(0.02 * np.arange(2000)))
    whole = linkage(of, engine.links)
    moved = np.abs(whole.along_own([s.position for s in of.sensors]) @ run.data.qpos).max()
    held = whole.fixed.rows
    assert len(held) and np.abs(held @ run.data.qpos).max() < 1e-9 * moved


@pytest.mark.parametrize("name", ["propped", "elastic between", "overhung"])
def test_energy(name, measured):
    """Reactions of rigid supports do no work; springs and dampers have their shares."""
    balance = energy_balance(rig(name), Excitation(noise(0.5, 8.0, 1), FS, "base", BAND), LAW, "links")
    measured.below(f"energy, {name}: imbalance", balance.imbalance, 1e-4, "what was put in")


@pytest.mark.parametrize(("name", "at"), [("propped", (0.5484, 0.95)), ("propped", (0.55, 0.58))])
def test_contact_forces_beside_reactions(name, at):
    """Without the help of joint forces, where support and bushing, or two bushings, are on one rigid link."""
    of, drive = with_bushings(rig(name, at), gap=2e-5), Excitation(noise(0.5, 20.0, 1), FS, "base", BAND)
    contact_force, expected = (simulate(of, drive, LAW, engine).contact_force for engine in (Links(24), Modal(16)))
    assert np.std(expected, axis=1).min() > 0.01
    np.testing.assert_allclose(np.std(contact_force, axis=1), np.std(expected, axis=1), rtol=0.02)


def test_modal_damping():
    """Damping ratios are those of the chain's own modes, the last one of all that follow; no other damping."""
    whole = linkage(rig("propped", at=(), rayleigh=(0.0, 0.0), damping_ratios=(0.01, 0.02)), 16)
    modes = vibration_modes(*(whole.free.T @ m @ whole.free for m in (whole.mass, whole.whole_stiffness)))
    shapes = whole.free @ modes.shapes
    ratios = (shapes.T @ whole.viscous @ shapes) / (2 * modes.omega)
    np.testing.assert_allclose(ratios.diagonal()[:4], [0.01, 0.02, 0.02, 0.02], rtol=1e-9)
    np.testing.assert_allclose(ratios - np.diag(ratios.diagonal()), 0, atol=1e-9)


def test_models_for_a_viewer_are_stable():
    """The MJCF of two shafts as it is written, with springs, supports, clearances: pushed, it comes to rest."""
    model = mujoco.MjModel.from_xml_string(build_links(rig("two shafts")).to_xml())
    assert (model.neq, model.nv) == (1, 16 + 17)
    data = mujoco.MjData(model)
    data.qvel[:] = 0.01
    mujoco.mj_step(model, data, 20000)
    assert not np.any(data.warning.number) and np.abs(data.qpos).max() < 0.01


def test_what_links_cannot_do():
    """One line says what can."""
    drive, of = Excitation(noise(0.1, 1.0, 1), FS, "base", BAND), rig("propped")
    assert_refused(RigError, "links needs a shaft; use modal", simulate, chain(), drive, LAW, "links")
    shears = of.replace(structure=dataclasses.replace(of.structure, theory="timoshenko"))
    assert_refused(RigError, 'no shear flexibility; use modal, or theory = "euler"', build_links, shears)
    close = shaft((0.0, "clamped"), (1.0, "clamped"), (0.95, "clamped"), (0.9, "clamped"))
    assert_refused(RigError, "too close together", build_links, of.replace(structure=close), 4)


@functools.cache
def frf(name, level, engine):
    response = simulate(rig(name), Excitation(noise(16, level, 4), FS, "base", BAND), LAW, engine)
    assert level < 5 or name == "two spans" or np.any(response.contact_force)
    return estimate_frf(response, "H1", resolution=1.0).functions


@pytest.mark.slow
@pytest.mark.parametrize("level", [1.0, 5.0])
@pytest.mark.parametrize("name", [
    "pinned-pinned", "propped", "clamped-clamped", "clamped-guided", "stepped", "tapered", "elastic ends",
    "elastic between", "two spans", "two shafts",
])  # fmt: skip
def test_frfs_in_contact(name, level, measured):
    """16 links, 1 and 5 m/s² rms of the base."""
    rms_error = rms_db(frf(name, level, Links()), frf(name, level, Modal()))
    measured.below(f"FRFs at {level:g} m/s², {name}: RMS of magnitude", rms_error, 0.3, "modal", "dB")
