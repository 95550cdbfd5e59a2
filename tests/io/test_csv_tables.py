"""CSV records: the numbers that were written come back in SI units; every fault is named with line and column."""

import gzip

import numpy as np
import pytest

from clearance_mj import RecordError
from clearance_mj.io.csv_tables import read_csv

from .refusals import assert_refused

FS, N = 2048.0, 3000
HEADER = "time,base,acc:1,disp:6"


@pytest.fixture
def numbers(rng):
    return np.column_stack((np.arange(N) / FS, rng.standard_normal((N, 3))))


def write(path, numbers, header=HEADER, separator=",", time="%.9f", value="%.17g"):
    np.savetxt(path, numbers, [time] + [value] * (numbers.shape[1] - 1), separator, header=header, comments="")
    return path


def places(channels):
    return [(c.node, c.direction, c.quantity) for c in channels]


def test_channels_by_the_names_of_columns(tmp_path, numbers):
    channels = read_csv(write(tmp_path / "a.csv", numbers))
    assert places(channels) == [(100, "+Z", "acceleration"), (1, "+Z", "acceleration"), (6, "+Z", "displacement")]
    assert {c.fs for c in channels} == {FS}
    assert np.array_equal([c.value for c in channels], numbers[:, 1:].T)


def test_units_directions_and_semicolons(tmp_path, numbers):
    header = "# bench 3\n\ntime [ms];force (kN);acc:1:-Z [g];disp:6 [µm]"
    channels = read_csv(write(tmp_path / "a.csv", numbers * [1e3, 1, 1, 1], header, ";"))
    assert places(channels) == [(200, "+Z", "force"), (1, "-Z", "acceleration"), (6, "+Z", "displacement")]
    in_si = numbers[:, 1:] * [1e3, 9.80665, 1e-6]  # standard gravity: BIPM, The International System of Units
    np.testing.assert_allclose([c.value for c in channels], in_si.T, rtol=1e-15)
    assert channels[0].fs == FS


def test_columns_by_a_map(tmp_path, numbers):
    file = write(tmp_path / "a.csv", numbers, "t,Input,Accel 1 (m/s²),Temp")
    channels = read_csv(file, {"t": "time", "Input": "base [g]", "Accel 1": "acc:1", "Temp": "skip"})
    assert places(channels) == [(100, "+Z", "acceleration"), (1, "+Z", "acceleration")]
    np.testing.assert_allclose(channels[0].value, 9.80665 * numbers[:, 1], rtol=1e-15)
    assert np.array_equal(channels[1].value, numbers[:, 2])


def test_sampling_rate_in_place_of_time(tmp_path, numbers):
    file = write(tmp_path / "a.csv", numbers, "t,base,acc:1,disp:6")
    assert read_csv(file, {"t": "skip"}, fs=500.0)[0].fs == 500.0
    assert_refused('no column "time"', read_csv, file, {"t": "skip"})
    assert_refused("no sampling rate beside it", read_csv, file, {"t": "time"}, fs=500.0)


@pytest.mark.parametrize("time", ["%.6f", "%.5f", "%g", "%.8e"])
def test_times_of_few_digits_still_tell_the_rate(tmp_path, numbers, time):
    assert read_csv(write(tmp_path / "a.csv", numbers, time=time))[0].fs == FS


def test_compressed(tmp_path, numbers):
    file = write(tmp_path / "a.csv", numbers)
    packed = tmp_path / "a.csv.gz"
    packed.write_bytes(gzip.compress(file.read_bytes()))
    assert np.array_equal(read_csv(packed)[2].value, numbers[:, 3])


TIMES = {"time": "time", "base": "skip", "acc:1": "skip", "disp:6": "skip"}
BAD = {
    "a name like it": ("time,base,acx:1,disp:6", {}, None, r'line 1, column 3 "acx:1": .*did you mean "acc:1"'),
    "another": ("time,base,acc:1,dips:6", {}, None, r'line 1, column 4 "dips:6": .*did you mean "disp:6"'),
    "unit": ("time,base,acc:1 [yd/s2],disp:6", {}, None, r'3 "acc:1 \[yd/s2\]": unit "yd/s2" .* m/s2, mm/s2, g'),
    "unit of another": ("time,base,acc:1 [mm],disp:6", {}, None, r'unit "mm" of acceleration is unknown'),
    "too few": ("time,base,acc:1", {}, None, "line 2: has 4 columns, the header 3"),
    "no such column": (HEADER, {}, {"Acc:1": "acc:1"}, r'line 1: has no column "Acc:1" \(did you mean "acc:1"'),
    "coarse times": (HEADER, {"time": "%.3f"}, None, "digits enough"),
    "time alone": (HEADER, {}, TIMES, "line 1: has no channel beside time"),
}


@pytest.mark.parametrize("name", BAD)
def test_tables_that_cannot_be_used(tmp_path, numbers, name):
    header, options, columns, part = BAD[name]
    file = write(tmp_path / "a.csv", numbers, header, **options)
    with pytest.raises(RecordError, match=part) as error:
        read_csv(file, columns)
    assert str(error.value).startswith(str(file))


@pytest.mark.parametrize("cell", ["one", "1..2"])
def test_cells_that_are_not_numbers(tmp_path, numbers, cell):
    file = write(tmp_path / "a.csv", numbers)
    lines = file.read_text().splitlines()
    lines[1500] = ",".join([*lines[1500].split(",")[:3], cell])
    file.write_text("\n".join(lines))
    assert_refused(r'line 1501, column 4 "disp:6": .* is not a number', read_csv, file)


def test_a_missing_instant_is_named(tmp_path, numbers):
    file = write(tmp_path / "a.csv", np.delete(numbers, 1700, axis=0))
    assert_refused(r'line 1702, column 1 "time": goes from 0\.829589844 s to 0\.830566406 s', read_csv, file)


def test_files_without_records(tmp_path):
    (tmp_path / "a.csv").write_text(HEADER + "\n")
    assert_refused("holds no records", read_csv, tmp_path / "a.csv")
    assert_refused(r"b\.csv", read_csv, tmp_path / "b.csv")
