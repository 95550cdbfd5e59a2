"""Gains from forces in the clearances to channels, of a rig whose open parameters have other values."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...linear import LinearModel, linear_model
from ...rig import Rig
from ...structure import Beam, Shaft
from ...structure.base import ratios_of_modes
from .priors import rig_with

__all__ = ["SpectralLines", "end_gains", "force_gains", "gains_at", "model_with"]

MODES, SPATIAL_MODES = 16, 10  # of the structure or of each of its planes, to which the static shapes are added
LOW_MODES = 40.0  # Hz, up to which the flanks of a record's window are quick for a mode
STRUCTURAL = "beam", "1/", "structure", "masses", "springs", "oscillators", "fixture", "planes"  # paths begin so


class SpectralLines(NamedTuple):
    """Spectral lines of a record."""

    kind: str  #: of the excitation
    omega: np.ndarray  #: (n_f,) complex frequencies, rad/s
    tested: Rig  #: whose shaker and spin are those of the record


def force_gains(
    rig: Rig, values: Mapping[str, float], probes: bool, lines: Sequence[SpectralLines]
) -> list[np.ndarray]:
    """Return the gains (n_f, n_channels, n_forces + 1) of forces and excitation, for each record.

    A force acts half in the clearance's middle, where the filling does, and half at its ends, where contact does.
    """
    model = model_with(rig, values)
    at = (model.at_bushings + model.ends_by_row.mean(axis=1)) / 2
    return gains_at(model, values, probes, lines, at)


def gains_at(
    model: LinearModel, values: Mapping[str, float], probes: bool, lines: Sequence[SpectralLines], at: np.ndarray
) -> list[np.ndarray]:
    """Return the gains of forces that act at rows (n_forces, n_modes), and of the excitation, for each record."""
    rows = model.at_probes(values) if probes else np.zeros((0, model.size))
    driven = [model.driven(each.tested) for each in lines]
    return [m.channel_gains(rows, each.kind, each.omega, at, spin) for (m, spin), each in zip(driven, lines)]


def end_gains(
    model: LinearModel, values: Mapping[str, float], probes: bool, lines: SpectralLines, in_flanks: np.ndarray
) -> np.ndarray:
    """Return the effect on the channels of a record that begins and ends in motion, (n_f, n_channels, n_modes).

    A mode q̈ + 2ζω q̇ + ω² q = p in a window f is moved by f p + 2 ḟ q̇ + f̈ q: near a low mode a sine that ends there
    leaves nothing else. How large it is, the channels say.

    Parameters
    ----------
    model : LinearModel
        Modes of the structure.
    values : mapping of str to float
        Of the probes, by name.
    probes : bool
        Whether displacement probes take part.
    lines : Lines
        Of the record.
    in_flanks : ndarray, shape (n_f, n_channels)
        2 ḟ ẏ + f̈ y of each channel y.
    """
    modes = np.eye(model.size)[model.omega < 2 * np.pi * LOW_MODES]
    (gains,) = gains_at(model, values, probes, [lines], modes)
    driven, spin = model.driven(lines.tested)
    motion = driven.displacement_gains(modes, lines.kind, lines.omega, modes, spin)
    gains = gains[:, :-1, :-1]
    response = gains / np.einsum("fii->fi", motion[:, :, :-1])[:, None]  # per motion of each mode
    response = response * np.any(in_flanks[:, :-1], axis=0).reshape(-1, 1)  # a channel that was left out shows nothing
    power = np.maximum(np.sum(np.abs(response) ** 2, axis=1), 1e-300)
    size = np.einsum("fci,fc->fi", response.conj(), in_flanks[:, :-1]) / power
    return np.pad(gains * size[:, None], ((0, 0), (0, 1), (0, 0)))


def model_with(rig: Rig, values: Mapping[str, float]) -> LinearModel:
    """Return the modes of the structure with values by name, without the filling's stiffness.

    Values that are no part of the structure's matrices leave the modes as they are: these are kept for later calls.
    """
    # Of all values those in the matrices of the structure and of attached parts.
    structural = {n: v for n, v in values.items() if n.startswith(STRUCTURAL) or ".housing." in n}
    whole = rig_with(rig, values)
    linear, ratios = whole.linear, tuple[float, ...]()
    # Of something attached, modes of the whole are not those that the damping ratios are of.
    if isinstance(linear, Beam | Shaft) and not whole.attached:
        field, ratios = "beam" if whole.beam else "structure", linear.damping_ratios or ()
        # Modes are damped by ratios of their own: these leave the reduction as it is.
        structural |= {f"{field}.damping_ratios[{i}]": 0.0 for i in range(len(ratios))}
    modes = SPATIAL_MODES if rig.moves_across else MODES
    model = linear_model(rig_with(rig, structural), modes, turning=bool(linear.shafts) and whole.spin is not None)
    shares = [ratios_of_modes(ratios, n) for n in model.plane_sizes]
    damping = model.damping + 2 * model.omega * np.concatenate(shares)
    return dataclasses.replace(model, rig=whole, damping=damping)
