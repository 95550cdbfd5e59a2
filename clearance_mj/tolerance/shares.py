"""Fractions of a production that touch, exceed a limit or may jump, over level and frequency of an excitation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import ClearanceError
from ..core.kinds import checks_kinds
from ..core.runner import ALL_CORES, Runner
from ..engines import static_equilibrium
from ..model import Model
from ..periodic.axes import level_axis
from ..signals import labelled
from ..signals.arrays import ArrayData
from ..statistics.shares import share_interval
from .limits import Limit
from .scatter import Scatter, draw_designs
from .sines import Sines, settings_of, total_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Production", "production"]

SHARES = ("contact", "from_rest", "exceeding", "several")


@dataclass(frozen=True, eq=False, repr=False)
class Production(ArrayData):
    """Fractions of a production over level and frequency, each of the designs whose vibrations are known there."""

    nominal: Model
    """model in the middle of the scatter"""
    kind: str
    """excitation: "base", "force" or "unbalance\""""
    limit: Limit | None
    """limit of the designs"""
    level: np.ndarray
    """(n_levels,) amplitude of the excitation, m/s² or N, or factor of the rig's unbalances"""
    frequency: np.ndarray
    """(n_frequencies,) Hz"""
    contact: np.ndarray
    """(n_levels, n_frequencies) fraction of the designs that can hit a wall: one of their coexisting vibrations does;
    an end that rests against a wall, such as teeth under a mean torque, hits it once it leaves it"""
    from_rest: np.ndarray
    """(n_levels, n_frequencies) fraction of the designs that hit a wall if the level is raised slowly from rest"""
    exceeding: np.ndarray
    """(n_levels, n_frequencies) fraction of the designs that exceed the limit; 0 without one"""
    several: np.ndarray
    """(n_levels, n_frequencies) fraction of the designs with more than one vibration: they may jump"""
    unknown: np.ndarray
    """(n_levels, n_frequencies) fraction of the designs whose vibration is not known"""
    first_contact: np.ndarray
    """(n_designs,) lowest level at which a design can hit a wall at any of the frequencies; infinite if it does
    not up to somewhat above the largest level"""
    first_from_rest: np.ndarray
    """(n_designs,) lowest level at which it hits a wall if the level is raised slowly from rest"""
    first_exceeding: np.ndarray
    """(n_designs,) lowest level at which it exceeds the limit"""
    largest: np.ndarray
    """(n_designs,) largest value of the limited quantity, up to the largest level, N, m or m/s²; 0 without a limit"""
    names: tuple[str, ...]
    """paths of the numbers that scatter; none for draws from a posterior"""
    values: np.ndarray
    """(n_designs, n_numbers) their values, SI units"""

    @property
    def designs(self) -> int:
        """Number of designs."""
        return self.first_contact.size

    def over_level(self, what: str = "contact") -> np.ndarray:
        """Return the fraction (n_levels,) of the designs that do so at any of the frequencies.

        Parameters
        ----------
        what : str
            "contact": that can touch; "from_rest": that touch if the level is raised from rest; "exceeding": the limit.
        """
        if what not in SHARES[:3]:
            raise ClearanceError(f"what must be one of {', '.join(SHARES[:3])}, got {what!r}")
        return np.searchsorted(np.sort(getattr(self, f"first_{what}")), self.level, side="right") / self.designs

    def interval(self, share: ArrayLike, confidence: float = 0.95) -> np.ndarray:
        """Return the confidence limits (2, ...) of fractions of the designs, see `statistics.share_interval`.

        Parameters
        ----------
        share : array_like
            Fractions such as `contact`.
        confidence : float
            Probability that the production's fraction lies between the limits.
        """
        return share_interval(share, self.designs, confidence)

    @property
    def notes(self) -> list[str]:
        """Plain sentences on the base of the fractions, and on their limitations."""
        sentences = []
        if pressed := _pressed_at_rest(self.nominal):
            sentences.append(f"{', '.join(pressed)}: rests against its wall; it touches from where it leaves the wall")
        if self.limit and not self.exceeding.any():
            sentences.append(
                f"{self.limit.words}: no design reaches that up to {self.level[-1]:g} {level_axis(self.kind).unit}; "
                f"the largest is {self.largest.max():.4g} {self.limit.unit}"
            )
        if self.unknown.any():
            sentences.append(
                f"vibrations were not found in {100 * self.unknown.mean():.2g} % of all cases; shares are of the others"
            )
        return sentences

    def to_xarray(self) -> xr.Dataset:
        """Return all quantities with labels and units, over level and frequency or over designs."""
        unit = level_axis(self.kind).symbol
        cells = ("level", "frequency")
        variables: dict[str, Any] = {name: (cells, getattr(self, name), "1") for name in (*SHARES, "unknown")}
        variables |= {f"first_{name}": ("design", getattr(self, f"first_{name}"), unit) for name in SHARES[:3]}
        limited = self.limit.unit if self.limit else "1"
        variables["largest"] = ("design", self.largest, limited.replace("/s²", " s-2"))
        variables["value"] = (("design", "number"), self.values, "SI")
        coordinates = {"level": self.level, "frequency": self.frequency, "number": list(self.names)}
        attributes = {"kind": self.kind, "limit": self.limit.words if self.limit else ""}
        return labelled.dataset("production", variables, coordinates, attributes)


