"""Sampling rates, jitter, starts, dates and resampling; the answers are the functions that files are written from."""

import numpy as np
import pytest
import scipy.io
from asammdf import Signal
from nptdms import ChannelObject

import clearance_mj as cm
from clearance_mj.cli import main
from clearance_mj.core.checks import even_rate
from clearance_mj.core.notes import RecordNote
from clearance_mj.io.time_axis import resample_channels

from .logger_files import blocks, mdf, tdms
from .refusals import assert_refused
from .uff_by_hand import by_hand

FS, N = 2000.0, 8000  # of a car's accelerometers
EVEN = np.arange(N) / FS


def tone(time, frequency=7.0):
    return np.sin(2 * np.pi * frequency * time + 0.3)


@pytest.fixture
def car(tmp_path, rng):
    """Two even accelerometers, B twice A, the second with invalid samples; a message of CAN at 100 Hz that jitters."""
    can = np.arange(400) / 100 + 0.0037 + rng.uniform(-3e-3, 3e-3, 400)
    lost, invalid = np.delete(can, [100, 200, 201]), (np.arange(N) >= 4000) & (np.arange(N) < 4010)
    b = Signal(np.where(invalid, 0.0, 2 * tone(EVEN)), EVEN, "m/s^2", "B", invalidation_bits=invalid)
    return mdf(tmp_path, [Signal(tone(EVEN), EVEN, "m/s^2", "A"), b], [Signal(tone(can, 3.0), can, "rpm", "Speed")],
               [Signal(tone(lost, 3.0), lost, "Nm", "Torque")])  # fmt: skip


@pytest.fixture
def said(tmp_path):
    """Read a file, and return its channels and the notes without the file's name."""

    def read(path, **options):
        with pytest.warns(RecordNote) as notes:
            channels = cm.read(path, **options)
        return channels, [str(one.message).removeprefix(f"{path}: ") for one in notes]

    return read


def csv(path, header, times, values, form="%.6f"):
    path.write_text("\n".join([header, *(f"{t},{form % v}" for t, v in zip(times, values))]) + "\n")
    return path


def test_a_channel_of_a_car_that_is_uneven_blocks_no_other(car, said):
    assert_refused(r'"Torque": its times are uneven .*--resample RATE .*\("Torque=skip"\)', cm.read, car)
    (a, b, speed), (note,) = said(car, columns={"Torque": "skip"})
    assert [(c.name, c.fs, c.size) for c in (a, b, speed)] == [("A", FS, N), ("B", FS, N), ("Speed", 100.0, 400)]
    assert '"B": 10 of 8000 samples are marked as invalid, from sample 4000 on; they are interpolated' in note
    assert '"Speed": times jitter by up to 0.0031 s about even steps; taken for 100 Hz' in note
    np.testing.assert_allclose(b.value, 2 * a.value, atol=7e-3)  # straight lines between: (ω h)²/8 of 11 samples
    assert (np.abs(b.value - 2 * a.value) > 1e-12).sum() <= 10


def test_a_sampling_rate_is_not_that_of_another_channel(car, said):
    assert_refused(r'"Torque": its times have 99\.\d+ samples in a second, not 2048 \(--fs\)', cm.read, car, fs=2048.0)
    channels, (note,) = said(car, columns={"Torque": "skip"}, fs=2048.0)
    assert [c.fs for c in channels] == [FS, FS, 100.0]
    assert '"A", "B": 2000 Hz by its times, not 2048 (--fs)' in note


def test_records_of_a_car_at_one_rate(car, said):
    """Jitter and lost messages included: cubic splines between the true instants of a sine of 3 Hz at 100 Hz."""
    channels, notes = said(car, resample=500.0)
    assert {(c.fs, c.start, c.size) for c in channels} == {(500.0, channels[0].start, channels[0].size)}
    inner = slice(50, -50)  # what is beyond the ends is unknown
    for channel, height, frequency in zip(channels, (1, 2, np.pi / 30, 1), (7.0, 7.0, 3.0, 3.0)):
        expected = height * tone(channel.time, frequency)
        bound = 7e-3 if channel.name == "B" else 2e-3  # straight lines between invalid samples
        np.testing.assert_allclose(channel.value[inner], expected[inner], atol=bound)
    assert '"Torque": interpolated by cubic splines between 397 of 397 uneven instants, over gaps of up to ' in notes[0]
    assert notes[1].startswith("resampled to 500 Hz from 0.")


