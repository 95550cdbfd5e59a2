"""Belief about tracked parameters, refined window by window, and begun anew after a change."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from ...estimate.beliefs import Belief, Function, Refinement
from .alarms import TRACKED, Alarm
from .changes import Changes, fused, refined

__all__ = ["Label", "SequentialPosterior"]

Label = tuple[int, str]
"""Number of a bushing, and a name in `TRACKED`"""
MAX_MOVE = 2.0  # of a window's standard deviation: one that ends farther off is refined again from a wider belief
SIGNIFICANCE = 4.0  # standard deviations beyond its threshold from which on a change counts
MIN_WINDOWS = 2  # that show a change before it counts, so that its kind is known


class SequentialPosterior:
    """A belief that windows of a record refine, tested for changes.

    Parameters
    ----------
    belief : Belief
        About the coordinates (n,) that are tracked, before the first window.
    labels : sequence of Label
        (n,) bushing and quantity that each belongs to.
    unit : ndarray
        (n,) a relative change of 1 in each coordinate; of an offset it is a gap.
    value : callable
        Value of a label's quantity, SI, at coordinates (n,).
    length, hop : float
        s, of a window, and from one to the next.
    """

    def __init__(
        self, belief: Belief, labels: Sequence[Label], unit: np.ndarray, value: Callable[[Label, np.ndarray], float],
        length: float, hop: float,
    ) -> None:  # fmt: skip
        self.belief, self.value, self.length, self.hop = belief, value, length, hop
        tracked = [TRACKED[quantity] for _, quantity in labels]
        self.walk = unit * np.array([t.walk for t in tracked]) * math.sqrt(hop)
        self.window_std = unit * np.array([t.window_std for t in tracked])
        self.change_std = unit * np.array([t.change_std for t in tracked])
        self.tested = [label for label in dict.fromkeys(labels) if TRACKED[label[1]].threshold is not None]
        self.directions = unit * np.array([[label == tested for label in labels] for tested in self.tested])
        self.thresholds = np.log1p([TRACKED[quantity].threshold or 0.0 for _, quantity in self.tested])
        self.changes = Changes(belief, self.change_std)

    def take(self, residuals: Function, block: int, end: float) -> tuple[Refinement, Alarm | None]:
        """Take a window; return the refinement by it alone, and the alarm of a change that it shows.

        Parameters
        ----------
        residuals : callable
            As `estimate.refine` takes them.
        block : int
            Successive residuals that may be correlated.
        end : float
            s in the record, of the window.
        """
        widened = self.belief.drifted(self.walk)
        refinement, observation = refined(self.belief, residuals, block, self.window_std, self.change_std, MAX_MOVE)
        self.belief = fused(widened, observation, self.changes.add(widened, observation))
        return refinement, self._alarm(end)

    def _alarm(self, end: float) -> Alarm | None:
        """Begin anew with the belief after a significant change, if the windows show one; return its alarm."""
        best, least = self.changes.likeliest(self.directions, self.thresholds), MIN_WINDOWS * self.length / self.hop
        if best is None or best[1] < SIGNIFICANCE or best[0].windows < least:
            return None
        change, label = best[0], self.tested[best[0].kind]
        self.belief = change.after.drifted(self.window_std)  # the window in which it happened holds both
        self.changes = Changes(self.belief, self.change_std)
        if not TRACKED[label[1]].alarm:
            return None
        before, since = self.value(label, change.before), end - (change.windows - 1) * self.hop - self.length
        return Alarm(end, since, *label, before, before * math.exp(change.size))
