"""The path as the servo can follow it: averaged where it requires faster steering.

Along a path of curvature κ(t) the wheels turn at about g dκ/dt, g the angle over the curvature of a steady turn. Where
that exceeds the servo's rate limit, a sliding mode on the exact path saturates, and its feedback with it. A path that
is averaged over a time W, as 1/W ∫ y dt from t - W/2 to t + W/2, lies κ (W v)²/24 inside the curve and requires g |κ(t
+ W/2) - κ(t - W/2)|/W. W grows from two periods, which changes nothing, to all of the preview as the largest rate
nearby grows from a quarter to 60 % of the limit: part of the limit is reserved for feedback.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...core.jit import jit
from .base import Observation, Task
from .design import DesignModel

__all__ = ["FeasiblePath", "PathAhead"]

AVERAGED_FROM, AVERAGED_FULLY = 0.25, 0.6  # of the rate limit, between which the averaged path is blended in


class PathAhead(NamedTuple):
    """The averaged path at a point ahead, relative to the path there."""

    offset: float  # m, left positive
    heading: float  # rad
    curvature: float  # 1/m
    turning: float  # 1/(m s), dκ/dt
    bending: float  # 1/(m s²), d²κ/dt²


class FeasiblePath:
    """The averaged path ahead, for the time when the wheel has responded to the next command."""

    def __init__(self, task: Task, model: DesignModel):
        self._task = task
        previewed = task.preview / task.period
        centre = min(task.lead, previewed - 1)  # the differences need one period more
        self._half = max(int(previewed - centre + 1e-9), 1)
        self._times = (centre + np.arange(-self._half, self._half + 1.0)) * task.period
        self._gain = float(model.steady_turn[4]) / task.largest_rate  # of the wheel angle of a turn

    def ahead(self, seen: Observation) -> PathAhead:
        """Return the averaged path."""
        curvature = self._task.curvature(seen, self._times)
        return PathAhead(*_average_path(curvature, self._half, self._task.period, seen.speed, self._gain).tolist())


@jit
def _average_path(curvature: np.ndarray, half: int, period: float, speed: float, gain: float) -> np.ndarray:
    """Return averages over 2 w periods about the middle of curvatures sampled at ± half periods, gain in s/rad m."""
    n = curvature.size
    slope = np.empty(n)
    slope[0], slope[n - 1] = curvature[1] - curvature[0], curvature[n - 1] - curvature[n - 2]
    slope[1 : n - 1] = (curvature[2:] - curvature[: n - 2]) / 2
    slope /= period
    index = np.arange(n)
    demand = np.max(gain * np.abs(slope) * (1 - np.abs(index - half) / half))  # near points have the largest weight
    blend = min(max((demand - AVERAGED_FROM) / (AVERAGED_FULLY - AVERAGED_FROM), 0.0), 1.0)
    w = 1 + (half - 1) * blend
    heading, offset, area = np.zeros(n), np.zeros(n), np.zeros(n)
    heading[1:] = speed * period / 2 * np.cumsum(curvature[1:] + curvature[:-1])
    heading -= heading[half]
    offset[1:] = speed * period / 2 * np.cumsum(heading[1:] + heading[:-1])
    offset -= offset[half]
    area[1:] = period / 2 * np.cumsum(offset[1:] + offset[:-1])
    bounds, means = np.array([half - w, half + w]), np.empty(5)
    for k, values in enumerate((area, offset / speed, heading / speed, curvature, slope)):
        first, last = np.interp(bounds, index, values)
        means[k] = (last - first) / (2 * w * period)
    return means
