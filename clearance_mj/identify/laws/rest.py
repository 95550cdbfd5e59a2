"""Rest position of a loaded shaft in its clearances, and its offset in them without load."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Sequence

import numpy as np
import scipy.optimize

from ...core.errors import SimulationError
from ...engines.equilibrium import static_equilibrium
from ...linear import linear_model
from ...rig import Rig
from ..forces.restoring import MODES
from .case import OFFSETS, forces_along
from .force_fit import ForceFit
from .measured_motion import FORCE_ERROR

__all__ = ["rests_of", "with_offsets"]


def rests_of(rig: Rig) -> list[tuple[float, ...]]:
    """Return the shaft's rest position in each clearance of the rig file, from its middle, m."""
    rows, displacement = rig.clearance_rows, np.zeros(rig.n_rows)
    if rig.gravity or rig.loads:
        with contextlib.suppress(SimulationError):
            displacement = static_equilibrium(rig.replace(spin=None, unbalances=(), orders=())).displacement
    offsets = [[getattr(b, name) for name in OFFSETS[-b.n_coordinates :]] for b in rig.bushings]
    return [tuple((np.array(each) + displacement[row]).tolist()) for each, row in zip(offsets, rows)]


def with_offsets(fits: Sequence[ForceFit], rig: Rig, drawn: Sequence[Rig] = ()) -> list[ForceFit]:
    """Return fits with the offsets of the unloaded shaft: its rest position less its displacement by loads and forces.

    Parameters
    ----------
    fits : sequence of ForceFit
        Of all clearances.
    rig : Rig
        The updated rig.
    drawn : sequence of Rig
        Rigs from its posterior, by which offsets vary.
    """
    if not rig.is_loaded:
        return list(fits)
    shift, error = _displacement_to_rest(fits, rig)
    others = np.array([_displacement_to_rest(fits, other)[0] for other in drawn]).reshape(-1, shift.size) - shift
    spread = others.T @ others / max(len(drawn), 1) + error @ error.T
    return [f.offset_by(shift[row], spread[row, row]) for f, row in zip(fits, rig.clearance_rows)]


def _displacement_to_rest(fits: Sequence[ForceFit], rig: Rig) -> tuple[np.ndarray, np.ndarray]:
    """Return the displacement (n_rows,), m, of the shaft from its unloaded place under loads and clearance forces.

    With its errors (n_rows, n_rows) from the expected errors of the laws' forces.
    """
    model = linear_model(rig, MODES)
    at = model.at_bushings
    square = np.where(model.omega > 0, model.omega, np.inf) ** 2  # rigid-body modes have no unloaded place
    compliance, sag = (at / square) @ at.T, at @ (model.weight / square)

    def forces(displaced: np.ndarray) -> np.ndarray:
        return np.concatenate([_force_at_rest(f, displaced[row]) for f, row in zip(fits, rig.clearance_rows)])

    def residual(displaced: np.ndarray) -> np.ndarray:
        return np.asarray(displaced - sag + compliance @ forces(displaced))

    # Walls stay where they are from the place at rest: fillings alone move with the unloaded place.
    displacement = np.asarray(scipy.optimize.root(residual, np.zeros(len(at)), options={"xtol": 1e-6}).x)
    return displacement, compliance * FORCE_ERROR * forces(displacement)


def _force_at_rest(fit: ForceFit, displacement: np.ndarray) -> np.ndarray:
    """Force (d,) of the clearance on a shaft that has come from its unloaded place to rest, N, without friction."""
    offset = np.array(fit.case.rest) - displacement
    bushing = dataclasses.replace(fit.case.bushing, friction=None, radius=1.0 if fit.nominal.is_round else None)
    case = fit.case._replace(bushing=bushing, rest=tuple(offset.tolist()))
    x = np.stack([np.zeros((3, len(displacement))), np.tile(displacement, (3, 1))])
    unloaded, loaded = forces_along(case, x, np.zeros_like(x), np.zeros(2), 1.0)
    return np.asarray(loaded - (unloaded if np.linalg.norm(offset) < bushing.gap else 0.0))
