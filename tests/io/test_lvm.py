"""LabVIEW measurement files: the three layouts of the abscissa, and damage named by file and line."""

import gzip

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.cli import main
from clearance_mj.core.errors import RecordError
from clearance_mj.io.lvm import read_lvm

END = "***End_of_Header***\t\n"
HEAD = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t{point}\nX_Columns\t{layout}\n" + END + "\t\n"
SEGMENT = "Channels\t2\t\t\nSamples\t3\t3\t\nY_Unit_Label\tlb\tg\t\nX0\t0.5\t0.5\t\nDelta_X\t0.25\t0.25\t\n" + END
ONE = "X_Value\tForce\tAcc\tComment\n0.5\t1\t-4\n0.75\t2\t-5\tknocked\n1.0\t3\t-6e-1\n"
MULTI = "X_Value\tForce\tX_Value\tAcc\tComment\n0.5\t1\t0.5\t-4\n0.75\t2\t0.75\t-5\n1.0\t3\t1.0\t-6e-1\n"
NO = "X_Value\tForce\tAcc\tComment\n\t1\t-4\n\t2\t-5\n\t3\t-6e-1\n"
BODY = {"One": ONE, "Multi": MULTI, "No": NO}


def text(layout="One", point=".", segments=1):
    whole = HEAD.format(point=point, layout=layout) + "\n".join([SEGMENT + BODY[layout]] * segments)
    return whole.replace(".", point)


def write(folder, content, name="a.lvm"):
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize("layout", list(BODY))
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_layouts(tmp_path, layout, end):
    [segment] = read_lvm(write(tmp_path, text(layout).replace("\n", end)))
    np.testing.assert_array_equal(segment.x, [0.5, 0.75, 1.0])
    np.testing.assert_array_equal(segment.value, [[1, 2, 3], [-4, -5, -0.6]])
    assert segment.names == ("Force", "Acc")
    assert segment.units == ("lb", "g")
    assert segment.header["X_Columns"] == layout


def test_decimal_comma_gzip_and_two_segments(tmp_path):
    path = write(tmp_path, gzip.compress(text(point=",", segments=2).encode()), "a.lvm.gz")
    segments = read_lvm(path)
    assert [s.value[1, 2] for s in segments] == [-0.6, -0.6]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("time,force\n1,2\n", "line 1: a LabVIEW"),
        ("", "line 1"),
        (HEAD.format(point=".", layout="One"), "no data"),
        (text().replace("0.75\t2\t-5\tknocked", "0.75\t2"), "line 15: 2 of 3 columns"),
        (text().replace("0.75\t2\t-5\tknocked", "0.75\ttwo\t-5"), "line 15: not numbers"),
        (text().replace("Channels\t2", "Channels\tmany"), "Channels"),
        (text().replace("X_Columns\tOne", "X_Columns\tSome"), "X_Columns"),
        (text().replace("Separator\tTab", "Separator\tBlank"), "Separator"),
        (text().split("X_Value")[0], "ends after"),
        (text().split("0.5\t1")[0], "no numbers"),
        (text()[:100], "no \\*\\*\\*End_of_Header"),
        (gzip.compress(text().encode(), mtime=0)[:80], "damaged gzip"),
        (b"LabVIEW Measurement\0\1", "not a text file"),
    ],
)
def test_damage(tmp_path, content, message):
    path = write(tmp_path, content, "bad.lvm")
    with pytest.raises(RecordError, match=f"bad.lvm.*{message}"):
        read_lvm(path)


def test_no_file(tmp_path):
    with pytest.raises(RecordError, match=r"nothing.lvm: No such file"):
        read_lvm(tmp_path / "nothing.lvm")


def test_time_records(tmp_path):
    """The map gives the unit of the force, whose own, lb, is unknown; that of the acceleration, g, is the file's."""
    columns = {"Force": "force:5 [kN]", "Acc": "acc:3:-Z"}
    force, acceleration = cm.read(write(tmp_path, text()), columns)
    assert [(c.label, c.quantity, c.fs, c.start) for c in (force, acceleration)] == [
        ("5:+Z", "force", 4.0, 0.5),
        ("3:-Z", "acceleration", 4.0, 0.5),
    ]
    np.testing.assert_allclose(force.value, [1e3, 2e3, 3e3])
    np.testing.assert_allclose(acceleration.value, 9.80665 * np.array([-4, -5, -0.6]))
    arguments = [part for header, name in columns.items() for part in ("--column", f"{header}={name}")]
    assert main(["convert", str(tmp_path / "a.lvm"), str(tmp_path / "a.csv"), *arguments]) == 0
    np.testing.assert_allclose(cm.read(tmp_path / "a.csv")[1].value, acceleration.value)


@pytest.mark.parametrize(
    ("segments", "columns", "part"),
    [
        (2, {"Force": "skip", "Acc": "acc:3"}, "holds 2 segments, time records need one"),
        (1, {"Force": "force:5"}, 'variable "Force \\[lb\\]": unit "lb" of force is unknown'),
        (1, {"Force": "frequency [Hz]", "Acc": "acc:3/force [g/N]"}, "channels over time"),
    ],
)
def test_no_time_records(tmp_path, segments, columns, part):
    with pytest.raises(RecordError, match=f"a.lvm: .*{part}"):
        cm.read(write(tmp_path, text(segments=segments)), columns)
