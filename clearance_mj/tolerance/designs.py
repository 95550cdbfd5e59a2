"""Designs: models of a production, drawn from a scatter or from a posterior."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import norm

from ..calibrate.free import with_values
from ..clearance.law_files import law_from_dict
from ..clearance.modelled import nominal_law
from ..core.checks import naming
from ..core.errors import ClearanceError
from ..core.plain_numbers import Key, find_numbers, get_number, path_of, replace_numbers
from ..model import Model
from ..rig.tolerance import unit_of
from ..statistics.sobol import unit_points
from .scattered import LAW, Correlation, Scattered

__all__ = ["Designs", "DrawingRule", "changed", "is_datasheet"]

_UNIT_INTERVAL = 1e-12  # least distance of a probability from 0 and 1


class DrawingRule:
    """Map from a unit cube to designs: the scattering numbers of a model, and their correlations."""

    def __init__(self, numbers: Sequence[Scattered], correlations: Sequence[Correlation], model: Model):
        self.model = model
        data = {"rig": model.rig.to_dict(), "law": None if is_datasheet(model) else model.law.to_dict()}
        pairs = [(each, key) for each in numbers for key in _find_keys(data, each.of)]
        self.keys = [key for _, key in pairs]
        self.names = [_path_name(key) for key in self.keys]
        if len({*self.names}) < len(self.names):
            duplicate = next(name for i, name in enumerate(self.names) if name in self.names[:i])
            raise ClearanceError(f"{duplicate} scatters twice; give each number once")
        self.numbers = [each for each, _ in pairs]
        self.owner = np.array([i for i, each in enumerate(numbers) for other, _ in pairs if other is each])
        self.values = np.array([_nominal_value(data, key) for key in self.keys])
        self.gaps = [_reference_gap(data, key) for key in self.keys]
        self.mixing = _mixing_matrix(correlations, self.names)
        self._require_possible_ends()

    def _require_possible_ends(self) -> None:
        """Raise a ClearanceError if the rig is impossible at an end of the scatter of one of the numbers."""
        ends = np.array([_UNIT_INTERVAL, 1 - _UNIT_INTERVAL])
        for i, (number, name) in enumerate(zip(self.numbers, self.names)):
            limits = number.quantile(ends, self.values[i], self.gaps[i])
            unit = "" if name.startswith(LAW) else f" {unit_of(name)}".rstrip()
            ends_in_words = f"{limits[0]:.4g} to {limits[1]:.4g}{unit}"
            for value in limits:
                what = f"scatter of {name} reaches from {ends_in_words}; at {value:.4g} the model is impossible"
                with naming(what, ClearanceError, ClearanceError):
                    changed(self.model, [self.keys[i]], [value])

    def deviations(self, designs: Designs) -> np.ndarray:
        """Return the deviations of the designs' numbers from their middles, over the distance of their limits.

        Parameters
        ----------
        designs : Designs
            n designs.

        Returns
        -------
        ndarray, shape (n, n_numbers)
        """
        columns = zip(self.numbers, designs.values.T, self.values, self.gaps)
        return np.stack([number.deviation(column, value, gap) for number, column, value, gap in columns], axis=1)

    def draw(self, n: int, seed: int = 0) -> Designs:
        """Return designs of scrambled Sobol' points, of which the first ones stay the same if more are drawn.

        Parameters
        ----------
        n : int
            Number of designs.
        seed : int
            Seed of the points.
        """
        if n < 1:
            raise ClearanceError(f"designs must be 1 or more, got {n}")
        return self.designs(unit_points("sobol", n, len(self.names), seed))

    def designs(self, shares: np.ndarray) -> Designs:
        """Return the designs of points (n, n_numbers) of a unit cube, before correlations.

        Parameters
        ----------
        shares : ndarray, shape (n, n_numbers)
            Independent and uniform.
        """
        scores = norm.ppf(np.clip(shares, _UNIT_INTERVAL, 1 - _UNIT_INTERVAL)) @ self.mixing.T
        columns = zip(self.numbers, norm.cdf(scores).T, self.values, self.gaps)
        values = np.stack([number.quantile(share, value, gap) for number, share, value, gap in columns], axis=1)
        return Designs(self.model, tuple(self.names), values, tuple(self.keys))


@dataclass(frozen=True, eq=False)
class Designs:
    """Drawn models of a production."""

    nominal: Model
    """model whose numbers scatter"""
    names: tuple[str, ...]
    """paths of the numbers that differ; none for draws from a posterior"""
    values: np.ndarray
    """(n, n_numbers) in SI units"""
    keys: tuple[Key, ...] = ()
    """of the numbers in the model's plain data"""
    drawn: tuple[Model, ...] = ()
    """of a posterior, instead of numbers"""

    def __len__(self) -> int:
        return len(self.drawn) or len(self.values)

    def __getitem__(self, which: slice) -> Designs:
        """Return some of the designs."""
        return replace(self, values=self.values[which], drawn=self.drawn[which])

    def model(self, i: int) -> Model:
        """Return a design.

        Parameters
        ----------
        i : int
            Its number.

        Raises
        ------
        ClearanceError
            If it is impossible, such as an offset beyond the gap.
        """
        if self.drawn:
            return self.drawn[i]
        try:
            return changed(self.nominal, self.keys, self.values[i].tolist())
        except ClearanceError as error:
            settings = ", ".join(f"{name} = {value:.4g}" for name, value in zip(self.names, self.values[i]))
            raise ClearanceError(f"design {i} is impossible: {error} ({settings})") from None


