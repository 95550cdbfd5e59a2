"""What a law's uncertainty makes of a prediction: bands of FRFs by Monte Carlo over the fitted parameters.

The logarithms of the parameters are drawn from a normal distribution with the fit's covariance (`Estimates.draw`),
cut to the fit's bounds, and every drawn law is simulated under the same excitation. The band of the drawn FRFs holds
what the records leave open about the parameters. A measured FRF has a random error besides, which `Band.prediction`
adds: `frf.random_error` between two excitations, `paired_error` where the rig and its model see the same one. No band
holds what the law's form cannot say.

JCGM 101:2008, Propagation of distributions using a Monte Carlo method.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.stats

from ..clearance.law import Law
from ..engines import Engine, simulate_each
from ..errors import LawError
from ..identify.registry import get_method
from ..parameters import Estimates
from ..rig import Rig
from ..signals.arrays import ArrayData, read_only
from ..signals.excitation import Excitation
from ..signals.frf import FRF, estimate_frf, random_error
from ..signals.response import Response

__all__ = ["CONFIDENCE", "Band", "draw_laws", "frf_band", "inside", "paired_error"]

CONFIDENCE = 0.95
DB = 20 / np.log(10)
WIDEST = 5.0
"""standard deviation of a logarithm from which on a parameter counts as not identified at all"""


@dataclass(frozen=True, eq=False, repr=False)
class Band(ArrayData):
    """FRFs of a fitted law and of laws drawn from its covariance."""

    fitted: FRF
    """of the fitted law itself"""
    drawn: np.ndarray
    """(n_laws, n_outputs, n_inputs, n_f) magnitudes"""
    confidence: float = CONFIDENCE
    """probability that an FRF lies between the limits, line by line"""

    def __post_init__(self) -> None:
        self._set(drawn=read_only(self.drawn))

    @cached_property
    def limits(self) -> np.ndarray:
        """(2, n_outputs, n_inputs, n_f) lower and upper limit of the magnitude of another drawn law.

        The prediction interval of a lognormal variable, of which there are as many samples as laws: exp(m ± t s
        √(1 + 1/n)), t of Student's distribution with n - 1 degrees of freedom.
        """
        return self._about(self._half_width)

    @cached_property
    def half_width_db(self) -> np.ndarray:
        """(n_outputs, n_inputs, n_f) half the width between the limits."""
        return DB * self._half_width

    def prediction(self, error: np.ndarray) -> np.ndarray:
        """Return the limits of the magnitude that a test is to show.

        Parameters
        ----------
        error : ndarray, shape (n_outputs, n_inputs, n_f)
            Standard deviation of the tested over the fitted magnitude, relative, beside that of the law: of
            `paired_error`, or of the `frf.random_error` of both.

        Returns
        -------
        ndarray, shape (2, n_outputs, n_inputs, n_f)
        """
        quantile = scipy.stats.norm.ppf(0.5 + self.confidence / 2)
        return self._about(np.hypot(self._half_width, quantile * error))

    @cached_property
    def _half_width(self) -> np.ndarray:
        n = len(self.drawn)
        quantile = scipy.stats.t.ppf(0.5 + self.confidence / 2, n - 1)
        return quantile * np.sqrt(1 + 1 / n) * np.log(self.drawn).std(axis=0, ddof=1)

    def _about(self, half_width: np.ndarray) -> np.ndarray:
        middle = np.log(self.drawn).mean(axis=0)
        return np.exp((middle - half_width, middle + half_width))


def inside(limits: np.ndarray | tuple[np.ndarray, np.ndarray], frf: FRF) -> float:
    """Share of an FRF's lines, of all sensors, whose magnitude lies between limits.

    Parameters
    ----------
    limits : ndarray, shape (2, n_outputs, n_inputs, n_f)
        Of `Band`.
    frf : FRF
        On the same lines.
    """
    magnitude = np.abs(frf.value)
    return float(np.mean((limits[0] <= magnitude) & (magnitude <= limits[1])))


def paired_error(test: Response, model: Response, resolution: float = 0.5) -> np.ndarray:
    """Relative standard deviation of a test's FRF magnitude about that of a model under the same excitation.

    The FRF of the difference of the responses is the difference of their FRFs; its random error comes from its own
    coherence. Scatter that both share, such as most of a nonlinear rig's, drops out; noise and impacts that the model
    does not repeat stay.

    Parameters
    ----------
    test, model : Response
        Under one excitation, of the same sensors; refused as by `estimate_frf`.
    resolution : float
        Of the FRFs, Hz.

    Returns
    -------
    ndarray, shape (n_outputs, n_inputs, n_f)
    """
    frf = estimate_frf(test, resolution=resolution)
    difference = dataclasses.replace(test, acceleration=test.acceleration - model.acceleration)
    rest = estimate_frf(difference, resolution=resolution)
    return random_error(rest, test.duration) * np.abs(rest.value) / np.abs(frf.value)


def draw_laws(rig: Rig, method: str, parameters: Sequence[dict], n: int, seed: int = 0) -> list[Law]:
    """Draw laws that the records do not distinguish from the fitted one.

    Parameters
    ----------
    rig : Rig
        The rig.
    method : str
        How the law was identified, see `identify.law`.
    parameters : sequence of dict
        Its fitted parameters, as `identify.Identified` has them.
    n, seed : int
        How many, and the seed of the random numbers.

    Raises
    ------
    LawError
        If the method fits no parameters, or the records do not identify one of them.
    """
    make = get_method(method).make
    if make is None or not parameters or any("correlation" not in p for p in parameters):
        raise LawError(f'method "{method}" gives no covariance of its parameters; use one that fits them')
    estimates = Estimates.from_rows(parameters)
    for name, std in zip(estimates.names, estimates.varied_std):
        if not std < WIDEST:
            raise LawError(f"the records do not identify the {name}, so there is no band")
    return [make(rig, *row) for row in estimates.draw(n, seed).tolist()]


def frf_band(
    rig: Rig, excitation: Excitation, law: Law, laws: Sequence[Law], engine: str | Engine = "modal",
    resolution: float = 0.5, progress: str | None = None,
) -> Band:  # fmt: skip
    """Simulate a fitted law and the laws drawn around it under one excitation.

    Parameters
    ----------
    rig : Rig
        The rig.
    excitation : Excitation
        Of every simulation.
    law, laws : Law and sequence of Law
        The fitted law, and those of `draw_laws`.
    engine : str or Engine
        As in `simulate`, whose errors it raises.
    resolution : float
        Of the FRFs, Hz.
    progress : str, optional
        Show a progress bar with this name.
    """
    every, frfs = [law, *laws], []
    for response in simulate_each(rig, excitation, every, engine, progress=progress):
        frfs.append(estimate_frf(response, resolution=resolution))
    return Band(frfs[0], np.abs([frf.value for frf in frfs[1:]]))
