"""Universal files that are damaged, and objects that they cannot hold, are refused."""

import dataclasses
import time
import tracemalloc

import numpy as np
import pytest

from clearance_mj import Channel, RecordError, read_uff, write_uff
from clearance_mj.io.uff import scan_uff

from .refusals import assert_refused
from .uff_by_hand import ROWS, assert_same_channels, by_hand, channels, frf, units_by_hand

# Refusals


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    path = tmp_path_factory.mktemp("good") / "a.uff"
    write_uff(path, channels())
    return path.read_bytes()


def refused(path, *parts):
    for function in (read_uff, scan_uff):
        with pytest.raises(RecordError) as caught:
            function(path)
        message = str(caught.value)
        assert message.startswith(f"{path}: ") and "\n" not in message
        assert all(part in message for part in parts), message


@pytest.mark.parametrize(
    ("data", "parts"),
    [
        (b"", []),
        (b"\x00\xff" * 4000, ["not a universal file", "'    -1'"]),
        (b"name,node\n1,2\n", ["not a universal file"]),
        (by_hand(ROWS)[:-7], ["data set 1", "no closing line '    -1'"]),
        (by_hand(ROWS) + b"tail", ["stray bytes before data set 2"]),
        (by_hand(ROWS, count=18), ["data set 1", "declares 18 samples, which is 3 lines, but 2"]),
        (by_hand(ROWS, count=0), ["declares 0 samples; needs at least 1"]),
        (by_hand(ROWS, count=-4), ["declares -4 samples"]),
        (by_hand(ROWS, step="0.00000E+00"), ["data set 1", "abscissa increment 0 must be > 0"]),
        (by_hand(ROWS, step="-1.0000E-02"), ["abscissa increment -0.01 must be > 0"]),
        (by_hand(ROWS, step="nan"), ["abscissa increment is 'NAN', needs a number"]),
        (by_hand(ROWS, step="1.00000E-320"), ["data set 1", "abscissa increment 9.99989e-321 is too small"]),
        (by_hand(ROWS, first="1E999"), ["abscissa minimum is '1E999', needs a finite number"]),
        (by_hand(ROWS, ordinate=3), ["ordinate data type 3 is unknown; needs 2, 4, 5 or 6"]),
        (by_hand(ROWS, spacing=2), ["abscissa spacing 2"]),
        (by_hand(ROWS, dof=(3, 7, 0, 0)), ["response direction 7"]),
        (by_hand(ROWS, dof=(-3, 3, 0, 0)), ["response node -3"]),
        (units_by_hand(1e3, 1.0) + by_hand(ROWS, unit="g"), ["data set 2", "contradicts", "convert --units SI"]),
        (units_by_hand(1e3, 1.0) + by_hand(ROWS, unit="m/s^2"), ["data set 2", "contradicts"]),
        (b"    -1\n   164\n1\n    -1\n" + by_hand(ROWS), ["data set 1", "units need two factors", "--units SI"]),
        (by_hand(b"\0" * 48, binary=f"b{3:6d}{2:6d}"), ["byte ordering 3"]),
        (by_hand(b"\0" * 48, binary=f"b{1:6d}{1:6d}"), ["floating-point format 1", "2 (IEEE 754)"]),
        (by_hand(b"\0" * 40, binary=f"b{1:6d}{2:6d}"), ["12 samples, which is 48 bytes, but 40 bytes"]),
        (by_hand(b"\0" * 52, binary=f"b{1:6d}{2:6d}"), ["12 samples, which is 48 bytes, but 52 bytes"]),
        (b"    -1\n    58b     1\n", ["data set 1", "header is cut short"]),
        (b"    -1\nnonsense\n    -1\n", ["data set 1", "has no type"]),
    ],
)  # fmt: skip
def test_refused_in_one_line_that_names_file_and_data_set(write, data, parts):
    refused(write(data), *parts)


