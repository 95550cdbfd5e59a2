"""Linear rotordynamics of a shaft in its gaps: whirl, thresholds of stability, critical speeds, unbalance.

Above the speed at which rotating damping puts in more energy than non-rotating damping dissipates, the shaft is
unstable: Ω = ω (1 + c_e/c_i) for a Jeffcott rotor. The equations are those of `LinearModel`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.optimize

from ..core.errors import RigError
from ..core.kinds import checks_kinds
from ..linear import LinearModel, Poles, linear_model
from ..rig import Bushing, Rig
from ..structure.base import parse_direction

__all__ = ["TurningShaft", "rising", "turning_shaft"]

UNSTABLE = -1e-9  # damping ratio below which a motion is unstable; an undamped one is within it up to rounding
FROZEN_SPINS = 201  # of a table of bearings, sampled in the search for critical speeds
POINTS = 41  # along the shaft, for the sense of a whirl


@dataclass(frozen=True, eq=False)
class TurningShaft:
    """A rig's shaft in two bending planes, its bushings filled. Made by `turning_shaft`."""

    model: LinearModel
    """the shaft with fillings: coordinates of the motion along y, then along z"""

    @property
    def rig(self) -> Rig:
        """The rig."""
        return self.model.rig

    def shapes(self, positions: Sequence[float] | np.ndarray) -> np.ndarray:
        """Return the shapes of modes of unit mass at points of the shaft, along y and z.

        Parameters
        ----------
        positions : sequence of float, length n_points
            m along the shaft.

        Returns
        -------
        ndarray, shape (n_points, 2, n)
            1/sqrt(kg).
        """
        return self.model.moved(positions)

    def poles(self, spin: float) -> Poles:
        """Return the poles of vibrating motions at a spin, by rising frequency, with the motion of each.

        Parameters
        ----------
        spin : float
            Ω, rad/s.
        """
        return self.model.poles(spin).vibrating

    def sense(self, motion: np.ndarray) -> np.ndarray:
        """Return the sense of whirl of motions: 1 forward, with the spin, -1 backward, 0 in a plane.

        Parameters
        ----------
        motion : ndarray, shape (n, m)
            Motions such as those of `poles`.

        Returns
        -------
        ndarray, shape (m,)
            Circular forward motion less backward motion along the shaft, over both, in mean squares.
        """
        y, z = np.moveaxis(self.shapes(np.linspace(*self.rig.linear.span, POINTS)) @ motion, 1, 0)
        forward, backward = np.sum(np.abs(y + 1j * z) ** 2, axis=0), np.sum(np.abs(y - 1j * z) ** 2, axis=0)
        return np.asarray((forward - backward) / (forward + backward))

    def least_damping(self, spin: float) -> float:
        """Return the smallest damping ratio of all vibrating motions at a spin; below 0 the shaft is unstable.

        Parameters
        ----------
        spin : float
            Ω, rad/s.
        """
        value = self.poles(spin).value
        return float(np.min(-value.real / np.abs(value), initial=np.inf))

    def threshold(self, speeds: Sequence[float] | np.ndarray) -> float | None:
        """Return the lowest spin, rad/s, above which the shaft is unstable; None where it is stable throughout.

        Parameters
        ----------
        speeds : sequence of float
            Rising spins, rad/s, between neighbours of which it is searched.
        """
        stable = None
        for spin in map(float, speeds):
            if self.least_damping(spin) < UNSTABLE:
                if stable is None:
                    return spin
                return float(scipy.optimize.brentq(lambda at: self.least_damping(at) - UNSTABLE, stable, spin))
            stable = spin
        return None

    @property
    def critical_speeds(self) -> np.ndarray:
        """(m,) rad/s, rising: spins that are a natural frequency of the undamped shaft, forward or backward."""
        return self.critical_motions.value.imag

    @property
    def critical_motions(self) -> Poles:
        """Motions a e^(iΩt) of the undamped shaft at its critical speeds Ω: K(Ω) a = Ω² (1 - i G) a.

        The symmetric part of the bearings' stiffness counts; those with a table are known within it alone.
        """
        model = self.model
        if not model.omega.all():
            raise RigError(f"rig {self.rig.name!r}: the shaft can move without bending; add a support")
        if not (tables := [held.bearing.spin for held in model.bearings if held.bearing.spin]):
            return self._critical_at(0.0)
        spins = np.linspace(max(0.0, *(t[0] for t in tables)), min(t[-1] for t in tables), FROZEN_SPINS)
        gap = np.array([self._critical_at(spin).value.imag - spin for spin in spins])
        critical = []
        for i, j in np.argwhere(gap[:-1] * gap[1:] < 0).tolist():
            at = scipy.optimize.brentq(lambda s, j=j: self._critical_at(s).value[j].imag - s, spins[i], spins[i + 1])
            critical.append(self._critical_at(at).selected([j]))
        critical.sort(key=lambda motion: motion.value[0].imag)
        parts = [Poles(np.empty(0, complex), np.empty((model.size, 0), complex)), *critical]
        return Poles(np.concatenate([p.value for p in parts]), np.hstack([p.motion for p in parts]))

    def _critical_at(self, spin: float) -> Poles:
        """Return critical motions of the shaft with its bearings at a spin, by rising speed."""
        stiffness, mass = self.model.elastic(spin), np.eye(self.model.size) - 1j * self.model.gyroscopic
        try:
            inverse, motion = scipy.linalg.eigh(mass, (stiffness + stiffness.T) / 2)
        except np.linalg.LinAlgError:
            raise RigError(
                f"rig {self.rig.name!r}: at {spin:g} rad/s its bearings leave the shaft a motion without stiffness, so "
                "that it has no critical speeds"
            ) from None
        positive = np.flatnonzero(inverse > np.finfo(float).eps * inverse.max())[::-1]
        return Poles(1j / np.sqrt(inverse[positive]), motion[:, positive])

    def under_unbalances(self, speeds: Sequence[float] | np.ndarray) -> np.ndarray:
        """Return the synchronous response to the rig's unbalances: the motion is the real part of it times e^(iφ).

        Parameters
        ----------
        speeds : sequence of float, length n_speeds
            Spins Ω, rad/s.

        Returns
        -------
        ndarray, shape (n, n_speeds), complex
            The modes' coordinates, sqrt(kg) m, for use with `shapes`; φ is the shaft's angle.

        Raises
        ------
        RigError
            If the rig has no unbalances.
        """
        if not self.rig.unbalances:
            raise RigError(f"rig {self.rig.name!r} has no unbalances, so that nothing moves it at its speed; give one")
        cos, sin = self.model.unbalance
        force = cos - 1j * sin
        return np.array([np.linalg.solve(self.model.dynamic(s, s), s**2 * force) for s in map(float, speeds)]).T


