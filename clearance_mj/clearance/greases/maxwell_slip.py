"""Maxwell-slip hysteresis: parallel springs, each in series with a Coulomb slider.

W. D. Iwan, "A distributed-element model for hysteresis and its steady-state dynamic response", J. Appl. Mech. 33, 1966;
friction that falls with speed: R. Stribeck, Z. VDI 46, 1902, in the form of Bo & Pavelescu, Wear 82, 1982.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from ...core.validation import NotNegative, Number, Positive
from ...rig import Bushing
from ..contact import Numbers
from ..family import EarlierFit, FamilyParameter, FillingFamily, GapForces, positive_parameter, register_family
from ..grease import GreaseModel, Vector, register
from ..lanes import any_below, exponential, whole
from ..vectors import along, answer, length, minus, plus, read, times, within, write
from .bouc_wen import film_damping, spring_and_film, values_of_film

__all__ = ["MaxwellSlip", "SlipFriction", "StribeckFriction", "slip_start"]

ELEMENTS = 4  # of the families
SLIP_RATIO = 3.0  # of the slip displacements of neighbouring elements, at the start
# Samples of Iwan's distribution for the start of a fit:
NARROWEST_SLIP, WIDEST_SLIP = 0.02, 2.0  # slip displacements over the gap
SLIP_SAMPLES = 24
FILM_HEIGHTS = (1.5, 2.0, 2.5, 3.0, 4.0, 6.0, 20.0)  # over the gap
NO_SPRING = 1e-9  # N/m and N, of an absent element
SOFTEST_SPRING = 1e-3  # of the total stiffness: softest spring at the start; 0 has no logarithm


@register
class MaxwellSlip(GreaseModel):
    """Σ kᵢ zᵢ + k x + c ẋ / max(1 - |x|/h, ε)²: each zᵢ follows the motion while kᵢ zᵢ stays within ±Wᵢ s(ẋ).

    s = 1, or with a Stribeck speed 1 + (r - 1) exp(-(ẋ/v)²): friction is larger at low speed.
    """

    name: ClassVar[str] = "maxwell-slip"
    springs: Annotated[tuple[Positive, ...], Field(min_length=1)]
    """kᵢ, N/m"""
    forces: tuple[Positive, ...]
    """Wᵢ at which they slide, N"""
    elastic: NotNegative = 0.0
    """k that does not slide, N/m"""
    damping: NotNegative = 0.0
    """c of the centred shaft, N s/m"""
    film_height: Positive | None = None
    """h, m: film thickness at which the squeeze film would close; None: damping does not grow"""
    film_limit: Annotated[Positive, Field(le=1)] = 0.2
    """ε, smallest relative film thickness"""
    static_ratio: Annotated[Number, Field(ge=1)] = 1.0
    """r, force at which a spring begins to slide, over Wᵢ"""
    stribeck_speed: Positive | None = None
    """v, m/s, at which the excess over Wᵢ has fallen by 63 %; None: independent of speed"""

    def __post_init__(self) -> None:
        if len(self.forces) != len(self.springs):
            raise ValueError(f"forces must be {len(self.springs)} numbers, one for each spring, got {len(self.forces)}")
        if self.static_ratio > 1 and self.stribeck_speed is None:
            raise ValueError("stribeck_speed is missing; static_ratio > 1 needs a speed over which the force falls")

    def small_motion(self) -> tuple[float, float]:
        """Return stiffness and damping before any slip."""
        return self.elastic + sum(self.springs), self.damping

    def states(self, coordinates: int) -> int:
        """One deflection for each spring, m."""
        return coordinates * len(self.springs)

    def parameters(self) -> tuple[float, ...]:
        """N, k, c, 1/h (0 without film), ε, r - 1, 1/v, the springs, the forces."""
        film = 1 / self.film_height if self.film_height else 0.0, self.film_limit
        stribeck = self.static_ratio - 1, 1 / self.stribeck_speed if self.stribeck_speed else 0.0
        return len(self.springs), self.elastic, self.damping, *film, *stribeck, *self.springs, *self.forces

    def largest(self) -> tuple[float, float]:
        """Return the stiffness before any slip, and the damping of the thinnest film."""
        return self.small_motion()[0], self.damping / (self.film_limit if self.film_height else 1.0) ** 2

    @staticmethod
    def law(p: Sequence[float], state: Numbers, r: Vector, dr: Vector, spin: float, step: float, out: Numbers) -> None:
        """Each spring follows the motion up to its limit, exactly for any step, by a radial return."""
        n, force, excess = whole(p[0]), times(p[1], r), p[5]
        if any_below(0.0 - excess, 0.0):
            ratio = length(dr) / step * p[6]
            excess = excess * exponential(0.0 - ratio * ratio)
        for i in range(n):
            limit = (1.0 + excess) * p[7 + n + i] / p[7 + i]
            z = within(plus(read(state, i, r), dr), limit)
            write(state, i, z)
            force = plus(force, times(p[7 + i], z))
        answer(out, force, film_damping(length(r), p[2], p[3], p[4]))

    @staticmethod
    def energy(
        p: Sequence[float], before: Sequence[float], state: Sequence[float], r: Vector, dr: Vector, out: Numbers
    ) -> None:
        """½ k r² + Σ ½ kᵢ zᵢ², and the force of each spring times the displacement of its slider.

        Where the force along that displacement has fallen since the step before, it is the mean of the two.
        """
        n = int(p[0])
        stored = p[1] * along(r, r)
        lost = 0.0
        for i in range(n):
            previous, z = read(before, i, r), read(state, i, r)
            stored += p[7 + i] * along(z, z)
            sliding = minus(plus(previous, dr), z)
            work = along(z, sliding)
            lost += p[7 + i] * max(work, 0.5 * (work + along(previous, sliding)))
        out[0] = 0.5 * stored
        out[1] = lost


@register_family
class SlipFriction(FillingFamily):
    """Four elements with friction independent of speed, in parallel to a spring and a squeeze film."""

    name: ClassVar[str] = "Maxwell-slip"
    model: ClassVar[type] = MaxwellSlip

    def parameters(self, bushing: Bushing) -> list[FamilyParameter]:
        """Return stiffness, damping, film height, then the elements' slip displacements, then their springs."""
        spring, *film = spring_and_film(bushing)
        slip, stiffness = "grease slip displacement", "grease slipping stiffness"
        starts = [bushing.gap / 20 * SLIP_RATIO**i for i in range(ELEMENTS)]
        slips = [positive_parameter(f"{slip} {i}", "m", start, 0.5) for i, start in enumerate(starts, 1)]
        springs = [positive_parameter(f"{stiffness} {i + 1}", "N/m", 0.1 * spring.start, 1.5) for i in range(ELEMENTS)]
        return [spring, *film, *slips, *springs]

    def make(self, bushing: Bushing, *values: float) -> MaxwellSlip:
        """Return the grease of stiffness, damping, film height, slip displacements and springs."""
        return _grease(values)

    def holds(self, model: GreaseModel) -> bool:
        """Return True if it has four elements and friction independent of speed."""
        return isinstance(model, MaxwellSlip) and len(model.springs) == ELEMENTS and model.stribeck_speed is None

    def values(self, bushing: Bushing, model: MaxwellSlip) -> dict[str, float]:
        """Return all parameters; without a film, all but its height."""
        values = values_of_film(model.elastic, model.damping, model.film_height)
        for i, (spring, force) in enumerate(zip(model.springs, model.forces), 1):
            values |= {f"grease slip displacement {i}": force / spring, f"grease slipping stiffness {i}": spring}
        return values

    def start(self, fit: EarlierFit, forces: GapForces) -> dict[str, float]:
        """Return the values of `slip_start`."""
        return slip_start(fit.bushing, forces)


