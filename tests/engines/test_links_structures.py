"""Hinge chains of shafts with springs, and of two shafts with a clearance between them."""

import mujoco
import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.engines import build_links
from clearance_mj.physical.rows import softness_of
from clearance_mj.rig import Bushing, Contact, Grease, Load, Rig, Sensor, Shaker
from clearance_mj.structure import Disc, Material, Section, Shaft, Support

from ..conftest import ROOT
from .tube import tube_and_shaft

PUMP = Rig.load(ROOT / "models" / "stepped_shaft.toml")


def test_springs_are_no_clearances():
    """Only a tendon between two shafts has limits: those of the contact, with its inverse inertia."""
    for rig, limits in ((PUMP, 0), (tube_and_shaft(), 2)):
        model = build_links(rig, 20).compile()
        limited = np.flatnonzero(model.tendon_limited == mujoco.mjtLimited.mjLIMITED_TRUE)
        assert (limited.size, model.ntendon > limits) == (limits, True)
        for i in limited:
            np.testing.assert_allclose(softness_of(model, "tendon", i), (5e4 / 2, 5.0 / 2), rtol=1e-6)


STEEL, CLAMP, PINS = Material(210e9, 7850.0), Support(0.0, "clamped"), (Support(0.0, "pinned"), Support(0.4, "pinned"))
CANTILEVER = Shaft((Section(0.6, 0.012),), (CLAMP,), (), STEEL, (1.0, 2e-6), theory="euler")
DISCS = Disc(0.0, 1.0, 1e-3), Disc(0.4, 1.0, 2e-3)
FREE = Shaft((Section(0.4, 0.02),), PINS, DISCS, STEEL, (1.0, 1e-6), theory="euler")


@pytest.mark.parametrize(("shaft", "bushing", "at", "torque", "tolerance"), [
    (CANTILEVER, Bushing("@0.6:RY", 2e-3, 0.0, Grease(2.0, 0.01), Contact(300.0, 0.05)), 0.4, (), 0.03),
    (CANTILEVER, Bushing("@0.5:Z", 2e-3, 0.0, Grease(200.0, 0.1), Contact(3e4, 5.0)), 0.4, (), 0.01),
    (
        FREE, Bushing("@0.4:RX", 1e-3, 0.0, Grease(0.0, 0.05), Contact(500.0, 0.05)), "@0.0:RX",
        (Load("@0.0:RX", torque=0.5),), 1e-3,
    ),
], ids=["slope", "along z", "teeth alone hold a shaft"])  # fmt: skip
def test_slots_with_directions_move_as_modes_do(shaft, bushing, at, torque, tolerance):
    """Limits of what the point names, in contact; root mean squares of differences."""
    rig = Rig("slot", None, (bushing,), (Sensor(1, 0.3),), structure=shaft, shaker=Shaker("force", at), loads=torque)
    band, level = ((5, 60), 2.0) if torque else ((20, 500), 20.0)
    drive = cm.excitation.random(0.3, 8192.0, band=band, rms=level, seed=1, kind="force")
    links, modal = (cm.simulate(rig, drive, engine=e) for e in ("links", "modal"))
    for name in ("displacement", "contact_force"):
        computed, expected = getattr(links, name), getattr(modal, name)
        assert np.abs(expected).max() > 1e-3 and np.std(computed - expected) < tolerance * np.std(expected)
