"""Laws as compiled loops see them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .contact import ContactModel

__all__ = ["LawTable"]


class LawTable(NamedTuple):
    """A law as arrays: parameters of contact models, of which compiled loops interpolate the rows before every step."""

    by_amplitude: bool  # the abscissa is the envelope of the motion (m) instead of time (s)
    abscissa: np.ndarray  # (n_rows,) increasing
    parameters: np.ndarray  # (n_rows, n_bushings, n_numbers) of the models (Kelvin-Voigt: k, c), padded with zeros
    release: float  # s, time constant with which the envelope falls after a peak
    adhesion: np.ndarray  # (n_bushings,) whether the contact may pull
    contact_law: np.ndarray  # (n_bushings,) addresses of the models' laws
    contact_energy: np.ndarray  # (n_bushings,) addresses of the models' energies
    kinds: tuple[type[ContactModel], ...]  # (n_bushings,) of the models

    @property
    def by_time(self) -> bool:
        """Whether the parameters change over time."""
        return not self.by_amplitude and self.abscissa.size > 1
