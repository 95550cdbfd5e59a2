"""Run-out: the readings of displacement probes at a turning shaft whose axis stays where it is.

A shaft is not quite round and its surface not quite even where a probe looks at it. Turned slowly, its axis rests: the
probes' readings over the shaft's angle are then subtracted from those at any speed (slow-roll compensation; API
Standard 670; Bently & Hatch, Fundamentals of Rotating Machinery Diagnostics, 2002, chapter 6).
"""

from __future__ import annotations

import numpy as np

__all__ = ["SLOW", "TURNS", "run_out", "run_out_at"]

TURNS = 4  # multiples of the spin that unbalance and run-out excite
SLOW = 0.35  # of the fastest record's spin: so slow is a turning in which unbalance moves nothing


def run_out(angle: np.ndarray, displacement: np.ndarray) -> np.ndarray:
    """Return the run-out (2 TURNS, n_probes) of each probe per cos kθ and sin kθ of the shaft's angle θ, m.

    Parameters
    ----------
    angle : ndarray, shape (n_t,)
        rad, of a shaft that turns slowly.
    displacement : ndarray, shape (n_probes, n_t)
        Readings of the probes, m.
    """
    rows = np.column_stack((_multiples(angle), np.ones(angle.size)))
    return np.asarray(np.linalg.lstsq(rows, displacement.T, rcond=None)[0][:-1])


def run_out_at(angle: np.ndarray, surface: np.ndarray) -> np.ndarray:
    """Return the readings of a run-out at angles of the shaft, (n_probes, n_t), m.

    Parameters
    ----------
    angle : ndarray, shape (n_t,)
        rad.
    surface : ndarray, shape (2 TURNS, n_probes)
        As `run_out` returns.
    """
    return np.asarray((_multiples(angle) @ surface).T)


def _multiples(angle: np.ndarray) -> np.ndarray:
    """(n_t, 2 TURNS) cos kθ and sin kθ."""
    phase = np.outer(angle, np.arange(1, TURNS + 1))
    return np.column_stack((np.cos(phase), np.sin(phase)))
