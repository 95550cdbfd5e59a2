"""Sound of the shown setting: of the rig's plate or, without one, a sensor's signal."""

from __future__ import annotations

import numpy as np

from ..core.errors import ClearanceError
from ..core.quantities import QUANTITIES
from ..sound import Sound, radiate, resampled
from .figures import Numbers
from .session import SettingResult

__all__ = ["heard"]

RATE = 16_000.0  # samples per second that are sent: every browser takes them, and simulations hold less
LONGEST = 6.0  # s that are sent


def heard(shown: SettingResult, sensor: int) -> Numbers:
    """Return the last seconds of what a setting gave.

    Parameters
    ----------
    shown : Shown
        What a setting gave.
    sensor : int
        Row of the sensor that is heard where the rig has no plate.

    Returns
    -------
    Numbers
        Array "samples" (n,) in "unit", Pa or the sensor's, "rate" of them in a second; "of", in words; the setting's
        "values".

    Raises
    ------
    ClearanceError
        If there is no such sensor.
    """
    response, plate = shown.response, shown.model.rig.plate
    if plate is not None:
        sound, unit, words = radiate(response, shown.model.rig), "Pa", f"the plate at sensor {plate.sensor}"
    elif sensor < len(response.channels):
        sound = Sound(response.channels[sensor] - response.channels[sensor].mean(), response.fs)
        quantity = response.quantities[sensor]
        unit, words = QUANTITIES[quantity].unit, f"the {quantity} {response.responses[sensor]}"
    else:
        raise ClearanceError(f"there is no sensor {sensor + 1} to hear")
    part = sound.between(max(0.0, sound.duration - LONGEST)).faded()
    samples: np.ndarray = resampled(part.pressure, part.fs, RATE)
    return Numbers({"unit": unit, "rate": RATE, "of": words, "values": shown.values}, {"samples": samples})
