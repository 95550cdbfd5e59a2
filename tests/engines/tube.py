"""A shaft in a tube, both pinned, with a clearance between them and a spring from the shaft to the base."""

from clearance_mj.rig import Bushing, Contact, Grease, Rig, Sensor
from clearance_mj.structure import Material, Section, Shaft, Shafts, Spring, Support


def tube_and_shaft(gap: float = 2e-4, **place: object) -> Rig:
    def pinned(name: str, section: Section) -> Shaft:
        ends = Support(0.0, "pinned"), Support(section.length, "pinned")
        return Shaft((section,), ends, (), Material(210e9, 7850.0), (1.0, 1e-6), theory="euler", name=name)

    shafts = pinned("inner", Section(0.8, 0.012)), pinned("outer", Section(0.6, 0.03, 0.026))
    bushing = Bushing("inner@0.3", gap, 0.02, Grease(2e3, 3.0), Contact(5e4, 5.0), to="outer@0.3", **place)
    structure = Shafts(shafts, (Spring("inner@0.7", 1e4),))
    return Rig("shaft in a tube", None, (bushing,), (Sensor(1, "inner@0.4"),), structure=structure)
