"""A structure made of measured FRFs of an aircraft.

J.P. Noël and M. Schoukens, F-16 aircraft benchmark based on ground vibration test data, 2017: a shaker below the right
wing, accelerations at the shaker and on both sides of the mounting interface of a dummy payload.
"""

import numpy as np
import pytest
import scipy.io

from clearance_mj.signals.frf import FRF
from clearance_mj.structure import modes_from_frf


def test_synthesis_of_the_modes_between_2_and_15_hertz(real_data):
    """Multisine at its lowest level, mean of eight of nine periods of 8192 samples; the first one has the transient."""
    path = real_data / "f16" / "F16Data_FullMSine_Level1.mat"
    if not path.exists():
        pytest.skip(f"{path.name} is missing; it is among the records of nonlinearbenchmark.org")
    record, lines = scipy.io.loadmat(path), slice(41, 308)
    force, acceleration = (record[name].reshape(-1, 9, 8192)[:, 1:].mean(axis=1) for name in ("Force", "Acceleration"))
    value = np.fft.rfft(acceleration)[:, lines] / np.fft.rfft(force)[:, lines]
    frequency = np.arange(8192)[lines] * record["Fs"].item() / 8192
    frf = FRF(frequency, value, None, ("1:+Z", "2:+Z", "3:+Z"), "1:+Z", "acceleration/force")
    found = modes_from_frf(frf)
    assert len(found.summary()["frequency"]) >= 6 and not found.left_out
    assert found.collinearity.min() > 0.98
    assert found.frac.min() > 0.98
    assert found.rmse_db[0] < 0.6 and found.rmse_db.max() < 2.5