@register_family
class StribeckFriction(FillingFamily):
    """As `SlipFriction`, with larger friction at low speed."""

    name: ClassVar[str] = "Maxwell-slip, Stribeck"
    model: ClassVar[type] = MaxwellSlip
    begins_from: ClassVar[str | None] = SlipFriction.name

    def parameters(self, bushing: Bushing) -> list[FamilyParameter]:
        """Return the excess of static friction, r - 1, the Stribeck speed and the parameters of `SlipFriction`."""
        excess = positive_parameter("grease static friction over sliding, less 1", "1", 0.3, 1.0)
        speed = positive_parameter("grease Stribeck speed", "m/s", 0.01, 1.5)
        return [excess, speed, *SlipFriction().parameters(bushing)]

    def make(self, bushing: Bushing, *values: float) -> MaxwellSlip:
        """Return the grease of r - 1, the Stribeck speed, and the values of `SlipFriction`."""
        excess, speed, *others = values
        return _grease(others, 1 + excess, speed)

    def holds(self, model: GreaseModel) -> bool:
        """Return True if it has four elements and a Stribeck speed."""
        return isinstance(model, MaxwellSlip) and len(model.springs) == ELEMENTS and model.stribeck_speed is not None

    def values(self, bushing: Bushing, model: MaxwellSlip) -> dict[str, float]:
        """Return all parameters; without a film, all but its height."""
        speed = {"grease Stribeck speed": model.stribeck_speed or 0.0}
        excess = {"grease static friction over sliding, less 1": model.static_ratio - 1}
        return SlipFriction().values(bushing, model) | excess | speed


