"""Where a structure rests before it vibrates: gravity and loads, fillings and films, contact, friction."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..clearance.follower import SLOWEST_IMPACT, signed_penetration
from ..clearance.grease import GreaseModel
from ..clearance.kernel import Clearance, greases_of
from ..clearance.law import Law
from ..clearance.modelled import Modelled, rig_and_law
from ..clearance.round_kernel import BRISTLES, END_MEMORY, RoundClearance, at_offset, fillings_of
from ..core.errors import SimulationError
from ..core.kinds import checks_kinds
from ..linear import LinearModel, linear_model
from ..rig import Bushing, Rig

__all__ = ["ChainModes", "Equilibrium", "equilibrium_of", "rest_of", "static_equilibrium"]

PATH = 64  # pieces of the way from the unloaded place on which hysteresis is followed
SMALL = 1e-6  # of a gap: differences of which stiffnesses are made
TOLERANCE = 1e-12  # of the forces that act, their imbalance at the end
ITERATIONS = 200
SOFTENING = 10.0 ** -np.arange(8)  # of springs that hold what can move without bending, over weight per gap


class ChainModes(NamedTuple):
    """The modes of a MuJoCo model, of unit mass, as far as statics need them."""

    omega: np.ndarray  # (n,) natural circular frequencies, 1/s
    circulatory: np.ndarray  # (n, n) H; (0, 0) if there is none
    weight: np.ndarray  # (n,) steady force on the modes
    at_points: np.ndarray  # (3 n_rows, n) as of `LinearModel`
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
    """whose coordinates they are"""
    _fillings: tuple[_Filling, ...]
    _contacts: tuple[_Contact, ...]

    def deflection(self, points: Sequence[float | str]) -> np.ndarray:
        """Return how far points have sagged from the unloaded shaft: y and z (n_points, 2), m.

        Parameters
        ----------
        points : sequence of Point, length n_points
            Positions, m, or degrees of freedom.
        """
        return np.asarray(self.model.moved(points) @ self.coordinates)

    def columns(self) -> np.ndarray:
        """Return what an engine's run returns of the bushings at rest: (7 n_bushings,), see `Run.advance`."""
        touches = self.contact_force.reshape(-1, self.rig.n_coordinates).any(axis=1).astype(float)
        return np.concatenate((self.displacement, self.contact_force, self.grease_force, touches))

    def begin(self, clearance: RoundClearance | Clearance) -> None:
        """Let the records of compiled loops remember the rest.

        Parameters
        ----------
        clearance : RoundClearance or Clearance
            Of the rig, changed in place.
        """
        n, size, numbers = len(self.rig.bushings), self.rig.n_coordinates, clearance.numbers
        at = (self.model.at_points @ self.coordinates).reshape(-1, size)
        for j, filling in enumerate(self._fillings):
            state = clearance.states[j]
            for name, value in zip(("y", "z") if size == 2 else ("displacement",), at[j]):
                state[name] = value
            filling.moved(at[j])
            numbers[state["grease"] : state["grease"] + len(filling.states)] = filling.states
            for end in range(2):
                place = at[n + 2 * j + end]
                depth, direction = self._contacts[2 * j + end].depth(place)
                if depth <= 0:
                    continue
                if size == 1:
                    numbers[state["impact"] + end] = SLOWEST_IMPACT * direction[0]
                    continue
                memory = state["ends"] + END_MEMORY * end
                numbers[memory : memory + BRISTLES] = SLOWEST_IMPACT, *direction
                numbers[memory + BRISTLES : memory + END_MEMORY] = 0.0, *place


