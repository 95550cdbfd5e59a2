"""Tables as data loggers write them, with their parts drawn: lines above, names, units, separators, decimals, times."""

import io
import tempfile
from pathlib import Path

import numpy as np
from asammdf import MDF, Signal
from nptdms import ChannelObject, GroupObject, TdmsWriter

from .mutations import NUMBERS

TIMES = ("Time", "t [s]", "Zeit;", "X_Value", "Time (ms)", "Timestamp", "Date/Time", "Sample", "Frequency", "",
         "time", "A")  # fmt: skip
NAMES = ("Accel 1", "Accel 1 [g]", "Kraft (N)", "base", "acc:6", "acc6", "Temp (°C)", "", "x" * 90, '"a, b [g]"', "1",
         "F / kN", "State", "Time 2", "CH 1 [", "acx:1 [g]", "a\tb", "unit")  # fmt: skip
UNITS = ("s", "g", "m/s²", "mm/s^2", "N", "V", "°C", "", "[g]", "unit", "?", "ms")
ABOVE = ("Title: run 3", "Sample rate: 64 Hz", "fs = 64", "dt=0,015625", "Rate;0;Hz", "# comment", "", "Channels;2",
         "a,b,c", "Sampling interval (us),1e999", "Start;23.10.2023 10:00:00", "1;2;3", "\tName\tA",
         "Datum;")  # fmt: skip
STAMPS = ("2023-10-23 10:00:00.{:03d}", "23.10.2023 10:00:00,{:03d}", "10/23/2023 3:00:00.{:03d} PM", "23:59:59.{:03d}",
          "31/13/2023 10:00:00.{:03d}", "2023-10-23T10:00:00.{:03d}Z", "0{:03d}:00.5",
          "1/1/1 0:0:0.{:03d}")  # fmt: skip
CELLS = ("", "OVL", "1.234,5", '"', '"1,5"', "10:00")
BELOW = ("", "End", "0.5;", "Mean;1;2", "\0", "0.1,2")
ENCODINGS = ("utf-8", "utf-8", "utf-8", "cp1252", "utf-16", "utf-16-le", "utf-8-sig")


def table(rng) -> bytes:
    """A table of a logger, more often whole than not."""
    width, size = rng.choice((1, 2, 2, 3, 3, 5)), rng.choice((2, 3, 5, 12, 40))
    separator, point = rng.choice((",.", ";,", ";.", "\t,", "\t.", ("  ", "."), "|."))
    step, stamp = rng.choice((1 / 64, 0.5, 1, 1 / 2048)), rng.choice((None, None, None, *STAMPS))
    rows = []
    for time in (step * i for i in range(size)):
        first = stamp.format(int(1000 * time) % 1000) if stamp else f"{time:.9g}".replace(".", point)
        rows.append([first, *(f"{rng.uniform(-2000, 2000):.6g}".replace(".", point) for _ in range(width - 1))])
    if rng.random() < 0.4:
        row = rng.choice(rows)
        row[rng.randrange(width)] = rng.choice((*(n.decode() for n in NUMBERS), *CELLS))
    head = [rng.choice(TIMES), *(rng.choice(NAMES) for _ in range(width - 1))]
    above = [rng.choice(ABOVE) for _ in range(rng.choice((0, 0, 1, 3, 8)))]
    between = [separator.join(rng.choice(UNITS) for _ in head)] * rng.choice((0, 0, 1, 2))
    between += [separator.join(map(str, range(width)))] * rng.choice((0, 0, 0, 1))
    end = rng.choice((separator, "", "", 3 * separator)) + rng.choice(("\n", "\n", "\r\n", "\r"))
    below = [rng.choice(BELOW)] * rng.choice((0, 0, 1))
    lines = [*above, separator.join(head), *between, *(separator.join(row) for row in rows), *below]
    return end.join([*lines, ""]).encode(rng.choice(ENCODINGS), "replace")


def tdms() -> list[bytes]:
    """Two groups of other rates, integers with a scale, a channel of time, text."""
    wave = {"wf_increment": 1 / 64, "wf_start_offset": 0.25, "unit_string": "g"}
    scale = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Linear", "NI_Scale[0]_Linear_Slope": 0.5,
             "NI_Scale[0]_Linear_Y_Intercept": 1.0}  # fmt: skip
    files = []
    for objects in (
        [ChannelObject("g", "Accel 1", np.arange(6.0), wave),
         ChannelObject("g", "U", np.arange(6, dtype="i2"), wave | scale)],
        [GroupObject("a", {"x": 1}), ChannelObject("a", "Time", np.arange(6) / 8), ChannelObject("a", "F", np.ones(6)),
         ChannelObject("b", "F", np.ones(3, "f4"), wave), ChannelObject("b", "note", ["one", "two"])],
    ):  # fmt: skip
        file = io.BytesIO()
        with TdmsWriter(file) as writer:
            writer.write_segment(objects)
            writer.write_segment(objects[:1])
        files.append(file.getvalue())
    return files


def mdf() -> list[bytes]:
    """Two groups of other rates, a conversion, a compressed file."""
    files = []
    with tempfile.TemporaryDirectory() as folder:
        for compression in (0, 2):
            with MDF(version="4.10") as file:
                time = np.arange(6) / 64
                scaled = Signal(np.arange(6, dtype="i2"), time, "N", "F", conversion={"a": 0.5, "b": 1.0})
                file.append([Signal(np.arange(6.0), time, "g", "Accel 1"), scaled], common_timebase=True)
                file.append([Signal(np.arange(3.0), np.arange(3.0), "V", "U")])
                path = Path(folder) / "a.mf4"
                file.save(path, overwrite=True, compression=compression)
            files.append(path.read_bytes())
    return files
