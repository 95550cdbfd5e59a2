"""How well coefficients of wear and gaps are known: their tolerances in the rig, as spreads and draws."""

from __future__ import annotations

import dataclasses
import re

import numpy as np

from ..model import Model
from ..rig import Rig

__all__ = ["drawn_models", "spreads"]

LEAST_GAP = 0.05  # of the nominal one: a smaller gap is not drawn
_OF = re.compile(r"bushings(?:\[(\d+)\])?\.(wear|gap)")


def spreads(rig: Rig, field: str = "wear") -> np.ndarray:
    """Return the standard deviations (n_bushings,) of the logarithm of a number of the bushings; infinite if untold.

    Parameters
    ----------
    rig : Rig
        With tolerances.
    field : str
        "wear" or "gap".
    """
    found = np.full(len(rig.bushings), np.inf)
    for tolerance in rig.tolerances:
        match = _OF.fullmatch(tolerance.of)
        if not match or match[2] != field:
            continue
        for j in range(len(rig.bushings)) if match[1] is None else [int(match[1])]:
            value = getattr(rig.bushings[j], field) or 0.0
            found[j] = np.log1p(tolerance.size if tolerance.relative else tolerance.size / max(value, 1e-300))
    return found


def drawn_models(model: Model, n: int, seed: int) -> list[Model]:
    """Draw models: of the posterior if there is one, with coefficients and, without one, gaps within their tolerances.

    Coefficients are lognormal, gaps normal. What has no tolerance stays.

    Parameters
    ----------
    model : Model
        What is drawn from.
    n : int
        Number of models.
    seed : int
        Seed of the random numbers.
    """
    rng, count = np.random.default_rng(seed), len(model.rig.bushings)
    drawn = list(model.draw(n, seed)) if model.posterior else [model] * n
    of_wear, of_gap = (np.where(np.isfinite(s), s, 0.0) for s in (spreads(model.rig), spreads(model.rig, "gap")))
    quicker = np.exp(of_wear * rng.standard_normal((n, count)))
    wider = np.maximum(1 + np.expm1(of_gap) * rng.standard_normal((n, count)), LEAST_GAP)
    if model.posterior:
        wider[:] = 1.0
    return [_changed(one, model.rig, q, w) for one, q, w in zip(drawn, quicker, wider)]


def _changed(model: Model, nominal: Rig, quicker: np.ndarray, wider: np.ndarray) -> Model:
    """A model with the nominal coefficients times a factor, and its own gaps times another; offsets go with them."""
    bushings = tuple(
        dataclasses.replace(
            b, wear=None if own.wear is None else own.wear * float(q), worn=own.worn, gap=b.gap * float(w),
            offset=b.offset * float(w), offset_y=b.offset_y * float(w),
        )
        for b, own, q, w in zip(model.rig.bushings, nominal.bushings, quicker, wider)
    )  # fmt: skip
    return Model(model.rig.replace(bushings=bushings), model.law)
