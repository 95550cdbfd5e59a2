"""Uncertainty of coefficients of wear: their tolerances in the rig, as standard deviations and draws."""

from __future__ import annotations

import numpy as np

from ..core.plain_numbers import find_numbers
from ..model import Model
from ..rig import Rig
from ..tolerance.designs import changed
from ..tolerance.scatter import Scatter

__all__ = ["drawn_models", "spreads"]


def spreads(rig: Rig) -> np.ndarray:
    """Return the standard deviations (n_bushings,) of the logarithms of coefficients of wear; infinite if not given.

    Parameters
    ----------
    rig : Rig
        Rig with tolerances.
    """
    std = np.full(len(rig.bushings), np.inf)
    for tolerance in (each for each in rig.tolerances if each.of.rpartition(".")[2] == "wear"):
        for _, j, _ in find_numbers(rig.to_dict(), tolerance.of):
            value = rig.bushings[int(j)].wear or 0.0
            std[int(j)] = np.log1p(tolerance.size if tolerance.relative else tolerance.size / max(value, 1e-300))
    return std


def drawn_models(model: Model, n: int, seed: int) -> list[Model]:
    """Draw models: of the posterior if there is one, with coefficients and, without one, gaps within their tolerances.

    Coefficients are lognormal. Numbers without a tolerance are exact.

    Parameters
    ----------
    model : Model
        Model with a posterior or tolerances.
    n : int
        Number of models.
    seed : int
        Seed of the random numbers.
    """
    drawn = list(model.draw(n, seed)) if model.posterior else [Model(model.rig, model.law)] * n
    fields = ("wear",) if model.posterior else ("wear", "gap")
    if not any(t.size > 0 and t.of.rpartition(".")[2] in fields for t in model.rig.tolerances):
        return drawn
    designs = Scatter.of_rig(model.rig, fields).draw(model, n, seed)
    return [changed(one, designs.keys, values) for one, values in zip(drawn, designs.values.tolist())]
