"""How well two FRFs, or two sets of modes, agree.

Arrays of FRFs are (n_resp, n_f), test first, model second, on the same responses and frequency lines: nothing is
interpolated.
"""

from __future__ import annotations

import numpy as np

from .errors import RecordError

__all__ = [
    "csac",
    "csac_per_sensor",
    "csf",
    "csf_per_sensor",
    "frac",
    "mac",
    "mre",
    "relative_error",
    "rmse_db",
]


def relative_error(test, model) -> np.ndarray:
    """Relative error of natural frequencies, |f_m - f_t| / f_t.

    Parameters
    ----------
    test, model : array_like, shape (n,)
        Natural frequencies in one order, Hz.

    Returns
    -------
    ndarray, shape (n,)

    Raises
    ------
    RecordError
        If the shapes differ.
    """
    test, model = np.asarray(test, dtype=float), np.asarray(model, dtype=float)
    if test.shape != model.shape:
        raise RecordError(f"test and model must have one shape, got {test.shape} and {model.shape}")
    return np.abs(model - test) / test


def mac(a, b) -> np.ndarray:
    """Modal assurance criterion, |aᴴb|² / ((aᴴa)(bᴴb)), of each shape of one set with each of another.

    Parameters
    ----------
    a : array_like, shape (n_dof, n_a)
        Mode shapes as columns, real or complex.
    b : array_like, shape (n_dof, n_b)
        The same degrees of freedom.

    Returns
    -------
    ndarray, shape (n_a, n_b)
        0 (orthogonal) to 1 (equal but for a complex factor).

    Raises
    ------
    RecordError
        If they are not columns over the same degrees of freedom.

    Notes
    -----
    Allemang and Brown, A correlation coefficient for modal vector analysis, IMAC 1, 1982.
    """
    a, b = np.asarray(a), np.asarray(b)
    if a.ndim != 2 or b.ndim != 2 or a.shape[0] != b.shape[0]:
        raise RecordError(f"mode shapes must be (n_dof, n) with one n_dof, got {a.shape} and {b.shape}")
    return np.abs(a.conj().T @ b) ** 2 / np.outer(_energy(a, axis=0), _energy(b, axis=0))


def frac(test, model) -> np.ndarray:
    """Frequency response assurance criterion of each response.

    |Σ H_t H_m*|² / (Σ|H_t|² Σ|H_m|²), summed over the lines; it does not see a complex scale factor.

    Parameters
    ----------
    test, model : array_like, shape (n_resp, n_f)
        FRFs, complex.

    Returns
    -------
    ndarray, shape (n_resp,)
        0 to 1.

    Raises
    ------
    RecordError
        If the shapes differ or are not (n_resp, n_f).

    Notes
    -----
    Heylen and Lammens, FRAC: a consistent way of comparing frequency response functions, Swansea, 1996.
    """
    test, model = _pair(test, model)
    product = np.abs(np.sum(test * model.conj(), axis=1))
    return product**2 / (_energy(test, axis=1) * _energy(model, axis=1))


def csac(test, model) -> np.ndarray:
    """Cross signature assurance criterion of each line, |H_tᴴH_m|² / ((H_tᴴH_t)(H_mᴴH_m)) over the responses.

    It compares shapes along the structure and does not see a complex scale factor.

    Parameters
    ----------
    test, model : array_like, shape (n_resp, n_f)
        FRFs, complex; at least two responses, as it is 1 for one, whatever the FRFs.

    Returns
    -------
    ndarray, shape (n_f,)
        0 to 1.

    Raises
    ------
    RecordError
        If the shapes differ, are not (n_resp, n_f) or hold one response.

    Notes
    -----
    Zang, Grafe and Imregun, Frequency-domain criteria for correlating and updating dynamic finite element
    models, Mechanical Systems and Signal Processing 15, 2001.
    """
    return _csac(*_products(*_several("CSAC", test, model)))


def csf(test, model) -> np.ndarray:
    """Cross signature scale factor of each line, 2|H_tᴴH_m| / (H_tᴴH_t + H_mᴴH_m) over the responses.

    It is 1 only where the FRFs agree in shape and in level.

    Parameters
    ----------
    test, model : array_like, shape (n_resp, n_f)
        FRFs, complex; at least two responses.

    Returns
    -------
    ndarray, shape (n_f,)
        0 to 1.

    Raises
    ------
    RecordError
        If the shapes differ, are not (n_resp, n_f) or hold one response.

    Notes
    -----
    Grafe, Model updating of large structural dynamics models using measured response functions, Ph.D. thesis,
    Imperial College London, 1998; Zang, Grafe and Imregun 2001, as for `csac`.
    """
    return _csf(*_products(*_several("CSF", test, model)))


