"""Estimates: the values and the covariance that every fit returns, and combinations that the data do not identify."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy.stats
from numpy.typing import ArrayLike

from .parameter import Parameter

__all__ = ["Combination", "Estimates", "PrincipalDeviations", "principal_deviations", "unidentified_combinations"]

UNIDENTIFIED = 0.5
"""Standard deviation of a logarithm, or of a ratio, from which on the data do not identify a parameter."""
REDUCED = 0.5  # Posterior over prior standard deviation below which the data identify a parameter.
PRIOR_DOMINATED = 0.9  # Posterior over prior standard deviation above which the data add hardly anything to the prior.
COUNTS = 0.1  # Exponent from which on a parameter counts to a combination.


@dataclass(frozen=True)
class Combination:
    """A product of powers of parameters that the data do not identify."""

    exponent: dict[str, float]
    """of each parameter that counts"""
    std: float
    """standard deviation of its logarithm"""

    def __str__(self) -> str:
        powers = " × ".join(f"{path}^{power:+.2f}" for path, power in self.exponent.items())
        return powers if len(self.exponent) > 1 else next(iter(self.exponent))


@dataclass(frozen=True, eq=False)
class Estimates:
    """Fitted values of parameters and their covariance."""

    parameters: tuple[Parameter, ...]
    """the fitted parameters"""
    value: np.ndarray
    """(n,) SI units"""
    varied_std: np.ndarray
    """(n,) standard deviation of what varies: of a logarithm, that of the value relative to it; 0 where the data do not
    depend on the parameter"""
    correlation: np.ndarray
    """(n, n) of what varies; near ±1: the data identify only a combination of the two"""

    @classmethod
    def of(cls, parameters: Sequence[Parameter], value: ArrayLike, covariance: np.ndarray) -> Estimates:
        """Return estimates of values (n,), SI units, with covariance (n, n) of what varies: logarithms or values.

        Parameters
        ----------
        parameters : sequence of Parameter
            The fitted parameters.
        value : array_like, shape (n,)
            Values, SI units.
        covariance : ndarray, shape (n, n)
            Covariance of what varies: logarithms if the transform is "log".
        """
        std = np.sqrt(np.diag(covariance))
        with np.errstate(invalid="ignore"):  # of what is not known at all
            correlation = covariance / np.maximum(np.outer(std, std), np.finfo(float).tiny)
        return cls(tuple(parameters), np.asarray(value, dtype=float), std, correlation)

    @property
    def names(self) -> tuple[str, ...]:
        """(n,) names of the parameters."""
        return tuple(p.name for p in self.parameters)

    @property
    def covariance(self) -> np.ndarray:
        """(n, n) of what varies."""
        return np.outer(self.varied_std, self.varied_std) * self.correlation

    @property
    def std(self) -> np.ndarray:
        """(n,) standard deviations to first order, SI units; infinite where the data do not depend on a parameter."""
        slope = [v if p.transform == "log" else 1.0 for p, v in zip(self.parameters, self.value)]
        return np.where(self.varied_std > 0, slope * self.varied_std, np.inf)

    @property
    def identifiable(self) -> np.ndarray:
        """(n,) bool: the data at least halve the standard deviation of the prior."""
        known = [REDUCED * p.known_std for p in self.parameters]
        return (self.varied_std > 0) & (self.varied_std < known)

    @property
    def posterior_over_prior(self) -> np.ndarray:
        """(n,) posterior over prior standard deviation: 1 where the data add nothing to the prior."""
        return self.varied_std / np.array([p.known_std for p in self.parameters])

    @property
    def only_prior(self) -> tuple[str, ...]:
        """Parameters of which the data add hardly anything to the prior: posterior over prior beyond 0.9."""
        return tuple(name for name, ratio in zip(self.names, self.posterior_over_prior) if ratio > PRIOR_DOMINATED)

    def interval(self, confidence: float = 0.95) -> np.ndarray:
        """Return the limits (2, n) within which each value lies with this probability, cut to the bounds.

        Parameters
        ----------
        confidence : float
            Probability that an interval holds the true value.
        """
        half = scipy.stats.norm.ppf(0.5 + confidence / 2) * np.where(self.varied_std > 0, self.varied_std, np.inf)
        varied = self._to_varied(self.value)
        return self._from_varied(np.array([varied - half, varied + half]))

    def widened(self, factor: float) -> Estimates:
        """Return the estimates with standard deviations of the data larger by a factor; priors stay.

        C' = (P⁻¹ + (C⁻¹ - P⁻¹) / factor²)⁻¹, with the covariances C and, before the fit, P: the information of the data
        falls, so that none is known worse than before.

        Parameters
        ----------
        factor : float
            Factor on the standard deviations that the data alone give.
        """
        width = np.array([p.prior_std for p in self.parameters])
        finite = np.isfinite(width)
        scale = np.where(finite, width, self.varied_std)
        of_data = np.linalg.inv(self.covariance / np.outer(scale, scale)) / factor**2
        precision = of_data + np.diag(np.where(finite, 1 - 1 / factor**2, 0.0))
        return Estimates.of(self.parameters, self.value, np.linalg.inv(precision) * np.outer(scale, scale))

    def with_rivals(self, rivals: Iterable[tuple[float, Mapping[str, float]]]) -> Estimates:
        """Return the same values with their covariance widened by the values of rival fits.

        Parameters
        ----------
        rivals : iterable of (float, mapping of str to float)
            Probability and values by name of each; parameters that it does not name stay where they are.
        """
        covariance, varied = self.covariance.copy(), self._to_varied(self.value)
        for weight, values in rivals:
            deviation = self._to_varied([values.get(p.name, v) for p, v in zip(self.parameters, self.value)]) - varied
            covariance += weight * np.outer(deviation, deviation)
        return Estimates.of(self.parameters, self.value, covariance)

    def draw(self, n: int, seed: int = 0) -> np.ndarray:
        """Draw values (n, n_parameters) from the normal distribution of what varies, cut to the bounds.

        Parameters
        ----------
        n : int
            Number of draws.
        seed : int
            Seed of the random numbers.
        """
        mean, rng = self._to_varied(self.value), np.random.default_rng(seed)
        return self._from_varied(rng.multivariate_normal(mean, self.covariance, size=n, method="eigh"))

    def rows(self) -> tuple[dict[str, Any], ...]:
        """Return one row of plain data for each parameter, which `from_rows` takes.

        "relative_std" is the standard deviation of what varies: relative to the value, or, where the row has "varies":
        "linear", in the value's unit.
        """
        return tuple(
            {"name": p.name, "unit": p.unit, "value": float(v), "low": p.low, "high": p.high}
            | {"relative_std": float(s), "correlation": r.tolist()}
            | ({"varies": p.transform} if p.transform != "log" else {})
            | ({"prior_std": p.prior_std} if math.isfinite(p.prior_std) else {})
            for p, v, s, r in zip(self.parameters, self.value, self.varied_std, self.correlation)
        )

    def beside_priors(self) -> list[dict[str, Any]]:
        """Return one row of plain data for each parameter: its value with a 95 % interval, and its prior.

        Names, units and values in SI; "prior_std" and "posterior_std" are of what "varies",
        "posterior_over_prior" is their ratio.
        """
        low, high = self.interval()
        return [
            {"name": p.name, "unit": p.unit, "value": float(v), "std": float(s), "low": float(a), "high": float(b),
             "before": p.start, "varies": p.transform, "prior_std": p.known_std, "posterior_std": float(w),
             "posterior_over_prior": float(t)}
            for p, v, s, a, b, w, t in zip(
                self.parameters, self.value, self.std, low, high, self.varied_std, self.posterior_over_prior
            )
        ]  # fmt: skip

    @classmethod
    def from_rows(cls, rows: Sequence[Mapping[str, Any]]) -> Estimates:
        """Return the estimates of the plain data that `rows` returns.

        Parameters
        ----------
        rows : sequence of mapping
            One for each parameter.
        """
        parameters = []
        for r in rows:
            prior, varies = r.get("prior_std", math.inf), r.get("varies", "log")
            parameters.append(Parameter(r["name"], r["unit"], r["value"], r["low"], r["high"], prior, varies))
        value, std, correlation = (np.array([r[k] for r in rows]) for k in ("value", "relative_std", "correlation"))
        return cls(tuple(parameters), value, std, correlation)

    def _to_varied(self, values: Sequence[float] | np.ndarray) -> np.ndarray:
        return np.array([p.to_varied(v) for p, v in zip(self.parameters, values)])

    def _from_varied(self, varied: np.ndarray) -> np.ndarray:
        """Values (..., n) within the bounds."""
        low, high = (self._to_varied([getattr(p, end) for p in self.parameters]) for end in ("low", "high"))
        columns = np.moveaxis(np.clip(varied, low, high), -1, 0)
        return np.stack([p.from_varied(column) for p, column in zip(self.parameters, columns)], axis=-1)


class PrincipalDeviations(NamedTuple):
    """Principal axes of the uncertainty of a fit; its covariance is ``(direction.T * std**2) @ direction``."""

    direction: np.ndarray  #: (n, n) unit vectors in its rows, best known first
    std: np.ndarray  #: (n,) standard deviation along each


def principal_deviations(jacobian: np.ndarray) -> PrincipalDeviations:
    """Return the principal axes of the uncertainty of a linearised fit.

    Parameters
    ----------
    jacobian : ndarray, shape (n_residuals, n)
        Derivatives of residuals in standard deviations of the data.
    """
    _, singular, direction = np.linalg.svd(jacobian, full_matrices=jacobian.shape[0] < jacobian.shape[1])
    singular = np.append(singular, np.zeros(direction.shape[0] - singular.size))
    return PrincipalDeviations(direction, 1 / np.maximum(singular, 1e-9 * max(singular[0], 1.0)))


def unidentified_combinations(names: Sequence[str], direction: np.ndarray, std: np.ndarray) -> tuple[Combination, ...]:
    """Return combinations of logarithms that the data do not identify, least known first, by `principal_deviations`.

    Parameters
    ----------
    names : sequence of str
        Names of the parameters.
    direction : ndarray, shape (n, n)
        Principal directions, best known first.
    std : ndarray, shape (n,)
        Standard deviation in each direction.
    """
    combinations = []
    for v, s in zip(direction[::-1], std[::-1]):
        if s > UNIDENTIFIED:
            v = v * np.sign(v[np.argmax(np.abs(v))])
            combinations.append(Combination({name: float(e) for name, e in zip(names, v) if abs(e) > COUNTS}, float(s)))
    return tuple(combinations)
