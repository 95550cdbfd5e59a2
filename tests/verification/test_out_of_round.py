"""Walls that are out of round: an oval beside a polygon of 720 sides, in orbits, links, lanes and files.

The polygon is a wall of this file, which knows nothing of the oval's nearest point: the deepest of its faces is met.
"""

import math
from collections.abc import MutableSequence, Sequence
from typing import ClassVar

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.core.validation import Number
from clearance_mj.engines import Links, Modal, simulate_together
from clearance_mj.rig import Bushing, Contact, Friction, Grease, Rig, Sensor, Spin, Unbalance
from clearance_mj.rig.walls import WALLS, Wall, register
from clearance_mj.structure import Disc, Material, Section, Shaft, Support

from ..engines.alike import assert_alike, with_bushings

GAP, WIDE, ACROSS, SIDES, FS = 2e-4, 2e-5, -1e-5, 720, 8192.0
SHAPE = {"wide": WIDE, "across": ACROSS}


@pytest.fixture(scope="module")
def faceted():
    """A wall whose faces touch an oval from outside; known to rig files while the tests of this file run."""

    @register
    class Faceted(Wall):
        """Lines that touch gap + wide cos 2θ + across sin 2θ at 720 angles θ."""

        name: ClassVar[str] = "faceted"
        wide: Number = 0.0
        """m"""
        across: Number = 0.0
        """m"""

        @staticmethod
        def law(p: Sequence[float], r: tuple[float, float], out: MutableSequence[float]) -> None:
            """Return the largest depth in a face, of a convex wall the nearest one, of those within 30°."""
            out[0], here = -1e9, round(360.0 / math.pi * math.atan2(r[1], r[0]))
            for i in range(here - 60, here + 61):
                at = math.pi * i / 360.0
                cos, sin, cos2, sin2 = math.cos(at), math.sin(at), math.cos(2.0 * at), math.sin(2.0 * at)
                g, slope = p[0] + p[1] * cos2 + p[2] * sin2, 2.0 * (p[2] * cos2 - p[1] * sin2)
                size = math.sqrt(g * g + slope * slope)
                n_y, n_z = (g * cos + slope * sin) / size, (g * sin - slope * cos) / size
                depth = (r[0] - g * cos) * n_y + (r[1] - g * sin) * n_z
                if depth > out[0]:
                    out[0], out[1], out[2] = depth, n_y, n_z

        def reach(self, gap: float) -> float:
            """Return the smallest distance of a face from the middle."""
            return 0.9 * gap - math.hypot(self.wide, self.across)

    yield Faceted
    del WALLS["faceted"]


def rotor(shape="oval", gap=GAP, **more):
    """A shaft on a pinned and an elastic support, whose unbalance presses it into its bushing all around."""
    more |= {"shape": shape, "wall": SHAPE}
    bushing = Bushing(0.45, gap, 0.0, Grease(0.0, 30.0), Contact(3e5, 100.0), **more)
    shaft = Shaft(
        (Section(0.8, 0.02),), (Support(0.0, "pinned"), Support(0.75, "elastic", 1e6, translation_damping=200.0)),
        (Disc(0.4, 2.0, 2e-3),), Material(210e9, 7850.0), (5.0, 1e-5), theory="euler",
    )  # fmt: skip
    turning = {"spin": Spin(60.0), "unbalances": (Unbalance(0.4, 1.4e-2),)}
    return Rig("rotor", None, (bushing,), (Sensor(1, 0.4),), structure=shaft, **turning)


def whirl(rig, engine="modal", duration=0.3):
    return cm.simulate(rig, cm.Excitation(np.zeros(round(duration * FS)), FS, "base"), engine=engine)


def test_an_orbit_on_an_oval_is_that_on_a_polygon(faceted, measured):
    """In steps that are far shorter than the way along a face, whose direction is wrong by up to a quarter of 1°."""
    oval, polygon = (whirl(rotor(shape), Modal(resolution=0.1)) for shape in ("oval", "faceted"))
    late = slice(oval.time.size // 2, None)
    assert np.abs(oval.contact_force[:, late]).sum(axis=0).min() > 1.0  # all the time
    assert np.ptp(np.hypot(*oval.displacement[:, late])) > 1.5 * math.hypot(WIDE, ACROSS)
    difference = np.hypot(*(oval.displacement - polygon.displacement)[:, late]).max() / GAP
    measured.below("orbit on an oval wall, over its gap: difference", difference, 1e-4, "a polygon of 720 sides")
    assert oval.contact_share == pytest.approx(polygon.contact_share, abs=1e-3)


def test_links_run_on_an_oval_as_modes_do():
    modal, links = (whirl(rotor(), engine) for engine in ("modal", Links(links=32)))
    assert modal.contact_share > 0.8
    assert cm.energy_balance(rotor(), cm.Excitation(np.zeros(1000), FS, "base"), engine="links").imbalance < 1e-3
    error = np.sqrt(np.mean((modal.displacement - links.displacement) ** 2) / np.mean(modal.displacement**2))
    assert error < 1e-2


def test_an_oval_without_lobes_is_round():
    rigs = [with_bushings(rotor(), shape=shape, wall=None) for shape in ("oval", "round")]
    oval, circle = (whirl(rig, duration=0.2) for rig in rigs)
    assert oval.contact_share > 0.5
    np.testing.assert_allclose(oval.displacement, circle.displacement, rtol=0, atol=1e-9 * GAP)


@pytest.mark.parametrize("shape", ["oval", "faceted"])
def test_eight_side_by_side_are_each_alone(faceted, shape):
    push = cm.excitation.random(0.1, FS, band=(5, 200), rms=3.0, seed=2)
    rigs = [rotor(shape, gap=GAP * (1 + 0.02 * i), friction=Friction(0.05 + 0.01 * i)) for i in range(8)]
    cases = [(rig, cm.ConstantLaw(3e5 + 1e4 * i, 90.0)) for i, rig in enumerate(rigs)]
    for (rig, law), side_by_side in zip(cases, simulate_together(cases, push)):
        alone = cm.simulate(rig, push, law, engine="modal")
        assert alone.contact_share > 0.05
        assert_alike(side_by_side, alone, 1e-9, ("displacement", "contact_force", "channels"))


def test_an_oval_comes_back_from_its_file(tmp_path):
    rig = rotor()
    rig.save(tmp_path / "rig.toml")
    assert Rig.load(tmp_path / "rig.toml") == rig
    text = (tmp_path / "rig.toml").read_text(encoding="utf-8")
    assert 'shape = "oval"' in text and "wide = 2e-05" in text and "across = -1e-05" in text
