"""What sensors of a structure along y and z show of forces in its clearances and of what excites it, at any spin.

Without filling and contact the structure is linear: every channel reads y(ω) = G(ω, Ω) θ(ω), with θ the forces along y
and z in the clearances, and the excitation. Gyroscopic moments and damping that turns couple the modes: G is a sum over
the poles of the whole.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..rig import Rig
from ..rig.points import probe_point
from .spatial import SpatialModel

__all__ = ["SpatialGains"]


@dataclass(frozen=True, eq=False)
class SpatialGains:
    """A structure along y and z as channels see it; its methods are those of `ModalModel`."""

    model: SpatialModel
    """the structure, whose rig has the sensors"""
    spin: float = 0.0
    """Ω, rad/s"""
    direction: tuple[float, float, float] | None = None
    """(x, y, z) along which it is excited; None: that of the rig's shaker"""

    @property
    def size(self) -> int:
        """Number of degrees of freedom."""
        return self.model.size

    def driven(self, tested: Rig) -> SpatialGains:
        """Return the structure driven as in a test, and turning at its spin: of a ramp in the middle of its ends.

        Parameters
        ----------
        tested : Rig
            Whose shaker and spin are those of the test.
        """
        spin = tested.spin
        mean = 0.0 if spin is None else spin.speed if spin.until is None else (spin.speed + spin.until) / 2
        return dataclasses.replace(self, spin=mean, direction=tuple(tested.shaker.unit_direction.tolist()))

    @functools.cached_property
    def _driven_model(self) -> SpatialModel:
        rig = self.model.rig
        if self.direction is None or tuple(rig.shaker.unit_direction) == self.direction:
            return self.model
        shaker = dataclasses.replace(rig.shaker, direction=self.direction)
        return dataclasses.replace(self.model, rig=rig.replace(shaker=shaker))

    @property
    def at_bushings(self) -> np.ndarray:
        """(2 n_bushings, n) y and z in the middle of each clearance."""
        n = len(self.model.rig.bushings)
        return self.model.at_points[:n].reshape(2 * n, self.size)

    @property
    def at_ends(self) -> np.ndarray:
        """(4 n_bushings, n) both ends along y, then along z, of each clearance."""
        n = len(self.model.rig.bushings)
        ends = self.model.at_points[n:].reshape(n, 2, 2, self.size)
        return np.ascontiguousarray(ends.transpose(0, 2, 1, 3)).reshape(4 * n, self.size)

    @property
    def at_points(self) -> np.ndarray:
        """(6 n_bushings, n) `at_bushings`, then `at_ends`."""
        return np.vstack((self.at_bushings, self.at_ends))

    def at_probes(self, values: Mapping[str, float]) -> np.ndarray:
        """Return the displacements (2 n_bushings, n) that two probes in each clearance read, turned as in the rig file.

        Parameters
        ----------
        values : mapping of str to float
            Gains and places that are not 1 and the clearance's middle: "probes[0].gain" and "probes[1].gain" of the
            first clearance, "probes[0].position" of both in m.
        """
        rig = self.model.rig
        points = [probe_point(j, b, values.get(f"probes[{j}].position"), False) for j, b in enumerate(rig.bushings)]
        found = self.model._clearances(points)
        for j, bushing in enumerate(rig.bushings):
            cos, sin = np.cos(bushing.probe_angle), np.sin(bushing.probe_angle)
            found[j] = np.array([[cos, sin], [-sin, cos]]) @ found[j]
        gains = [values.get(f"probes[{i}].gain", 1.0) for i in range(2 * len(rig.bushings))]
        return np.asarray(found.reshape(-1, self.size) * np.array(gains)[:, None])

    def channel_gains(
        self, probes: np.ndarray, kind: str, omega: np.ndarray, at: np.ndarray | None = None
    ) -> np.ndarray:
        """Return gains (n_f, n_sensors + n_probes + 1, n_forces + 1) as `ModalModel.channel_gains` does.

        Parameters
        ----------
        probes : ndarray, shape (n_probes, n)
            Displacements that probes read, such as `at_probes`.
        kind : str
            Kind of excitation: "base", "force" or "spin", of a shaft that turns alone: as the base.
        omega : ndarray, shape (n_f,)
            Angular frequencies, rad/s, real or complex.
        at : ndarray, shape (n_forces, n), optional
            Where the forces act; by default in the clearances' middles.
        """
        model = self._driven_model
        seen = model.sensor_rows.gains(
            lambda rows: self.displacement_gains(rows, kind, omega, at), probes, omega, kind != "force"
        )
        itself = np.zeros((omega.size, 1, seen.shape[2]), dtype=complex)
        itself[:, :, -1] = 1.0
        found, rig = np.concatenate((seen, itself), axis=1), model.rig
        of_probes = [b.probe_delay for b in rig.bushings for _ in "YZ"][: len(probes)]
        for i, delay in enumerate([*(s.delay for s in rig.sensors), *of_probes, rig.shaker.delay]):
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
        own = self._driven_model.input("force" if kind == "force" else "base")
        return self.responses(rows, np.vstack((-(self.at_bushings if at is None else at), own)).T, omega)

    def responses(self, rows: np.ndarray, inputs: np.ndarray, omega: np.ndarray) -> np.ndarray:
        """Return displacements (n_f, n_rows, n_inputs) with rows (n_rows, n) under forces on the modes (n, n_inputs).

        Parameters
        ----------
        rows, inputs : ndarray
            Shapes.
        omega : ndarray, shape (n_f,)
            Angular frequencies, rad/s, real or complex.
        """
        model = self.model
        if not (self._coupled or model.coupling.size):
            products = rows[:, None, :] * inputs.T[None]
            receptance = 1 / (model.omega**2 - omega[:, None] ** 2 + 1j * omega[:, None] * model.damping)
            return np.asarray((receptance @ products.reshape(-1, self.size).T).reshape(omega.size, len(rows), -1))
        poles, motion, drive = self._poles
        products = (rows @ motion)[:, None, :] * (drive @ inputs).T[None]
        gains = (1 / (1j * omega[:, None] - poles)) @ products.reshape(-1, poles.size).T
        return np.asarray(gains.reshape(omega.size, len(rows), -1))

    @property
    def _coupled(self) -> bool:
        return bool(self.spin and (self.model.gyroscopic.any() or self.model.circulatory.any()))

    @functools.cached_property
    def _poles(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Poles (2n,), the motion (n, 2n) of each, and what a force on each mode drives of it (2n, n)."""
        model, n = self.model, self.size
        damping, stiffness = np.diag(model.damping), np.diag(model.omega**2)
        if model.coupling.size:
            damping = damping + model.coupling
        if self._coupled:
            damping = damping + self.spin * model.gyroscopic
            stiffness = stiffness + self.spin * model.circulatory
        state = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -damping]])
        scale = np.concatenate((np.ones(n), np.maximum(model.omega, 1.0)))  # rows of one size
        poles, vectors = np.linalg.eig(state / scale[:, None] * scale)
        return poles, vectors[:n], np.linalg.inv(vectors)[:, n:] / scale[n:]
