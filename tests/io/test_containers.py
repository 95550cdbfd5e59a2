"""Files of other programs whose channels stand in nested fields; the numbers are those that the files are made from."""

import h5netcdf
import h5py
import numpy as np
import pytest
import scipy.io
from sdypy_sep005 import Sep005Data

import clearance_mj as cm
from clearance_mj.core.notes import RecordNote
from clearance_mj.io.channels import NOWHERE
from clearance_mj.io.containers import from_sep005, to_sep005

from .refusals import assert_refused
from .test_measurement_files import described

FS, N, G = 2048.0, 300, 9.80665
TIME = np.arange(N) / FS
VALUE = np.sin(np.arange(3 * N)).reshape(3, N)


def simcenter(value, label, x="s", names=("Time",)):
    """As Simcenter Testlab exports a signal to MATLAB."""
    quantity = {"label": x, "quantity_terms": {"TIME": 1.0}}
    return {
        "x_values": {"start_value": 0.5, "increment": 1 / FS, "number_of_values": float(N), "quantity": quantity},
        "y_values": {"values": value, "quantity": {"label": label, "unit_transformation": {"factor": 1.0}}},
        "function_record": {"name": names[0] if len(names) == 1 else np.array(names, dtype=object), "type": "Time"},
    }


def test_signals_of_simcenter(tmp_path):
    """Three accelerations in one signal, a force in another, which has another unit."""
    scipy.io.savemat(
        tmp_path / "a.mat",
        {"Signal_0": simcenter(VALUE.T, "g", names=("P1:+X", "P1:+Y", "P1:+Z")),
         "Signal_1": simcenter(VALUE[0], "lbf")},
    )  # fmt: skip
    channels = cm.read(tmp_path / "a.mat")
    assert described(channels) == [
        *((f"P1:+{axis}", "acceleration", "", FS, 0.5, N) for axis in "XYZ"), ("Signal_1", "force", "", FS, 0.5, N),
    ]  # fmt: skip
    np.testing.assert_allclose([c.value for c in channels[:3]], G * VALUE, rtol=1e-15)
    np.testing.assert_allclose(channels[3].value, 4.4482216152605 * VALUE[0], rtol=1e-12)
    (mapped,) = cm.read(tmp_path / "a.mat", {"Signal_1": "force:5", **{f"P1:+{axis}": "skip" for axis in "XYZ"}})
    assert mapped.label == "5:+Z"


def test_one_name_of_several_columns(tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"Signal": simcenter(VALUE.T, "m/s^2")})
    assert [c.name for c in cm.read(tmp_path / "a.mat")] == ["Signal:1", "Signal:2", "Signal:3"]


def test_functions_over_frequency_are_no_time_records(tmp_path):
    held = {"FRF": simcenter(VALUE[0], "g/N", "Hz"), "Cross": simcenter(VALUE[0] + 1j, "g"),
            "Signal": simcenter(VALUE[1], "g")}  # fmt: skip
    scipy.io.savemat(tmp_path / "a.mat", held)
    with pytest.warns(RecordNote, match='left out "FRF", which is over Hz, .*; left out "Cross", which is complex'):
        (channel,) = cm.read(tmp_path / "a.mat")
    np.testing.assert_allclose(channel.value, G * VALUE[1], rtol=1e-15)


def test_channels_of_bruel_and_kjaer(tmp_path):
    """Headers beside the numbers, the rate in that of the file; numbers may be text."""
    held = {"File_Header": {"NumberOfChannels": "2", "SampleFrequency": "2048", "NumberOfSamplesPerChannel": str(N)}}
    for i, (name, unit) in enumerate((("Hammer", "N"), ("Tip", "m/s^2")), 1):
        held |= {f"Channel_{i}_Header": {"SignalName": name, "Unit": unit}, f"Channel_{i}_Data": VALUE[i]}
    scipy.io.savemat(tmp_path / "a.mat", held)
    channels = cm.read(tmp_path / "a.mat")
    assert described(channels) == [("Hammer", "force", "", FS, 0.0, N), ("Tip", "acceleration", "", FS, 0.0, N)]
    np.testing.assert_array_equal([c.value for c in channels], VALUE[1:])