def test_commands_resample_and_skip(car, tmp_path, capsys):
    out = tmp_path / "a.csv"
    assert main(["convert", str(car), str(out), "--column", "Torque=skip", "--resample", "1000"]) == 0
    assert "3 channels" in capsys.readouterr().out and {c.fs for c in cm.read(out)} == {1000.0}
    assert main(["show", str(car), "--column", "Torque=skip", "--column", "Speed=skip"]) == 0
    assert "2 x time record" in capsys.readouterr().out


@pytest.mark.parametrize(("fs", "start", "rate"), [(2000.0, 0.00013, 2000.0), (2000.0, 0.01, 512.0), (512.0, 0, 2048)])
def test_resampling_keeps_what_both_rates_hold(fs, start, rate):
    """Sines up to 0.35 of the lower rate and an offset, at starts between samples, within 0.2 %."""
    high = 0.35 * min(fs, rate)

    def value(time):
        return 5 + np.sin(2 * np.pi * high * time) + np.cos(2 * np.pi * 20.3 * time)

    times = [begin + np.arange(4000) / fs for begin in (0.0, start)]
    for channel in resample_channels([cm.Channel("A", 0, "S", "unknown", value(t), fs, t[0]) for t in times], rate, []):
        inner = slice(100, -100)
        np.testing.assert_allclose(channel.value[inner], value(channel.time[inner]), atol=4e-3)
        assert channel.start == start


def test_records_that_share_no_time():
    a, b = (cm.Channel(name, 0, "S", "unknown", np.ones(10), 10.0, start) for name, start in (("A", 0.0), ("B", 5.0)))
    assert_refused(r'"A" ends at 0\.9 s, "B" begins at 5 s; leave one out', resample_channels, [a, b], 10.0, [])
    assert_refused("must be > 0 Hz, got -1", resample_channels, [a], -1.0, [])


def test_what_is_not_resampled(tmp_path):
    path = tmp_path / "frf.csv"
    path.write_text("frequency [Hz],acc:1/force real,acc:1/force imag\n1,1,0\n2,1,0\n")
    assert_refused("holds FRFs; only time records are resampled", cm.read, path, resample=100.0)


def test_jitter_of_a_logger(rng):
    """0.5 ms at 500 Hz is even; a lost sample is not, wherever it is, with and without jitter."""
    time = np.arange(5000) / 500 + rng.uniform(-5e-4, 5e-4, 5000)
    notes: list[str] = []
    rate, start = even_rate(time, 1e-9, notes)
    assert (rate, notes) == (500.0, ["times jitter by up to 0.00051 s about even steps; taken for 500 Hz"])
    assert start == pytest.approx(0.0, abs=2e-5)
    for jitter in (0.0, 2e-4):
        for lost in (1, 20, 2500, 4998):
            noisy = np.delete(np.arange(5000) / 500, lost) + rng.uniform(-jitter, jitter, 4999)
            assert_refused("its times are uneven", even_rate, noisy, 1e-9, notes)


def test_jitter_in_text_and_matlab(tmp_path, rng, said):
    time = np.arange(1000) / 500 + rng.uniform(-5e-4, 5e-4, 1000)
    scipy.io.savemat(tmp_path / "a.mat", {"time": time, "a": tone(time)})
    for each in (csv(tmp_path / "a.csv", "Time [s],A", [f"{t:.6f}" for t in time], tone(time)), tmp_path / "a.mat"):
        (channel,), (note,) = said(each)
        assert (channel.fs, channel.size) == (500.0, 1000) and "times jitter by up to 0.0005" in note
        assert "about even steps; taken for 500 Hz" in note
        (channel,), _ = said(each, resample=500.0)
        np.testing.assert_allclose(channel.value[9:-9], tone(channel.time[9:-9]), atol=2e-4)


def test_jitter_in_a_universal_file(tmp_path, rng):
    time = np.arange(40) / 500 + rng.uniform(-5e-4, 5e-4, 40)
    pairs = [f"{t:13.5e}{v:13.5e}" for t, v in zip(time, tone(time))]
    rows = ["".join(pairs[i : i + 3]) for i in range(0, 40, 3)]
    (tmp_path / "a.uff").write_bytes(by_hand(rows, spacing=0, count=40, step="2.00000E-03"))
    with pytest.warns(UserWarning, match=r"times jitter by up to 0\.0005.* about even steps; taken for 500 Hz"):
        (channel,) = cm.read(tmp_path / "a.uff")
    assert (channel.fs, channel.size) == (500.0, 40)


