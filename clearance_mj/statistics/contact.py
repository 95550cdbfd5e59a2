"""Motion and contact at the bushings."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.errors import RecordError
from ..core.kinds import checks_kinds
from ..signals.response import Response

__all__ = ["contact_statistics"]


@checks_kinds
def contact_statistics(response: Response) -> dict[str, Any]:
    """RMS and peak displacement (m), `Response.contact_share`, peak contact force (N) of each bushing; time step (s).

    In space displacements are those of both directions together, and the force is the resultant. The share is nan where
    the engine does not tell when the shaft touches.

    Parameters
    ----------
    response : Response
        Response of a simulation.
    """
    if response.contact_force is None or response.displacement is None:
        raise RecordError("only a simulated response has contact forces")
    share, rows = response.contact_share, len(response.displacement)
    bushings = rows if share is None else len(share)
    shape = bushings, rows // max(bushings, 1), response.excitation.shape[-1]
    moved, force = (each.reshape(shape) for each in (response.displacement, response.contact_force))
    return {
        "displacement_rms": np.sqrt(moved.var(axis=2).sum(axis=1)).tolist(),
        "displacement_peak": np.linalg.norm(moved, axis=1).max(axis=1).tolist(),
        "contact_share": (np.full(bushings, np.nan) if share is None else share).tolist(),
        "contact_peak": np.linalg.norm(force, axis=1).max(axis=1).tolist(),
        "step": response.provenance["step"],
    }
