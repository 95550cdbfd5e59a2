"""Covariances of estimates whose residuals are correlated: jackknife and sandwich over blocks, correlation time."""

from __future__ import annotations

import numpy as np
import scipy.stats

from .estimates import principal_deviations

__all__ = ["coloured", "correlated_observations", "correlation_time", "jackknife", "sandwich", "student_widening"]

UNCORRELATED = 0.05  # autocorrelation from which on residuals count as independent
INFORMED = 1e-6  # of the largest information: directions with less are not informed by the data
NOISE_FLOOR = 1e-5  # standard deviation that is always assumed, so that perfect records have a covariance too


def jackknife(rows: np.ndarray, scores: np.ndarray, block: np.ndarray, prior: np.ndarray) -> np.ndarray:
    """Return the covariance (n, n) of a fit by leaving out one block of residuals after another.

    Residuals of one block may depend on each other in any way. Without block g the optimum moves by (A - A_g)⁻¹ s_g,
    with the information A and the block's parts A_g and s_g of it and of the gradient (MacKinnon, Nielsen and Webb,
    Journal of Applied Econometrics 38, 2023: CV3). A prior is one observation of unit variance.

    Parameters
    ----------
    rows : ndarray, shape (n_residuals, n)
        Jacobian, times the root of the curvature of a robust loss.
    scores : ndarray, shape (n_residuals, n)
        Contribution of each residual to half of the loss's gradient.
    block : ndarray, shape (n_residuals,)
        Number of each residual's block.
    prior : ndarray, shape (n, n)
        Information of the priors.

    Returns
    -------
    ndarray, shape (n, n)
        Infinite if there is one block only.
    """
    groups = [block == number for number in np.unique(block)]
    if len(groups) < 2:
        return np.full(prior.shape, np.inf)
    information = rows.T @ rows + prior
    changes = np.array([np.linalg.pinv(information - rows[g].T @ rows[g]) @ scores[g].sum(axis=0) for g in groups])
    inverse = np.linalg.pinv(information)
    return (len(groups) - 1) * np.cov(changes.T, bias=True) + inverse @ prior @ inverse


def student_widening(blocks: int) -> float:
    """Return the ratio of Student's 95 % interval of a mean of a few blocks to the normal one.

    Parameters
    ----------
    blocks : int
        Number of blocks, at least 2.
    """
    return float(scipy.stats.t.ppf(0.975, blocks - 1) / scipy.stats.norm.ppf(0.975))


def sandwich(jacobian: np.ndarray, residuals: np.ndarray, block: np.ndarray) -> np.ndarray:
    """Return the covariance (n, n) for residuals correlated within blocks.

    Liang and Zeger, Biometrika 73, 1986, with independence as the working correlation.

    Parameters
    ----------
    jacobian : ndarray, shape (n_residuals, n)
        Jacobian of the residuals.
    residuals : ndarray, shape (n_residuals,)
        At the optimum.
    block : ndarray of int, shape (n_residuals,)
        Number of each residual's block, from 0.

    Returns
    -------
    ndarray, shape (n, n)
        Infinite on the diagonal where the residuals do not depend on a parameter.
    """
    scale = np.sqrt(np.sum(jacobian**2, axis=0))
    depends = scale > 0
    scale = np.where(depends, scale, 1.0)
    scaled = jacobian / scale
    inverse = np.linalg.pinv(scaled.T @ scaled)
    scores = np.zeros((block.max() + 1, jacobian.shape[1]))
    np.add.at(scores, block, scaled * residuals[:, None])
    count = scores.shape[0]
    covariance = inverse @ scores.T @ scores @ inverse * count / max(count - jacobian.shape[1], 1)
    covariance /= np.outer(scale, scale)
    covariance[np.diag_indices_from(covariance)] = np.where(depends, np.abs(np.diag(covariance)), np.inf)
    return np.asarray(covariance)


def coloured(rows: np.ndarray, residuals: np.ndarray) -> np.ndarray:
    """Return the covariance (n, n) of a fit by output error, whose residuals are one stationary series.

    Ljung, System Identification, 2nd ed., 1999, section 9.4, with the residuals' variance over their correlation time.

    Parameters
    ----------
    rows : ndarray, shape (n_residuals, n)
        Jacobian, times the root of the curvature of a robust loss.
    residuals : ndarray, shape (n_residuals,)
        Residuals over the data's RMS.

    Returns
    -------
    ndarray, shape (n, n)
        Large, but finite, where the residuals hardly depend on a parameter.
    """
    direction, std = principal_deviations(rows)
    variance = residuals.var() * correlation_time(residuals) + NOISE_FLOOR**2
    return np.asarray((direction.T * std**2) @ direction * variance)


def correlation_time(residuals: np.ndarray) -> float:
    """Return the number of samples of a series that count as one: 1 + 2 Σρ up to its first lag below 0.05, at least 1.

    Parameters
    ----------
    residuals : ndarray, shape (n,)
        Evenly sampled residuals.
    """
    r = residuals - residuals.mean()
    spectrum = np.abs(np.fft.rfft(r, 2 * r.size)) ** 2
    rho = np.fft.irfft(spectrum)[: r.size]
    if rho[0] == 0:
        return 1.0
    rho = rho / rho[0]
    end = int(np.argmax(rho < UNCORRELATED)) or r.size
    return max(float(1 + 2 * np.sum(rho[1:end])), 1.0)


def correlated_observations(scores: np.ndarray, information: np.ndarray, least: float | None = None) -> float:
    """Return the number of residuals that count as one observation: tr(H⁻¹ V)/n, at least 1.

    V is the covariance that the scores of blocks show, H that of independent residuals of unit variance
    (Rao and Scott, Annals of Statistics 12, 1984; Ribatet, Cooley and Davison, Statistica Sinica 22, 2012).

    Parameters
    ----------
    scores : ndarray, shape (n_blocks, n)
        Contribution of the residuals of each block to half of the loss's gradient.
    information : ndarray, shape (n, n)
        Information matrix H of the data.
    least : float, optional
        Information from which on a direction is informed by the data. Default: 1e-6 of the largest.

    Returns
    -------
    float
        1 if no direction is informed.
    """
    value, direction = np.linalg.eigh(information)
    informed = value > (INFORMED * value[-1] if least is None else least)
    if not informed.any():
        return 1.0
    of_blocks = scores @ direction[:, informed]
    return max(1.0, float(np.mean(np.sum(of_blocks**2, axis=0) / value[informed])))
