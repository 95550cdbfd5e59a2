"""Targets of a calibration: measured natural frequencies and shapes, or FRFs; also read from files."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike

import numpy as np

from ..beam import linear_frf, mode_shapes, natural_frequencies
from ..core.checks import naming
from ..core.errors import RecordError
from ..core.files import plain_file
from ..io.uff import read_uff
from ..rig import Rig
from ..signals.ema import extract_modes
from ..signals.frf import FRF
from ..structure.base import parse_dof

__all__ = ["FRFTarget", "ModalTarget", "modal_target", "read_frequencies", "read_frf"]

FREQUENCY_STD = 1e-3  # of a measured natural frequency, relative, where the file does not say
MIN_STD = 1e-9  # of a frequency: no test knows one better
SHAPE_STD = 0.03  # of a component of a shape of unit length
FRF_STD = 1.0  # of a line of an FRF, dB


@dataclass(frozen=True, eq=False)
class ModalTarget:
    """Measured natural frequencies, and shapes where known.

    Raises
    ------
    RecordError
        If frequencies or mode numbers do not rise, or a value is not positive.
    """

    frequency: np.ndarray
    """(n,) Hz, rising"""
    mode: np.ndarray
    """(n,) number of each mode, from 1"""
    std: np.ndarray
    """(n,) standard deviation, Hz"""
    shape: np.ndarray | None = None
    """(n_sensors, n) real, any scale"""
    nodes: tuple[int | str, ...] = ()
    """sensors that the shape's rows belong to: nodes, or degrees of freedom such as "7:-X" """
    shape_std: float = SHAPE_STD
    """of a component of a shape of unit length"""

    def __post_init__(self) -> None:
        for name, values in (("natural frequencies", self.frequency), ("mode numbers", self.mode)):
            if not np.size(values) or not np.all(np.diff(values, prepend=0) > 0) or not np.isfinite(values).all():
                raise RecordError(f"{name} must be positive and rise, got {_comma_list(values)}")
        if np.any(np.mod(self.mode, 1)):
            raise RecordError(f"mode numbers must be whole, got {_comma_list(self.mode)}")
        relative = np.asarray(self.std) / self.frequency
        if not np.all((relative >= MIN_STD) & (relative <= 1)):
            raise RecordError(
                f"standard deviations must be > 0 Hz, {MIN_STD:g} to 1 of the frequency, got {_comma_list(self.std)}"
            )
        if self.shape is not None and not (np.isfinite(self.shape).all() and np.any(self.shape, axis=0).all()):
            raise RecordError("a shape is not finite or zero at every sensor")

    @property
    def size(self) -> int:
        """Number of data; the scale of a shape is none."""
        return self.frequency.size + (0 if self.shape is None else (self.shape.shape[0] - 1) * self.shape.shape[1])

    def residual(self, rig: Rig) -> np.ndarray:
        """Return the differences of a rig from the target, in standard deviations.

        Parameters
        ----------
        rig : Rig
            The rig.

        Returns
        -------
        ndarray
            (n,) logarithms of the frequency ratios, then (n_sensors n,) differences of the shapes, whose squares sum
            to 1 - MAC for each mode before they are divided by the variance.
        """
        frequency, shape = self.model(rig)
        errors = np.log(frequency / self.frequency) * self.frequency / self.std
        if self.shape is None:
            return errors
        test = self.shape / np.linalg.norm(self.shape, axis=0)
        fitted = shape * (np.sum(shape * test, axis=0) / np.sum(shape**2, axis=0))
        return np.concatenate((errors, (fitted - test).ravel() / self.shape_std))

    def model(self, rig: Rig) -> tuple[np.ndarray, np.ndarray]:
        """Return a rig's natural frequencies (n,), Hz, and shapes (n_sensors, n), 1/sqrt(kg), of the target's modes.

        Parameters
        ----------
        rig : Rig
            The rig.
        """
        modes = np.asarray(self.mode, dtype=int) - 1
        rows, sign = sensor_rows(rig, self.nodes)
        n, sensors = int(modes.max()) + 1, [rig.sensors[row] for row in rows]
        shapes = mode_shapes(rig, [s.position for s in sensors], n)[:, modes]
        return natural_frequencies(rig, n)[modes], (sign * [s.gain for s in sensors])[:, None] * shapes


def _comma_list(values: np.ndarray) -> str:
    return ", ".join(f"{v:g}" for v in values) or "none"


@dataclass(frozen=True, eq=False)
class FRFTarget:
    """Measured FRFs, whose magnitudes are compared in dB."""

    frf: FRF
    """of the test"""
    std: float = FRF_STD
    """standard deviation of a line, dB"""

    @property
    def nodes(self) -> tuple[int | str, ...]:
        """Sensors of the responses: nodes, of those that are not along +Z degrees of freedom."""
        return tuple(int(label[:-3]) if label.endswith(":+Z") else label for label in self.frf.responses)

    @property
    def size(self) -> int:
        """Number of data."""
        return self.frf.value.size

    def residual(self, rig: Rig) -> np.ndarray:
        """Return the differences (n_sensors n_f,) of a rig from the target, in standard deviations.

        Parameters
        ----------
        rig : Rig
            The rig.
        """
        return 20 * np.log10(np.abs(self.model(rig) / self.frf.functions)).ravel() / self.std

    def model(self, rig: Rig) -> np.ndarray:
        """Return a rig's FRFs (n_sensors, n_f).

        Parameters
        ----------
        rig : Rig
            The rig.
        """
        rows, sign = sensor_rows(rig, self.nodes)
        return sign[:, None] * linear_frf(rig, self.frf.frequency)[rows]


