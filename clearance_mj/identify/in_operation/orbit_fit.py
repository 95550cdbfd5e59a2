"""Clearances identified from orbits: gaps with their intervals, or how wide they are at least."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...clearance.contact import ContactModel
from ...clearance.family import CONTACT_FAMILIES
from ...core.files import to_json, write_text
from ...estimate.estimates import Estimates
from ...model import Model
from ...rig import Rig
from .windows import BandLimits

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["ClearanceInOperation", "OrbitFit"]

NORMAL95 = 1.959963984540054  # standard deviations, half of a 95 % interval
MICRO = 1e6
RPM = 30 / math.pi


@dataclass(frozen=True, eq=False)
class ClearanceInOperation:
    """A clearance as the orbits of its shaft show it."""

    name: str
    """of its bushing, as in `Rig.clearance_labels`"""
    seen: bool
    """True if the records identify the gap: by contact, or by an oil film's forces"""
    touches: bool
    """True if the shaft touches in any record"""
    odds: float
    """logarithm of the likelihood of contact over that of none, as far as laws and rig explain the records"""
    gap: float
    """m, radial; where it is not seen, that of the rig file"""
    gap_std: float
    """standard deviation of its logarithm"""
    rest: tuple[float, float]
    """m, along y and z from the bushing's middle to where the shaft rests standing still"""
    rest_std: tuple[float, float]
    """m"""
    at_least: float
    """m, radius of the smallest circle about the shaft's motion: no gap is narrower"""
    arc: float = 0.0
    """rad of the wall that the shaft touches; from one side alone, gap and middle are hardly told apart"""
    law: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """contact, friction and filling by name, SI, each with the standard deviation of its logarithm"""
    orbit: np.ndarray = field(default_factory=lambda: np.empty((0, 2)), repr=False)
    """(n, 2) motion along y and z from where the shaft rests, m"""
    contact_model: ContactModel | None = None
    """the identified contact; None where the shaft does not touch"""
    deepest: float = 0.0
    """m, how far the shaft goes into its wall"""

    @property
    def contact(self) -> str | None:
        """Name of the identified contact's family; None where the shaft does not touch."""
        return next((f.name for f in CONTACT_FAMILIES.values() if f.holds(self.contact_model)), None)

    @property
    def interval(self) -> tuple[float, float]:
        """Limits of the gap, m, at 95 %; without an upper one where it is not seen."""
        if not self.seen:
            return self.at_least, math.inf
        half = NORMAL95 * self.gap_std
        return self.gap * math.exp(-half), self.gap * math.exp(half)

    @property
    def words(self) -> str:
        """Sentence on what is known of the gap."""
        if not self.seen:
            why = "the shaft touches, but too little of the wall" if self.touches else "the shaft never touches"
            return f"{self.name}: gap not seen, {why}; it is at least {MICRO * self.at_least:.4g} µm"
        low, high = (MICRO * end for end in self.interval)
        by = "contact" if self.touches else "the oil film alone"
        if self.touches and self.arc < math.pi:
            by += f" with {math.degrees(self.arc):.0f}° of the wall, which hardly tells the gap and its middle apart"
        return f"{self.name}: gap {MICRO * self.gap:.4g} µm (95 %: {low:.4g} to {high:.4g} µm), by {by}"

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        low, high = self.interval
        return {
            "bushing": self.name, "seen": self.seen, "touches": self.touches, "odds": self.odds,
            "gap": self.gap if self.seen else None, "low": low, "high": high if math.isfinite(high) else None,
            "at_least": self.at_least, "arc": self.arc, "rest": list(self.rest), "rest_std": list(self.rest_std),
            "contact": self.contact, "deepest": self.deepest,
            "law": {name: {"value": v, "relative_std": s} for name, (v, s) in self.law.items()},
        }  # fmt: skip


@dataclass(frozen=True, eq=False)
class OrbitFit:
    """Clearances and model identified from the orbits of a machine in operation. Made by `orbits`."""

    model: Model
    """identified linear rig, unbalances and, where a gap is seen, gap, place, contact, friction and filling"""
    clearances: tuple[ClearanceInOperation, ...]
    """of each bushing"""
    estimates: Estimates
    """of everything that was fitted: rig, unbalance, run-out, laws"""
    records: tuple[str, ...]
    """names of the records"""
    misfit: float
    """RMS of the residuals, over their expected error"""
    bands: BandLimits
    """of forces and motion"""
    drawn: Rig
    """the rig that was fitted, as it was drawn"""
    warnings: tuple[str, ...] = ()
    """plain words on what not to rely on"""

    @property
    def rig(self) -> Rig:
        """That of the model, whose contacts are linear ones as stiff as those at the deepest penetration."""
        return self.model.rig

    def words(self) -> list[str]:
        """Return a sentence for each clearance on what is known of its gap."""
        return [c.words for c in self.clearances]

    def rows(self) -> list[dict[str, Any]]:
        """Return a row of plain data for each clearance, SI units."""
        return [c.to_dict() for c in self.clearances]

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data, SI units."""
        return {
            "rig": self.rig.name, "records": list(self.records), "misfit": self.misfit, "clearances": self.rows(),
            "parameters": list(self.estimates.rows()), "warnings": list(self.warnings),
        }  # fmt: skip

    def save(self, folder: str | Path) -> None:
        """Write ``rig.toml``, ``law.json`` and ``orbits.json``.

        Parameters
        ----------
        folder : str or Path
            Folder that is written to.
        """
        self.model.save(folder)
        write_text(Path(folder) / "orbits.json", to_json(self.to_dict()))

    def plot(self) -> Figure:
        """Draw the orbits of each clearance with the identified wall and its 95 % band."""
        from matplotlib.figure import Figure

        n = len(self.clearances)
        figure = Figure(figsize=(4.2 * n, 4.2), layout="constrained")
        around = np.linspace(0, 2 * np.pi, 361)
        circle = np.array([np.cos(around), np.sin(around)])
        for axes, clearance in zip(figure.subplots(1, n, squeeze=False)[0], self.clearances):
            y, z = MICRO * (clearance.orbit + np.array(clearance.rest)).T
            axes.plot(y, z, lw=0.3, color="tab:blue", label="orbits")
            ends = clearance.interval if clearance.seen else (clearance.at_least,)
            if clearance.seen:
                axes.plot(*(MICRO * clearance.gap * circle), color="black", lw=1.0, label="wall")
            for i, end in enumerate(ends):
                label = None if i else "95 %" if clearance.seen else "at least so wide"
                axes.plot(*(MICRO * end * circle), color="tab:red", lw=0.7, ls="--", label=label)
            axes.set(aspect="equal", xlabel="y (µm)", ylabel="z (µm)", title=clearance.name)
            axes.legend(loc="upper right", fontsize="small")
        return figure