@pytest.mark.parametrize("rate", [
    {"fs": FS}, {"SamplingRate": FS}, {"sample_rate": FS}, {"Sampling_Interval": 1 / FS}, {"dt": 1 / FS},
    {"time": TIME}, {"Frequency": FS}, {"Delta_T": 1 / FS}, {"t": TIME},
])  # fmt: skip
@pytest.mark.parametrize("many", [False, True])
def test_a_structure_for_each_channel(tmp_path, rate, many):
    """One beside the other, or an array of them."""
    channels = [
        {"data": VALUE[i], "unit": unit, "name": name, **rate}
        for i, (name, unit) in enumerate((("A 1", "g"), ("F", "N")))
    ]
    held = {"ch1": channels[0], "ch2": channels[1]}
    if many:
        array = np.zeros(2, dtype=[(key, object) for key in channels[0]])
        for i, channel in enumerate(channels):
            array[i] = tuple(channel.values())
        held = {"channels": array}
    scipy.io.savemat(tmp_path / "a.mat", held)
    read = cm.read(tmp_path / "a.mat")
    assert described(read) == [("A 1", "acceleration", "", FS, 0.0, N), ("F", "force", "", FS, 0.0, N)]
    np.testing.assert_allclose(read[0].value, G * VALUE[0], rtol=1e-15)


def test_a_structure_of_vectors_with_one_time(tmp_path):
    scipy.io.savemat(
        tmp_path / "a.mat", {"run": {"time": 1 + TIME, "Acc": VALUE[0], "Prox": VALUE[1], "limits": [0.0, 1.0]}}
    )
    assert described(cm.read(tmp_path / "a.mat")) == [
        ("Acc", "unknown", "", FS, 1.0, N),
        ("Prox", "unknown", "", FS, 1.0, N),
    ]


def test_a_structure_without_a_rate(tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"run": {"data": VALUE[0], "unit": "g"}})
    assert_refused(r'"run": does not say its sampling interval or rate; give .* \(--fs\)', cm.read, tmp_path / "a.mat")
    assert described(cm.read(tmp_path / "a.mat", fs=FS)) == [("run", "acceleration", "", FS, 0.0, N)]


