"""Evidence: how probable data are under rival models, in Laplace's approximation."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["log_evidence", "rival_weights"]


def log_evidence(cost: float, at: np.ndarray, information: np.ndarray) -> float:
    """Return the logarithm of the probability of the data given a model, but for a constant of the data.

    Laplace's approximation for a posterior about ``at``, in prior standard deviations from the prior's mean (MacKay,
    Neural Computation 4, 1992): a parameter whose prior the data narrow by much costs as much.

    Parameters
    ----------
    cost : float
        Twice the negative log-likelihood at the optimum, without the priors.
    at : ndarray, shape (n,)
        The optimum, prior standard deviations.
    information : ndarray, shape (n, n)
        Information matrix of the data in the same coordinates.

    Returns
    -------
    float
        To compare with that of other models of the same data.
    """
    _, log_determinant = np.linalg.slogdet(information + np.eye(at.size))
    return float(-0.5 * (cost + at @ at + log_determinant))


def rival_weights(evidence: ArrayLike) -> np.ndarray:
    """Return the posterior probability (n,) of rival models that were equally probable, from their log evidence.

    Parameters
    ----------
    evidence : array_like, shape (n,)
        Logarithm of the evidence of each model of the same data.
    """
    relative = np.asarray(evidence, dtype=float)
    weight = np.exp(relative - relative.max())
    return np.asarray(weight / weight.sum())
