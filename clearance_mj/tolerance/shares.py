"""How many of a production touch, exceed a limit or may jump, over level and frequency of a harmonic excitation."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import norm

from ..core.errors import ClearanceError
from ..core.kinds import checks_kinds
from ..model import Model
from ..periodic.axes import level_axis
from ..signals import labelled
from ..signals.arrays import ArrayData
from .batches import settings_of, total_of
from .limits import Limit
from .scatter import Scatter, draw_designs

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Production", "production", "share_interval"]

SHARES = ("contact", "from_rest", "exceeding", "several")


@dataclass(frozen=True, eq=False, repr=False)
class Production(ArrayData):
    """What a production does over level and frequency; shares are of the designs whose vibrations are known there."""

    nominal: Model
    """in the middle of the scatter"""
    kind: str
    """ "base", "force" or "unbalance": what the excitation is"""
    limit: Limit | None
    """what must not be exceeded"""
    level: np.ndarray
    """(n_levels,) amplitude of the excitation, m/s² or N, or what the rig's unbalances are multiplied by"""
    frequency: np.ndarray
    """(n_frequencies,) Hz"""
    contact: np.ndarray
    """(n_levels, n_frequencies) share of the designs that can hit a wall: one of their coexisting vibrations does; what
    rests against a wall, such as teeth under a mean torque, hits it from where it leaves it"""
    from_rest: np.ndarray
    """(n_levels, n_frequencies) share of the designs that hit a wall if the level is raised slowly from rest"""
    exceeding: np.ndarray
    """(n_levels, n_frequencies) share of the designs that exceed the limit; 0 without one"""
    several: np.ndarray
    """(n_levels, n_frequencies) share of the designs with more than one vibration: they may jump"""
    unknown: np.ndarray
    """(n_levels, n_frequencies) share of the designs whose vibration was not found"""
    first_contact: np.ndarray
    """(n_designs,) lowest level at which a design can hit a wall at any of the frequencies; infinite if it is not found
    up to somewhat above the largest level"""
    first_from_rest: np.ndarray
    """(n_designs,) lowest level at which it hits a wall if the level is raised slowly from rest"""
    first_exceeding: np.ndarray
    """(n_designs,) lowest level at which it exceeds the limit"""
    largest: np.ndarray
    """(n_designs,) largest value of what is limited, up to the largest level, N, m or m/s²; 0 without a limit"""
    names: tuple[str, ...]
    """paths of the numbers that scatter; none of draws from a posterior"""
    values: np.ndarray
    """(n_designs, n_numbers) their values, SI units"""

    @property
    def designs(self) -> int:
        """How many there are."""
        return self.first_contact.size

    def over_level(self, what: str = "contact") -> np.ndarray:
        """Return the share (n_levels,) of the designs that do so at any of the frequencies.

        Parameters
        ----------
        what : str
            "contact": that can touch; "from_rest": that touch if the level is raised from rest; "exceeding": the limit.
        """
        if what not in SHARES[:3]:
            raise ClearanceError(f"what must be one of {', '.join(SHARES[:3])}, got {what!r}")
        first = np.sort(getattr(self, f"first_{what}"))
        return np.searchsorted(first, self.level, side="right") / self.designs

    def interval(self, share: ArrayLike, confidence: float = 0.95) -> np.ndarray:
        """Return the limits (2, ...) of shares of the designs, see `share_interval`.

        Parameters
        ----------
        share : array_like
            Such as `contact`.
        confidence : float
            Probability that the production's share lies between the limits.
        """
        return share_interval(share, self.designs, confidence)

    @property
    def notes(self) -> list[str]:
        """Plain words on what not to rely on."""
        found = []
        if self.limit and not self.exceeding.any():
            found.append(
                f"{self.limit.words}: no design reaches that up to {self.level[-1]:g} {level_axis(self.kind).unit}; "
                f"the largest is {self.largest.max():.4g} {self.limit.unit}"
            )
        if self.unknown.any():
            found.append(
                f"vibrations were not found in {100 * self.unknown.mean():.2g} % of all cases; shares are of the others"
            )
        return found

    def to_xarray(self) -> xr.Dataset:
        """Return everything with labels and units, over level and frequency or over designs."""
        unit = level_axis(self.kind).symbol
        cells = ("level", "frequency")
        variables: dict[str, Any] = {name: (cells, getattr(self, name), "1") for name in (*SHARES, "unknown")}
        firsts = [f"first_{name}" for name in SHARES[:3]]
        variables |= {name: ("design", getattr(self, name), unit) for name in firsts}
        limited = self.limit.unit if self.limit else "1"
        variables["largest"] = ("design", self.largest, limited.replace("/s²", " s-2"))
        variables["value"] = (("design", "number"), self.values, "SI")
        coordinates = {"level": self.level, "frequency": self.frequency, "number": list(self.names)}
        attributes = {"kind": self.kind, "limit": self.limit.words if self.limit else ""}
        return labelled.dataset("production", variables, coordinates, attributes)


