"""Parameters: what a fit, a calibration or a sweep varies, where it stands in a rig or law, and how well it is known.

A parameter is named in words or by a path into nested plain data, as TOML and JSON hold it: `bushings[0].gap`, or
`bushings.gap` for one value in all entries. The 0.4 of a place such as "inner@0.4" is a number too. `Estimates` are the
values and the covariance that every fit returns.
"""

from __future__ import annotations

import copy
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import scipy.stats
from numpy.typing import ArrayLike

from .errors import ClearanceError

__all__ = ["Combination", "Estimates", "Parameter"]

Key = tuple[str | int, ...]
"""names and indices that lead to one number in nested plain data"""
UNIDENTIFIED = 0.5
"""standard deviation of a logarithm, or a share, from which on the data do not identify it"""
REDUCED = 0.5
"""share of the prior standard deviation below which the data identify a parameter"""
HARDLY = 0.9
"""share of it above which the data told nothing worth the name"""
COUNTS = 0.1
"""exponent from which on a parameter counts to a combination"""
_PLACE = re.compile(r"(.+@)([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?)")
_STEP = re.compile(r"(?:^|\.)([A-Za-z_]\w*)|\[(\d{1,9})\]")


@dataclass(frozen=True)
class Parameter:
    """A number to find: where the search begins, what is possible, and what is known before."""

    name: str
    """in words, or a path into a rig or law"""
    unit: str
    """of its values, SI"""
    start: float
    """where the search begins, and the mean of the prior"""
    low: float
    """lower bound"""
    high: float
    """upper bound"""
    prior_std: float = math.inf
    """standard deviation before the fit, of the logarithm where that is what varies; infinite: the bounds only"""
    transform: Literal["log", "linear"] = "log"
    """what varies in a fit: the logarithm of a positive number, or the number"""

    def _forward(self, value: float) -> float:
        """What varies in a fit."""
        return float(np.log(value)) if self.transform == "log" else float(value)

    def _inverse(self, varied: np.ndarray) -> np.ndarray:
        """Values of what varies in a fit."""
        return np.exp(varied) if self.transform == "log" else np.asarray(varied)

    @property
    def known_std(self) -> float:
        """Standard deviation before the fit: the prior's, or that of the uniform distribution between the bounds."""
        if math.isfinite(self.prior_std):
            return self.prior_std
        return (self._forward(self.high) - self._forward(self.low)) / math.sqrt(12)


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
    """what was fitted"""
    value: np.ndarray
    """(n,) SI units"""
    varied_std: np.ndarray
    """(n,) standard deviation of what varies: of a logarithm, that of the value as a share of it; 0 where the data do
    not depend on the parameter"""
    correlation: np.ndarray
    """(n, n) of what varies; near ±1: the data identify only a combination of the two"""

    @classmethod
    def of(cls, parameters: Sequence[Parameter], value: ArrayLike, covariance: np.ndarray) -> Estimates:
        """Take values (n,), SI units, and covariance (n, n) of what varies: logarithms if the transform is "log"."""
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
        """(n,) bool: the data at least halve the standard deviation that was known before."""
        known = [REDUCED * p.known_std for p in self.parameters]
        return (self.varied_std > 0) & (self.varied_std < known)

    @property
    def told(self) -> np.ndarray:
        """(n,) standard deviation over the one that was known before: 1 where the data told nothing."""
        return self.varied_std / np.array([p.known_std for p in self.parameters])

    @property
    def only_prior(self) -> tuple[str, ...]:
        """Parameters that the data hardly told: their standard deviation is over 0.9 of what was known before."""
        return tuple(name for name, told in zip(self.names, self.told) if told > HARDLY)

    def interval(self, confidence: float = 0.95) -> np.ndarray:
        """Limits (2, n) within which each value lies with this probability, cut to the bounds."""
        half = scipy.stats.norm.ppf(0.5 + confidence / 2) * np.where(self.varied_std > 0, self.varied_std, np.inf)
        varied = self._forward(self.value)
        return self._inverse(np.array([varied - half, varied + half]))

    def widened(self, factor: float) -> Estimates:
        """Take standard deviations of the data to be larger by a factor; what was known before stays.

        C' = (P⁻¹ + (C⁻¹ - P⁻¹) / factor²)⁻¹, with the covariances C and, before the fit, P: what the data tell grows
        less, so that none is known worse than before.
        """
        width = np.array([p.prior_std for p in self.parameters])
        finite = np.isfinite(width)
        scale = np.where(finite, width, self.varied_std)
        told = np.linalg.inv(self.covariance / np.outer(scale, scale)) / factor**2
        precision = told + np.diag(np.where(finite, 1 - 1 / factor**2, 0.0))
        return Estimates.of(self.parameters, self.value, np.linalg.inv(precision) * np.outer(scale, scale))

    def draw(self, n: int, seed: int = 0) -> np.ndarray:
        """Draw values (n, n_parameters) from the normal distribution of what varies, cut to the bounds."""
        rng = np.random.default_rng(seed)
        return self._inverse(rng.multivariate_normal(self._forward(self.value), self.covariance, size=n, method="eigh"))

    def rows(self) -> tuple[dict[str, Any], ...]:
        """Return one row of plain data for each parameter, which `from_rows` takes.

        "relative_std" is the standard deviation of what varies: a share of the value, or, where the row has "varies":
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
        """Return one row of plain data for each parameter: found, with a 95 % interval, beside what was known before.

        Names, units and values in SI; "prior_std" and "posterior_std" are of what "varies", "told" is their ratio.
        """
        low, high = self.interval()
        return [
            {"name": p.name, "unit": p.unit, "value": float(v), "std": float(s), "low": float(a), "high": float(b),
             "before": p.start, "varies": p.transform, "prior_std": p.known_std, "posterior_std": float(w),
             "told": float(t)}
            for p, v, s, a, b, w, t in zip(
                self.parameters, self.value, self.std, low, high, self.varied_std, self.told
            )
        ]  # fmt: skip

    @classmethod
    def from_rows(cls, rows: Sequence[Mapping[str, Any]]) -> Estimates:
        """Take the plain data that `rows` returns."""
        parameters = tuple(
            Parameter(
                r["name"], r["unit"], r["value"], r["low"], r["high"], r.get("prior_std", math.inf),
                r.get("varies", "log"),
            )
            for r in rows
        )  # fmt: skip
        value, std, correlation = (np.array([r[k] for r in rows]) for k in ("value", "relative_std", "correlation"))
        return cls(parameters, value, std, correlation)

    def _forward(self, values: Sequence[float] | np.ndarray) -> np.ndarray:
        return np.array([p._forward(v) for p, v in zip(self.parameters, values)])

    def _inverse(self, varied: np.ndarray) -> np.ndarray:
        """Values (..., n) within the bounds."""
        inside = np.clip(
            varied, *(self._forward([getattr(p, end) for p in self.parameters]) for end in ("low", "high"))
        )
        return np.stack([p._inverse(column) for p, column in zip(self.parameters, np.moveaxis(inside, -1, 0))], axis=-1)


def principal_deviations(jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions (n, n), best known first, in which a linearised fit leaves its parameters open, and how far (n,).

    From the Jacobian (n_residuals, n) of residuals in standard deviations of the data; the covariance of the parameters
    is ``(direction.T * std**2) @ direction``.
    """
    _, singular, direction = np.linalg.svd(jacobian, full_matrices=jacobian.shape[0] < jacobian.shape[1])
    singular = np.append(singular, np.zeros(direction.shape[0] - singular.size))
    return direction, 1 / np.maximum(singular, 1e-9 * max(singular[0], 1.0))


