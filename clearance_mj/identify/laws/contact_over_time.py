"""Contact stiffness and damping of every bushing over time, from the restoring forces in the time-frequency plane."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...clearance.walls.slot import penetration
from ...core.errors import RecordError
from ...core.jit import jit
from ...rig import Grease
from ..forces.restoring import RestoringForce
from .grease import grease_force, grease_parameters

__all__ = ["ContactParameters", "contact_parameters"]

FINER = 4  # factor by which motions are interpolated before the gap function sharpens them
WAVELET_CENTRE = 5.0  # ω0 of the Morlet wavelets
PER_OCTAVE = 3  # wavelets
LOWEST = 5.0  # Hz, lowest of them
OVERLAP = 8  # values of k(t) and c(t) within the length of a window
HANN = np.hanning(OVERLAP + 2)[1:-1]
UNSURE = 0.5  # relative standard deviation of k from which no value is given
RELEASES = 3  # times that the instants of release, where the contact would pull, are computed from k and c


@dataclass(frozen=True, eq=False)
class ContactParameters:
    """Contact stiffness and damping over time, as `contact_parameters` finds them; nan where there is no contact.

    Like a law's, its arrays have the bushings last.
    """

    time: np.ndarray  #: (n,) middles of the windows, s
    k: np.ndarray  #: (n, n_bushings) N/m
    c: np.ndarray  #: (n, n_bushings) N s/m
    k_std: np.ndarray
    """(n, n_bushings) standard deviation, N/m, for the grease as given; its error and the structure's come on top"""
    c_std: np.ndarray  #: (n, n_bushings) N s/m
    contact: np.ndarray  #: (n, n_bushings) fraction of time in contact
    amplitude: np.ndarray  #: (n, n_bushings) mean of the envelope during contact, m; nan without
    grease: tuple[Grease, ...]  #: grease whose force was subtracted


def contact_parameters(
    force: RestoringForce, grease: Sequence[Grease] | None = None, window: float = 0.5
) -> ContactParameters:
    """Return the contact stiffness and damping over time from W_f = k W_g + c W_ġ in the time-frequency plane.

    f is the restoring force without the grease's (default: that of `grease_parameters`), g the gap function (Eq. 11) at
    the bushing's two ends, W their Morlet transforms with ω0 = 5, a third of an octave apart. In each Hann window (s) k
    and c are real least squares over all instants and bands, every band weighted by the force's noise in it. The
    contact does not pull: samples where k g + c ġ would are released, in a few rounds. Holds under any excitation.
    """
    require_contact([force])
    if not 0 < window <= force.time[-1] / 2:
        raise RecordError(f'record "{force.name}": window {window:g} s must be > 0 and within half of the record')
    greases = grease_parameters(force).grease if grease is None else tuple(grease)
    hop = max(1, round(window * force.fs / OVERLAP))
    edges = np.arange(0, force.time.size - hop + 1, hop)
    parts = [_fit_windows(force, j, grease, edges, hop) for j, grease in enumerate(greases)]
    k, c, k_std, c_std, contact, amplitude = (np.column_stack(part) for part in zip(*parts))
    time = (edges + hop / 2) / force.fs
    return ContactParameters(time, k, c, k_std, c_std, contact, amplitude, greases)


def _fit_windows(force: RestoringForce, bushing: int, grease: Grease, edges: np.ndarray, hop: int) -> tuple[Any, ...]:
    """Columns (n,) of `ContactParameters` for one bushing."""
    target = force.valid * (force.force[bushing] - grease_force(force, bushing, grease))
    g, speed, touching = _contact_motion(force, bushing)
    a = envelope(force.displacement[bushing], force.fs)
    valid_time, peak_held = (_hann_sums(np.add.reduceat(v * touching, edges)) for v in (force.valid, force.valid * a))
    sample, middle = np.arange(a.size), edges + hop / 2
    for _ in range(RELEASES):
        cells = _band_products(force, bushing, force.valid * g, force.valid * speed, target, edges)
        k, c, k_std, c_std = _solve_windows(*cells)
        identified = (valid_time > 0.5) & (k_std < UNSURE * k)
        if identified.any():
            now = (np.repeat(np.interp(sample, middle[identified], value[identified]), FINER) for value in (k, c))
            g, speed, _ = _contact_motion(force, bushing, *now)
    amplitude = np.divide(peak_held, valid_time, out=np.full(valid_time.size, np.nan), where=valid_time > 0.5)
    k, c, k_std, c_std = (np.where(identified, v, np.nan) for v in (k, c, k_std, c_std))
    return k, c, k_std, c_std, valid_time / (hop * HANN.sum()), amplitude


