"""Motion and contact at the bushings."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.errors import RecordError
from ..signals.response import Response

__all__ = ["contact_statistics"]


def contact_statistics(response: Response) -> dict[str, Any]:
    """RMS and peak displacement (m), share of time in contact, peak contact force (N) of each bushing; time step (s).

    Parameters
    ----------
    response : Response
        Response of a simulation.
    """
    if response.contact_force is None or response.displacement is None:
        raise RecordError("only a simulated response has contact forces")
    contact = np.abs(response.contact_force)
    # The anti-alias filter rings a little around an impact: count what is above its ripple.
    ripple = np.maximum(0.01 * contact.max(axis=1, keepdims=True), 1e-3)
    return {
        "displacement_rms": response.displacement.std(axis=1).tolist(),
        "displacement_peak": np.abs(response.displacement).max(axis=1).tolist(),
        "contact_share": np.mean(contact > ripple, axis=1).tolist(),
        "contact_peak": contact.max(axis=1).tolist(),
        "step": response.provenance["step"],
    }
