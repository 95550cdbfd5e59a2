"""Compiled loops that march the modal engine step by step and keep the modes' coordinates."""

from __future__ import annotations

import numpy as np

from ..clearance.kernel import Clearance
from ..clearance.lane_contacts import LaneContacts
from ..clearance.lane_greases import LaneGreases
from ..clearance.round_kernel import RoundClearance
from ..core.jit import OPTIONS, jit
from ..engines.modal_loop import Motion, Shaft, advance
from ..engines.round_loop import advance_round
from ..engines.round_scheme import SPIN, RoundMotion, RoundShaft

__all__ = ["march_planar", "march_round"]


@jit(**OPTIONS)
def march_planar(
    steps: int, excitation: np.ndarray, h: float, lanes: tuple[int, ...], shaft: Shaft, motion: Motion,
    clearance: Clearance, greases: LaneGreases, contacts: LaneContacts, out: np.ndarray, q: np.ndarray,
    impact: np.ndarray,
) -> int:  # fmt: skip
    """Advance by the steps of the excitation (n, n_inputs); return the step of a divergence, or -1.

    ``out``: (columns, 1, 1), room. ``q``: (n, n_modes), filled with the coordinates after every step, and ``impact``:
    (n, 2 n_bushings) with the speeds at which the contacts of the ends began.
    """
    for i in range(excitation.shape[0]):
        part = excitation[i : i + 1]
        failed, _ = advance(steps + i, part, h, lanes, shaft, motion, clearance, greases, contacts, out, 0)
        if failed >= 0:
            return i
        q[i] = motion.q[:, 0]
        impact[i] = clearance.numbers[: impact.shape[1]]
    return -1


@jit(**OPTIONS)
def march_round(
    steps: int, excitation: np.ndarray, h: float, shaft: RoundShaft, coupling: np.ndarray, drive: np.ndarray,
    motion: RoundMotion, clearance: RoundClearance, out: np.ndarray, works: np.ndarray, q: np.ndarray, spin: np.ndarray,
) -> int:  # fmt: skip
    """Advance by the steps of the excitation (n, n_inputs); return the step of a divergence, or -1.

    ``out``: (columns, 9), room. ``works``: (n, columns) of `round_energies`. ``q``: (n, n_modes), filled with the
    coordinates after every step, and ``spin``: (n,) with the shaft's before it, rad/s.
    """
    for i in range(excitation.shape[0]):
        spin[i] = motion.turning[SPIN]
        failed, _ = advance_round(
            steps + i, excitation[i : i + 1], h, shaft, coupling, drive, motion, clearance, out, 0, works[i : i + 1]
        )
        if failed >= 0:
            return i
        q[i] = motion.q
    return -1
