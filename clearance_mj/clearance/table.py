"""Laws as tables for compiled loops."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..core.errors import LawError
from .contact import ContactModel

__all__ = ["LawTable", "law_table"]


class LawTable(NamedTuple):
    """A law as arrays: parameters of contact models, whose rows compiled loops interpolate before every step."""

    by_amplitude: bool  # the abscissa is the envelope of the motion (m) instead of time (s)
    abscissa: np.ndarray  # (n_rows,) increasing
    parameters: np.ndarray  # (n_rows, n_bushings, n_numbers) of the models (Kelvin-Voigt: k, c), padded with zeros
    release: float  # s, time constant of the envelope's decay after a peak
    period: float  # s, repetition period of the time; 0 without repetition
    adhesion: np.ndarray  # (n_bushings,) True if the contact may pull
    contact_law: np.ndarray  # (n_bushings,) addresses of the models' laws
    contact_energy: np.ndarray  # (n_bushings,) addresses of the models' energies
    kinds: tuple[type[ContactModel], ...]  # (n_bushings,) of the models

    @property
    def by_time(self) -> bool:
        """True if the parameters change over time."""
        return not self.by_amplitude and self.abscissa.size > 1


def law_table(
    by_amplitude: bool, abscissa: np.ndarray, rows: np.ndarray, models: Sequence[ContactModel], n: int,
    release: float = 0.0, period: float = 0.0,
) -> LawTable:  # fmt: skip
    """Return the table of rows (n_rows, 1 or n_bushings, n_numbers) and as many models, or one; arrays are copied."""
    if rows.shape[1] not in (1, n):
        raise LawError(
            f"the law holds k and c for {rows.shape[1]} bushings, the rig has {n}; "
            "give one value for all of them or one each"
        )
    parameters = np.array(np.broadcast_to(rows, (len(rows), n, rows.shape[2])))
    law, energy = np.array([m.addresses() for m in models], dtype=np.int64).T
    adhesion = np.array([m.adhesion for m in models])
    adhesion, law, energy = (np.array(np.broadcast_to(values, n)) for values in (adhesion, law, energy))
    kinds = tuple(type(model) for model in models) * (n if len(models) == 1 else 1)
    return LawTable(by_amplitude, abscissa.copy(), parameters, release, period, adhesion, law, energy, kinds)
