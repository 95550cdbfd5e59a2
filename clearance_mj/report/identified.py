"""What an identification found: the table of its parameters, and the figures that its records allow."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property, partial
from typing import Any, TypeVar

import numpy as np
from matplotlib.figure import Figure

from ..clearance.figures import AmplitudeCurve
from ..clearance.law import AmplitudeLaw, ConstantLaw, ContactLaw, TimeLaw
from ..core.errors import RecordError
from ..identify.forces.law_force import law_force
from ..identify.forces.restoring import RestoringForce, restoring_force
from ..identify.laws.contact_over_time import OVERLAP, ContactParameters, contact_parameters
from ..identify.laws.grease import GreaseFit, grease_parameters
from ..identify.methods.ridge import ridge_law
from ..identify.registry import Identified
from ..identify.wavelets.lowest_mode import ridge_band
from ..identify.wavelets.wavelet import scalogram, skeleton
from ..io.dataset import Dataset, Record
from . import identification as draw

__all__ = ["Findings"]

CURVE = 200
"""amplitudes of a law's curve"""

T = TypeVar("T")


class Findings:
    """Parameters and figures of a law that a method identified from the records of a dataset with role "identify"."""

    def __init__(self, dataset: Dataset, found: Identified, method: str):
        self.records, self.rig = dataset.to_identify(), dataset.rig
        self.dataset, self.found, self.method = dataset, found, method

    def parameters(self) -> list[dict]:
        """Name, unit, value and standard deviation of every parameter of the law, infinite where not identifiable.

        A RecordError says if the records do not identify them.
        """
        if fit := self.found.estimates:
            return [row | {"std": float(s)} for row, s in zip(fit.rows(), fit.std)]
        law = self.found.law
        if not isinstance(law, ConstantLaw | AmplitudeLaw) or law.grease is None:
            return []
        rows = [
            _row(f"bushing {j + 1}: grease {p.name}", p.unit, value, std)
            for j, fit in enumerate(self._grease.estimates)
            for p, value, std in zip(fit.parameters, fit.value, fit.std)
        ]
        return rows + self._contact_rows(law) if isinstance(law, ConstantLaw) else rows

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """Names of the figures, and what draws each; it raises a RecordError where the records do not allow it."""
        todo = {}
        for record in self.records:
            todo[f"scalogram_{record.name}"] = partial(self._scalograms, record)
            todo[f"contact_over_time_{record.name}"] = partial(self._contact_over_time, record)
            todo[f"hysteresis_{record.name}"] = partial(self._hysteresis, record)
        return todo | {"contact_over_amplitude": self._contact_over_amplitude}

    @cached_property
    def _forces(self) -> dict[str, RestoringForce | RecordError]:
        """Of every record, or why not."""
        return {record.name: _attempt(restoring_force, record) for record in self.records}

    @cached_property
    def _grease(self) -> GreaseFit:
        return grease_parameters(_found(self._forces))

    @cached_property
    def _contact(self) -> dict[str, ContactParameters | RecordError]:
        """Of every record, or why not."""
        return {name: _attempt(self._contact_of, force) for name, force in self._forces.items()}

    def _contact_of(self, force: RestoringForce | RecordError) -> ContactParameters:
        if isinstance(force, RecordError):
            raise force
        return contact_parameters(force, self._grease.grease)

    def _contact_rows(self, law: ConstantLaw) -> list[dict]:
        """Standard deviations of the windows' weighted means, which the law holds; neighbouring windows overlap."""
        windows = _found(self._contact)
        share, k_std, c_std = (
            np.concatenate([getattr(w, name) for w in windows]) for name in ("contact", "k_std", "c_std")
        )
        share = share * np.isfinite(k_std)
        rows = []
        for name, unit, values, std in (("k", "N/m", law.k, k_std), ("c", "N s/m", law.c, c_std)):
            total = np.sqrt(OVERLAP * np.nansum((share * std) ** 2, axis=0)) / np.maximum(share.sum(axis=0), 1e-30)
            known = np.where(share.sum(axis=0) > 0, total, np.inf)
            rows += [
                _row(f"bushing {j + 1}: contact {name}", unit, v, s) for j, (v, s) in enumerate(zip(values, known))
            ]
        return rows

    def _scalograms(self, record: Record) -> Figure:
        probes = record.response().displacement
        if probes is None:
            raise RecordError("no displacement probe at every bushing")
        planes = [scalogram(signal, record.fs, ridge_band(self.rig)) for signal in probes]
        gaps = [b.gap for b in self.rig.bushings]
        return draw.scalograms(f"{record.name}: lowest mode", planes, [skeleton(p) for p in planes], gaps)

    def _contact_over_time(self, record: Record) -> Figure:
        measured, ridge = self._contact[record.name], _attempt(self._ridge, record)
        if isinstance(measured, RecordError) and isinstance(ridge, RecordError):
            raise measured
        return draw.contact_over_time(
            f"{record.name}: contact over time",
            None if isinstance(measured, RecordError) else measured,
            None if isinstance(ridge, RecordError) else ridge,
        )

    def _ridge(self, record: Record) -> TimeLaw:
        if isinstance(self.found.law, TimeLaw) and record.duration == max(r.duration for r in self.records):
            return self.found.law
        return ridge_law(Dataset(self.rig, (record,)))

    def _contact_over_amplitude(self) -> Figure:
        return draw.contact_over_amplitude(_found(self._contact), self._curves(), [b.gap for b in self.rig.bushings])

    def _curves(self) -> list[AmplitudeCurve]:
        """The law's stiffness and damping over the amplitudes that each bushing reached."""
        law, gaps, forces = self.found.law, np.array([b.gap for b in self.rig.bushings]), _found(self._forces)
        if isinstance(law, TimeLaw):
            return []
        largest = np.max([np.abs(f.displacement[:, f.valid]).max(axis=1) for f in forces], axis=0)
        amplitude = np.linspace(gaps.min(), largest.max(), CURVE + 1)[1:]
        omega = np.mean([np.std(f.velocity, axis=1) / np.std(f.displacement, axis=1) for f in forces], axis=0)
        label = f"{self.method} law{', equivalent in a cycle' if isinstance(law, ContactLaw) else ''}"
        k, c = law.over_amplitude(gaps.tolist(), amplitude, omega)
        reached = amplitude[:, None] <= largest
        return [AmplitudeCurve(label, amplitude, *(np.where(reached, v, np.nan) for v in (k, c)))]

    def _hysteresis(self, record: Record) -> Figure:
        force = self._forces[record.name]
        if isinstance(force, RecordError):
            raise force
        return draw.hysteresis(f"{record.name}: {self.method} law", force, law_force(force, self.found.law))


def _attempt(find: Callable[..., T], *arguments: Any) -> T | RecordError:
    """What is found, or the error that says why not."""
    try:
        return find(*arguments)
    except RecordError as error:
        return error


def _found(attempts: Mapping[str, T | RecordError]) -> list[T]:
    """What was found, if anything; else the first error is raised."""
    found = [result for result in attempts.values() if not isinstance(result, RecordError)]
    if not found:
        raise next(result for result in attempts.values() if isinstance(result, RecordError))
    return found


def _row(name: str, unit: str, value: float, std: float) -> dict[str, Any]:
    return {"name": name, "unit": unit, "value": float(value), "std": float(std)}
