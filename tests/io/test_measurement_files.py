"""TDMS and MDF files: what npTDMS and asammdf write is read, and what we write they read."""

import csv
import importlib.util

import h5py
import numpy as np
import pandas as pd
import pytest
import scipy.io
from asammdf import MDF, Signal
from nptdms import ChannelObject, TdmsFile

import clearance_mj as cm
from clearance_mj.core.notes import RecordNote
from clearance_mj.io import formats
from clearance_mj.io.channels import NOWHERE

from .logger_files import blocks, mdf, tdms
from .refusals import assert_refused

N = 200
VALUE = np.sin(np.arange(N))
WAVE = {"wf_increment": 1 / 2048, "wf_start_offset": 0.25, "unit_string": "g"}


def described(channels):
    return [(c.name, c.quantity, c.unit, c.fs, c.start, c.size) for c in channels]


def test_waveforms_of_a_tdms_file(tmp_path):
    path = tdms(tmp_path, ChannelObject("bench", "Accel 3", VALUE, WAVE),
                ChannelObject("bench", "U", VALUE.astype("f4"), WAVE | {"unit_string": "mV"}))  # fmt: skip
    accel, voltage = cm.read(path)
    assert described((accel, voltage)) == [
        ("Accel 3", "acceleration", "", 2048.0, 0.25, N), ("U", "unknown", "mV", 2048.0, 0.25, N),
    ]  # fmt: skip
    assert (accel.node, accel.direction) == NOWHERE
    np.testing.assert_array_equal(accel.value, 9.80665 * VALUE)
    np.testing.assert_array_equal(voltage.value, VALUE.astype("f4"))
    (mapped,) = cm.read(path, {"Accel 3": "acc:3:-Z", "U": "skip"})
    assert (mapped.label, mapped.quantity) == ("3:-Z", "acceleration")


def test_raw_integers_of_a_tdms_file_are_scaled(tmp_path):
    """0.5 x + 1, as "NI_Scale" properties say."""
    scale = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Linear", "NI_Scale[0]_Linear_Slope": 0.5,
             "NI_Scale[0]_Linear_Y_Intercept": 1.0}  # fmt: skip
    (channel,) = cm.read(tdms(tmp_path, ChannelObject("g", "U", np.arange(9, dtype="i2"), WAVE | scale)))
    np.testing.assert_array_equal(channel.value, 9.80665 * (0.5 * np.arange(9) + 1))


def test_groups_of_other_rates_and_a_channel_of_time(tmp_path):
    slow = WAVE | {"wf_increment": 0.1, "unit_string": "N"}
    path = tdms(tmp_path, ChannelObject("fast", "A", VALUE, WAVE), ChannelObject("slow", "A", VALUE[:5], slow),
                ChannelObject("timed", "Time", np.arange(4) / 8), ChannelObject("timed", "B", VALUE[:4]),
                ChannelObject("timed", "words", ["one", "two"]))  # fmt: skip
    with pytest.warns(RecordNote) as said:
        channels = cm.read(path)
    assert described(channels) == [
        ("fast/A", "acceleration", "", 2048.0, 0.25, N), ("slow/A", "force", "", 10.0, 0.25, 5),
        ("B", "unknown", "", 8.0, 0.0, 4),
    ]  # fmt: skip
    assert str(said[0].message) == (
        f'{path}: left out "words", which holds no numbers; channels of several rates or lengths: 1 at 8 Hz, 1 at '
        "10 Hz, 1 at 2048 Hz"
    )


def test_tdms_without_a_rate(tmp_path):
    path = tdms(tmp_path, ChannelObject("g", "A", VALUE))
    words = r'a\.tdms: "A": does not say its sampling interval or rate; .* \(--fs\), .*\("A=skip"\)'
    assert_refused(words, cm.read, path)
    assert cm.read(path, fs=100.0)[0].fs == 100.0


def test_groups_and_conversions_of_an_mdf_file(tmp_path):
    time, slow = 0.25 + np.arange(N) / 2048, np.arange(5) / 10
    fast = [Signal(VALUE, time, "g", "Accel 3"),
            Signal(np.arange(N, dtype="i2"), time, "N", "F", conversion={"a": 0.5, "b": 1.0})]  # fmt: skip
    path = mdf(tmp_path, fast, [Signal(VALUE[:5], slow, "°C", "Oil")])
    with pytest.warns(RecordNote, match="channels of several rates or lengths: 1 at 10 Hz, 2 at 2048 Hz"):
        accel, force, oil = cm.read(path)
    assert described((accel, force, oil)) == [
        ("Accel 3", "acceleration", "", 2048.0, 0.25, N), ("F", "force", "", 2048.0, 0.25, N),
        ("Oil", "unknown", "°C", 10.0, 0.0, 5),
    ]  # fmt: skip
    np.testing.assert_array_equal(accel.value, 9.80665 * VALUE)
    np.testing.assert_array_equal(force.value, 0.5 * np.arange(N) + 1)


