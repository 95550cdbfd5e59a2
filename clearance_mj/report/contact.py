"""What records show of contact, where the rig file is exact: ridges, and stiffness and damping in windows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.figure import Figure

from ..clearance.figures import AmplitudeCurve
from ..clearance.law import ContactLaw, TimeLaw
from ..core.errors import RecordError
from ..identify.forces.restoring import RestoringForce
from ..identify.laws.contact_over_time import ContactParameters, contact_parameters
from ..identify.laws.grease import grease_parameters
from ..identify.methods.ridge import ridge_law
from ..identify.records.lowest_mode import ridge_band
from ..identify.registry import Identified
from ..io.dataset import Dataset, Record
from ..signals.wavelet import scalogram, skeleton
from . import contact_figures as draw
from .style import Drawing

__all__ = ["contact_drawings"]

CURVE = 200  # amplitudes of a law's curve


def contact_drawings(
    found: Identified, records: Sequence[Record], forces: Sequence[RestoringForce]
) -> Iterator[Drawing | str]:
    """Yield figures, and in words what the records do not allow.

    Parameters
    ----------
    found : Identified
        With a law for the rig file's rig.
    records : sequence of Record
        Those that it was identified from.
    forces : sequence of RestoringForce
        Restoring forces of the records that allow them.
    """
    try:
        grease = grease_parameters(forces).grease if forces else ()
    except RecordError as error:
        grease = ()
        yield str(error)
    by_record, windows = {force.name: force for force in forces}, list[ContactParameters]()
    for record in records:
        try:
            caption = f"Record {record.name}: wavelet transform of the motion in every bushing about the lowest mode."
            yield Drawing(f"scalogram_{record.name}", _scalograms(record), caption, caption, sharp=False)
        except RecordError as error:
            yield f"{record.name}, scalogram: {error}"
        measured, words = None, []
        if record.name in by_record and grease:
            try:
                measured = contact_parameters(by_record[record.name], grease)
                windows.append(measured)
            except RecordError as error:
                words.append(str(error))
        try:
            ridge = _ridge(found, record, records)
        except RecordError as error:
            ridge = None
            words.append(str(error))
        if measured is None and ridge is None:
            yield f"{record.name}, contact over time: {'; '.join(words)}"
            continue
        caption = f"Record {record.name}: contact stiffness and damping over time."
        figure = draw.contact_over_time(f"{record.name}: contact over time", measured, ridge)
        yield Drawing(f"contact_over_time_{record.name}", figure, caption, caption)
    if windows:
        figure = draw.contact_over_amplitude(windows, _curves(found, forces), [b.gap for b in found.rig.bushings])
        caption = "Contact stiffness and damping over the amplitude of the motion: of windows, and of the law."
        yield Drawing("contact_over_amplitude", figure, caption, caption)


def _scalograms(record: Record) -> Figure:
    if (probes := record.response().displacement) is None:
        raise RecordError("no displacement probe at every bushing")
    planes = [scalogram(signal, record.fs, ridge_band(record.rig)) for signal in probes]
    gaps = [b.gap for b in record.rig.bushings]
    return draw.scalograms(f"{record.name}: lowest mode", planes, [skeleton(p) for p in planes], gaps)


def _ridge(found: Identified, record: Record, records: Sequence[Record]) -> TimeLaw:
    if isinstance(found.law, TimeLaw) and record.duration == max(r.duration for r in records):
        return found.law
    return ridge_law(Dataset(found.rig, (record,)))


def _curves(found: Identified, forces: Sequence[RestoringForce]) -> list[AmplitudeCurve]:
    """The law's stiffness and damping over the amplitudes that each bushing reached."""
    law, gaps = found.law, np.array([b.gap for b in found.rig.bushings])
    if isinstance(law, TimeLaw):
        return []
    largest = np.max([np.abs(f.displacement[:, f.valid]).max(axis=1) for f in forces], axis=0)
    amplitude = np.linspace(gaps.min(), largest.max(), CURVE + 1)[1:]
    omega = np.mean([np.std(f.velocity, axis=1) / np.std(f.displacement, axis=1) for f in forces], axis=0)
    label = f"law{', equivalent in a cycle' if isinstance(law, ContactLaw) else ''}"
    k, c = law.over_amplitude(gaps.tolist(), amplitude, omega)
    reached = amplitude[:, None] <= largest
    return [AmplitudeCurve(label, amplitude, *(np.where(reached, v, np.nan) for v in (k, c)))]
