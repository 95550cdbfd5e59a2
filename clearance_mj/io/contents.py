"""Contents of files that hold several kinds of data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..core.errors import RecordError
from ..core.overview import HasOverview, Overview, few
from ..rig import Rig
from ..signals.ema import Modes
from ..signals.frf import FRF
from ..signals.response import Response
from ..signals.spectra import Spectra
from ..structure.geometry import Geometry
from .channels import Channel

__all__ = ["FileContents", "describe_part", "pick_part"]

_KINDS: dict[str, type] = {
    "channels": list, "response": Response, "frf": FRF, "spectra": Spectra, "modes": Modes, "geometry": Geometry,
    "rig": Rig,
}  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class FileContents(HasOverview):
    """All data of one file; FRFs, spectra or modes of different lines, quantity or nodes are several objects."""

    channels: tuple[Channel, ...] = ()
    """time records"""
    frfs: tuple[FRF, ...] = ()
    spectra: tuple[Spectra, ...] = ()
    mode_sets: tuple[Modes, ...] = ()
    geometry: Geometry | None = None

    @property
    def frf(self) -> FRF:
        """The FRFs; refuses several that do not fit into one."""
        return self.pick("frf")

    @property
    def modes(self) -> Modes:
        """The modes; refuses several sets."""
        return self.pick("modes")

    @property
    def parts(self) -> dict[str, Any]:
        """All parts by the name that `pick` takes: "channels", "frf", "spectra 1", "spectra 2", "geometry" ..."""
        parts: dict[str, Any] = {"channels": [*self.channels]} if self.channels else {}
        for name, objects in (("frf", self.frfs), ("spectra", self.spectra), ("modes", self.mode_sets)):
            numbered = [f"{name} {i}" for i in range(1, len(objects) + 1)] if len(objects) > 1 else [name]
            parts |= dict(zip(numbered, objects))
        return parts | ({} if self.geometry is None else {"geometry": self.geometry})

    @property
    def unplaced(self) -> tuple[str, ...]:
        """Responses of the FRFs and modes whose node the geometry does not have; none without a geometry."""
        if self.geometry is None:
            return ()
        responses = [f.responses for f in self.frfs] + [m.responses for m in self.mode_sets]
        return self.geometry.missing(dict.fromkeys(label for labels in responses for label in labels))

    def pick(self, what: str) -> Any:
        """Return one part of the file.

        Parameters
        ----------
        what : str
            "channels", "frf", "spectra", "modes" or "geometry"; with a number, such as "spectra 2", where there are
            several.

        Raises
        ------
        RecordError
            If there is no such part, or several without a number; the message names those there are.
        """
        parts = self.parts
        if what in parts:
            return parts[what]
        listing = ", ".join(f'"{name}" ({describe_part(part)})' for name, part in parts.items())
        several = [name for name in parts if name.startswith(f"{what} ")]
        raise RecordError(f'holds {"several" if several else "no"} "{what}"; choose one of {listing}')

    def _overview(self) -> Overview:
        parts = self.parts
        rows = [("what", "holds"), *((f'"{name}"', describe_part(part)) for name, part in parts.items())]
        choose = f'cm.read(path, what="{next(iter(parts), "frf")}"), or .pick("{next(iter(parts), "frf")}") of this'
        facts = {"choose": choose, "without a place": few(self.unplaced)}
        return Overview(f"File with {len(parts)} kinds of things", facts, rows)


def describe_part(part: Any) -> str:
    """Return a description of a part of a file, in words."""
    if isinstance(part, list):
        return f"{len(part)} time records: {few([c.name for c in part], 4)}"
    if isinstance(part, FRF):
        size = f"{part.measured.sum()} functions, {part.frequency.size} lines"
        return f"FRFs {part.quantity}, {size}, to {few(part.references, 4)}"
    if isinstance(part, Spectra):
        return f"{part.kind}, {len(part.value)} functions, {part.abscissa.size} lines"
    if isinstance(part, Modes):
        return f"{part.frequency.size} modes at {len(part.responses)} degrees of freedom"
    return f"geometry of {len(part.numbers)} nodes"


def pick_part(obj: Any, what: str) -> Any:
    """Return one kind of a file's data; refuses a kind that it does not hold and names those that it does."""
    if isinstance(obj, FileContents):
        return obj.pick(what)
    name = what.split(" ")[0]
    if name not in _KINDS:
        raise RecordError(f'"{what}" is unknown; use {", ".join(_KINDS)}')
    if not isinstance(obj, _KINDS[name]):
        actual = next((name for name, kind in _KINDS.items() if isinstance(obj, kind)), type(obj).__name__)
        raise RecordError(f'holds no "{what}"; it holds "{actual}"')
    return obj
