"""Directional FRFs of a shaft that turns: forward and backward whirl, from FRFs along y and z.

Motion and excitation across the shaft are complex, p = y + i z and g = g_y + i g_z. A line of p at ω > 0 is a circle
from y to z, one at ω < 0 a circle from z to y. Of the matrix H of FRFs along y and z,

    P(ω) = H_pg(ω) G(ω) + H_pĝ(ω) Ĝ(ω),    2 H_pg = H_yy + H_zz + i (H_zy - H_yz),
                                            2 H_pĝ = H_yy - H_zz + i (H_zy + H_yz),

with Ĝ of the conjugate of g. A rotor that is alike along y and z has no reverse FRF H_pĝ; its forward and backward
modes are peaks of the normal FRF H_pg at ω > 0 and at ω < 0.

Source: C.-W. Lee, A complex modal testing theory for rotating machinery, Mechanical Systems and Signal Processing 5,
1991.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.errors import RecordError
from .arrays import ArrayData
from .frf import FRF

__all__ = ["DirectionalFRF", "directional_frfs"]

AXES = ("Y", "Z")


@dataclass(frozen=True, eq=False, repr=False)
class DirectionalFRF(ArrayData):
    """Normal and reverse directional FRFs of points of a shaft. Made by `directional_frfs`."""

    frequency: np.ndarray
    """(2 n_f,) Hz, rising: backward below 0, forward above"""
    normal: np.ndarray
    """(n_points, 2 n_f) complex H_pg: circles that go round as the excitation does"""
    reverse: np.ndarray
    """(n_points, 2 n_f) complex H_pĝ: circles that go round against it; 0 where y and z are alike"""
    points: tuple[str, ...]
    """(n_points,) node of each"""
    unit: str
    """of the FRFs in words"""


def directional_frfs(frf: FRF) -> DirectionalFRF:
    """Return the directional FRFs of each node that has responses along y and z to references along y and z.

    Parameters
    ----------
    frf : FRF
        To two references, one along y and one along z, in either sense.

    Raises
    ------
    RecordError
        If it does not have these two references, or no node has both responses.
    """
    columns = {axis: (j, sign) for j, (axis, sign) in enumerate(map(_axis, frf.references))}
    if len(frf.references) != 2 or set(columns) != set(AXES):
        raise RecordError(
            f"directional FRFs need one reference along y and one along z; there are {', '.join(frf.references)}"
        )
    rows: dict[str, dict[str, tuple[int, float]]] = {}
    for i, label in enumerate(frf.responses):
        axis, sign = _axis(label)
        rows.setdefault(label.split(":")[0], {})[axis] = i, sign
    if not (nodes := {node: by_axis for node, by_axis in rows.items() if set(AXES) <= set(by_axis)}):
        raise RecordError(f"no node has responses along y and z; there are {', '.join(frf.responses)}")

    def part(response: str, reference: str) -> np.ndarray:
        j, of_reference = columns[reference]
        places = [by_axis[response] for by_axis in nodes.values()]
        one_sided = of_reference * np.array([sign * frf.value[i, j] for i, sign in places])
        return np.concatenate((one_sided[:, ::-1].conj(), one_sided), axis=1)

    yy, yz, zy, zz = (part(response, reference) for response in AXES for reference in AXES)
    normal, reverse = (yy + zz + 1j * (zy - yz)) / 2, (yy - zz + 1j * (zy + yz)) / 2
    frequency = np.concatenate((-frf.frequency[::-1], frf.frequency))
    return DirectionalFRF(frequency, normal, reverse, tuple(nodes), frf.unit)


def _axis(label: str) -> tuple[str, float]:
    """Return the axis of a degree of freedom such as "3:-Y", and its sign."""
    direction = label.split(":")[1]
    return direction.lstrip("+-"), -1.0 if direction.startswith("-") else 1.0
