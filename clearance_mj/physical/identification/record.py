"""Records of a machine that a MuJoCo model describes: controls and sensors over time."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from ...core.checks import naming
from ...core.errors import RecordError
from ...core.files import plain_file
from ...core.sampling import even_times
from ...core.units import quantity_of, unit_factor
from ..actuators import actuator_count
from ..drives import ANGLE, SPEED, drives
from ..elements import compile_target, suggestion

__all__ = ["ModelRecord", "drive_columns", "quantum"]

UNEVEN = 1e-2  # of the sampling interval, tolerated jitter of the times
SAMPLES = 20  # least number in a record
TURNING, SLIDING = ("angle", "spin", "torque"), ("displacement", "velocity", "force")  # quantities of a joint
MEASURED = {
    "LINVEL": ["velocity"], "ANGVEL": ["spin"], "LINACC": ["acceleration"], "FRAMEPOS": ["displacement"],
    "ACCELEROMETER": ["acceleration"], "VELOCIMETER": ["velocity"], "GYRO": ["spin"], "TOUCH": ["force"],
    "_FORCE": ["force"], "_TORQUE": ["torque"], "RANGEFINDER": ["displacement"], "CLOCK": ["time"],
    "POS": ["angle", "displacement"], "VEL": ["spin", "velocity"], "FRC": ["torque", "force"],
}  # fmt: skip
"""Quantities of a MuJoCo sensor, by the end of its type's name"""
_HEADER = re.compile(r"(.*?)\s*(?:\[(\d+)\])?\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))?")
REPEATED = 0.3  # fraction of repeated samples, above which a sensor counts as quantised


