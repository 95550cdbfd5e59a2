"""Result of updating a rig to its records: the rig, its estimates and its misfit."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ...estimate.estimates import Estimates
from ...estimate.parameter import Parameter
from ...rig import Rig
from ..records.prepared import PreparedRecord
from .accepted_parts import AcceptedParts
from .misfit import RecordMisfit, rms_relative_error
from .priors import CRITICAL, rig_with, unsaid_words

__all__ = ["RigUpdate"]

SUSPECT_MISFIT = 0.1  # of a channel's level: a larger misfit is said
DRAWN_RIGS = 8  # by which the rig's errors are propagated to later results
NEARLY_CRITICAL = 0.9  # of critical damping, from which on a shaft's mode is not believed


@dataclass(frozen=True, eq=False)
class RigUpdate:
    """A rig updated to its records, and how well it is known."""

    rig: Rig
    """as updated; gaps, offsets and grease are those of the rig file"""
    start: Rig
    """the rig file's, with the parts identified beyond its structure"""
    records: tuple[PreparedRecord, ...]
    """that it was updated to"""
    estimates: Estimates
    """of all that varied, with their priors; those of probes are no part of the rig"""
    misfit: tuple[RecordMisfit, ...]
    """of each record"""
    channels: tuple[str, ...]
    """names of the misfits' channels"""
    probes: bool
    """True if displacement probes took part"""
    clearance_priors: tuple[Parameter, ...]
    """open parameters of the clearances, which the update leaves as they are"""
    structure: AcceptedParts = field(default_factory=AcceptedParts)
    """hypotheses tried beyond the structure in the rig file"""

    @property
    def only_prior(self) -> tuple[str, ...]:
        """Parameters of which the records add hardly anything to the prior, as `Estimates.only_prior`."""
        return self.estimates.only_prior

    @property
    def relative_error(self) -> np.ndarray:
        """(n_channels,) residual of each channel over its level, RMS over the records that have it."""
        return rms_relative_error([m.relative_error for m in self.misfit])

    @property
    def warnings(self) -> tuple[str, ...]:
        """Plain words on what not to rely on."""
        words = list(self.structure.warnings)
        if not self.probes:
            words.append("without probes: the motion in the clearances is known by the accelerometers alone")
        if self.only_prior:
            words.append(unsaid_words(self.only_prior))
        for name, value in self.values.items():
            if "damping_ratios" in name and value > NEARLY_CRITICAL * CRITICAL:
                words.append(
                    f"the records want a mode damped critically ({name} = {value:.2g}), which no shaft is: look at "
                    "their units (g for m/s²?), their sampling rate, and whether all channels are of one test"
                )
        worst = int(np.argmax(self.relative_error))
        if self.relative_error[worst] > SUSPECT_MISFIT:
            words.append(
                f"the updated rig misses {self.channels[worst]} by {100 * self.relative_error[worst]:.0f} % of its "
                "level: the rig file is wrong in something that it takes for exact, or a sensor is"
            )
        return tuple(words)

    @property
    def values(self) -> dict[str, float]:
        """Estimates by name, SI units."""
        return dict(zip(self.estimates.names, self.estimates.value.tolist()))

    def draw(self, n: int, seed: int = 0) -> list[Rig]:
        """Draw rigs from the covariance, gaps and offsets those of the rig file.

        Parameters
        ----------
        n : int
            Number of rigs to draw.
        seed : int
            Seed of the random numbers.
        """
        return [rig for rig, _ in self._drawn(n, seed)]

    @cached_property
    def drawn(self) -> list[tuple[Rig, dict[str, float]]]:
        """Eight rigs as of `draw`, and their values by name, among which are those of the probes."""
        return self._drawn(DRAWN_RIGS, 0)

    def _drawn(self, n: int, seed: int) -> list[tuple[Rig, dict[str, float]]]:
        values = [dict(zip(self.estimates.names, row)) for row in self.estimates.draw(n, seed).tolist()]
        return [(rig_with(self.start, each), each) for each in values]

    def to_dict(self) -> dict[str, Any]:
        """Return parameters, covariance, misfit and warnings as plain data."""
        errors = [{c: e for c, e in zip(self.channels, m.relative_error.tolist()) if e == e} for m in self.misfit]
        return {
            "parameters": self.estimates.beside_priors(), "covariance": self.estimates.covariance.tolist(),
            "records": [{"record": m.record, "duration": m.duration, "misfit": e} for m, e in zip(self.misfit, errors)],
            "only_prior": list(self.only_prior), "structure": self.structure.to_dict(), "warnings": list(self.warnings),
        }  # fmt: skip
