"""Rub of a turning shaft in a round clearance, exact for circular motion.

Both bending planes are equal, so that one complex coordinate w = y + i z describes the motion. Beyond the gap δ the
bushing pushes back with k_c (ρ - δ), and its friction, μ times that, acts on the shaft's surface against its rotation:
the force on the shaft at w = ρ e^(iθ) is -k_c (ρ - δ) (1 + i μ) e^(iθ), as the surface slides everywhere. So a circular
whirl w ~ e^(iωt) is a linear motion under a force that rotates with it. With the receptance H(ω) at the clearance,
gyroscopic moments and all, and u the free motion under the unbalance,

- synchronous rub (ω = Ω) has |ρ + H k_c (ρ - δ)(1 + i μ)| = |u|, a quadratic equation for ρ: two branches at most;
- dry whirl, which friction alone drives, backward, has 1 + H(-ω) k_c (1 - δ/ρ)(1 + i μ) = 0: at whirls ω with
  Im H = -μ Re H, Re H < 0;
- a shaft of radius R that rolls inside the bushing without sliding has ω ρ = Ω R and needs less friction than acts
  where it slides.

Source: Black, J. Mech. Eng. Sci. 10, 1968; Jiang & Ulbrich, Nonlinear Dynamics 24, 2001, for a Jeffcott rotor.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy.optimize

from ..core.errors import LawError, RigError
from ..core.kinds import checks_kinds
from ..linear import LinearModel
from ..rig import Rig
from .turning import TurningShaft, turning_shaft

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["DryWhirl", "SynchronousRub", "dry_whirls", "rolling_whirls", "synchronous_rub"]

EQUAL = 1e-6  # relative difference allowed between frequencies of the two planes
GROWING = 1e-9  # of a pole's size: real part above which a motion is unstable
WHIRLS = 4000  # frequencies sampled in the search for dry whirls


class _CircularShaft(NamedTuple):
    """A shaft of equal planes in the complex coordinates y + i z of its modes, and one clearance."""

    model: LinearModel
    at: np.ndarray
    gap: float
    stiffness: float
    friction: complex  # 1 + i μ

    def of_circle(self, matrix: np.ndarray) -> np.ndarray:
        """Return the matrix for circular motion, z = -i y, of a matrix of both planes."""
        n = self.at.size
        return matrix[:n, :n] - 1j * matrix[:n, n:]

    def dynamic(self, whirl: float, spin: float) -> np.ndarray:
        """Return the dynamic stiffness of the modes in a circular motion; a whirl < 0 is backward."""
        return self.of_circle(self.model.dynamic(whirl, spin))

    def receptance(self, whirl: float, spin: float) -> complex:
        """Return the displacement in the clearance per unit force there."""
        return complex(self.at @ np.linalg.solve(self.dynamic(whirl, spin), self.at))

    def is_stable(self, spin: float, radius: float) -> bool:
        """Return True if small motions about a synchronous circle decay, in coordinates that rotate with it."""
        n, push = self.at.size, self.friction * np.outer(self.at, self.at)
        k_tangential = self.stiffness * (1 - self.gap / radius)
        direct = self.dynamic(spin, spin) + push * (k_tangential + self.stiffness * self.gap / (2 * radius))
        mirrored = push * self.stiffness * self.gap / (2 * radius)  # of the conjugate motion
        viscous = self.of_circle(self.model.viscous(spin)) + 2j * spin * np.eye(n)
        stiffness = np.block([[direct, mirrored], [mirrored.conj(), direct.conj()]])
        rates = np.block([[viscous, np.zeros((n, n))], [np.zeros((n, n)), viscous.conj()]])
        poles = np.linalg.eigvals(np.block([[np.zeros((2 * n, 2 * n)), np.eye(2 * n)], [-stiffness, -rates]]))
        return bool(np.all(poles.real <= GROWING * np.abs(poles)))


@dataclass(frozen=True, eq=False)
class SynchronousRub:
    """Radius of a shaft's circular orbit in a clearance under unbalance, over its spin."""

    gap: float
    """m, radial"""
    speed: np.ndarray
    """(n_speeds,) spin, rad/s"""
    free: np.ndarray
    """(n_speeds,) m, radius without a bushing; the motion is free of contact where it is below the gap"""
    radius: np.ndarray
    """(n_speeds, 2) m, of the lower and the upper branch in contact; nan where there is none"""
    stable: np.ndarray
    """(n_speeds, 2) True where small motions about them decay"""

    @property
    def ends(self) -> np.ndarray:
        """(n,) rad/s, the first or last speed of each stretch in which the upper branch exists."""
        exists = np.isfinite(self.radius[:, 1])
        edge = np.flatnonzero(exists[1:] != exists[:-1])
        return self.speed[np.where(exists[edge], edge, edge + 1)]

    def plot(self) -> Figure:
        """Draw the radius over the spin: without contact, and rubbing, stable or not."""
        from ..core.drawing import COLOURS, REPEAT, TEST, canvas, key, tidy

        figure = canvas(3.6)
        ax = figure.subplots()
        rpm, mm = self.speed * 30 / np.pi, 1e3
        ax.plot(rpm, mm * np.where(self.free < self.gap, self.free, np.nan), color=COLOURS[0], label="in the gap")
        for stable, style, name in ((True, "-", "rubbing"), (False, ":", "rubbing, unstable")):
            shown = mm * np.where(self.stable == stable, self.radius, np.nan)
            ax.plot(rpm, shown[:, 0], style, color=COLOURS[1], label=name)
            ax.plot(rpm, shown[:, 1], style, color=COLOURS[1])
        ax.axhline(mm * self.gap, color=TEST, linewidth=0.9, linestyle="--", label="gap")
        ax.plot(rpm, mm * np.where(self.free < self.gap, np.nan, self.free), color=REPEAT, linewidth=0.9,
                label="without bushing")  # fmt: skip
        ax.set_ylim(0.0, 1.3 * mm * float(np.nanmax(np.append(self.radius, self.gap))))
        tidy(ax, "", "Radius (mm)", "Spin (rev/min)")
        key(figure, ax.get_legend_handles_labels()[0], 5)
        return figure


