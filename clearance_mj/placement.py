"""Sensor placement: which positions tell the modes best, by Fisher information.

Sensors read y = Φ q + e: the modal coordinates q through the mode shapes at the positions, and noise of covariance R,
to which modes that are not wanted add their motion. The Fisher information of a layout S is Q = Φ_Sᵀ R_SS⁻¹ Φ_S; its
inverse is the smallest covariance that an unbiased estimate of q can have. Its determinant falls with the volume of
the ellipsoid of the error, its trace is a sum over modes and cares for no mode in particular.

One sensor less or more changes Q by a matrix of rank one, ±v vᵀ, also where the noise is correlated. The share that a
sensor contributes, E = vᵀ Q⁻¹ v, is what effective independence is built on: without it the determinant is 1 - E of
what it was, so that deleting the least E deletes the sensor that the determinant misses least.

Kammer, Sensor placement for on-orbit modal identification and correlation of large space structures, Journal of
Guidance, Control, and Dynamics 14, 1991; Kammer, Effects of noise on sensor placement for on-orbit modal identification
of large space structures, Journal of Dynamic Systems, Measurement, and Control 114, 1992; exchange: Fedorov, Theory of
Optimal Experiments, 1972.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, islice

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from .beam import ritz_model
from .errors import ClearanceError
from .rig import Rig
from .signals.correlation import mac

__all__ = ["CRITERIA", "METHODS", "Candidates", "Placement", "candidates", "evaluate", "grid", "place_sensors"]

CRITERIA = ("determinant", "trace")
METHODS = ("backward", "forward", "exchange", "exhaustive")
MOST_LAYOUTS = 3_000_000
"""that are tried one by one"""
CHUNK = 50_000
"""layouts at a time"""
FAINT = 1e-9
"""information that is always assumed, relative, so that fewer sensors than modes can be compared"""
SINGULAR = 1e-12
"""inverse condition number below which a layout does not tell every mode"""
BETTER = 1e-9
"""least relative gain of an exchange"""


@dataclass(frozen=True, eq=False)
class Candidates:
    """Positions where sensors may sit, and what each would read.

    Raises
    ------
    ClearanceError
        If the shapes do not fit each other, or the noise is not positive.
    """

    position: np.ndarray
    """(n,) m from the clamp"""
    shapes: np.ndarray
    """(n, n_modes) Φ: reading per unit of each modal coordinate"""
    noise: np.ndarray
    """(n, n) R, covariance of the readings"""

    def __post_init__(self) -> None:
        n = len(self.position)
        if np.ndim(self.shapes) != 2 or len(self.shapes) != n or np.shape(self.noise) != (n, n):
            raise ClearanceError(
                f"candidates need {n} rows of shapes and a covariance ({n}, {n}), got {np.shape(self.shapes)} and "
                f"{np.shape(self.noise)}"
            )
        if not np.isfinite(self.shapes).all() or not np.isfinite(self.noise).all():
            raise ClearanceError("the candidates' shapes and noise must be finite")
        if np.linalg.eigvalsh(self.noise)[0] <= 0:
            raise ClearanceError("the noise of every candidate must be > 0, its covariance positive definite")

    def information(self, chosen: Sequence[int]) -> np.ndarray:
        """Return the Fisher information (n_modes, n_modes) of a layout.

        Parameters
        ----------
        chosen : sequence of int
            Indices of the candidates that get a sensor.
        """
        rows = self.shapes[list(chosen)]
        return rows.T @ self.precision(chosen) @ rows

    def precision(self, chosen: Sequence[int]) -> np.ndarray:
        """Return R_SS⁻¹ (n_sensors, n_sensors) of a layout.

        Parameters
        ----------
        chosen : sequence of int
            Indices of the candidates that get a sensor.
        """
        chosen = list(chosen)
        if self.independent:
            return np.diag(1 / np.diag(self.noise)[chosen])
        return np.linalg.inv(self.noise[np.ix_(chosen, chosen)])

    @cached_property
    def independent(self) -> bool:
        """Whether the noise of no two candidates is correlated."""
        return np.array_equal(self.noise, np.diag(np.diag(self.noise)))


@dataclass(frozen=True, eq=False)
class Placement:
    """A layout of sensors, what each carries and what its loss costs."""

    chosen: tuple[int, ...]
    """indices of the candidates, by position"""
    position: np.ndarray
    """(n_sensors,) m"""
    determinant: float
    """of the Fisher information"""
    trace: float
    """of the Fisher information"""
    condition: float
    """condition number of the Fisher information"""
    mac: np.ndarray
    """(n_modes, n_modes) auto-MAC: how alike the modes look to these sensors"""
    std: np.ndarray
    """(n_modes,) least standard deviation of each modal coordinate"""
    contribution: np.ndarray
    """(n_sensors,) E, 0 to 1; with uncorrelated noise they sum up to the number of modes"""
    std_after_loss: np.ndarray
    """(n_sensors, n_modes) standard deviations without each sensor; infinite where a mode is then not told"""

    @property
    def determinant_after_loss(self) -> np.ndarray:
        """(n_sensors,) share of the determinant that is left without each sensor, 1 - E."""
        return 1 - self.contribution

    @property
    def std_growth(self) -> np.ndarray:
        """(n_sensors, n_modes) standard deviations without each sensor, over those with it."""
        return self.std_after_loss / self.std

    @property
    def worst_mac(self) -> float:
        """Largest MAC of two different modes."""
        return float(np.max(self.mac - np.eye(len(self.mac)), initial=0.0))

    @property
    def table(self) -> pd.DataFrame:
        """A row for each sensor: position, contribution, what its loss costs."""
        columns = {"sensor": np.arange(1, len(self.position) + 1), "position_m": self.position}
        columns |= {"contribution": self.contribution, "determinant_after_loss": self.determinant_after_loss}
        columns |= {f"std_growth_mode_{j}": growth for j, growth in enumerate(self.std_growth.T, 1)}
        return pd.DataFrame(columns)

    def to_dict(self) -> dict:
        """Return the layout as plain data."""
        return {
            "position_m": self.position.tolist(),
            "determinant": self.determinant,
            "trace": self.trace,
            "condition": self.condition,
            "worst_mac": self.worst_mac,
            "std": self.std.tolist(),
            "sensors": self.table.to_dict("records"),
        }


def grid(rig: Rig, count: int) -> np.ndarray:
    """Evenly spaced positions along the part of the shaft that is outside the bushings.

    Parameters
    ----------
    rig : Rig
        The rig.
    count : int
        How many. The clamp is none of them, the last is at the tip or, if a bushing ends there, before it.

    Returns
    -------
    ndarray, shape (count,)
        m, rising.

    Raises
    ------
    ClearanceError
        If the count is not positive.
    """
    if count < 1:
        raise ClearanceError(f"give at least 1 candidate, got {count}")
    outside = rig.beam.length - sum(b.length for b in rig.bushings)
    x = outside * np.arange(1, count + 1) / count
    for bushing in sorted(rig.bushings, key=lambda b: b.position):
        x = np.where(x > bushing.ends[0], x + bushing.length, x)
    return x


def candidates(
    rig: Rig,
    position: ArrayLike,
    modes: Sequence[int] = (1, 2, 3, 4),
    weight: ArrayLike = 1.0,
    noise: ArrayLike = 1.0,
    unwanted: Sequence[int] = (),
) -> Candidates:
    """Describe what sensors on a rig would read.

    Parameters
    ----------
    rig : Rig
        The rig, in its linear state within the gap.
    position : array_like, shape (n,)
        Where a sensor may sit, m.
    modes : sequence of int
        Modes that are wanted, from 1.
    weight : float or array_like, shape (n_modes,)
        Typical size of each modal coordinate's acceleration, sqrt(kg) m/s²; coordinates are counted in this unit. The
        determinant of every layout grows by the same factor, so weights matter to the trace, and to ``unwanted``.
    noise : float or array_like, shape (n,)
        Standard deviation of the reading at each position, m/s².
    unwanted : sequence of int
        Modes that the readings also hold, of coordinates about as large as the largest weight: correlated noise.

    Returns
    -------
    Candidates

    Raises
    ------
    ClearanceError
        If a position is off the shaft or given twice, or a mode, weight or noise is impossible.
    """
    x, wanted, others = np.asarray(position, dtype=float), list(modes), list(unwanted)
    if not x.size or not np.all((x > 0) & (x <= rig.beam.length)) or np.unique(x).size < x.size:
        raise ClearanceError(f"candidate positions must differ and lie on the shaft, 0 < x <= {rig.beam.length:g} m")
    if not wanted or min(wanted + others) < 1 or len({*wanted, *others}) < len(wanted + others):
        raise ClearanceError(f"modes count from 1, each once, wanted or unwanted; got {wanted} and {others}")
    weight, noise = np.asarray(weight, dtype=float), np.asarray(noise, dtype=float)
    for name, values, size in (("weights", weight, len(wanted)), ("noise", noise, x.size)):
        if values.shape not in ((), (size,)) or not np.all((values > 0) & np.isfinite(values)):
            raise ClearanceError(f"{name}: give one number > 0 or {size}, got {values.tolist()}")
    shapes = ritz_model(rig, max(wanted + others) + 16, grease=True).shapes(x)
    disturbing = shapes[:, np.array(others, dtype=int) - 1] * weight.max()
    covariance = np.diag(np.broadcast_to(noise**2, x.size)) + disturbing @ disturbing.T
    return Candidates(x, shapes[:, np.array(wanted) - 1] * weight, covariance)


def place_sensors(
    places: Candidates, n: int, criterion: str = "determinant", method: str = "exchange", required: Sequence[int] = ()
) -> Placement:
    """Choose the candidates that tell the modes best.

    Parameters
    ----------
    places : Candidates
        Where sensors may sit.
    n : int
        Number of sensors.
    criterion : {"determinant", "trace"}
        Of the Fisher information, to be as large as possible.
    method : {"exchange", "backward", "forward", "exhaustive"}
        Delete one after the other from all (effective independence), add one after the other, or, by default, both and
        then exchange single sensors as long as that gains; "exhaustive" tries every layout.
    required : sequence of int
        Indices of candidates that get a sensor in any case.

    Returns
    -------
    Placement

    Raises
    ------
    ClearanceError
        If there are fewer sensors than modes or fewer candidates than sensors, if the layouts are too many to try, if
        a name is unknown, or if no layout found tells every mode.
    """
    required = _required(places, n, required)
    for what, value, known in (("criterion", criterion, CRITERIA), ("method", method, METHODS)):
        if value not in known:
            raise ClearanceError(f'{what} "{value}" is unknown; use {", ".join(known)}')
    search = _Search(places, n, criterion, required)
    chosen = {
        "backward": search.backward,
        "forward": search.forward,
        "exchange": search.best_exchange,
        "exhaustive": search.exhaustive,
    }[method]()
    return evaluate(places, chosen)


def evaluate(places: Candidates, chosen: Sequence[int]) -> Placement:
    """Say how well a layout tells the modes, what each sensor carries and what its loss costs.

    Parameters
    ----------
    places : Candidates
        Where sensors may sit.
    chosen : sequence of int
        Indices of the candidates that have one.

    Returns
    -------
    Placement

    Raises
    ------
    ClearanceError
        If the layout does not tell every mode.
    """
    chosen = sorted(chosen, key=lambda i: places.position[i])
    information = places.information(chosen)
    if not _tells(information):
        raise ClearanceError(
            f"{len(chosen)} sensors at {', '.join(f'{x:.4g}' for x in places.position[chosen])} m do not tell "
            f"{len(information)} modes apart; the trace alone does not see to that, the determinant does"
        )
    deviation = np.sqrt(np.diag(np.linalg.inv(information)))
    vectors = _losses(places, chosen)
    contribution = np.einsum("si,is->s", vectors, np.linalg.solve(information, vectors.T)).clip(0, 1)
    after = [_std(information - np.outer(v, v)) for v in vectors]
    return Placement(
        chosen=tuple(int(i) for i in chosen),
        position=places.position[chosen],
        determinant=float(np.linalg.det(information)),
        trace=float(np.trace(information)),
        condition=float(np.linalg.cond(information)),
        mac=mac(places.shapes[chosen], places.shapes[chosen]),
        std=deviation,
        contribution=contribution,
        std_after_loss=np.array(after),
    )


def _tells(information: np.ndarray) -> bool:
    scale = np.sqrt(np.diag(information))
    return bool(np.all(scale > 0)) and bool(np.linalg.cond(information / np.outer(scale, scale)) < 1 / SINGULAR)


def _std(information: np.ndarray) -> np.ndarray:
    """Standard deviation of every coordinate; infinite where one is not told."""
    if not _tells(information):
        return np.full(len(information), np.inf)
    return np.sqrt(np.diag(np.linalg.inv(information)))


def _losses(places: Candidates, chosen: Sequence[int]) -> np.ndarray:
    """(n_sensors, n_modes) v of each sensor: without it the information is Q - v vᵀ.

    The inverse of a covariance that loses row i loses P e eᵀ P / P_ii (partitioned inverse), P = R_SS⁻¹.
    """
    precision = places.precision(chosen)
    return precision @ places.shapes[chosen] / np.sqrt(np.diag(precision))[:, None]


def _gains(places: Candidates, chosen: Sequence[int], others: Sequence[int]) -> np.ndarray:
    """(n_others, n_modes) w of each further candidate: with it the information is Q + w wᵀ.

    What its reading adds is what the others do not predict of it, over the standard deviation of that.
    """
    across = places.noise[np.ix_(others, chosen)]
    predicted = across @ places.precision(chosen)
    own = np.diag(places.noise)[others] - np.sum(predicted * across, axis=1)
    return (places.shapes[others] - predicted @ places.shapes[chosen]) / np.sqrt(own)[:, None]


def _required(places: Candidates, n: int, required: Sequence[int]) -> list[int]:
    candidates_, modes = places.shapes.shape
    if n < modes:
        raise ClearanceError(f"{n} sensors cannot tell {modes} modes apart; give at least {modes}")
    if n > candidates_:
        raise ClearanceError(f"{n} sensors need as many candidates; there are {candidates_}")
    required = sorted(set(required))
    if len(required) > n or any(not 0 <= i < candidates_ for i in required):
        raise ClearanceError(f"required candidates {required}: at most {n}, numbered from 0 to {candidates_ - 1}")
    return required


class _Search:
    """Layouts of n sensors that hold the required ones, better and better by a criterion."""

    def __init__(self, places: Candidates, n: int, criterion: str, required: list[int]) -> None:
        self.places, self.n, self.required = places, n, required
        self.by_trace = criterion == "trace"
        self.rest = [i for i in range(len(places.position)) if i not in required]
        scale = np.trace(places.information(range(len(places.position)))) / places.shapes.shape[1]
        self.faint = FAINT * scale * np.eye(places.shapes.shape[1])

    def value(self, chosen: Sequence[int]) -> float:
        information = self.places.information(chosen)
        return np.trace(information) if self.by_trace else np.linalg.slogdet(information + self.faint)[1]

    def change(self, information: np.ndarray, vectors: np.ndarray) -> np.ndarray:
        """Importance of each vector v to the information: vᵀ v for the trace, vᵀ Q⁻¹ v for the determinant."""
        if self.by_trace:
            return np.sum(vectors**2, axis=1)
        return np.einsum("si,is->s", vectors, np.linalg.solve(information + self.faint, vectors.T))

    def backward(self) -> list[int]:
        """Delete the sensor that is missed least, until n are left."""
        chosen = [*self.required, *self.rest]
        while len(chosen) > self.n:
            share = self.change(self.places.information(chosen), _losses(self.places, chosen))
            share[: len(self.required)] = np.inf
            del chosen[int(np.argmin(share))]
        return chosen

    def forward(self) -> list[int]:
        """Add the sensor that gains most, until there are n."""
        chosen = list(self.required)
        while len(chosen) < self.n:
            others = [i for i in self.rest if i not in chosen]
            gain = self.change(self.places.information(chosen), _gains(self.places, chosen, others))
            chosen.append(others[int(np.argmax(gain))])
        return chosen

    def best_exchange(self) -> list[int]:
        """Exchange from what backward and forward end with; the better of the two."""
        return max((self.exchange(self.backward()), self.exchange(self.forward())), key=self.value)

    def exchange(self, chosen: list[int]) -> list[int]:
        """Make the best exchange of one sensor as long as it gains."""
        while True:
            trials = [self._exchanged(chosen, i) for i in chosen if i not in self.required]
            best = max(trials, key=self.value, default=chosen)
            old, new = self.value(chosen), self.value(best)
            if new <= old + BETTER * (abs(old) if self.by_trace else 1):
                return chosen
            chosen = best

    def _exchanged(self, chosen: list[int], leaving: int) -> list[int]:
        stay = [i for i in chosen if i != leaving]
        others = [i for i in self.rest if i not in stay]
        gain = self.change(self.places.information(stay), _gains(self.places, stay, others))
        return [*stay, others[int(np.argmax(gain))]]

    def exhaustive(self) -> list[int]:
        """Try every layout."""
        more = self.n - len(self.required)
        count = math.comb(len(self.rest), more)
        if count > MOST_LAYOUTS:
            raise ClearanceError(f"{count} layouts are too many to try (at most {MOST_LAYOUTS}); use another method")
        layouts, best, found = combinations(self.rest, more), -np.inf, np.empty(0, dtype=int)
        while block := list(islice(layouts, CHUNK)):
            chosen = np.hstack(
                (np.tile(np.array(self.required, dtype=int), (len(block), 1)), np.array(block, dtype=int))
            )
            value = self._values(chosen)
            if value.max() > best:
                best, found = value.max(), chosen[np.argmax(value)]
        return found.tolist()

    def _values(self, chosen: np.ndarray) -> np.ndarray:
        """Criterion of many layouts (n_layouts, n) at once."""
        rows = self.places.shapes[chosen]
        noise = self.places.noise
        if self.places.independent:
            weighted = rows / np.diag(noise)[chosen][..., None]
        else:
            weighted = np.linalg.solve(noise[chosen[:, :, None], chosen[:, None, :]], rows)
        information = rows.transpose(0, 2, 1) @ weighted
        return np.trace(information, axis1=1, axis2=2) if self.by_trace else np.linalg.det(information)
