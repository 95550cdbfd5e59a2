"""Hinge chains of shafts with springs, and of two shafts with a clearance between them."""

import mujoco
import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.engines import build_links
from clearance_mj.physical.rows import softness_of
from clearance_mj.rig import Bushing, Contact, Grease, Load, Rig, Sensor, Shaker
from clearance_mj.structure import Disc, Material, Section, Shaft, Shafts, Spring, Support

from ..conftest import ROOT

PUMP = Rig.load(ROOT / "models" / "stepped_shaft.toml")


def tube_and_shaft():
    def pinned(name, section):
        ends = Support(0.0, "pinned"), Support(section.length, "pinned")
        return Shaft((section,), ends, (), Material(210e9, 7850.0), (1.0, 1e-6), theory="euler", name=name)

    parts = pinned("inner", Section(0.8, 0.012)), pinned("outer", Section(0.6, 0.03, 0.026))
    spring = Spring("inner@0.7", 1e4)
    bushing = Bushing("inner@0.3", 2e-4, 0.02, Grease(2e3, 3.0), Contact(5e4, 5.0), to="outer@0.3")
    structure = Shafts(parts, (spring,))
    return Rig("shaft in a tube", None, (bushing,), (Sensor(1, "inner@0.4"),), structure=structure)


def test_springs_are_no_clearances():
    """Only a tendon between two shafts has limits: those of the contact, with its inverse inertia."""
    for rig, limits in ((PUMP, 0), (tube_and_shaft(), 2)):
        model = build_links(rig, 20).compile()
        limited = np.flatnonzero(model.tendon_limited == mujoco.mjtLimited.mjLIMITED_TRUE)
        assert (limited.size, model.ntendon > limits) == (limits, True)
        for i in limited:
            np.testing.assert_allclose(softness_of(model, "tendon", i), (5e4 / 2, 5.0 / 2), rtol=1e-6)


CANTILEVER = Shaft(
    (Section(0.6, 0.012),), (Support(0.0, "clamped"),), (), Material(210e9, 7850.0), (1.0, 2e-6), theory="euler"
)  # fmt: skip
FREE = Shaft(
    (Section(0.4, 0.02),), (Support(0.0, "pinned"), Support(0.4, "pinned")),
    (Disc(0.0, 1.0, 1e-3), Disc(0.4, 1.0, 2e-3)), Material(210e9, 7850.0), (1.0, 1e-6), theory="euler",
)  # fmt: skip


@pytest.mark.parametrize(
    ("shaft", "bushing", "at", "torque", "share"),
    [
        (CANTILEVER, Bushing("@0.6:RY", 2e-3, 0.0, Grease(2.0, 0.01), Contact(300.0, 0.05)), 0.4, (), 0.03),
        (CANTILEVER, Bushing("@0.5:Z", 2e-3, 0.0, Grease(200.0, 0.1), Contact(3e4, 5.0)), 0.4, (), 0.01),
        (
            FREE, Bushing("@0.4:RX", 1e-3, 0.0, Grease(0.0, 0.05), Contact(500.0, 0.05)), "@0.0:RX",
            (Load("@0.0:RX", torque=0.5),), 1e-3,
        ),
    ],
    ids=["slope", "along z", "teeth alone hold a shaft"],
)  # fmt: skip
def test_slots_with_directions_move_as_modes_do(shaft, bushing, at, torque, share):
    """Limits of what the point names, in contact; root mean squares of differences."""
    rig = Rig("slot", None, (bushing,), (Sensor(1, 0.3),), structure=shaft, shaker=Shaker("force", at), loads=torque)
    band, level = ((5, 60), 2.0) if torque else ((20, 500), 20.0)
    drive = cm.excitation.random(0.3, 8192.0, band=band, rms=level, seed=1, kind="force")
    links, modal = (cm.simulate(rig, drive, engine=e) for e in ("links", "modal"))
    for found, told in ((links.displacement, modal.displacement), (links.contact_force, modal.contact_force)):
        assert np.abs(told).max() > 1e-3 and np.std(found - told) < share * np.std(told)
