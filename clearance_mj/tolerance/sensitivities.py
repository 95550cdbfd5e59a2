"""Which scattering number the spread of a production comes from: Sobol indices of the levels at which it rattles.

First order: the share of the variance that fixing a number alone would take away on average; total: the share that is
left if all others are fixed. Numbers that are correlated with each other have their indices together, as a group.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..core.errors import ClearanceError
from ..core.kinds import checks_kinds
from ..core.runner import ALL_CORES, Runner
from ..model import Model
from ..periodic.axes import level_axis
from ..statistics.sobol import Sensitivity, require_power_of_two, saltelli_points, sobol_indices
from .limits import Limit
from .rattling import CONTACT, EXCEEDING, LARGEST, Rattling
from .scatter import Scatter
from .scattered import Correlation
from .sines import Sines, settings_of, total_of

__all__ = ["rattle_sensitivity"]

FIRST = "level of first contact (dB)"


@checks_kinds
def rattle_sensitivity(
    model: Model, scatter: Scatter | None, sines: Sines, n_base: int = 128, seed: int = 0, runner: Runner = ALL_CORES
) -> Sensitivity:
    """Find Sobol indices of the lowest level that touches, of that which exceeds a limit, and of what is limited.

    Parameters
    ----------
    model : Model
        As `production` takes it.
    scatter : Scatter or None
        How the production scatters; None: by the rig file's own tolerances.
    sines : Sines
        Of the largest level, what must not be exceeded up to there, and frequencies.
    n_base : int
        A power of 2; so many times (numbers + 2) designs are computed.
    seed : int
        Of scrambled Sobol' points.
    runner : Runner
        As `production` takes it.

    Returns
    -------
    Sensitivity
        Levels in dB; with the largest value of what is limited, up to the level, in its unit.

    Raises
    ------
    ClearanceError
        If n_base is no power of 2, or designs do not touch or reach the limit up to the level.
    """
    if n_base < 2:
        raise ClearanceError(f"n_base must be 2 or more, got {n_base}")
    require_power_of_two("n_base", n_base)
    scatter = scatter or Scatter.of_rig(model.rig)
    rule = scatter.rule(model)
    groups = _groups(rule.names, scatter.correlations)
    settings = settings_of(model, sines)
    settings = replace(settings, levels=settings.levels[-1:])
    designs = rule.designs(saltelli_points(groups, n_base, seed))
    found = total_of("sensitivities", settings, designs, runner)
    results = _results(found, settings.limit, f"{settings.levels[0]:g} {level_axis(settings.kind).unit}")
    named = tuple(", ".join(rule.names[i] for i in group) for group in groups)
    indices = sobol_indices(np.stack(list(results.values()), axis=1), len(groups), seed)
    return Sensitivity(tuple(results), named, *indices)


def _groups(names: Sequence[str], correlations: Sequence[Correlation]) -> list[list[int]]:
    """Numbers that hang together by correlations."""
    group = list(range(len(names)))
    for pair in correlations:
        i, j = (group[names.index(name)] for name in pair.of)
        group = [min(i, j) if each in (i, j) else each for each in group]
    return [[i for i, each in enumerate(group) if each == first] for first in sorted({*group})]


def _results(found: Rattling, limit: Limit | None, level: str) -> dict[str, np.ndarray]:
    results = {FIRST: found.of_designs[CONTACT]}
    if limit:
        results[f"level at {limit.words} (dB)"] = found.of_designs[EXCEEDING]
    levels = {}
    for name, values in results.items():
        if silent := int(np.sum(~np.isfinite(values))):
            if name == FIRST or silent == values.size:
                raise ClearanceError(
                    f"{name}: {silent} of {values.size} designs do not come to it up to {level}; give a higher "
                    "level" + ("" if name == FIRST else " or a lower limit")
                )
            continue
        levels[name] = 20 * np.log10(values)
    if limit:
        levels[f"largest {limit.quantity.replace('_', ' ')} ({limit.unit})"] = found.of_designs[LARGEST]
    return {name: values for name, values in levels.items() if np.ptp(values) > 0}
