"""Logs of a drive: angle and torque at its motor, and at its load where that is measured."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from ..core.errors import RecordError
from .logs import read_table

__all__ = ["DriveRecord"]

COLUMNS = ("motor_angle", "motor_torque", "load_angle", "load_torque")
SAMPLES = 100  # that a record has at least
UNEVEN = 0.5  # of the sampling interval, by which a time may be late before samples are missing
REVERSAL = 0.05  # of the range of the motor's angle, by which it must turn back


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
        rad and N m, at the motor's end. The torque is what the motor exerts on the drive.
    load_angle, load_torque : ndarray, shape (n,), optional
        At the load's end. The torque is what the drive exerts on the load.

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
                at = int(np.argmin(np.isfinite(values)))
                raise RecordError(f'run "{self.name}": {column} is not finite at {at / self.fs:g} s')
            if column.endswith("angle"):
                self._require_unwrapped(column, values)
            object.__setattr__(self, column, values)

    def _require_unwrapped(self, column: str, values: np.ndarray) -> None:
        jump = np.diff(values)
        usual = np.median(np.abs(jump))
        for turn, unit in ((2 * math.pi, "rad"), (360.0, "degrees")):
            at = np.flatnonzero((np.abs(np.abs(jump) - turn) < 0.1 * turn) & (np.abs(jump) > 20 * usual))
            if at.size:
                raise RecordError(
                    f'run "{self.name}": {column} jumps by {jump[at[0]]:.4g} at {at[0] / self.fs:g} s, a whole turn in '
                    f"{unit}: the encoder wraps; unwrap it (numpy.unwrap) and give rad"
                )

    @property
    def both_ends(self) -> bool:
        """Whether angle and torque of the load were measured."""
        return self.load_angle is not None and self.load_torque is not None

    @property
    def lost_work(self) -> float:
        """Work of the motor less work on the load, J, of a run of both ends."""
        if self.load_angle is None or self.load_torque is None:
            return math.nan
        given = np.trapezoid(self.motor_torque, self.motor_angle)
        return float(given - np.trapezoid(self.load_torque, self.load_angle))

    @functools.cached_property
    def reversals(self) -> int:
        """How often the motor turns back, by more than 5 % of its range."""
        x, count, forward = self.motor_angle, 0, 0
        extreme, least = x[0], REVERSAL * np.ptp(x)
        for value in x:
            if forward * (value - extreme) > 0 or (forward == 0 and abs(value - extreme) > least):
                forward, extreme = forward or (1 if value > extreme else -1), value
            elif forward * (extreme - value) > least:
                count, forward, extreme = count + 1, -forward, value
        return count

    def thinned(self, points: int) -> DriveRecord:
        """Return means over neighbouring samples, about so many of them.

        Parameters
        ----------
        points : int
            Number of samples at most.
        """
        size = -(-self.motor_angle.size // points)
        if size == 1:
            return self
        n = self.motor_angle.size // size * size
        channels = (getattr(self, column) for column in COLUMNS)
        thin = (None if c is None else c[:n].reshape(-1, size).mean(axis=1) for c in channels)
        return DriveRecord(self.name, self.fs / size, *thin)  # type: ignore[arg-type]

    @classmethod
    def read(cls, path: str | Path, columns: Mapping[str, str] | None = None) -> DriveRecord:
        """Read a run from a file: CSV (also compressed), Parquet, or joint states of ROS 2 in MCAP, see `read_table`.

        Parameters
        ----------
        path : path
            The file.
        columns : mapping of str to str, optional
            Columns of the file by what they are: "time" (s), "motor_angle" (rad), "motor_torque" (N m), "load_angle",
            "load_torque". Those that are not named have these names; the load's may be missing. A minus sign before a
            name is for a column that counts the other way round.

        Raises
        ------
        RecordError
            For a file that cannot be read, a column that is missing, and times that are not evenly spaced.
        """
        name = Path(path).name.split(".")[0]
        names = {known: known for known in ("time", *COLUMNS)} | dict(columns or {})
        if unknown := set(names) - {"time", *COLUMNS}:
            raise RecordError(f'"{min(unknown)}" is no column of a drive; known: time, {", ".join(COLUMNS)}')
        table = read_table(path)
        found = {}
        for what, column in names.items():
            sign, column = (1.0, column) if column in table else (-1.0, column.removeprefix("-"))
            if column in table:
                found[what] = sign * pd.to_numeric(table[column], errors="coerce").to_numpy(dtype=float)
            elif what in ("time", "motor_angle", "motor_torque") or what in (columns or {}):
                raise RecordError(f'{path}: no column "{column}" ({what}); it has {", ".join(map(str, table.columns))}')
        return cls(name, _rate(found["time"], str(path)), *(found.get(what) for what in COLUMNS))  # type: ignore[arg-type]


def _rate(time: np.ndarray, where: str) -> float:
    step = np.diff(time)
    if not step.size or not np.isfinite(step).all() or step.min() <= 0:
        raise RecordError(f"{where}: times must rise from sample to sample")
    usual = float(np.median(step))
    late = np.flatnonzero(np.abs(step - usual) > UNEVEN * usual)
    if late.size:
        raise RecordError(
            f"{where}: {step[late[0]]:.4g} s pass after {time[late[0]]:.6g} s instead of {usual:.4g} s "
            f"({late.size} times): samples are missing; cut the run there, or bring it to an even rate"
        )
    return 1 / float(np.mean(step))
