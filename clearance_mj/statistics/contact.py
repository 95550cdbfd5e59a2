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
    """Return RMS and peak displacement (m), `Response.contact_share`, peak contact force (N) of bushings; step (s).

    Displacements of a round one are those of both directions together, and the force is the resultant. The fraction of
    time in contact is nan where the engine does not record when the shaft touches.

    Parameters
    ----------
    response : Response
        Response of a simulation.
    """
    if response.contact_force is None or response.displacement is None:
        raise RecordError("only a simulated response has contact forces")
    contact, rows = response.contact_share, response.clearance_rows
    displacement, force = ([each[part] for part in rows] for each in (response.displacement, response.contact_force))
    return {
        "displacement_rms": [float(np.sqrt(each.var(axis=1).sum())) for each in displacement],
        "displacement_peak": [float(np.linalg.norm(each, axis=0).max()) for each in displacement],
        "contact_share": (np.full(len(rows), np.nan) if contact is None else contact).tolist(),
        "contact_peak": [float(np.linalg.norm(each, axis=0).max()) for each in force],
        "step": response.provenance["step"],
    }
