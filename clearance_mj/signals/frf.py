"""Frequency response functions estimated from records: H = Y/X for signals that go as e^{+jωt}."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..core.checks import UNKNOWN
from ..core.errors import RecordError
from ..core.kinds import checks_kinds
from ..core.notes import note
from ..core.overview import HasOverview, Overview, few, span
from ..core.quantities import QUANTITIES
from . import labelled
from .arrays import ArrayData, read_only, rows_of
from .hits import hit_blocks, is_impulsive
from .labelled import UNITS
from .response import Response
from .welch import ESTIMATORS, WINDOWS, Band, Welch, lines_within

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["FRF", "estimate_frf", "estimate_frf_blocks"]

SEVERAL = "several"  # in place of a quantity that differs between responses
QUANTITY = {"base": "acceleration/acceleration", "force": "acceleration/force"}


@dataclass(frozen=True, eq=False, repr=False)
class FRF(HasOverview, ArrayData):
    """Frequency response functions of several responses to one or several references.

    ``value`` and ``coherence`` may be given as (n_outputs, n_f) where there is one reference. A pair of response and
    reference that was not measured is nan at every line.

    Raises
    ------
    RecordError
        If the shapes do not fit each other or the frequencies do not rise.
    """

    frequency: np.ndarray
    """(n_f,) Hz, rising"""
    value: np.ndarray
    """(n_outputs, n_inputs, n_f) complex, H = Y/X for signals that go as e^{+jωt}; SI unit by ``quantity``, as in
    the file where that is unknown"""
    coherence: np.ndarray | None = None
    """(n_outputs, n_inputs, n_f) ordinary coherence, 0 to 1; nan where it is unknown, None if it is everywhere"""
    responses: tuple[str, ...] = ()
    """degree of freedom of each output, such as "3:+Z"; numbered from 1 if left out"""
    references: tuple[str, ...] = ("100:+Z",)
    """degree of freedom of each input"""
    quantity: str = "acceleration/acceleration"
    """"acceleration/acceleration" (base excitation), "acceleration/force" (accelerance), "velocity/force" (mobility),
    "displacement/force" (receptance), "strain/force" ...; "several/force" where ``quantities`` differ; a part that its
    file does not say, or that is no motion and no force, is "unknown": see `signals.with_quantity`"""
    unit_label: str = ""
    """unit in its file of an FRF whose quantity is unknown"""
    averages: float | None = field(default=None, compare=False)
    """independent averages of the estimate; None: not known, as of most files"""
    window_rate: float = 0.0
    """1/s, of the exponential window that is in the FRF: it is H(jω + rate), and its peaks look as much more damped;
    `extract_modes` and `structure.modes_from_frf` take it out"""
    quantities: tuple[str, ...] = ()
    """quantity of each output where they differ; () where all are ``quantity``"""

    def __post_init__(self) -> None:
        frequency, value = read_only(self.frequency), read_only(_with_inputs(self.value), complex)
        if frequency.ndim != 1 or value.ndim != 3 or value.shape[2] != frequency.size or not value.size:
            shapes = f"{np.shape(self.value)} over {frequency.shape}"
            raise RecordError(f"an FRF is (n_outputs, n_inputs, n_f) over (n_f,) lines, got {shapes}")
        if not np.all(np.diff(frequency) > 0):
            raise RecordError("the frequencies of an FRF must rise from line to line")
        coherence = None if self.coherence is None else read_only(_with_inputs(self.coherence))
        if coherence is not None and coherence.shape != value.shape:
            raise RecordError(f"coherence has shape {coherence.shape}, the FRF {value.shape}")
        responses = tuple(self.responses) or tuple(f"{i + 1}:+Z" for i in range(value.shape[0]))
        references = (self.references,) if isinstance(self.references, str) else tuple(self.references)
        for role, labels, size in (("response", responses, value.shape[0]), ("reference", references, value.shape[1])):
            if len(labels) != size:
                raise RecordError(f"{len(labels)} {role} labels for {size} {role}s: {', '.join(labels)}")
        if self.quantities:
            if len(self.quantities) != len(responses):
                raise RecordError(f"{len(self.quantities)} quantities for {len(responses)} responses")
            first, *others = dict.fromkeys(self.quantities)
            several = f"{SEVERAL}/{first.partition('/')[2]}"
            self._set(quantity=several if others else first, quantities=tuple(self.quantities) if others else ())
        self._set(frequency=frequency, value=value, coherence=coherence, responses=responses, references=references)

    @property
    def reference(self) -> str:
        """The only reference; refuses several."""
        if len(self.references) > 1:
            raise RecordError(f"the FRF has several references, {', '.join(self.references)}; needs one")
        return self.references[0]

    @property
    def measured(self) -> np.ndarray:
        """(n_outputs, n_inputs) which pairs were measured; with one reference all count as measured."""
        if len(self.references) == 1:
            return np.ones(self.value.shape[:2], dtype=bool)
        return ~np.isnan(self.value).all(axis=2)

    @property
    def functions(self) -> np.ndarray:
        """(n_measured, n_f) a row for each measured pair: all responses to the first reference, and so on."""
        if len(self.references) == 1:
            return self.value[:, 0]
        return self.value.swapaxes(0, 1)[self.measured.T]

    @property
    def labels(self) -> tuple[str, ...]:
        """A label for each row of ``functions``: its response, or "response/reference" where there are several."""
        if len(self.references) == 1:
            return self.responses
        return tuple(f"{self.responses[i]}/{self.references[j]}" for j, i in np.argwhere(self.measured.T))

    @property
    def row_quantities(self) -> tuple[str, ...]:
        """Quantity of each response."""
        return self.quantities or (self.quantity,) * len(self.responses)

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each row of ``functions``, such as "m/s/N"; "1" of a ratio of like quantities."""
        of_rows = [self._unit_of(quantity) for quantity in self.row_quantities]
        return tuple(of_rows[i] for _, i in np.argwhere(self.measured.T))

    def of_quantity(self, quantity: str) -> FRF:
        """Return the functions of one quantity out of several.

        Parameters
        ----------
        quantity : str
            Such as "velocity/force"; refused if no response has it.
        """
        if not (rows := [i for i, row_quantity in enumerate(self.row_quantities) if row_quantity == quantity]):
            raise RecordError(f"holds FRFs of {', '.join(dict.fromkeys(self.row_quantities))}; not {quantity}")
        labels = tuple(self.responses[i] for i in rows)
        return self._part(rows, responses=labels, quantity=quantity, quantities=())

    def within(self, band: Band) -> FRF:
        """Return the FRF at the lines with lo <= f <= hi; refuses a band without a line.

        Parameters
        ----------
        band : (float, float)
            Lower and upper end of the band, Hz.
        """
        lines = lines_within(self.frequency, band)
        return self._part((..., lines), frequency=self.frequency[lines])

    def _part(self, index: Any, **changes: Any) -> FRF:
        """Return the values and coherences at an index."""
        coherence = None if self.coherence is None else self.coherence[index]
        return replace(self, value=self.value[index], coherence=coherence, **changes)

    def to_reference(self, reference: str) -> FRF:
        """Return the functions to one reference out of several, of the responses that were measured to it.

        Parameters
        ----------
        reference : str
            Such as "5:+Z"; refused if there are no functions to it.
        """
        if reference not in self.references:
            raise RecordError(f"holds FRFs to {', '.join(self.references)}; not {reference}")
        if len(self.references) == 1:
            return self
        j = self.references.index(reference)
        rows = np.flatnonzero(self.measured[:, j])
        texts = self.responses, self.quantities
        responses, quantities = (tuple(labels[i] for i in rows if labels) for labels in texts)
        part = self._part((rows, j), responses=responses, references=(reference,), quantities=quantities)
        is_known = part.coherence is not None and not np.isnan(part.coherence).all()
        return part if is_known else replace(part, coherence=None)

    def _overview(self) -> Overview:
        step = np.diff(self.frequency)
        spacing = f", {step.mean():.4g} Hz apart" if step.size and np.ptp(step) < 1e-6 * step.mean() else ""
        finite = np.empty(0) if self.coherence is None else self.coherence[np.isfinite(self.coherence)]
        size = np.where(np.isfinite(self.value), np.abs(self.value), -1.0)
        i, j, line = np.unravel_index(size.argmax(), size.shape)
        peak = f"{size.max():.4g} at {self.frequency[line]:.4g} Hz, {self.responses[i]}"
        to = self.references[0] if len(self.references) == 1 else f"{len(self.references)} references"
        facts = {
            "quantity": f"{self.quantity}, {self.unit}",
            "lines": f"{self.frequency.size}: {span(self.frequency, 'Hz')}{spacing}",
            "responses": few(self.responses),
            "references": few(self.references) if len(self.references) > 1 else "",
            "largest": "" if size.max() < 0 else peak + ("" if len(self.references) == 1 else f"/{self.references[j]}"),
            "coherence": f"median {np.median(finite):.3f}" if finite.size else "unknown",
            "averages": f"{self.averages:.3g}" if self.averages else "",
        }
        return Overview(f"FRF of {len(self.responses)} responses to {to}", facts)

    @property
    def unit(self) -> str:
        """Unit of ``value`` in words, such as "m/s²/N"; "1" of a ratio of like quantities."""
        return "several units" if self.quantities else self._unit_of(self.quantity)

    def _unit_of(self, quantity: str) -> str:
        above, _, below = quantity.partition("/")
        if UNKNOWN in (above, below):
            return self.unit_label or "unknown unit"
        numerator, divisor = (QUANTITIES[name].unit if name in QUANTITIES else name for name in (above, below))
        if "/" in divisor:
            numerator, divisor = (f"({unit})" if "/" in unit else unit for unit in (numerator, divisor))
        return "1" if above == below else f"{numerator}/{divisor}"

    def plot(self, rows: Sequence[int] | None = None, **others: FRF) -> Figure:
        """Draw magnitude, phase and coherence of every function, alone or over those of other FRFs.

        Parameters
        ----------
        rows : sequence of int, optional
            Rows of ``functions`` that are drawn; None: all.
        **others : FRF
            FRFs of the same functions by their names in the legend, such as ``test.plot(model=model)``.

        Raises
        ------
        RecordError
            If the others are of another quantity or other functions, or a row is not there.
        """
        from .figures import frf_figure

        for name, other in others.items():
            if (other.quantity, other.labels) != (self.quantity, self.labels):
                raise RecordError(
                    f"{name} is {other.quantity} at {few(other.labels)}, this FRF {self.quantity} at {few(self.labels)}"
                )
        return frf_figure({"this FRF": self} | others, rows_of(self.labels, rows, RecordError))

    def to_xarray(self) -> xr.Dataset:
        """Return ``value`` and ``coherence`` (response, reference, frequency), with labels, units and the quantity."""
        dims = ("response", "reference", "frequency")
        above, _, below = self.quantity.partition("/")
        units = "1" if above == below else f"({UNITS.get(above, above)})/({UNITS.get(below, below)})"
        attributes: dict[str, str | float] = {"quantity": self.quantity}
        if UNKNOWN in (above, below):
            units, attributes = self.unit_label, attributes | {"unit_label": self.unit_label}
        variables = {"value": (dims, self.value, units), "coherence": (dims, self.coherence, "1")}
        coordinates = {"response": self.responses, "reference": self.references, "frequency": self.frequency}
        attributes |= {name: value for name in ("averages", "window_rate") if (value := getattr(self, name))}
        ds = labelled.dataset("frf", variables, coordinates, attributes)
        if self.quantities:
            ds = ds.assign_coords(response_quantity=("response", list(self.quantities)))
        ds["value"].attrs["long_name"] = self.quantity
        return ds

    @classmethod
    def from_xarray(cls, ds: xr.Dataset) -> FRF:
        """Return the FRF of a dataset that `to_xarray` made; refuses others.

        Parameters
        ----------
        ds : xarray.Dataset
            The dataset.
        """
        labelled.require_kind(ds, "frf")
        dims = ("response", "reference", "frequency")
        value = labelled.values(ds, "value", *dims, dtype=complex)
        coherence = labelled.values(ds, "coherence", *dims) if "coherence" in ds else None
        responses, references = labelled.labels(ds, "response"), labelled.labels(ds, "reference")
        if len(set(references)) < len(references):
            raise RecordError(f"needs different references, got {', '.join(references)}")
        frequency, quantity = labelled.values(ds, "frequency", "frequency"), str(labelled.attribute(ds, "quantity"))
        unit, averages = str(ds.attrs.get("unit_label", "")), ds.attrs.get("averages")
        n_averages, rate = float(averages) if averages else None, float(ds.attrs.get("window_rate", 0.0))
        quantities = labelled.labels(ds, "response_quantity") if "response_quantity" in ds.coords else ()
        return cls(frequency, value, coherence, responses, references, quantity, unit, n_averages, rate, quantities)