def _pressed_at_rest(model: Model) -> list[str]:
    """Return names of clearances against whose walls weight or loads press the shaft."""
    rig = model.rig
    if not (rig.gravity or rig.loads):
        return []
    try:
        force = static_equilibrium(model).contact_force
    except ClearanceError:  # such as gears whose torques are not in balance
        return []
    return [name for name, rows in zip(rig.clearance_labels, rig.clearance_rows) if force[rows].any()]


@checks_kinds
def production(
    model: Model, scatter: Scatter | str | None, sines: Sines, n_designs: int = 1000, seed: int = 0,
    runner: Runner = ALL_CORES,
) -> Production:  # fmt: skip
    """Estimate the fractions of a production that touch, exceed a limit or may jump, over level and frequency.

    For every design and frequency the vibration that grows out of rest is followed over the level, around folds.

    Parameters
    ----------
    model : Model
        Rig, with a shaft or a small system of `structure.Matrices`, and law, a `ConstantLaw` or a `ContactLaw`.
    scatter : Scatter or str or None
        Scatter of the production about the model; "posterior": by the posterior of the model's identification; None: by
        the rig file's tolerances.
    sines : Sines
        Levels, frequencies and limit.
    n_designs : int
        Number of drawn designs.
    seed : int
        Seed of the draws.
    runner : Runner
        Workers, and folder of finished results.

    Returns
    -------
    Production
        The same for any number of workers.

    Raises
    ------
    ClearanceError
        For impossible scatter, limits, numbers of designs, harmonics, samples, modes or workers.
    ExcitationError
        For impossible levels or frequencies, or a rig without a position for a force.
    LawError
        For a law over time or amplitude, one that does not fit the rig, or a model without a posterior.
    RigError
        If the rig has no clearance, or in the gap moves without stiffness.
    """
    settings = settings_of(model, sines)
    designs = draw_designs(model, scatter, n_designs, seed)
    total = total_of("production", settings, designs, runner)
    known, *counts = total.counts
    fractions = dict(zip(SHARES, counts / np.maximum(known, 1))) | {"unknown": 1 - known / len(designs)}
    firsts = dict(zip(("first_contact", "first_from_rest", "first_exceeding", "largest"), total.of_designs))
    return Production(
        model, settings.kind, settings.limit, settings.levels, settings.frequencies, **fractions, **firsts,
        names=designs.names, values=designs.values,
    )  # fmt: skip