class _Filling:
    """What fills a bushing, moved slowly from the unloaded place."""

    def __init__(self, bushing: Bushing, model: GreaseModel, spin: float, moves_across: bool):
        self.model, self.parameters = model, model.parameters()
        self.law: Callable[..., None]
        self.turned: tuple[float, ...]
        if moves_across:
            self.law, self.turned = model.round_law, (spin,)
            self.offset, self.states = np.array([bushing.offset_y, bushing.offset]), [0.0] * model.round_states()
            self.preload = np.array(at_offset(model, *self.offset)[:2])
        else:
            self.law, self.turned = model.law, ()
            self.offset, self.states = np.array([bushing.offset]), [0.0] * model.states()
            self.preload = np.array([model.at_rest(bushing.offset)[0]])

    def moved(self, place: np.ndarray) -> np.ndarray:
        """Return the force at a place, m, (2,) or (1,), above that at the offset; the states are those there."""
        self.states = [0.0] * len(self.states)
        pieces = PATH if self.states and not self.model.is_linear() else 1
        out, step = [0.0] * 6, place / pieces
        for i in range(1, pieces + 1):
            self.law(self.parameters, self.states, *(self.offset + i * step), *step, *self.turned, 1e6, out)
        return np.array(out[: place.size]) - self.preload