def _with_inputs(value: ArrayLike) -> np.ndarray:
    """Return (n_outputs, n_f) of one reference as (n_outputs, 1, n_f)."""
    value = np.asarray(value)
    return value[:, None] if value.ndim == 2 else value


@checks_kinds
def estimate_frf(
    resp: Response, estimator: str = "H1", resolution: float = 0.5, overlap: float = 0.5, band: Band | None = None,
    window: str | None = None,
) -> FRF:  # fmt: skip
    """Estimate the FRFs of a record by averaging over windowed segments (Welch).

    A constant offset of a channel reaches only the lines 0 and 1, so none is removed. Of an excitation that is
    hits, segments begin with the hits and have no window, see `hammer_frf`; a `RecordNote` says so, and what is
    left out. For burst random take ``window="boxcar"``, ``overlap=0`` and 1 / (time from burst to burst) as the
    resolution: every segment then holds one burst and its whole decay.

    Parameters
    ----------
    resp : Response
        The record; its excitation is the reference, its channels are the responses, each in its quantity.
    estimator : {"H1", "H2", "Hv"}
        H1 = S_yx/S_xx (noise on the response), H2 = S_yy/S_xy (noise on the excitation), Hv: total least
        squares for each response alone (as much noise on both, in the units of the record).
    resolution : float
        Distance of the lines, Hz; a segment has round(fs / resolution) samples.
    overlap : float
        Fraction of a segment that the next one repeats, 0 <= overlap < 1.
    band : (float, float), optional
        Lines to return, Hz; else the band of the record's excitation, or every line if that is not known.
    window : {"hann", "boxcar"}, optional
        Periodic Hann, or none, on segments that follow one another from the first sample on. If left out: Hann, but
        of hits see above.

    Returns
    -------
    FRF
        nan at a line where the excitation is exactly zero.

    Raises
    ------
    RecordError
        If the record is shorter than one segment, sampled below twice the band, constant or not finite in its
        excitation or not finite in a response, or if an argument is unknown or impossible.

    Notes
    -----
    Bendat and Piersol, Random Data, 4th ed., 2010, chapters 6, 9 and 11; Hv: Rocklin, Crowley and Vold,
    A comparison of H1, H2, and Hv frequency response functions, IMAC 3, 1985.
    """
    if window is None and resp.excitation.ndim == 1 and is_impulsive(resp.excitation, resp.fs):
        blocks, words = hit_blocks(resp, resolution)
        note(f"the excitation {resp.reference}", words)
        if blocks:
            return estimate_frf_blocks(blocks, estimator, resolution, 0.0, band or resp.band, "boxcar")
    return estimate_frf_blocks([resp], estimator, resolution, overlap, band, window or "hann")


