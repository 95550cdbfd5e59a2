"""Regressions on restoring forces: weights, non-negative least squares, and their covariance."""

from __future__ import annotations

import numpy as np
import scipy.linalg
import scipy.optimize

from .forces import RestoringForce

__all__ = ["LOCAL", "block_covariance", "non_negative", "weights"]

MODEL_ERROR = 0.03
"""share of the force's local RMS that a regression takes for error of its model, besides the noise"""
LOCAL = 0.5
"""s over which that RMS is taken, and length of a block of errors that hang together"""


def weights(force: RestoringForce, bushing: int) -> np.ndarray:
    """Return weights from the noise and the model's error, which grows with the force; 0 at the record's ends.

    Parameters
    ----------
    force : RestoringForce
        Of a record.
    bushing : int
        Its number.

    Returns
    -------
    ndarray, shape (n_t,)
        1/N.
    """
    size = max(1, int(LOCAL * force.fs))
    power = np.convolve(force.force[bushing] ** 2, np.full(size, 1 / size), "same")
    return force.valid / (force.force_std[bushing] + MODEL_ERROR * np.sqrt(np.maximum(power, 0)))


def non_negative(matrix: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Solve least squares with no negative share; by Cholesky, as the rows are very many and the columns scaled.

    Parameters
    ----------
    matrix : ndarray, shape (n, m)
        Columns to explain the target by.
    target : ndarray, shape (n,)
        What is explained.

    Returns
    -------
    ndarray, shape (m,)
    """
    scale = np.sqrt(np.sum(matrix**2, axis=0))
    scale = np.where(scale > 0, scale, 1.0)
    normal = (matrix.T @ matrix) / np.outer(scale, scale) + 1e-12 * np.eye(scale.size)
    r = np.linalg.cholesky(normal).T
    right = scipy.linalg.solve_triangular(r, (matrix.T @ target) / scale, trans="T")
    return scipy.optimize.nnls(r, right)[0] / scale


def block_covariance(jacobian: np.ndarray, left: np.ndarray, block: np.ndarray) -> np.ndarray:
    """Return a covariance that holds for errors correlated within blocks (Liang and Zeger 1986, independence).

    Parameters
    ----------
    jacobian : ndarray, shape (n, m)
        Of the model.
    left : ndarray, shape (n,)
        Residuals.
    block : ndarray, shape (n,)
        Number of each residual's block, from 0.

    Returns
    -------
    ndarray, shape (m, m)
        Infinite on the diagonal where the model does not depend on a parameter.
    """
    scale = np.sqrt(np.sum(jacobian**2, axis=0))
    depends = scale > 0
    scale = np.where(depends, scale, 1.0)
    scaled = jacobian / scale
    inverse = np.linalg.pinv(scaled.T @ scaled)
    scores = np.zeros((block.max() + 1, jacobian.shape[1]))
    np.add.at(scores, block, scaled * left[:, None])
    count = scores.shape[0]
    covariance = inverse @ scores.T @ scores @ inverse * count / max(count - jacobian.shape[1], 1)
    covariance /= np.outer(scale, scale)
    covariance[np.diag_indices_from(covariance)] = np.where(depends, np.abs(np.diag(covariance)), np.inf)
    return covariance