class _Contact:
    """One end of a bushing, whose shaft lies or slides on it."""

    def __init__(self, bushing: Bushing, parameters: np.ndarray, law: Callable[..., None], surface: float):
        self.bushing, self.parameters, self.law = bushing, tuple(parameters), law
        sliding = np.sign(surface) * (bushing.friction.coefficient if bushing.friction else 0.0)
        self.friction, self.offset = float(sliding), np.array([bushing.offset_y, bushing.offset])

    def depth(self, place: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the depth at a place, m, (2,) or (1,), below 0 in the gap, and the direction in which it is deep."""
        if place.size == 1:
            g = signed_penetration(float(place[0]), *self.bushing.walls)
            return abs(g), np.sign([g])
        r = place + self.offset
        e = float(np.hypot(*r))
        return e - self.bushing.gap, r / (e or 1.0)

    def moved(self, place: np.ndarray) -> np.ndarray:
        """Return the force at a place, m, (2,) or (1,)."""
        depth, n = self.depth(place)
        if depth <= 0:
            return np.zeros(place.size)
        out = [0.0, 0.0]
        self.law(self.parameters, depth, 0.0, SLOWEST_IMPACT, out)
        across = self.friction * np.array([-n[1], n[0]]) if self.friction else 0.0
        return np.asarray(out[0] / 2 * depth * (n + across))


@checks_kinds
def static_equilibrium(model: Rig | Modelled, law: Law | None = None, n_modes: int = 8) -> Equilibrium:
    """Find where a rig rests under gravity and loads: its sag, its place in the bushings, contact and films included.

    Fillings are followed on a straight way from the unloaded shaft. In a contact a shaft that does not turn was put
    down, without sliding; one that turns slides. Unbalance and excitation do not act.

    Parameters
    ----------
    model : Model or Rig
        What rests.
    law : Law, optional
        Contact and filling of a rig; without one, its datasheet values.
    n_modes : int
        Modes of each plane, to which static shapes are added.

    Raises
    ------
    RigError
        If nothing carries a load.
    SimulationError
        If no equilibrium is found: nothing holds the shaft, or friction and films leave it none.
    """
    rig, law = rig_and_law(model, law)
    return equilibrium_of(rig, law, linear_model(rig, n_modes))


def rest_of(rig: Rig, law: Law, modes: int) -> Equilibrium | None:
    """Return where a planar rig rests, or None where nothing loads it: it then rests at 0."""
    return static_equilibrium(rig, law, modes) if rig.gravity or rig.loads else None


def equilibrium_of(rig: Rig, law: Law, whole: LinearModel | ChainModes) -> Equilibrium:
    """Find where a structure rests that stands for a rig's; see `static_equilibrium`."""
    spin = rig.spin.speed if rig.spin else 0.0
    fillings, contacts = _forces(rig, law, spin)
    q = _rest(rig, whole, [*fillings, *contacts], spin)
    n, size = len(rig.bushings), rig.n_coordinates
    at = (whole.at_points @ q).reshape(-1, size)
    pushed = np.array([c.moved(r) for c, r in zip(contacts, at[n:])]).reshape(n, 2, size).sum(axis=1)
    held = np.array([f.moved(r) for f, r in zip(fillings, at)]).reshape(n, size)
    return Equilibrium(rig, at[:n].ravel(), pushed.ravel(), held.ravel(), q, whole, tuple(fillings), tuple(contacts))


def _forces(rig: Rig, law: Law, spin: float) -> tuple[list[_Filling], list[_Contact]]:
    """Fillings of the bushings, and contacts of both ends of each."""
    table = law.table(len(rig.bushings))
    contacts = [
        _Contact(bushing, table.parameters[0, j], table.kinds[j].law, spin)
        for j, bushing in enumerate(rig.bushings)
        for _ in range(2)
    ]
    fillings = fillings_of(rig, law) if rig.moves_across else greases_of(rig, law)
    return [_Filling(b, m, spin, rig.moves_across) for b, m in zip(rig.bushings, fillings)], contacts


def _rest(rig: Rig, model: LinearModel | ChainModes, forces: Sequence[_Filling | _Contact], spin: float) -> np.ndarray:
    """(n,) coordinates at which all forces are in equilibrium.

    What can move without bending is held by springs at first, which soften to nothing.
    """
    gap = min((b.gap for b in rig.bushings), default=1.0)
    balance = _Balance(model, forces, rig, spin)
    q = np.zeros(model.omega.size)
    if not model.omega.all():
        weight = float(np.linalg.norm(rig.gravity or 0.0))
        if rig.loads:
            weight += float(np.abs(balance.points @ model.weight).max(initial=0.0))
        for held in weight / gap * SOFTENING:
            q = balance.settled(q, held)[0]
    q, settled = balance.settled(q)
    if not settled:
        raise SimulationError(
            f"rig {rig.name!r}: no static equilibrium under gravity {rig.gravity} m/s²"
            f"{' and its loads' * bool(rig.loads)} at a spin of {spin:g} rad/s: nothing holds the shaft, or films and "
            "friction leave it no place to rest"
        )
    return q


class _Balance:
    """Forces on the modes at rest, and Newton's steps to where they are none, damped as Levenberg's."""

    def __init__(self, model: LinearModel | ChainModes, forces: Sequence[_Filling | _Contact], rig: Rig, spin: float):
        dims, small = rig.n_coordinates, SMALL * min((b.gap for b in rig.bushings), default=1.0)
        self.forces, self.weight, self.steps = forces, model.weight, small * np.eye(dims)
        self.points, self.stiffness = model.at_points.reshape(-1, dims, model.omega.size), model.stiff(spin)
        self.scale = 1 / np.sqrt(model.omega**2 + 1e-4 * np.mean(model.omega) ** 2 + 1.0)

    def off(self, q: np.ndarray, held: float) -> np.ndarray:
        """Return what is not in equilibrium (n,), with springs on all modes, 1/s²."""
        total = self.stiffness @ q + held * q - self.weight
        for force, at in zip(self.forces, self.points):
            total += at.T @ force.moved(at @ q)
        return np.asarray(total)

    def tangent(self, q: np.ndarray, held: float) -> np.ndarray:
        """Return the derivative of `off` (n, n)."""
        found = self.stiffness + held * np.eye(q.size)
        for force, at in zip(self.forces, self.points):
            here = at @ q
            change = [force.moved(here + d) - force.moved(here - d) for d in self.steps]
            found += at.T @ (np.array(change).T / (2 * self.steps[0, 0])) @ at
        return found

    def settled(self, q: np.ndarray, held: float = 0.0) -> tuple[np.ndarray, bool]:
        """Return the coordinates to which Newton's steps lead, and whether that is an equilibrium."""
        off = self.off(q, held)
        size = float(np.linalg.norm(self.scale * off))
        least = TOLERANCE * max(float(np.linalg.norm(self.scale * self.weight)), size)
        damping = 0.0
        for _ in range(ITERATIONS):
            if size <= least:
                return q, True
            tangent, found = self.tangent(q, held), False
            while not found and damping < 1e12:
                step = _solved(tangent + damping * np.diag(1 / self.scale**2), off)
                new = None if step is None else self.off(q - step, held)
                reached = np.inf if new is None else float(np.linalg.norm(self.scale * new))
                if step is not None and new is not None and reached < size:
                    q, off, size, damping = q - step, new, reached, damping / 10 if damping > 1e-9 else 0.0
                    found = True
                else:
                    damping = max(10 * damping, 1e-6)
            if not found:
                break
        return q, size <= 1e3 * least


def _solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray | None:
    try:
        found = np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        return None
    return found if np.isfinite(found).all() else None
