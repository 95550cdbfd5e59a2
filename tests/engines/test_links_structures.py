"""Hinge chains of shafts with springs, and of two shafts with a clearance between them."""

import mujoco
import numpy as np

from clearance_mj.engines import build_links
from clearance_mj.physical.rows import softness_of
from clearance_mj.rig import Bushing, Contact, Grease, Rig, Sensor
from clearance_mj.structure import Material, Section, Shaft, Shafts, Spring, Support

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
