"""The uniform cantilever: closed-form modes and static shapes as the coordinates of an engine's model.

Equations 1-8 of the article with their misprints corrected: the shaft is clamped at x = 0 and free at x = l, so
cos λ cosh λ = -1 (Blevins, Formulas for Natural Frequency and Mode Shape, 1979, table 8-1).

A truncated set of modes is too stiff under a point force: fourteen modes miss 5 % of the static displacement at a
bushing near the clamp. The static deflection under a unit force at each point is therefore added to them: it carries
the residual flexibility of the modes left out (MacNeal 1971; Rubin 1975).
"""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import RigError
from ..core.validation import NotNegative, Positive, Share, checked, seldom
from .base import Assembly, Structure, parse_direction, parse_place
from .section import Material, Section, check_sizes
from .shaft import Disc, Shaft, Support, rows_at

__all__ = ["Beam", "Clamp"]

_EITHER_SECTION = {
    "oneOf": [
        {"required": ["diameter"], "properties": {"width": False, "height": False}},
        {"required": ["width", "height"], "properties": {"diameter": False}},
    ]
}


@checked(RigError)
class Clamp:
    """A flexible clamp: directions without a spring are rigid, and so is the twist."""

    rotation: Positive | None = None
    """N m/rad"""
    translation: Positive | None = None
    """N/m"""
    rotation_damping: NotNegative = seldom(default=0.0)
    """N m s/rad, parallel to ``rotation``"""
    translation_damping: NotNegative = seldom(default=0.0)
    """N s/m, parallel to ``translation``"""
    mass: NotNegative = seldom(default=0.0)
    """kg, that moves with the shaft's end on ``translation``"""

    def __post_init__(self) -> None:
        for field, spring in (("rotation_damping", "rotation"), ("translation_damping", "translation")):
            if getattr(self, field) and not getattr(self, spring):
                raise ValueError(f"{field} has no effect without {spring}: the clamp is rigid there")
        if self.mass and not self.translation:
            raise ValueError("mass has no effect without translation: the clamp does not move; give its spring, N/m")


@checked(RigError, schema=_EITHER_SECTION)
class Beam(Structure):
    """A uniform Euler-Bernoulli shaft, clamped at x = 0 and free at x = length.

    Give ``diameter`` for a round section, or ``width`` and ``height`` (in the direction of vibration) for a
    rectangular one.
    """

    length: Positive
    """m"""
    young_modulus: Positive
    """Pa"""
    density: Positive
    """kg/m³"""
    diameter: Positive | None = None
    """m"""
    width: Positive | None = None
    """m"""
    height: Positive | None = None
    """m, in the direction of vibration"""
    rayleigh: tuple[NotNegative, NotNegative] = (0.0, 0.0)
    """(η1 in 1/s, η2 in s): damping η1 M + η2 K, Eq. 6"""
    damping_ratios: tuple[Share, ...] | None = None
    """of the modes, in addition; the last one holds for all that follow"""
    clamp: Clamp | None = None
    """None: rigid"""

    def __post_init__(self) -> None:
        check_sizes(self.diameter, self.width, self.height)

    @property
    def area(self) -> float:
        """Cross-section in m²."""
        width, height = self._rectangle
        return math.pi * self.diameter**2 / 4 if self.diameter else width * height

    @property
    def second_moment(self) -> float:
        """Second moment of area in m⁴."""
        width, height = self._rectangle
        return math.pi * self.diameter**4 / 64 if self.diameter else width * height**3 / 12

    @property
    def _rectangle(self) -> tuple[float, float]:
        return self.width or 0.0, self.height or 0.0

    @property
    def bending_stiffness(self) -> float:
        """E I in N m²."""
        return self.young_modulus * self.second_moment

    @property
    def mass_per_length(self) -> float:
        """ρ A in kg/m."""
        return self.density * self.area

    @property
    def total_mass(self) -> float:
        """Mass in kg."""
        return self.mass_per_length * self.length

    @property
    def in_other_plane(self) -> Beam:
        """The same beam as it bends along y; see `Structure.in_other_plane`."""
        return dataclasses.replace(self, width=self.height, height=self.width)

    @property
    def shafts(self) -> tuple[Shaft, ...]:
        """The same as a shaft of one section; see `Structure.shafts`."""
        material = Material(self.young_modulus, self.density)
        size = {name: getattr(self, name) for name in ("diameter", "width", "height")}
        clamp = self.clamp or Clamp()
        kind: Literal["clamped", "pinned", "guided", "elastic"] = "clamped"
        if clamp.rotation:
            kind = "elastic" if clamp.translation else "pinned"
        elif clamp.translation:
            kind = "guided"
        support = Support(
            0.0, kind, clamp.translation or 0.0, clamp.rotation or 0.0, clamp.translation_damping,
            clamp.rotation_damping, twist="rigid",
        )  # fmt: skip
        clamp_mass = (Disc(0.0, clamp.mass, name="clamp"),) if clamp.mass else ()
        damping = self.rayleigh, self.damping_ratios or ()
        return (Shaft((Section(self.length, **size),), (support,), clamp_mass, material, *damping, theory="euler"),)

    def check(self, point: float | str) -> None:
        """Raise a ValueError for a point that is not on the shaft; see `Structure.check`."""
        place = parse_place(point)
        if place is None or place[0]:
            raise ValueError(f'"{point}" is no position on the beam: give a number, 0 < x <= {self.length:g} m')
        if not 0 < place[1] <= self.length:
            raise ValueError(f"{place[1]:g} m lies outside the beam (0 < x <= {self.length:g} m)")
        if parse_direction(point):
            self.shafts[0].check(point)

    def assemble(self, points: tuple[float | str, ...], modes: int) -> Assembly:
        """Return mass and stiffness of cantilever modes and of the static shapes under a unit force at each point.

        With a flexible clamp, or points with directions, those of the shaft's elements.
        """
        if self.clamp or any(map(parse_direction, points)):
            return self.shafts[0].assemble(points, modes)
        forces = np.array(sorted(set(points)), dtype=float)
        x, weight = _quadrature(self.length, forces, modes)
        functions = functools.partial(_ritz_functions, self, modes, forces)
        y, curvature = functions(x, 0), functions(x, 2)
        mass = self.mass_per_length * (y.T * weight) @ y
        influence = np.zeros((len(mass), 3))
        influence[:, 2] = self.mass_per_length * weight @ y
        stiffness = self.bending_stiffness * (curvature.T * weight) @ curvature
        return Assembly(
            mass, stiffness, influence, lambda at: rows_at(at, len(mass), functions), self.rayleigh,
            self.damping_ratios or (), rocking=self.mass_per_length * (weight * x) @ y, reduced=True,
        )  # fmt: skip


