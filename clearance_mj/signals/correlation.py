"""Agreement of two FRFs, or of two sets of mode shapes.

Arrays of FRFs are (n_outputs, n_inputs, n_f), or (n_outputs, n_f) of one input; test first, model second, on the same
degrees of freedom and frequency lines: nothing is interpolated. Arrays of other shapes raise RecordError. Criteria are
0 to 1, and 1 where test and model agree.

Allemang and Brown, A correlation coefficient for modal vector analysis, IMAC 1, 1982 (MAC); Heylen and Lammens, FRAC: a
consistent way of comparing frequency response functions, Swansea, 1996; Zang, Grafe and Imregun, Frequency-domain
criteria for correlating and updating dynamic finite element models, Mechanical Systems and Signal Processing 15, 2001
(CSAC, CSF); Grafe, Model updating of large structural dynamics models using measured response functions, Ph.D. thesis,
Imperial College London, 1998.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike

from ..core.errors import RecordError

__all__ = ["csac", "csac_per_sensor", "csf", "csf_per_sensor", "frac", "mac", "mre", "relative_error", "rmse_db"]


def relative_error(test: ArrayLike, model: ArrayLike) -> np.ndarray:
    """Return the relative error of natural frequencies, |f_m - f_t| / f_t.

    Parameters
    ----------
    test, model : array_like, shape (n,)
        Natural frequencies in one order, Hz.

    Returns
    -------
    ndarray, shape (n,)
    """
    test, model = np.asarray(test, dtype=float), np.asarray(model, dtype=float)
    if test.shape != model.shape:
        raise RecordError(f"test and model must have one shape, got {test.shape} and {model.shape}")
    return np.abs(model - test) / test


def mac(a: ArrayLike, b: ArrayLike) -> np.ndarray:
    """Return the modal assurance criterion, |aᴴb|² / ((aᴴa)(bᴴb)), of each shape of one set with each of another.

    Parameters
    ----------
    a, b : array_like, shape (n_dof, n_a) and (n_dof, n_b)
        Mode shapes as columns, real or complex; a complex factor is not seen.

    Returns
    -------
    ndarray, shape (n_a, n_b)
    """
    a, b = np.asarray(a), np.asarray(b)
    if a.ndim != 2 or b.ndim != 2 or a.shape[0] != b.shape[0]:
        raise RecordError(f"mode shapes must be (n_dof, n) with one n_dof, got {a.shape} and {b.shape}")
    return np.abs(a.conj().T @ b) ** 2 / np.outer(_energy(a, axis=0), _energy(b, axis=0))


def frac(test: ArrayLike, model: ArrayLike) -> np.ndarray:
    """Return the frequency response assurance criterion of each FRF, |Σ H_t H_m*|² / (Σ|H_t|² Σ|H_m|²) over the lines.

    Parameters
    ----------
    test, model : array_like, shape (n_outputs, [n_inputs,] n_f)
        FRFs, complex; a complex factor is not seen.

    Returns
    -------
    ndarray, shape (n_outputs, [n_inputs])
    """
    return _csac(*_products(*_pair(test, model), axis=-1))


def csac(test: ArrayLike, model: ArrayLike) -> np.ndarray:
    """Return the cross signature assurance criterion of each line, |H_tᴴH_m|² / ((H_tᴴH_t)(H_mᴴH_m)) over the outputs.

    It compares shapes along the structure and does not see a complex factor.

    Parameters
    ----------
    test, model : array_like, shape (n_outputs, [n_inputs,] n_f)
        FRFs, complex; at least two outputs, as it is 1 for one, whatever the FRFs.

    Returns
    -------
    ndarray, shape ([n_inputs,] n_f)
    """
    test, model = _pair(test, model)
    if test.shape[0] < 2:
        raise RecordError(
            f"CSAC compares shapes along the responses and needs at least 2, got {test.shape[0]}; use csac_per_sensor"
        )
    return _csac(*_products(test, model, axis=0))


def csf(test: ArrayLike, model: ArrayLike) -> np.ndarray:
    """Return the cross signature scale factor of each line, 2|H_tᴴH_m| / (H_tᴴH_t + H_mᴴH_m) over the outputs.

    It is 1 only where the FRFs agree in shape and in level; of one output it compares the level alone.

    Parameters
    ----------
    test, model : array_like, shape (n_outputs, [n_inputs,] n_f)
        Complex FRFs of test and model.

    Returns
    -------
    ndarray, shape ([n_inputs,] n_f)
    """
    return _csf(*_products(*_pair(test, model), axis=0))


def csac_per_sensor(test: ArrayLike, model: ArrayLike, window: int = 9) -> np.ndarray:
    """Return a variant of `csac` (n_outputs, [n_inputs,] n_f) for each FRF: a window of lines replaces the outputs.

    The article's Table 2 gives a CSAC for each sensor, where the criterion as published is 1 by definition. The window,
    an odd number of lines, is centred on its line and cut off at the ends of the band.
    """
    return _csac(*_products(*_windows(test, model, window), axis=-1))


def csf_per_sensor(test: ArrayLike, model: ArrayLike, window: int = 9) -> np.ndarray:
    """Return the variant of `csf` for each FRF, as `csac_per_sensor` is of `csac`."""
    return _csf(*_products(*_windows(test, model, window), axis=-1))


def mre(test: ArrayLike, model: ArrayLike) -> np.ndarray:
    """Return the mean relative error of the magnitude: mean over the lines of ||H_m| - |H_t|| / |H_t|, for each FRF.

    Parameters
    ----------
    test, model : array_like, shape (n_outputs, [n_inputs,] n_f)
        Complex FRFs of test and model.

    Returns
    -------
    ndarray, shape (n_outputs, [n_inputs])
    """
    test, model = _pair(test, model)
    return np.mean(np.abs(np.abs(model) - np.abs(test)) / np.abs(test), axis=-1)


def rmse_db(test: ArrayLike, model: ArrayLike) -> np.ndarray:
    """Return the root mean square over the lines of 20 log10(|H_m| / |H_t|), for each FRF, dB.

    Parameters
    ----------
    test, model : array_like, shape (n_outputs, [n_inputs,] n_f)
        Complex FRFs of test and model.

    Returns
    -------
    ndarray, shape (n_outputs, [n_inputs])
    """
    test, model = _pair(test, model)
    return np.sqrt(np.mean((20 * np.log10(np.abs(model) / np.abs(test))) ** 2, axis=-1))


def _energy(value: np.ndarray, axis: int) -> np.ndarray:
    return np.sum(np.abs(value) ** 2, axis=axis)


def _products(test: np.ndarray, model: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return |H_tᴴH_m|, H_tᴴH_t and H_mᴴH_m, summed over one axis."""
    return np.abs(np.sum(test.conj() * model, axis=axis)), _energy(test, axis), _energy(model, axis)


