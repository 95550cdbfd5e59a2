"""FRFs from measured auto and cross spectra."""

from __future__ import annotations

import numpy as np

from ..core.checks import NOWHERE, UNKNOWN
from ..core.errors import RecordError
from ..core.overview import few
from .frf import FRF
from .spectra import Spectra
from .welch import ESTIMATORS

__all__ = ["frf_from_spectra"]

AUTO_KINDS = ("auto spectrum", "power spectral density")
LARGEST_COHERENCE = 1.01  # with the digits of files; beyond, auto and cross spectra are not scaled alike
Matrix = dict[tuple[str, str], np.ndarray]  # S_ab (n_f,) = A B* by the degrees of freedom a and b


def frf_from_spectra(auto: Spectra, cross: Spectra, estimator: str = "H1", references: tuple[str, ...] = ()) -> FRF:
    """Estimate FRFs from auto and cross spectra that another program measured.

    Parameters
    ----------
    auto : Spectra
        Auto spectra (or power spectral densities) of the references, and for "H2", "Hv" and the coherence of the
        responses.
    cross : Spectra
        Cross spectra of each response to each reference, S_yx = Y X*, scaled as the auto spectra; with several
        references also those between them.
    estimator : {"H1", "H2", "Hv"}
        As `estimate_frf` takes it; of several references H1 = S_yx S_xx⁻¹, Hv by the smallest eigenvalue of the
        matrix of a response and the references; H2 needs one reference.
    references : tuple of str
        Degrees of freedom of the excitation; empty: the references of the cross spectra.

    Returns
    -------
    FRF
        With the ordinary coherence where there is one reference and the auto spectrum of every response.

    Raises
    ------
    RecordError
        If a spectrum that is needed is missing, lines differ, or auto and cross spectra are not scaled alike.

    Notes
    -----
    Bendat and Piersol, Random Data, 4th ed., 2010, chapters 6 and 7.
    """
    RecordError.require_known("estimator", estimator, ESTIMATORS)
    if auto.kind not in AUTO_KINDS or cross.kind != "cross spectrum":
        raise RecordError(f"FRFs need auto and cross spectra, got {auto.kind} and {cross.kind}")
    if not np.array_equal(auto.frequency, cross.frequency):
        raise RecordError("auto and cross spectra are not on the same lines")
    spectra = _matrix(auto, cross)
    inputs = references or tuple(dict.fromkeys(cross.references))
    outputs = tuple(dof for dof in dict.fromkeys((*cross.responses, *cross.references)) if dof not in inputs)
    if not outputs:
        raise RecordError(f"there is no response beside the references {few(inputs)}")
    s_xx = np.array([[_entry(spectra, a, b) for b in inputs] for a in inputs])
    s_yx = np.array([[_entry(spectra, a, b) for b in inputs] for a in outputs])
    has_autos = all((dof, dof) in spectra for dof in outputs)
    s_yy = np.array([_entry(spectra, dof, dof).real for dof in outputs]) if has_autos or estimator != "H1" else None
    with np.errstate(divide="ignore", invalid="ignore"):
        value = _estimate(estimator, s_xx, s_yx, s_yy)
        coherence = None
        if s_yy is not None and len(inputs) == 1:
            coherence = np.abs(s_yx) ** 2 / (s_xx[0, 0].real * s_yy[:, None])
    if coherence is not None and np.nanmax(coherence, initial=0.0) > LARGEST_COHERENCE:
        line = auto.frequency[np.nanargmax(np.nanmax(coherence, axis=(0, 1)))]
        raise RecordError(
            f"the coherence would be {np.nanmax(coherence):.3g} at {line:g} Hz, which is above 1: auto and cross "
            "spectra are not scaled alike"
        )
    return FRF(auto.frequency, value, coherence, outputs, inputs, _quantity(auto, outputs, inputs))


def _matrix(auto: Spectra, cross: Spectra) -> Matrix:
    matrix: Matrix = {}
    for spectra in (auto, cross):
        for i, (a, b) in enumerate(zip(spectra.responses, spectra.references)):
            pair = (a, a) if spectra is auto else (a, b)
            if NOWHERE in pair:
                raise RecordError(
                    f'{spectra.kind} "{spectra.names[i]}" does not say where it was measured; give its degrees of '
                    "freedom: dataclasses.replace(spectra, responses=..., references=...)"
                )
            if pair in matrix:
                raise RecordError(f"{spectra.kind} of {a}{f' to {b}' if spectra is cross else ''} comes twice")
            matrix[pair] = spectra.value[i]
    return matrix


def _entry(spectra: Matrix, a: str, b: str) -> np.ndarray:
    """Return S_ab, which is the conjugate of S_ba."""
    if (a, b) in spectra:
        return spectra[a, b].astype(complex)
    if (b, a) in spectra:
        return spectra[b, a].astype(complex).conj()
    raise RecordError(f"there is no {f'auto spectrum of {a}' if a == b else f'cross spectrum of {a} to {b}'}")


def _estimate(estimator: str, s_xx: np.ndarray, s_yx: np.ndarray, s_yy: np.ndarray | None) -> np.ndarray:
    """Return FRFs (n_outputs, n_inputs, n_f) by S_xx (n_inputs, n_inputs, n_f), S_yx, S_yy (n_outputs, n_f)."""
    if len(s_xx) == 1:
        rows = s_yy if s_yy is not None else np.empty(s_yx[:, 0].shape)
        return ESTIMATORS[estimator](s_xx[0, 0].real, rows, s_yx[:, 0])[:, None]
    of_lines, rows_of_lines = np.moveaxis(s_xx, -1, 0), np.moveaxis(s_yx, -1, 0)
    if estimator == "H1":
        return _solve(of_lines, rows_of_lines)
    if estimator == "H2" or s_yy is None:
        raise RecordError("H2 needs one reference; use H1 or Hv with several")
    frfs = []
    for y, row in enumerate(s_yx):
        matrix = np.empty((s_xx.shape[-1], len(s_xx) + 1, len(s_xx) + 1), dtype=complex)
        matrix[:, :-1, :-1], matrix[:, -1, -1] = of_lines, s_yy[y]
        matrix[:, -1, :-1], matrix[:, :-1, -1] = row.T, row.T.conj()
        vector = np.linalg.eigh(matrix)[1][:, :, 0]  # smallest eigenvalue: v_x* x + v_y* y is noise alone
        frfs.append((-vector[:, :-1].conj() / vector[:, -1:].conj()).T)
    return np.array(frfs)


def _solve(s_xx: np.ndarray, s_yx: np.ndarray) -> np.ndarray:
    """Return S_yx S_xx⁻¹ line by line (n_f first); nan where the references are not independent."""
    value = np.full(s_yx.shape, complex(np.nan, np.nan))
    regular = np.linalg.cond(s_xx) < 1 / np.finfo(float).eps
    value[regular] = np.linalg.solve(s_xx[regular].swapaxes(1, 2), s_yx[regular].swapaxes(1, 2)).swapaxes(1, 2)
    return np.moveaxis(value, 0, -1)


def _quantity(auto: Spectra, outputs: tuple[str, ...], inputs: tuple[str, ...]) -> str:
    """Return the quantity of the FRFs."""
    by_dof = dict(zip(auto.responses, auto.quantities))
    quantities = [{by_dof.get(dof, UNKNOWN) for dof in dofs} for dofs in (outputs, inputs)]
    above, below = (names.pop() if len(names) == 1 else UNKNOWN for names in quantities)
    return f"{above}/{below}"
