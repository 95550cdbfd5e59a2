"""Targets out of files."""

from __future__ import annotations

import csv
from os import PathLike

import numpy as np

from ..core.checks import naming
from ..core.errors import RecordError
from ..core.files import plain_file
from ..io.uff import read_uff
from ..signals.frf import FRF
from ..structure.base import parse_dof
from .targets import FREQUENCY_STD, FRFTarget, ModalTarget

__all__ = ["read_frequencies", "read_frf"]


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
    with naming(path):
        return ModalTarget(
            frequency,
            table.get("mode", np.arange(1.0, frequency.size + 1)),
            table.get("std_hz", std * frequency),
            np.array([table[column] for _, column in named]) if named else None,
            nodes,
        )


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
        found = f"FRFs to {', '.join(frf.references)}" if isinstance(frf, FRF) else "no FRFs"
        raise RecordError(f"{path}: holds {found}, calibration needs FRFs to one reference")
    frf = frf.within(band) if band else frf
    if not (np.isfinite(frf.value) & (frf.value != 0)).all():
        raise RecordError(f"{path}: an FRF is zero or not finite at a line; cut it off with a band")
    return FRFTarget(frf)
