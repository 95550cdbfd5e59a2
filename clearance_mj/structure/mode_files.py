"""Files of modes: universal files (data sets 55 and 2414) and CSV."""

from __future__ import annotations

import csv
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from ..core.checks import naming
from ..core.errors import RecordError, RigError
from ..core.files import read_lines
from ..universal import contents, scan
from ..universal.mode_shapes import ModeShapes, read_modes

__all__ = [
    "DAMPING", "FREQUENCY", "MODAL_MASS", "PARTICIPATION", "RESIDUAL", "ModesWarning", "phase_collinearity",
    "read_mode_file", "real_shapes",
]  # fmt: skip

COLLINEAR = 0.9  # phase collinearity below which a warning says that a mode is far from real
FREQUENCY, DAMPING, MODAL_MASS = "frequency [Hz]", "damping", "modal mass [kg]"
PARTICIPATION = tuple(f"participation {axis} [sqrt(kg)]" for axis in "XYZ")
RESIDUAL = "residual at "
_UNSCALED = (
    "modes without scaling; give modal_masses (kg) beside file, or make the structure of FRFs with a driving point "
    "(modes_from_frf)"
)


class ModesWarning(UserWarning):
    """A property of modes that is not known, or that a structure of real modes neglects."""


def phase_collinearity(shape: np.ndarray) -> np.ndarray:
    """Return the modal phase collinearity |Σψ²|² / (Σ|ψ|²)² of modes: 1 where a shape is real up to a common phase.

    Pappa, Elliott and Schenk, Consistent-mode indicator for the eigensystem realization algorithm, Journal of Guidance,
    Control and Dynamics 16, 1993, with zero for the mean.

    Parameters
    ----------
    shape : ndarray, shape (n_dofs, n)
        Complex shapes.
    """
    return np.abs(np.sum(shape**2, axis=0)) ** 2 / np.sum(np.abs(shape) ** 2, axis=0) ** 2


def real_shapes(shape: np.ndarray) -> np.ndarray:
    """Return the real parts (n_dofs, n) of complex shapes, each turned by the phase that makes them largest.

    Parameters
    ----------
    shape : ndarray, shape (n_dofs, n)
        Complex shapes.
    """
    return (shape * np.exp(-0.5j * np.angle(np.sum(shape**2, axis=0)))).real


def read_mode_file(path: Path, scaled: bool = False) -> dict[str, Any]:
    """Read the modes of a file as the fields of a `ModalStructure`.

    Parameters
    ----------
    path : Path
        Universal file (.uff, .unv, .uf) or CSV file.
    scaled : bool
        True if modal masses are given elsewhere, so that the file need not have them.

    Raises
    ------
    RigError
        If the file cannot be used, or does not say how its modes are scaled.
    """
    with naming(path, RecordError, RigError, "{1}"):  # names the file already
        if path.suffix.lower() in (".csv", ".txt"):
            lines = read_lines(path)
            with naming(path):
                return _read_csv(lines)
        data = contents(path)
        with naming(path):
            return _read_universal(path, data, scaled)


def _read_universal(path: Path, data: bytes, scaled: bool) -> dict[str, Any]:
    _, blocks, notes = scan(data)
    sets = read_modes(blocks)
    if len(sets) != 1:
        why = "its modes are of several sets of nodes" if sets else "holds no modes"
        raise RecordError(f"{why}; needs data sets 55 or 2414 at the same nodes, of analysis type 2, 3 or 7")
    (modes,) = sets
    for note in notes:
        _warn(f"{path}: {note}")
    if not any(block.kind == 164 for block in blocks):
        _warn(f"{path}: has no units (data set 164); taken for SI")
    if low := [f"{i + 1} ({mpc:.2f})" for i, mpc in enumerate(phase_collinearity(modes.shape)) if mpc < COLLINEAR]:
        _warn(f"{path}: real parts stand for modes that are far from real (phase collinearity): {', '.join(low)}")
    return {
        "frequencies": modes.frequency.tolist(),
        "damping_ratios": np.maximum(modes.damping, 0.0).tolist(),
        "dofs": list(modes.dofs),
        "shapes": real_shapes(modes.shape * _mass_factors(modes, scaled)).tolist(),
    }


def _mass_factors(modes: ModeShapes, scaled: bool) -> np.ndarray:
    """Return factors (n,) to unit modal mass: 1/√m, or √(2 j ω_d / a) of complex modes; 1 where masses come later."""
    if scaled:
        return np.ones(modes.frequency.size, dtype=complex)
    damped = 2 * np.pi * modes.frequency * np.sqrt(1 - np.minimum(modes.damping, 1.0) ** 2)
    unknown = np.isnan(modes.modal_mass) & np.isnan(modes.modal_a)
    if unknown.any():
        raise RecordError(f"{_UNSCALED}; mode {int(np.argmax(unknown)) + 1} has neither modal mass nor modal A")
    mass = np.where(np.isnan(modes.modal_mass), modes.modal_a / (2j * damped), modes.modal_mass)
    return 1 / np.sqrt(mass)


def _warn(text: str) -> None:
    warnings.warn(text, ModesWarning, stacklevel=2)


def _read_csv(lines: list[str]) -> dict[str, Any]:
    """Return modes of a table as `ModalStructure.write_csv` writes it."""
    rows = [row for row in csv.reader(lines) if any(cell.strip() for cell in row)]
    header, table = [cell.strip() for cell in rows[0]] if rows else [], {r[0].strip(): r[1:] for r in rows[1:]}
    residual_dofs = [cell.removeprefix(RESIDUAL).split()[0] for cell in header if cell.startswith(RESIDUAL)]
    n = len(header) - 1 - len(residual_dofs)
    for name in (FREQUENCY, MODAL_MASS):
        if name not in table:
            why = f"{_UNSCALED}; " if name == MODAL_MASS else ""
            raise RecordError(f'{why}needs a row "{name}"; a table of modes is "dof, mode 1, ..." above such rows')
    known = (FREQUENCY, DAMPING, MODAL_MASS, *PARTICIPATION)
    numbers = {name: _parse_row(name, cells, n if name in known else len(header) - 1) for name, cells in table.items()}
    dofs = [name for name in table if name not in known]
    fields: dict[str, Any] = {
        "frequencies": numbers[FREQUENCY],
        "damping_ratios": numbers.get(DAMPING, []),
        "dofs": dofs,
        "shapes": [numbers[dof][:n] for dof in dofs],
        "modal_masses": numbers[MODAL_MASS],
    }
    if any(name in numbers for name in PARTICIPATION):
        fields["participation"] = list(zip(*(numbers.get(name, [0.0] * n) for name in PARTICIPATION)))
    if residual_dofs:
        fields |= {"residual_dofs": residual_dofs, "residual_flexibility": [numbers[dof][n:] for dof in dofs]}
    return fields


def _parse_row(name: str, cells: list[str], count: int) -> list[float]:
    with naming(f'row "{name}"', ValueError, RecordError):
        values = [float(cell) for cell in cells[:count]]
    if len(values) < count:
        raise RecordError(f'row "{name}" has {len(values)} numbers, needs {count}')
    return values
