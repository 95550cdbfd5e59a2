"""Free decays whose stiffness and damping are known functions of time, and their identification at single scales."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp

from clearance_mj.core.errors import RecordError
from clearance_mj.identify.laws.oscillator import local_polynomials

MASS = 0.025  # kg; the article does not print it, its best scale 2^-6.8 at 8000 N/m and ω0 = 5 gives it
SLOPE_WIDTH = 0.1  # s, in the scale study
TIGHT = {"rtol": 1e-10, "atol": 1e-13}
SCALE_SEQUENCES = (
    tuple(2.0**-e for e in (5, 6, 7, 8)),
    tuple(2.0**-e for e in (6, 6.25, 6.5, 6.75, 7)),
    tuple(2.0**-e for e in (6.5, 6.6, 6.7, 6.8, 6.9, 7)),
)  # The three sequences of scales of the article's Figure 4, s


@dataclass(frozen=True)
class Condition:
    """One of the article's working conditions: parameters that are known functions of time."""

    k: Callable  #: N/m at times (n_t,) s
    c: Callable  #: N s/m at times (n_t,) s
    jumps: tuple[float, ...] = ()  #: s, where k or c jump; the value at a jump is the new one


CONDITIONS = {
    1: Condition(lambda t: np.where(t < 2, 8000.0, 5000.0), lambda t: np.where(t < 2, 0.02, 0.04), (2.0,)),
    2: Condition(lambda t: 8000 - 1000 * t, lambda t: 0.02 - 0.002 * t),
}
"""The article's working conditions, Section 3.2. The damping of the second as printed, 0.02 - 0.02 t, is negative after
1 s; 0.02 - 0.002 t stands in for it."""

SCALE_CONDITION = Condition(lambda t: np.full_like(t, 8000.0), lambda t: 0.06 - 0.0002 * t)
"""The decay of the article's Figure 4"""


@dataclass(frozen=True, eq=False)
class Decay:
    """A free decay with known parameters."""

    time: np.ndarray  #: (n_t,) s
    signal: np.ndarray  #: (n_t,) displacement, starting from 1
    k: np.ndarray  #: (n_t,) N/m
    c: np.ndarray  #: (n_t,) N s/m
    fs: float  #: samples per second
    mass: float  #: kg

    def with_noise(self, snr: float, seed: int = 0) -> Decay:
        """Add white Gaussian noise; snr: mean power of the signal over that of the noise, dB."""
        noise = np.random.default_rng(seed).standard_normal(self.time.size)
        return replace(self, signal=self.signal + (np.sqrt(np.mean(self.signal**2)) * 10 ** (-snr / 20)) * noise)


@dataclass(frozen=True)
class ScaleResult:
    """Cost and error of one scale of Figure 4."""

    scale: float  #: s
    points: int  #: translations, 50 T/a + 1
    products: int  #: multiplications of a sample with the wavelet
    seconds: float  #: time for them
    k_error: float  #: root mean square of the relative error of k = m (ω0/a)²
    c_error: float  #: root mean square of the relative error of c
    time: np.ndarray  #: (n,) s, the translations within the record's interior
    c: np.ndarray  #: (n,) N s/m


def free_decay(condition: Condition, duration: float = 4.0, fs: float = 2048.0) -> Decay:
    """Simulate a free decay of 0.025 kg from rest, of a duration in s, accurate to about 1e-9 of the start."""
    time = np.arange(round(duration * fs)) / fs
    signal, state = np.empty_like(time), np.array([1.0, 0.0])
    edges = [0.0, *(jump for jump in condition.jumps if jump < duration), duration]
    for start, stop in zip(edges, edges[1:]):
        within = (time >= start) & (time < stop)
        last = np.nextafter(stop, start)  # at its end too, k and c are those of this stretch
        path = solve_ivp(
            _oscillator, (start, stop), state, "DOP853", time[within], True, args=(condition, last), **TIGHT
        )
        signal[within], state = path.y[0], path.sol(stop)
    k, c = (np.broadcast_to(value(time), time.shape).astype(float) for value in (condition.k, condition.c))
    return Decay(time, signal, k, c, float(fs), MASS)


def _oscillator(time, state, condition, last):
    time = min(time, last)
    return state[1], -(condition.k(time) * state[0] + condition.c(time) * state[1]) / MASS


def rms_error(value, truth, valid) -> float:
    """Return the root mean square of the relative error where it is valid; 1 is 100 %."""
    value, truth = np.asarray(value)[valid], np.asarray(truth)[valid]
    return float(np.sqrt(np.mean((value / truth - 1) ** 2)))


def scale_study(decay: Decay, scales, duration: float = 4.0, omega0: float = 5.0) -> tuple[ScaleResult, ...]:
    """Identify a decay at single scales in s, as the article does, instead of on the ridge.

    The duration is that from the first to the last translation, the article's 4 T; the decay must be longer by 16
    times the largest scale, so that every wavelet lies within it (RecordError).

    Article, Section 3.2: translations b = a (16 κ + 8), κ = 0 : 0.005 : T/(4a), where 16 is the support of the wavelet;
    A = 2|W|/√a and ω = ω0/a (Eq. 13), k = m ω² (Eq. 14), c = -2m A'/A (Eq. 12, read as viscous). The slope of ln A is
    that of a local parabola 0.1 s wide (standard deviation of its weights) at every scale.
    """
    return tuple(_at_scale(decay, float(scale), duration, omega0) for scale in scales)


def _at_scale(decay, scale, duration, omega0) -> ScaleResult:
    shift = scale * (16 * 0.005 * np.arange(1 + int(duration / (0.08 * scale) + 1e-9)) + 8)
    first, width = np.ceil((shift - 8 * scale) * decay.fs).astype(int), int(16 * scale * decay.fs)
    if first[-1] + width > decay.time.size:
        raise RecordError(
            f"the decay lasts {decay.time.size / decay.fs:g} s; scale {scale:g} s needs {duration + 16 * scale:g} s"
        )
    start = clock.perf_counter()
    samples = first[:, None] + np.arange(width)
    u = (samples / decay.fs - shift[:, None]) / scale
    wave = np.exp(-(u**2) / 2 - 1j * omega0 * u) / np.sqrt(2 * np.pi)
    value = np.einsum("bt,bt->b", wave, decay.signal[samples]) / (np.sqrt(scale) * decay.fs)
    seconds = clock.perf_counter() - start
    level = np.log(2 * np.abs(value) / np.sqrt(scale))
    step = shift[1] - shift[0]
    _, slope, _ = local_polynomials(level, np.ones_like(level), SLOPE_WIDTH / step, 2)
    c = -2 * decay.mass * slope / step
    truth = [np.interp(shift, decay.time, value) for value in (decay.k, decay.c)]
    k = np.full_like(shift, decay.mass * (omega0 / scale) ** 2)
    errors = [rms_error(value, true, slice(None)) for value, true in zip((k, c), truth)]
    return ScaleResult(scale, shift.size, samples.size, seconds, *errors, shift, c)
