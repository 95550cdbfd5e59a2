"""Stiffness of meshing spur gears over time, with one or two pairs of teeth in contact."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..core.errors import LawError
from ..rig import Rig
from ..structure.base import parse_direction
from .law import TimeLaw

__all__ = ["mesh_law"]


def mesh_law(
    rig: Rig, teeth: int, contact_ratio: float | Sequence[float], phase: float | Sequence[float] = 0.0,
    rise: float = 0.02,
) -> TimeLaw:  # fmt: skip
    """Return the law of a rig with mesh stiffness proportional to the number of pairs of teeth in contact.

    With a contact ratio ε between 1 and 2 two pairs carry for the fraction ε - 1 of a mesh period, one pair otherwise,
    all equal (the rectangular wave of Lin & Parker, J. Vib. Acoust. 124, 2002). The mean is the
    mesh's contact stiffness k in the rig file, so that one pair has k/ε. Damping is constant, as are other clearances.

    Parameters
    ----------
    rig : Rig
        Gears at a steady spin, that of the gear with ``teeth``. Its meshes are the clearances between two base circles,
        such as "1:X" to "2:X"; all have the same period, like those of idlers.
    teeth : int
        Number of teeth of the gear that turns with the rig's spin.
    contact_ratio : float or sequence of float, length n_meshes
        ε, of the transverse section: of all meshes or of each.
    phase : float or sequence of float, length n_meshes
        Fraction of a period after which the second pair comes into contact.
    rise : float
        Fraction of a period in which the stiffness changes linearly, about that instant and the first pair's release.

    Raises
    ------
    LawError
        If the rig has no mesh or no steady spin, or there are not always one or two pairs in contact.
    """
    meshes = [j for j, b in enumerate(rig.bushings) if [(parse_direction(p) or "Z")[0] for p in b.joined] == ["X", "X"]]
    if not meshes:
        raise LawError(f'rig {rig.name!r} has no mesh: no clearance between two base circles, such as "1:X" to "2:X"')
    if not rig.spin or not rig.spin.speed or rig.spin.rate:
        raise LawError(
            f"rig {rig.name!r} has no steady spin, rad/s, of the gear with {teeth} teeth: give [spin] its speed"
        )
    ratios, phases = (np.broadcast_to(np.asarray(v, dtype=float), len(meshes)) for v in (contact_ratio, phase))
    if not (0 < rise < 0.5 and np.all((1 + rise <= ratios) & (ratios <= 2 - rise))):
        raise LawError(f"contact_ratio must be between 1 + rise and 2 - rise, got {contact_ratio} and rise {rise:g}")
    half = rise / 2 * np.array([-1.0, 1.0, -1.0, 1.0])
    edges = phases[:, None] + (ratios[:, None] - 1) * np.array([0.0, 0.0, 1.0, 1.0]) + half
    times = np.unique(edges % 1.0)
    k, c = (
        np.tile([getattr(b.contact, name) for b in rig.bushings], (times.size, 1)) for name in ("stiffness", "damping")
    )
    for j, edge, ratio in zip(meshes, edges, ratios):
        k[:, j] *= np.interp(times, edge, [1.0, 2.0, 2.0, 1.0], period=1.0) / ratio
    period = 2 * np.pi / (teeth * abs(rig.spin.speed))
    return TimeLaw(period * times, k, c, period=period)
