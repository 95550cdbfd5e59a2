"""The linear rig from whole records, whatever its clearances do: model updating by weighted Gauss-Newton with priors.

The structure without filling and contact is linear. Whatever acts in the clearances, a few forces enter it there, and
more sensors than forces were recorded: at every frequency the forces and the excitation are those that meet the
sensors best (`Projection`), and the remaining contradiction between the sensors is the rig's error. So neither a law of
the clearance nor quiet records are needed. The parameters of `priors` vary until that is least, together with their
distances from the priors (Friswell and Mottershead, Finite Element Model Updating in Structural Dynamics, 1995,
chapter 8).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...rig import Rig
from ..records.prepared import PreparedRecord
from .misfit import relative_error, rms_relative_error
from .priors import with_exact_supports
from .rig_fit import RigFit
from .rig_update import RigUpdate
from .spectra import rms

__all__ = ["rig_file_misfit", "update_from"]


def update_from(rig: Rig, records: Sequence[PreparedRecord]) -> RigUpdate:
    """Update the numbers of a rig to prepared records, its structure as it is drawn.

    Parameters
    ----------
    rig : Rig
        Where the fit begins, and the means of the priors.
    records : sequence of PreparedRecord
        Probes take part if all records have them.

    Raises
    ------
    RecordError
        If there are no more sensors than clearances, or a channel cannot be used.
    """
    return RigFit(rig, records).run()


def rig_file_misfit(rig: Rig, records: Sequence[PreparedRecord]) -> np.ndarray:
    """Return the misfit of a rig as it is in each channel over its level (n_channels,), RMS over the records.

    Under the forces in the clearances that meet all sensors best.

    Raises
    ------
    RecordError
        As `update_from`.
    """
    fit = RigFit(with_exact_supports(rig), records)
    parts = zip(fit.projected(None), fit.noise, fit.spectra)
    return rms_relative_error([relative_error(rms(f.fitted(n) - s.measured), rms(s.measured)) for f, n, s in parts])
