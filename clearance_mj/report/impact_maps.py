"""Maps of impacts: figure, rows for CSV, and in words how much of a map has which impacts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from ..periodic import ImpactMap
from ..periodic.impact_maps import IMPACTS
from ..periodic.summaries import unit
from .rattle_maps import sweep_columns
from .style import Drawing

__all__ = ["draw", "rows", "summary_lines"]


def draw(regions: ImpactMap) -> Drawing:
    """Draw which walls a sweep up in level hits."""
    caption = (
        f"Impacts of rig “{regions.model.rig.name}” in sweeps up in level. Line: impacts begin, in a sweep from rest. "
        "What does not hang together with the vibration that grows out of rest is not on the map."
    )
    return Drawing("rattle_map", regions.plot(), caption, "Impacts over level and constant loads or frequency.", False)


def rows(regions: ImpactMap) -> pd.DataFrame:
    """Return a row per load, level, frequency and direction of a sweep, SI units; empty without a solution."""
    load, swept = sweep_columns(regions)
    impacts = np.array([*IMPACTS, ""])[regions.impacts.ravel().astype(int)]
    columns = {"load": regions.load[load], **swept, "impacts": impacts}
    return pd.DataFrame(columns | {"contact_force_n": regions.contact_force.ravel()})


def summary_lines(regions: ImpactMap) -> Iterator[str]:
    """Yield lines on where impacts begin, and the fraction of the map with each kind of them."""
    least = np.unravel_index(int(regions.onset.argmin()), regions.onset.shape)
    if np.isfinite(regions.onset[least]):
        place = f"{regions.frequency[least[1]]:.5g} Hz with loads × {regions.load[least[0]]:.3g}"
        yield f"impacts begin first from {regions.onset[least]:.4g} {unit(regions)} on, at {place}"
    else:
        yield "no impacts"
    for i, name in enumerate(IMPACTS):
        if fraction := np.mean(regions.impacts[0] == i):
            yield f"{name}: {100 * fraction:.0f} % of the map in sweeps up"
    if regions.unknown:
        yield f"no vibration was found in {100 * regions.unknown:.3g} % of the map"