def changed(model: Model, keys: Sequence[Key], values: Sequence[float]) -> Model:
    """Return a model with other numbers by their keys in ``{"rig": ..., "law": ...}``.

    A law that is the datasheet's follows the rig.
    """
    of_rig = {key[1:]: value for key, value in zip(keys, values) if key[0] == "rig"}
    of_law = {key[1:]: value for key, value in zip(keys, values) if key[0] == "law"}
    rig = with_values(model.rig, of_rig) if of_rig else model.rig
    if of_law:
        law = law_from_dict(replace_numbers(model.law.to_dict(), of_law))
    else:
        law = nominal_law(rig) if is_datasheet(model) else model.law
    return replace(model, rig=rig, law=law, posterior=None)


def is_datasheet(model: Model) -> bool:
    """Return True if a model's law is that of its rig file."""
    return model.law == nominal_law(model.rig)


def _find_keys(data: dict[str, Any], path: str) -> list[Key]:
    of_law = path.startswith(LAW)
    if of_law and data["law"] is None:
        raise ClearanceError(f"scatter of {path}: the model has no law of its own; scatter bushings[0].contact instead")
    if not of_law and data["law"] is not None and "contact" in path:
        raise ClearanceError(f"scatter of {path}: has no effect beside the model's law; scatter law. instead")
    part, subpath = ("law", path.removeprefix(LAW)) if of_law else ("rig", path)
    with naming("scatter", ClearanceError):
        return [(part, *key) for key in find_numbers(data[part], subpath)]


def _path_name(key: Key) -> str:
    return path_of(key[1:] if key[0] == "rig" else key)


def _nominal_value(data: dict[str, Any], key: Key) -> float:
    value = get_number(data, key)
    if value is None and key[-1] in ("offset", "offset_y"):
        return 0.0
    if value is None:
        raise ClearanceError(f"scatter of {_path_name(key)}: the rig has no such number; write it into the rig file")
    return float(value)


def _reference_gap(data: dict[str, Any], key: Key) -> float | None:
    """Return the gap to which an offset's relative tolerance refers."""
    return float(data["rig"]["bushings"][key[2]]["gap"]) if key[-1] in ("offset", "offset_y") else None


def _mixing_matrix(correlations: Sequence[Correlation], names: Sequence[str]) -> np.ndarray:
    """Return the matrix (n, n) that correlates independent normal scores."""
    matrix = np.eye(len(names))
    for pair in correlations:
        for name in pair.of:
            if name not in names:
                raise ClearanceError(f"correlation of {name}: it does not scatter; known: {', '.join(names)}")
        i, j = (names.index(name) for name in pair.of)
        if i == j or matrix[i, j]:
            raise ClearanceError(f"correlation of {pair.of[0]} and {pair.of[1]}: give each pair of two numbers once")
        matrix[i, j] = matrix[j, i] = pair.value
    values, vectors = np.linalg.eigh(matrix)
    if values[0] < -1e-10:
        contradicting = [names[i] for i in np.argsort(-np.abs(vectors[:, 0]))[:3]]
        raise ClearanceError(
            f"the correlations are no correlation matrix (its smallest eigenvalue is {values[0]:.3g}, must be 0 or "
            f"more): those of {', '.join(contradicting)} contradict each other; take smaller ones"
        )
    return vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T if correlations else matrix