def csac_per_sensor(test, model, window: int = 9) -> np.ndarray:
    """Variant of `csac` for one sensor: a window of lines takes the place of the vector over the responses.

    The article's Table 2 gives a CSAC for each sensor, where the criterion as published is 1 by definition.

    Parameters
    ----------
    test, model : array_like, shape (n_resp, n_f)
        FRFs, complex.
    window : int
        Lines in the window, odd, at least 3; it is centred on its line and cut off at the ends of the band.

    Returns
    -------
    ndarray, shape (n_resp, n_f)
        0 to 1.

    Raises
    ------
    RecordError
        If the shapes differ, are not (n_resp, n_f), or the window is no odd number >= 3.
    """
    return _csac(*_products(*_windows(test, model, window), axis=-1))


def csf_per_sensor(test, model, window: int = 9) -> np.ndarray:
    """Variant of `csf` for one sensor, as `csac_per_sensor` is of `csac`.

    Parameters
    ----------
    test, model : array_like, shape (n_resp, n_f)
        FRFs, complex.
    window : int
        Lines in the window, odd, at least 3; it is centred on its line and cut off at the ends of the band.

    Returns
    -------
    ndarray, shape (n_resp, n_f)
        0 to 1.

    Raises
    ------
    RecordError
        If the shapes differ, are not (n_resp, n_f), or the window is no odd number >= 3.
    """
    return _csf(*_products(*_windows(test, model, window), axis=-1))


def mre(test, model) -> np.ndarray:
    """Mean relative error of the magnitude: mean over the lines of ||H_m| - |H_t|| / |H_t|, for each response.

    Parameters
    ----------
    test, model : array_like, shape (n_resp, n_f)
        FRFs, complex.

    Returns
    -------
    ndarray, shape (n_resp,)

    Raises
    ------
    RecordError
        If the shapes differ or are not (n_resp, n_f).
    """
    test, model = _pair(test, model)
    return np.mean(np.abs(np.abs(model) - np.abs(test)) / np.abs(test), axis=1)


def rmse_db(test, model) -> np.ndarray:
    """Root mean square over the lines of 20 log10(|H_m| / |H_t|), for each response.

    Parameters
    ----------
    test, model : array_like, shape (n_resp, n_f)
        FRFs, complex.

    Returns
    -------
    ndarray, shape (n_resp,)
        dB.

    Raises
    ------
    RecordError
        If the shapes differ or are not (n_resp, n_f).
    """
    test, model = _pair(test, model)
    return np.sqrt(np.mean((20 * np.log10(np.abs(model) / np.abs(test))) ** 2, axis=1))


def _energy(value, axis) -> np.ndarray:
    return np.sum(np.abs(value) ** 2, axis=axis)


def _products(test, model, axis=0):
    """|H_tᴴH_m|, H_tᴴH_t and H_mᴴH_m, summed over one axis."""
    return np.abs(np.sum(test.conj() * model, axis=axis)), _energy(test, axis), _energy(model, axis)


def _csac(cross, test, model):
    return cross**2 / (test * model)


def _csf(cross, test, model):
    return 2 * cross / (test + model)


def _pair(test, model):
    test, model = np.asarray(test), np.asarray(model)
    if test.shape != model.shape or test.ndim != 2:
        raise RecordError(f"test and model FRFs must both be (n_resp, n_f), got {test.shape} and {model.shape}")
    return test, model


def _several(name, test, model):
    test, model = _pair(test, model)
    if test.shape[0] < 2:
        raise RecordError(
            f"{name} compares shapes along the responses and needs at least 2, got {test.shape[0]}; "
            f"use {name.lower()}_per_sensor"
        )
    return test, model


def _windows(test, model, window):
    """Both as (n_resp, n_f, window), with zeros beyond the ends: they add nothing to the sums."""
    if window < 3 or window % 2 != 1:
        raise RecordError(f"window must be an odd number of lines >= 3, got {window!r}")
    ends = ((0, 0), (window // 2, window // 2))
    return (
        np.lib.stride_tricks.sliding_window_view(np.pad(value, ends), window, axis=1) for value in _pair(test, model)
    )
