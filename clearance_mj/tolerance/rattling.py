"""Rattling of single designs of a production over level and frequency of a harmonic excitation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..core.checks import naming
from ..core.errors import ClearanceError
from ..model import Model
from ..periodic.level_branches import IMPACT, LevelBranch, level_branches
from ..periodic.map_rows import solver_at
from ..periodic.resolution import resolution
from .designs import Designs
from .limits import Limit

__all__ = ["CONTACT", "EXCEEDING", "HARMONICS", "LARGEST", "REACH", "Batch", "Rattling", "Settings", "rattling_of"]

HARMONICS = (9, 13, 21)
"""Of the motion: the fewest that reach the modes; more hardly change fractions, except those of accelerations, which
always have the most"""
REACH = 0.7
CONTACT, FROM_REST, EXCEEDING, LARGEST = range(4)


@dataclass(frozen=True, eq=False)
class Settings:
    """Settings of the computation of all designs."""

    kind: str  #: of the excitation: "base", "force" or "unbalance"
    levels: np.ndarray  #: (n_levels,) m/s², N, or factors of the unbalance
    frequencies: np.ndarray  #: (n_frequencies,) Hz
    limit: Limit | None
    harmonics: int | None  #: of the motion; None: the fewest of `HARMONICS` that reach `reach`, all for accelerations
    samples: int | None  #: of a period; None: those of `periodic.resolution`
    modes: int
    reach: float  #: Hz, frequency covered by harmonics: `REACH` of the highest natural frequency within the range


class Batch(NamedTuple):
    """A batch of designs."""

    first: int  #: number of the first one
    designs: Designs


class Rattling(NamedTuple):
    """Counts and first levels of designs."""

    counts: np.ndarray
    """(5, n_levels, n_frequencies) number of designs with known vibrations; of these the numbers that can hit a wall,
    hit it if the level is raised from rest, exceed the limit, and have more than one vibration, so that they jump"""
    of_designs: np.ndarray
    """(4, n_designs) lowest level at any frequency at which it can hit, hits if the level is raised from rest, and
    exceeds the limit, infinite if none does; the largest value of the limited quantity, up to the largest level, 0
    without a limit: rows `CONTACT`, `FROM_REST`, `EXCEEDING` and `LARGEST`"""


def rattling_of(settings: Settings, batch: Batch) -> Rattling:
    """Compute the designs of a batch.

    Parameters
    ----------
    settings : Settings
        Levels, frequencies and limit.
    batch : Batch
        The designs.

    Raises
    ------
    ClearanceError
        If a design cannot be computed; the message has its number.
    """
    counts = np.zeros((5, settings.levels.size, settings.frequencies.size), dtype=np.int64)
    of_designs = np.empty((4, len(batch.designs)))
    for i in range(len(batch.designs)):
        with naming(f"design {batch.first + i}", ClearanceError):
            result = _compute_design(settings, batch.designs.model(i))
        counts += result.counts
        of_designs[:, i : i + 1] = result.of_designs
    return Rattling(counts, of_designs)


def _compute_design(settings: Settings, model: Model) -> Rattling:
    levels, limit = settings.levels, settings.limit
    branches = branches_of(settings, model)
    crossings = [branch.crossings(levels) for branch in branches]
    vibrations = np.array([count for count, _, _ in crossings]).T
    impact, *limited = np.array([values for _, _, values in crossings]).transpose(1, 2, 0)
    exceeds = limited[0] > limit.value if limit else np.zeros_like(impact, dtype=bool)
    touched = min(branch.first_level(branch.values[0], 0.0) for branch in branches)
    raised = np.array([branch.level_from_rest(branch.values[0]) for branch in branches])
    from_rest = (vibrations > 0) & (levels[:, None] >= raised)
    exceeded = min(branch.first_level(branch.values[1], limit.value) for branch in branches) if limit else np.inf
    counts = np.array([vibrations > 0, impact > 0, from_rest, exceeds, vibrations > 1], dtype=np.int64)
    largest = limited[0].max() if limit else 0.0
    return Rattling(counts, np.array([[touched], [raised.min()], [exceeded], [largest]]))


def branches_of(settings: Settings, model: Model) -> list[LevelBranch]:
    """Return the branches of a design over the level at every frequency; with finer samples where they end early.

    Parameters
    ----------
    settings : Settings
        Levels, frequencies and limit.
    model : Model
        The design.
    """
    needed = harmonics_of(settings)
    branches: dict[int, LevelBranch] = {}
    for harmonics in np.unique(needed).tolist():
        remaining = np.flatnonzero(needed == harmonics).tolist()
        for samples in resolution(harmonics, settings.samples, 1, settings.modes)[1]:
            for i, branch in zip(remaining, _follow_branches(settings, model, remaining, harmonics, samples)):
                if i not in branches or branch.complete or branch.level.max() > branches[i].level.max():
                    branches[i] = branch
            if not (remaining := [i for i in remaining if not branches[i].complete]):
                break
    return [branches[i] for i in range(needed.size)]


def harmonics_of(settings: Settings) -> np.ndarray:
    """Return the number of harmonics of the motion at each frequency, (n_frequencies,).

    Parameters
    ----------
    settings : Settings
        Frequencies, and the frequency that harmonics must reach.
    """
    harmonics = settings.harmonics
    if harmonics is None and settings.limit and settings.limit.quantity == "acceleration":
        harmonics = HARMONICS[-1]
    if harmonics is not None:
        return np.full(settings.frequencies.size, harmonics)
    return np.select([each * settings.frequencies >= settings.reach for each in HARMONICS], HARMONICS, HARMONICS[-1])


def _follow_branches(
    settings: Settings, model: Model, which: list[int], harmonics: int, samples: int
) -> Iterator[LevelBranch]:  # fmt: skip
    limit, omega = settings.limit, 2 * np.pi * settings.frequencies
    solver = solver_at(model, settings.kind, 1.0, float(omega[-1]), harmonics, samples, settings.modes)
    quantities, rows = ((IMPACT, limit.quantity), (None, limit.row(model.rig))) if limit else ((IMPACT,), ())
    followed = solver.system.frequency_ratio * omega[which]
    return level_branches(solver, followed, float(settings.levels[-1]), quantities, rows)