class DryWhirl(NamedTuple):
    """A backward whirl with full annular contact, driven by friction."""

    whirl: float  #: rad/s
    radius: float  #: m
    friction: float  #: acting coefficient: the full one where it slides, less where it rolls


@checks_kinds
def synchronous_rub(
    rig: Rig, speeds: Sequence[float] | np.ndarray, position: float, moment: float, friction: float = 0.0,
    bushing: int = 0, n_modes: int = 16,
) -> SynchronousRub:  # fmt: skip
    """Compute the circular orbits of a shaft under unbalance in a bushing, with and without contact, over its spin.

    The bushing's contact is its datasheet stiffness, at its middle; it is not damped.

    Parameters
    ----------
    rig : Rig
        A rig with a beam or one shaft, alike in both planes.
    speeds : sequence of float, length n_speeds
        Rising spins, rad/s.
    position : float
        m along the shaft, of the unbalance.
    moment : float
        Mass times eccentricity, kg m.
    friction : float
        Coefficient μ between shaft and bushing.
    bushing : int
        Number of the bushing with rub; the fillings of all act.
    n_modes : int
        Modes of each plane, to which static shapes are added.

    Raises
    ------
    RigError
        If the planes differ, the structure is no such shaft, or there is no such bushing.
    LawError
        If friction is negative.
    """
    shaft, circling = _circular_shaft(rig, friction, bushing, n_modes)
    speed = np.array(speeds, dtype=float)
    source = shaft.shapes([position])[0, 0, : circling.at.size]
    free, radius = np.zeros(speed.size), np.full((speed.size, 2), np.nan)
    stable = np.zeros((speed.size, 2), dtype=bool)
    stiff, gap = circling.stiffness * circling.friction, circling.gap
    for i, spin in enumerate(speed):
        moved = np.linalg.solve(circling.dynamic(spin, spin), np.column_stack((circling.at, moment * spin**2 * source)))
        receptance, free[i] = circling.at @ moved[:, 0], abs(circling.at @ moved[:, 1])
        factor, shift = 1 + receptance * stiff, receptance * stiff * gap
        half = (factor * shift.conjugate()).real / abs(factor) ** 2
        inside = half**2 - (abs(shift) ** 2 - free[i] ** 2) / abs(factor) ** 2
        if inside >= 0:
            for j, sign in enumerate((-1.0, 1.0)):
                root = half + sign * np.sqrt(inside)
                if root > gap:
                    radius[i, j], stable[i, j] = root, circling.is_stable(spin, root)
    return SynchronousRub(gap, speed, free, radius, stable)


@checks_kinds
def dry_whirls(
    rig: Rig, friction: float, spin: float = 0.0, bushing: int = 0, n_modes: int = 16
) -> tuple[DryWhirl, ...]:
    """Compute the backward whirls that friction in a bushing can sustain, by rising frequency.

    The shaft's surface slides all the time, so that its spin acts by gyroscopic moments and rotating damping alone.

    Parameters
    ----------
    rig : Rig
        A rig with a beam or one shaft, alike in both planes.
    friction : float
        Coefficient μ between shaft and bushing, > 0.
    spin : float
        Ω, rad/s.
    bushing, n_modes
        As in `synchronous_rub`.

    Raises
    ------
    RigError
        If the planes differ, the structure is no such shaft, or there is no such bushing.
    LawError
        If friction is negative.
    """
    _, circling = _circular_shaft(rig, friction, bushing, n_modes)

    def driven(whirl: float) -> float:
        receptance = circling.receptance(-whirl, spin)
        return receptance.imag + friction * receptance.real

    whirls = []
    for whirl in _roots(driven, circling, spin, np.inf):
        k_dynamic = -(1 / circling.receptance(-whirl, spin)).real  # k_c (1 - δ/ρ)
        if 0 < k_dynamic < circling.stiffness:
            whirls.append(DryWhirl(whirl, circling.gap / (1 - k_dynamic / circling.stiffness), friction))
    return tuple(whirls)


