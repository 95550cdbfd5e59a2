"""Sound that a vibrating plate radiates: from the acceleration of one sensor to the pressure at a distance.

The sound power of a plate of area S is W = ρc S σ <v²>, with the mean squared velocity <v²> across it and the radiation
efficiency σ (ISO/TS 7849-1:2009 and 7849-2:2009, where σ is called the radiation factor ε; Fahy and Gardonio, Sound and
Structural Vibration, 2nd ed. 2007, chapter 3; Cremer, Heckl and Petersson, Structure-Borne Sound, 3rd ed. 2005). It
spreads evenly over the half sphere above a reflecting floor, so that p² = ρc W / (2π r²) at distance r, or over the
sphere of a free field, with 4π (the measurement surfaces of ISO 3744:2010 and ISO 3745:2012). Hence

    p(f) = ρc sqrt(S σ(f) / (2π r²)) v(f),

which is applied as a filter, so that the pressure keeps the time course of the velocity, such as that of a rattle.
The plate's phase and directivity, and the travel time of sound, are neglected.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import scipy.fft

from ..core.errors import RecordError
from ..rig import Plate, Rig
from ..signals.response import Response
from .pressure import Sound

__all__ = ["AIR_IMPEDANCE", "radiate", "velocity"]

AIR_IMPEDANCE = 1.204 * 343.2
"""ρc of air at 20 °C and 1013.25 hPa, N s/m³."""
HIGH_PASS_ORDER = 4  # of the Butterworth high-pass of the velocity
SETTLING = 8.0  # periods of the corner frequency in which the filter's transient decays below 1e-6


def velocity(
    acceleration: np.ndarray, fs: float, lowest: float, gain: Callable[[np.ndarray], np.ndarray] | None = None
) -> np.ndarray:
    """Integrate an acceleration to a high-pass filtered velocity.

    A causal Butterworth high-pass of fourth order removes frequencies below its corner; both it and the integration are
    those of continuous time, exact at every line of the spectrum, and the motion is taken to begin and end at rest.

    Parameters
    ----------
    acceleration : ndarray, shape (n,)
        m/s².
    fs : float
        Samples per second.
    lowest : float
        Corner of the high-pass, Hz: 3 dB down there, 24 dB per octave below.
    gain : callable, optional
        Additional real gain over frequency, Hz, without phase.

    Returns
    -------
    ndarray, shape (n,)
        m/s, times the gain.
    """
    n = acceleration.size
    padded = scipy.fft.next_fast_len(n + math.ceil(SETTLING * fs / lowest), real=True)
    frequency = scipy.fft.rfftfreq(padded, 1 / fs)
    s = 1j * frequency / lowest
    poles = np.exp(1j * np.pi * (2 * np.arange(1, HIGH_PASS_ORDER + 1) + HIGH_PASS_ORDER - 1) / (2 * HIGH_PASS_ORDER))
    # s^4 of the high-pass over s of the integration is s^3, without division by zero at f = 0.
    response = s ** (HIGH_PASS_ORDER - 1) / np.prod(s[:, None] - poles, axis=1) / (2 * np.pi * lowest)
    if gain is not None:
        response = response * gain(frequency)
    result: np.ndarray = scipy.fft.irfft(scipy.fft.rfft(acceleration, padded) * response, padded)[:n]
    return result


def radiate(response: Response, rig: Rig, plate: Plate | None = None) -> Sound:
    """Return the sound of a rig's plate under a response, at the response's sampling rate.

    Parameters
    ----------
    response : Response
        Simulated or measured accelerations of the rig's sensors.
    rig : Rig
        The rig of these sensors.
    plate : Plate, optional
        Radiating plate; None: that of the rig.

    Returns
    -------
    Sound
        Pressure at the plate's distance, Pa.

    Raises
    ------
    RecordError
        If there is no plate, its sensor is not in the response, or it listens from above half the sampling rate.
    """
    if (plate := plate or rig.plate) is None:
        raise RecordError(f'rig "{rig.name}" has no plate; give it a [plate] with sensor, area and distance')
    try:
        label = rig.sensor_labels[plate.row(rig.sensors)]
    except ValueError as error:
        raise RecordError(f"plate.{error}") from None
    labels = response.responses or tuple(rig.sensor_labels)
    labels = tuple(name for name, quantity in zip(labels, response.quantities) if quantity == "acceleration")
    if label not in labels or len(response.acceleration) != len(labels):
        raise RecordError(f"the response has no acceleration {label}, with which the plate moves")
    if not (lowest := plate.lowest_frequency) < response.fs / 2:
        raise RecordError(f"plate.lowest_frequency {lowest:g} Hz must be below half of {response.fs:g} Hz")
    scale = AIR_IMPEDANCE * math.sqrt(plate.area / plate.solid_angle) / plate.distance
    motion = response.acceleration[labels.index(label)]
    pressure = velocity(motion, response.fs, lowest, lambda f: scale * np.sqrt(plate.efficiency(f)))
    return Sound(pressure, response.fs, f"plate at {label} of {rig.name}", dict(response.provenance))
