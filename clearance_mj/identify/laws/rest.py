"""Where a loaded shaft rests in its clearances, and where it would be in them without its load."""

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
    """Return where the shaft rests in each clearance as the rig file has it, from its middle, m."""
    rows, moved = rig.clearance_rows, np.zeros(rig.n_rows)
    if rig.gravity or rig.loads:
        with contextlib.suppress(SimulationError):
            moved = static_equilibrium(rig.replace(spin=None, unbalances=(), orders=())).displacement
    offsets = [[getattr(b, name) for name in OFFSETS[-b.n_coordinates :]] for b in rig.bushings]
    return [tuple((np.array(each) + moved[own]).tolist()) for each, own in zip(offsets, rows)]


def with_offsets(fits: Sequence[ForceFit], rig: Rig, drawn: Sequence[Rig] = ()) -> list[ForceFit]:
    """Return fits with the offsets of the unloaded shaft: where it rests, less what loads and forces do there.

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
    moved, error = _moved_to_rest(fits, rig)
    others = np.array([_moved_to_rest(fits, other)[0] for other in drawn]).reshape(-1, moved.size) - moved
    spread = others.T @ others / max(len(drawn), 1) + error @ error.T
    return [f.offset_by(moved[own], spread[own, own]) for f, own in zip(fits, rig.clearance_rows)]


def _moved_to_rest(fits: Sequence[ForceFit], rig: Rig) -> tuple[np.ndarray, np.ndarray]:
    """How far (n_rows,), m, loads and the forces of the clearances move the shaft from its unloaded place.

    And by how much (n_rows, n_rows) that is wrong if laws' forces are as wrong as is expected of them.
    """
    model = linear_model(rig, MODES)
    at = model.at_bushings
    square = np.where(model.omega > 0, model.omega, np.inf) ** 2  # what nothing holds has no unloaded place
    compliance, sag = (at / square) @ at.T, at @ (model.weight / square)

    def forces(moved: np.ndarray) -> np.ndarray:
        return np.concatenate([_force_at_rest(f, moved[own]) for f, own in zip(fits, rig.clearance_rows)])

    def beyond(moved: np.ndarray) -> np.ndarray:
        return np.asarray(moved - sag + compliance @ forces(moved))

    # Walls stay where they are from the place at rest: what moves with the unloaded place are fillings alone.
    found = np.asarray(scipy.optimize.root(beyond, np.zeros(len(at)), options={"xtol": 1e-6}).x)
    return found, compliance * FORCE_ERROR * forces(found)


def _force_at_rest(fit: ForceFit, moved: np.ndarray) -> np.ndarray:
    """Force (d,) of the clearance on a shaft that has come from its unloaded place to rest, N, without friction."""
    offset = np.array(fit.case.rest) - moved
    bushing = dataclasses.replace(fit.case.bushing, friction=None, radius=1.0 if fit.nominal.is_round else None)
    case = fit.case._replace(bushing=bushing, rest=tuple(offset.tolist()))
    x = np.stack([np.zeros((3, len(moved))), np.tile(moved, (3, 1))])
    unloaded, loaded = forces_along(case, x, np.zeros_like(x), np.zeros(2), 1.0)
    return np.asarray(loaded - (unloaded if np.linalg.norm(offset) < bushing.gap else 0.0))
