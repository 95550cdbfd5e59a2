"""Pressure of a radiating plate against its formulas, and the filter against one in continuous time."""

import numpy as np
import pytest
import scipy.signal

from clearance_mj.core.errors import RecordError
from clearance_mj.rig import Plate, Rig
from clearance_mj.signals.response import Response
from clearance_mj.sound import Sound, radiate, velocity

from ..rig.rig_changes import TABLES

FS = 8192.0
TIME = np.arange(int(4 * FS)) / FS
IMPEDANCE = 413.2  # N s/m³ of air at 20 °C, Fahy and Gardonio, Sound and Structural Vibration, 2nd ed.


def table1(**plate) -> Rig:
    return Rig.from_dict(TABLES | {"plate": {"sensor": 8, "area": 0.5, "distance": 2.0} | plate})


def response(rig, acceleration, fs=FS) -> Response:
    rows = np.zeros((len(rig.sensors), acceleration.size))
    rows[-1] = acceleration
    return Response(fs, np.zeros(acceleration.size), rows, responses=tuple(rig.sensor_labels))


def tone(frequency, amplitude=1.0):
    return amplitude * np.sin(2 * np.pi * frequency * TIME)


def rms(value):
    return float(np.sqrt(np.mean(value[TIME.size // 4 : -TIME.size // 4] ** 2)))


@pytest.mark.parametrize(("surroundings", "angle"), [("reflecting floor", 2 * np.pi), ("free field", 4 * np.pi)])
def test_a_tone_has_the_power_and_pressure_of_the_formulas(surroundings, angle):
    """W = ρc S σ <v²>, p² = ρc W / (2π r²), or 4π."""
    rig = table1(radiation_efficiency=0.3, surroundings=surroundings)
    speed = 2e-3  # m/s RMS at 500 Hz
    heard = radiate(response(rig, tone(500.0, np.sqrt(2) * speed * 2 * np.pi * 500)), rig)
    power = IMPEDANCE * 0.5 * 0.3 * speed**2
    expected = np.sqrt(IMPEDANCE * power / (angle * 2.0**2))
    assert rms(heard.pressure) == pytest.approx(expected, rel=1e-3)


def test_the_level_is_that_of_a_worked_example():
    """1 m² at 1 mm/s and σ = 1: L_W = 86.2 dB re 1 pW, and at 1 m above a floor L_W - 8.0 + 0.1 dB re 20 µPa."""
    rig = table1(area=1.0, distance=1.0)
    heard = radiate(response(rig, tone(500.0, np.sqrt(2) * 1e-3 * 2 * np.pi * 500)), rig).between(1.0, 3.0)
    power_level = 10 * np.log10(IMPEDANCE * 1e-6 / 1e-12)
    assert power_level == pytest.approx(86.2, abs=0.05)
    expected = power_level - 10 * np.log10(2 * np.pi) + 10 * np.log10(IMPEDANCE * 1e-12 / (20e-6) ** 2)
    assert heard.level == pytest.approx(expected, abs=0.01)


def test_each_frequency_has_its_own_efficiency():
    rig = table1(radiation_efficiency=[0.01, 1.0], frequencies=[200.0, 2000.0])
    one = table1()
    for frequency, efficiency in ((100.0, 0.01), (np.sqrt(200 * 2000), 0.1), (3000.0, 1.0)):
        moved = tone(frequency)
        ratio = rms(radiate(response(rig, moved), rig).pressure) / rms(radiate(response(one, moved), one).pressure)
        assert ratio == pytest.approx(np.sqrt(efficiency), rel=1e-3)


def test_the_filter_is_integration_and_butterworth_of_continuous_time():
    """Against scipy's Butterworth over s, marched by lsim from a smooth pulse on fine steps."""
    fine = 16
    time = np.arange(int(0.5 * FS) * fine) / (FS * fine)
    pulse = np.exp(-(((time - 0.1) / 2e-3) ** 2)) * np.sin(2 * np.pi * 300 * (time - 0.1))
    b, a = scipy.signal.butter(4, 2 * np.pi * 20.0, "high", analog=True)
    _, expected, _ = scipy.signal.lsim((b[:-1], a), pulse, time)  # over s: the numerator's last zero is at rest
    filtered = velocity(pulse[::fine], FS, 20.0)
    assert np.abs(filtered - expected[::fine]).max() < 1e-4 * np.abs(expected).max()


def test_nothing_is_heard_before_an_impact():
    rig = table1()
    moved = np.where(TIME >= 2.0, np.exp(-(TIME - 2) / 0.05) * np.sin(2 * np.pi * 400 * (TIME - 2)), 0.0)
    heard = radiate(response(rig, moved), rig).pressure
    before = np.abs(heard[: int(2.0 * FS) - 10])
    assert before.max() < 1e-3 * np.abs(heard).max()


def test_an_offset_and_a_drift_are_taken_off():
    moved = tone(500.0)
    changed = np.abs(velocity(moved + 3.0 + 2.0 * TIME, FS, 20.0) - velocity(moved, FS, 20.0))
    assert changed[TIME.size // 2 : -1000].max() < 1e-6


@pytest.mark.parametrize(
    ("plate", "fs", "words"),
    [
        (None, FS, "has no plate; give it a [plate]"),
        (Plate(sensor=9, area=1.0, distance=1.0), FS, "plate.sensor 9 is no accelerometer's node; the rig has 1, 2"),
        (Plate(sensor=8, area=1.0, distance=1.0, lowest_frequency=50.0), 80.0, "must be below half of 80 Hz"),
    ],
)
def test_what_cannot_radiate_is_refused(plate, fs, words):
    rig = Rig.from_dict(TABLES)
    with pytest.raises(RecordError) as caught:
        radiate(response(rig, np.zeros(400), fs), rig, plate)
    assert words in str(caught.value)


def test_parts_and_levels_of_a_sound():
    pressure = np.sqrt(2) * tone(1000.0)  # 1 Pa RMS is 94.0 dB (IEC 60942)
    sound = Sound(pressure, FS)
    assert sound.level == pytest.approx(93.98, abs=0.01)
    assert sound.between(1.0, 1.5).duration == pytest.approx(0.5)
    faded = sound.faded(0.1).pressure
    assert np.array_equal(faded[1000:-1000], pressure[1000:-1000])
    assert np.abs(faded[[0, -1]]).max() < 1e-3 and np.abs(faded[:400]).max() < 0.6 * np.sqrt(2)
    with pytest.raises(RecordError, match="no sample lies between"):
        sound.between(5.0)
    with pytest.raises(RecordError, match="one row of finite samples"):
        Sound([1.0, np.nan], FS)
