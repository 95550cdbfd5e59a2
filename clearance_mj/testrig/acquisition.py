"""Sensors and converter: noise, and 24 bits over a range that is a power of two."""

from __future__ import annotations

import math

import numpy as np

from ..io.uff import Channel

__all__ = ["BITS", "acquire", "digitise"]

BITS = 24
NOISE_STREAM = 2
"""Second word of the noise's seed, so that no other generator of the same seed draws the same numbers"""


def digitise(signal, noise, rng) -> tuple[np.ndarray, float]:
    """Add sensor noise and convert to 24 bits.

    Parameters
    ----------
    signal : ndarray, shape (n_t,)
        What the sensor feels.
    noise : float
        RMS of its white noise over the RMS of the signal.
    rng : numpy.random.Generator
        Source of the noise.

    Returns
    -------
    value : ndarray, shape (n_t,)
        Whole multiples of ``full_scale / 2**23``: single precision stores them exactly.
    full_scale : float
        The range is ± this, the next power of two above the peak.
    """
    noisy = signal + noise * math.sqrt(np.mean(signal**2)) * rng.standard_normal(signal.size)
    _, exponent = math.frexp(np.abs(noisy).max())
    full_scale = math.ldexp(1.0, exponent)
    step = full_scale / 2 ** (BITS - 1)
    return np.minimum(np.rint(noisy / step), 2 ** (BITS - 1) - 1) * step, full_scale


def acquire(rig, response, noise, seed: int) -> list[Channel]:
    """Measure a response of the virtual rig, shaken at its base, with its sensors and probes.

    Parameters
    ----------
    rig : Rig
        Its accelerometers; probes sit at the bushings, with the node of the nearest accelerometer.
    response : Response
        Free of noise.
    noise : float
        See `digitise`.
    seed : int
        Of the noise.

    Returns
    -------
    list of Channel
        Base acceleration, accelerometers, probes; the names tell the range.
    """
    rng = np.random.default_rng((seed, NOISE_STREAM))
    signals = [("base", 100, "acceleration", response.excitation)]
    for sensor, column in zip(rig.sensors, response.acceleration.T):
        signals.append((f"accelerometer {sensor.node}", sensor.node, "acceleration", column))
    for j, (bushing, column) in enumerate(zip(rig.bushings, response.displacement.T), 1):
        nearest = min(rig.sensors, key=lambda s: abs(s.position - bushing.position))
        signals.append((f"probe in bushing {j}", nearest.node, "displacement", column))
    return [_channel(*signal, response.fs, noise, rng) for signal in signals]


def _channel(name, node, quantity, signal, fs, noise, rng):
    value, full_scale = digitise(signal, noise, rng)
    unit = {"acceleration": "m/s^2", "displacement": "m"}[quantity]
    return Channel(f"{name}, synthetic, range +-{full_scale:.9g} {unit}", node, "+Z", quantity, value, fs)
