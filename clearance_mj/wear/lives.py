"""Lives of machines drawn within the uncertainties of one: quantiles over the draws."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..core.errors import ClearanceError
from ..core.kinds import checks_kinds
from ..core.runner import ALL_CORES, Runner
from ..model import Model
from ..signals.arrays import ArrayData
from ..statistics.shares import quantiles
from .coefficients import drawn_models
from .growth import clearances_of
from .life import ACCURACY, LONGEST, Life, gap_limits, predict_life
from .operation import Operation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Lives", "predict_lives"]

GRID = 201  # number of times at which gaps are kept
MAX_DRAWS = 10_000


@dataclass(frozen=True, eq=False, repr=False)
class Lives(ArrayData):
    """Lives over draws of uncertain coefficients of wear, gaps, or a posterior."""

    nominal: Life
    """of the model as it is"""
    life: np.ndarray
    """(n,) h to the first gap that reaches its limit; infinite where none does"""
    hours: np.ndarray
    """(m,) h"""
    gap: np.ndarray
    """(n, m, n_bushings) m; a machine keeps its gaps once its life has ended"""

    def quantile(self, share: float) -> float:
        """Return the hours after which a fraction of the machines has reached a limit; infinite if fewer ever do.

        Parameters
        ----------
        share : float
            Fraction from 0 to 1.
        """
        return float(quantiles(self.life, share))

    def words(self) -> list[str]:
        """Return sentences on the nominal machine, and on the scatter of lives."""
        low, middle, high = (self.quantile(share) for share in (0.05, 0.5, 0.95))
        never = float(np.mean(np.isinf(self.life)))
        line = f"of {self.life.size} drawn machines half last {middle:.4g} h, 90 % from {low:.4g} to {high:.4g} h"
        return [*self.nominal.words(), line + (f"; {100 * never:.3g} % reach no limit" if never else "")]

    def plot(self) -> Figure:
        """Draw gaps over hours with the 90 % band of the draws, limits and jumps."""
        from ..core.drawing import COLOURS, canvas

        figure = canvas(3.4)
        axes = figure.subplots()
        low, high = 1e3 * np.quantile(self.gap, [0.05, 0.95], axis=0)
        for j in range(self.gap.shape[2]):
            axes.fill_between(self.hours, low[:, j], high[:, j], color=COLOURS[j % len(COLOURS)], alpha=0.2, lw=0)
        self.nominal.draw_on(axes)
        return figure


@checks_kinds
def predict_lives(
    model: Model, operation: Operation, limit: float | str | Mapping[str, float | str], n: int = 50, seed: int = 0,
    hours: float = LONGEST, accuracy: float = ACCURACY, runner: Runner = ALL_CORES,
) -> Lives:  # fmt: skip
    """Predict the lives of machines drawn within a model's uncertainties.

    Drawn are coefficients of wear within their tolerances, and the model's posterior or, without one, gaps within
    theirs. Numbers without a tolerance are exact.

    Parameters
    ----------
    model : Model
        Rig with tolerances, and law.
    operation : Operation
        Operation of the machine.
    limit : float, str or mapping
        Gap at which life ends, as for `predict_life`: that of the model holds for all draws.
    n : int
        Number of draws.
    seed : int
        Seed of the draws.
    hours, accuracy : float
        As for `predict_life`.
    runner : Runner
        Workers, and folder in which each finished life is kept, so that an interrupted prediction can resume.

    Returns
    -------
    Lives

    Raises
    ------
    ClearanceError
        As `predict_life`, or for impossible numbers of draws.
    """
    if not 2 <= n <= MAX_DRAWS:
        raise ClearanceError(f"n must be 2 to {MAX_DRAWS} draws, got {n!r}")
    nominal = predict_life(model, operation, limit, hours, accuracy, runner.progress)
    asked = operation, gap_limits(model, limit), hours, accuracy
    results = runner.run("lives", partial(_life, *asked), drawn_models(model, n, seed), partial(_inputs, *asked))
    ends = [float(each["life"]) for each in results]
    grid = np.linspace(0.0, max([float(nominal.hours[-1]), *(end for end in ends if np.isfinite(end))]), GRID)
    gaps = [np.transpose([np.interp(grid, each["hours"], row) for row in each["gap"].T]) for each in results]
    return Lives(nominal, np.array(ends), grid, np.array(gaps))


def _inputs(operation: Operation, limits: np.ndarray, hours: float, accuracy: float, model: Model) -> object:
    return model.content(), operation.to_dict(), limits.tolist(), hours, accuracy


def _life(
    operation: Operation, limits: np.ndarray, hours: float, accuracy: float, model: Model
) -> dict[str, np.ndarray]:
    """Compute life, hours and gaps of one drawn machine."""
    gaps = clearances_of(model.rig)[:, 0]
    if np.any(gaps >= limits):
        return {"life": np.zeros(()), "hours": np.zeros(1), "gap": gaps[None]}
    limit_by_name = {f"bushings[{j}]": float(limit) for j, limit in enumerate(limits) if np.isfinite(limit)}
    life = predict_life(model, operation, limit_by_name, hours, accuracy)
    return {"life": np.array(life.life), "hours": np.array(life.hours), "gap": np.array(life.gap)}
