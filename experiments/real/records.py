"""Readers for published records of real devices whose stiffness or clearance changes.

- DROPBEAR: High-Rate-SHM-Working-Group, Dataset-8 DROPBEAR Acceleration vs Roller Displacement (2023), text.
- Friction damper with backlash: ARTS-Laboratory, Dataset-Friction-Damper-with-Backlash (2022), JSON.
- F-16: Noël and Schoukens, F-16 aircraft benchmark based on ground vibration test data (2017), MATLAB, on
  nonlinearbenchmark.org.
- Brake-Reuss beam: Cenedese, BRBtesting (Chen et al., Mech. Syst. Signal Process. 166, 2022, 108401), MATLAB, and its
  stepped-sine curves rewritten as CSV.

All but the F-16 are on GitHub under those names, and none is part of this project. Text and JSON files may be
compressed by gzip.
"""

import json
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from clearance_mj import RecordError, Response
from clearance_mj.core.files import read_lines
from clearance_mj.io.mat import read_variables

INCH = 0.0254  # m
POUND = 4.4482216152605  # N
HEADER_LINES = 9  # of a DROPBEAR file; the sixth names the columns
STEPPED = ("control", "index", "frequency_Hz", "force_N", "amplitude_m_s2", "phase_rad")
"""columns of a file of stepped-sine curves"""
ACCELERATION, POSITION, TIME = "Low G Accel", "PinLoc", "Time"


@dataclass(frozen=True, eq=False)
class DropbearRecord:
    """Cantilever with a roller support that moves along it."""

    time: np.ndarray  #: (n,) s
    acceleration: np.ndarray  #: (n,) low-g accelerometer, V (not scaled)
    position: np.ndarray  #: (n,) roller position sensor, V (not scaled)
    fs: float  #: samples per second


@dataclass(frozen=True, eq=False)
class DamperRecord:
    """Friction damper with backlash under a prescribed displacement."""

    time: np.ndarray  #: (n,) s
    displacement: np.ndarray  #: (n,) m
    force: np.ndarray  #: (n,) N
    fs: float  #: samples per second


@dataclass(frozen=True, eq=False)
class HammerRecord:
    """Ring-down of the Brake-Reuss beam after a hammer's hit."""

    acceleration: np.ndarray  #: (3, n) m/s²
    fs: float  #: samples per second


@dataclass(frozen=True, eq=False)
class SteppedSine:
    """One stepped-sine curve of the Brake-Reuss beam, in the order of the file."""

    control: str  #: what the controller held: "ForceControl" or "ResponseControl"
    index: int
    frequency: np.ndarray  #: (n,) Hz
    force: np.ndarray  #: (n,) N
    amplitude: np.ndarray  #: (n,) m/s²
    phase: np.ndarray  #: (n,) rad, of the reversed acceleration over the force


def real_folder() -> Path | None:
    """Return the folder named by the environment variable CLEARANCE_REAL_DATA; None if it is not set or missing."""
    folder = Path(os.environ.get("CLEARANCE_REAL_DATA", ""))
    return folder if folder.parts and folder.is_dir() else None


def read_dropbear(path) -> DropbearRecord:
    """Read a DROPBEAR text file: 9 header lines, then columns separated by tabs.

    RecordError names file and line if a column is missing, a line is not numbers or the time does not rise.
    """
    lines = read_lines(path)
    if len(lines) <= HEADER_LINES:
        raise RecordError(f"{path}: {len(lines)} lines, a DROPBEAR file has {HEADER_LINES} header lines and then data")
    names = [name.strip() for name in lines[5].split("\t")]
    missing = [name for name in (ACCELERATION, POSITION, TIME) if name not in names]
    if missing:
        raise RecordError(f"{path}, line 6: no column {', '.join(missing)} among {', '.join(names)}")
    rows = np.empty((len(lines) - HEADER_LINES, len(names)))
    for i, line in enumerate(lines[HEADER_LINES:]):
        try:
            rows[i] = [float(field) for field in line.split("\t")]
        except ValueError:
            raise RecordError(
                f"{path}, line {i + HEADER_LINES + 1}: {len(names)} numbers expected, got {line[:60]!r}"
            ) from None
    time, acceleration, position = (rows[:, names.index(name)] for name in (TIME, ACCELERATION, POSITION))
    fs = _rate(path, time, first=HEADER_LINES + 1)
    _finite(path, HEADER_LINES + 1, acceleration=acceleration, position=position)
    return DropbearRecord(time, acceleration, position, fs)