@dataclass(frozen=True, eq=False)
class ModelRecord:
    """Controls and sensors of one run.

    Parameters
    ----------
    fs : float
        Sampling rate, Hz.
    control : Mapping of str to array_like, shape (n,)
        By the name of the model's actuator; measured or commanded values, in the unit of its control.
    sensors : Mapping of str to array_like, shape (n,) or (n, dim)
        By the name of the model's sensor, in its unit; joint positions, velocities, forces, or any other.
    hold : "linear" or "zero"
        What controls are between samples: "linear" for measured ones, "zero" for commands that a controller holds.
    quantisation : Mapping of str to float, optional
        Step of a sensor that counts, such as 2π/4096 of an encoder. Where it is not given it is seen in the samples.
    pose : array_like, shape (nq,), optional
        Near which the record begins; the model's initial pose if it is not given.

    Raises
    ------
    RecordError
        For samples of different number, too few, or not finite.
    """

    fs: float
    control: Mapping[str, ArrayLike]
    sensors: Mapping[str, ArrayLike]
    hold: Literal["linear", "zero"] = "linear"
    quantisation: Mapping[str, float] = field(default_factory=dict)
    pose: ArrayLike | None = None

    def __post_init__(self) -> None:
        if not (0 < self.fs < math.inf):
            raise RecordError(f"sampling rate {self.fs:g} Hz must be > 0")
        if self.hold not in ("linear", "zero"):
            raise RecordError(f'hold "{self.hold}" is unknown; use "linear" or "zero"')
        if not self.sensors:
            raise RecordError("a record needs a sensor at least")
        for kind in ("control", "sensors"):
            object.__setattr__(self, kind, {n: np.array(v, dtype=float) for n, v in getattr(self, kind).items()})
        size = len(next(iter(self.sensors.values())))  # type: ignore[arg-type]
        for name, values in (*self.control.items(), *self.sensors.items()):
            samples = np.asarray(values)
            if len(samples) != size:
                raise RecordError(f'"{name}" has {len(samples)} samples, the record\'s first sensor {size}')
            if not np.isfinite(samples).all():
                sample = int(np.argmax(~np.isfinite(samples).reshape(size, -1).all(axis=1)))
                raise RecordError(f'"{name}" is not finite at sample {sample} ({sample / self.fs:g} s)')
        if size < SAMPLES:
            raise RecordError(f"a record of {size} samples is too short; {SAMPLES} are needed")
        steps = {name: quantum(np.asarray(values)) for name, values in self.sensors.items()}
        for name, step in self.quantisation.items():
            if name not in steps:
                raise RecordError(f'quantisation of "{name}", which is no sensor of the record: {", ".join(steps)}')
            if not 0 <= step < math.inf:
                raise RecordError(f'quantisation {step:g} of "{name}" must be >= 0')
        object.__setattr__(self, "quantisation", steps | dict(self.quantisation))

    @property
    def size(self) -> int:
        """Number of samples."""
        return len(np.asarray(next(iter(self.sensors.values()))))

    @property
    def time(self) -> np.ndarray:
        """(n,) s."""
        return np.arange(self.size) / self.fs

    @classmethod
    def of_time(
        cls, time: ArrayLike, control: Mapping[str, ArrayLike], sensors: Mapping[str, ArrayLike],
        hold: Literal["linear", "zero"] = "linear",
    ) -> ModelRecord:  # fmt: skip
        """Return a record of samples given with their times instead of a sampling rate.

        Samples with jitter are interpolated linearly to even times; held controls keep their impulse.

        Parameters
        ----------
        time : array_like, shape (n,)
            s, rising, of which none is missing.
        control, sensors : Mapping of str to array_like
            Controls and sensors, as in `ModelRecord`.
        hold : "linear" or "zero"
            What controls are between samples, as in `ModelRecord`.

        Raises
        ------
        RecordError
            For times that do not rise or of which some are missing, and whatever `ModelRecord` refuses.
        """
        time = np.asarray(time, dtype=float)
        if time.ndim != 1 or time.size < 2 or not np.isfinite(time).all():
            raise RecordError(f"time of shape {time.shape} must be finite numbers, two or more")
        for name, values in (*control.items(), *sensors.items()):
            if len(values) != time.size:  # type: ignore[arg-type]
                raise RecordError(f'"{name}" has {len(values)} samples, time {time.size}')  # type: ignore[arg-type]
        fs, grid = even_times(time, "the record")
        if np.abs(time - grid).max() <= UNEVEN / fs:
            return cls(fs, control, sensors, hold)
        quanta = {name: quantum(np.asarray(values, dtype=float)) for name, values in sensors.items()}
        controls = {name: _resample(grid, time, values, hold) for name, values in control.items()}
        resampled = {name: _resample(grid, time, values) for name, values in sensors.items()}
        return cls(fs, controls, resampled, hold, quanta)

    @classmethod
    def read_csv(
        cls, path: str | Path, spec: mujoco.MjSpec | mujoco.MjModel, columns: Mapping[str, str] | None = None,
        hold: Literal["linear", "zero"] = "linear",
    ) -> ModelRecord:  # fmt: skip
        """Read a CSV file with the columns time (s), and names of the model's actuators and sensors.

        A sensor of several numbers has columns NAME[0], NAME[1]; where an actuator and a sensor have one name, write
        actuator:NAME and sensor:NAME. A unit behind a name, such as NAME [deg], NAME[0] [mm] or time (ms), is brought
        to SI units if it is one of what the sensor measures; numbers without one are in SI units.

        Parameters
        ----------
        path : str or Path
            The file; its first line has the names.
        spec : mujoco.MjSpec or mujoco.MjModel
            Whose actuators and sensors are meant.
        columns : Mapping of str to str, optional
            The file's columns by name in the model: "time", an actuator or a sensor; others are left out. A minus sign
            before a column is for one that counts the other way round, a unit behind it goes before that of the file:
            {"encoder": "-pos [ticks/4096]"}.
        hold : "linear" or "zero"
            What controls are between samples, as in `ModelRecord`.

        Raises
        ------
        RecordError
            For a file that cannot be read, a column of another name or unit, a cell that is not a number, and whatever
            `ModelRecord` refuses.
        """
        names, values = _read_table(Path(path))
        if columns is not None:
            with naming(path):
                names, values = _select_columns(names, values, columns)
        model, time = compile_target(spec), None
        known = {
            "actuator": [model.actuator(i).name for i in range(actuator_count(model))],
            "sensor": [*(model.sensor(i).name for i in range(model.nsensor)), *drive_columns(model)],
        }
        columns_by_kind: dict[str, dict[str, dict[int, np.ndarray]]] = {"actuator": {}, "sensor": {}}
        with naming(path):
            for header, column in zip(names, values.T):
                name, index, unit = _split_header(header, known)
                if name == "time" and time is None:
                    time = column * (unit_factor(unit, "time") if unit else 1.0)
                    continue
                kind, _, bare = name.rpartition(":")
                base = bare if kind in known else name
                kinds = [k for k in ([kind] if kind in known else known) if base in known[k]]
                if len(kinds) != 1:
                    raise RecordError(f"column {_name_problem(header, base, kinds, known)}")
                cells = columns_by_kind[kinds[0]].setdefault(base, {})
                if index in cells:
                    raise RecordError(f'column "{header}" is there twice; write {base}[0], {base}[1]')
                cells[index] = column * (_si_factor(header, unit, _quantities(model, kinds[0], base)) if unit else 1.0)
            if time is None:
                raise RecordError(f'has no column "time": {", ".join(names)}')
            control, sensors = ({n: _stack(n, c) for n, c in elements.items()} for elements in columns_by_kind.values())
            return cls.of_time(time, control, sensors, hold)


