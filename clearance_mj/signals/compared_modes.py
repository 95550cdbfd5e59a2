"""Modes of the FRFs of a test and of a model, paired one to one, with random errors and reasons."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.optimize

from .arrays import ArrayData
from .correlation import mac, relative_error
from .ema import Modes, extract_modes, refitted_modes
from .frf import FRF
from .modal_fit import ModalFit, line_weight, poles_of

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "WEAK_MODE_ERRORS", "ModeErrors", "cached_modes", "common_modes", "distinct_modes", "mac_of_modes", "mode_errors",
    "mode_table", "paired_modes",
]  # fmt: skip

FREQUENCY_SCALE = 0.15  # relative difference in frequency at which two modes are e^-½ times as likely to be one
MIN_AFFINITY = 0.05
REACH = float(np.exp(FREQUENCY_SCALE * np.sqrt(-2 * np.log(MIN_AFFINITY))))
"""Ratio of the frequencies of two modes of one shape beyond which they are no pair."""
SAME_MODE = 0.8  # affinity from which on modes of two records of one level are the same
Pairs = list[tuple[int, int]]  # numbers of the modes of test and model that are one


def mac_of_modes(a: Modes, b: Modes) -> np.ndarray:
    """Return the MAC (n_a, n_b) of each mode of one set with each of another; nan for one response, whose MAC is 1."""
    if a.shape.shape[0] < 2:
        return np.full((a.frequency.size, b.frequency.size), np.nan)
    return mac(a.shape, b.shape)


@functools.lru_cache(maxsize=64)
def cached_modes(frf: FRF, n_modes: int) -> Modes:
    """Return the modes of a test, which is compared with many models; equal FRFs have equal modes."""
    return distinct_modes(frf, n_modes)


def common_modes(frfs: Sequence[FRF], names: Sequence[str], n_modes: int) -> tuple[list[Modes], list[str]]:
    """Return the modes that all records of a level show well, in one order, and in words which are left out and why.

    Parameters
    ----------
    frfs : sequence of FRF
        FRFs of the same lines and responses, one for each record.
    names : sequence of str
        Of the records.
    n_modes : int
        Largest number of modes of each.
    """
    mode_sets = [cached_modes(frf, n_modes) for frf in frfs]
    first, columns, left_out = mode_sets[0], [], list[str]()
    partners = [dict(_pairs(first, other, SAME_MODE)) for other in mode_sets[1:]]
    hardly = [mode_errors(frf, modes).hardly for frf, modes in zip(frfs, mode_sets)]
    for i, hz in enumerate(first.frequency.tolist()):
        numbers = [i, *(partner.get(i, -1) for partner in partners)]
        missing = [name for name, number in zip(names, numbers) if number < 0]
        weak = [name for name, number, is_weak in zip(names, numbers, hardly) if number >= 0 and is_weak[number]]
        if missing:
            left_out.append(f"the mode near {hz:.4g} Hz of record {names[0]} is not found in {', '.join(missing)}")
        elif weak:
            left_out.append(f"the mode near {hz:.4g} Hz is hardly extracted from {', '.join(weak)}")
        else:
            columns.append(numbers)
    for name, modes, partner in zip(names[1:], mode_sets[1:], partners):
        others = np.delete(modes.frequency, [*partner.values()]).tolist()
        left_out += [f"the mode near {hz:.4g} Hz of record {name} is not found in {names[0]}" for hz in others]
    return [_select(modes, [row[k] for row in columns]) for k, modes in enumerate(mode_sets)], left_out


def _select(modes: Modes, columns: Sequence[int] | np.ndarray) -> Modes:
    index = np.array(columns, dtype=int)
    return Modes(modes.frequency[index], modes.damping[index], modes.shape[:, index], modes.responses)


def paired_modes(test_frf: FRF, model_frf: FRF, n_modes: int, of_test: Modes | None) -> tuple[Modes, Modes, Pairs]:
    """Return the modes of test and model, and the pairs of their numbers.

    Where a strong mode of the test has no partner among as many of the model, twice as many are looked at: it may be
    a weaker one there.
    """
    test = cached_modes(test_frf, n_modes) if of_test is None else of_test
    model = distinct_modes(model_frf, n_modes)
    pairs = _pairs(test, model)
    if len(pairs) == test.frequency.size:
        return test, model, pairs
    larger_set = distinct_modes(model_frf, 2 * n_modes)
    more_pairs = _pairs(test, larger_set)
    return (test, larger_set, more_pairs) if len(more_pairs) > len(pairs) else (test, model, pairs)


def _pairs(test: Modes, model: Modes, min_affinity: float = MIN_AFFINITY) -> Pairs:
    """Return one-to-one pairs with the largest sum of √MAC times a Gaussian of the frequency ratio's logarithm.

    Frequency keeps modes apart whose shapes the few sensors cannot, MAC those that are close.
    """
    ratio = np.log(model.frequency / test.frequency[:, None])
    affinity = np.sqrt(mac(test.shape, model.shape)) * np.exp(-0.5 * (ratio / FREQUENCY_SCALE) ** 2)
    rows, columns = scipy.optimize.linear_sum_assignment(affinity, maximize=True)
    return [(int(i), int(j)) for i, j in zip(rows, columns) if affinity[i, j] >= min_affinity]


def mode_table(
    test_frf: FRF, model_frf: FRF, modes: tuple[Modes, Modes, Pairs], n_modes: int, only_test: bool = False
) -> pd.DataFrame:
    """Return n_modes rows: the test's modes, then the model's that have no partner, by frequency; then nan.

    A mode that one of the two lacks, or that is hardly extracted from one of them, has no relative error and no MAC,
    and the reason in column ``why``. With ``only_test`` the model's without partner are left out.
    """
    import pandas as pd

    test, model, pairs = modes
    partner = dict(pairs)
    rows = [(i, partner.get(i, -1)) for i in range(test.frequency.size)]
    if not only_test:
        rows += [(-1, j) for j in range(model.frequency.size) if j not in partner.values()]
    rows += [(-1, -1)] * n_modes
    of_test, of_model = np.array(rows[:n_modes], dtype=int).reshape(-1, 2).T
    test_hz, model_hz = np.append(test.frequency, np.nan)[of_test], np.append(model.frequency, np.nan)[of_model]
    why = _reasons(test_frf, model_frf, (test, model), list(zip(of_test.tolist(), of_model.tolist())))
    compared = np.array([not words for words in why], dtype=bool)
    of_pairs = np.pad(mac_of_modes(test, model), (0, 1), constant_values=np.nan)[of_test, of_model]
    order = np.argsort(np.where(np.isnan(test_hz), model_hz, test_hz))
    table = pd.DataFrame({
        "test_hz": test_hz, "model_hz": model_hz,
        "relative_error": np.where(compared, relative_error(test_hz, model_hz), np.nan),
        "mac": np.where(compared, of_pairs, np.nan), "test_damping": np.append(test.damping, np.nan)[of_test],
        "model_damping": np.append(model.damping, np.nan)[of_model], "why": why,
    })  # fmt: skip
    return table.iloc[order].reset_index(drop=True).assign(mode=np.arange(1, n_modes + 1))[["mode", *table]]


def _reasons(test_frf: FRF, model_frf: FRF, modes: tuple[Modes, Modes], rows: Pairs) -> list[str]:
    """Return why each row is not compared; "" for rows that are, and for empty ones."""
    frfs, names = (test_frf, model_frf), ("test", "model")
    errors = [mode_errors(frf, m) if m.frequency.size else None for frf, m in zip(frfs, modes)]
    reasons = []
    for row in rows:
        words = ""
        for side, other in ((0, 1), (1, 0)):
            if row[side] >= 0 and row[other] < 0:
                hz, lines = modes[side].frequency[row[side]], frfs[other].frequency
                low, high = max(hz / REACH, lines[0]), min(hz * REACH, lines[-1])
                words = f"not found in the {names[other]}'s FRFs between {low:.3g} and {high:.3g} Hz"
        weak = [i for i in (0, 1) if row[i] >= 0 and (error := errors[i]) is not None and error.hardly[row[i]]]
        for i in weak if not words else ():
            error = errors[i]
            assert error is not None
            df, dshape = error.frequency[row[i]], error.shape[row[i]]
            loose = f"frequency ± {100 * df:.2g} %" if not df < WEAK_MODE_ERRORS[0] else f"shape ± {100 * dshape:.2g} %"
            words = f"hardly extracted from the {names[i]}'s FRFs ({loose})"
        reasons.append(words)
    return reasons


SAME_SHAPE = 0.9  # MAC from which on two modes whose half-power bands overlap are one peak
WEAK_MODE_ERRORS = 0.02, 1 / 3
"""Relative standard deviation of the frequency, and error of the shape over its length, from which on a mode is hardly
extracted: two shapes with a third of random error each have a MAC of 0.8 with each other where they are equal."""


@dataclass(frozen=True, eq=False, repr=False)
class ModeErrors(ArrayData):
    """Random errors of modes, from the residual of their fit."""

    frequency: np.ndarray
    """(n,) relative standard deviation of the natural frequency"""
    shape: np.ndarray
    """(n,) root of the shape's total variance over its length"""

    @property
    def hardly(self) -> np.ndarray:
        """(n,) True for a mode that is hardly extracted, see `WEAK_MODE_ERRORS`."""
        # nan, of a fit without an inverse, is hardly extracted too
        return ~((self.frequency < WEAK_MODE_ERRORS[0]) & (self.shape < WEAK_MODE_ERRORS[1]))


