"""Logs of a drive: angle and torque at its motor, and at its load where that is measured."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ..core.checks import naming
from ..core.errors import RecordError
from ..core.files import plain_file
from ..core.notes import note
from ..core.sampling import even_times
from ..core.units import UNITS, unit_factor
from ..io.channels import UNKNOWN, require_one_time
from ..io.columns import SKIP
from ..io.csv_tables import read_columns
from ..io.formats import FORMATS, read_channels
from ..io.tables.headers import is_time, split_header

__all__ = ["DriveRecord", "read_table", "window_means"]

COLUMNS = ("motor_angle", "motor_torque", "load_angle", "load_torque")
REQUIRED = ("time", "motor_angle", "motor_torque")
QUANTITIES = {"time": "time"} | {column: column.partition("_")[2] for column in COLUMNS}
SAMPLES = 100  # least number in a record
EVEN = 1e-3  # of the sampling interval, tolerated jitter of the times
REVERSAL = 0.05  # of the range of the motor's angle, least motion back that counts as a reversal


@dataclass(frozen=True, eq=False)
class DriveRecord:
    """Angles and torques of one run.

    Parameters
    ----------
    name : str
        Of the run.
    fs : float
        Sampling rate, Hz.
    motor_angle, motor_torque : ndarray, shape (n,)
        rad and N m, at the motor's end. The torque is that of the motor on the drive.
    load_angle, load_torque : ndarray, shape (n,), optional
        At the load's end. The torque is that of the drive on the load.

    Raises
    ------
    RecordError
        For samples of different number, too few, or not finite; an angle that jumps by whole turns.
    """

    name: str
    fs: float
    motor_angle: np.ndarray
    motor_torque: np.ndarray
    load_angle: np.ndarray | None = None
    load_torque: np.ndarray | None = None

    def __post_init__(self) -> None:
        if not 0 < self.fs < math.inf:
            raise RecordError(f'run "{self.name}": sampling rate {self.fs:g} Hz must be > 0')
        size = np.size(self.motor_angle)
        if size < SAMPLES:
            raise RecordError(f'run "{self.name}": {size} samples are too few; {SAMPLES} are needed')
        for column in COLUMNS:
            if getattr(self, column) is None:
                continue
            values = np.array(getattr(self, column), dtype=float)
            if values.shape != (size,):
                raise RecordError(f'run "{self.name}": {column} has {values.size} samples, motor_angle {size}')
            if not np.isfinite(values).all():
                sample = int(np.argmin(np.isfinite(values)))
                raise RecordError(f'run "{self.name}": {column} is not finite at {sample / self.fs:g} s')
            if column.endswith("angle"):
                self._require_unwrapped(column, values)
            object.__setattr__(self, column, values)

    def _require_unwrapped(self, column: str, values: np.ndarray) -> None:
        step = np.diff(values)
        typical = np.median(np.abs(step))
        for turn, unit in ((2 * math.pi, "rad"), (360.0, "degrees")):
            at = np.flatnonzero((np.abs(np.abs(step) - turn) < 0.1 * turn) & (np.abs(step) > 20 * typical))
            if at.size:
                raise RecordError(
                    f'run "{self.name}": {column} jumps by {step[at[0]]:.4g} at {at[0] / self.fs:g} s, a whole turn in '
                    f"{unit}: the encoder wraps; unwrap it (numpy.unwrap) and give rad"
                )

    @property
    def both_ends(self) -> bool:
        """True if angle and torque of the load were measured."""
        return self.load_angle is not None and self.load_torque is not None

    @property
    def any_end(self) -> bool:
        """True if angle or torque of the load was measured."""
        return self.load_angle is not None or self.load_torque is not None

    @property
    def lost_work(self) -> float:
        """Work of the motor less work on the load, J; nan without both ends."""
        if self.load_angle is None or self.load_torque is None:
            return math.nan
        input_work = np.trapezoid(self.motor_torque, self.motor_angle)
        return float(input_work - np.trapezoid(self.load_torque, self.load_angle))

    @functools.cached_property
    def reversals(self) -> int:
        """Number of the motor's reversals by more than 5 % of its range."""
        x, count, direction = self.motor_angle, 0, 0
        extreme, threshold = x[0], REVERSAL * np.ptp(x)
        for value in x:
            if direction * (value - extreme) > 0 or (direction == 0 and abs(value - extreme) > threshold):
                direction, extreme = direction or (1 if value > extreme else -1), value
            elif direction * (extreme - value) > threshold:
                count, direction, extreme = count + 1, -direction, value
        return count

    def thinned(self, points: int) -> DriveRecord:
        """Return a record of means over neighbouring samples.

        Parameters
        ----------
        points : int
            Number of samples at most.
        """
        size = -(-self.motor_angle.size // points)
        if size == 1:
            return self
        channels = (getattr(self, column) for column in COLUMNS)
        means = (None if channel is None else window_means(channel, size) for channel in channels)
        return DriveRecord(self.name, self.fs / size, *means)  # type: ignore[arg-type]

    @classmethod
    def read(cls, path: str | Path, columns: Mapping[str, str] | None = None) -> DriveRecord:
        """Read a run from a file: CSV, Parquet, joint states of ROS 2 in MCAP, or any format of records.

        Units are those in brackets in the header of a column, or in ``columns``, such as "motor [deg]", "tau [mN m]",
        "pos [turn]" or "count [ticks/4096]"; without one rad, N m and s. A `RecordNote` says where that was assumed, or
        an end of a name such as ``_deg`` was taken for the unit, and which columns of the file are not used.

        Parameters
        ----------
        path : path
            The file.
        columns : mapping of str to str, optional
            Columns of the file by quantity: "time", "motor_angle", "motor_torque", "load_angle", "load_torque".
            Those that are not named have these names; the load's may be missing, or "skip". A minus sign before a name
            is for a column that counts the other way round, a unit behind it goes before that of the file.

        Raises
        ------
        RecordError
            For a file that cannot be read, a column that is missing or of an unknown unit, and times of which some
            are missing.
        """
        columns, name = dict(columns or {}), Path(path).name.split(".")[0]
        if unknown := columns.keys() - QUANTITIES:
            raise RecordError(f'"{min(unknown)}" is no column of a drive; known: {", ".join(QUANTITIES)}')
        table = {str(header): column for header, column in read_table(path).items()}
        notes, channels = list[str](), dict[str, np.ndarray]()
        times = sorted((h for h in table if is_time(split_header(h)[0])), key=lambda h: split_header(h)[0] != "time")
        names = {known: known for known in QUANTITIES} | dict.fromkeys(("time",), [*times, "time"][0]) | columns
        unused = dict.fromkeys(header for header in table if names.get(split_header(header)[0]) != SKIP)
        with naming(path):
            for quantity, column in names.items():
                if header := _find_header(table, quantity, column):
                    unused.pop(header[0], None)
                    values = pd.to_numeric(table[header[0]], errors="coerce").to_numpy(dtype=float)
                    channels[quantity] = values * _si_factor(quantity, *header, notes)
                elif column != SKIP and (quantity in REQUIRED or quantity in columns):
                    listed = ", ".join(table)
                    raise RecordError(f'no column "{column.removeprefix("-")}" ({quantity}); it has {listed}')
        time = channels.pop("time")
        fs, grid = even_times(time, str(path))
        if (jitter := float(np.abs(time - grid).max())) > max(EVEN / fs, _resolution(time)):
            notes.append(f"times are up to {1e3 * jitter:.3g} ms off even ones, to which the run is interpolated")
            channels = {target: np.interp(grid, time, values) for target, values in channels.items()}
        if unused:
            notes.append(f"not used: {', '.join(unused)}")
        note(path, notes)
        return cls(name, fs, *(channels.get(target) for target in COLUMNS))  # type: ignore[arg-type]


def window_means(x: np.ndarray, window: int) -> np.ndarray:
    """Return means over consecutive windows, without an incomplete one at the end."""
    return np.asarray(x[: x.size // window * window].reshape(-1, window).mean(axis=1))


def _find_header(table: Iterable[str], quantity: str, column: str) -> tuple[str, float, str] | None:
    """Return the header of a column in the file, its sign and its unit; None if there is no such column."""
    parts = {header: split_header(header) for header in table}
    for sign, written in ((1.0, column), (-1.0, column.removeprefix("-"))):
        name, unit = split_header(written)
        for label, given_unit in ((written, ""), (name, unit)):
            hits = [h for h in parts if h == label] or [h for h in parts if parts[h][0] == label]
            if len(hits) > 1:
                raise RecordError(f'several columns are "{label}" ({quantity}): {", ".join(hits)}; give its unit too')
            if hits:
                return hits[0], sign, given_unit or parts[hits[0]][1]
    return None


def _si_factor(column: str, header: str, sign: float, unit: str, notes: list[str]) -> float:
    """Return the factor from a column's unit to SI; an assumed unit is added to notes."""
    quantity, ending = QUANTITIES[column], header.rpartition("_")[2]
    if not unit and header != column and not header.endswith(FIELDS):
        unit = ending if ending in UNITS[quantity] else next(iter(UNITS[quantity]))
        notes.append(f'"{header}" is taken for {unit}, {"as its name ends" if unit == ending else "without a unit"}')
    with naming(f'column "{header}" ({column})', form="{}: {}; or a number of these, such as [0.05 Nm]"):
        return sign * (unit_factor(unit, quantity) if unit else 1.0)


def _resolution(time: np.ndarray) -> float:
    """Return the place value of the last digit that times are written with, s."""
    return next((10.0**-d for d in range(9) if np.allclose(time, np.round(time, d), rtol=0, atol=1e-10)), 0.0)


# Files that logs of drives come in, as tables: Parquet, MCAP with joint states of ROS 2, all formats of records.

STATE = "sensor_msgs/msg/JointState"
FIELDS = (".position", ".velocity", ".effort")  # of joints, in SI units


def read_table(path: str | Path) -> pd.DataFrame:
    """Return the columns of a log: ``.parquet``, ``.mcap`` with joint states of ROS 2, a format of records, or text.

    Tables of text are read as loggers write them; units stand in brackets behind the names of columns, ``motor [deg]``.
    Of joint states the columns are ``time`` (s, of the messages' stamps), ``JOINT.position``, ``JOINT.velocity`` and
    ``JOINT.effort``; of joints that several topics have, ``/topic JOINT.position``. Topics are brought to the times of
    the first by linear interpolation.

    Parameters
    ----------
    path : path
        The file.

    Raises
    ------
    RecordError
        For a file that cannot be read, or whose format needs a package that is not installed.
    """
    name = Path(path).name.lower()
    kind, read = next((c for c in READERS.items() if name.endswith(c[0])), ("a log", _read_records))
    try:
        return read(plain_file(path))
    except ImportError:
        raise RecordError(f'{path}: {kind} needs further packages: pip install "clearance-mj[logs]"') from None
    except RecordError:
        raise
    except Exception as error:  # each reader raises different errors
        raise RecordError(f"{path}: cannot be read as {kind.removeprefix('.')}: {error}") from None


def _read_records(path: Path) -> pd.DataFrame:
    format_ = FORMATS.get(Path(path.name.lower().removesuffix(".gz")).suffix)
    if format_ is None or format_.read is FORMATS[".csv"].read:
        return pd.DataFrame(read_columns(path))
    channels = read_channels(path)
    require_one_time(channels)
    units = (c.unit if c.quantity == UNKNOWN else next(iter(UNITS[c.quantity])) for c in channels)
    columns = {f"{c.name} [{unit}]" if unit else c.name: c.value for c, unit in zip(channels, units)}
    return pd.DataFrame({"time": channels[0].time} | columns)


def _read_joint_states(path: Path) -> pd.DataFrame:
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    topics: dict[str, list[tuple[float, Any]]] = {}
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, channel, _, message in reader.iter_decoded_messages():
            if schema is not None and schema.name == STATE:
                stamp = message.header.stamp
                topics.setdefault(channel.topic, []).append((stamp.sec + 1e-9 * stamp.nanosec, message))
    if not topics:
        raise RecordError(f"{path}: no topic has joint states ({STATE})")
    joints = [joint for messages in topics.values() for joint in messages[0][1].name]
    time = np.array([stamp for stamp, _ in next(iter(topics.values()))])
    columns = {"time": time - time[0]}
    for topic, messages in topics.items():
        times = np.array([stamp for stamp, _ in messages])
        for joint in messages[0][1].name:
            prefix = joint if joints.count(joint) == 1 else f"{topic} {joint}"
            for field in FIELDS:
                values = [_field_value(message, joint, field[1:]) for _, message in messages]
                if not np.isnan(values).all():
                    columns[f"{prefix}{field}"] = np.interp(time, times, values)
    return pd.DataFrame(columns)


def _field_value(message: Any, joint: str, field: str) -> float:
    """Return a joint's field in a message, whose joints may come in any order; nan where it is missing."""
    values, names = getattr(message, field), list(message.name)
    return float(values[names.index(joint)]) if joint in names and len(values) == len(names) else float("nan")


READERS: dict[str, Callable[[Path], pd.DataFrame]] = {".parquet": pd.read_parquet, ".mcap": _read_joint_states}
