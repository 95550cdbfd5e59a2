"""Functions of frequency that are no FRFs: auto and cross spectra, densities, coherences, and others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.checks import NOWHERE
from ..core.errors import RecordError
from ..core.overview import HasOverview, Overview, few, span
from . import labelled
from .arrays import ArrayData, read_only, rows_of
from .welch import Band, lines_within

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["POWERS", "RATIOS", "Spectra"]

POWERS = ("auto spectrum", "cross spectrum", "power spectral density", "energy spectral density")
"""Kinds whose values are products of two quantities"""
RATIOS = ("coherence", "partial coherence", "multiple coherence")
"""Kinds whose values have no unit"""
MOST_SHOWN = 20  # functions that the overview lists
_LABELS = {"name": "names", "response": "responses", "reference": "references", "quantity": "quantities",
           "unit": "units"}  # fmt: skip
"""Fields with a label of each function, by the names of their coordinates"""


@dataclass(frozen=True, eq=False, repr=False)
class Spectra(HasOverview, ArrayData):
    """Functions of one kind over one abscissa, a row each.

    Raises
    ------
    RecordError
        If the shapes or the numbers of labels do not fit each other, or the abscissa of a spectrum does not rise.
    """

    kind: str
    """such as "auto spectrum", "cross spectrum", "power spectral density", "spectrum", "coherence" """
    abscissa: np.ndarray
    """(n_f,) frequency in Hz, rising, or the quantity ``axis``"""
    value: np.ndarray
    """(n_functions, n_f) real, or complex where there are phases; a cross spectrum is response × reference*"""
    responses: tuple[str, ...]
    """degree of freedom of each function, such as "3:+Z"; "0:S" where it is not known"""
    references: tuple[str, ...] = ()
    """degree of freedom of each function's reference; "0:S" where there is none, everywhere if left out"""
    names: tuple[str, ...] = ()
    """of the functions, in their file; the degrees of freedom if left out"""
    quantities: tuple[str, ...] = ()
    """of the responses, such as "acceleration"; "unknown" if left out"""
    units: tuple[str, ...] = ()
    """of the values, as they are written; "" if left out"""
    axis: str = "frequency"
    """quantity of the abscissa"""
    axis_unit: str = "Hz"
    """its unit"""

    def __post_init__(self) -> None:
        abscissa, value = read_only(self.abscissa), np.asarray(self.value)
        if abscissa.ndim != 1 or value.ndim != 2 or value.shape[1] != abscissa.size or not value.size:
            shapes = f"{value.shape} over {abscissa.shape}"
            raise RecordError(f"spectra are (n_functions, n_f) over (n_f,) lines, got {shapes}")
        if self.axis == "frequency" and not np.all(np.diff(abscissa) > 0):
            raise RecordError("the frequencies of spectra must rise from line to line")
        is_complex = np.iscomplexobj(value) and value.imag.any()
        value = read_only(value, complex) if is_complex else read_only(value.real)
        rows = len(value)
        texts: dict[str, tuple[str, ...]] = {"responses": tuple(self.responses)}
        defaults = {"references": (NOWHERE,) * rows, "names": texts["responses"], "quantities": ("unknown",) * rows}
        for name, default in (defaults | {"units": ("",) * rows}).items():
            texts[name] = tuple(getattr(self, name)) or default
        for name, labels in texts.items():
            if len(labels) != rows:
                raise RecordError(f"{len(labels)} {name} for {rows} spectra: {few(labels)}")
        self._set(abscissa=abscissa, value=value, **texts)

    @property
    def frequency(self) -> np.ndarray:
        """(n_f,) Hz; refuses functions of something else."""
        if self.axis != "frequency":
            raise RecordError(f"the {self.kind} is a function of {self.axis}, not of frequency")
        return self.abscissa

    @property
    def labels(self) -> tuple[str, ...]:
        """A label for each row: its response, "response/reference", or its name if it is not placed."""
        pairs = zip(self.responses, self.references, self.names)
        return tuple(
            name if response == NOWHERE else response if reference == NOWHERE else f"{response}/{reference}"
            for response, reference, name in pairs
        )

    def within(self, band: Band) -> Spectra:
        """Return the spectra at the lines with lo <= f <= hi; refuses a band without a line.

        Parameters
        ----------
        band : (float, float)
            Lower and upper end of the band, in units of the abscissa.
        """
        lines = lines_within(self.abscissa, band)
        return replace(self, abscissa=self.abscissa[lines], value=self.value[:, lines])

    def pick(self, rows: Sequence[int]) -> Spectra:
        """Return some of the functions.

        Parameters
        ----------
        rows : sequence of int
            Their rows.
        """
        chosen = rows_of(self.responses, rows, RecordError)
        picked: dict[str, Any] = {name: tuple(getattr(self, name)[i] for i in chosen) for name in _LABELS.values()}
        return replace(self, value=self.value[list(chosen)], **picked)

    def _overview(self) -> Overview:
        step = np.diff(self.abscissa)
        is_even = step.size and np.ptp(step) < 1e-6 * abs(step.mean())
        spacing = f", {step.mean():.4g} {self.axis_unit} apart" if is_even else ""
        lines = f"{self.abscissa.size}: {span(self.abscissa, self.axis_unit)}{spacing}"
        head = ("function", "quantity", "unit", "largest", f"at ({self.axis_unit or '1'})")
        rows = []
        for label, quantity, unit, value in zip(self.labels, self.quantities, self.units, self.value):
            line = int(np.argmax(np.abs(value)))
            rows.append((label, quantity, unit, f"{np.abs(value[line]):.4g}", f"{self.abscissa[line]:.4g}"))
        more = f"{len(rows) - MOST_SHOWN} more" if len(rows) > MOST_SHOWN else ""
        facts = {self.axis: lines, "besides the functions below": more}
        return Overview(f"Spectra: {len(rows)} of kind {self.kind}", facts, [head, *rows[:MOST_SHOWN]])

    def plot(self, rows: Sequence[int] | None = None) -> Figure:
        """Draw the functions, a panel each: levels in dB of spectra, coherences from 0 to 1, other values as they are.

        Parameters
        ----------
        rows : sequence of int, optional
            Those that are drawn; None: all.
        """
        from .figures import spectra_figure

        selected = rows_of(self.labels, rows, RecordError)
        functions = [(self.labels[row], self.units[row], self.value[row]) for row in selected]
        along = f"{self.axis.capitalize()} ({self.axis_unit or '1'})"
        return spectra_figure(self.kind, functions, self.abscissa, along)

    def to_xarray(self) -> xr.Dataset:
        """Return ``value`` (function, abscissa) with the labels of each function, and kind and axis as attributes."""
        attributes = {"kind": self.kind, "axis": self.axis, "axis_unit": self.axis_unit}
        ds = labelled.dataset("spectra", {"value": (("function", "abscissa"), self.value, "1")}, {}, attributes)
        ds["value"].attrs = {"long_name": self.kind}
        coordinates: dict[str, Any] = {n: ("function", list(getattr(self, field))) for n, field in _LABELS.items()}
        coordinates["abscissa"] = ("abscissa", self.abscissa, {"long_name": self.axis})
        return ds.assign_coords(coordinates)

    @classmethod
    def from_xarray(cls, ds: xr.Dataset) -> Spectra:
        """Return the spectra of a dataset that `to_xarray` made; refuses others.

        Parameters
        ----------
        ds : xarray.Dataset
            The dataset.
        """
        labelled.require_kind(ds, "spectra")
        dtype = complex if "value" in ds and ds["value"].dtype.kind == "c" else float
        value = labelled.values(ds, "value", "function", "abscissa", dtype=dtype)
        texts: dict[str, Any] = {field: labelled.labels(ds, name) for name, field in _LABELS.items()}
        texts |= {name: str(labelled.attribute(ds, name)) for name in ("kind", "axis", "axis_unit")}
        return cls(abscissa=labelled.values(ds, "abscissa", "abscissa"), value=value, **texts)