def distinct_modes(frf: FRF, n_modes: int) -> Modes:
    """Return extracted modes, those that are one peak joined.

    The hump of a nonlinear resonance, or a noisy one, is fitted by two poles within each other's half-power band and of
    one shape, whose frequencies and dampings differ from record to record. The one that explains less is left out, and
    the others are fitted again.

    Parameters
    ----------
    frf : FRF
        As in `extract_modes`.
    n_modes : int
        Largest number of modes.
    """
    modes = extract_modes(frf, n_modes)
    while (pairs := _pairs_of_one_peak(modes)).size:
        explained, _ = _fit(frf).explained(poles_of(_unknowns(frf, modes)))
        weaker = pairs.ravel()[np.argmin(explained[pairs.ravel()])]
        modes = refitted_modes(frf, _select(modes, np.delete(np.arange(explained.size), weaker)))
    return modes


def _pairs_of_one_peak(modes: Modes) -> np.ndarray:
    """Return (n, 2) pairs of modes that are two poles of one peak."""
    f, half_width = modes.frequency, modes.frequency * modes.damping
    close = np.abs(f[:, None] - f) < half_width[:, None] + half_width
    return np.argwhere(np.triu(close & (mac(modes.shape, modes.shape) > SAME_SHAPE), 1))


def _fit(frf: FRF) -> ModalFit:
    return ModalFit(frf.frequency, frf.functions, line_weight(frf.functions))


