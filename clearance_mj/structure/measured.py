"""Modal structures from measured FRFs of an assembly, with the synthesis compared to the measurement.

Poles come from `extract_modes`. The residue of a mode between two degrees of freedom is φ_o φ_r / (2 j ω_d) for shapes
of unit modal mass (Ewins, Modal Testing, 2nd ed., 2000, sections 2.4 and 4.6), so a driving point, whose response is
measured where the force acts, gives the scale; shapes that fit all references at once follow by least squares. The
residual of the FRFs beyond the modes, L + s² R in accelerance, is the effect of modes below and above the band; it is
fitted as modes at one low and one high frequency, as the structure represents it.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import scipy.optimize

from ..core.errors import RecordError
from ..signals.correlation import frac, rmse_db
from ..signals.ema import extract_modes
from ..signals.frf import FRF
from ..signals.modal_fit import ModalFit, line_weight
from ..signals.quantities import require_quantity
from ..signals.references import join_references
from .base import parse_dof
from .mode_files import phase_collinearity
from .modes import OMEGA_RATIO, ModalStructure, flexibility_root

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["MeasuredModes", "modes_from_frf"]

SIGNIFICANT = 3.0  # standard errors above which a driving point's residual counts as modes out of the band
MIN_SHARE = 1e-3  # least fraction of a driving point's weighted energy explained by modes below the band, to keep them
LOW_RATIO = 0.2  # of the lowest line: frequency assigned to modes below the band; 4 % more inertia at that line
Pair: TypeAlias = tuple[tuple[int | str, str], tuple[int | str, str], int]
"""node and axis of response and reference, and the sign of their directions"""
INTEGRATED = {"acceleration": 0, "velocity": 1, "displacement": 2}


@dataclass(frozen=True, eq=False)
class MeasuredModes:
    """A structure identified from measured FRFs, and its agreement with them."""

    structure: ModalStructure
    """modes of unit modal mass, with the residual flexibility where the FRFs show it"""
    measured: FRF
    """accelerance that was fitted, m/s²/N"""
    synthesised: FRF
    """accelerance of the structure"""
    collinearity: np.ndarray
    """(n,) modal phase collinearity of the measured modes, before their real parts were taken"""
    left_out: tuple[float, ...] = ()
    """Hz, modes of the FRFs with a negative modal mass at the driving points"""
    below: int = 0
    """number of the structure's first modes that represent those below the band"""

    @functools.cached_property
    def frac(self) -> np.ndarray:
        """(n_functions,) frequency response assurance criterion of each function, 0 to 1."""
        return frac(self.measured.functions, self.synthesised.functions)

    @functools.cached_property
    def rmse_db(self) -> np.ndarray:
        """(n_functions,) RMS difference of each function's magnitude, dB."""
        return rmse_db(self.measured.functions, self.synthesised.functions)

    def summary(self) -> dict[str, Any]:
        """Return modes and quality of the synthesis as plain data."""
        functions = zip(self.measured.labels, self.frac.tolist(), self.rmse_db.tolist())
        modes = slice(self.below, None)
        return {
            "frequency": list(self.structure.frequencies[modes]),
            "damping": self.structure.ratios[modes].tolist(),
            "phase_collinearity": self.collinearity.tolist(),
            "modes_below_the_band": self.below,
            "left_out": list(self.left_out),
            "residual_flexibility_at": list(self.structure.residual_dofs or ()),
            "functions": [{"function": name, "frac": f, "rmse_db": e} for name, f, e in functions],
        }

    def figure(self) -> Figure:
        """Return a figure of every measured function with its synthesis: magnitude over frequency."""
        from ..core.drawing import canvas

        labels = self.measured.labels
        columns = min(len(labels), 3)
        rows = -(-len(labels) // columns)
        figure = canvas(0.4 + 2.2 * rows, 3.2 * columns)
        axes = figure.subplots(rows, columns, squeeze=False, sharex=True)
        pairs = zip(self.measured.functions, self.synthesised.functions)
        for ax, label, (test, model), assurance, error in zip(axes.flat, labels, pairs, self.frac, self.rmse_db):
            ax.semilogy(self.measured.frequency, np.abs(test), color="black", linewidth=1.0, label="measured")
            ax.semilogy(self.measured.frequency, np.abs(model), color="#d55e00", linewidth=1.0, label="synthesised")
            ax.set_title(f"{label}: FRAC {assurance:.3f}, RMSE {error:.2f} dB", fontsize=8)
        for ax in axes.flat[len(labels) :]:
            ax.set_visible(False)
        for ax in axes.flat[len(labels) - columns : len(labels)]:
            ax.set_xlabel("frequency (Hz)")
            ax.tick_params(labelbottom=True)
        for ax in axes[:, 0]:
            ax.set_ylabel("accelerance (m/s²/N)")
        axes[0, 0].legend(fontsize=7, frameon=False)
        return figure


def modes_from_frf(
    frfs: FRF | Sequence[FRF], n_modes: int = 10, band: tuple[float, float] | None = None,
    poles: tuple[Sequence[float], Sequence[float]] | None = None, driving_points: dict[str, str] | None = None,
) -> MeasuredModes:  # fmt: skip
    """Identify a structure from measured FRFs, and compare its FRFs with them.

    Parameters
    ----------
    frfs : FRF or sequence of FRF
        Responses to forces, of one or several references; at least one response where a force acts.
    n_modes : int
        Largest number of modes to find.
    band : (float, float), optional
        Lines to use, Hz; all if left out.
    poles : (sequence of float, sequence of float), optional
        Natural frequencies, Hz, and damping ratios from elsewhere, such as sdypy-EMA's ``nat_freq`` and ``nat_xi``.
    driving_points : dict, optional
        Response degree of freedom by reference, where they have different names, such as {"200:+Z": "5:+Z"}.

    Returns
    -------
    MeasuredModes
        The structure, its FRFs, and their agreement with the measured ones.

    Raises
    ------
    RecordError
        If the FRFs are not per unit force, have no driving point, are not finite, or show no modes.
    """
    frf = _accelerance(frfs if isinstance(frfs, FRF) else join_references(list(frfs)), driving_points or {})
    frf = frf if band is None else frf.within(band)
    pairs = _pairs(frf)
    if not any(a == b for a, b, _ in pairs):
        raise RecordError(
            f"no response is where a force acts ({', '.join(frf.references)}), so the modes have no scale; measure a "
            "driving point, or name it (driving_points) where its label is another"
        )
    if poles is None:
        modes = extract_modes(frf, n_modes)
        frequency, damping = modes.frequency, modes.damping
    else:
        frequency, damping = (np.asarray(values, dtype=float) for values in poles)
    if not frequency.size:
        raise RecordError("the FRFs show no modes; give a band around them, or poles found elsewhere")
    order = np.argsort(frequency)
    return _identify(frf, pairs, frequency[order], damping[order])


def _accelerance(frf: FRF, names: dict[str, str]) -> FRF:
    """Return the accelerance at lines above 0 Hz, its references named after the responses at them."""
    above, _, below = frf.quantity.partition("/")
    require_quantity(frf)
    if below != "force" or above not in INTEGRATED:
        raise RecordError(f'FRFs are "{frf.quantity}"; modes of unit mass need "acceleration/force"')
    if unknown := [name for name in names if name not in frf.references]:
        raise RecordError(f"driving point of {unknown[0]}: the FRFs are to {', '.join(frf.references)}")
    lines = frf.frequency > 0
    finite = np.isfinite(frf.functions[:, lines]).all(axis=0)
    if not finite.all():
        raise RecordError(f"the FRF is not finite at {frf.frequency[lines][np.argmin(finite)]:g} Hz")
    power = (frf.window_rate + 2j * np.pi * frf.frequency[lines]) ** INTEGRATED[above]
    references = tuple(names.get(name, name) for name in frf.references)
    value = frf.value[..., lines] * power
    return replace(
        frf, frequency=frf.frequency[lines], value=value, coherence=None, references=references,
        quantity="acceleration/force",
    )  # fmt: skip


def _pairs(frf: FRF) -> list[Pair]:
    """Return node and axis of response and reference of each function, and the sign of their directions."""
    labels = (*frf.responses, *frf.references)
    dofs = {label: dof for label in labels if (dof := parse_dof(label))}
    if bad := [label for label in labels if label not in dofs]:
        raise RecordError(f'"{bad[0]}" is no degree of freedom, such as "3:+Z"')
    known = ((dofs[frf.responses[i]], dofs[frf.references[j]]) for j, i in np.argwhere(frf.measured.T))
    return [(a[:2], b[:2], a[2] * b[2]) for a, b in known]


def _identify(frf: FRF, pairs: list[Pair], frequency: np.ndarray, damping: np.ndarray) -> MeasuredModes:
    """Scale shapes, add residual modes, and synthesise the FRFs."""
    places = {place: i for i, place in enumerate(dict.fromkeys([a for a, _, _ in pairs] + [b for _, b, _ in pairs]))}
    at = np.array([(places[a], places[b]) for a, b, _ in pairs])
    sign = np.array([s for _, _, s in pairs])
    last = 2 * np.pi * frf.frequency[-1]
    omega = 2 * np.pi * frequency
    poles = omega / last * (-damping + 1j * np.sqrt(1 - damping**2))
    value = sign[:, None] * frf.functions
    fit = ModalFit(frf.frequency, value, line_weight(value), frf.window_rate)
    residues = fit.residues(poles)
    shapes = [_fit_shape((a * 2j * p.imag).real, at, len(places)) for a, p in zip(residues, poles)]
    positive = np.array([shape is not None for shape in shapes])
    if not positive.any():
        raise RecordError("every mode's driving points say a negative mass; check the directions of force and response")
    phi = np.array([shape for shape in shapes if shape is not None]).T
    dofs = tuple(f"{node}:+{axis}" for node, axis in places)
    flexibility, loads, lower = _fit_residual_modes(fit, value, phi, omega[positive], damping[positive], at, last)
    below = np.full(lower.shape[1], LOW_RATIO * frf.frequency[0])
    structure = ModalStructure(
        frequencies=tuple(np.append(below, frequency[positive])),
        damping_ratios=tuple(np.append(np.zeros(below.size), damping[positive])),
        dofs=dofs,
        shapes=_to_tuples(np.hstack((lower, phi))),
        residual_flexibility=_to_tuples(flexibility) if flexibility.any() else None,
        residual_dofs=tuple(dofs[i] for i in loads) if flexibility.any() else None,
    )
    left_out = tuple(frequency[~positive].tolist())
    mpc = phase_collinearity(residues[positive].T)
    return MeasuredModes(structure, frf, _synthesise(structure, frf), mpc, left_out, below.size)


def _to_tuples(values: np.ndarray) -> tuple[tuple[float, ...], ...]:
    return tuple(map(tuple, values.tolist()))


def _fit_shape(product: np.ndarray, at: np.ndarray, size: int) -> np.ndarray | None:
    """Fit φ (size,) to products φ_a φ_b of the pairs; return None where those of all driving points are negative."""
    driving = np.where(at[:, 0] == at[:, 1], product, -np.inf)
    best = int(np.argmax(driving))
    if not driving[best] > 0:
        return None
    start, driving_point = np.zeros(size), at[best, 0]
    start[driving_point] = np.sqrt(driving[best])
    for (a, b), value in zip(at, product):
        if driving_point in (a, b) and a != b:
            start[a if b == driving_point else b] = value / start[driving_point]

    def slopes(phi: np.ndarray) -> np.ndarray:
        jacobian = np.zeros((len(at), size))
        rows = np.arange(len(at))
        np.add.at(jacobian, (rows, at[:, 0]), phi[at[:, 1]])
        np.add.at(jacobian, (rows, at[:, 1]), phi[at[:, 0]])
        return jacobian

    return scipy.optimize.least_squares(lambda phi: phi[at[:, 0]] * phi[at[:, 1]] - product, start, slopes).x


def _modal_accelerance(s: np.ndarray, products: np.ndarray, omega: np.ndarray, damping: np.ndarray) -> np.ndarray:
    """Return the accelerance (n_functions, n_f) of modes with products φ_a φ_b (n_functions, n) at s = jω (n_f,)."""
    return products @ (s**2 / (omega[:, None] ** 2 + s**2 + 2 * (damping * omega)[:, None] * s))


def _fit_residual_modes(
    fit: ModalFit, value: np.ndarray, phi: np.ndarray, omega: np.ndarray, damping: np.ndarray, at: np.ndarray,
    last: float,
) -> tuple[np.ndarray, list[int], np.ndarray]:  # fmt: skip
    """Return residual flexibility (n_dofs, n_loads), its loads, and shapes (n_dofs, k) of modes below the band."""
    w = fit.s[:, 0].imag * last
    residual = value - _modal_accelerance(fit.s[:, 0] * last, phi[at[:, 0]] * phi[at[:, 1]], omega, damping)
    columns = np.column_stack(
        (w**2 / (w**2 - (LOW_RATIO * w[0]) ** 2), -(w**2) / (1 - (w / (OMEGA_RATIO * omega[-1])) ** 2))
    )
    basis, target = fit.weighted(columns), fit.weighted(residual.T)
    terms, spread = _least_squares(basis, target)  # L and R (2, n_functions)
    driving = at[:, 0] == at[:, 1]
    fraction = np.sum((basis[:, :1] * terms[0]) ** 2, axis=0) / np.sum(fit.target**2, axis=0)
    lower, _ = _significant_root(terms[0], spread[0], at, len(phi))
    if fraction[driving].max() < MIN_SHARE:
        lower = lower[:, :0]
        terms, spread = _least_squares(basis[:, 1:], target)
    upper, loads = _significant_root(terms[-1], spread[-1], at, len(phi))
    return upper @ upper[loads].T, loads, lower


def _least_squares(basis: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return coefficients of columns in a target by least squares, and their standard errors."""
    terms, *_ = np.linalg.lstsq(basis, target, rcond=None)
    noise = np.mean((target - basis @ terms) ** 2, axis=0)
    return terms, np.sqrt(np.linalg.inv(basis.T @ basis).diagonal()[:, None] * noise)


def _significant_root(term: np.ndarray, spread: np.ndarray, at: np.ndarray, size: int) -> tuple[np.ndarray, list[int]]:
    """Return S (size, k) with S Sᵀ = a term of the functions under forces with driving points, and their places."""
    known = {(int(a), int(b)): i for i, (a, b) in enumerate(at)}
    loads = [b for b in dict.fromkeys(at[:, 1].tolist()) if term[known.get((b, b), 0)] > 0 and (b, b) in known]
    if any((a, b) not in known for a in loads for b in loads):
        loads = sorted(loads, key=lambda b: -term[known[b, b]])[:1]
    if not loads:
        return np.zeros((size, 0)), []
    columns = np.array([[term[known[a, b]] if (a, b) in known else 0.0 for b in loads] for a in range(size)])
    floor = SIGNIFICANT * max(spread[known[b, b]] for b in loads)
    return flexibility_root(columns, columns[loads], floor), loads


def _synthesise(structure: ModalStructure, frf: FRF) -> FRF:
    """Return the structure's FRFs for the measured functions."""
    linear = structure.assemble(frf.references, 0)
    s = frf.window_rate + 2j * np.pi * frf.frequency
    dynamic = linear.stiffness.diagonal()[:, None] + s**2 + s * linear.viscous.diagonal()[:, None]
    value = np.einsum("om,rm,mf->orf", linear.rows(frf.responses), linear.rows(frf.references), s**2 / dynamic)
    return replace(frf, value=np.where(frf.measured[..., None], value, np.nan))
