"""Regressions on restoring forces: weights and non-negative least squares."""

from __future__ import annotations

import numpy as np
import scipy.linalg
import scipy.optimize

from ..forces.restoring import RestoringForce

__all__: list[str] = []

MODEL_ERROR = 0.03  # fraction of the force's local RMS that a regression takes for its model's error, besides the noise
LOCAL = 0.5  # s over which that RMS is taken, and length of a block of correlated errors


def weights(force: RestoringForce, bushing: int) -> np.ndarray:
    """Return (n_t,) weights, 1/N: noise and the model's error, which grows with the force; 0 at the record's ends."""
    size = max(1, int(LOCAL * force.fs))
    power = np.convolve(force.force[bushing] ** 2, np.full(size, 1 / size), "same")
    return force.valid / (force.force_std[bushing] + MODEL_ERROR * np.sqrt(np.maximum(power, 0)))


def non_negative(matrix: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return non-negative coefficients (m,) by least squares; by Cholesky, as rows are very many, columns scaled."""
    scale = np.sqrt(np.sum(matrix**2, axis=0))
    scale = np.where(scale > 0, scale, 1.0)
    normal = (matrix.T @ matrix) / np.outer(scale, scale) + 1e-12 * np.eye(scale.size)
    r = np.linalg.cholesky(normal).T
    right = scipy.linalg.solve_triangular(r, (matrix.T @ target) / scale, trans="T")
    return scipy.optimize.nnls(r, right)[0] / scale
