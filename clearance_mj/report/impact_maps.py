"""Maps of impacts: figure, rows for CSV, and in words how much of a map has which impacts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from ..periodic import ImpactMap
from ..periodic.impact_maps import IMPACTS
from ..periodic.summaries import unit
from .rattle_maps import of_sweeps
from .style import Drawing

__all__ = ["draw", "rows", "words"]


def draw(found: ImpactMap) -> Drawing:
    """Draw which walls a sweep up in level hits."""
    caption = (
        f"Impacts of rig “{found.model.rig.name}” in sweeps up in level. Line: impacts begin, in a sweep from rest. "
        "What does not hang together with the vibration that grows out of rest is not on the map."
    )
    return Drawing("rattle_map", found.plot(), caption, "Impacts over level and constant loads or frequency.", False)


def rows(found: ImpactMap) -> pd.DataFrame:
    """Return a row per load, level, frequency and direction of a sweep, SI units; empty where none was found."""
    load, swept = of_sweeps(found)
    columns = {
        "load": found.load[load],
        **swept,
        "impacts": np.array([*IMPACTS, ""])[found.impacts.ravel().astype(int)],
        "contact_force_n": found.contact_force.ravel(),
    }
    return pd.DataFrame(columns)


def words(found: ImpactMap) -> Iterator[str]:
    """Say in lines where impacts begin, and the share of the map with each kind of them."""
    least = np.unravel_index(int(found.onset.argmin()), found.onset.shape)
    if np.isfinite(found.onset[least]):
        where = f"{found.frequency[least[1]]:.5g} Hz with loads × {found.load[least[0]]:.3g}"
        yield f"impacts begin first from {found.onset[least]:.4g} {unit(found)} on, at {where}"
    else:
        yield "no impacts"
    for i, name in enumerate(IMPACTS):
        if share := np.mean(found.impacts[0] == i):
            yield f"{name}: {100 * share:.0f} % of the map in sweeps up"
    if found.unknown:
        yield f"no vibration was found in {100 * found.unknown:.3g} % of the map"
