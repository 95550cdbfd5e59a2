"""The linear part of a rig: reduced to uncoupled modes, which engines, identification and placement work with.

A truncated set of modes is too stiff under a point force. `ritz_model` therefore keeps, beside the lowest modes, the
static shape under a unit force at each clearance and force shaker: they carry the residual flexibility of the modes
left out (MacNeal 1971; Rubin 1975) as further degrees of freedom, so the displacement at a contact needs no algebraic
correction.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .core.errors import RigError
from .core.kinds import checks_kinds
from .rig import Rig
from .rig.points import probe_point
from .rig.sensing import SensorRows, sensor_rows
from .structure.base import Rows

if TYPE_CHECKING:
    import control

__all__ = ["ModalModel", "linear_frf", "mode_shapes", "natural_frequencies", "ritz_model", "state_space"]

WORST_POLES = 1e10  # condition of the poles' vectors beyond which they are not used
MAX_MODES = 60  # Modes in a Ritz basis beyond which nothing is gained


@dataclass(frozen=True, eq=False)
class ModalModel:
    """A rig's structure reduced to modes of unit mass: q̈ + 2ζω q̇ + C q̇ + ω² q = Φᵀ f - Γ a_base (Eq. 3).

    Made by `ritz_model`.
    """

    rig: Rig
    """the rig"""
    omega: np.ndarray
    """(n,) natural circular frequencies, 1/s; 0 of a rigid body"""
    damping: np.ndarray
    """(n,) 2ζω, 1/s, of the structure's own damping"""
    coupling: np.ndarray
    """(n, n) C, 1/s: damping that couples modes, with zeros on the diagonal; (0, 0) if none does"""
    participation: np.ndarray
    """(n,) Γ, sqrt(kg), for the shaker's direction"""
    stiffness_included: bool
    """whether the grease stiffness is part of ω"""
    _rows: Rows
    _transform: np.ndarray

    @property
    def size(self) -> int:
        """Number of degrees of freedom."""
        return self.omega.size

    def shapes(self, points: Sequence[float | str] | np.ndarray) -> np.ndarray:
        """Return the mode shapes, of unit modal mass; of a shaft positive at its last position.

        Parameters
        ----------
        points : sequence of Point, length n_points
            Positions, m, or degrees of freedom.

        Returns
        -------
        ndarray, shape (n_points, n)
            1/sqrt(kg).
        """
        at = points.tolist() if isinstance(points, np.ndarray) else list(points)
        return np.ascontiguousarray(self._rows(at) @ self._transform).reshape(-1, self.size)

    @functools.cached_property
    def at_bushings(self) -> np.ndarray:
        """(n_bushings, n) relative displacement in the middle of each clearance."""
        return self._relative(self.rig.clearance_points)

    @functools.cached_property
    def at_ends(self) -> np.ndarray:
        """(2 n_bushings, n) relative displacement at both ends of each clearance."""
        return self._relative(self.rig.clearance_ends)

    @functools.cached_property
    def at_points(self) -> np.ndarray:
        """(3 n_bushings, n) the clearances' middles, then both ends of each."""
        return np.vstack((self.at_bushings, self.at_ends))

    @functools.cached_property
    def sensor_rows(self) -> SensorRows:
        """What the sensors read of the coordinates and of the base."""
        return sensor_rows(self.rig, lambda points, _: self.shapes(points), self.size)

    @property
    def at_sensors(self) -> np.ndarray:
        """(n_sensors, n) what the sensors read of the coordinates, before it is differentiated to their order."""
        return self.sensor_rows.rows

    @property
    def sensors_on_base(self) -> np.ndarray:
        """(n_sensors,) the same of the base."""
        return self.sensor_rows.on_base

    def input(self, kind: str) -> np.ndarray:
        """Return the force (n,) on the modes per unit of excitation: N per m/s² of the base, or per N of the shaker.

        Parameters
        ----------
        kind : str
            Kind of excitation: "base" or "force".

        Raises
        ------
        RigError
            If the structure does not tell what the excitation does to it, or the base moves none of its masses.
        """
        if refusal := self.rig.linear.refusal(kind):
            raise RigError(f"rig {self.rig.name!r}: {refusal}")
        if kind == "base":
            if not self.participation.any():
                along = tuple(self.rig.shaker.unit_direction.tolist())
                raise RigError(
                    f"rig {self.rig.name!r}: the base moves along {along}, which moves no mass of the structure; "
                    "give another shaker.direction"
                )
            return -self.participation
        points, factors = self.rig.shaker.pushed()
        return factors @ self.shapes(points)

    def receptance(self, omega: np.ndarray) -> np.ndarray:
        """Return the modes' displacement per unit force on them at circular frequencies (n_f,), 1/s.

        Parameters
        ----------
        omega : ndarray, shape (n_f,)
            Angular frequencies, rad/s.

        Returns
        -------
        ndarray, shape (n_f, n) or, where damping couples the modes, (n_f, n, n), complex
        """
        dynamic = self.omega**2 - omega[:, None] ** 2 + 1j * omega[:, None] * self.damping
        if not self.coupling.size:
            return 1 / dynamic
        return np.linalg.inv(dynamic[:, None] * np.eye(self.size) + 1j * omega[:, None, None] * self.coupling)

    def at_probes(self, values: Mapping[str, float]) -> np.ndarray:
        """Return the displacement (n_bushings, n) that a probe in each clearance reads.

        Parameters
        ----------
        values : mapping of str to float
            Gains and places that are not 1 and the clearance's middle: "probes[0].gain", "probes[0].position" in m.
        """
        places = [values.get(f"probes[{j}].position") for j in range(len(self.rig.bushings))]
        gains = [values.get(f"probes[{j}].gain", 1.0) for j in range(len(self.rig.bushings))]
        rig = self.rig
        points = [probe_point(j, b, at, bool(rig.fixture)) for j, (b, at) in enumerate(zip(rig.bushings, places))]
        return self._relative(points) * np.array(gains)[:, None]

    def channel_gains(
        self, probes: np.ndarray, kind: str, omega: np.ndarray, at: np.ndarray | None = None
    ) -> np.ndarray:
        """Return what sensors, probes and the excitation itself show of forces in the clearances and of it.

        Without filling and contact the structure is linear, so each channel reads y(ω) = G(ω) θ(ω), with θ the forces
        and the excitation.

        Parameters
        ----------
        probes : ndarray, shape (n_probes, n)
            Displacements that probes read, such as `at_probes`.
        kind : str
            Kind of excitation: "base" or "force".
        omega : ndarray, shape (n_f,)
            Angular frequencies, rad/s, real or complex.
        at : ndarray, shape (n_forces, n), optional
            Where the forces act; by default in the clearances' middles.

        Returns
        -------
        ndarray, shape (n_f, n_sensors + n_probes + 1, n_forces + 1), complex
        """
        seen = self.sensor_rows.gains(
            lambda rows: self.displacement_gains(rows, kind, omega, at), probes, omega, kind == "base"
        )
        itself = np.zeros((omega.size, 1, seen.shape[2]), dtype=complex)
        itself[:, :, -1] = 1.0
        found = np.concatenate((seen, itself), axis=1)
        of_probes = [b.probe_delay for b in self.rig.bushings][: len(probes)]
        for i, delay in enumerate([*(s.delay for s in self.rig.sensors), *of_probes, self.rig.shaker.delay]):
            if delay:
                found[:, i] *= np.exp(-1j * omega * delay)[:, None]
        return found

    def displacement_gains(
        self, rows: np.ndarray, kind: str, omega: np.ndarray, at: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the same (n_f, n_rows, n_forces + 1) of displacements with rows (n_rows, n).

        Parameters
        ----------
        rows, kind, omega, at
            As `channel_gains` takes them.
        """
        inputs = np.vstack((-(self.at_bushings if at is None else at), self.input(kind))).T
        if self.coupling.size:
            return self._coupled_gains(rows, inputs, omega)
        receptance = self.receptance(omega)
        products = rows[:, None, :] * inputs.T[None]
        return (receptance @ products.reshape(-1, self.size).T).reshape(omega.size, len(rows), -1)

    def _coupled_gains(self, rows: np.ndarray, inputs: np.ndarray, omega: np.ndarray) -> np.ndarray:
        """Displacements (n_f, n_rows, n_inputs) where damping couples the modes, by the poles of the whole.

        Poles that have no vectors of their own, as of a free body, leave the inverse at every frequency.
        """
        poles, motion, drive = self._poles
        if motion is None or drive is None:
            return np.asarray(rows @ self.receptance(omega) @ inputs)
        products = (rows @ motion)[:, None, :] * (drive @ inputs).T[None]
        gains = (1 / (1j * omega[:, None] - poles)) @ products.reshape(-1, poles.size).T
        return gains.reshape(omega.size, len(rows), -1)

    @functools.cached_property
    def _poles(self) -> tuple[np.ndarray, np.ndarray | None, np.ndarray | None]:
        """Poles (2n,), the motion (n, 2n) of each, and what a force on each mode drives of it (2n, n)."""
        n = self.size
        state = np.block(
            [[np.zeros((n, n)), np.eye(n)], [-np.diag(self.omega**2), -np.diag(self.damping) - self.coupling]]
        )
        scale = np.concatenate((np.ones(n), np.maximum(self.omega, 1.0)))  # rows of one size
        poles, vectors = np.linalg.eig(state / scale[:, None] * scale)
        if np.linalg.cond(vectors) > WORST_POLES:
            return poles, None, None
        inverse = np.linalg.inv(vectors)
        return poles, vectors[:n], inverse[:, n:] / scale[n:]

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
        return (self.shapes(points) / self.omega**2) @ loads.T

    def _relative(self, joined: Sequence[tuple[float | str, ...]]) -> np.ndarray:
        """Rows of first points less those of second ones, where there are any."""
        rows = self.shapes([points[0] for points in joined])
        second = [i for i, points in enumerate(joined) if len(points) > 1]
        rows[second] -= self.shapes([joined[i][1] for i in second])
        return rows


@functools.lru_cache(maxsize=128)  # a fit's Jacobian draws on some 70 rigs, one record after the other
def ritz_model(rig: Rig, n_modes: int = 8, grease: bool = False) -> ModalModel:
    """Reduce the rig's structure, with its point masses, to modes and static shapes (Eqs 1-6).

    Rigs that differ in gaps, contacts or, without ``grease``, in the grease alone share one reduction.

    Parameters
    ----------
    rig : Rig
        The rig.
    n_modes : int
        Number of modes in the Ritz basis; one static shape for every bushing and point of a force shaker is added.
    grease : bool
        Count the in-gap stiffness of the grease to the structure's. Without it the grease is left to the force side.

    Raises
    ------
    RigError
        If the structure's mass is not positive or its stiffness negative.
    """
    found = rig.reduction(n_modes, grease)
    participation = (found.influence @ rig.shaker.unit_direction) @ found.transform
    return ModalModel(
        rig, found.omega, found.damping, found.coupling, participation, grease, found.rows, found.transform
    )


@checks_kinds
def natural_frequencies(rig: Rig, n: int) -> np.ndarray:
    """Return the natural frequencies of the rig in its in-gap linear state: grease stiffness on, no contact.

    Parameters
    ----------
    rig : Rig
        The rig.
    n : int
        Number of modes.

    Returns
    -------
    ndarray, shape (n,)
        Hz; fewer where the structure has fewer modes.
    """
    return ritz_model(rig, n + 16, grease=True).omega[:n] / (2 * np.pi)


@checks_kinds
def mode_shapes(rig: Rig, x: Sequence[float | str] | np.ndarray, n: int) -> np.ndarray:
    """Return the mode shapes of the rig in its in-gap linear state, of unit modal mass and positive at the tip.

    Parameters
    ----------
    rig : Rig
        The rig.
    x : array_like, shape (n_x,)
        Positions, m, or degrees of freedom.
    n : int
        Number of modes.

    Returns
    -------
    ndarray, shape (n_x, n)
        1/sqrt(kg).
    """
    return ritz_model(rig, n + 16, grease=True).shapes(x)[:, :n]


@checks_kinds
def state_space(rig: Rig, n_modes: int = 16) -> control.StateSpace:
    """Return the linear model of the rig in the gap, the grease a spring and damper at each bushing.

    Parameters
    ----------
    rig : Rig
        The rig.
    n_modes : int
        Modes in the Ritz basis.

    Returns
    -------
    control.StateSpace
        Input: base acceleration (m/s²) or shaker force (N), as ``rig.shaker`` says. Outputs: absolute accelerations
        of the sensors (m/s²), then displacements that probes in the bushings read (m).
    """
    import control  # it brings pyplot, a second of every start

    model, kind = ritz_model(rig, n_modes), rig.shaker.kind
    at_bushing, at_sensor = model.at_bushings, model.at_sensors
    grease_k = np.array([b.grease.stiffness for b in rig.bushings])
    grease_c = np.array([b.grease.damping for b in rig.bushings])
    k = np.diag(model.omega**2) + (at_bushing.T * grease_k) @ at_bushing
    c = np.diag(model.damping) + (at_bushing.T * grease_c) @ at_bushing
    if model.coupling.size:
        c += model.coupling
    b = model.input(kind)
    zero, one = np.zeros((model.size, model.size)), np.eye(model.size)
    a_matrix = np.block([[zero, one], [-k, -c]])
    b_matrix = np.concatenate((np.zeros(model.size), b))[:, None]
    c_matrix = np.block([[-at_sensor @ k, -at_sensor @ c], [model.at_probes({}), np.zeros_like(at_bushing)]])
    direct = at_sensor @ b + (model.sensors_on_base if kind == "base" else 0.0)
    d_matrix = np.concatenate((direct, np.zeros(len(rig.bushings))))[:, None]
    return control.ss(a_matrix, b_matrix, c_matrix, d_matrix)


@checks_kinds
def linear_frf(rig: Rig, frequency: ArrayLike, n_modes: int = 16) -> np.ndarray:
    """Return the accelerance (transmissibility for a shaken base) of the sensors in the gap, through python-control.

    Parameters
    ----------
    rig : Rig
        The rig.
    frequency : array_like, shape (n_f,)
        Hz.
    n_modes : int
        Modes in the Ritz basis.

    Returns
    -------
    ndarray, shape (n_sensors, n_f), complex
    """
    import control

    omega = 2 * np.pi * np.asarray(frequency, dtype=float)
    response = control.frequency_response(state_space(rig, n_modes), omega)
    return np.asarray(response.frdata)[: len(rig.sensors), 0] * np.exp(-1j * np.outer(rig.delays, omega))