def share_interval(share: ArrayLike, n: int, confidence: float = 0.95) -> np.ndarray:
    """Return the limits (2, ...) within which shares of a production lie of which n designs were drawn.

    Wilson's interval (Journal of the American Statistical Association 22, 1927), for independent draws; Sobol' points
    scatter less, so it holds more often than it says.

    Parameters
    ----------
    share : array_like
        Of the n designs.
    n : int
        Number of designs.
    confidence : float
        Probability that the production's share lies between the limits.
    """
    p, z = np.asarray(share, dtype=float), float(norm.ppf(0.5 + confidence / 2))
    middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * np.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    return np.stack((np.where(p == 0, 0.0, middle - half), np.where(p == 1, 1.0, middle + half)))


@checks_kinds
def production(
    model: Model, scatter: Scatter | str | None, limit: Limit | str | None, levels: ArrayLike, frequencies: ArrayLike,
    n_designs: int = 1000, seed: int = 0, kind: str | None = None, n_harmonics: int | None = None,
    n_samples: int | None = None, n_modes: int = 8, workers: int | None = None, scheduler: str | None = None,
    executor: Executor | None = None, progress: bool = False, kept: Path | None = None,
) -> Production:  # fmt: skip
    """Find how many of a production touch, exceed a limit or may jump, over level and frequency.

    For every design and frequency the vibration that grows out of rest is followed over the level, around folds.

    Parameters
    ----------
    model : Model
        Rig, with a shaft or a small system of `structure.Matrices`, and law, a `ConstantLaw` or a `ContactLaw`.
    scatter : Scatter or str or None
        How the production scatters about the model; "posterior": as the records that the model was identified from
        leave it open; None: by the rig file's own tolerances.
    limit : Limit or str or None
        What must not be exceeded, such as "contact_force > 20 N"; None: only contact counts.
    levels : array_like
        Amplitudes (n_levels,) of the excitation, m/s² or N, increasing; of kind "unbalance" what the rig's unbalances
        are multiplied by.
    frequencies : array_like
        Frequencies (n_frequencies,) of the excitation, Hz, increasing.
    n_designs : int
        Number of designs that are drawn.
    seed : int
        Of the draws.
    kind : str, optional
        Kind of excitation, "base", "force" or, of a rig in space, "unbalance"; None: unbalance of a rig that has some,
        else that of its shaker.
    n_harmonics : int, optional
        Number of harmonics of the motion, H; None: 9, 13 or 21, the fewest that reach 0.7 of the highest natural
        frequency within the range of frequencies; 21 with a limit on an acceleration.
    n_samples : int, optional
        Number of samples of a period, at least 4 H + 1; None: the power of two from 12 H on, and four times as many
        where vibrations end early with them.
    n_modes : int
        Number of modes in the Ritz basis, as in the modal engine.
    workers : int, optional
        Processes on this machine; default: one for each core. 1: none beside this one.
    scheduler : str, optional
        Address of a Dask scheduler, whose cluster then computes the designs.
    executor : concurrent.futures.Executor, optional
        What computes the designs instead; it is left open.
    progress : bool
        Show a progress bar with the time left.
    kept : Path, optional
        Folder, of this call alone, for what is done, so that an interrupted one goes on where it stopped; it is made if
        it is not there.

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

    Notes
    -----
    Processes start by importing the calling script: start a production below ``if __name__ == "__main__"``.
    """
    settings = settings_of(model, levels, frequencies, limit, kind, n_harmonics, n_samples, n_modes)
    designs = draw_designs(model, scatter, n_designs, seed)
    total = total_of(settings, designs, workers, scheduler, executor, "production" if progress else "", kept)
    known, *counts = total.counts
    first_contact, first_from_rest, first_exceeding, largest = total.of_designs
    contact, from_rest, exceeding, several = counts / np.maximum(known, 1)
    return Production(
        model, settings.kind, settings.limit, settings.levels, settings.frequencies, contact, from_rest, exceeding,
        several, 1 - known / len(designs), first_contact, first_from_rest, first_exceeding, largest, designs.names,
        designs.values,
    )  # fmt: skip