def rising(speeds: Sequence[float] | np.ndarray) -> np.ndarray:
    """Return spins as an array, after a check that they rise.

    Parameters
    ----------
    speeds : sequence of float, length n_speeds
        rad/s.

    Raises
    ------
    RigError
        If they are none, or do not rise.
    """
    speed = np.array(speeds, dtype=float)
    if speed.ndim != 1 or not speed.size or not np.isfinite(speed).all() or np.any(np.diff(speed) <= 0):
        raise RigError(f"speeds must be rising spins in rad/s, got {speeds!r}")
    return speed


@checks_kinds
def turning_shaft(rig: Rig, n_modes: int = 16) -> TurningShaft:
    """Reduce a rig's shaft to modes of two planes, with the filling's stiffness and damping in its bushings.

    Point masses and bushings act equally in both planes, supports by their fields.

    Parameters
    ----------
    rig : Rig
        A rig with a beam or one shaft, round or square.
    n_modes : int
        Modes of each plane, to which static shapes are added.

    Raises
    ------
    RigError
        If the structure is no such shaft, stands on a fixture, has planes, or a bushing that is not on the base.
    """
    if rig.linear.is_torsional:
        raise RigError(f"rig {rig.name!r}: its gears turn, and no shaft of theirs bends; give a beam or one shaft")
    if rig.fixture or rig.planes:
        raise RigError(f"rig {rig.name!r}: a shaft that turns has no fixture and no planes of its own")
    for j, bushing in enumerate(rig.bushings):
        if bushing.to is not None:
            raise RigError(f"rig {rig.name!r}: bushings[{j}].to is on the shaft itself, which turns; leave it out")
    if not rig.moves_across:
        rig = rig.replace(bushings=tuple(map(_as_round, rig.bushings)))
    greases = [bushing.grease.damping for bushing in rig.bushings]
    return TurningShaft(linear_model(rig, n_modes, True, True).filled(np.zeros(len(greases)), greases))


def _as_round(bushing: Bushing) -> Bushing:
    """Return the bushing as a round one, around a shaft that moves in every direction; a named one is unchanged."""
    named = parse_direction(bushing.position) is not None
    return bushing if named else dataclasses.replace(bushing, shape="round", stops="both")