@pytest.mark.parametrize("spacing", [0, 1])
def test_non_finite_sample_is_refused_with_its_place(write, spacing):
    rows = ["".join(f"{v:>13}" for v in ("0.0", "1.0", "0.1", "NaN", "0.2", "3.0"))]
    path = write(by_hand(rows, spacing=spacing, count=6 if spacing else 3))
    assert_refused(r"data set 1: sample \d is not a finite number", read_uff, path)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_non_finite_binary_sample(write, good, bad):
    position = good.find(b"    -1\n    -1\n    58b", good.find(b"    58b"))  # the end of the first function
    data = good[: position - 4] + np.float32(bad).tobytes() + good[position:]
    assert_refused("data set 3: sample 63 is not a finite number", read_uff, write(data))


@pytest.mark.parametrize("end", [5, 90, 700, 1300, 1700, 2000, -1, -7, -8, -100])
def test_every_cut_is_refused_but_the_last_line_end(write, good, end):
    path = write(good[:end])
    if end == -1:
        assert_same_channels(read_uff(path), read_uff(write(good)))
    else:
        refused(path)


@pytest.mark.parametrize("count", [2**31 - 1, 10**9, 9_999_999_999])
def test_declared_size_allocates_nothing(write, count):
    for data in (by_hand(ROWS, count=count), by_hand(b"\0" * 48, count=count, binary=f"b{1:6d}{2:6d}")):
        path = write(data)
        tracemalloc.start()
        began = time.perf_counter()
        refused(path, f"declares {count} samples")
        assert tracemalloc.get_traced_memory()[1] < 1e6 and time.perf_counter() - began < 1
        tracemalloc.stop()


def test_missing_file_and_folder(tmp_path):
    refused(tmp_path / "absent.uff", "cannot be read (No such file or directory)")
    refused(tmp_path, "cannot be read")


@pytest.mark.parametrize("obj", [None, 3, "text", np.zeros(4), [np.zeros(4)], [], object()])
def test_objects_that_are_no_test_data(tmp_path, obj):
    with pytest.raises(RecordError, match=r"cannot be written: (needs a sequence of Channel|there is no channel)"):
        write_uff(tmp_path / "a.uff", obj)
    assert not list(tmp_path.iterdir())


def test_samples_beyond_single_precision(tmp_path):
    with pytest.raises(RecordError, match='channel "c" exceeds single precision'):
        write_uff(tmp_path / "a.uff", [Channel("c", 1, "+Z", "force", [1.0, -1e39], 10.0)])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("changes, part", [
    ({"name": ""}, "1 to 72 printable"), ({"name": "a\nb"}, "printable"), ({"name": " a"}, "printable"),
    ({"name": "a" * 73}, "1 to 72"), ({"node": -1}, "node -1 must be"),
    ({"node": 10**9}, "node 1000000000 must be a whole number of at most 9 digits"),
    ({"direction": "up"}, 'direction "up" is unknown; use .*\\+Z'),
    ({"quantity": "stress"}, 'quantity "stress" is unknown; use displacement'),
    ({"value": [[1.0]]}, r"one row of samples, got shape \(1, 1\)"), ({"value": []}, "one row of samples"),
    ({"value": [0.0, np.nan]}, "sample 1 is not a finite number"), ({"fs": 0.0}, "fs must be > 0 Hz"),
    ({"fs": np.inf}, "fs must be > 0 Hz"), ({"start": np.nan}, "start finite"),
])  # fmt: skip
def test_impossible_channels(changes, part):
    assert_refused(part, dataclasses.replace, channels()[0], **changes)


@pytest.mark.parametrize("changes, part", [
    ({"quantity": "acceleration"}, 'quantity "acceleration" is unknown'),
    ({"quantity": "stress/force"}, 'quantity "stress/force" is unknown'),
    ({"references": ("tip",)}, 'degree of freedom "tip" must be a node and a direction'),
    ({"responses": ("1:+Z", "2", "3:+Z")}, 'degree of freedom "2"'),
    ({"value": np.full((3, 430), np.nan + 0j)}, r"FRF 1:\+Z: sample 0 is not a finite number"),
    ({"coherence": np.where(np.arange(430) < 1, np.nan, np.ones((3, 430)))}, r"coherence 1:\+Z: sample 0 is not"),
])  # fmt: skip
def test_frfs_that_the_format_cannot_hold(tmp_path, changes, part):
    assert_refused(part, write_uff, tmp_path / "h.uff", dataclasses.replace(frf(), **changes))
    assert not list(tmp_path.iterdir())