def estimate_frf_blocks(
    blocks: Iterable[Response], estimator: str = "H1", resolution: float = 0.5, overlap: float = 0.5,
    band: Band | None = None, window: str = "hann",
) -> FRF:  # fmt: skip
    """Estimate the FRFs of a record that comes block by block, as `estimate_frf` does of a whole one, to rounding.

    Parameters
    ----------
    blocks : iterable of Response
        Consecutive blocks of any lengths, such as `simulate_blocks` yields.
    estimator, resolution, overlap, band, window
        As in `estimate_frf`.

    Raises
    ------
    RecordError
        As `estimate_frf`.
    """
    for name, given, known in (("estimator", estimator, ESTIMATORS), ("window", window, WINDOWS)):
        RecordError.require_known(name, given, known)
    if not 0 <= overlap < 1:
        raise RecordError(f"overlap must be in 0 <= overlap < 1, got {overlap!r}")
    blocks = iter(blocks)
    if (first := next(blocks, None)) is None:
        raise RecordError("there is no block of a record")
    if len({*first.kinds}) > 1:
        raise RecordError("FRFs to a base and to a force at once have no quantity in common; drive them one by one")
    if first.kind not in QUANTITY:
        raise RecordError(f'kind "{first.kind}" of the excitation is unknown; use {", ".join(QUANTITY)}')
    if len(first.kinds) > 1 and estimator != "H1":
        raise RecordError(f'several inputs at once, {", ".join(first.references)}, need estimator "H1"')
    spectra = Welch(first.fs, resolution, overlap, band or first.band, window)
    spectra.push(first)
    for block in blocks:
        spectra.push(block)
    value, coherence = spectra.estimate(ESTIMATORS[estimator])
    below = QUANTITY[first.kind].partition("/")[2]
    return FRF(
        spectra.frequency, value, coherence, first.responses, first.references, QUANTITY[first.kind],
        averages=spectra.independent_averages(), quantities=tuple(f"{name}/{below}" for name in first.quantities),
    )  # fmt: skip