def read_damper(path) -> DamperRecord:
    """Read a JSON file of the friction damper with backlash; the force is the friction force, in SI units as all.

    The file: {"data": rows of [time s, displacement in, friction force kip, velocity in/s, actuator force 1 lb,
    actuator force 2 lb]}. RecordError names file and line (of a JSON error) or row.
    """
    try:
        content = json.loads("\n".join(read_lines(path)))
    except json.JSONDecodeError as error:
        raise RecordError(f"{path}, line {error.lineno}: not JSON ({error.msg})") from None
    rows = content.get("data") if isinstance(content, dict) else None
    if not isinstance(rows, list) or len(rows) < 2:
        raise RecordError(f'{path}: needs {{"data": [rows]}} with two rows or more')
    for i, row in enumerate(rows):
        if not isinstance(row, list) or len(row) < 3 or not all(type(v) in (int, float) for v in row[:3]):
            raise RecordError(f"{path}, row {i + 1}: needs numbers for time, displacement and force")
    time, displacement, force = np.array([row[:3] for row in rows], dtype=float).T
    fs = _rate(path, time, first=1, unit="row")
    _finite(path, 1, "row", displacement=displacement, force=force)
    return DamperRecord(time, displacement * INCH, force * 1000 * POUND, fs)


def read_f16(path) -> Response:
    """Read a record of the F-16: Force (N), Acceleration (m/s²) at shaker, wing and payload, Fs (Hz).

    Force and first acceleration are at one point, node 1; wing and payload are nodes 2 and 3. RecordError names the
    file if it is not there or holds something else.
    """
    content = read_variables(path)
    force, rows, fs = (np.asarray(content.get(name, ()), dtype=float) for name in ("Force", "Acceleration", "Fs"))
    if not force.size or rows.shape != (3, force.size) or fs.size != 1:
        raise RecordError(
            f"{path}: needs Force (n), Acceleration (3, n) and Fs; it has {force.shape}, {rows.shape} and {fs.shape}"
        )
    return Response(fs.item(), force.ravel(), rows, kind="force", band=(2.0, 15.0), responses=("1:+Z", "2:+Z", "3:+Z"),
                    reference="1:+Z")  # fmt: skip


def read_hammer(path) -> HammerRecord:
    """Read the ring-down of the Brake-Reuss beam: a structure HIdata with time, acc1, acc2, acc3 in m/s².

    RecordError names the file if it is not there or holds something else.
    """
    content, names = read_variables(path).get("HIdata"), ("time", "acc1", "acc2", "acc3")
    held = [content.get(name) if isinstance(content, dict) else None for name in names]
    missing = [name for name, value in zip(names, held) if np.size(value) < 2]
    if missing:
        raise RecordError(f"{path}: needs HIdata with {', '.join(names)}; it has no {', '.join(missing)}")
    rows = [np.asarray(value, dtype=float).ravel() for value in held]
    if len({row.shape for row in rows}) > 1:
        raise RecordError(f"{path}: {', '.join(names)} have {[row.size for row in rows]} samples")
    fs = _rate(path, rows[0], first=1, unit="sample")
    _finite(path, 1, "sample", **dict(zip(names[1:], rows[1:])))
    return HammerRecord(np.stack(rows[1:]), fs)


def read_stepped_sines(path) -> list[SteppedSine]:
    """Read the stepped-sine curves of the Brake-Reuss beam: CSV with the columns of `STEPPED`, curve after curve.

    RecordError names file and line if a column is missing or a line is not numbers.
    """
    header, *lines = read_lines(path) or [""]
    names = header.strip().split(",")
    missing = [name for name in STEPPED if name not in names]
    if missing:
        raise RecordError(f"{path}, line 1: no column {', '.join(missing)} among {', '.join(names)}")
    at = [names.index(name) for name in STEPPED]
    curves: dict[tuple[str, int], list[list[float]]] = {}
    for i, line in enumerate(lines):
        fields = line.strip().split(",")
        try:
            control, index, *numbers = (fields[j] for j in at)
            row = [float(number) for number in numbers]
            curves.setdefault((control, int(index)), []).append(row)
        except (ValueError, IndexError):
            raise RecordError(f"{path}, line {i + 2}: a control and {len(STEPPED) - 1} numbers expected") from None
        if not (np.isfinite(row).all() and min(row[:3]) > 0):
            raise RecordError(f"{path}, line {i + 2}: frequency, force and amplitude must be > 0, all finite")
    return [SteppedSine(*key, *np.array(rows).T) for key, rows in curves.items()]


def _rate(path, time, first, unit="line"):
    """Samples per second, or an error where the time does not rise."""
    rising = np.diff(time) > 0
    if not rising.all():
        raise RecordError(f"{path}, {unit} {int(np.argmin(rising)) + 1 + first}: the time does not rise")
    if time.size < 2:
        raise RecordError(f"{path}: one sample is no record")
    return float((time.size - 1) / (time[-1] - time[0]))


def _finite(path, first, unit="line", **channels):
    for name, value in channels.items():
        good = np.isfinite(value)
        if not good.all():
            raise RecordError(f"{path}, {unit} {int(np.argmin(good)) + first}: {name} is not finite")
