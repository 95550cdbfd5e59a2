"""The linear structure of a rig in modes of unit mass: static deflection, poles, gains at any spin.

    q̈ + (C + Ω G) q̇ + (K + Ω H) q = inputs - Pᵀ F

Coordinates are modes, coupled only by damping, springs and the spin Ω > 0 from y to z. G is skew:
the moment of a disc's polar inertia I on its slopes is -I Ω ż' about one axis and I Ω ẏ' about the other. H is skew
too: damping that turns with the shaft sees the velocity ẏ + Ω z, ż - Ω y of the turning shaft's material. It is the
part η2 K of Rayleigh's damping, with K of the shaft alone; all other damping stands still.

Source: Childs, Turbomachinery Rotordynamics, 1993, chapter 3; Krämer, Dynamics of Rotors and Foundations, 1993.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike

from ..core.errors import RigError
from ..rig import Bearing, Rig
from ..signals.arrays import read_only
from .poles import Poles
from .rows import RigRows

__all__ = ["HeldBearing", "LinearModel", "no_matrix"]

WORST_POLES = 1e10  # condition of the poles' vectors beyond which they are not used


def no_matrix() -> np.ndarray:
    """Return (0, 0): a part of a model that is not there."""
    return np.zeros((0, 0))


class HeldBearing(NamedTuple):
    """A bearing with the rows of its place. The modes are computed with its largest stiffness along y and along z."""

    bearing: Bearing
    rows: np.ndarray  # (2, n) displacement along y and z

    def springs(self, spin: float) -> np.ndarray:
        """Return its stiffness (n, n) at a spin less that in the modes, 1/s²."""
        return self.rows.T @ (self.bearing.at(spin).stiffness - np.diag(self.bearing.stiffest)) @ self.rows

    def damping(self, spin: float) -> np.ndarray:
        """Return its damping (n, n) at a spin, 1/s."""
        return self.rows.T @ self.bearing.at(spin).damping @ self.rows


@dataclass(frozen=True, eq=False)
class LinearModel(RigRows):
    """A rig's structure in modes of unit mass, of one bending plane or two. Made by `linear_model`."""

    omega: np.ndarray
    """(n,) natural circular frequencies of the structure at rest, 1/s; 0 of a rigid body"""
    damping: np.ndarray
    """(n,) 2ζω, 1/s, of the structure's damping"""
    coupling: np.ndarray
    """(n, n) the rest of C, 1/s; (0, 0) if there is none"""
    influence: np.ndarray
    """(n, 3) inertia forces on the modes per unit acceleration of the base along X, Y and Z"""
    gyroscopic: np.ndarray = field(default_factory=no_matrix)
    """(n, n) G, per rad/s of the spin; (0, 0) of a shaft that does not turn"""
    circulatory: np.ndarray = field(default_factory=no_matrix)
    """(n, n) H, 1/s, of damping that turns with the shaft; (0, 0) of a shaft that does not turn"""
    springs: np.ndarray = field(default_factory=no_matrix)
    """(n, n) the rest of K, 1/s²; (0, 0) if there is none"""
    bearings: tuple[HeldBearing, ...] = ()
    """with coefficients between both directions, or over the spin: added to the fields before"""
    load: np.ndarray | float = 0.0
    """(n,) constant force on the modes besides gravity"""

    @property
    def participation(self) -> np.ndarray:
        """(n,) Γ, sqrt(kg), for the shaker's direction."""
        return self.influence @ self.rig.shaker.unit_direction

    @property
    def weight(self) -> np.ndarray:
        """(n,) constant force on the modes: gravity and `load`."""
        return self.influence @ np.array(self.rig.gravity or (0.0, 0.0, 0.0)) + self.load

    def input(self, kind: str, number: int = 0) -> np.ndarray:
        """Return the force (n,) on the modes per unit of excitation: N per m/s² of the base, or per N of the shaker.

        Parameters
        ----------
        kind : str
            Kind of excitation: "base", "force", or "spin" of a shaft that only turns: as the base, if that moves it.
        number : int
            Index in `Rig.inputs`.

        Raises
        ------
        RigError
            If the structure does not know the effect of the excitation, or the base moves none of its masses.
        """
        if kind == "spin" and self.rig.linear.refusal("base"):
            return np.zeros(self.size)
        return _input(self, "base" if kind == "spin" else kind, number)

    def driven(self, tested: Rig) -> tuple[LinearModel, float]:
        """Return the model driven as in a test, and its spin, rad/s; that of slots keeps the direction of its shaker.

        Parameters
        ----------
        tested : Rig
            Whose shaker and spin are those of the test.
        """
        along, shaker = tuple(tested.shaker.unit_direction.tolist()), self.rig.shaker
        spin = tested.spin.mean if tested.spin else 0.0
        if not self.rig.moves_across or tuple(shaker.unit_direction.tolist()) == along:
            return self, spin
        rig = self.rig.replace(shaker=dataclasses.replace(shaker, direction=along))
        return dataclasses.replace(self, rig=rig), spin

    def filled(self, stiffness: ArrayLike, damping: ArrayLike) -> LinearModel:
        """Return the model with a spring and a damper in every clearance, as fillings are in small motions.

        Parameters
        ----------
        stiffness, damping : array_like, shape (n_bushings,)
            N/m and N s/m, of a round one alike along y and z.
        """
        rows = self.at_bushings
        k, c = (np.asarray(v, dtype=float)[self.rig.bushing_of_row] for v in (stiffness, damping))
        springs, coupling = _sum((rows.T * k) @ rows, self.springs), _sum((rows.T * c) @ rows, self.coupling)
        return dataclasses.replace(self, springs=springs, coupling=coupling)

    def springs_at(self, spin: float) -> np.ndarray:
        """Return `springs` with those of bearings at a spin, (n, n) or (0, 0), 1/s².

        Parameters
        ----------
        spin : float
            Ω, rad/s.
        """
        return _sum(self.springs, *(bearing.springs(spin) for bearing in self.bearings))

    def coupling_at(self, spin: float) -> np.ndarray:
        """Return `coupling` with the damping of bearings at a spin, (n, n) or (0, 0), 1/s.

        Parameters
        ----------
        spin : float
            Ω, rad/s.
        """
        return _sum(self.coupling, *(bearing.damping(spin) for bearing in self.bearings))

    def elastic(self, spin: float = 0.0) -> np.ndarray:
        """Return K (n, n) at a spin, 1/s², without the circulatory part of damping that turns.

        Parameters
        ----------
        spin : float
            Ω, rad/s.
        """
        return _sum(np.diag(self.omega**2), self.springs_at(spin))

    def stiff(self, spin: float = 0.0) -> np.ndarray:
        """Return the stiffness K + Ω H (n, n) at a spin, 1/s².

        Parameters
        ----------
        spin : float
            Ω, rad/s.
        """
        return _sum(self.elastic(spin), spin * self.circulatory)

    def viscous(self, spin: float = 0.0) -> np.ndarray:
        """Return the damping C + Ω G (n, n) at a spin, 1/s.

        Parameters
        ----------
        spin : float
            Ω, rad/s.
        """
        return _sum(np.diag(self.damping), self.coupling_at(spin), spin * self.gyroscopic)

    def dynamic(self, omega: complex, spin: float = 0.0) -> np.ndarray:
        """Return the dynamic stiffness (n, n) of motions q e^(iωt), 1/s².

        Parameters
        ----------
        omega : complex
            ω, rad/s.
        spin : float
            Ω, rad/s.
        """
        return self.stiff(spin) - omega**2 * np.eye(self.size) + 1j * omega * self.viscous(spin)

    def state(self, spin: float = 0.0) -> np.ndarray:
        """Return the derivative (2 n, 2 n) of displacements and velocities by time.

        Parameters
        ----------
        spin : float
            Ω, rad/s.
        """
        n = self.size
        return np.block([[np.zeros((n, n)), np.eye(n)], [-self.stiff(spin), -self.viscous(spin)]])

    def flow(self, step: float, spin: float = 0.0) -> np.ndarray:
        """Return the transition matrix (2 n, 2 n) of displacements and velocities over a step.

        Parameters
        ----------
        step : float
            s.
        spin : float
            Ω, rad/s.
        """
        return np.ascontiguousarray(scipy.linalg.expm(step * self.state(spin)))

    def poles(self, spin: float = 0.0) -> Poles:
        """Return all 2 n poles at a spin, with the motion of each.

        Parameters
        ----------
        spin : float
            Ω, rad/s.
        """
        value, vectors, _ = _eigenmotions(self, spin)
        return Poles(value, vectors[: self.size])

    def drive(self, spin: float = 0.0) -> np.ndarray:
        """Return the participation (2 n, n) of a force on each mode in the motion of each pole.

        Parameters
        ----------
        spin : float
            Ω, rad/s.

        Raises
        ------
        LinAlgError
            If poles have no independent vectors, as those of a free body.
        """
        return _drive(self, spin)

    def responses(self, rows: np.ndarray, inputs: np.ndarray, omega: np.ndarray, spin: float = 0.0) -> np.ndarray:
        """Return displacements (n_f, n_rows, n_inputs) of rows (n_rows, n) per unit of harmonic inputs.

        Parameters
        ----------
        rows : ndarray, shape (n_rows, n)
            Such as `at_sensors`.
        inputs : ndarray, shape (n, n_inputs)
            Forces on the modes.
        omega : ndarray, shape (n_f,)
            Angular frequencies, rad/s, real or complex.
        spin : float
            Ω, rad/s.
        """
        if self._is_coupled(spin):
            try:
                drive = self.drive(spin)
            except np.linalg.LinAlgError:  # the inverse at every frequency
                return np.array([rows @ np.linalg.solve(self.dynamic(each, spin), inputs) for each in omega])
            value, motion = self.poles(spin)
            rows, inputs, receptance = rows @ motion, drive @ inputs, 1 / (1j * omega[:, None] - value)
        else:
            receptance = 1 / (self.omega**2 - omega[:, None] ** 2 + 1j * omega[:, None] * self.damping)
        products = rows[:, None, :] * inputs.T[None]
        gains = receptance @ products.reshape(-1, receptance.shape[1]).T
        return np.asarray(gains.reshape(omega.size, len(rows), inputs.shape[1]))

    def _is_coupled(self, spin: float) -> bool:
        turns = spin and (self.gyroscopic.any() or self.circulatory.any())
        return bool(self.coupling.size or self.springs.size or self.bearings or turns)

    def displacement_gains(
        self, rows: np.ndarray, kind: str, omega: np.ndarray, at: np.ndarray | None = None, spin: float = 0.0
    ) -> np.ndarray:
        """Return displacements (n_f, n_rows, n_forces + 1) of rows (n_rows, n), otherwise as `channel_gains`.

        Parameters
        ----------
        rows : ndarray, shape (n_rows, n)
            Such as `at_points`.
        kind, omega, at, spin
            As `channel_gains` takes them.
        """
        forces = -(self.at_bushings if at is None else at)
        return self.responses(rows, np.vstack((forces, self.input(kind))).T, omega, spin)

    def channel_gains(
        self, probes: np.ndarray, kind: str, omega: np.ndarray, at: np.ndarray | None = None, spin: float = 0.0
    ) -> np.ndarray:
        """Return the gains from forces in the clearances and the excitation to sensors, probes and the excitation.

        Without filling and contact the structure is linear, so each channel reads y(ω) = G(ω, Ω) θ(ω), with θ the
        forces and the excitation.

        Parameters
        ----------
        probes : ndarray, shape (n_probes, n)
            Displacements that probes read, such as `at_probes`.
        kind : str
            Kind of excitation: "base", "force" or "spin".
        omega : ndarray, shape (n_f,)
            Angular frequencies, rad/s, real or complex.
        at : ndarray, shape (n_forces, n), optional
            Where the forces act; by default in the clearances' middles.
        spin : float
            Ω, rad/s.

        Returns
        -------
        ndarray, shape (n_f, n_sensors + n_probes + 1, n_forces + 1), complex
        """
        rig = self.rig
        responses = self.sensor_rows.gains(
            lambda rows: self.displacement_gains(rows, kind, omega, at, spin), probes, omega, kind != "force"
        )
        gains = np.pad(responses, ((0, 0), (0, 1), (0, 0)))
        gains[:, -1, -1] = 1.0  # the excitation itself
        of_probes = [rig.bushings[j].probe_delay for j in rig.bushing_of_row[: len(probes)]]
        for i, delay in enumerate([*(s.delay for s in rig.sensors), *of_probes, rig.shaker.delay]):
            if delay:
                gains[:, i] *= np.exp(-1j * omega * delay)[:, None]
        return gains

    def static_deflection(self, points: Sequence[float | str] | np.ndarray, loads: np.ndarray) -> np.ndarray:
        """Return the deflection (n_points, n_loads), m/N, of points under unit static loads.

        Parameters
        ----------
        points : sequence of Point, length n_points
            Positions, m, or degrees of freedom.
        loads : ndarray, shape (n_loads, n)
            Force on the modes of each load, such as ``at_bushings``; exact for those and the shaker's.

        Raises
        ------
        RigError
            If the structure can move without bending.
        """
        if not self.omega.all():
            raise RigError(
                f"rig {self.rig.name!r}: the structure can move without bending, so it has no static deflection; "
                "add a support, or a spring to the base"
            )
        if self.springs.size or self.bearings:
            return np.asarray(self.shapes(points) @ np.linalg.solve(self.stiff(), loads.T))
        return (self.shapes(points) / self.omega**2) @ loads.T