START = 1767323456  # 2026-01-02 03:10:56 UTC, by the rules of POSIX: 20,455 days of 86,400 s and 11,456 s
STAMPS = {
    "timestamp s": ("timestamp", [f"{START + i / 1000:.3f}" for i in range(40)], "s since 1970"),
    "timestamp ms": ("timestamp", [f"{1000 * START + i}" for i in range(40)], "ms since 1970"),
    "timestamp us": ("Unix Timestamp", [f"{10**6 * START + 1000 * i}" for i in range(40)], "µs since 1970"),
    "timestamp ns": ("stamp", [f"{10**9 * START + 10**6 * i}" for i in range(40)], "ns since 1970"),
    "ms of our name": ("time", [f"{1000 * START + i}" for i in range(40)], "ms since 1970"),
    "header says ms": ("epoch_ms", [f"{1000 * START + i}" for i in range(40)], "ms since 1970"),
    "brackets say ns": ("Timestamp (ns)", [f"{10**9 * START + 10**6 * i}" for i in range(40)], "ns since 1970"),
    "LabVIEW": ("Time", [f"{START + 2082844800 + i / 1000:.3f}" for i in range(40)], "s since 1904"),
}


@pytest.mark.parametrize("name", STAMPS)
def test_dates_in_numbers(tmp_path, said, name):
    header, times, words = STAMPS[name]
    (channel,), (note,) = said(csv(tmp_path / "a.csv", f"{header},A [g]", times, np.arange(40.0)))
    assert (channel.fs, channel.start, channel.size) == (1000.0, 0.0, 40)
    assert note == f'"{header.split(" (")[0]}" is taken for {words}: time begins at 2026-01-02T03:10:56.000000 UTC'


@pytest.mark.parametrize(
    ("header", "step"),
    [("time_ms", 1), ("t [us]", 1000), ("Time (µs)", 1000), ("t_ns", 10**6), ("Time in ms", 1), ("millis", 1),
     ("elapsed_us", 1000), ("Time (msec)", 1), ("timestampMs", 1), ("Time since start [ms]", 1)],
)  # fmt: skip
def test_units_of_counts_since_the_start(tmp_path, header, step, recwarn):
    path = csv(tmp_path / "a.csv", f"{header},A [g]", [str(step * i) for i in range(40)], np.arange(40.0))
    (channel,) = cm.read(path)
    assert (channel.fs, channel.start) == (1000.0, 0.0) and not recwarn.list


def test_counts_without_a_unit_are_seconds_and_that_is_said(tmp_path, said):
    path = csv(tmp_path / "a.csv", "timestamp,A [g]", range(40), np.arange(40.0))
    (channel,), (note,) = said(path)
    assert channel.fs == 1.0
    assert note == '"timestamp" does not say its unit, s is taken; if it counts others, map it: "timestamp=time [ms]"'
    assert cm.read(path, {"timestamp": "time [ms]"})[0].fs == 1000.0


def test_stamps_of_whole_ms_tell_the_rate_by_all_of_them(tmp_path, said):
    """Rounded to 1 ms of 2 ms, the first up and the last down: by these two it would be 500.84 Hz."""
    times = [1000 * START + 2 * i + (i % 7 == 0) for i in range(300)]
    (channel,), (note,) = said(csv(tmp_path / "a.csv", "timestamp,A [g]", times, np.arange(300.0)))
    assert channel.fs == 500.0
    assert "times jitter by up to 0.00086 s about even steps; taken for 500 Hz" in note


def test_a_date_beside_the_time(tmp_path, recwarn):
    times = [f"{i / 1000:.3f},{1000 * START + i}" for i in range(40)]
    (channel,) = cm.read(csv(tmp_path / "a.csv", "Time [s],Timestamp [ms],A [g]", times, np.arange(40.0)))
    assert (channel.fs, channel.start, channel.name) == (1000.0, 0.0, "A") and not recwarn.list


# TDMS

WAVE = {"wf_increment": 1 / 1024, "wf_start_offset": 0.0, "unit_string": "m/s^2"}
NOON = np.datetime64("2026-01-01T12:00:00.000000")


def started(microseconds):
    return WAVE | {"wf_start_time": NOON + np.timedelta64(microseconds, "us")}


def test_waveforms_that_begin_at_other_times(tmp_path, rng, said):
    """B is twice A, recorded from 0.25 s on (256 samples): over the time that they share the FRF is 2 exactly."""
    x = rng.standard_normal(1280)
    a, b = ChannelObject("g", "A", x[:1024], started(0)), ChannelObject("g", "B", 2 * x[256:], started(250_000))
    (first, second), notes = said(tdms(tmp_path, a, b))
    assert (first.start, second.start) == (0.0, 0.25)
    assert notes == ['"B": begins 0.25 s after the first channel (wf_start_time)']
    (first, second), notes = said(tmp_path / "a.tdms", resample=1024.0)
    np.testing.assert_allclose(second.value, 2 * first.value, rtol=1e-14)
    assert first.size == 768
    assert notes[1] == "resampled to 1024 Hz from 0.25 s to 0.999023 s, which all channels share"


