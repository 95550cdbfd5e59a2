"""Laws of round clearances fitted to the forces that probes show: parameters and residuals."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...clearance.contacts.kelvin_voigt import LinearContact
from ...clearance.family import CONTACT_FAMILIES, ContactFamily, FillingFamily
from ...clearance.greases.bouc_wen import LinearWithFilm
from ...clearance.greases.oil_film import OilFilled
from ...estimate import Parameter, Problem, UnknownScale, one_by_one
from ...estimate.problem import LinearisedResiduals
from ...rig import Bushing, Rig
from ..laws.case import HOLE, ClearanceWithLaw, case_of, forces_along, nominal_of, open_parameters
from ..laws.measured_motion import WIDE
from .forces import Forces, run_out
from .windows import RecordWindow

__all__ = ["ClearanceFamilies", "LawProblem", "acts_without_contact", "law_parameters", "places_of"]

KEPT_MOTIONS = 4  # of probes' gains and turns
STEP = 1e-8  # coordinates, of differences: so small that no sample enters or leaves a wall, where forces jump
FAINT = 1e-3  # N/m, of a contact that is never met
MAX_RESIDUAL = 1e6  # of the expected error: a law that misses more diverges
LARGEST_CORRELATION = 30.0  # residuals that count as one observation on the way


class ClearanceFamilies(NamedTuple):
    """A clearance and the families of its law."""

    number: int
    nominal: Bushing  #: with the shaft's radius
    contact: ContactFamily
    filling: FillingFamily


def places_of(rig: Rig, contacts: Sequence[str | None] = ()) -> list[ClearanceFamilies]:
    """Return a rig's clearances: oil where the rig file has it, else springs and a squeeze film.

    Parameters
    ----------
    rig : Rig
        As its file has it.
    contacts : sequence of str or None
        Names of the families of their contacts; by default, and where None, they are linear.
    """
    of_contacts = [CONTACT_FAMILIES[name or LinearContact.name] for name in contacts or [None] * len(rig.bushings)]
    fillings = [OilFilled() if bushing.film else LinearWithFilm() for bushing in rig.bushings]
    return [ClearanceFamilies(j, nominal_of(rig, j), *both) for j, both in enumerate(zip(of_contacts, fillings))]


def law_parameters(
    place: ClearanceFamilies, priors: Sequence[Parameter], rest: tuple[float, ...], turns: bool, weight: float,
    touching: bool,
) -> list[Parameter]:  # fmt: skip
    """Return the open parameters of a clearance's law, named by its number.

    Parameters
    ----------
    place : Place
        The clearance.
    priors : sequence of Parameter
        Of the rig file.
    rest : tuple of float
        From its middle to where the shaft rests, as the rig file has it, m.
    turns : bool
        True if the shaft turns in any record.
    weight : float
        N, of the size of the force at rest, which moves nothing and is unknown.
    touching : bool
        True if the shaft may touch; else gap, contact and friction are left out where only contact identifies them.
    """
    key = f"bushings[{place.number}]"
    shape = open_parameters(place.number, place.nominal, priors, rest, turns)
    law = [*place.contact.parameters(place.nominal), *_filling_parameters(place)]
    rest_forces = [
        Parameter(f"{key}.force at rest {axis}", "N", 0.0, -50 * weight, 50 * weight, weight, "linear") for axis in "yz"
    ]
    parameters = [*shape, *(dataclasses.replace(p, name=f"{key}.{p.name}") for p in law), *rest_forces]
    return parameters if touching else [p for p in parameters if acts_without_contact(p.name, place.filling)]


def acts_without_contact(name: str, filling: FillingFamily) -> bool:
    """Return True if a law's parameter acts on a shaft that touches no wall; an oil film's force depends on the gap."""
    field = name.rpartition("].")[2]
    if field in HOLE or field.startswith(("contact ", "friction")):
        return False
    return filling.round_only or field not in ("gap", "rest_y", "rest_z")


def _filling_parameters(place: ClearanceFamilies) -> list[Parameter]:
    """Return the filling's open parameters: a dry bushing, whose rig file has no spring, has none."""
    dry = not place.nominal.grease.stiffness
    return [p for p in place.filling.parameters(place.nominal) if not (dry and p.name == "grease stiffness")]


