"""What a law's uncertainty makes of a prediction: bands of FRFs by Monte Carlo over the fitted parameters.

The logarithms of the parameters are drawn from a normal distribution with the fit's covariance (`output_error.Fit`),
cut to the fit's bounds, and every drawn law is simulated under the same excitation. The bands hold what the records
leave open about the parameters; they do not hold what the law's form cannot say, nor another excitation's scatter.

JCGM 101:2008, Propagation of distributions using a Monte Carlo method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .clearance.law import Law
from .engines import simulate_each
from .errors import LawError
from .excitation import Excitation
from .frf import FRF, estimate_frf
from .identify.laws import get_method
from .rig import Rig

__all__ = ["CONFIDENCE", "Band", "draw_laws", "frf_band"]

CONFIDENCE = 0.95
WIDEST = 5.0
"""standard deviation of a logarithm from which on a parameter counts as not told at all"""


@dataclass(frozen=True, eq=False)
class Band:
    """FRFs of a fitted law and of laws drawn from its covariance."""

    fitted: FRF
    """of the fitted law itself"""
    drawn: np.ndarray
    """(n_laws, n_sensors, n_f) magnitudes"""
    confidence: float = CONFIDENCE
    """share of the drawn laws between the limits"""

    @cached_property
    def limits(self) -> np.ndarray:
        """(2, n_sensors, n_f) lower and upper limit of the magnitude at each line."""
        tail = 50 * (1 - self.confidence)
        return np.percentile(self.drawn, (tail, 100 - tail), axis=0)

    @property
    def half_width_db(self) -> np.ndarray:
        """(n_sensors, n_f) half the band's width."""
        return 10 * np.log10(self.limits[1] / self.limits[0])


def draw_laws(rig: Rig, method: str, parameters: Sequence[dict], n: int, seed: int = 0) -> list[Law]:
    """Draw laws that the records do not tell from the fitted one.

    Parameters
    ----------
    rig : Rig
        The rig.
    method : str
        How the law was identified, see `identify.law`.
    parameters : sequence of dict
        Its fitted parameters, as `identify.laws.Identified` has them.
    n : int
        How many.
    seed : int
        Of the random numbers.

    Returns
    -------
    list of Law

    Raises
    ------
    LawError
        If the method fits no parameters, or the records do not tell one of them.
    """
    make = get_method(method).make
    if make is None or not parameters or any("correlation" not in p for p in parameters):
        raise LawError(f'method "{method}" gives no covariance of its parameters; use one that fits them')
    std = np.array([p["relative_std"] for p in parameters])
    for parameter, s in zip(parameters, std):
        if not s < WIDEST:
            raise LawError(f"the records do not tell the {parameter['name']}, so there is no band")
    covariance = np.outer(std, std) * [p["correlation"] for p in parameters]
    value, low, high = (np.log([p[key] for p in parameters]) for key in ("value", "low", "high"))
    rng = np.random.default_rng(seed)
    drawn = rng.multivariate_normal(value, covariance, size=n, method="eigh")
    return [make(rig, *np.exp(row).tolist()) for row in np.clip(drawn, low, high)]


def frf_band(
    rig: Rig, excitation: Excitation, law: Law, laws: Sequence[Law], engine="modal", resolution: float = 0.5,
    progress: str | None = None,
) -> Band:  # fmt: skip
    """Simulate a fitted law and the laws drawn around it under one excitation.

    Parameters
    ----------
    rig : Rig
        The rig.
    excitation : Excitation
        Of every simulation.
    law : Law
        The fitted law.
    laws : sequence of Law
        As `draw_laws` returns them.
    engine : str or Engine
        As in `simulate`.
    resolution : float
        Of the FRFs, Hz.
    progress : str, optional
        Show a progress bar with this name.

    Returns
    -------
    Band

    Raises
    ------
    ClearanceError
        As `simulate`.
    """
    every, frfs = [law, *laws], []
    for response in simulate_each(rig, excitation, every, engine, progress=progress):
        frfs.append(estimate_frf(response, resolution=resolution))
    return Band(frfs[0], np.abs([frf.value for frf in frfs[1:]]))