def sensor_rows(rig: Rig, names: Sequence[int | str]) -> tuple[list[int], np.ndarray]:
    """Return rows of sensors among the rig's and the sign (n,) of each, by nodes or degrees of freedom of any sign."""
    labels, nodes = rig.sensor_labels, [s.node for s in rig.sensors]
    rows, sign = [], []
    for name in names:
        label = f"{name}:+Z" if isinstance(name, int) else name
        opposite = label.translate(str.maketrans("+-", "-+"))
        if label in labels or opposite in labels:
            rows.append(labels.index(label if label in labels else opposite))
        elif isinstance(name, int) and nodes.count(name) == 1:
            rows.append(nodes.index(name))
        else:
            kind = "node" if isinstance(name, int) else "degree of freedom"
            raise RecordError(f"the data's {kind} {name} is no sensor of rig {rig.name!r}: {', '.join(labels)}")
        sign.append(1.0 if isinstance(name, int) or label in labels else -1.0)
    return rows, np.array(sign)


def modal_target(target: FRFTarget, n_modes: int = 4, std: float = FREQUENCY_STD) -> ModalTarget:
    """Extract natural frequencies and shapes from FRFs as targets; the modes count from 1 in rising order.

    Parameters
    ----------
    target : FRFTarget
        FRFs from below the first mode on.
    n_modes : int
        Number of modes.
    std : float
        Relative standard deviation of a frequency.

    Raises
    ------
    RecordError
        If fewer modes stand out.
    """
    modes = extract_modes(target.frf, n_modes)
    if modes.frequency.size < n_modes:
        raise RecordError(f"only {modes.frequency.size} of {n_modes} modes stand out of the FRFs")
    real = np.exp(-0.5j * np.angle(np.sum(modes.shape**2, axis=0)))
    numbers = np.arange(1, n_modes + 1)
    return ModalTarget(modes.frequency, numbers, std * modes.frequency, (modes.shape * real).real, target.nodes)


def read_frequencies(path: str | PathLike[str], std: float = FREQUENCY_STD) -> ModalTarget:
    """Read measured natural frequencies, and shapes where given, from a CSV file.

    Parameters
    ----------
    path : str or Path
        Its heading names the columns: ``frequency_hz`` (or ``test_hz``), and if known ``mode`` (else 1, 2, ...),
        ``std_hz``, and ``shape_NODE`` or ``shape_12:-X`` for the shape at each sensor.
    std : float
        Relative standard deviation of a frequency where there is no ``std_hz``.

    Raises
    ------
    RecordError
        If the file cannot be read, lacks a column or holds an impossible value.
    """
    try:
        with plain_file(path).open(newline="", encoding="utf-8-sig") as file:
            header, *rows = [row for row in csv.reader(file) if row]
        table = dict(zip(header, np.array(rows, dtype=float).T, strict=True))
    except OSError as error:
        raise RecordError(f"{path}: cannot be read ({error.strerror})") from None
    except ValueError:
        raise RecordError(f"{path}: must be a heading and rows of as many numbers, separated by commas") from None
    if (name := next((n for n in ("frequency_hz", "test_hz") if n in table), None)) is None:
        raise RecordError(f"{path}: lacks a column frequency_hz (or test_hz); its columns: {', '.join(header)}")
    named = [(c[6:], c) for c in header if c.startswith("shape_") and (c[6:].isdigit() or parse_dof(c[6:]))]
    nodes = tuple(int(text) if text.isdigit() else text for text, _ in named)
    frequency = table[name]
    mode, std_hz = table.get("mode", np.arange(1.0, frequency.size + 1)), table.get("std_hz", std * frequency)
    shape = np.array([table[column] for _, column in named]) if named else None
    with naming(path):
        return ModalTarget(frequency, mode, std_hz, shape, nodes)


def read_frf(path: str | PathLike[str], band: tuple[float, float] | None = None) -> FRFTarget:
    """Read measured FRFs from a universal file.

    Parameters
    ----------
    path : str or Path
        The file.
    band : (float, float), optional
        Lines to use, Hz.

    Raises
    ------
    RecordError
        If the file holds no FRFs, or one that is zero or not finite at a line.
    """
    frf = read_uff(path)
    if not isinstance(frf, FRF) or len(frf.references) > 1:
        content = f"FRFs to {', '.join(frf.references)}" if isinstance(frf, FRF) else "no FRFs"
        raise RecordError(f"{path}: holds {content}, calibration needs FRFs to one reference")
    frf = frf.within(band) if band else frf
    if not (np.isfinite(frf.value) & (frf.value != 0)).all():
        raise RecordError(f"{path}: an FRF is zero or not finite at a line; cut it off with a band")
    return FRFTarget(frf)
