"""Damping from a wavelet transform near the end of a record. How much a mask must leave out."""

import itertools

import numpy as np
import pytest

from clearance_mj.signals.wavelet import scalogram, skeleton

FS, OMEGA = 2048.0, 2 * np.pi * 40.0
TIME = np.arange(8192) / FS
DECAYS = list(itertools.product((0.01, 0.02), (5.0, 10.0, 20.0)))
"""Damping ratio of the decay, centre of the Morlet wavelet"""


def bias(ratio, omega0, mask):
    """Error of ζ from the slope of ln(amplitude) over the 4 σ_t that follow a mask of so many σ_t."""
    signal = np.exp(-ratio * OMEGA * TIME) * np.cos(OMEGA * np.sqrt(1 - ratio**2) * TIME + 0.3)
    amplitude = skeleton(scalogram(signal, FS, (25, 60), omega0)).amplitude
    spread = omega0 / OMEGA
    use = (TIME > mask * spread) & (TIME < (mask + 4) * spread)
    return abs(-np.polyfit(TIME[use], np.log(amplitude[use]), 1)[0] / (ratio * OMEGA) - 1)


@pytest.mark.parametrize(("ratio", "omega0"), DECAYS)
def test_mask(ratio, omega0, measured):
    """The usual cone of √2 σ_t leaves 6 to 30 % in; 4 σ_t, which `ridge` masks, nothing that matters."""
    what = f"ζ = {ratio:.0%}, ω0 = {omega0:g}: error of ζ"
    cone = bias(ratio, omega0, np.sqrt(2))
    measured.equal(f"{what} past a cone of √2 σ_t", cone, 0.18, "6 to 30 %, a pilot study", abs=0.12)
    measured.below(f"{what} past 4 σ_t", bias(ratio, omega0, 4), 1e-3, "the decay's ζ")