class LawProblem(Problem):
    """Uncertain parameters of a rig and its clearances' laws, with the residuals of their forces, window by window."""

    def __init__(
        self, forces: Forces, places: Sequence[ClearanceFamilies], law_priors: Sequence[Parameter],
        touching: bool = True,
    ) -> None:  # fmt: skip
        self.forces, self.places, self.touching = forces, tuple(places), touching
        self.n_linear = len(forces.parameters)
        blocks = 2 * forces.displacement[0].size * _block_starts(forces.windows)
        parameters, loss = [*forces.parameters, *law_priors], UnknownScale(blocks, LARGEST_CORRELATION)
        super().__init__(parameters, one_by_one(self._residual), loss=loss, lanes=False)
        self.names = [p.name for p in self.parameters]
        self._acts = np.array([by.any() for by in forces.per_force_by], dtype=bool)
        self._rest = [self.names.index(f"bushings[{p.number}].force at rest {axis}") for p in places for axis in "yz"]
        moving = [i for i, n in enumerate(self.names) if i >= self.n_linear or n.endswith((".gain", ".probe_angle"))]
        self._moving = np.setdiff1d(moving, self._rest)
        """numbers of the parameters on which forces of laws depend"""
        slow, surface = forces.slow, run_out(dict(zip(self.names, forces.at.tolist())), forces.displacement.shape[2])
        self._shown = slow.x - slow.waves @ surface, slow.v - slow.waves_by_time @ surface
        self._of_probes = [n for n in self.names if n.endswith((".gain", ".probe_angle"))]
        self._moved: dict[tuple[float, ...], list[tuple[np.ndarray, np.ndarray]]] = {}
        self._known: tuple[bytes, np.ndarray] | None = None

    def law_forces(self, values: np.ndarray) -> np.ndarray:
        """Return the forces (n_t, m) of laws at parameters (n,), N."""
        by_name, slow = dict(zip(self.names, values.tolist())), self.forces.slow
        out = np.empty(slow.x.shape)
        for place, (x, v) in zip(self.places, self.points(by_name)):
            columns = slice(2 * place.number, 2 * place.number + 2)
            out[:, columns] = forces_along(self.case(place, by_name), x, v, slow.spin, 1 / slow.rate)
        return out

    def points(self, known: Mapping[str, float]) -> list[tuple[np.ndarray, np.ndarray]]:
        """Motion and velocity (n_t, 3, 2) of the middle and both ends of each clearance, by gains and turn of probes.

        Run-out is that of the point about which the forces are linearised.
        """
        key = tuple(known.get(name, 0.0) for name in self._of_probes)
        if key not in self._moved:
            if len(self._moved) >= KEPT_MOTIONS:
                self._moved.clear()
            self._moved[key] = [self._at_ends(place, known) for place in self.places]
        return self._moved[key]

    def _at_ends(self, place: ClearanceFamilies, known: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
        forces, j = self.forces, place.number
        columns = slice(2 * j, 2 * j + 2)
        angle = known.get(f"bushings[{j}].probe_angle", place.nominal.probe_angle)
        c, s = np.cos(angle), np.sin(angle)
        gain = np.array([known.get(f"probes[{i}].gain", 1.0) for i in (2 * j, 2 * j + 1)])
        rotation = np.array([[c, s], [-s, c]]) / gain[:, None]
        x, v = np.empty((2, len(forces.tilt), 3, 2))
        for points, shown, tilt in zip((x, v), self._shown, (forces.tilt, forces.tilt_speed)):
            points[:, 0] = shown[:, columns] @ rotation
            points[:, 1:] = tilt[:, :, columns] + points[:, :1]
        return x, v

    def end_positions(self, place: ClearanceFamilies, known: Mapping[str, float]) -> np.ndarray:
        """Return where both ends of a clearance's shaft are from its middle (n_t, 2, 2), m, along y and z.

        Parameters
        ----------
        place : Place
            The clearance.
        known : mapping of str to float
            Values of parameters.
        """
        rest = [known.get(f"bushings[{place.number}].rest_{axis}", 0.0) for axis in "yz"]
        return np.asarray(self.points(known)[place.number][0][:, 1:] + rest)

    def contact(self, values: np.ndarray) -> np.ndarray:
        """Return the fraction of time in contact (n_bushings,) at parameters (n,)."""
        by_name = dict(zip(self.names, values.tolist()))
        distances = [np.linalg.norm(self.end_positions(place, by_name), axis=2).max(axis=1) for place in self.places]
        gaps = [by_name.get(f"bushings[{p.number}].gap", p.nominal.gap) for p in self.places]
        return np.array([np.mean(r > gap) if self.touching else 0.0 for r, gap in zip(distances, gaps)])

    def spectral_residuals(self, values: np.ndarray) -> np.ndarray:
        """Return the residuals (n_windows, n_f, m) of the probes' signals, over their expected errors."""
        change = values[: self.n_linear] - self.forces.at
        shown = self.forces.displacement + self.forces.displacement_by @ change
        return np.asarray(shown - times(self._per_force(change), self._dynamic_forces(values)))

    def _dynamic_forces(self, values: np.ndarray) -> np.ndarray:
        """(n_windows, n_f, m) spectra of the forces of laws above those at rest, N."""
        forces = self.forces
        return forces.of_laws(self.law_forces(values)) - forces.unit_force[:, :, None] * values[self._rest]

    def linearised(self, at: np.ndarray, residuals: np.ndarray | None = None) -> LinearisedResiduals:
        """Return residuals and Jacobian: by differences for parameters of laws' forces, else exact, as it is linear.

        Parameters
        ----------
        at : ndarray, shape (n,)
            Coordinates of the point.
        residuals : ndarray, shape (n_residuals,), optional
            Residuals there; they are computed in any case.
        """
        values = self.values(at)
        change, forces = values[: self.n_linear] - self.forces.at, self._dynamic_forces(values)
        per_force = self._per_force(change)
        shown = self.forces.displacement + self.forces.displacement_by @ change
        base = real(shown - times(per_force, forces))
        jacobian = np.zeros((base.size, self.size))
        for i in (*range(self.n_linear), *self._rest):
            column = self.shown_by(i, values, per_force)
            if i < self.n_linear and self._acts[i]:
                column = column - times(self._per_coordinate(i, values) * self.forces.per_force_by[i], forces)
            jacobian[:, i] = real(column)
        for i in self._moving:
            step = -STEP if at[i] + STEP > self.high[i] else STEP
            shifted = self._dynamic_forces(self.values(at + step * (np.arange(self.size) == i)))
            jacobian[:, i] -= real(times(per_force, (shifted - forces) / step))
        self.evaluations += 1 + self._moving.size
        return LinearisedResiduals(np.where(np.abs(base) < MAX_RESIDUAL, base, np.inf), jacobian)

    def shown_by(self, i: int, values: np.ndarray, per_force: np.ndarray) -> np.ndarray:
        """Return the derivative (n_windows, n_f, m) of the probes' signals by a coordinate i in which they are linear.

        Parameters
        ----------
        i : int
            Of the rig's numbers, or a force at rest.
        values : ndarray, shape (n,)
            Values of all parameters.
        per_force : ndarray, shape (n_windows, n_f, m, m)
            Response of the probes to forces, over its expected error.
        """
        by_unit = self._per_coordinate(i, values)
        if i < self.n_linear:
            return by_unit * self.forces.displacement_by[..., i]
        return np.asarray(by_unit * self.forces.unit_force[:, :, None] * per_force[..., self._rest.index(i)])

    def _per_coordinate(self, i: int, values: np.ndarray) -> float:
        """Return the derivative of parameter i by its coordinate."""
        return float(self.unit[i] * (1.0 if self.parameters[i].transform == "linear" else values[i]))

    def _per_force(self, change: np.ndarray) -> np.ndarray:
        """(n_windows, n_f, m, m) response of the probes to forces, over its expected error."""
        key = change.tobytes()
        if self._known is None or self._known[0] != key:
            changed = np.flatnonzero(change * self._acts)
            by = np.tensordot(change[changed], self.forces.per_force_by[changed], 1)
            self._known = key, self.forces.per_force + by
        return self._known[1]

    def _residual(self, values: np.ndarray) -> np.ndarray:
        residuals = real(self.spectral_residuals(values))
        return np.where(np.abs(residuals) < MAX_RESIDUAL, residuals, np.inf)

    def case(self, place: ClearanceFamilies, known: Mapping[str, float]) -> ClearanceWithLaw:
        """Return a clearance and its law.

        Parameters
        ----------
        place : Place
            The clearance.
        known : mapping of str to float
            Values of parameters.
        """
        prefix, fields = f"bushings[{place.number}].", {"contact stiffness": FAINT, "rest_y": 0.0, "rest_z": 0.0}
        fields |= {name.removeprefix(prefix): value for name, value in known.items() if name.startswith(prefix)}
        case = case_of(fields, place.nominal, place.contact, place.filling)
        if self.touching:
            return case
        return case._replace(bushing=dataclasses.replace(case.bushing, gap=WIDE * case.bushing.gap, friction=None))


def times(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Return the product of matrices (..., m, m) and vectors (..., m)."""
    return np.einsum("...ij,...j->...i", matrix, vector)


def real(spectra: np.ndarray) -> np.ndarray:
    """Return real and imaginary parts of spectra (n_windows, ...), window after window."""
    return np.ascontiguousarray(spectra).view(float).reshape(len(spectra), -1).ravel()


def _block_starts(windows: Sequence[RecordWindow]) -> np.ndarray:
    """First window of each block: a record at one speed repeats itself, in a run-up every window is new."""
    names = [(w.record, -1 if w.steady else i) for i, w in enumerate(windows)]
    return np.array([i for i in range(len(names)) if i == 0 or names[i] != names[i - 1]])
