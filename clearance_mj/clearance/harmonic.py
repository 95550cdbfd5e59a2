"""Harmonic balance of one degree of freedom: complex stiffness of elements with memory, and the response.

M. Krack and J. Gross, Harmonic Balance for Nonlinear Vibration Problems, Springer 2019, chapter 2. One harmonic is
kept, as for a lightly damped mode near its resonance, which filters out the others.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import LawError
from .contact import ContactModel
from .grease import GreaseModel

__all__ = ["equivalent_contact", "harmonic_stiffness", "periodic_amplitudes", "slip_stiffness"]

SAMPLES = 1024  # of a period
PHASES = 2000  # of a contact
PERIODS = 2  # the second one is periodic (Masing's elements: after a quarter of the first)


def slip_stiffness(amplitude: ArrayLike, springs: ArrayLike, forces: ArrayLike) -> np.ndarray:
    """Return the complex stiffness, N/m, of springs in series with Coulomb sliders under a harmonic motion.

    Parameters
    ----------
    amplitude : array_like
        (...) of the motion, m, > 0.
    springs : array_like
        (n,) stiffness of each, N/m.
    forces : array_like
        (n,) at which each slides, N.

    Returns
    -------
    numpy.ndarray
        (...) fundamental of the force over the motion: stiffness and, as imaginary part, ω times the damping.

    Raises
    ------
    LawError
        If an amplitude is not positive, or springs and forces are not as many.

    Notes
    -----
    Of one element that slips from u = F/k < X on, with cos θ = 1 - 2u/X: (k/π) (θ - sin 2θ / 2 + 4j (u/X)(1 - u/X));
    π X² times the imaginary part is the energy of a cycle, 4 F (X - u). T. K. Caughey, "Sinusoidal excitation of a
    system with bilinear hysteresis", J. Appl. Mech. 27, 1960, 640.
    """
    amplitude, springs, forces = (np.asarray(value, dtype=float) for value in (amplitude, springs, forces))
    if springs.shape != forces.shape or springs.ndim != 1:
        raise LawError(f"springs and forces are (n,) each, got {springs.shape} and {forces.shape}")
    if not (amplitude > 0).all():
        raise LawError(f"the amplitude of a motion must be > 0 m, got {amplitude.min():.6g}")
    ratio = np.minimum(forces / springs / amplitude[..., None], 1.0)
    angle = np.arccos(1 - 2 * ratio)
    return (angle - np.sin(2 * angle) / 2 + 4j * ratio * (1 - ratio)) @ springs / np.pi


def harmonic_stiffness(model: GreaseModel, amplitude: ArrayLike, omega: float, n_samples: int = SAMPLES) -> np.ndarray:
    """Return the complex stiffness, N/m, of any element with memory under a harmonic motion, by its law.

    Alternating frequency-time: the law is marched over two periods of X cos ωt; the result is the second's fundamental.

    Parameters
    ----------
    model : GreaseModel
        Any element with memory, such as `MaxwellSlip`.
    amplitude : array_like
        (...) of the motion, m, > 0.
    omega : float
        Angular frequencies, rad/s.
    n_samples : int
        Of a period.

    Returns
    -------
    numpy.ndarray
        (...) fundamental of the force over the motion.

    Raises
    ------
    LawError
        If an amplitude or the frequency is not positive.
    """
    amplitude = np.asarray(amplitude, dtype=float)
    if not ((amplitude > 0).all() and 0 < omega < np.inf):
        raise LawError(f"amplitude and frequency must be > 0, got {amplitude.min():.6g} m and {omega:.6g} rad/s")
    stiffness = [_march(model, a, omega, n_samples) for a in amplitude.ravel()]
    return np.array(stiffness).reshape(amplitude.shape)


def _march(model: GreaseModel, amplitude: float, omega: float, n_samples: int) -> complex:
    phase = 2 * np.pi * np.arange(PERIODS * n_samples + 1) / n_samples
    x, step = amplitude * np.cos(phase), 2 * np.pi / omega / n_samples
    p, state, out, force = model.parameters(), [0.0] * model.states(1), [0.0, 0.0], np.empty(x.size)
    model.law(p, state, (x[0],), (x[0],), 0.0, step, out)  # initial displacement from the middle
    for i in range(1, x.size):
        model.law(p, state, (x[i],), (x[i] - x[i - 1],), 0.0, step, out)
        force[i] = out[0] - out[1] * amplitude * omega * np.sin(phase[i])
    return complex(2 * np.mean(force[-n_samples:] * np.exp(-1j * phase[-n_samples:])) / amplitude)


def periodic_amplitudes(
    amplitude: np.ndarray, stiffness: np.ndarray, mass: float, omega: float, force: float
) -> np.ndarray:
    """Return the amplitudes, m, rising, at which m x'' + f(x, ..) = F cos ωt can vibrate harmonically.

    Parameters
    ----------
    amplitude : numpy.ndarray
        (n,) m, rising: solutions are searched between neighbours.
    stiffness : numpy.ndarray
        (n,) complex stiffness K of these amplitudes, N/m, as from `slip_stiffness`.
    mass : float
        m, kg.
    omega : float
        Angular frequencies, rad/s.
    force : float
        Amplitude F, N.

    Returns
    -------
    numpy.ndarray
        Solutions X of abs(K(X) - m ω²) X = F: one, or where resonance bends three, or none between the ends.

    Raises
    ------
    LawError
        If amplitude and stiffness are not as many, or the amplitudes do not rise from above 0.
    """
    if np.shape(amplitude) != np.shape(stiffness) or np.ndim(amplitude) != 1:
        raise LawError(f"amplitude and stiffness are (n,) each, got {np.shape(amplitude)} and {np.shape(stiffness)}")
    if not (amplitude[0] > 0 and (np.diff(amplitude) > 0).all()):
        raise LawError("amplitudes among which a response is looked for must rise, and be > 0 m")
    excess = np.abs(stiffness - mass * omega**2) * amplitude - force
    crossings = np.flatnonzero((excess[:-1] < 0) != (excess[1:] < 0))
    fraction = excess[crossings] / (excess[crossings] - excess[crossings + 1])  # exact for a linear oscillator
    return amplitude[crossings] + fraction * (amplitude[crossings + 1] - amplitude[crossings])


def equivalent_contact(
    models: Sequence[ContactModel], gaps: ArrayLike, amplitude: ArrayLike, omega: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Return k and c (n, n_bushings) of the spring and damper beyond the gap that approximate a contact model best.

    Least squares over a cycle x = A cos ωt, as in identification from records; A (n,) in m, ω
    (n_bushings,) in rad/s; nan where A stays within the gap.
    """
    gaps, amplitude, omega = (np.asarray(v, dtype=float) for v in (gaps, amplitude, omega))
    k, c = np.full((2, amplitude.size, gaps.size), np.nan)
    for i, j in np.argwhere(amplitude[:, None] > gaps):
        k[i, j], c[i, j] = _fit_cycle(models[j], gaps[j], amplitude[i], omega[j])
    return k, c


@functools.lru_cache(maxsize=1000)  # bushings are often equal
def _fit_cycle(model: ContactModel, gap: float, amplitude: float, omega: float) -> np.ndarray:
    # Half a cycle, from one reversal to the next, contains one whole contact.
    half_phase = np.arccos(gap / amplitude)
    phase = -half_phase + 2 * half_phase * (np.arange(PHASES) + 0.5) / PHASES
    depth, speed = amplitude * np.cos(phase) - gap, -omega * amplitude * np.sin(phase)
    impact = omega * np.sqrt(amplitude**2 - gap**2)
    force = [model.force(*motion, impact) for motion in zip(depth, speed)]
    return np.linalg.lstsq(np.column_stack((depth, speed)), np.array(force), rcond=None)[0]