def _sum(*parts: np.ndarray) -> np.ndarray:
    """Return the sum of the matrices that are not empty."""
    return functools.reduce(np.add, [part for part in parts if part.size] or [no_matrix()])


@functools.lru_cache(maxsize=256)  # of models, which are never equal to another one, here and below
def _input(model: LinearModel, kind: str, number: int) -> np.ndarray:
    rig = model.rig
    if refusal := rig.linear.refusal(kind):
        raise RigError(f"rig {rig.name!r}: {refusal}")
    if kind != "base":
        return read_only(model.push(number))
    along = rig.inputs[number].unit_direction
    force = -(model.influence @ along)
    if not force.any():
        raise RigError(
            f"rig {rig.name!r}: the base moves along {tuple(along.tolist())}, which moves no mass of the structure; "
            "give another shaker.direction"
        )
    return read_only(force)


@functools.lru_cache(maxsize=64)
def _eigenmotions(model: LinearModel, spin: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Eigenvalues (2 n,) and vectors (2 n, 2 n) of the state matrix with rows of one size, and their scale (2 n,)."""
    scale = np.concatenate((np.ones(model.size), np.maximum(model.omega, 1.0)))
    return (*np.linalg.eig(model.state(spin) / scale[:, None] * scale), scale)


@functools.lru_cache(maxsize=64)
def _drive(model: LinearModel, spin: float) -> np.ndarray:
    _, vectors, scale = _eigenmotions(model, spin)
    if not np.linalg.cond(vectors, 1) < WORST_POLES:
        raise np.linalg.LinAlgError("poles have no vectors of their own")
    return np.asarray((np.linalg.inv(vectors) / scale)[:, model.size :])
