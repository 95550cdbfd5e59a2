"""Losses: how much residuals count, and the weights that Gauss-Newton steps take from them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from .covariance import correlated_observations

__all__ = ["GroupedHuber", "Loss", "LossWeights", "SoftL1", "Squares", "UnknownScale"]


class LossWeights(NamedTuple):
    """Weights (n_residuals,) of residuals r with the Jacobian J."""

    score: np.ndarray  #: half of the gradient is Jᵀ (score · r)
    curvature: np.ndarray  #: half of the second derivative is about Jᵀ diag(curvature) J


class Loss(ABC):
    """Twice the negative log-likelihood of residuals, but for a constant."""

    divisor: float = 1.0
    """number of residuals that count as one observation; `cost` allows for it, `weights` do not"""

    @abstractmethod
    def cost(self, residuals: np.ndarray) -> np.ndarray:
        """Return the loss (n_points,).

        Parameters
        ----------
        residuals : ndarray, shape (n_points, n_residuals)
            At several points.
        """

    @abstractmethod
    def weights(self, residuals: np.ndarray) -> LossWeights:
        """Return the weights of residuals.

        Parameters
        ----------
        residuals : ndarray, shape (n_residuals,)
            At one point.
        """

    def adapted(self, residuals: np.ndarray, jacobian: np.ndarray) -> Loss:
        """Return the loss adapted to residuals and their derivatives; by default it is the same.

        Parameters
        ----------
        residuals : ndarray, shape (n_residuals,)
            At one point.
        jacobian : ndarray, shape (n_residuals, n)
            Jacobian at that point.
        """
        return self


@dataclass(frozen=True)
class Squares(Loss):
    """Sum of the squares of residuals with unit variance."""

    def cost(self, residuals: np.ndarray) -> np.ndarray:
        """Return Σ |r|² (n_points,)."""
        return np.sum(np.abs(residuals) ** 2, axis=-1)

    def weights(self, residuals: np.ndarray) -> LossWeights:
        """Return ones."""
        ones = np.ones(residuals.shape)
        return LossWeights(ones, ones)


@dataclass(frozen=True)
class SoftL1(Loss):
    """Soft L1 loss 2 s² (√(1 + (r/s)²) - 1): squares below the scale s, amounts above it."""

    scale: float = 1.0
    """s"""

    def cost(self, residuals: np.ndarray) -> np.ndarray:
        """Return Σ 2 s² (√(1 + (r/s)²) - 1) (n_points,)."""
        return np.sum(2 * self.scale**2 * (self._root(residuals) - 1), axis=-1)

    def weights(self, residuals: np.ndarray) -> LossWeights:
        """Return first and second derivative: 1/√(1 + (r/s)²) and its third power."""
        score = 1 / self._root(residuals)
        return LossWeights(score, score**3)

    def _root(self, residuals: np.ndarray) -> np.ndarray:
        return np.sqrt(1 + np.abs(residuals / self.scale) ** 2)


@dataclass(frozen=True, eq=False)
class GroupedHuber(Loss):
    """Huber's loss of the size s of each group of residuals: s² up to c, 2 c s - c² above it."""

    radius: np.ndarray
    """(n_groups,) c; residuals are groups of equal number, one after another"""

    def cost(self, residuals: np.ndarray) -> np.ndarray:
        """Return Σ s² or 2 c s - c² (n_points,)."""
        size, c = self._size(residuals), self.radius
        return np.sum(np.where(size > c, 2 * c * size - c**2, size**2), axis=-1)

    def weights(self, residuals: np.ndarray) -> LossWeights:
        """Return c/s, at most 1, for the residuals of each group."""
        weight = self.radius / np.maximum(self._size(residuals), self.radius)
        repeated = np.repeat(weight, residuals.size // self.radius.size)
        return LossWeights(repeated, repeated)

    def _size(self, residuals: np.ndarray) -> np.ndarray:
        return np.linalg.norm(residuals.reshape(*residuals.shape[:-1], self.radius.size, -1), axis=-1)


@dataclass(frozen=True, eq=False)
class UnknownScale(Loss):
    """Errors of unknown size that are correlated within blocks: n/m log of the mean soft L1 loss of n residuals.

    The number m of residuals that count as one observation follows from the scores of the blocks at every step
    (Ribatet, Cooley and Davison, Statistica Sinica 22, 2012), so that neither noise nor its correlation need be known.
    """

    blocks: np.ndarray
    """(n_blocks,) first residual of each block"""
    largest: float = np.inf
    """of m during the search: far from the optimum all residuals seem to be correlated"""
    correlated: float = 0.0
    """m; 0: not known yet, a block then counts as one observation"""

    @property
    def divisor(self) -> float:  # type: ignore[override]
        """Number of residuals that count as one observation, m, but not more than the largest."""
        return min(self.correlated, self.largest)

    def scale(self, residuals: np.ndarray) -> np.ndarray:
        """Return the mean soft L1 loss (n_points,), a robust variance.

        Parameters
        ----------
        residuals : ndarray, shape (n_points, n_residuals)
            At several points.
        """
        return np.mean(2 * (np.sqrt(1 + residuals**2) - 1), axis=-1)

    def losses(self, residuals: np.ndarray) -> np.ndarray:
        """Return the sums of the loss over blocks (n_blocks,): n times `scale` in all.

        Parameters
        ----------
        residuals : ndarray, shape (n_residuals,)
            At one point.
        """
        return np.add.reduceat(2 * (np.sqrt(1 + residuals**2) - 1), self.blocks)

    def cost(self, residuals: np.ndarray) -> np.ndarray:
        """Return n/m log of the scale (n_points,)."""
        n = residuals.shape[-1]
        count = self.divisor or n / self.blocks.size
        return n / count * np.log(self.scale(residuals))

    def weights(self, residuals: np.ndarray) -> LossWeights:
        """Return 1/√(1 + r²) over the scale."""
        weight = 1 / (np.sqrt(1 + residuals**2) * self.scale(residuals))
        return LossWeights(weight, weight)

    def adapted(self, residuals: np.ndarray, jacobian: np.ndarray) -> UnknownScale:
        """Return the loss with the m that follows from the scores of the blocks."""
        weight = self.weights(residuals).score
        information = (jacobian.T * weight) @ jacobian
        scores = np.add.reduceat(jacobian * (weight * residuals)[:, None], self.blocks, axis=0)
        return replace(self, correlated=correlated_observations(scores, information))
