"""Lives of clearances: figure, rows for CSV and plain data of a prediction."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..wear import Life, Lives, Remaining
from .style import Drawing

__all__ = ["draw", "rows", "summary"]

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


def draw(prediction: Life | Lives | Remaining) -> Drawing:
    """Draw gaps over hours: a life, a life with the band of its draws, or a history with what is left."""
    name = _nominal(prediction).model.rig.name
    if isinstance(prediction, Remaining):
        caption = (
            f"Gaps of rig “{name}” as its history has them, and when they reach their limits: median and 90 % interval "
            "of Archard's law with the vibration at each gap, its coefficient walking at random."
        )
    else:
        band = " Bands: 90 % of the drawn machines." if isinstance(prediction, Lives) else ""
        caption = (
            f"Gaps of rig “{name}” over hours in operation, by Archard's law with the vibration at each gap.{band}"
        )
    return Drawing("life", prediction.plot(), caption, "Gaps of the bushings over hours in operation.", False)


def rows(prediction: Life | Lives | Remaining) -> list[dict[str, Any]]:
    """Return a row for each time and bushing, SI units and hours; with draws the band's limits at even times."""
    if not isinstance(prediction, Lives):
        return list(_nominal(prediction).rows())
    low, middle, high = np.quantile(prediction.gap, [0.05, 0.5, 0.95], axis=0)
    nominal = prediction.nominal.gap_at(prediction.hours)
    return [
        {"hours": float(hours), "bushing": j, "gap_m": float(nominal[i, j]), "gap_5_m": float(low[i, j]),
         "gap_50_m": float(middle[i, j]), "gap_95_m": float(high[i, j])}
        for i, hours in enumerate(prediction.hours)
        for j in range(prediction.gap.shape[2])
    ]  # fmt: skip


def summary(prediction: Life | Lives | Remaining) -> dict[str, Any]:
    """Return what was predicted as plain data; infinite hours are null."""
    life = _nominal(prediction)
    result: dict[str, Any] = {
        "operation": life.operation.to_dict(), "limit_m": [_finite(value) for value in life.limit],
        "life_h": _finite(life.life), "ended": life.ended, "hours": float(life.hours[-1]),
        "gap_m": life.gap[-1].tolist(), "jumps": [vars(jump) for jump in life.jumps],
    }  # fmt: skip
    if isinstance(prediction, Lives):
        result["quantiles_h"] = {f"{p:g}": _finite(prediction.quantile(p)) for p in QUANTILES}
        result["draws"] = int(prediction.life.size)
    if isinstance(prediction, Remaining):
        result["remaining"] = [_bushing_summary(prediction, j) for j in prediction.history.known]
        result["machine_h"] = dict(zip(("median", "low_90", "high_90"), map(_finite, prediction.machine())))
    return result


def _nominal(prediction: Life | Lives | Remaining) -> Life:
    if isinstance(prediction, Life):
        return prediction
    return prediction.nominal if isinstance(prediction, Lives) else prediction.life


def _bushing_summary(life: Remaining, j: int) -> dict[str, Any]:
    (low, high), (k_low, k_high) = life.interval(), life.coefficient_interval()
    return {
        "bushing": j, "limit_m": float(life.limit[j]), "median_h": _finite(life.median[j]),
        "low_90_h": _finite(low[j]), "high_90_h": _finite(high[j]),
        "coefficient_m2_per_n": float(np.median(life.coefficient[j])), "coefficient_low_90": float(k_low[j]),
        "coefficient_high_90": float(k_high[j]), "drift": float(life.drift[j]), "misfit": float(life.misfit[j]),
    }  # fmt: skip


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
