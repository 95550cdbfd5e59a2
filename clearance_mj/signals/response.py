"""Responses: time histories of a simulation or a test, with units and provenance."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import RecordError
from ..core.overview import HasOverview, Overview, few, span
from ..core.quantities import QUANTITIES
from . import labelled
from .arrays import ArrayData, rows_of
from .excitation_data import EXCITATION_UNITS, common_kind

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["Response"]

HISTORIES = {
    "channels": ("response", ""), "displacement": ("coordinate", "m"), "contact_force": ("coordinate", "N"),
    "grease_force": ("coordinate", "N"),
}  # fmt: skip
"""Dimension other than time, and unit"""
ACCELERATION = "acceleration"  # also the variable of channels that are nothing else
OLDER = {"coordinate": "bushing"}  # dimension of files of before, where each clearance had one row


@dataclass(frozen=True, eq=False, repr=False)
class Response(HasOverview, ArrayData):
    """Time histories of one run, sampled at ``fs``; time is the last axis.

    Simulations fill every field; a test record has no forces, and no displacement where no probe was fitted.

    Raises
    ------
    RecordError
        If the histories differ in length.
    """

    fs: float
    """samples per second"""
    excitation: np.ndarray
    """(n_t,) base acceleration in m/s² or shaker force in N, see ``kind``; of several inputs (n_inputs, n_t)"""
    channels: np.ndarray
    """(n_sensors, n_t) readings of the sensors, each in the SI unit of its quantity, such as m/s²"""
    displacement: np.ndarray | None = None
    """(n_rows, n_t) relative to the bushing, m: a row of each slot or stop, y and z of each round clearance"""
    contact_force: np.ndarray | None = None
    """(n_rows, n_t) force of the bushing on the shaft's motion, positive against positive displacement, N"""
    grease_force: np.ndarray | None = None
    """(n_rows, n_t) same sign, N"""
    kind: str = "base"
    """"base" or "force": kind of the excitation; "mixed" of inputs of both kinds"""
    band: tuple[float, float] | None = None
    """Hz, band of the excitation where known"""
    responses: tuple[str, ...] = ()
    """degree of freedom of each row of the channels, such as "3:+Z" """
    reference: str = "100:+Z"
    """degree of freedom of the excitation; of several inputs the first one's"""
    provenance: dict[str, Any] = field(default_factory=dict)
    """inputs that made it: rig, law, engine, excitation, seed, versions; plain data"""
    contact_share: np.ndarray | None = None
    """(n_bushings,) fraction of the time in contact: of the simulation's steps at which an end of the bushing lies
    beyond its gap, before the anti-alias filter, which rings into the gap; None where that was not counted"""
    spin: np.ndarray | None = None
    """(n_t,) rad/s, of a shaft that turns"""
    quantities: tuple[str, ...] = ()
    """quantity of each row of the channels; all are "acceleration" if left out"""
    references: tuple[str, ...] = ()
    """degree of freedom of each of several inputs"""
    kinds: tuple[str, ...] = ()
    """kind of each of several inputs"""
    coordinates: tuple[str, ...] = ()
    """degree of freedom of each row of displacement and forces, such as "6:+Z", see `Rig.probe_labels`"""

    def __post_init__(self) -> None:
        super().__post_init__()
        quantities = tuple(self.quantities) or (ACCELERATION,) * len(self.channels)
        if len(quantities) != len(self.channels) or not {*quantities} <= QUANTITIES.keys():
            raise RecordError(f"{len(self.channels)} channels need as many quantities of {', '.join(QUANTITIES)}")
        self._set(quantities=quantities)
        if self.excitation.ndim == 1:
            self._set(references=(self.reference,), kinds=(self.kind,))
        elif not len(self.references) == len(self.kinds) == len(self.excitation):
            raise RecordError(
                f"an excitation of {len(self.excitation)} inputs needs as many references and kinds, got "
                f"{len(self.references)} and {len(self.kinds)}"
            )
        else:
            self._set(reference=self.references[0], kind=common_kind(self.kinds))
        for name in ("excitation", *HISTORIES):
            if np.iscomplexobj(getattr(self, name)):
                raise RecordError(f"{name} must be real numbers over time, got complex ones; an FRF holds these")
        for name, (rows, _) in HISTORIES.items():
            value = getattr(self, name)
            if value is not None and (value.ndim != 2 or value.shape[1:] != self.excitation.shape[-1:]):
                raise RecordError(
                    f"{name} must be (n_{rows}s, n_t) with n_t samples of excitation, got {value.shape} and "
                    f"{self.excitation.shape}"
                )

    @functools.cached_property
    def acceleration(self) -> np.ndarray:
        """(n_accelerometers, n_t) the rows of the channels that are accelerations."""
        return self._of(ACCELERATION)

    @property
    def inputs(self) -> np.ndarray:
        """(n_inputs, n_t) the excitation of one input or several."""
        return np.atleast_2d(self.excitation)

    @property
    def only_input(self) -> np.ndarray:
        """(n_t,) the excitation of one input; refuses several."""
        if self.excitation.ndim > 1:
            raise RecordError(f"the record has several inputs, {', '.join(self.references)}; needs one")
        return self.excitation

    @property
    def time(self) -> np.ndarray:
        """(n_t,) s"""
        return np.arange(self.excitation.shape[-1]) / self.fs

    @property
    def duration(self) -> float:
        """Duration, s."""
        return self.excitation.shape[-1] / self.fs

    def at(self, responses: Sequence[str]) -> Response:
        """Return the response at some of the sensors alone.

        Parameters
        ----------
        responses : sequence of str
            Their degrees of freedom; where several sensors have one, all of them.
        """
        rows = [i for label in dict.fromkeys(responses) for i, dof in enumerate(self.responses) if dof == label]
        if missing := {*responses} - {*self.responses}:
            raise RecordError(f"has no response at {min(missing)}; it has {', '.join(self.responses)}")
        responses, quantities = (tuple(labels[i] for i in rows) for labels in (self.responses, self.quantities))
        return dataclasses.replace(self, channels=self.channels[rows], responses=responses, quantities=quantities)

    @functools.cached_property
    def clearance_rows(self) -> list[slice]:
        """Rows of each clearance in displacement and forces: one, or those along y and z by their labels."""
        n_rows = 0 if self.displacement is None else len(self.displacement)
        count = n_rows if self.contact_share is None else self.contact_share.size
        begins = [*range(0, n_rows, max(n_rows // max(count, 1), 1))]
        if len(begins) != count:  # of both kinds
            two = [(f"{label[:-1]}Y", label) if label.endswith(":+Z") else () for label in self.coordinates]
            begins = [i for i, pair in enumerate(pairwise(("", *self.coordinates))) if pair != two[i]]
        return [slice(*ends) for ends in pairwise([*begins, n_rows])]

    def _overview(self) -> Overview:
        band, words = self.band, {"base": ("base acceleration", "m/s²"), "force": ("force", "N")}
        inputs = zip([words.get(kind, words["force"]) for kind in self.kinds], self.references, self.inputs)
        driven = [f"{noun} at {dof}, {np.std(value):.4g} {unit} RMS" for (noun, unit), dof, value in inputs]
        facts = {
            "excitation": "; ".join(driven) + (f", {band[0]:g} to {band[1]:g} Hz" if band else ""),
            "responses": few(self.responses),
            **{name: _largest(self._of(name), *QUANTITIES[name].in_figures) for name in dict.fromkeys(self.quantities)},
            "in clearances": _largest(self.displacement, "mm", 1e3),
            "contact force": _largest(self.contact_force, "N"),
            "in contact": _in_contact(self.contact_share),
            "grease force": _largest(self.grease_force, "N"),
            "spin": "" if self.spin is None else span(self.spin, "rev/min", 30 / np.pi),
            "from": _origin(self.provenance),
        }
        return Overview(f"Response of {len(self.channels)} sensors, {self.duration:g} s at {self.fs:g} Hz", facts)

    def _of(self, quantity: str) -> np.ndarray:
        """Return the rows of the channels of one quantity; the channels themselves where they have no other."""
        rows = [name == quantity for name in self.quantities]
        return self.channels if all(rows) else self.channels[rows]

    def plot(self, sensors: Sequence[int] | None = None, time: tuple[float, float] | None = None) -> Figure:
        """Draw excitation and sensor readings over time; displacement and forces at bushings, and spin, where known.

        Parameters
        ----------
        sensors : sequence of int, optional
            Rows of the channels that are drawn; None: all.
        time : (float, float), optional
            First and last time that are drawn, s; None: all.

        Raises
        ------
        RecordError
            If a row is not there, or no sample in the time.
        """
        from .figures import response_figure

        return response_figure(self, rows_of(self.channels, sensors, RecordError), time or (0.0, self.duration))

    def to_xarray(self) -> xr.Dataset:
        """Return the histories with labels and units, the provenance (plain data) as JSON in an attribute.

        ``excitation`` (time,), of several inputs (input, time), ``acceleration`` (response, time), or ``channels`` with
        the quantity of each where they are not all accelerations, and of ``displacement``, ``contact_force`` and
        ``grease_force`` (coordinate, time), ``contact_share`` (bushing,) and ``spin`` (time,) what the response has.
        """
        if unknown := set(self.kinds) - {"base", "force"}:
            raise RecordError(f'kind "{unknown.pop()}" is unknown; use base or force')
        dims = ("input", "time")[-self.excitation.ndim :]
        variables: dict[str, Any] = {"excitation": (dims, self.excitation, EXCITATION_UNITS[self.kind])}
        variables |= {name: ((rows, "time"), getattr(self, name), units) for name, (rows, units) in HISTORIES.items()}
        if {*self.quantities} == {ACCELERATION}:
            variables[ACCELERATION] = (*variables.pop("channels")[:2], QUANTITIES[ACCELERATION].cf_unit)
        variables["contact_share"] = ("bushing", self.contact_share, "1")
        variables["spin"] = ("time", self.spin, "rad s-1")
        attributes = labelled.driving_attributes(self, "provenance")
        coordinates = {"time": self.time, "response": self.responses, "coordinate": self.coordinates}
        ds = labelled.dataset("response", variables, coordinates, attributes)
        ds["excitation"].attrs["dof"] = " ".join(self.references)
        if "channels" in ds:
            of_rows = {"quantity": ("response", list(self.quantities))}
            of_rows["units"] = ("response", [QUANTITIES[name].cf_unit for name in self.quantities])
            ds = ds.assign_coords(of_rows)
        return ds

    @classmethod
    def from_xarray(cls, ds: xr.Dataset) -> Response:
        """Return the response of a dataset that `to_xarray` made; refuses others.

        Parameters
        ----------
        ds : xarray.Dataset
            The dataset; older ones have time first.
        """
        labelled.require_kind(ds, "response")
        if not {ACCELERATION, "channels"} & {*ds}:
            raise RecordError('holds no "acceleration" and no "channels"')
        excitation = labelled.values(ds, "excitation", *(["input"] if "input" in ds.dims else []), "time")
        provenance = labelled.from_json(ds, "provenance")
        band, kinds = ds.attrs.get("band"), tuple(str(labelled.attribute(ds, "kind")).split())
        references = tuple(str(ds["excitation"].attrs.get("dof", "100:+Z")).split())
        histories = {
            name: labelled.values(ds, name, rows if rows in ds[name].dims else OLDER.get(rows, rows), "time")
            for name, (rows, _) in (HISTORIES | {ACCELERATION: HISTORIES["channels"]}).items()
            if name in ds
        }
        histories["channels"] = histories.pop(ACCELERATION if ACCELERATION in histories else "channels")
        return cls(
            fs=float(labelled.attribute(ds, "fs")), excitation=excitation, kind=common_kind(kinds), kinds=kinds,
            band=None if band is None else (float(band[0]), float(band[1])), provenance=provenance,
            responses=labelled.labels(ds, "response") if "response" in ds.coords else (),
            reference=references[0], references=references,
            contact_share=labelled.values(ds, "contact_share", "bushing") if "contact_share" in ds else None,
            spin=labelled.values(ds, "spin", "time") if "spin" in ds else None,
            quantities=labelled.labels(ds, "quantity") if "quantity" in ds.coords else (),
            coordinates=labelled.labels(ds, "coordinate") if "coordinate" in ds.coords else (), **histories,
        )  # fmt: skip


def _largest(values: np.ndarray | None, unit: str, factor: float = 1.0) -> str:
    if values is None or not values.size:
        return ""
    return f"{len(values)} rows, up to {factor * np.abs(values).max():.4g} {unit}"


def _in_contact(fractions: np.ndarray | None) -> str:
    if fractions is None or not fractions.size:
        return ""
    return f"{few([f'{100 * fraction:.3g} %' for fraction in fractions])} of the time, that is beyond the gap"


def _origin(provenance: dict[str, Any]) -> str:
    """Return the origin of a response in words, from its provenance."""
    words = []
    for name in ("record", "rig", "law", "engine"):
        value = provenance.get(name)
        value = value.get("name", value.get("kind")) if isinstance(value, dict) else value
        words += [f"{name} {value}"] if isinstance(value, str) else []
    return ", ".join(words)
