"""Plain data of branches, backbones and maps for reports, and jumps at folds."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

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
"""Points on either side of a fold that are searched for a stable one: rounding may shift the change of stability."""


class JumpAtFold(NamedTuple):
    """A fold at which a stable vibration ends and jumps to another one."""

    upwards: bool  #: True if it is met while the parameter rises
    at: float  #: frequency of the fold, Hz, or another `Branch.parameter`
    clearance: int  #: index of the clearance with the largest motion there
    before: float  #: amplitude at the fold, m
    after: tuple[float, ...]
    """amplitudes of the branch's stable vibrations at the same parameter, m; empty: it jumps to another branch"""


def unit(result: Branch | ImpactMap | RattleMap) -> str:
    """Return the unit of the excitation's level, for use behind a number."""
    return level_axis(result.kind).unit


def level_title(result: Branch | RattleMap) -> str:
    """Return the label of the excitation's level on a report's figure."""
    return level_axis(result.kind).title


def parameter_title(branch: Branch) -> str:
    """Return the label of a branch's parameter on a report's figure."""
    if branch.over == "level":
        return level_title(branch)
    label, _ = parameter_axis(branch.over, branch.kind)
    return label[0].upper() + label[1:]


def frequency_title(result: RattleMap) -> str:
    """Return the label of the frequency on a report's figure."""
    label = level_axis(result.kind).frequency
    return label[0].upper() + label[1:]


def stable_points(branch: Branch) -> np.ndarray:
    """Return True (n,) for stable points: by the Floquet multipliers or, without them, by counting folds.

    At a fold one multiplier passes 1, so that every second part of a branch that begins stable is not.
    """
    if branch.stable is not None:
        return branch.stable
    passed = np.zeros(branch.frequency.size, dtype=int)
    np.add.at(passed, [point.index for point in branch.special if point.kind == "fold"], 1)
    return np.cumsum(passed) % 2 == 0


def is_cut(branch: Branch) -> bool:
    """Return True if a branch ends because the continuation failed, not because it returned to a known point."""
    return branch.ended.startswith("no further")


def jumps(branch: Branch) -> list[JumpAtFold]:
    """Return the folds at which a stable vibration ends, in the order of the curve."""
    x, stable, at_folds = branch.parameter, stable_points(branch), []
    amplitude = branch.amplitude("clearance_displacement")
    folds = [point.index for point in branch.special if point.kind == "fold"]
    for last, i, following in zip([-1, *folds], folds, [*folds[1:], x.size]):
        before = slice(max(last + 1, i - BESIDE_FOLD), i)
        after = slice(i + 1, min(following, i + 1 + BESIDE_FOLD))
        if not (stable[before].any() or stable[after].any()):
            continue
        j = int(np.argmax(amplitude[i]))
        landing = tuple(float(value) for value in _landing_amplitudes(x, amplitude[:, j], stable, i))
        at_folds.append(JumpAtFold(bool(x[i] > x[i - 1]), float(x[i]), j, float(amplitude[i, j]), landing))
    return at_folds


def _landing_amplitudes(x: np.ndarray, amplitude: np.ndarray, stable: np.ndarray, fold: int) -> Iterator[float]:
    """Yield amplitudes where the branch passes a fold's parameter between two stable points."""
    crossing = (x[:-1] - x[fold]) * (x[1:] - x[fold]) <= 0
    for k in np.flatnonzero(crossing & stable[:-1] & stable[1:]):
        if fold not in (k, k + 1):
            fraction = (x[fold] - x[k]) / (x[k + 1] - x[k])
            yield float(amplitude[k] + fraction * (amplitude[k + 1] - amplitude[k]))


def motion(backbone: Backbone) -> np.ndarray:
    """Return (n,) amplitude of the displacement at the clearance that the mode moves most, m."""
    return np.abs(backbone.clearance_displacement[:, backbone.clearance, 1])


def of_branch(branch: Branch) -> dict[str, Any]:
    """Return settings, special points and jumps of a branch as plain data."""
    x, stable = branch.parameter, stable_points(branch)
    at_folds = [
        jump._asdict() | {"clearance": branch.clearances[jump.clearance], "after": list(jump.after)}
        for jump in jumps(branch)
    ]
    special = [
        {"kind": p.kind, "frequency": float(p.frequency), "level": float(p.level), "at": float(x[p.index]),
         "point": int(p.index)}
        for p in branch.special
    ]  # fmt: skip
    return {
        "over": branch.over, "kind": branch.kind, "periods": int(branch.periods),
        "harmonics": branch.acceleration.shape[-1] - 1, "samples": int(branch.n_samples), "modes": int(branch.n_modes),
        "level": None if branch.over in ("level", "speed") else float(abs(branch.level[0, 0])),
        "frequency": None if branch.over in ("frequency", "speed") else float(branch.frequency[0]),
        "from": float(x[0]), "to": float(x[-1]), "points": int(x.size), "unstable": int(np.sum(~stable)),
        "floquet": branch.multipliers is not None, "special": special, "jumps": at_folds, "ended": branch.ended,
    }  # fmt: skip


def of_backbone(backbone: Backbone) -> dict[str, Any]:
    """Return a backbone as plain data."""
    return {
        "mode": backbone.mode, "clearance": backbone.clearances[backbone.clearance],
        "harmonics": backbone.acceleration.shape[-1] - 1, "amplitude": motion(backbone).tolist(),
        **{name: getattr(backbone, name).tolist() for name in ("frequency", "damping", "level")},
        "ended": backbone.ended,
    }  # fmt: skip


def of_map(rattle: RattleMap) -> dict[str, Any]:
    """Return a map's axes, first contact and jumps as plain data."""
    return {
        "kind": rattle.kind,
        **{name: getattr(rattle, name).tolist() for name in ("gap", "level", "frequency", "first_contact")},
        "rattles": np.mean(rattle.rattles, axis=(1, 2)).tolist(),
        "several": np.mean(rattle.vibrations > 1, axis=(1, 2)).tolist(),
        "jumps": [jump._asdict() for jump in rattle.jumps],
        "unknown": rattle.unknown,
        "largest_force": np.nanmax(rattle.contact_force, axis=(0, 2, 3), initial=0.0).tolist(),
        "largest_depth": np.nanmax(rattle.penetration, axis=(0, 2, 3), initial=0.0).tolist(),
        "ended": list(rattle.ended),
    }


def of_impacts(impacts: ImpactMap) -> dict[str, Any]:
    """Return a map's axes, onset of impacts, and the fraction of each of `IMPACTS` in sweeps up, as plain data."""
    return {
        "kind": impacts.kind,
        **{name: getattr(impacts, name).tolist() for name in ("load", "level", "frequency")},
        "onset": [[level if np.isfinite(level) else None for level in row] for row in impacts.onset.tolist()],
        "impacts": {name: float(np.mean(impacts.impacts[0] == i)) for i, name in enumerate(IMPACTS)},
        "several": float(np.mean(impacts.vibrations > 1)),
        "unknown": impacts.unknown,
        "largest_force": float(np.nanmax(impacts.contact_force, initial=0.0)),
    }