def _contact_motion(
    force: RestoringForce, bushing: int, k: np.ndarray | float = 1.0, c: np.ndarray | float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the gap function and its rate in the force's band, mean of both ends, and True in contact; each (n_t,)."""
    g, speed, touching = _fine_motion(force, bushing, k, c)
    return _to_band(force, g), _to_band(force, speed), touching[::FINER]


def _fine_motion(
    force: RestoringForce, bushing: int, k: np.ndarray | float, c: np.ndarray | float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same (n_t * FINER,), not yet limited to the band; samples that would pull are left out, of a spring none."""
    ends = _interpolate(force.ends[bushing])
    g = penetration(ends, *force.rig.bushings[bushing].walls)
    speed = np.gradient(ends, axis=1) * (force.fs * FINER)
    pushes = (k * g + c * speed) * np.sign(g) > 0
    return (g * pushes).mean(axis=0), (speed * pushes).mean(axis=0), pushes.any(axis=0)


def _interpolate(signal: np.ndarray) -> np.ndarray:
    """Interpolate a signal (..., n_t) that fades at its ends to FINER times its rate."""
    return FINER * np.fft.irfft(np.fft.rfft(signal), signal.shape[-1] * FINER)


def _to_band(force: RestoringForce, signal: np.ndarray) -> np.ndarray:
    """Limit a fine signal (..., n_t * FINER) to the force's band and bring it to the record's rate."""
    n = signal.shape[-1] // FINER
    spectrum = np.fft.rfft(signal)[..., : n // 2 + 1]
    spectrum[..., np.fft.rfftfreq(n, 1 / force.fs) > force.band[1]] = 0
    return np.fft.irfft(spectrum, n) / FINER


def amplitude_columns(
    force: RestoringForce, bushing: int, nodes: np.ndarray, release: float, k: np.ndarray, c: np.ndarray
) -> np.ndarray:
    """(n_t, 2 n_nodes) gap function, then its rate, times the interpolation weight of each node's amplitude, m."""
    a = envelope(_interpolate(force.displacement[bushing]), force.fs * FINER, release)
    weights = np.column_stack([np.interp(a, nodes, unit) for unit in np.eye(nodes.size)])
    g, speed, _ = _fine_motion(force, bushing, weights @ k, weights @ c)
    return _to_band(force, np.hstack((weights * g[:, None], weights * speed[:, None])).T).T


def _band_products(
    force: RestoringForce, bushing: int, g: np.ndarray, speed: np.ndarray, target: np.ndarray, edges: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Whitened products of the wavelet transforms, summed over bands and over the cells that begin at the edges.

    Returns (n, 2, 2) normal matrices of (g, ġ) and (n, 2) their products with the force, so scaled that the inverse of
    a sum of the former is the covariance that the force's noise causes.
    """
    n, fs = g.size, force.fs
    frequency = np.fft.fftfreq(n, 1 / fs)
    centres = LOWEST * 2 ** np.arange(0, np.log2(force.band[1] / LOWEST), 1 / PER_OCTAVE)
    shapes = np.exp(-0.5 * (WAVELET_CENTRE * (frequency / centres[:, None] - 1)) ** 2) * (frequency > 0)
    inside = (frequency >= LOWEST) & (frequency <= force.band[1])
    shapes *= inside / np.sqrt(np.sum(shapes**2, axis=0) + 1e-30)  # bands that together keep the energy
    density = np.interp(centres, force.noise_frequency, force.noise_density[bushing])
    spectra = np.fft.fft((g, speed, target))
    sums = np.zeros((5, edges.size))
    for shape, noise in zip(shapes, density):
        # An analytic signal (twice the positive frequencies) has twice the power; a white noise has density² fs/2.
        wg, wv, wf = np.fft.ifft(spectra * shape) * (2 / (noise * np.sqrt(fs)))
        products = (abs(wg) ** 2, (wg.conj() * wv).real, abs(wv) ** 2, (wg.conj() * wf).real, (wv.conj() * wf).real)
        sums += np.add.reduceat(np.array(products), edges, axis=1)
    gg, gv, vv, gf, vf = sums
    return np.stack((gg, gv, gv, vv), axis=1).reshape(-1, 2, 2), np.column_stack((gf, vf))


def _solve_windows(cell_normal: np.ndarray, cell_right: np.ndarray) -> tuple[np.ndarray, ...]:
    """K, c >= 0 and their standard deviations (n,), from the force's noise and the scatter between cells.

    Besides noise, the scatter holds errors of displacement and grease, and variations of k and c in a window.
    """
    effective = HANN.sum() ** 2 / np.sum(HANN**2)
    normal, right = _hann_sums(cell_normal), _hann_sums(cell_right)
    normal += 1e-12 * np.eye(2) * np.einsum("nii->ni", normal)[:, None] + 1e-300 * np.eye(2)
    inverse = np.linalg.inv(normal)
    theta = np.einsum("nij,nj->ni", inverse, right)
    single = right / np.einsum("nii->ni", normal)
    theta = np.where(theta[:, ::-1] < 0, single, theta)  # where one is negative, the other is fitted without it
    theta = np.maximum(theta, 0)
    scatter = np.zeros_like(normal)
    for i, weight in enumerate(HANN):
        near, of = (np.roll(part, OVERLAP // 2 - 1 - i, axis=0) for part in (cell_normal, cell_right))
        scores = weight * (of - np.einsum("nij,nj->ni", near, theta))
        scatter += scores[:, :, None] * scores[:, None, :]
    robust = inverse @ scatter @ inverse * effective / (effective - 2)
    std = np.sqrt(np.einsum("nii->ni", inverse + robust))
    return *theta.T, *std.T


def _hann_sums(cells: np.ndarray) -> np.ndarray:
    """Sums of cells (n, ...) under a Hann window of OVERLAP cells."""
    flat = cells.reshape(cells.shape[0], -1)
    return np.column_stack([np.convolve(column, HANN, "same") for column in flat.T]).reshape(cells.shape)


@jit
def envelope(x: np.ndarray, fs: float, release: float = 0.03) -> np.ndarray:
    """(n_t,) peak-hold with exponential release, A ← max(|x|, A e^(-dt/release)), as `AmplitudeLaw` defines it."""
    out = np.empty(x.size)
    decay, a = np.exp(-1.0 / (fs * release)), 0.0
    for i in range(x.size):
        a = max(abs(x[i]), a * decay)
        out[i] = a
    return out


def require_contact(forces: Sequence[RestoringForce]) -> None:
    """Refuse records in which the shaft never leaves the gaps; the message has the grease that can be identified."""
    if any(f.touched.any() for f in forces):
        return
    gaps = [b.gap for b in forces[0].rig.bushings]
    reached, fit = np.max([f.reach for f in forces], axis=0), grease_parameters(forces, "linear")
    moves = "; ".join(
        f"bushings[{j}]: moves up to {1e3 * r:.3g} mm in a gap of {1e3 * d:.3g} mm, "
        f"grease {e.value[0]:.4g} N/m, {e.value[1]:.3g} N s/m"
        for j, (r, d, e) in enumerate(zip(reached, gaps, fit.estimates))
    )
    names = ", ".join(f'"{f.name}"' for f in forces)
    raise RecordError(
        f"record {names}: no contact, so its stiffness and damping cannot be identified; only the grease: {moves}"
    )


def fill_untouched(values: np.ndarray, touched: np.ndarray) -> np.ndarray:
    """Return the values (..., n_bushings), those of bushings not touched replaced by the others' mean."""
    return np.where(touched, values, values[..., touched].mean(axis=-1, keepdims=True))
