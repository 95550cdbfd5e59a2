"""How well two FRFs, or two sets of modes, agree.

Arrays of FRFs are (n_outputs, n_inputs, n_f), or (n_outputs, n_f) of one input; test first, model second, on the same
degrees of freedom and frequency lines: nothing is interpolated.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
import scipy.optimize

from ..errors import RecordError
from .ema import NO_MODES, Modes, extract_modes
from .frf import FRF

__all__ = [
    "Comparison",
    "compare",
    "csac",
    "csac_per_sensor",
    "csf",
    "csf_per_sensor",
    "frac",
    "mac",
    "mac_of_modes",
    "mre",
    "relative_error",
    "rmse_db",
    "with_modes",
]

SAME_MODE = 0.15  # relative difference in frequency at which two modes are e^-½ times as likely to be one
LEAST_AFFINITY = 0.05


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


def mac_of_modes(a: Modes, b: Modes) -> np.ndarray:
    """MAC of each mode of one set with each of another.

    Parameters
    ----------
    a, b : Modes
        Of the same responses.

    Returns
    -------
    ndarray, shape (n_a, n_b)
        nan if there is one response, whose MAC is 1 by definition.
    """
    if a.shape.shape[0] < 2:
        return np.full((a.frequency.size, b.frequency.size), np.nan)
    return mac(a.shape, b.shape)


def frac(test, model) -> np.ndarray:
    """Frequency response assurance criterion of each response.

    |Σ H_t H_m*|² / (Σ|H_t|² Σ|H_m|²), summed over the lines; it does not see a complex scale factor.

    Parameters
    ----------
    test, model : array_like, shape (n_outputs, [n_inputs,] n_f)
        FRFs, complex.

    Returns
    -------
    ndarray, shape (n_outputs, [n_inputs])
        0 to 1.

    Raises
    ------
    RecordError
        If the shapes differ or are of another form.

    Notes
    -----
    Heylen and Lammens, FRAC: a consistent way of comparing frequency response functions, Swansea, 1996.
    """
    test, model = _pair(test, model)
    product = np.abs(np.sum(test * model.conj(), axis=-1))
    return product**2 / (_energy(test, axis=-1) * _energy(model, axis=-1))


def csac(test, model) -> np.ndarray:
    """Cross signature assurance criterion of each line, |H_tᴴH_m|² / ((H_tᴴH_t)(H_mᴴH_m)) over the outputs.

    It compares shapes along the structure and does not see a complex scale factor.

    Parameters
    ----------
    test, model : array_like, shape (n_outputs, [n_inputs,] n_f)
        FRFs, complex; at least two responses, as it is 1 for one, whatever the FRFs.

    Returns
    -------
    ndarray, shape ([n_inputs,] n_f)
        0 to 1.

    Raises
    ------
    RecordError
        If the shapes differ, are of another form or hold one response.

    Notes
    -----
    Zang, Grafe and Imregun, Frequency-domain criteria for correlating and updating dynamic finite element
    models, Mechanical Systems and Signal Processing 15, 2001.
    """
    test, model = _pair(test, model)
    if test.shape[0] < 2:
        raise RecordError(
            f"CSAC compares shapes along the responses and needs at least 2, got {test.shape[0]}; use csac_per_sensor"
        )
    return _csac(*_products(test, model))


def csf(test, model) -> np.ndarray:
    """Cross signature scale factor of each line, 2|H_tᴴH_m| / (H_tᴴH_t + H_mᴴH_m) over the outputs.

    It is 1 only where the FRFs agree in shape and in level; of one response it compares the level alone.

    Parameters
    ----------
    test, model : array_like, shape (n_outputs, [n_inputs,] n_f)
        FRFs, complex.

    Returns
    -------
    ndarray, shape ([n_inputs,] n_f)
        0 to 1.

    Raises
    ------
    RecordError
        If the shapes differ or are of another form.

    Notes
    -----
    Grafe, Model updating of large structural dynamics models using measured response functions, Ph.D. thesis,
    Imperial College London, 1998; Zang, Grafe and Imregun 2001, as for `csac`.
    """
    return _csf(*_products(*_pair(test, model)))


def csac_per_sensor(test, model, window: int = 9) -> np.ndarray:
    """Variant of `csac` for one sensor: a window of lines takes the place of the vector over the responses.

    The article's Table 2 gives a CSAC for each sensor, where the criterion as published is 1 by definition.

    Parameters
    ----------
    test, model : array_like, shape (n_outputs, [n_inputs,] n_f)
        FRFs, complex.
    window : int
        Lines in the window, odd, at least 3; it is centred on its line and cut off at the ends of the band.

    Returns
    -------
    ndarray, shape (n_outputs, [n_inputs,] n_f)
        0 to 1.

    Raises
    ------
    RecordError
        If the shapes differ, are of another form, or the window is no odd number >= 3.
    """
    return _csac(*_products(*_windows(test, model, window), axis=-1))


def csf_per_sensor(test, model, window: int = 9) -> np.ndarray:
    """Variant of `csf` for one sensor, as `csac_per_sensor` is of `csac`.

    Parameters
    ----------
    test, model : array_like, shape (n_outputs, [n_inputs,] n_f)
        FRFs, complex.
    window : int
        Lines in the window, odd, at least 3; it is centred on its line and cut off at the ends of the band.

    Returns
    -------
    ndarray, shape (n_outputs, [n_inputs,] n_f)
        0 to 1.

    Raises
    ------
    RecordError
        If the shapes differ, are of another form, or the window is no odd number >= 3.
    """
    return _csf(*_products(*_windows(test, model, window), axis=-1))


def mre(test, model) -> np.ndarray:
    """Mean relative error of the magnitude: mean over the lines of ||H_m| - |H_t|| / |H_t|, for each response.

    Parameters
    ----------
    test, model : array_like, shape (n_outputs, [n_inputs,] n_f)
        FRFs, complex.

    Returns
    -------
    ndarray, shape (n_outputs, [n_inputs])

    Raises
    ------
    RecordError
        If the shapes differ or are of another form.
    """
    test, model = _pair(test, model)
    return np.mean(np.abs(np.abs(model) - np.abs(test)) / np.abs(test), axis=-1)


def rmse_db(test, model) -> np.ndarray:
    """Root mean square over the lines of 20 log10(|H_m| / |H_t|), for each response.

    Parameters
    ----------
    test, model : array_like, shape (n_outputs, [n_inputs,] n_f)
        FRFs, complex.

    Returns
    -------
    ndarray, shape (n_outputs, [n_inputs])
        dB.

    Raises
    ------
    RecordError
        If the shapes differ or are of another form.
    """
    test, model = _pair(test, model)
    return np.sqrt(np.mean((20 * np.log10(np.abs(model) / np.abs(test))) ** 2, axis=-1))


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
    if test.shape != model.shape or test.ndim not in (2, 3):
        raise RecordError(
            f"test and model FRFs must both be (n_outputs, n_f) or (n_outputs, n_inputs, n_f), got {test.shape} and "
            f"{model.shape}"
        )
    return test, model


def _windows(test, model, window):
    """Both as (..., n_f, window), with zeros beyond the ends: they add nothing to the sums."""
    if window < 3 or window % 2 != 1:
        raise RecordError(f"window must be an odd number of lines >= 3, got {window!r}")
    test, model = _pair(test, model)
    ends = (*((0, 0),) * (test.ndim - 1), (window // 2, window // 2))
    return (np.lib.stride_tricks.sliding_window_view(np.pad(value, ends), window, axis=-1) for value in (test, model))


@dataclass(frozen=True)
class Comparison:
    """Agreement of the FRFs of a test and a model, over frequency, by sensor and by mode."""

    frequency: np.ndarray
    """(n_f,) Hz"""
    csac: np.ndarray
    """(n_f,), nan of one response"""
    csf: np.ndarray
    """(n_f,)"""
    csac_per_sensor: np.ndarray
    """(n_resp, n_f) windowed variant"""
    csf_per_sensor: np.ndarray
    """(n_resp, n_f) windowed variant"""
    per_sensor: dict
    """columns of n_resp: sensor (its label), mre, rmse_db, frac; csac and csf: means over the lines of the variant;
    nan for frac and csac where there is one line"""
    per_mode: dict
    """columns of n_modes: mode (from 1), test_hz, model_hz, relative_error, mac, test_damping, model_damping; a mode
    without a partner has nan in place of what is not there, and so have rows for which no mode was found; the MAC of
    one response is nan"""

    def summary(self) -> dict[str, float]:
        """Means and modes in one flat dict.

        Returns
        -------
        dict
            mre, rmse_db, frac: means over the sensors; csac, csf: over the lines; csac_per_sensor, csf_per_sensor: over
            both; relative_error, mac: over the modes that have a partner; mode_1_test_hz and so on for each mode.
        """
        means = {name: np.mean(self.per_sensor[name]) for name in ("mre", "rmse_db", "frac")}
        means |= {name: np.mean(getattr(self, name)) for name in ("csac", "csf", "csac_per_sensor", "csf_per_sensor")}
        paired = np.isfinite(self.per_mode["relative_error"])
        for name in ("relative_error", "mac"):
            means[name] = np.mean(self.per_mode[name][paired]) if paired.any() else np.nan
        modes = {
            f"mode_{mode}_{name}": value
            for name, column in self.per_mode.items()
            if name != "mode"
            for mode, value in zip(self.per_mode["mode"], column)
        }
        return {name: float(value) for name, value in (means | modes).items()}


def compare(test_frf: FRF, model_frf: FRF, n_modes: int = 4) -> Comparison:
    """Compare the FRFs of a model with those of a test on the same lines and responses.

    Parameters
    ----------
    test_frf : FRF
        The test.
    model_frf : FRF
        The model, estimated in the same way; nothing is interpolated.
    n_modes : int
        How many modes to compare. They come out of the FRFs and are paired one to one by MAC and frequency. 0: none
        are looked for.

    Returns
    -------
    Comparison
        With nan for measures that are 1 by definition: CSAC and MAC of one response, FRAC of one line.

    Raises
    ------
    RecordError
        If the lines, the responses or the quantities differ, or if modes cannot be looked for (a line is not finite,
        too few lines).
    """
    _require_same(test_frf, model_frf)
    modes = _paired_modes(test_frf, model_frf, n_modes) if n_modes else (NO_MODES, NO_MODES, [])
    return with_modes(test_frf, model_frf, _mode_table(*modes, n_modes))


def with_modes(test_frf: FRF, model_frf: FRF, per_mode: dict) -> Comparison:
    """Compare FRFs whose modes are known from an earlier comparison: looking for them takes nearly all of the time.

    Parameters
    ----------
    test_frf, model_frf : FRF
        As `compare` takes them.
    per_mode : dict
        `Comparison.per_mode` of the same FRFs.

    Returns
    -------
    Comparison
    """
    test, model = test_frf.functions, model_frf.functions
    n_resp, n_f = test.shape
    # What is 1 by definition says nothing.
    by_line = csac(test, model) if n_resp > 1 else np.full(n_f, np.nan)
    variant_csac = csac_per_sensor(test, model) if n_f > 1 else np.full((n_resp, 1), np.nan)
    variant_csf = csf_per_sensor(test, model)
    per_sensor = {
        "sensor": test_frf.labels,
        "mre": mre(test, model),
        "rmse_db": rmse_db(test, model),
        "frac": frac(test, model) if n_f > 1 else np.full(n_resp, np.nan),
        "csac": variant_csac.mean(axis=1),
        "csf": variant_csf.mean(axis=1),
    }
    return Comparison(test_frf.frequency, by_line, csf(test, model), variant_csac, variant_csf, per_sensor, per_mode)


def _require_same(test_frf, model_frf):
    if test_frf.quantity != model_frf.quantity:
        raise RecordError(f"the test's FRF is {test_frf.quantity}, the model's {model_frf.quantity}")
    if test_frf.labels != model_frf.labels:
        responses = (", ".join(frf.labels) for frf in (test_frf, model_frf))
        raise RecordError("the test's responses are {}; the model's are {}".format(*responses))
    lines = test_frf.frequency, model_frf.frequency
    if lines[0].shape != lines[1].shape or not np.allclose(*lines, rtol=1e-9, atol=0):
        raise RecordError("the test has {}; the model has {}".format(*map(_grid, lines)))


def _grid(frequency) -> str:
    return f"{frequency.size} lines from {frequency[0]:.9g} to {frequency[-1]:.9g} Hz"


def _paired_modes(test_frf, model_frf, n_modes):
    """Modes of test and model, and the pairs of their numbers.

    Where a strong mode of the test has no partner among as many of the model, twice as many are looked at: it may be
    a weaker one there.
    """
    test, model = _modes_once(test_frf, n_modes), extract_modes(model_frf, n_modes)
    pairs = _pairs(test, model)
    if len(pairs) == test.frequency.size:
        return test, model, pairs
    more = extract_modes(model_frf, 2 * n_modes)
    more_pairs = _pairs(test, more)
    return (test, more, more_pairs) if len(more_pairs) > len(pairs) else (test, model, pairs)


@functools.lru_cache(maxsize=32)
def _modes_once(frf, n_modes):
    """Modes of a test, which is compared with many models."""
    return extract_modes(frf, n_modes)


def _pairs(test, model) -> list[tuple[int, int]]:
    """One-to-one pairs with the largest sum of √MAC times a Gaussian of the frequency ratio's logarithm.

    Frequency keeps modes apart whose shapes the few sensors cannot, MAC those that are close.
    """
    ratio = np.log(model.frequency / test.frequency[:, None])
    affinity = np.sqrt(mac(test.shape, model.shape)) * np.exp(-0.5 * (ratio / SAME_MODE) ** 2)
    rows, columns = scipy.optimize.linear_sum_assignment(affinity, maximize=True)
    return [(int(i), int(j)) for i, j in zip(rows, columns) if affinity[i, j] >= LEAST_AFFINITY]


def _mode_table(test, model, pairs, n_modes) -> dict:
    """Columns of n_modes rows: the test's modes, then the model's that have no partner, by frequency; then nan."""
    partner = dict(pairs)
    rows = [(i, partner.get(i, -1)) for i in range(test.frequency.size)]
    rows += [(-1, j) for j in range(model.frequency.size) if j not in partner.values()]
    rows += [(-1, -1)] * n_modes
    of_test, of_model = np.array(rows[:n_modes], dtype=int).reshape(-1, 2).T

    def column(values, places):
        return np.append(values, np.nan)[places]

    test_hz, model_hz = column(test.frequency, of_test), column(model.frequency, of_model)
    order = np.argsort(np.where(np.isnan(test_hz), model_hz, test_hz))
    columns = {
        "test_hz": test_hz,
        "model_hz": model_hz,
        "relative_error": relative_error(test_hz, model_hz),
        "mac": np.pad(mac_of_modes(test, model), (0, 1), constant_values=np.nan)[of_test, of_model],
        "test_damping": column(test.damping, of_test),
        "model_damping": column(model.damping, of_model),
    }
    return {"mode": np.arange(1, n_modes + 1)} | {name: values[order] for name, values in columns.items()}