def _csac(cross: np.ndarray, test: np.ndarray, model: np.ndarray) -> np.ndarray:
    return cross**2 / (test * model)


def _csf(cross: np.ndarray, test: np.ndarray, model: np.ndarray) -> np.ndarray:
    return 2 * cross / (test + model)


def _pair(test: ArrayLike, model: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    test, model = np.asarray(test), np.asarray(model)
    if test.shape != model.shape or test.ndim not in (2, 3):
        raise RecordError(
            f"test and model FRFs must both be (n_outputs, n_f) or (n_outputs, n_inputs, n_f), got {test.shape} and "
            f"{model.shape}"
        )
    return test, model


def _windows(test: ArrayLike, model: ArrayLike, window: int) -> tuple[np.ndarray, np.ndarray]:
    """Return both as (..., n_f, window), with zeros beyond the ends: they add nothing to the sums."""
    if window < 3 or window % 2 != 1:
        raise RecordError(f"window must be an odd number of lines >= 3, got {window!r}")
    pair = _pair(test, model)
    ends = [(0, 0)] * (pair[0].ndim - 1) + [(window // 2, window // 2)]
    padded_test, padded_model = (np.pad(value, ends) for value in pair)
    return sliding_window_view(padded_test, window, axis=-1), sliding_window_view(padded_model, window, axis=-1)
