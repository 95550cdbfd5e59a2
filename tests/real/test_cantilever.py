"""Measured record: shaker cantilever. Frequencies of an impact and of a cantilever of the stated size."""

import numpy as np
import pytest

from clearance_mj.io.lvm import read_lvm
from experiments.real import cantilever


def test_impact_spectrum(real_data, measured):
    """Authors: 6.62, 41.4, 117.5 Hz; a line is 0.085 Hz wide."""
    result = cantilever.analyse(real_data)
    for i, (measured_hz, known) in enumerate(zip(result["read"], cantilever.READ_BY_AUTHORS), 1):
        measured.equal(f"f{i} in the impact spectrum (Hz)", measured_hz, known, "README of the records", rel=0.005)
    mass, model = result["models"][cantilever.YOUNG]
    assert 0.05 < mass < 0.15
    for i, (measured_hz, known) in enumerate(zip(model, result["read"]), 1):
        what, source = f"f{i} of the cantilever with a mass at its end (Hz)", "impact spectrum; mass fitted to f1"
        measured.equal(what, measured_hz, known, source, rel=0.02)
    assert np.all(np.abs(result["bare"] / result["read"] - 1) > 0.09)  # without the mass


def test_downsampled_record(real_data):
    """README of the records: voltage, force (lb), acceleration (g) at 3.2 kHz, although its header says 51.2 kHz."""
    [segment] = read_lvm(real_data / "shaker_cantilever" / "test3_downsampled_by_16.lvm.gz")
    assert segment.units == ("Volts", "Pounds", "g") and segment.value.shape == (3, 63041)
    assert (segment.x.size - 1) / segment.x[-1] == pytest.approx(3200, rel=1e-4)
    assert float(segment.header["Delta_X"]) == pytest.approx(1 / 51200)


def test_mass_at_the_end():
    """No mass: λ = 1.8751, 4.6941, 7.8548. A beam without mass of its own: ω² = 3EI/(m l³)."""
    scale = np.sqrt(cantilever.YOUNG * cantilever.HEIGHT**2 / 12 / cantilever.DENSITY) / cantilever.LENGTH**2
    free = np.array([1.8751041, 4.6940911, 7.8547574]) ** 2 * scale / (2 * np.pi)
    np.testing.assert_allclose(cantilever.cantilever_frequencies(0.0), free, rtol=1e-6)
    inertia = cantilever.WIDTH * cantilever.HEIGHT**3 / 12
    heavy = np.sqrt(3 * cantilever.YOUNG * inertia / (1e4 * cantilever.LENGTH**3)) / (2 * np.pi)
    assert cantilever.cantilever_frequencies(1e4)[0] == pytest.approx(heavy, rel=1e-4)
    assert cantilever.mass_of_first(cantilever.cantilever_frequencies(0.2)[0]) == pytest.approx(0.2)


def test_peak_between_lines():
    frequency = np.arange(0, 20, 0.1)
    assert cantilever.peak(frequency, -((frequency - 7.03) ** 2), (4, 12)) == pytest.approx(7.03)