def test_mdf_at_uneven_times(tmp_path):
    path = mdf(tmp_path, [Signal(VALUE, np.arange(N) ** 2 / 64, "g", "A")])
    assert_refused(r'"A": its times are uneven .* \(--fs\), or leave it out \("A=skip"\)', cm.read, path)
    assert_refused(r"its times have 0\.32161 samples in a second, not 64 \(--fs\)", cm.read, path, fs=64.0)
    path = mdf(tmp_path, [Signal(VALUE, np.arange(N) / 64 + (np.arange(N) > 9) / 64, "g", "A")])  # one is missing
    with pytest.warns(RecordNote, match=r'"A": 64 Hz \(--fs\) in place of uneven times'):
        assert cm.read(path, fs=64.0)[0].fs == 64.0


@pytest.mark.parametrize("version", ["2.14", "3.00", "3.10", "3.30"])
def test_other_versions_of_mdf(tmp_path, version):
    group = [Signal(VALUE, np.arange(N) / 64, "g", "A"), Signal(np.arange(N, dtype="u2"), np.arange(N) / 64, "V", "B")]
    one, other = cm.read(mdf(tmp_path, group, version=version))
    assert described((one, other)) == [("A", "acceleration", "", 64.0, 0.0, N), ("B", "unknown", "V", 64.0, 0.0, N)]
    np.testing.assert_array_equal(one.value, 9.80665 * VALUE)
    np.testing.assert_array_equal(other.value, np.arange(N))


def changed(data, at, value, size=4):
    """The bytes of a file with another whole number at a place."""
    return data[:at] + value.to_bytes(size, "little") + data[at + size :]


def looped_3(data):
    """The first link of a group of channels leads to the next; here to itself."""
    first = int.from_bytes(data[68:72], "little")
    return changed(data, first + 4, first)


def looped(data):
    """asammdf follows it for ever: the first link is the next group."""
    return changed(data, data.index(b"##CG") + 24, data.index(b"##CG"), 8)


def declaring(data):
    """asammdf makes room for the bytes of one sample, 1.7 GB here, before it reads."""
    of_sample = blocks(data, b"##CG")[0] + 24
    assert int.from_bytes(data[of_sample : of_sample + 4], "little") == 16
    return changed(data, of_sample, 1_684_889_888)


def behind(data):
    """A channel behind the samples, at which asammdf ends the process."""
    places = [at + 4 for at in blocks(data, b"##CN")]
    return changed(data, next(i for i in places if int.from_bytes(data[i : i + 4], "little") == 8), 49)


