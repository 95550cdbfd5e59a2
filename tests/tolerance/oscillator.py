"""A mass on a spring with a stop on each side: contact begins at gap |k - m ω² + i c ω|, in closed form."""

import clearance_mj as cm
from clearance_mj.rig import Bushing, Contact, Grease, Rig, Sensor, Shaker
from clearance_mj.structure import Matrices

STIFFNESS, DAMPING, GAP = 1e4, 20.0, 1e-3


def oscillator(contact: float = 1e5, **changes) -> cm.Model:
    """One of 1 kg, with k = 1e4 N/m, c = 20 N s/m and gaps of 1 mm, driven by a force."""
    rig = Rig(
        "one mass between stops", None, (Bushing("1:X", GAP, 0.0, Grease(STIFFNESS / 2, 0.0), Contact(contact, 5.0)),),
        (Sensor(1, "1:X"),), shaker=Shaker("force", "1:X"),
        structure=Matrices("m-kg-s", mass=[[1.0]], stiffness=[[STIFFNESS / 2]], damping=[[DAMPING]], dofs=["1:X"]),
    )  # fmt: skip
    return cm.Model(rig.replace(**changes), None)
