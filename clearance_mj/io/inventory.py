"""Inventory of a file: name, place, quantity, size, level and course of each function."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.checks import NOWHERE
from ..core.units import UNITS
from ..rig import Rig
from ..signals.ema import Modes
from ..signals.frf import FRF
from ..signals.response import Response
from ..signals.spectra import Spectra
from ..structure.geometry import Geometry
from .channels import UNKNOWN, Channel
from .contents import FileContents
from .formats import to_channels

__all__ = ["Item", "inventory", "sparkline"]

BLOCKS = "▁▂▃▄▅▆▇█"
COURSE = 24  # characters of a sparkline


@dataclass(frozen=True, eq=False)
class Item:
    """One function, mode or geometry of a file."""

    kind: str  #: such as "time record", "FRF", "auto spectrum", "mode"
    name: str
    place: str  #: degree of freedom, "" if the file does not say it
    quantity: str
    unit: str
    size: int  #: samples, lines, degrees of freedom or nodes
    rate: str  #: in words: samples per second, distance of lines, a natural frequency
    rms: float | None = None  #: in the unit; None where it means nothing
    peak: float | None = None
    course: np.ndarray | None = None  #: values of the sparkline, drawn from the lowest to the highest

    def summary(self) -> dict[str, Any]:
        """Return the item as plain data."""
        plain = {name: value for name, value in vars(self).items() if name != "course"}
        return plain | {"sparkline": sparkline(self.course)}


def inventory(obj: object, rig: Rig | None = None) -> list[Item]:
    """Return the items of an object that was read; none of one with its own overview, such as a rig.

    Parameters
    ----------
    obj : object
        Object that `clearance_mj.read` returned.
    rig : Rig, optional
        Rig that says at which nodes the displacements of a response are.
    """
    if isinstance(obj, FileContents):
        return [item for part in obj.parts.values() for item in inventory(part, rig)]
    if isinstance(obj, Response):
        obj = to_channels(obj, rig)
    if isinstance(obj, list):
        return [_of_channel(channel) for channel in obj]
    items_of = next((items for kind, items in _ITEMS.items() if isinstance(obj, kind)), None)
    return [*items_of(obj)] if items_of else []


def _of_channel(channel: Channel) -> Item:
    value = channel.value
    unit = channel.unit if channel.quantity == UNKNOWN else next(iter(UNITS[channel.quantity]))
    place, rate = channel.label if channel.placed else "", f"{channel.fs:.6g} Hz"
    level = float(np.sqrt(np.mean((value - value.mean()) ** 2)))
    peak = float(np.abs(value).max())
    return Item("time record", channel.name, place, channel.quantity, unit, channel.size, rate, level, peak, value)


def _of_frf(frf: FRF) -> Iterator[Item]:
    spacing = _line_spacing(frf.frequency, "Hz")
    for label, value in zip(frf.labels, frf.functions):
        size = np.abs(value)
        with np.errstate(divide="ignore"):
            course = np.log(size)
        name = label if "/" in label or frf.references == (NOWHERE,) else f"{label}/{frf.reference}"
        largest = float(np.nanmax(size, initial=0.0))
        yield Item("FRF", name, label, frf.quantity, frf.unit, value.size, spacing, None, largest, course)


def _of_spectra(spectra: Spectra) -> Iterator[Item]:
    spacing = _line_spacing(spectra.abscissa, spectra.axis_unit)
    rows = zip(spectra.names, spectra.labels, spectra.responses, spectra.quantities, spectra.units, spectra.value)
    for name, label, response, quantity, unit, value in rows:
        size = np.abs(value)
        with np.errstate(divide="ignore"):
            course = value.real if spectra.axis == "time" or spectra.kind.endswith("coherence") else np.log(size)
        place = "" if response == NOWHERE else label
        yield Item(spectra.kind, name, place, quantity, unit, value.size, spacing, None, float(size.max()), course)


def _of_modes(modes: Modes) -> Iterator[Item]:
    for i, (frequency, damping, shape) in enumerate(zip(modes.frequency, modes.damping, modes.shape.T), 1):
        words, largest = f"{frequency:.5g} Hz, {100 * damping:.3g} %", float(np.abs(shape).max())
        yield Item("mode", f"mode {i}", "", "shape", "", shape.size, words, None, largest, shape.real)


def _of_geometry(geometry: Geometry) -> Iterator[Item]:
    counts = {"lines": geometry.lines, "elements": geometry.elements, "coordinate systems": geometry.systems}
    words = ", ".join(f"{len(parts)} {name}" for name, parts in counts.items() if parts)
    yield Item("geometry", "nodes", "", "position", "m", len(geometry.numbers), words)


_ITEMS: dict[type, Callable[[Any], Iterator[Item]]] = {
    FRF: _of_frf, Spectra: _of_spectra, Modes: _of_modes, Geometry: _of_geometry,
}  # fmt: skip


def _line_spacing(values: np.ndarray, unit: str) -> str:
    """Return the spacing of lines, in words."""
    steps = np.diff(values)
    if not steps.size:
        return "one line"
    is_even = np.ptp(steps) <= 1e-4 * np.abs(steps).max()
    return f"{'' if is_even else 'uneven, '}{steps.mean():.5g} {unit}".strip()


def sparkline(course: np.ndarray | None) -> str:
    """Return the course of numbers in a few characters: the largest of each stretch, between least and largest of all.

    Parameters
    ----------
    course : ndarray, shape (n,), or None
        Numbers; those that are not finite are left out.
    """
    if course is None or not (finite := course[np.isfinite(course)]).size:
        return ""
    low, high = float(finite.min()), float(finite.max())
    largest = [part.max() for part in np.array_split(finite, min(COURSE, finite.size))]
    span = high - low
    if not 0 < span < np.inf:
        return BLOCKS[0] * len(largest)
    return "".join(BLOCKS[min(int((value - low) / span * len(BLOCKS)), len(BLOCKS) - 1)] for value in largest)