def test_starts_that_say_nothing(tmp_path, said, recwarn):
    """LabVIEW's zero, 1904, is none; a channel without a start begins with the first."""
    zero = WAVE | {"wf_start_time": np.datetime64("1904-01-01T00:00:00.000000")}
    path = tdms(tmp_path, ChannelObject("g", "A", np.ones(9), zero), ChannelObject("g", "B", np.ones(9), started(0)))
    assert [c.start for c in cm.read(path)] == [0.0, 0.0] and not recwarn.list
    waves = {"A": WAVE, "B": started(0), "C": started(500_000)}
    path = tdms(tmp_path, *(ChannelObject("g", name, np.ones(9), wave) for name, wave in waves.items()))
    channels, (note,) = said(path)
    assert [c.start for c in channels] == [0.0, 0.0, 0.5]
    assert '"A": has no wf_start_time, taken to begin with the first channel' in note


def test_a_scale_that_nobody_applies(tmp_path):
    """npTDMS logs it and gives raw numbers."""
    unknown = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Reciprocal"}
    applied = {"NI_Scaling_Status": "scaled"}
    path = tdms(tmp_path, ChannelObject("g", "A", np.arange(9, dtype="i2"), WAVE | unknown),
                ChannelObject("g", "B", np.arange(9.0), WAVE | unknown | applied))  # fmt: skip
    assert_refused(r'"A": has a scale \(NI_Scale\) that npTDMS does not apply.*\("A=skip"\)', cm.read, path)
    (channel,) = cm.read(path, {"A": "skip"})
    np.testing.assert_array_equal(channel.value, np.arange(9.0))


def test_channels_of_tdms_that_are_skipped(tmp_path, recwarn):
    """Without a rate, without numbers, over frequency by name or by axis."""
    over = WAVE | {"wf_xname": "Frequency", "wf_xunit_string": "Hz"}
    path = tdms(tmp_path, ChannelObject("g", "A", np.ones(9), WAVE), ChannelObject("g", "Setpoint", np.ones(3)),
                ChannelObject("g", "words", ["one", "two"]), ChannelObject("g", "A (FFT - (Peak))", np.ones(5), WAVE),
                ChannelObject("g", "S", np.ones(5), over))  # fmt: skip
    for name, part in (("Setpoint", "interval or rate"), ("A (FFT - (Peak))", "is a spectrum"), ("S", "is over F")):
        others = {other: "skip" for other in ("Setpoint", "words", "A (FFT - (Peak))", "S") if other != name}
        assert_refused(part, cm.read, path, others)
    assert [c.name for c in cm.read(path, others | {"S": "skip"})] == ["A"] and not recwarn.list


def test_a_channel_of_time_has_its_unit(tmp_path, said):
    path = tdms(tmp_path, ChannelObject("g", "Time", 10**6 * START + 1000 * np.arange(40), {"unit_string": "us"}),
                ChannelObject("g", "A", np.ones(40)))  # fmt: skip
    (channel,), (note,) = said(path)
    assert (channel.fs, channel.start) == (1000.0, 0.0) and "us since 1970" in note


# MDF


@pytest.mark.parametrize("kind, part", [
    (2, "is over angle, not over time"), (0, "does not say its sampling interval or rate"),
])  # fmt: skip
def test_masters_that_are_no_time(tmp_path, kind, part):
    """A group without a master has no times, which asammdf counts from 0; one over an angle is no record."""
    path = mdf(tmp_path, [Signal(np.ones(50), np.arange(50) / 64, "g", "A")])
    data = path.read_bytes()
    at = next(i for i in blocks(data, b"##CN") if data[i] == 2)  # the master; its next byte says over what
    path.write_bytes(data[:at] + bytes((kind, kind)) + data[at + 2 :])
    assert_refused(f'"A": {part}', cm.read, path, {"time": "skip"} if kind == 0 else None)


def test_samples_that_are_mostly_invalid_are_a_slower_channel(tmp_path, said):
    invalid, time = np.arange(200) % 4 > 0, np.arange(200) / 64
    value = np.where(invalid, 99.0, tone(time))
    (channel,), (note,) = said(mdf(tmp_path, [Signal(value, time, "g", "A", invalidation_bits=invalid)]))
    np.testing.assert_allclose(channel.value, 9.80665 * tone(np.arange(50) / 16), rtol=1e-14)
    assert (channel.fs, channel.size) == (16.0, 50)
    assert note == '"A": 150 of 200 samples are marked as invalid, from sample 1 on; it is taken at the others'
