"""The part of its range that a branch misses because it turned back and left the range where it began."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from .axes import parameter_axis
from .branch import Branch

__all__ = ["not_covered", "reached", "turned_back"]

TURNED_BACK = "it turns back"  # begins `Branch.ended` of such a branch
REST = (
    "begin elsewhere or from the other end, take another number of harmonics, or look for isolas "
    "(find_isolas, --isolas)"
)
COVERED = 1e-6  # relative distance at which the range's end counts as reached


def reached(branch: Branch) -> float:
    """Return the parameter up to which a branch leads from its beginning."""
    x = branch.parameter
    back = branch.ended.startswith(("it turns", "it comes"))
    return float(x[np.argmax(np.abs(x - x[0]))] if back else x[-1])


def turned_back(branch: Branch, stop: float) -> Branch:
    """Return a branch whose ``ended`` says so if it left its range through the beginning.

    Parameters
    ----------
    branch : Branch
        Branch as it was continued.
    stop : float
        End of the range that was asked for, in the unit of its `Branch.parameter`.
    """
    if branch.ended or abs(branch.parameter[-1] / stop - 1) < COVERED:
        return branch
    _, unit = parameter_axis(branch.over, branch.kind)
    words = f"{TURNED_BACK} and leaves the range at {branch.parameter[-1]:.6g} {unit}"
    farthest = reached(dataclasses.replace(branch, ended=words))
    words += f", where it began: {farthest:.6g} to {stop:.6g} {unit} is not covered; {REST}"
    return dataclasses.replace(branch, ended=words)


def not_covered(branches: Sequence[Branch]) -> tuple[float, float] | None:
    """Return the range that neither of the branches from its two ends covers, or None if there is none.

    It is one-sided, to infinity or from 0, if there is only the branch from one end.
    """
    if not all(branch.ended for branch in branches):
        return None
    ends = sorted((float(branch.parameter[0]), reached(branch)) for branch in branches)
    low, high = ends[0][1], ends[-1][1]
    if len(ends) == 1:
        return (low, math.inf) if low >= ends[0][0] else (0.0, low)
    return (low, high) if low < high else None
