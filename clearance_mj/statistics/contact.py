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

    The share is nan where the engine does not tell when the shaft touches.

    Parameters
    ----------
    response : Response
        Response of a simulation.
    """
    if response.contact_force is None or response.displacement is None:
        raise RecordError("only a simulated response has contact forces")
    share = response.contact_share
    return {
        "displacement_rms": response.displacement.std(axis=1).tolist(),
        "displacement_peak": np.abs(response.displacement).max(axis=1).tolist(),
        "contact_share": (np.full(len(response.displacement), np.nan) if share is None else share).tolist(),
        "contact_peak": np.abs(response.contact_force).max(axis=1).tolist(),
        "step": response.provenance["step"],
    }