def _unknowns(frf: FRF, modes: Modes) -> np.ndarray:
    return np.log(np.concatenate((modes.frequency / frf.frequency[-1], modes.damping)))


def mode_errors(frf: FRF, modes: Modes) -> ModeErrors:
    """Return the random errors of extracted modes, from the residual of their fit at each line and function.

    Linear propagation with White's covariance, as the residual is largest where the FRFs are (H. White, A
    heteroskedasticity-consistent covariance matrix estimator, Econometrica 48, 1980).

    Parameters
    ----------
    frf : FRF
        Functions that the modes were extracted from.
    modes : Modes
        The modes, of all its functions.
    """
    if not modes.frequency.size:
        return ModeErrors(np.empty(0), np.empty(0))
    fit, unknowns = _fit(frf), _unknowns(frf, modes)
    residual, slope = fit.residual(unknowns)
    n = modes.frequency.size
    rows, flat = slope.reshape(2 * n, -1), residual.ravel()
    inverse = np.linalg.pinv(rows @ rows.T, hermitian=True)
    of_poles = np.diag(inverse @ (rows * flat**2) @ rows.T @ inverse)[:n]
    return ModeErrors(np.sqrt(np.maximum(of_poles, 0)), fit.shape_errors(poles_of(unknowns), residual))
