"""One mass of 1 kg on a spring and a dashpot in a clearance, and a spring of two powers that grease stands for."""

from dataclasses import dataclass

from clearance_mj.clearance.grease import GreaseModel
from clearance_mj.rig import Bushing, Contact, Grease, Rig, Sensor, Shaker
from clearance_mj.structure import Matrices


def one_mass(stiffness=1.0, damping=0.0, gap=1.0, loads=(), **bushing) -> Rig:
    """1 kg on a spring to the base, pushed by a force, in a clearance without grease."""
    wall = Bushing("1:X", gap, 0.0, **{"grease": Grease(0.0), "contact": Contact(1.0), **bushing})
    structure = Matrices("m-kg-s", mass=[[1.0]], stiffness=[[stiffness]], damping=[[damping]], dofs=["1:X"])
    shaker = Shaker("force", "1:X")
    return Rig("one mass", None, (wall,), (Sensor(1, "1:X"),), shaker=shaker, structure=structure, loads=loads)


@dataclass(frozen=True)
class PolynomialSpring(GreaseModel):
    """Force β x² + κ x³: κ makes a linear oscillator Duffing's; with β a period doubles near twice its frequency."""

    square: float
    cubic: float

    def parameters(self):
        return self.square, self.cubic

    def states(self, coordinates):
        return 0

    def small_motion(self):
        return 0.0, 0.0

    @staticmethod
    def law(p, state, r, dr, spin, step, out):
        out[0] = p[0] * r[0] ** 2 + p[1] * r[0] ** 3
        out[1] = 0.0

    @staticmethod
    def energy(p, before, state, r, dr, out):
        out[0] = p[0] * r[0] ** 3 / 3.0 + p[1] * r[0] ** 4 / 4.0
        out[1] = 0.0
