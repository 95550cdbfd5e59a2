"""Growth of a clearance by rubbing: the rates of its gap and its offset.

The depth worn off is the volume over the footprint that the contact projects, h = V/(2 R L): so a conforming shaft
sinks into its bushing (Dickrell & Sawyer, Evolution of wear in a two-dimensional bushing, Tribology Transactions 47,
2004, 257, whose tests under a steady load have linear progress). Each end wears on half of the bushing's length, and
the clearance is the average of both: their volumes together over the whole footprint.

A bushing's wall recedes where it is touched. In the plane the upper wall by h_u and the lower by h_l: the gap grows by
(h_u + h_l)/2, and offset, from the bushing's middle to the shaft at rest, by (h_l - h_u)/2. In space a wall that is
touched in one direction recedes by h there: gap and middle move by h/2 each. Touched all around alike, the hole stays
round and V goes off 2πRL: the gap grows by h/π. Between both, the gap grows by h (1/2 - s (1/2 - 1/π)), with s = 4 det
M from 0 to 1 and M the rubbing's mean of n nᵀ: an interpolation that is exact at both ends and on every line.
A turning shaft wears evenly: the gap grows by V/(2πRL), the middle stays. One that does not turn wears as its wall
would, as only the distance between both counts.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..model import Model
from ..rig import Bushing, Rig
from .rubbing import footprints

__all__ = ["HOUR", "changed", "clearances_of", "growth", "growth_per_volume", "with_clearances"]

HOUR = 3600.0  # s


def clearances_of(rig: Rig) -> np.ndarray:
    """Return gap, offset along y and offset along z (n_bushings, 3) of a rig's bushings, m."""
    return np.array([(b.gap, b.offset_y, b.offset) for b in rig.bushings])


def changed(model: Model, changes: Iterable[Mapping[str, Any]]) -> Model:
    """Return a model with changed fields of each bushing."""
    bushings = tuple(dataclasses.replace(b, **new) for b, new in zip(model.rig.bushings, changes))
    return Model(model.rig.replace(bushings=bushings), model.law)


def with_clearances(model: Model, clearances: np.ndarray) -> Model:
    """Return a model whose bushings have other gaps and offsets.

    Parameters
    ----------
    model : Model
        The model; its posterior is left out.
    clearances : ndarray, shape (n_bushings, 3)
        As of `clearances_of`.
    """
    moved = np.asarray(clearances, dtype=float).tolist()
    return changed(model, ({"gap": gap, "offset_y": y, "offset": z} for gap, y, z in moved))


def growth_per_volume(rig: Rig, rubbing: np.ndarray) -> np.ndarray:
    """Return the rates of gap and offsets (n_bushings, 3) per coefficient of wear, N/s.

    Parameters
    ----------
    rig : Rig
        The rig.
    rubbing : ndarray, shape (n_bushings, 2, MOMENTS)
        Rubbing of both ends of every bushing, as of `rubbing.rubbing`.
    """
    radius, length = footprints(rig)
    turns = rig.spin is not None
    rates = np.zeros((len(rig.bushings), 3))
    for j, (bushing, moments) in enumerate(zip(rig.bushings, rubbing.sum(axis=1))):
        if bushing.wear and moments[0] > 0:
            rates[j] = _growth_by_depth(bushing, moments / (2 * radius[j] * length[j]), turns)
    return rates


def _growth_by_depth(bushing: Bushing, depth: np.ndarray, turns: bool) -> Sequence[float]:
    """Return the growth of gap and offsets by moments of the depth worn off."""
    total, along_y, along_z, yy, zz, yz = depth
    if bushing.worn == "shaft" and turns:
        return total / math.pi, 0.0, 0.0
    if bushing.stops != "both":  # the only wall recedes by the whole depth
        return total, 0.0, 0.0
    evenness = 4 * (yy * zz - yz * yz) / total**2
    return total * (0.5 - evenness * (0.5 - 1 / math.pi)), -along_y / 2, -along_z / 2


def growth(rig: Rig, rubbing: np.ndarray) -> np.ndarray:
    """Return the rates of gap and offsets (n_bushings, 3), m/h; see `growth_per_volume`.

    Parameters
    ----------
    rig : Rig
        The rig.
    rubbing : ndarray, shape (n_bushings, 2, MOMENTS)
        Rubbing of both ends of every bushing.
    """
    coefficient = np.array([bushing.wear or 0.0 for bushing in rig.bushings])
    return HOUR * coefficient[:, None] * growth_per_volume(rig, rubbing)
