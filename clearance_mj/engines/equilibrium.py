"""Static equilibrium of a structure under gravity and loads, with fillings and films, contact, friction."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..clearance.follower import SLOWEST_IMPACT, signed_penetration
from ..clearance.grease import GreaseModel
from ..clearance.kernel import BRISTLES
from ..clearance.law import Law
from ..clearance.modelled import Modelled, rig_and_law
from ..clearance.record import END_MEMORY, Clearance, fillings_of
from ..core.errors import SimulationError
from ..core.kinds import checks_kinds
from ..linear import LinearModel, linear_model
from ..rig import Bushing, Rig
from .scheme import at_rows, places_of

__all__ = ["ChainModes", "Equilibrium", "equilibrium_of", "rest_of", "static_equilibrium"]

PATH = 64  # steps from the unloaded position along which hysteresis is followed
SMALL = 1e-6  # of a gap: step of difference quotients for stiffnesses
TOLERANCE = 1e-12  # imbalance over the acting forces
ITERATIONS = 200
UNLIMITED = 1e-9  # of a motion without stiffness: its component in a clearance within rounding
SOFTENING = 10.0 ** -np.arange(8)  # of springs that restrain rigid-body motions, over weight per gap


class ChainModes(NamedTuple):
    """The modes of a MuJoCo model, of unit mass, for statics."""

    omega: np.ndarray  # (n,) natural circular frequencies, 1/s
    circulatory: np.ndarray  # (n, n) H; (0, 0) if there is none
    weight: np.ndarray  # (n,) steady force on the modes
    at_points: np.ndarray  # of `at_rows`, (rows, n)
    moved: Callable[[Sequence[float | str]], np.ndarray]  # as of `LinearModel`

    def stiff(self, spin: float) -> np.ndarray:
        """Return K + Ω H (n, n) at a spin, rad/s."""
        return np.diag(self.omega**2) + (spin * self.circulatory if self.circulatory.size else 0.0)


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """A rig at rest under its weight and loads, turning or not. Made by `static_equilibrium`."""

    rig: Rig
    """the rig"""
    displacement: np.ndarray
    """(2 n_bushings,) y and z in the bushings' middles from the unloaded shaft, m; see `Rig.probe_labels`. Of a planar
    rig (n_bushings,), here and below"""
    contact_force: np.ndarray
    """(2 n_bushings,) of the bushings on the shaft, positive against positive displacement, N"""
    grease_force: np.ndarray
    """(2 n_bushings,) of fillings, same sign, N"""
    coordinates: np.ndarray
    """(n,) of the modes"""
    model: LinearModel | ChainModes
    """model of the coordinates"""
    _fillings: tuple[_Filling, ...]
    _contacts: tuple[_EndContact, ...]

    def deflection(self, points: Sequence[float | str]) -> np.ndarray:
        """Return the sag of points from the unloaded shaft: y and z (n_points, 2), m.

        Parameters
        ----------
        points : sequence of Point, length n_points
            Positions, m, or degrees of freedom.
        """
        return np.asarray(self.model.moved(points) @ self.coordinates)

    def columns(self) -> np.ndarray:
        """Return the clearances' columns of a run at rest: (3 n_rows + n_bushings,); see `Run.advance`."""
        touches = [float(self.contact_force[rows].any()) for rows in self.rig.clearance_rows]
        return np.concatenate((self.displacement, self.contact_force, self.grease_force, touches))

    def begin(self, clearance: Clearance) -> None:
        """Write the equilibrium into the records of compiled loops.

        Parameters
        ----------
        clearance : Clearance
            Clearances of the rig, changed in place.
        """
        numbers = clearance.numbers
        middles, ends = _at_clearances(self.rig, _rows(self.model) @ self.coordinates)
        for j, (record, filling, middle) in enumerate(zip(clearance.bushings, self._fillings, middles)):
            numbers[record["place"] : record["place"] + middle.size] = middle
            filling.force_at(middle)
            numbers[record["memory"] : record["memory"] + len(filling.states)] = filling.states
            for end in range(2):
                place = ends[2 * j + end]
                depth, direction = self._contacts[2 * j + end].depth(place)
                if depth <= 0:
                    continue
                memory = record["ends"] + END_MEMORY * end
                if record["touching"] == 1:
                    numbers[memory] = SLOWEST_IMPACT * direction[0]
                    continue
                numbers[memory : memory + BRISTLES] = SLOWEST_IMPACT, *direction
                numbers[memory + BRISTLES : memory + END_MEMORY] = 0.0, *place