def test_other_programs_hdf5(tmp_path):
    """Units as attributes of the numbers, rates of the file, of a group or by a data set of times."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.attrs["sampling_rate"] = FS
        file.create_group("bench")["A 1"] = VALUE[0]
        file["bench/A 1"].attrs["unit"] = "g"
        slow = file.create_group("slow")
        slow["time"], slow["F"] = 1e3 * TIME[::2], VALUE[1, ::2]
        slow["time"].attrs["units"], slow["F"].attrs["units"] = "ms", np.bytes_("lbf")
        file["text"] = "a note"
    with pytest.warns(RecordNote, match="several rates"):
        channels = cm.read(tmp_path / "a.h5")
    assert described(channels) == [("A 1", "acceleration", "", FS, 0.0, N), ("F", "force", "", FS / 2, 0.0, N // 2)]
    np.testing.assert_allclose(channels[1].value, 4.4482216152605 * VALUE[1, ::2], rtol=1e-12)


def test_hdf5_without_time_records(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["a"] = 3.0
    assert_refused(r"a\.h5: holds no results of clearance_mj; .* and no time records", cm.read, tmp_path / "a.h5")


def rattlesnake(path):
    """The groups and variables that the controller writes, version 3."""
    table = {"node_number": ["101", "102", "901"], "node_direction": ["Z+", "X-", ""], "unit": ["g", "m/s^2", "V"],
             "comment": ["tip", "root", "drive"], "serial_number": ["1", "2", ""]}  # fmt: skip
    with h5netcdf.File(path, "w") as file:
        file.attrs["sample_rate"], file.attrs["file_version"] = int(FS), "3.0.0"
        file.dimensions = {"response_channels": 3, "time_samples": N, "num_environments": 1}
        file.create_variable("time_data", ("response_channels", "time_samples"), "f8", data=VALUE)
        file.create_variable("environment_active_channels", ("response_channels", "num_environments"), data=3 * [[1]])
        text = h5py.string_dtype()
        file.create_variable("environment_names", ("num_environments",), text, data=np.array(["Random"], dtype=object))
        group = file.create_group("channels")
        for name, values in table.items():
            group.create_variable(name, ("response_channels",), text, data=np.array(values, dtype=object))
        environment = file.create_group("Random")
        environment.dimensions = {"signal_samples": 2 * N}
        environment.create_variable("control_signal", ("signal_samples",), "f8", data=np.zeros(2 * N))


def test_rattlesnake(tmp_path):
    """Channels are placed by the table of channels; what was wanted is none."""
    rattlesnake(tmp_path / "a.nc4")
    channels = cm.read(tmp_path / "a.nc4")
    assert [(c.label, c.quantity, c.unit, c.fs) for c in channels] == [
        ("101:+Z", "acceleration", "", FS), ("102:-X", "acceleration", "", FS), ("0:S", "unknown", "V", FS),
    ]  # fmt: skip
    np.testing.assert_allclose([c.value for c in channels], VALUE * [[G], [1], [1]], rtol=1e-15)
    assert channels[2].name == "drive"


def test_what_we_write_as_nc4_is_ours(tmp_path):
    cm.write(tmp_path / "a.nc4", [cm.Channel("a", 3, "+Z", "acceleration", VALUE[0], FS)])
    assert cm.read(tmp_path / "a.nc4")[0].label == "3:+Z"
    assert_refused("is written by clearance_mj", cm.read, tmp_path / "a.nc4", {"a": "acc:4"})


def test_sep005_out_and_in():
    """Held to sdypy's own model of the format."""
    channels = [
        cm.Channel("A", 3, "-Z", "acceleration", VALUE[0], FS, 0.25),
        cm.Channel("U", *NOWHERE, "unknown", VALUE[1], FS, 0.25, "V"),
    ]  # fmt: skip
    series = to_sep005(channels)
    for one in series:
        held = Sep005Data.model_validate({k: v.tolist() if k == "time" else v for k, v in one.items()})
        assert held.fs == FS
    assert [(one["name"], one["unit_str"]) for one in series] == [("acc:3:-Z", "m/s2"), ("U", "V")]
    back = from_sep005(series)
    assert described(back) == [("acc:3:-Z", "acceleration", "", FS, 0.25, N), ("U", "unknown", "V", FS, 0.25, N)]
    assert back[0].label == "3:-Z"
    np.testing.assert_array_equal([c.value for c in back], VALUE[:2])


@pytest.mark.parametrize("when", [{"fs": FS}, {"time": TIME.tolist()}, {"fs": FS, "time": None}])
def test_sep005_of_others(when):
    series = [
        {
            "data": VALUE[0].tolist(),
            "name": "Prox X",
            "unit_str": "mil",
            "quantity": "d",
            "start_timestamp": "2026-01-01",
            **when,
        }
    ]
    (channel,) = from_sep005(series)
    assert described([channel]) == [("Prox X", "displacement", "", FS, 0.0, N)]
    np.testing.assert_allclose(channel.value, 2.54e-5 * VALUE[0], rtol=1e-12)
    with pytest.raises(cm.RecordError, match='"Prox X": does not say its sampling interval or rate'):
        from_sep005([{"data": VALUE[0], "name": "Prox X", "unit_str": "mil"}])
