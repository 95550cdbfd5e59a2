"""What a law makes of a measured motion, to lay beside what was measured."""

from __future__ import annotations

import numba
import numpy as np
import scipy.signal

from ..clearance.contact import contact_force, instantaneous
from ..clearance.gap import gap
from ..clearance.grease import grease_step, grease_table
from ..clearance.law import ContactLaw, Law, table_values
from .forces import RestoringForce

__all__ = ["equivalent_contact", "law_force"]

FINER = 4
"""factor by which motions are interpolated: contact begins and ends between samples"""
PHASES = 2000
"""instants of a cycle"""


def law_force(measured: RestoringForce, law: Law) -> np.ndarray:
    """Force of grease and contact that a law gives along the measured motion.

    Parameters
    ----------
    measured : RestoringForce
        Its motions are used, not its forces.
    law : Law
        Its grease, or else the rig's.

    Returns
    -------
    ndarray, shape (n_bushings, n_t)
        N, positive against positive displacement, as `RestoringForce.force`.

    Raises
    ------
    LawError
        If the law is for another number of bushings.
    """
    rig, n = measured.rig, measured.time.size
    grease, table = grease_table(rig, law), law.table(len(rig.bushings))
    points = np.concatenate((measured.displacement[:, None], measured.ends), axis=1)
    x = np.moveaxis(scipy.signal.resample(points, n * FINER, axis=2), 2, 1)
    v = np.gradient(x, axis=1) * (measured.fs * FINER)
    step = 1 / (measured.fs * FINER)
    fine = [
        _along(x[j].copy(), v[j].copy(), step, j, bushing.gap, grease[j], table)
        for j, bushing in enumerate(rig.bushings)
    ]
    return scipy.signal.resample(fine, n, axis=1)


@numba.njit(cache=True, nogil=True)
def _along(x, v, step, j, size, grease, law):
    """(n_t,) force of bushing j along the motion x, v (n_t, 3) of its middle and its two ends."""
    out, impact = np.empty(x.shape[0]), np.zeros(3)
    z, before, envelope, release = 0.0, 0.0, 0.0, np.exp(-step / law.release) if law.by_amplitude else 0.0
    for i in range(x.shape[0]):
        z, elastic, damping = grease_step(grease, x[i, 0], x[i, 0] - before, z)
        before, envelope = x[i, 0], max(abs(x[i, 0]), envelope * release)
        k_now, c_now = table_values(law, j, envelope if law.by_amplitude else i * step)
        out[i] = elastic + damping * v[i, 0]
        for end in range(1, 3):  # each carries half of the bushing's k and c
            g = gap(x[i, end], size)
            side = np.sign(g)
            if side == 0.0:
                impact[end] = 0.0
                continue
            if impact[end] == 0.0:
                impact[end] = max(side * v[i, end], 1e-12)
            k, c = instantaneous(k_now, c_now, law.exponent[j], law.kappa[j], abs(g), impact[end])
            out[i] += 0.5 * side * contact_force(k, c, abs(g), side * v[i, end], law.adhesion[j])
    return out


def equivalent_contact(law: ContactLaw, gaps, amplitude, omega) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and damping with which a spring and damper beyond the gap come closest to a contact model.

    Least squares over a cycle x = A cos ωt, as `contact.contact_parameters` finds them from records.

    Parameters
    ----------
    law : ContactLaw
        The model.
    gaps : array_like, shape (n_bushings,)
        m.
    amplitude : array_like, shape (n,)
        A, m.
    omega : array_like, shape (n_bushings,)
        rad/s.

    Returns
    -------
    k, c : ndarray, shape (n, n_bushings)
        N/m and N s/m; nan where A stays within the gap.
    """
    gaps, amplitude, omega = (np.asarray(v, dtype=float) for v in (gaps, amplitude, omega))
    table = law.table(gaps.size)
    k, c = np.full((2, amplitude.size, gaps.size), np.nan)
    for row, column in np.argwhere(amplitude[:, None] > gaps):
        k[row, column], c[row, column] = _equivalent(table, column, gaps[column], amplitude[row], omega[column])
    return k, c


def _equivalent(table, j, size, amplitude, omega):
    # Half a cycle, from one reversal to the next, holds one contact from its beginning to its end.
    within = np.arccos(size / amplitude)
    phase = -within + 2 * within * (np.arange(PHASES) + 0.5) / PHASES
    g, speed = amplitude * np.cos(phase) - size, -omega * amplitude * np.sin(phase)
    impact = omega * np.sqrt(amplitude**2 - size**2)
    model = table.k[0, j], table.c[0, j], table.exponent[j], table.kappa[j]
    force = [contact_force(*instantaneous(*model, d, impact), d, v, table.adhesion[j]) for d, v in zip(g, speed)]
    return np.linalg.lstsq(np.column_stack((g, speed)), np.array(force), rcond=None)[0]
