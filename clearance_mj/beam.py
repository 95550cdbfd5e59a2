"""Modes and frequency responses of a rig in its in-gap linear state."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .core.errors import RigError
from .core.kinds import checks_kinds
from .linear import linear_model
from .rig import Rig
from .rig.sensing import input_readings
from .structure.modal import Reduction

if TYPE_CHECKING:
    import control

__all__ = ["linear_frf", "mode_shapes", "natural_frequencies", "state_space"]


@functools.lru_cache(maxsize=128)
def _in_gap(rig: Rig, modes: int) -> Reduction:
    """Return the structure with the fillings' stiffness; shafts move along z."""
    return rig.reduction(modes, grease=True)


@checks_kinds
def natural_frequencies(rig: Rig, n: int) -> np.ndarray:
    """Return the natural frequencies of the rig in its in-gap linear state: grease stiffness on, no contact.

    Parameters
    ----------
    rig : Rig
        The rig.
    n : int
        Number of modes.

    Returns
    -------
    ndarray, shape (n,)
        Hz; fewer where the structure has fewer modes. Bearings count with their largest stiffness along z.
    """
    return _in_gap(rig, n + 16).omega[:n] / (2 * np.pi)


@checks_kinds
def mode_shapes(rig: Rig, x: Sequence[float | str] | np.ndarray, n: int) -> np.ndarray:
    """Return the mode shapes of the rig in its in-gap linear state, of unit modal mass and positive at the tip.

    Parameters
    ----------
    rig : Rig
        The rig.
    x : array_like, shape (n_x,)
        Positions, m, or degrees of freedom.
    n : int
        Number of modes.

    Returns
    -------
    ndarray, shape (n_x, n)
        1/sqrt(kg).
    """
    in_gap, points = _in_gap(rig, n + 16), x.tolist() if isinstance(x, np.ndarray) else list(x)
    return np.asarray(in_gap.rows(points) @ in_gap.transform)[:, :n]


@checks_kinds
def state_space(rig: Rig, n_modes: int = 16) -> control.StateSpace:
    """Return the linear model of the rig in the gap, the grease a spring and damper at each bushing, at its mean spin.

    Parameters
    ----------
    rig : Rig
        The rig.
    n_modes : int
        Modes in the Ritz basis.

    Returns
    -------
    control.StateSpace
        Input: base acceleration (m/s²) or shaker force (N), as ``rig.shaker`` says. Outputs: what the sensors
        read, such as absolute accelerations (m/s²), then displacements that probes in the bushings read (m).
    """
    import control  # it brings pyplot, a second of every start

    fillings = [b.grease for b in rig.bushings]
    model, kind = linear_model(rig, n_modes), rig.shaker.kind
    model = model.filled([g.stiffness for g in fillings], [g.damping for g in fillings])
    sensors, probes, force = model.sensor_rows, model.at_probes({}), model.input(kind)
    if kind == "base" and (sensors.on_base * (sensors.order < 2)).any():
        raise RigError(f'rig {rig.name!r}: the base\'s own motion is no state; give its sensors relative_to = "base"')
    state = model.state(rig.spin.mean if rig.spin else 0.0)
    b_matrix = np.concatenate((np.zeros(model.size), force))[:, None]
    seen = sensors.accelerations @ state[model.size :]
    seen += sensors.readings.reshape(-1, 2 * model.size) if sensors.readings.size else 0.0
    c_matrix = np.vstack((seen, np.hstack((probes, np.zeros_like(probes)))))
    direct = sensors.accelerations @ force + input_readings(rig, kind)[0]
    d_matrix = np.concatenate((direct, np.zeros(len(probes))))[:, None]
    return control.ss(state, b_matrix, c_matrix, d_matrix)


@checks_kinds
def linear_frf(rig: Rig, frequency: ArrayLike, n_modes: int = 16) -> np.ndarray:
    """Return the FRFs of the sensors in the gap, such as accelerances, through python-control.

    Parameters
    ----------
    rig : Rig
        The rig.
    frequency : array_like, shape (n_f,)
        Hz.
    n_modes : int
        Modes in the Ritz basis.

    Returns
    -------
    ndarray, shape (n_sensors, n_f), complex
    """
    import control

    omega = 2 * np.pi * np.asarray(frequency, dtype=float)
    response = control.frequency_response(state_space(rig, n_modes), omega)
    return np.asarray(response.frdata)[: len(rig.sensors), 0] * np.exp(-1j * np.outer(rig.delays, omega))
