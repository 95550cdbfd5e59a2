"""Uncertainty of predictions by a law: bands of FRFs by Monte Carlo over the fitted parameters.

Parameters, or their logarithms, are drawn from a normal distribution with the fit's covariance (`Estimates.draw`), cut
to the fit's bounds, and every drawn law is simulated under the same excitation, on the rig that was drawn with it where
the method identifies both. The band of the drawn FRFs holds the parameters' uncertainty. A measured FRF has a random
error besides, which `Band.prediction` adds: `signals.random_error` between two excitations, `paired_error` where the
rig and its model see the same one. Errors of the law's form are in a band as far as the records' misfit shows them
(`LawMisfit.spread`).

JCGM 101:2008, Propagation of distributions using a Monte Carlo method.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..core.kinds import checks_kinds
from ..engines import Modal, simulate_and_keep
from ..identify.laws.law_misfit import LawMisfit
from ..model import Model
from ..signals.arrays import ArrayData
from ..signals.excitation import Excitation
from ..signals.frf import FRF, estimate_frf
from ..signals.frf_error import random_error
from ..signals.response import Response
from .intervals import CONFIDENCE, two_sided_quantile

__all__ = ["Band", "frf_band", "inside", "paired_error"]

DB = 20 / np.log(10)


@dataclass(frozen=True, eq=False, repr=False)
class Band(ArrayData):
    """FRFs of a fitted law and of laws drawn from its covariance."""

    fitted: FRF
    """of the fitted law itself"""
    drawn: np.ndarray
    """(n_laws, n_outputs, n_inputs, n_f) magnitudes"""
    confidence: float = CONFIDENCE
    """probability that an FRF lies between the limits, line by line"""
    missed: np.ndarray | None = None
    """(n_outputs, n_inputs, n_f) relative standard deviation of a test's magnitude about that of the law, in addition
    to that of the drawn laws; None: not known"""
    contact: np.ndarray | None = None
    """(1 + n_laws, n_bushings) fraction of time in contact, of the fitted law and of those drawn; None: not known"""

    @property
    def contact_limits(self) -> np.ndarray:
        """(2, n_bushings) limits of the fraction of time in contact of another drawn law; nan where none is known.

        As `limits`, of arcsin √p of a fraction p, whose variance hardly depends on p (Anscombe, Biometrika 35, 1948).
        """
        if self.contact is None:
            return np.full((2, 0), np.nan)
        angle = np.arcsin(np.sqrt(np.clip(self.contact[1:], 0.0, 1.0)))
        half = self._quantile(len(angle)) * angle.std(axis=0, ddof=1)
        ends = np.array((angle.mean(axis=0) - half, angle.mean(axis=0) + half))
        return np.asarray(np.sin(np.clip(ends, 0.0, np.pi / 2)) ** 2)

    @functools.cached_property
    def limits(self) -> np.ndarray:
        """(2, n_outputs, n_inputs, n_f) lower and upper limit of the magnitude of another drawn law.

        The prediction interval of a lognormal variable, of which there are as many samples as laws: exp(m ± t s
        √(1 + 1/n)), t of Student's distribution with n - 1 degrees of freedom. Where the law's relative error σ is
        known, the half width is that of both, the root of the sum of the squares.
        """
        return self._about(self._half_width)

    @functools.cached_property
    def half_width_db(self) -> np.ndarray:
        """(n_outputs, n_inputs, n_f) half the width between the limits."""
        return DB * self._half_width

    def prediction(self, error: np.ndarray) -> np.ndarray:
        """Return the limits of the magnitude that a test is to show.

        Parameters
        ----------
        error : ndarray, shape (n_outputs, n_inputs, n_f)
            Standard deviation of the tested over the fitted magnitude, relative, in addition to the law's: of
            `paired_error`, or of the `signals.random_error` of both.

        Returns
        -------
        ndarray, shape (2, n_outputs, n_inputs, n_f)
        """
        return self._about(np.hypot(self._half_width, two_sided_quantile(self.confidence) * error))

    @functools.cached_property
    def _half_width(self) -> np.ndarray:
        drawn = self._quantile(len(self.drawn)) * np.log(self.drawn).std(axis=0, ddof=1)
        if self.missed is None:
            return np.asarray(drawn)
        return np.hypot(drawn, two_sided_quantile(self.confidence) * self.missed)

    def _quantile(self, n: int) -> float:
        """Return half the prediction interval of a normal variable over the standard deviation of n samples."""
        return two_sided_quantile(self.confidence, n - 1) * float(np.sqrt(1 + 1 / n))

    def _about(self, half_width: np.ndarray) -> np.ndarray:
        middle = np.log(self.drawn).mean(axis=0)
        return np.exp((middle - half_width, middle + half_width))


def inside(limits: np.ndarray | tuple[np.ndarray, np.ndarray], frf: FRF) -> float:
    """Return the fraction of an FRF's lines, of all sensors, whose magnitude lies between limits.

    Parameters
    ----------
    limits : ndarray, shape (2, n_outputs, n_inputs, n_f)
        Limits of a band, as in `Band.limits`.
    frf : FRF
        On the same lines.
    """
    magnitude = np.abs(frf.value)
    return float(np.mean((limits[0] <= magnitude) & (magnitude <= limits[1])))


@checks_kinds
def paired_error(test: Response, model: Response, resolution: float = 0.5) -> np.ndarray:
    """Return the relative standard deviation of a test's FRF magnitude about that of a model under the same excitation.

    The FRF of the difference of the responses is the difference of their FRFs; its random error comes from its
    coherence. Common scatter, such as most of a nonlinear rig's, drops out; noise and impacts that the model does not
    repeat stay.

    Parameters
    ----------
    test, model : Response
        Under one excitation, of the same sensors; refused as by `estimate_frf`.
    resolution : float
        Resolution of the FRFs, Hz.

    Returns
    -------
    ndarray, shape (n_outputs, n_inputs, n_f)
    """
    frf = estimate_frf(test, resolution=resolution, window="hann")
    difference = dataclasses.replace(test, channels=test.channels - model.channels)
    difference_frf = estimate_frf(difference, resolution=resolution, window="hann")
    return random_error(difference_frf) * np.abs(difference_frf.value) / np.abs(frf.value)


@checks_kinds
def frf_band(
    model: Model, excitation: Excitation, drawn: Sequence[Model], engine: Modal | None = None, resolution: float = 0.5,
    misfit: LawMisfit | None = None,
) -> Band:  # fmt: skip
    """Simulate a fitted model and the models drawn around it under one excitation.

    Parameters
    ----------
    model : Model
        The identified model.
    excitation : Excitation
        Excitation of every simulation.
    drawn : sequence of Model
        Models drawn by `Model.draw`.
    engine : Modal, optional
        Engine, as in `simulate_together`, whose errors it raises.
    resolution : float
        Resolution of the FRFs, Hz.
    misfit : LawMisfit, optional
        Misfit of the model in the records that it was identified from, which widens the band of FRFs measured under
        this excitation.
    """

    def keep(response: Response) -> tuple[FRF, np.ndarray | None]:
        return estimate_frf(response, resolution=resolution), response.contact_share

    simulated = simulate_and_keep([(m.rig, m.law) for m in (model, *drawn)], excitation, keep, engine)
    (first, *others), fractions = zip(*simulated)
    missed = None
    if misfit is not None:
        duration, level = excitation.value.size / excitation.fs, float(np.std(excitation.value))
        missed = misfit.spread(first.frequency, level, duration, resolution)[:, None]
    contact = None if any(fraction is None for fraction in fractions) else np.array(fractions)
    return Band(first, np.abs([other.value for other in others]), missed=missed, contact=contact)
