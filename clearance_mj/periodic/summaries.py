"""Branches, backbones and rattle maps as plain data, and where the vibrations of a branch jump."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from .axes import level_axis, parameter_axis
from .backbones import Backbone
from .branch import Branch
from .impact_maps import IMPACTS, ImpactMap
from .rattle_maps import RattleMap

__all__ = [
    "JumpAtFold", "frequency_title", "is_cut", "jumps", "level_title", "motion", "of_backbone", "of_branch",
    "of_impacts", "of_map", "parameter_title", "stable_points", "unit",
]  # fmt: skip

BESIDE_FOLD = 3
"""Points on either side of a fold, one of which is stable if a vibration ends there: rounding may shift the change."""


@dataclass(frozen=True)
class JumpAtFold:
    """A fold at which a vibration that was stable until then goes over to another one."""

    upwards: bool  #: whether it is met while what changes rises
    at: float  #: frequency of the fold, Hz, or what else the branch is over, as `Branch.parameter`
    clearance: int  #: the one with the largest motion there
    before: float  #: amplitude at it, m
    after: tuple[float, ...]
    """and those of the stable vibrations of the branch at the same place; none: they are elsewhere"""


def unit(found: Branch | ImpactMap | RattleMap) -> str:
    """Return the unit of the excitation's level, as it stands behind a number."""
    return level_axis(found.kind).unit


def level_title(found: Branch | RattleMap) -> str:
    """Return the label of the excitation's level on a report's figure."""
    return level_axis(found.kind).title


def parameter_title(branch: Branch) -> str:
    """Return the label on a report's figure of what changes along a branch."""
    if branch.over == "level":
        return level_title(branch)
    label, _ = parameter_axis(branch.over, branch.kind)
    return label[0].upper() + label[1:]


def frequency_title(found: Branch | RattleMap) -> str:
    """Return the label of the frequency on a report's figure."""
    label = level_axis(found.kind).frequency
    return label[0].upper() + label[1:]


def stable_points(branch: Branch) -> np.ndarray:
    """Return (n,) whether a point is stable: by Floquet's multipliers or, without them, by counting folds.

    At a fold one multiplier passes 1, so that every second part of a branch that begins stable is not.
    """
    if branch.stable is not None:
        return branch.stable
    passed = np.zeros(branch.frequency.size, dtype=int)
    np.add.at(passed, [point.index for point in branch.special if point.kind == "fold"], 1)
    return np.cumsum(passed) % 2 == 0


def is_cut(branch: Branch) -> bool:
    """Whether a branch ends where no next point was found, not where it comes back to its beginning or to another."""
    return branch.ended.startswith("no further")


def jumps(branch: Branch) -> list[JumpAtFold]:
    """Return the folds at which a stable vibration ends, in the order of the curve."""
    x, stable, found = branch.parameter, stable_points(branch), []
    amplitude = branch.amplitude("clearance_displacement")
    folds = [point.index for point in branch.special if point.kind == "fold"]
    for last, i, following in zip([-1, *folds], folds, [*folds[1:], x.size]):
        before = slice(max(last + 1, i - BESIDE_FOLD), i)
        after = slice(i + 1, min(following, i + 1 + BESIDE_FOLD))
        if not (stable[before].any() or stable[after].any()):
            continue
        j = int(np.argmax(amplitude[i]))
        landing = tuple(float(value) for value in _elsewhere(x, amplitude[:, j], stable, i))
        found.append(JumpAtFold(bool(x[i] > x[i - 1]), float(x[i]), j, float(amplitude[i, j]), landing))
    return found


def _elsewhere(x: np.ndarray, amplitude: np.ndarray, stable: np.ndarray, fold: int) -> Iterator[float]:
    """Amplitudes where the branch passes a fold's parameter between two stable points."""
    crossing = (x[:-1] - x[fold]) * (x[1:] - x[fold]) <= 0
    for k in np.flatnonzero(crossing & stable[:-1] & stable[1:]):
        if fold not in (k, k + 1):
            share = (x[fold] - x[k]) / (x[k + 1] - x[k])
            yield float(amplitude[k] + share * (amplitude[k + 1] - amplitude[k]))


def motion(found: Backbone) -> np.ndarray:
    """Return (n,) amplitude of the displacement at the clearance that the mode moves most, m."""
    return np.abs(found.clearance_displacement[:, found.clearance, 1])


def of_branch(branch: Branch) -> dict[str, Any]:
    """Return what a branch is and what is special about it as plain data."""
    x, stable = branch.parameter, stable_points(branch)
    return {
        "over": branch.over,
        "kind": branch.kind,
        "periods": int(branch.periods),
        "harmonics": branch.acceleration.shape[-1] - 1,
        "samples": int(branch.n_samples),
        "modes": int(branch.n_modes),
        "level": None if branch.over in ("level", "speed") else float(abs(branch.level[0, 0])),
        "frequency": None if branch.over in ("frequency", "speed") else float(branch.frequency[0]),
        "from": float(x[0]),
        "to": float(x[-1]),
        "points": int(x.size),
        "unstable": int(np.sum(~stable)),
        "floquet": branch.multipliers is not None,
        "special": [
            {"kind": p.kind, "frequency": float(p.frequency), "level": float(p.level), "at": float(x[p.index]),
             "point": int(p.index)}
            for p in branch.special
        ],
        "jumps": [
            dataclasses.asdict(jump) | {"clearance": branch.clearances[jump.clearance], "after": list(jump.after)}
            for jump in jumps(branch)
        ],
        "ended": branch.ended,
    }  # fmt: skip


def of_backbone(found: Backbone) -> dict[str, Any]:
    """Return a backbone as plain data."""
    return {
        "mode": found.mode,
        "clearance": found.clearances[found.clearance],
        "harmonics": found.acceleration.shape[-1] - 1,
        "amplitude": motion(found).tolist(),
        **{name: getattr(found, name).tolist() for name in ("frequency", "damping", "level")},
        "ended": found.ended,
    }


def of_map(found: RattleMap) -> dict[str, Any]:
    """Return a map's axes, first contact and jumps as plain data."""
    return {
        "kind": found.kind,
        **{name: getattr(found, name).tolist() for name in ("gap", "level", "frequency", "first_contact")},
        "rattles": [float(share) for share in np.mean(found.rattles, axis=(1, 2))],
        "several": [float(share) for share in np.mean(found.vibrations > 1, axis=(1, 2))],
        "jumps": [jump._asdict() for jump in found.jumps],
        "unknown": found.unknown,
        "largest_force": np.nanmax(found.contact_force, axis=(0, 2, 3), initial=0.0).tolist(),
        "largest_depth": np.nanmax(found.penetration, axis=(0, 2, 3), initial=0.0).tolist(),
        "ended": list(found.ended),
    }


def of_impacts(found: ImpactMap) -> dict[str, Any]:
    """Return a map's axes, where impacts begin, and the share of each of `IMPACTS` in sweeps up, as plain data."""
    onset = [[level if np.isfinite(level) else None for level in row] for row in found.onset.tolist()]
    return {
        "kind": found.kind,
        **{name: getattr(found, name).tolist() for name in ("load", "level", "frequency")},
        "onset": onset,
        "impacts": {name: float(np.mean(found.impacts[0] == i)) for i, name in enumerate(IMPACTS)},
        "several": float(np.mean(found.vibrations > 1)),
        "unknown": found.unknown,
        "largest_force": float(np.nanmax(found.contact_force, initial=0.0)),
    }