def drive_columns(model: mujoco.MjModel) -> dict[str, tuple[int, int]]:
    """Return column (in sensor data followed by activations) and dimension of drives' angles and speeds, by name."""
    return {
        f"{drive.name}.{quantity}": (model.nsensordata + int(model.actuator_actadr[drive.actuator]) + offset, 1)
        for drive in drives(model) for quantity, offset in (("angle", ANGLE), ("speed", SPEED))
    }  # fmt: skip


def _select_columns(names: list[str], values: np.ndarray, columns: Mapping[str, str]) -> tuple[list[str], np.ndarray]:
    """Return headers and values of the mapped columns, renamed to their quantities."""
    headers, selected = list[str](), list[np.ndarray]()
    parsed = [_HEADER.fullmatch(name).groups() for name in names]  # type: ignore[union-attr]
    for target, column in columns.items():
        sign = -1.0 if column.startswith("-") and column not in names else 1.0
        bare = column if column in names else column.removeprefix("-")
        name, index, *units = _HEADER.fullmatch(bare).groups()  # type: ignore[union-attr]
        position = next((i for i, fields in enumerate(parsed) if names[i] == bare or fields[:2] == (name, index)), None)
        if position is None:
            raise RecordError(f'no column "{bare}" ({target}); it has {", ".join(names)}')
        unit = next((text for text in (*units, *parsed[position][2:]) if text), "")
        headers.append(f"{target} [{unit}]" if unit else target)
        selected.append(sign * values[:, position])
    return headers, np.array(selected).T


def _split_header(header: str, known: Mapping[str, list[str]]) -> tuple[str, int, str]:
    """Return name, index and unit of a column; names in the model may contain brackets."""
    if any(header.removeprefix(f"{kind}:") in names for kind, names in known.items()):
        return header, 0, ""
    name, index, square, curved = _HEADER.fullmatch(header).groups()  # type: ignore[union-attr]
    return name, int(index or 0), (square or curved or "").strip()


