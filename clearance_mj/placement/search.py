"""Search for the layout of sensors that identifies the modes best."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations, islice

import numpy as np

from ..core.errors import ClearanceError
from .layout import Placement, evaluate, losses
from .readings import Candidates

__all__ = ["place_sensors"]

CRITERIA = ("determinant", "trace")
METHODS = ("backward", "forward", "exchange", "exhaustive")
MAX_LAYOUTS = 3_000_000  # number of layouts up to which every one is evaluated
CHUNK = 50_000  # layouts that are evaluated at a time, which bounds the memory
FLOOR = 1e-9  # relative information that is always assumed, so that fewer sensors than modes can be compared
MIN_GAIN = 1e-9  # relative gain below which an exchange is rounding, not progress


def place_sensors(
    candidates: Candidates, n: int, criterion: str = "determinant", method: str = "exchange",
    required: Sequence[int] = (),
) -> Placement:  # fmt: skip
    """Choose the candidates that identify the modes best.

    Parameters
    ----------
    candidates : Candidates
        Positions where sensors may sit.
    n : int
        Number of sensors.
    criterion : {"determinant", "trace"}
        Property of the Fisher information that is maximised.
    method : {"exchange", "backward", "forward", "exhaustive"}
        Delete one after the other from all (effective independence), add one after the other, or, by default, both and
        then exchange single sensors as long as that gains; "exhaustive" tries every layout.
    required : sequence of int
        Indices of candidates that get a sensor in any case.

    Raises
    ------
    ClearanceError
        If there are fewer sensors than modes or fewer candidates than sensors, if the layouts are too many to try, if
        a name is unknown, or if the best layout does not identify every mode.
    """
    required = _check_required(candidates, n, required)
    for what, value, known in (("criterion", criterion, CRITERIA), ("method", method, METHODS)):
        ClearanceError.require_known(what, value, known)
    return evaluate(candidates, getattr(_LayoutSearch(candidates, n, criterion, required), method)())


def _gains(candidates: Candidates, chosen: Sequence[int], others: Sequence[int]) -> np.ndarray:
    """(n_others, n_modes) w of each further candidate: with it the information is Q + w wᵀ.

    A reading adds its residual from the prediction by the others, over the residual's standard deviation.
    """
    cross_noise = candidates.noise[np.ix_(others, chosen)]
    predicted = cross_noise @ candidates._precision(chosen)
    residual_variance = np.diag(candidates.noise)[others] - np.sum(predicted * cross_noise, axis=1)
    return (candidates.shapes[others] - predicted @ candidates.shapes[chosen]) / np.sqrt(residual_variance)[:, None]


def _check_required(candidates: Candidates, n: int, required: Sequence[int]) -> list[int]:
    count, modes = candidates.shapes.shape
    if n < modes:
        raise ClearanceError(f"{n} sensors cannot tell {modes} modes apart; give at least {modes}")
    if n > count:
        raise ClearanceError(f"{n} sensors need as many candidates; there are {count}")
    required = sorted(set(required))
    if len(required) > n or any(not 0 <= i < count for i in required):
        raise ClearanceError(f"required candidates {required}: at most {n}, numbered from 0 to {count - 1}")
    return required


class _LayoutSearch:
    """Layouts of n sensors that hold the required ones, better and better by a criterion."""

    def __init__(self, candidates: Candidates, n: int, criterion: str, required: list[int]) -> None:
        self.candidates, self.n, self.required, self.by_trace = candidates, n, required, criterion == "trace"
        count, modes = candidates.shapes.shape
        self.rest = [i for i in range(count) if i not in required]
        self.faint = FLOOR * (np.trace(candidates.information(range(count))) / modes) * np.eye(modes)

    def value(self, chosen: Sequence[int]) -> float:
        information = self.candidates.information(chosen)
        return np.trace(information) if self.by_trace else np.linalg.slogdet(information + self.faint)[1]

    def change(self, information: np.ndarray, vectors: np.ndarray) -> np.ndarray:
        """Return the importance of vectors v to the information: vᵀ v for the trace, vᵀ Q⁻¹ v for the determinant."""
        if self.by_trace:
            return np.sum(vectors**2, axis=1)
        return np.einsum("si,is->s", vectors, np.linalg.solve(information + self.faint, vectors.T))

    def backward(self) -> list[int]:
        """Delete the sensor that is missed least, until n are left."""
        chosen = [*self.required, *self.rest]
        while len(chosen) > self.n:
            importance = self.change(self.candidates.information(chosen), losses(self.candidates, chosen))
            importance[: len(self.required)] = np.inf
            del chosen[int(np.argmin(importance))]
        return chosen

    def forward(self) -> list[int]:
        """Add the sensor that gains most, until there are n."""
        chosen = list(self.required)
        while len(chosen) < self.n:
            chosen = self._with_one_more(chosen)
        return chosen

    def _with_one_more(self, chosen: list[int]) -> list[int]:
        """Return a layout with the sensor that gains most."""
        others = [i for i in self.rest if i not in chosen]
        gain = self.change(self.candidates.information(chosen), _gains(self.candidates, chosen, others))
        return [*chosen, others[int(np.argmax(gain))]]

    def exchange(self) -> list[int]:
        """Exchange from the layouts of backward and forward; return the better one."""
        return max((self._improve(self.backward()), self._improve(self.forward())), key=self.value)

    def _improve(self, chosen: list[int]) -> list[int]:
        """Make the best exchange of one sensor as long as it gains."""
        while True:
            leaving = [i for i in chosen if i not in self.required]
            trials = [self._with_one_more([i for i in chosen if i != j]) for j in leaving]
            best = max(trials, key=self.value, default=chosen)
            old, new = self.value(chosen), self.value(best)
            if new <= old + MIN_GAIN * (abs(old) if self.by_trace else 1):
                return chosen
            chosen = best

    def exhaustive(self) -> list[int]:
        """Try every layout."""
        more = self.n - len(self.required)
        count = math.comb(len(self.rest), more)
        if count > MAX_LAYOUTS:
            raise ClearanceError(f"{count} layouts are too many to try (at most {MAX_LAYOUTS}); use another method")
        layouts, best, best_layout = combinations(self.rest, more), -np.inf, np.empty(0, dtype=int)
        while block := list(islice(layouts, CHUNK)):
            chosen = np.array([(*self.required, *layout) for layout in block], dtype=int)
            value = self._values(chosen)
            if value.max() > best:
                best, best_layout = value.max(), chosen[np.argmax(value)]
        return best_layout.tolist()

    def _values(self, chosen: np.ndarray) -> np.ndarray:
        """Return the criterion of many layouts (n_layouts, n) at once."""
        rows, noise = self.candidates.shapes[chosen], self.candidates.noise
        if self.candidates._independent:
            weighted = rows / np.diag(noise)[chosen][..., None]
        else:
            weighted = np.linalg.solve(noise[chosen[:, :, None], chosen[:, None, :]], rows)
        information = rows.transpose(0, 2, 1) @ weighted
        return np.trace(information, axis1=1, axis2=2) if self.by_trace else np.linalg.det(information)