def unidentified_combinations(names: Sequence[str], direction: np.ndarray, std: np.ndarray) -> tuple[Combination, ...]:
    """Combinations of logarithms that the data do not identify, least known first, out of `principal_deviations`."""
    found = []
    for v, s in zip(direction[::-1], std[::-1]):
        if s > UNIDENTIFIED:
            v = v * np.sign(v[np.argmax(np.abs(v))])
            found.append(Combination({name: float(e) for name, e in zip(names, v) if abs(e) > COUNTS}, float(s)))
    return tuple(found)


def find_numbers(data: dict[str, Any], path: str) -> list[Key]:
    """Keys of every number that a path stands for; the last name may be an optional field that is left out.

    Names are joined by dots, with [i] for one entry of a list; a list without it stands for all its entries.
    """
    steps = [int(number) if number else name for name, number in _STEP.findall(path)]
    if not path or _STEP.sub("", path):
        raise ClearanceError(f"{path!r} is not a path such as bushings[0].gap")
    return list(_found(data, steps, (), path))


def _found(data: Any, steps: list[str | int], before: Key, path: str) -> Iterator[Key]:
    if isinstance(data, list) and not (steps and isinstance(steps[0], int)):
        for i, item in enumerate(data):
            yield from _found(item, steps, (*before, i), path)
    elif not steps:
        if number_in(data) is None:
            raise ClearanceError(f"{path} holds {data!r}; only numbers can vary")
        yield before
    elif isinstance(data, dict) and steps[0] not in data and len(steps) == 1 and isinstance(steps[0], str):
        yield (*before, steps[0])
    else:
        try:
            inner = data[steps[0]]
        except (KeyError, IndexError, TypeError):
            raise ClearanceError(f"{path} leads nowhere: {_holds(data, before)}") from None
        yield from _found(inner, steps[1:], (*before, steps[0]), path)


def _holds(data: Any, before: Key) -> str:
    where = path_of(before) or "it"
    if isinstance(data, dict):
        return f"{where} has {', '.join(data)}"
    return f"{where} has {len(data)} entries" if isinstance(data, list) else f"{where} is {data!r}"


def path_of(key: Key) -> str:
    """Path that stands for one number."""
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in key)[1:]


def numbers(data: dict[str, Any] | list[Any]) -> Iterator[Key]:
    """Yield the key of every number."""
    for step, item in data.items() if isinstance(data, dict) else enumerate(data):
        if isinstance(item, dict | list):
            yield from ((step, *key) for key in numbers(item))
        elif number_in(item) is not None:
            yield (step,)


def number_in(item: object) -> float | None:
    """The number that plain data is, or holds behind an @; None if there is none."""
    if isinstance(item, str) and (place := _PLACE.fullmatch(item)):
        return float(place[2])
    return item if isinstance(item, int | float) and not isinstance(item, bool) else None


def with_number(item: object, number: float) -> float | str:
    """The same plain data with another number."""
    place = _PLACE.fullmatch(item) if isinstance(item, str) else None
    return f"{place[1]}{number!r}" if place else number


def get_number(data: Any, key: Key) -> float | None:
    """Number at a key, None where an optional field is left out."""
    for step in key[:-1]:
        data = data[step]
    return number_in(data.get(key[-1]) if isinstance(data, dict) else data[key[-1]])


def with_numbers(data: dict[str, Any], changes: Mapping[Key, float]) -> dict[str, Any]:
    """Copy of nested plain data with other numbers by their keys."""
    data = copy.deepcopy(data)
    for key, value in changes.items():
        part: Any = data
        for step in key[:-1]:
            part = part[step]
        part[key[-1]] = with_number(part.get(key[-1]) if isinstance(part, dict) else part[key[-1]], value)
    return data