@checks_kinds
def rolling_whirls(rig: Rig, friction: float, spin: float, bushing: int = 0, n_modes: int = 16) -> tuple[DryWhirl, ...]:
    """Compute the backward whirls in which a shaft rolls inside a bushing without sliding, by rising frequency.

    Parameters
    ----------
    rig : Rig
        A rig with a beam or one shaft, alike in both planes and round at the bushing.
    friction : float
        Coefficient μ between shaft and bushing, >= 0: whirls that need more are left out.
    spin : float
        Ω, rad/s, > 0.
    bushing, n_modes
        As in `synchronous_rub`.

    Raises
    ------
    RigError
        If the planes differ, the structure is no such shaft, or there is no such bushing.
    LawError
        If friction is negative.
    """
    _, circling = _circular_shaft(rig, friction, bushing, n_modes)
    rolling_speed = spin * _shaft_radius(rig, bushing)

    def mismatch(whirl: float) -> float:
        receptance = circling.receptance(-whirl, spin)
        # Both sides times |H|², which has no poles where H is zero.
        return receptance.real + abs(receptance) ** 2 * circling.stiffness * (1 - circling.gap * whirl / rolling_speed)

    whirls = []
    for whirl in _roots(mismatch, circling, spin, rolling_speed / circling.gap):
        k_dynamic = 1 / circling.receptance(-whirl, spin)
        acting = k_dynamic.imag / k_dynamic.real
        if k_dynamic.real < 0 and 0 <= acting <= friction:
            whirls.append(DryWhirl(whirl, rolling_speed / whirl, acting))
    return tuple(whirls)


def _roots(function: Callable[[float], float], circling: _CircularShaft, spin: float, highest: float) -> list[float]:
    """Return the whirls, rad/s, at which a function is zero; none is faster than the shaft with the contact closed."""
    lowest, n = circling.model.omega[0], circling.at.size
    closed = circling.model.elastic(spin)[:n, :n] + circling.stiffness * np.outer(circling.at, circling.at)
    fastest = min(highest, 2 * float(np.sqrt(np.linalg.eigvalsh(closed)[-1])))
    grid = np.geomspace(0.1 * lowest, fastest, WHIRLS)
    value = np.array([function(whirl) for whirl in grid])
    between = np.flatnonzero(value[1:] * value[:-1] < 0)
    return [float(scipy.optimize.brentq(function, grid[i], grid[i + 1], xtol=1e-12 * fastest)) for i in between]


def _shaft_radius(rig: Rig, bushing: int) -> float:
    """Return the radius of the shaft in a bushing, m."""
    (shaft,) = rig.linear.shafts
    at = rig.linear.place(rig.bushings[bushing].position)[1]
    i = int(np.clip(np.searchsorted(shaft.edges, at) - 1, 0, len(shaft.sections) - 1))
    if (diameter := shaft.sections[i].diameter) is None:
        raise RigError(f"rig {rig.name!r}: sections[{i}] in bushings[{bushing}] is not round, so it does not roll")
    fraction = (at - shaft.edges[i]) / shaft.sections[i].length
    return float(diameter[0] + fraction * (diameter[1] - diameter[0])) / 2


def _circular_shaft(rig: Rig, friction: float, bushing: int, n_modes: int) -> tuple[TurningShaft, _CircularShaft]:
    if not 0 <= friction < np.inf:
        raise LawError(f"friction {friction:g} must be a coefficient >= 0")
    if not 0 <= bushing < len(rig.bushings):
        raise RigError(f"bushing {bushing} is not there: rig {rig.name!r} has {len(rig.bushings)}")
    shaft, where = turning_shaft(rig, n_modes), rig.bushings[bushing]
    model, n = shaft.model, shaft.model.size // 2
    are_equal = not model.size % 2 and np.allclose(model.omega[:n], model.omega[n:], EQUAL, EQUAL * model.omega[0])
    if not are_equal or not all(bearing.is_isotropic for bearing in rig.bearings):
        raise RigError(f"rig {rig.name!r}: its supports differ in y and z, so that no motion is a circle")
    if where.offset:
        raise RigError(f"rig {rig.name!r}: bushings[{bushing}].offset is {where.offset:g} m; a circle needs its middle")
    at = shaft.shapes([float(where.position)])[0, 0, :n]
    return shaft, _CircularShaft(model, at, where.gap, where.contact.stiffness, 1 + 1j * friction)
