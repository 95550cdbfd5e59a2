"""The virtual rigs: what their datasheets say (the rig file), and what their bushings really are.

"table1" is the rig of the article's Table 1, as in models/table1_rig.toml. The others have other geometry, gaps,
contact and grease physics; they were made up after the identification was finished, to see what it is worth where it
was not developed. Their datasheets are wrong in the way datasheets are: fresh grease as a spring and damper, Hertz
contact linearised at one gap of penetration. What is hidden here is not written into a dataset, and nothing outside
this package may read it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from clearance_mj.rig import Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor
from experiments.testrig import physics


@dataclass(frozen=True)
class BoucWen:
    """Smooth hysteresis, see `physics.bouc_wen`."""

    model: ClassVar[int] = physics.BOUC_WEN
    states: ClassVar[int] = 1
    amplitude: float = 1.0
    """A"""
    beta: float = 1e7
    """1/mⁿ"""
    gamma: float = 1e7
    """1/mⁿ"""
    exponent: int = 2
    """n"""

    @property
    def parameters(self) -> np.ndarray:
        """(4,) as the integrator reads them."""
        return np.array([self.amplitude, self.beta, self.gamma, self.exponent])


@dataclass(frozen=True)
class Iwan:
    """Parallel Jenkins elements of equal stiffness, their yield displacements evenly spread; see `physics.iwan`."""

    model: ClassVar[int] = physics.IWAN
    largest_yield: float
    """m; element i of N yields at (i - 1/2)/N of it"""
    elements: int = 12
    """N"""

    @property
    def parameters(self) -> np.ndarray:
        """(n,) yield displacement of each element, m."""
        return self.largest_yield * (np.arange(self.elements) + 0.5) / self.elements

    @property
    def states(self) -> int:
        """Number of internal states."""
        return self.elements


@dataclass(frozen=True)
class LuGre:
    """Bristles that slide with Stribeck's friction, see `physics.lugre`."""

    model: ClassVar[int] = physics.LUGRE
    states: ClassVar[int] = 1
    coulomb: float
    """m, deflection of bristles that slide fast"""
    static: float
    """m, deflection of bristles that slide slowly"""
    stribeck_speed: float
    """m/s"""
    damping: float = 0.0
    """σ1, N s/m, of the bristles"""

    @property
    def parameters(self) -> np.ndarray:
        """(4,) as the integrator reads them."""
        return np.array([self.coulomb, self.static, self.stribeck_speed, self.damping])


@dataclass(frozen=True)
class Truth:
    """A real bushing; the defaults are those of the rig of the article's Table 1."""

    contact_stiffness: float = 3e5
    """K of a whole bushing, N/m^1.5; each end has half"""
    contact_exponent: float = 1.5
    """Hertz"""
    contact_dissipation: float = 1.5
    """α, s/m"""
    grease_stiffness: float = 4369.0
    """k, N/m"""
    elastic_ratio: float = 0.8
    """λ"""
    hysteresis: BoucWen | Iwan | LuGre = BoucWen()
    """of the other share of the stiffness"""
    film_damping: float = 4.0
    """c, N s/m"""
    film_height: float = 7.5e-4
    """h, m"""
    film_limit: float = 0.2
    """ε, smallest relative film thickness"""
    drift: float = 0.005
    """largest relative change of the grease stiffness, by temperature"""


@dataclass(frozen=True)
class VirtualRig:
    """A rig file, and its true bushings."""

    rig: Rig  # the datasheet
    truth: tuple[Truth, ...]  # of each bushing


def _rig(
    name: str, description: str, length: float, diameter: float, tip_mass: float, bushings: tuple[Bushing, Bushing],
    sensors: tuple[float, ...],
) -> Rig:  # fmt: skip
    beam = Beam(length, young_modulus=210e9, density=7850.0, diameter=diameter, rayleigh=(0.5, 1e-5))
    positions = [*sensors, *(b.position for b in bushings), length]
    accelerometers = tuple(Sensor(node, x) for node, x in enumerate(positions, 1))
    masses = (PointMass(length, tip_mass, "lever boss"),)
    return Rig(name, beam, bushings, accelerometers, masses, description=description)


def _table1() -> VirtualRig:
    grease, contact = Grease(4369.0, 3.0), Contact(7.8e3, 4.0)
    bushings = (Bushing(0.5484, 3e-4, 0.012, grease, contact), Bushing(0.7918, 3e-4, 0.012, grease, contact))
    words = "Steel shaft through two greased bushings with clearance, lever boss at the tip, on a shaken base plate"
    rig = _rig("table1", words, 1.0, 0.0086166, 0.434, bushings, (0.15, 0.3, 0.4, 0.65, 0.9))
    return VirtualRig(rig, (Truth(), Truth()))


def _iwan() -> VirtualRig:
    grease, contact = Grease(4600.0, 4.0), Contact(2.1e4, 6.0)
    bushings = (Bushing(0.42, 2e-4, 0.01, grease, contact), Bushing(0.71, 2e-4, 0.01, grease, contact))
    rig = _rig("iwan", "Short shaft, Iwan grease", 0.9, 0.008, 0.25, bushings, (0.12, 0.25, 0.34, 0.56, 0.82))
    truth = Truth(1e6, 1.5, 1.5, 5200.0, 0.6, Iwan(3e-4), film_damping=3.0, film_height=6e-4)
    return VirtualRig(rig, (truth, truth))


def _lugre() -> VirtualRig:
    grease, contact = Grease(7200.0, 4.0), Contact(2.8e4, 6.0)
    bushings = (Bushing(0.55, 3.5e-4, 0.015, grease, contact), Bushing(0.95, 3.5e-4, 0.015, grease, contact))
    rig = _rig("lugre", "Long shaft, LuGre grease", 1.2, 0.011, 0.6, bushings, (0.18, 0.32, 0.45, 0.75, 1.1))
    bristles = LuGre(coulomb=1.2e-4, static=1.8e-4, stribeck_speed=0.02, damping=0.5)
    truth = Truth(1e6, 1.5, 1.5, 8000.0, 0.55, bristles, film_damping=5.0, film_height=9e-4)
    return VirtualRig(rig, (truth, truth))


def _mixed() -> VirtualRig:
    bushings = (
        Bushing(0.6, 2.5e-4, 0.012, Grease(4500.0, 3.0), Contact(1.2e4, 4.0)),
        Bushing(0.88, 4e-4, 0.012, Grease(4500.0, 3.0), Contact(3e4, 4.0)),
    )
    words = "Iwan grease in the first bushing, LuGre in the second, unlike gaps and contacts"
    rig = _rig("mixed", words, 1.05, 0.009, 0.4, bushings, (0.16, 0.32, 0.45, 0.72, 0.97))
    bristles = LuGre(coulomb=1.5e-4, static=2.5e-4, stribeck_speed=0.015, damping=0.3)
    first = Truth(5e5, 1.5, 1.5, 4000.0, 0.7, Iwan(5e-4), film_damping=3.5, film_height=7e-4)
    second = Truth(1e6, 1.5, 1.5, 5500.0, 0.5, bristles, film_damping=6.0, film_height=1.1e-3)
    return VirtualRig(rig, (first, second))


RIGS: dict[str, Callable[[], VirtualRig]] = {"table1": _table1, "iwan": _iwan, "lugre": _lugre, "mixed": _mixed}
"""Functions that make each virtual rig, by name"""
