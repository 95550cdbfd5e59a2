"""The linear model of a rig.

A truncated set of modes is too stiff under a point force. The basis also has the static shape under a unit force at
each clearance and force shaker: they carry the residual flexibility of the modes left out (MacNeal 1971; Rubin
1975) as further degrees of freedom, so the displacement at a contact needs no algebraic correction. Modes of a turning
or spatial shaft are those of its plane along y, then of that along z.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import scipy.linalg

from ..rig import Rig
from ..rig.extremes import computable
from ..rig.loads import load_force
from ..structure import Shaft, Structure
from ..structure.base import PlaneCoupling
from ..structure.modal import Reduction
from .model import HeldBearing, LinearModel, no_matrix
from .rows import PlaneRows

__all__ = ["MAX_MODES", "linear_model", "skew"]

MAX_MODES = 60  # in a basis, beyond which nothing is gained


@functools.lru_cache(maxsize=128)  # a fit's Jacobian draws on some 70 rigs, one record after the other
def linear_model(rig: Rig, n_modes: int = 8, grease: bool = False, turning: bool | None = None) -> LinearModel:
    """Reduce the rig's structure, with its point masses, to modes and static shapes (Eqs 1-6).

    It has one bending plane, or two: of a spatial rig, or a shaft that turns. Rigs that differ in gaps, contacts or,
    without ``grease``, in the grease alone share one reduction.

    Parameters
    ----------
    rig : Rig
        The rig.
    n_modes : int
        Modes of each plane of shafts, or of the whole of another structure; one static shape for every row of a
        clearance and point of a force shaker is added.
    grease : bool
        Count the in-gap stiffness of the grease to the structure's. Without it the grease is left to the force side.
    turning : bool, optional
        True if the shaft may turn; None: if the rig has a spin.

    Raises
    ------
    RigError
        If the structure's mass is not positive or its stiffness negative, or it cannot turn as asked.
    """
    turns = rig.spin is not None and not rig.linear.is_torsional if turning is None else turning
    across = rig.linear.in_other_plane
    more = tuple((b.sliding_point, 1.0) for b in rig.bushings if b.sliding_point is not None)
    of_planes: tuple[Structure | None, Structure] = (across, rig.linear)
    if turns:
        shaft = _turning_shaft(rig)
        # A strong damper at a support bends the shaft there: the static shapes under its force are among the modes.
        more += tuple((s.position, 1.0) for s in shaft.supports if s.translation_damping)
        # Both planes are cut into the same elements, where the spin couples them: at slots, too, which act in one.
        slots = (rig.linear.place(b.position)[1] for b in rig.bushings if not b.is_round)
        more += tuple((f"@{x!r}:X", 1.0) for x in slots)
        of_planes = shaft.in_other_plane, shaft
    if turns or (rig.moves_across and across is not None):
        reductions = [rig.reduction(n_modes, grease, s, more=more, axes=axis) for axis, s in zip("YZ", of_planes)]
    else:
        reductions = [rig.reduction(n_modes, grease, more=more)]
    ends = [0, *np.cumsum([part.omega.size for part in reductions]).tolist()]
    planes = [PlaneRows(p.rows, p.transform, slice(*span)) for p, span in zip(reductions, zip(ends, ends[1:]))]
    y = planes[0] if len(planes) == 2 or across is None else None
    influence = [np.array([row @ p.transform for row in np.ascontiguousarray(p.influence.T)]).T for p in reductions]
    omega, damping, coupling = reductions[0].omega, reductions[0].damping, reductions[0].coupling
    gyroscopic = circulatory = no_matrix()
    if len(reductions) == 2:
        omega, damping = (np.concatenate([getattr(p, name) for p in reductions]) for name in ("omega", "damping"))
        if any(p.coupling.size for p in reductions):
            both = (p.coupling if p.coupling.size else 0 * np.diag(p.omega) for p in reductions)
            coupling = scipy.linalg.block_diag(*both)
        influence[0] = influence[0][:, [0, 2, 1]] * [1.0, 1.0, 0.0]  # the first plane is along y
    if turns:
        of_y, of_z = map(_coupling, reductions)
        gyroscopic = skew(of_y.polar.T @ of_z.polar)
        circulatory = skew(shaft.rayleigh[1] * of_y.strain.T @ of_z.strain)
    model = LinearModel(
        rig, (y, planes[-1]), omega, damping, coupling, np.vstack(influence), gyroscopic, circulatory,
        reductions[0].springs,
    )  # fmt: skip
    if rig.loads:
        model = dataclasses.replace(model, load=load_force(rig.name, rig.loads, model.directed, model.size))
    if not rig.bearings:
        return model
    rows = model.moved([bearing.position for bearing in rig.bearings])
    return dataclasses.replace(model, bearings=tuple(map(HeldBearing, rig.bearings, rows)))


def _turning_shaft(rig: Rig) -> Shaft:
    with computable(rig.name, rig.to_dict):
        if len(rig.linear.shafts) != 1:
            raise ValueError(f"only a beam or one shaft turns; its structure is {len(rig.linear.shafts)} shafts")
        shaft: Shaft = rig.linear.shafts[0]
        shaft.check_turning()
    return shaft


def _coupling(reduction: Reduction) -> PlaneCoupling:
    """Return the coupling between the planes, in the modes of one of them."""
    assert reduction.turning
    return PlaneCoupling(*(rows @ reduction.transform for rows in reduction.turning()))


def skew(coupling: np.ndarray) -> np.ndarray:
    """Return the skew matrix of both planes: a coupling from z to y, and its negative transpose from y to z."""
    n, m = coupling.shape
    return np.block([[np.zeros((n, n)), coupling], [-coupling.T, np.zeros((m, m))]])