@functools.cache
def cantilever_roots(n: int) -> np.ndarray:
    """Return the first n roots λ of cos λ cosh λ = -1 (Eq. 8 corrected)."""
    roots = (2 * np.arange(1, n + 1) - 1) * np.pi / 2
    for _ in range(20):  # Newton on cos λ + 1/cosh λ, which does not overflow
        sech = 1 / np.cosh(np.minimum(roots, 700))
        roots -= (np.cos(roots) + sech) / (-np.sin(roots) - sech * np.tanh(roots))
    roots.flags.writeable = False
    return roots


def cantilever_mode(x: ArrayLike, n: int, length: float = 1.0, order: int = 0) -> np.ndarray:
    """Return the shapes Y_i (n_x, n) of the bare cantilever at x (n_x,) (Eq. 7 corrected), with ∫Y² dx = length.

    Y_i = cosh βx - cos βx - σ (sinh βx - sin βx), or its derivative of order 1 or 2, in exponential form without
    cancellation of the growing exponentials, so that high modes keep their digits.
    """
    root = cantilever_roots(n)
    bx = np.asarray(x, dtype=float)[:, None] * root / length
    decay = np.exp(-root)
    difference = 2 * (np.sin(root) - np.cos(root) - decay) / (1 - decay**2 + 2 * np.sin(root) * decay)
    sigma = 1 - difference * decay  # 1 - σ = difference e^(-λ)
    hyperbolic = (difference * np.exp(bx - root) + (-1) ** order * (1 + sigma) * np.exp(-bx)) / 2
    cos, sin = np.cos(bx), np.sin(bx)
    if order == 1:
        return np.asarray(root / length * (hyperbolic + (sin + sigma * cos)))
    derivative = hyperbolic + (order - 1) * (cos - sigma * sin)
    return np.asarray((root / length) ** 2 * derivative if order else derivative)


def static_deflection(beam: Beam, x: ArrayLike, a: ArrayLike, order: int = 0) -> np.ndarray:
    """Return the deflection (n_x, n_a) in m/N at x of the clamped beam under a unit force at a.

    Of order 1 its slope, rad/N, of order 2 its curvature, 1/(m N) (Roark, table 8.1, case 1a).
    """
    x, a = np.asarray(x, dtype=float)[:, None], np.asarray(a, dtype=float)[None]
    if order == 2:
        return np.asarray(np.maximum(a - x, 0) / beam.bending_stiffness)
    near = np.minimum(x, a)
    if order == 1:
        return np.asarray(near * (2 * a - near) / (2 * beam.bending_stiffness))
    return np.asarray(near**2 * (3 * np.maximum(x, a) - near) / (6 * beam.bending_stiffness))


def _ritz_functions(beam: Beam, modes: int, forces: np.ndarray, x: np.ndarray, order: int) -> np.ndarray:
    """Return Ritz functions at x: cantilever modes, then the residuals of the static shapes, scaled to their size."""
    shapes = cantilever_mode(x, modes, beam.length, order)
    residual = static_deflection(beam, x, forces, order) - shapes @ _static_coefficients(beam, modes, forces)
    return np.hstack((shapes, residual * (3 * beam.bending_stiffness / beam.length**3)))


def _static_coefficients(beam: Beam, modes: int, forces: np.ndarray) -> np.ndarray:
    """Return coefficients (modes, n_forces) Y_i(a)/K_i of modes in the static deflection under a unit force at a."""
    stiffness = beam.bending_stiffness * (cantilever_roots(modes) / beam.length) ** 4 * beam.length
    return (cantilever_mode(forces, modes, beam.length) / stiffness).T


def _quadrature(length: float, breaks: np.ndarray, modes: int) -> tuple[np.ndarray, np.ndarray]:
    """Return Gauss-Legendre points and weights, exact enough for products of the modes, between the points of force."""
    node, weight = np.polynomial.legendre.leggauss(16)
    edges = np.unique(np.concatenate((np.linspace(0, length, modes + 3), breaks)))
    half, middle = np.diff(edges)[:, None] / 2, (edges[1:] + edges[:-1])[:, None] / 2
    return (middle + half * node).ravel(), (half * weight).ravel()