def _quantities(model: mujoco.MjModel, kind: str, name: str) -> list[str]:
    """Return the possible quantities of a sensor or an actuator's control; those of its joint if it has one."""
    if name in drive_columns(model):
        kind, name = "actuator", name.rpartition(".")[0]
    known, object_type, number = [*TURNING, *SLIDING], mujoco.mjtObj.mjOBJ_ACTUATOR, getattr(model, kind)(name).id
    if kind == "sensor":
        object_type, type_ = model.sensor_objtype[number], mujoco.mjtSensor(model.sensor_type[number]).name
        known = next((quantities for end, quantities in MEASURED.items() if type_.endswith(end)), [])
        number = model.sensor_objid[number]
    if object_type == mujoco.mjtObj.mjOBJ_ACTUATOR and model.actuator_trntype[number] == mujoco.mjtTrn.mjTRN_JOINT:
        object_type, number = mujoco.mjtObj.mjOBJ_JOINT, model.actuator_trnid[number, 0]
    if object_type != mujoco.mjtObj.mjOBJ_JOINT:
        return known
    return [q for q in known if q in (SLIDING if model.jnt_type[number] == mujoco.mjtJoint.mjJNT_SLIDE else TURNING)]


def _si_factor(header: str, unit: str, quantities: list[str]) -> float:
    if not quantities:
        raise RecordError(f'column "{header}": its sensor has no unit; give its numbers as MuJoCo has them')
    with naming(f'column "{header}"'):
        return unit_factor(unit, (quantity_of(unit, quantities) or quantities)[0])


def _resample(grid: np.ndarray, time: np.ndarray, samples: ArrayLike, hold: str = "linear") -> np.ndarray:
    """Resample (n,) or (n, dim) to even times; held controls as means over each interval."""
    values = np.asarray(samples, dtype=float)
    if hold == "linear":
        columns = [np.interp(grid, time, column) for column in values.reshape(time.size, -1).T]
        return np.stack(columns, axis=1).reshape(values.shape)
    dt = grid[1] - grid[0]
    impulse = np.append(0.0, np.cumsum(values * np.diff(time, append=time[-1] + dt)))
    ends = np.append(time, max(time[-1], grid[-1]) + dt)
    return np.diff(np.interp(np.append(grid, grid[-1] + dt), ends, impulse)) / dt


def _stack(name: str, columns: Mapping[int, np.ndarray]) -> np.ndarray:
    """Return columns as an array (n,) or (n, dim), in the order of their indices."""
    if sorted(columns) != [*range(len(columns))]:
        raise RecordError(f'"{name}" has columns {", ".join(f"{name}[{i}]" for i in sorted(columns))}; write them all')
    return columns[0] if len(columns) == 1 else np.stack([columns[i] for i in range(len(columns))], axis=1)


def _read_table(path: Path) -> tuple[list[str], np.ndarray]:
    with naming(f"{path} cannot be read", (OSError, UnicodeDecodeError), RecordError):
        with plain_file(path).open(newline="", encoding="utf-8-sig") as file:
            rows = [row for row in csv.reader(file) if row]
    names = [name.strip() for name in rows[0]] if rows else []
    for i, row in enumerate(rows[1:], start=2):
        if len(row) != len(names):
            raise RecordError(f"{path}, row {i}: {len(row)} cells for {len(names)} columns")
    with naming(path, ValueError, RecordError):
        return names, np.array(rows[1:], dtype=float).reshape(-1, len(names))


def _name_problem(name: str, base: str, kinds: list[str], names: Mapping[str, list[str]]) -> str:
    if kinds:
        return f'"{name}" is an actuator and a sensor; write actuator:{base} or sensor:{base}'
    return f'"{name}" is neither an actuator nor a sensor; {suggestion(base, [*names["actuator"], *names["sensor"]])}'


def quantum(samples: np.ndarray) -> float:
    """Return the quantisation step of a sensor, from the differences of its values; 0 if values hardly repeat."""
    values = np.unique(samples)
    if values.size < 3 or values.size > (1 - REPEATED) * samples.size:
        return 0.0
    differences = np.diff(values)
    step = float(np.median(differences[differences < 1.5 * differences[differences > 1e-9 * np.ptp(values)].min()]))
    return step if np.max(np.abs(differences / step - np.round(differences / step))) < 0.05 else 0.0