@pytest.mark.parametrize("version, change, part", [
    ("3.30", lambda data: data[:66], "behind its end"),
    ("3.30", lambda data: data[: len(data) // 2], "not a whole MDF file"),
    ("3.30", lambda data: changed(data, 68, 64), "holds no time records|not a whole MDF"),
    ("3.30", lambda data: changed(data, 68, 2**31), "behind its end"),
    ("3.30", looped_3, "leads back to itself"),
    ("4.10", lambda data: b"", "not an MDF file"),
    ("4.10", lambda data: data[:300], "behind its end|ends behind the file"),
    ("4.10", lambda data: data[:64] + b"xx" + data[66:], "no block begins at byte 64"),
    ("4.10", looped, "its list of blocks at byte {group} leads back to itself"),
    ("4.10", declaring, "group 1 declares more samples than it holds"),
    ("4.10", behind, '"A" lies behind the samples of its group'),
])  # fmt: skip
def test_damaged_mdf(tmp_path, version, change, part):
    path = mdf(tmp_path, [Signal(VALUE, np.arange(N) / 64, "g", "A")], version=version)
    data = path.read_bytes()
    path.write_bytes(change(data))
    assert_refused(rf"a\.m[df4]+: .*({part.format(group=data.find(b'##CG'))})", cm.read, path)


def test_damaged_tdms(tmp_path):
    whole = tdms(tmp_path, ChannelObject("g", "A", VALUE, WAVE)).read_bytes()
    for data in (b"x" * 100, whole[:60]):
        (tmp_path / "b.tdms").write_bytes(data)
        assert_refused(r"b\.tdms: (not a whole TDMS file|holds no time records)", cm.read, tmp_path / "b.tdms")
    assert_refused(r"absent\.tdms: No such file", cm.read, tmp_path / "absent.tdms")


@pytest.mark.parametrize(("suffix", "package", "extra"), [("tdms", "npTDMS", "tdms"), ("mf4", "asammdf", "mdf")])
def test_without_the_package(tmp_path, monkeypatch, suffix, package, extra):
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == package.lower() else find(name))
    part = rf'needs the package {package}: pip install "clearance-mj\[{extra}\]"'
    assert_refused(part, cm.read, tmp_path / f"a.{suffix}")
    assert_refused(part, cm.write, tmp_path / f"a.{suffix}", [cm.Channel("a", 1, "+Z", "force", VALUE, 64.0)])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", ["tdms", "mf4"])
def test_what_cannot_be_written(tmp_path, suffix):
    same = cm.Channel("a", 1, "+Z", "force", VALUE, 64.0)
    with pytest.raises(cm.RecordError, match='two channels would be "force:1"; give each its own node'):
        cm.write(tmp_path / f"a.{suffix}", [same, same])
    assert_refused("there is no channel", cm.write, tmp_path / f"a.{suffix}", [])


# What we write, others read: twelve files of each format, their rates, lengths, places and units drawn.

UNITS = {"acceleration": "m/s2", "force": "N", "displacement": "m", "unknown": "mV"}


def drawn(seed):
    rng = np.random.default_rng(seed)
    fs, start = rng.choice([1.0, 512.0, 1000 / 3, 2048.0, 51200.0]), rng.choice([0.0, 0.25, 1e4])
    size, channels = rng.integers(4, 500), []
    for i in range(rng.integers(1, 6)):
        quantity = str(rng.choice([*UNITS]))
        place = (i + 1, "+Z") if quantity != "unknown" and rng.random() < 0.5 else NOWHERE
        value, unit = rng.standard_normal(size) * 10.0 ** rng.uniform(-12, 12), "mV" * (quantity == "unknown")
        channels.append(cm.Channel(f"Sensor {i}, ä", *place, quantity, value, float(fs), float(start), unit))
    return channels


def of_csv(path):
    numbers = (
        pd.read_csv(path, float_precision="round_trip") if pd.__version__ < "3.1" else pd.read_csv(path)
    ).to_numpy()
    with path.open(encoding="utf-8", newline="") as file:
        np.testing.assert_array_equal(numbers, np.array([*csv.reader(file)][1:], float))
    return [*numbers.T[1:]], numbers[:, 0]


def of_mat(path):
    held = scipy.io.loadmat(path)
    return [*held["data"].T], held["time"].ravel()


def of_netcdf(path):
    with scipy.io.netcdf_file(path, mmap=False) as file:
        return [*file.variables["value"][:].astype(float)], file.variables["time"][:].astype(float)


def of_hdf5(path):
    with h5py.File(path) as file:
        return [*file["value"][:]], file["time"][:]


def of_tdms(path):
    channels = TdmsFile.read(path).groups()[0].channels()
    return [c[:] for c in channels], channels[0].time_track()


def of_mdf(path):
    with MDF(path) as file:
        channels = [*file.iter_channels()]
        return [signal.samples.copy() for signal in channels], channels[0].timestamps.copy()


OTHERS = {"csv": of_csv, "mat": of_mat, "nc": of_netcdf, "h5": of_hdf5, "tdms": of_tdms, "mf4": of_mdf}


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("suffix", OTHERS)
def test_others_read_what_we_write(tmp_path, suffix, seed):
    """Numbers to the last bit; times too, save those that npTDMS computes from the step."""
    channels, path = drawn(seed), tmp_path / f"a.{suffix}"
    formats.write(path, channels)
    values, time = OTHERS[suffix](path)
    np.testing.assert_allclose(time, channels[0].time, rtol=1e-14 * (suffix == "tdms"))
    again = formats.read(path)
    for by_other in (values, [c.value for c in again]):
        np.testing.assert_array_equal(by_other, [c.value for c in channels])
    assert [(c.label, c.quantity, c.unit) for c in again] == [(c.label, c.quantity, c.unit) for c in channels]
    assert [c.fs for c in again] == pytest.approx([c.fs for c in channels], rel=1e-6)


def test_units_are_where_others_look_for_them(tmp_path):
    channels = [cm.Channel("A", *NOWHERE, "acceleration", VALUE, 64.0),
                cm.Channel("U", *NOWHERE, "unknown", VALUE, 64.0, 0, "mV")]  # fmt: skip
    for suffix in ("tdms", "mf4"):
        formats.write(tmp_path / f"a.{suffix}", channels)
    read = TdmsFile.read(tmp_path / "a.tdms").groups()[0].channels()
    assert [(c.name, c.properties["unit_string"], c.properties["wf_increment"]) for c in read] == [
        ("A", "m/s2", 1 / 64), ("U", "mV", 1 / 64),
    ]  # fmt: skip
    with MDF(tmp_path / "a.mf4") as file:
        assert [(s.name, s.unit) for s in file.iter_channels()] == [("A", "m/s2"), ("U", "mV")]
