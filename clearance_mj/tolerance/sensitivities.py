"""Sensitivity of a production to its scattering numbers: Sobol indices of the levels at which it rattles.

First order: the fraction of the variance that fixing a number alone removes on average; total: the fraction that
remains if all others are fixed. Correlated numbers have their indices together, as a group.
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
    """Compute Sobol indices of the lowest level of contact, of the lowest beyond a limit, and of the limited quantity.

    Parameters
    ----------
    model : Model
        As in `production`.
    scatter : Scatter or None
        Scatter of the production; None: by the rig file's tolerances.
    sines : Sines
        Largest level, limit up to there, and frequencies.
    n_base : int
        A power of 2; n_base (numbers + 2) designs are computed.
    seed : int
        Seed of scrambled Sobol' points.
    runner : Runner
        As in `production`.

    Returns
    -------
    Sensitivity
        Levels in dB; the largest value of the limited quantity, up to the level, in its unit.

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
    groups = _correlated_groups(rule.names, scatter.correlations)
    settings = settings_of(model, sines)
    settings = replace(settings, levels=settings.levels[-1:])
    rattling = total_of("sensitivities", settings, rule.designs(saltelli_points(groups, n_base, seed)), runner)
    results = _varying_results(rattling, settings.limit, f"{settings.levels[0]:g} {level_axis(settings.kind).unit}")
    labels = tuple(", ".join(rule.names[i] for i in group) for group in groups)
    indices = sobol_indices(np.stack(list(results.values()), axis=1), len(groups), seed)
    return Sensitivity(tuple(results), labels, *indices)


def _correlated_groups(names: Sequence[str], correlations: Sequence[Correlation]) -> list[list[int]]:
    """Return groups of correlated numbers."""
    group = list(range(len(names)))
    for pair in correlations:
        i, j = (group[names.index(name)] for name in pair.of)
        group = [min(i, j) if each in (i, j) else each for each in group]
    return [[i for i, each in enumerate(group) if each == first] for first in sorted({*group})]


def _varying_results(rattling: Rattling, limit: Limit | None, level: str) -> dict[str, np.ndarray]:
    results = {FIRST: rattling.of_designs[CONTACT]}
    if limit:
        results[f"level at {limit.words} (dB)"] = rattling.of_designs[EXCEEDING]
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
        levels[f"largest {limit.quantity.replace('_', ' ')} ({limit.unit})"] = rattling.of_designs[LARGEST]
    return {name: values for name, values in levels.items() if np.ptp(values) > 0}
