"""Response surface fitted to designs, with its error of cross-validation."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.interpolate import RBFInterpolator

from ..core.errors import ClearanceError

__all__ = ["Learnt", "learn"]

FOLDS = 10
FEWEST = 20  # designs

Function = Callable[[np.ndarray], np.ndarray]
Fit = Callable[[np.ndarray, np.ndarray], Function]


class Learnt(NamedTuple):
    """A response surface over deviations of designs from the middle."""

    function: Function  #: of deviations (n, n_numbers), its values (n,)
    error: float  #: RMS error of cross-validation


def learn(deviations: np.ndarray, values: np.ndarray) -> Learnt:
    """Return the function with the least error of cross-validation: linear, quadratic, or radial on either.

    Parameters
    ----------
    deviations : ndarray, shape (n, n_numbers)
        Deviations of designs from the middle.
    values : ndarray, shape (n,)
        Values of a result.

    Raises
    ------
    ClearanceError
        If there are too few designs.
    """
    n, d = deviations.shape
    if n < max(FEWEST, 2 * (d + 1)):
        raise ClearanceError(f"{n} designs are too few for {d} numbers; take {max(FEWEST, 2 * (d + 1))} or more")
    folds = np.arange(n) % FOLDS

    def error(fit: Fit) -> float:
        residual = np.empty(n)
        for fold in range(FOLDS):
            is_test = folds == fold
            residual[is_test] = fit(deviations[~is_test], values[~is_test])(deviations[is_test]) - values[is_test]
        return float(np.sqrt(np.mean(residual**2)))

    enough = n * (1 - 1 / FOLDS) >= 1.5 * _terms(deviations[:1]).shape[1]
    fits = [_linear, _quadratic, _radial, _radial_on_quadratic] if enough else [_linear, _radial]
    errors = {fit: error(fit) for fit in fits}
    best = min(fits, key=lambda fit: errors[fit])
    return Learnt(best(deviations, values), errors[best])


def _linear(x: np.ndarray, y: np.ndarray) -> Function:
    weights = np.linalg.lstsq(np.column_stack((np.ones(len(x)), x)), y, rcond=None)[0]
    return lambda at: weights[0] + at @ weights[1:]


def _terms(x: np.ndarray) -> np.ndarray:
    i, j = np.triu_indices(x.shape[1])
    return np.column_stack((np.ones(len(x)), x, x[:, i] * x[:, j]))


def _quadratic(x: np.ndarray, y: np.ndarray) -> Function:
    weights = np.linalg.lstsq(_terms(x), y, rcond=None)[0]
    return lambda at: _terms(at) @ weights


def _radial(x: np.ndarray, y: np.ndarray) -> Function:
    return RBFInterpolator(x, y, kernel="cubic", degree=1)


def _radial_on_quadratic(x: np.ndarray, y: np.ndarray) -> Function:
    trend = _quadratic(x, y)
    residual = RBFInterpolator(x, y - trend(x), kernel="linear", degree=0)
    return lambda at: trend(at) + residual(at)