def _rows(model: LinearModel | ChainModes) -> np.ndarray:
    return model.at_points if isinstance(model, ChainModes) else at_rows(model)


def _at_clearances(rig: Rig, rows: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Select from rows, of `_rows`, those of the middle of each clearance, and of both ends of each, end by end.

    An end of a slot that rubs has the sliding direction before the pressing one.
    """
    ends = places_of(rig)[:, 1:].reshape(-1, 2)
    return [rows[part] for part in rig.clearance_rows], [rows[[y, z] if y != z else [z]] for y, z in ends]


class _Filling:
    """Filling of a clearance, moved slowly from the unloaded position."""

    def __init__(self, bushing: Bushing, model: GreaseModel, spin: float):
        self.model, self.parameters, self.spin, size = model, model.parameters(), spin, bushing.n_coordinates
        self.offset = np.array([bushing.offset_y, bushing.offset])[-size:]
        self.states, self.preload = [0.0] * model.states(size), np.array(model.at_rest(tuple(self.offset.tolist()))[0])

    def force_at(self, place: np.ndarray) -> np.ndarray:
        """Return the force at a place, m, (2,) or (1,), beyond that at the offset; update the states."""
        self.states = [0.0] * len(self.states)
        steps = PATH if self.states and not self.model.is_linear() else 1
        out, step = [0.0] * 6, place / steps
        for i in range(1, steps + 1):
            position = tuple((self.offset + i * step).tolist())
            self.model.law(self.parameters, self.states, position, tuple(step.tolist()), self.spin, 1e6, out)
        return np.array(out[: place.size]) - self.preload


class _EndContact:
    """Contact at one end of a clearance, sticking or sliding."""

    def __init__(self, bushing: Bushing, parameters: np.ndarray, law: Callable[..., None], surface: float):
        self.bushing, self.parameters, self.law = bushing, tuple(parameters), law
        turns = bushing.friction and bushing.friction.along is None
        sliding = np.sign(surface) * (bushing.friction.coefficient if bushing.friction and turns else 0.0)
        self.friction, self.offset = float(sliding), np.array([bushing.offset_y, bushing.offset])
        self.wall, self.of_wall = bushing.wall_model, bushing.wall_model.parameters(bushing.gap)
        self.reach = self.wall.reach(bushing.gap)

    def depth(self, place: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the penetration at a place, m, (2,) or (1,), < 0 in the gap, and the wall's normal."""
        if place.size == 1:
            g = signed_penetration(float(place[0]), *self.bushing.walls)
            return abs(g), np.sign([g])
        out, from_middle = [0.0] * 3, place + self.offset
        if np.linalg.norm(from_middle) <= self.reach:
            return -1.0, np.zeros(2)
        self.wall.law(self.of_wall, tuple(from_middle.tolist()), out)
        return out[0], np.array(out[1:])

    def force_at(self, place: np.ndarray) -> np.ndarray:
        """Return the force at a place, m, (2,) or (1,)."""
        depth, n = self.depth(place)
        if depth <= 0:
            return np.zeros(place.size)
        out = [0.0, 0.0]
        self.law(self.parameters, depth, 0.0, SLOWEST_IMPACT, out)
        tangential = self.friction * np.array([-n[1], n[0]]) if self.friction else 0.0
        return np.asarray(out[0] / 2 * depth * (n + tangential))


@checks_kinds
def static_equilibrium(model: Rig | Modelled, law: Law | None = None, n_modes: int = 8) -> Equilibrium:
    """Compute the static equilibrium of a rig under gravity and loads, with contact and films.

    Fillings are followed on a straight path from the unloaded shaft. In a contact a shaft that does not turn sticks; a
    turning one slides. Unbalance and excitation do not act. Gears whose torques are not in balance rest relative to
    each other, and accelerate together.

    Parameters
    ----------
    model : Model or Rig
        The model or rig.
    law : Law, optional
        Contact and filling of a rig; without one, its datasheet values.
    n_modes : int
        Modes of each plane, to which static shapes are added.

    Raises
    ------
    RigError
        If no support carries a load.
    SimulationError
        If there is no equilibrium: the shaft is unrestrained, or friction and films prevent it.
    """
    rig, law = rig_and_law(model, law)
    return equilibrium_of(rig, law, linear_model(rig, n_modes))


def rest_of(rig: Rig, law: Law, modes: int) -> Equilibrium | None:
    """Return the equilibrium of a rig, or None if neither a load nor a turning film moves it from 0."""
    return static_equilibrium(rig, law, modes) if rig.gravity or rig.loads or rig.spin else None


def equilibrium_of(rig: Rig, law: Law, whole: LinearModel | ChainModes) -> Equilibrium:
    """Compute the equilibrium of a structure that represents a rig's; see `static_equilibrium`."""
    spin = rig.spin.speed if rig.spin else 0.0
    fillings, contacts = _forces(rig, law, spin)
    q = _solve(rig, whole, [*fillings, *contacts], spin)
    middles, ends = _at_clearances(rig, _rows(whole) @ q)
    end_forces = [c.force_at(r)[-c.bushing.n_coordinates :] for c, r in zip(contacts, ends)]
    contact_force = _join([a + b for a, b in zip(end_forces[::2], end_forces[1::2])])
    grease_force = _join([filling.force_at(r) for filling, r in zip(fillings, middles)])
    return Equilibrium(rig, _join(middles), contact_force, grease_force, q, whole, tuple(fillings), tuple(contacts))


def _join(parts: list[np.ndarray]) -> np.ndarray:
    return np.concatenate([np.zeros(0), *parts])


def _forces(rig: Rig, law: Law, spin: float) -> tuple[list[_Filling], list[_EndContact]]:
    """Return the fillings of the clearances, and the contacts of both ends of each."""
    table = law.table(len(rig.bushings))
    ends = [(j, bushing) for j, bushing in enumerate(rig.bushings) for _ in range(2)]
    contacts = [_EndContact(bushing, table.parameters[0, j], table.kinds[j].law, spin) for j, bushing in ends]
    return [_Filling(b, model, spin) for b, model in zip(rig.bushings, fillings_of(rig, law))], contacts


def _solve(
    rig: Rig, model: LinearModel | ChainModes, forces: Sequence[_Filling | _EndContact], spin: float
) -> np.ndarray:
    """Solve for the coordinates (n,) at which all forces are in equilibrium.

    Rigid-body motions are restrained by springs at first, which soften to nothing.
    """
    gap = min((b.gap for b in rig.bushings), default=1.0)
    balance = _Balance(model, forces, rig, spin)
    q = np.zeros(model.omega.size)
    if not model.omega.all():
        weight = float(np.linalg.norm(rig.gravity or 0.0))
        if rig.loads:
            weight += float(np.abs(model.at_points @ model.weight).max(initial=0.0))
        for restraint in weight / gap * SOFTENING:
            q = balance.solve(q, restraint)[0]
    q, converged = balance.solve(q)
    if not converged:
        acting = [f"gravity {rig.gravity} m/s²"] * bool(rig.gravity) + ["its loads"] * bool(rig.loads)
        raise SimulationError(
            f"rig {rig.name!r}: no static equilibrium under {' and '.join(acting) or 'no load'} at a spin of {spin:g} "
            f"rad/s: nothing holds the shaft, or films and friction leave it no place to rest"
        )
    return q


def _free_motions(model: LinearModel | ChainModes, points: Sequence[np.ndarray]) -> np.ndarray:
    """Return the motions (n_free, n) of unit mass without stiffness in which clearances do not move."""
    stiff = np.diag(model.omega / model.omega.max(initial=1e-300))
    rows = [at / np.maximum(np.linalg.norm(at, axis=1, keepdims=True), 1e-300) for at in points]
    _, singular_values, motions = np.linalg.svd(np.vstack((*rows, stiff)))
    return np.asarray(motions[singular_values < UNLIMITED])


class _Balance:
    """Imbalance of the forces on the modes at rest, and its solution by Newton's method with Levenberg's damping."""

    def __init__(
        self, model: LinearModel | ChainModes, forces: Sequence[_Filling | _EndContact], rig: Rig, spin: float
    ):
        self.forces, weight = forces, model.weight
        self.small = SMALL * min((b.gap for b in rig.bushings), default=1.0)
        middles, ends = _at_clearances(rig, _rows(model))
        self.points, self.stiffness = [*middles, *ends], model.stiff(spin)
        if rig.linear.is_torsional:  # they accelerate together, at rest relative to each other
            free = _free_motions(model, self.points)
            weight = weight - (free @ weight) @ free
            self.stiffness = self.stiffness + np.max(model.omega**2 + 1.0) * free.T @ free
        self.weight = weight
        self.scale = 1 / np.sqrt(model.omega**2 + 1e-4 * np.mean(model.omega) ** 2 + 1.0)

    def imbalance(self, q: np.ndarray, restraint: float) -> np.ndarray:
        """Return the imbalance (n,), with springs on all modes, 1/s²."""
        total = self.stiffness @ q + restraint * q - self.weight
        for force, at in zip(self.forces, self.points):
            total += at.T @ force.force_at(at @ q)
        return np.asarray(total)

    def tangent(self, q: np.ndarray, restraint: float) -> np.ndarray:
        """Return the derivative (n, n) of the imbalance."""
        jacobian = self.stiffness + restraint * np.eye(q.size)
        for force, at in zip(self.forces, self.points):
            middle = at @ q
            steps = self.small * np.eye(middle.size)
            change = [force.force_at(middle + d) - force.force_at(middle - d) for d in steps]
            jacobian += at.T @ (np.array(change).T / (2 * self.small)) @ at
        return jacobian

    def solve(self, q: np.ndarray, restraint: float = 0.0) -> tuple[np.ndarray, bool]:
        """Return the coordinates of the last Newton step, and True if that is an equilibrium."""
        residual = self.imbalance(q, restraint)
        size = float(np.linalg.norm(self.scale * residual))
        least = TOLERANCE * max(float(np.linalg.norm(self.scale * self.weight)), size)
        damping = 0.0
        for _ in range(ITERATIONS):
            if size <= least:
                return q, True
            tangent, improved = self.tangent(q, restraint), False
            while not improved and damping < 1e12:
                step = _solve_or_none(tangent + damping * np.diag(1 / self.scale**2), residual)
                new = None if step is None else self.imbalance(q - step, restraint)
                new_size = np.inf if new is None else float(np.linalg.norm(self.scale * new))
                if step is not None and new is not None and new_size < size:
                    q, residual, size, damping = q - step, new, new_size, damping / 10 if damping > 1e-9 else 0.0
                    improved = True
                else:
                    damping = max(10 * damping, 1e-6)
            if not improved:
                break
        return q, size <= 1e3 * least


def _solve_or_none(matrix: np.ndarray, rhs: np.ndarray) -> np.ndarray | None:
    try:
        solution = np.linalg.solve(matrix, rhs)
    except np.linalg.LinAlgError:
        return None
    return solution if np.isfinite(solution).all() else None
