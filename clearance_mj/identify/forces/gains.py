"""What channels show of unknown forces in the clearances and of the excitation: gains at every frequency.

The structure without grease and contact is linear, so every channel reads y(ω) = G(ω) θ(ω), with θ the forces in the
clearances and the excitation.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...beam import ModalModel
from ...structure.base import parse_place

__all__ = ["channel_gains", "displacement_gains", "probe_rows"]


def probe_rows(model: ModalModel, values: Mapping[str, float]) -> np.ndarray:
    """(n_bushings, n_modes) displacement that probes read, of gains and places by the names of `priors`."""
    rows, bushings = model.at_bushings.copy(), model.rig.bushings
    for j in range(len(rows)):
        if f"probes[{j}].position" in values:
            name = (parse_place(bushings[j].position) or ("", 0.0))[0]
            at = values[f"probes[{j}].position"]
            rows[j] = model.shapes([f"{name}@{at!r}" if name else at])[0]
        rows[j] *= values.get(f"probes[{j}].gain", 1.0)
    return rows


def channel_gains(
    model: ModalModel, probes: np.ndarray, kind: str, omega: np.ndarray, at: np.ndarray | None = None
) -> np.ndarray:
    """Gains (n_f, n_channels, n_forces + 1) of accelerometers, probes and excitation on θ.

    θ: the forces and the excitation. ``at``: (n_forces, n_modes) where they act, by default in the bushings' middles.
    """
    sensors = len(model.at_sensors)
    seen = displacement_gains(model, np.vstack((model.at_sensors, probes)), kind, omega, at)
    seen[:, :sensors] *= -(omega[:, None, None] ** 2)
    seen[:, :sensors, -1] += model.sensors_on_base * float(kind == "base")
    itself = np.zeros((omega.size, 1, seen.shape[2]))
    itself[:, :, -1] = 1.0
    return np.concatenate((seen, itself), axis=1)


def displacement_gains(
    model: ModalModel, rows: np.ndarray, kind: str, omega: np.ndarray, at: np.ndarray | None = None
) -> np.ndarray:
    """Gains (n_f, n, n_forces + 1) of displacements with rows (n, n_modes) on θ, as `channel_gains` has it."""
    inputs = np.vstack((-(model.at_bushings if at is None else at), model.input(kind))).T
    receptance = model.receptance(omega)
    if receptance.ndim == 3:
        return rows @ receptance @ inputs
    products = rows[:, None, :] * inputs.T[None]
    return (receptance @ products.reshape(-1, model.size).T).reshape(omega.size, len(rows), -1)
