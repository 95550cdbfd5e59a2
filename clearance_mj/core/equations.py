"""Systems of linear equations that compiled loops solve many times with one factorisation."""

from __future__ import annotations

import numpy as np

from .jit import STRICT, jit

__all__ = ["factorise", "solved"]

BLOCK = 12  # columns that are eliminated before the rest of the matrix is changed at once


@jit(**STRICT)
def factorise(matrix: np.ndarray, pivots: np.ndarray) -> None:
    """Factorise a matrix (n, n) in place by Gauss's elimination with partial pivots (n,), in blocks.

    As fast as LAPACK's from here, without calling it.
    """
    n = matrix.shape[0]
    for start in range(0, n, BLOCK):
        stop = min(start + BLOCK, n)
        for k in range(start, stop):
            p = k
            for i in range(k + 1, n):
                if abs(matrix[i, k]) > abs(matrix[p, k]):
                    p = i
            pivots[k] = p
            if p != k:
                for j in range(n):
                    matrix[k, j], matrix[p, j] = matrix[p, j], matrix[k, j]
            for i in range(k + 1, n):
                multiplier = matrix[i, k] / matrix[k, k]
                matrix[i, k] = multiplier
                if multiplier != 0.0:
                    for j in range(k + 1, stop):
                        matrix[i, j] -= multiplier * matrix[k, j]
        if stop == n:
            return
        for k in range(start, stop):
            for i in range(k + 1, stop):
                multiplier = matrix[i, k]
                for j in range(stop, n):
                    matrix[i, j] -= multiplier * matrix[k, j]
        change = np.dot(matrix[stop:, start:stop].copy(), matrix[start:stop, stop:].copy())
        for i in range(stop, n):
            for j in range(stop, n):
                matrix[i, j] -= change[i - stop, j - stop]


@jit(**STRICT)
def solved(factors: np.ndarray, pivots: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the solution (n,) for a right side (n,)."""
    n, x = right.size, right.copy()
    for k in range(n):
        x[k], x[pivots[k]] = x[pivots[k]], x[k]
    for k in range(n):
        for j in range(k):
            x[k] -= factors[k, j] * x[j]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            x[k] -= factors[k, j] * x[j]
        x[k] /= factors[k, k]
    return x