def _grease(values: Sequence[float], static_ratio: float = 1.0, stribeck_speed: float | None = None) -> MaxwellSlip:
    k, c, height, *elements = values
    slips, springs = elements[:ELEMENTS], elements[ELEMENTS:]
    forces = tuple(slip * spring for slip, spring in zip(slips, springs))
    return MaxwellSlip(tuple(springs), forces, k, c, height, static_ratio=static_ratio, stribeck_speed=stribeck_speed)


def slip_start(bushing: Bushing, forces: GapForces) -> dict[str, float]:
    """Return values of `SlipFriction` by name, SI, by non-negative least squares on the forces inside the gap.

    Forces of elements add up, in proportion to their springs, so that only the slip displacements need a search. The
    springs of many elements are fitted at once, as samples of Iwan's distribution, and then merged to a few.

    Parameters
    ----------
    bushing : Bushing
        With the gap and offset fitted with a linear grease.
    forces : GapForces
        Forces in the records.
    """
    slips = bushing.gap * np.geomspace(NARROWEST_SLIP, WIDEST_SLIP, SLIP_SAMPLES)
    absent = (NO_SPRING,), (NO_SPRING,)
    elements = [*(MaxwellSlip((1.0,), (slip,)) for slip in slips), MaxwellSlip(*absent, elastic=1.0)]
    elements += [MaxwellSlip(*absent, damping=1.0, film_height=height * bushing.gap) for height in FILM_HEIGHTS]
    factors = _nonnegative_lstsq(*forces.in_gap(bushing, elements))
    springs, stiffness, films = np.split(factors, [SLIP_SAMPLES, SLIP_SAMPLES + 1])
    # Without elastic force, that of the prior.
    stiffest = float(stiffness[0] + springs.sum()) or SlipFriction().parameters(bushing)[0].start
    softest = SOFTEST_SPRING * stiffest
    values = {"grease stiffness": max(float(stiffness[0]), softest)}
    if films.any():
        height = bushing.gap / float(films @ (1 / np.array(FILM_HEIGHTS)) / films.sum())
        values |= {"grease damping": float(films.sum()), "grease film height": height}
    return values | _merge_elements(slips, springs, softest)


def _nonnegative_lstsq(columns: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the non-negative least-squares factors, by the Cholesky factor of the normal equations."""
    import scipy.optimize

    scale = np.linalg.norm(columns, axis=0)
    normal = columns / scale
    root = np.linalg.cholesky(normal.T @ normal + 1e-9 * np.eye(scale.size))
    factors, _ = scipy.optimize.nnls(root.T, np.linalg.solve(root, normal.T @ right))
    return np.asarray(factors / scale)


def _merge_elements(slips: np.ndarray, springs: np.ndarray, softest: float) -> dict[str, float]:
    """Merge neighbouring elements where that changes the distribution least (Ward 1963), until few are left."""
    groups = [(max(float(k), softest / springs.size), float(np.log(slip))) for k, slip in zip(springs, slips)]
    while len(groups) > ELEMENTS:
        cost = [a[0] * b[0] / (a[0] + b[0]) * (a[1] - b[1]) ** 2 for a, b in itertools.pairwise(groups)]
        i = int(np.argmin(cost))
        (k, position), (other_k, other_position) = groups[i : i + 2]
        groups[i : i + 2] = [(k + other_k, (k * position + other_k * other_position) / (k + other_k))]
    values = {f"grease slip displacement {i + 1}": float(np.exp(log_slip)) for i, (_, log_slip) in enumerate(groups)}
    return values | {f"grease slipping stiffness {i + 1}": max(k, softest) for i, (k, _) in enumerate(groups)}
