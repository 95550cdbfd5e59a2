"""A rig condensed to its clearances: its linear structure, and the nonlinear forces on it."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..clearance.grease import GreaseModel
from ..clearance.law import AmplitudeLaw, Law, TimeLaw
from ..clearance.record import clearance_records, fillings_of
from ..clearance.table import LawTable
from ..core.errors import ExcitationError, LawError, RigError
from ..engines.scheme import at_rows, places_of
from ..linear import LinearModel, linear_model
from ..model import Model
from ..rig import Rig
from ..rig.loads import order_forces
from .dynamics import DrivenModel
from .forces import Laws, Slopes
from .harmonic_balance import Grid

__all__ = ["UNBALANCE", "Condensed", "condensed", "grid", "laws_of", "require_periodic", "slopes"]

UNBALANCE = "unbalance"
STIFF = 1e-3
"""Contact stiffness times compliance above which a displacement of the points is an unknown; others are eliminated."""
FILM = 100.0  # stiffness of a film near the wall over that in its middle
SINGULAR = 1e-12  # of the largest stiffness of a mode: below it a motion is unrestrained
RESTRAINT = 1e-8  # of the lowest restraining stiffness: artificial stiffness of a motion that no clearance sees


class Condensed(NamedTuple):
    """The condensed model of a rig, a law and an excitation, for harmonic balance."""

    model: Model
    kind: str  #: "base", "force" or "unbalance"; "whirl" where nothing excites
    periods: int  #: number of excitation periods in one period of the motion
    order: float  #: of the excitation's first harmonic with respect to the spin, where rotating parts excite; else 0
    modes: int
    driven: DrivenModel
    basis: np.ndarray  #: (n_rows, r) B, orthonormal; every column belongs to one clearance and one direction
    owner: np.ndarray  #: (r,) clearance of each column
    laws: Laws
    size: float  #: m, scale of motions: the smallest distance of a wall
    pressed: np.ndarray  #: (n_bushings,) True where loads press it against its wall, which alone restrains the rig
    sag: np.ndarray  #: (n_rows,) displacement by constant loads without gaps, m
    stiffest: float  #: 1/s², the largest stiffness of a contact on the modes
    levels: np.ndarray  #: (n_levels,) complex amplitudes of the excitation; a factor of rotating excitations

    @property
    def rig(self) -> Rig:
        """Rig of the model."""
        return self.model.rig

    @property
    def frequency_ratio(self) -> float:
        """Ratio of the excitation's first harmonic to the frequency of branches and maps, that of the turning shaft."""
        return self.order or 1.0

    @property
    def fineness(self) -> float:
        """Factor of the tolerance: sag over the size of motions, where loads press walls that alone hold the rig."""
        return min(1.0, float(np.abs(self.sag).max()) / self.size) if self.pressed.any() else 1.0

    @property
    def undriven(self) -> Condensed:
        """The same without excitation: the mean is the only harmonic."""
        still = self.driven._replace(drive=0 * self.driven.drive[:1], unbalance=0 * self.driven.unbalance[:1])
        return self._replace(driven=still)

    def split(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return harmonics of the coordinates (r, K) and the remainder of displacements x (n_rows, K) outside them."""
        z = self.basis.T @ x
        return z, x - self.basis @ z

    def fillings(self, omega: np.ndarray, x: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Return complex amplitudes (n, n_coordinates, H + 1) of the fillings' forces at all clearances, N.

        Of displacements x and forces (n, n_rows, H + 1) that the linear system does not contain.
        """
        rows = self.rig.bushing_of_row
        turning = 1j * np.arange(x.shape[2]) * omega[:, None, None]
        spring, damper = self.laws.spring[rows, None], self.laws.damper[rows, None]
        return np.asarray(force[:, : rows.size] + (spring + damper * turning) * x[:, : rows.size])


def require_periodic(model: Model, kind: str) -> None:
    """Refuse a model that has no periodic vibration, or that an excitation does not reach.

    Raises
    ------
    RigError
        If the rig has no clearance.
    LawError
        For a law over amplitude, or one over time that does not turn with the shaft.
    ExcitationError
        If the rig has no position for a force.
    """
    rig, law = model.rig, model.law
    if not rig.bushings:
        raise RigError(f"rig {rig.name!r} has no clearance, so its vibration is linear; use cm.beam.linear_frf")
    turns = kind == UNBALANCE and rig.spin and rig.spin.speed
    if isinstance(law, TimeLaw) and not (turns and law.period):
        raise LawError(
            "a law over time has no periodic vibration unless it turns with the shaft: give it the period that it has "
            'at the speed of [spin], and use follow_unbalance or, of maps and commands, kind "unbalance"'
        )
    if isinstance(law, AmplitudeLaw):
        raise LawError(
            "a law over amplitude remembers the envelope for longer than a period, and harmonic balance does not "
            "follow that; give a ConstantLaw or a ContactLaw"
        )
    if kind == "force" and rig.shaker.position is None:
        raise ExcitationError(f"rig {rig.name!r} has no shaker.position, where the force acts")


def condensed(
    model: Model, kind: str, levels: Sequence[complex], harmonics: int, modes: int, periods: int = 1, speed: float = 0.0
) -> Condensed:
    """Condense a rig to its clearances.

    Parameters
    ----------
    model : Model
        Rig and law of its clearances.
    kind : str
        Kind of the excitation: "base", "force", "unbalance" of what turns with the shaft, or "whirl" of nothing.
    levels : sequence of complex
        Amplitudes of the excitation's harmonics from the first on, m/s² or N; one factor of what turns with the shaft.
    harmonics : int
        Number of harmonics of the motion, H.
    modes : int
        Number of modes in the Ritz basis, of each bending plane.
    periods : int
        Periods of the excitation after which the motion comes again.
    speed : float
        rad/s: a spin that occurs, by which the stiffness of films and bearings is estimated.

    Raises
    ------
    RigError
        If the rig has no clearance, or can move without stiffness.
    LawError
        For a law over time or amplitude.
    ExcitationError
        If the rig has no position for a force.
    """
    require_periodic(model, kind)
    rig, law = model.rig, model.law
    laws, structure = laws_of(rig, law, speed), linear_model(rig, modes)
    of_contact = np.broadcast_to(law.largest([b.gap for b in rig.bushings])[0], len(rig.bushings))
    free = _unrestrained_directions(structure.filled(laws.spring, laws.damper), speed)
    pressed = np.zeros(len(rig.bushings), dtype=bool)
    if np.abs(free.T @ structure.weight).max(initial=0.0) > 0:  # loads press it against walls, which alone hold it
        pressed = (laws.spring == 0) & laws.linear
        laws = laws._replace(spring=np.where(pressed, of_contact, laws.spring), linear=laws.linear & ~pressed)
    structure = structure.filled(laws.spring, laws.damper)
    points, weight = at_rows(structure), structure.weight
    if (free := _unrestrained_directions(structure, speed)).size:
        if np.abs(points @ free).max() > 1e-6 * np.abs(points).max():
            raise RigError(
                f"rig {rig.name!r}: in its gaps it can move without any stiffness, so the middle of a vibration is not "
                "defined; add a support, oil, or grease with stiffness"
            )
        # All turns together, which no clearance sees: a weak spring holds it, and loads without balance speed it up.
        values = np.linalg.eigvalsh(structure.elastic(speed))
        hold = RESTRAINT * values[values > SINGULAR * values[-1]][0] * free @ free.T
        springs = structure.springs + hold if structure.springs.size else hold
        structure, weight = dataclasses.replace(structure, springs=springs), weight - free @ (free.T @ weight)
    drive, unbalance, order = _excitation(structure, law, kind, np.asarray(levels, dtype=complex), harmonics, periods)
    if isinstance(law, TimeLaw) and rig.spin:
        laws = laws._replace(span=2 * np.pi * periods / (order * abs(rig.spin.speed)))
    driven = DrivenModel(structure, points, weight, drive, unbalance)
    stiffest = of_contact + [FILM * k if b.film else 0.0 for k, b in zip(laws.spring, rig.bushings)]
    on_modes = float(np.max(of_contact[rig.bushing_of_row] * np.sum(structure.at_bushings**2, axis=1)))
    basis, owner = _active_coordinates(driven, laws, stiffest, speed)
    room = min(b.wall_model.reach(b.gap) - math.hypot(b.offset_y, b.offset) for b in rig.bushings)
    return Condensed(
        model, kind, periods, order, modes, driven, basis, owner, laws, room, pressed,
        points @ np.linalg.solve(structure.stiff(speed), weight), on_modes, np.asarray(levels, dtype=complex),
    )  # fmt: skip


def _unrestrained_directions(model: LinearModel, spin: float) -> np.ndarray:
    """Return the directions (n, m) in which the modes move without stiffness."""
    elastic = model.elastic(spin)
    values, vectors = np.linalg.eigh((elastic + elastic.T) / 2)
    return vectors[:, values <= SINGULAR * max(model.omega.max() ** 2, values[-1])]


def _excitation(
    model: LinearModel, law: Law, kind: str, levels: np.ndarray, harmonics: int, periods: int
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return amplitudes (H + 1, n) of the excitation, those per Ω², and the order of its first harmonic or 0."""
    drive, unbalance = np.zeros((2, harmonics + 1, model.size), dtype=complex)
    if kind != UNBALANCE:
        if levels.size:
            drive[periods : periods * levels.size + 1 : periods] = np.outer(levels, model.input(kind))
        return drive, unbalance, 0.0
    rig = model.rig
    orders = [abs(each.order) for each in rig.orders] + [1.0] * bool(rig.unbalances)
    if isinstance(law, TimeLaw) and law.period and rig.spin:  # such as once for each tooth
        orders.append(2 * np.pi / (law.period * abs(rig.spin.speed)))
    first = _common_order(orders)
    forces = order_forces(rig.orders, model.directed, model.size).reshape(-1, 2, model.size)
    for each, (cosine, sine) in zip(rig.orders, forces):
        if (h := round(abs(each.order) / first) * periods) <= harmonics:
            drive[h] += levels[0] * (cosine - 1j * math.copysign(1.0, each.order) * sine)
    if rig.unbalances:
        unbalance[round(1 / first) * periods] = levels[0] * (model.unbalance[0] - 1j * model.unbalance[1])
    return drive, unbalance, first


def _common_order(orders: Sequence[float]) -> float:
    """Return the largest order of which all are multiples."""
    common = orders[0]
    for order in orders[1:]:
        while order > 1e-6 * orders[0]:
            common, order = order, math.remainder(common, order)
            order = abs(order)
    return common


def laws_of(rig: Rig, law: Law, speed: float = 0.0) -> Laws:
    """Return the laws of the clearances of a rig.

    Parameters
    ----------
    rig : Rig
        Rig.
    law : Law
        Law of its clearances.
    speed : float
        rad/s: a film has no direct stiffness in the middle, so Ω c/2 of its coupling at this spin stands for it.
    """
    fillings, bushings = fillings_of(rig, law), rig.bushings
    k, c = np.transpose([filling.small_motion() for filling in fillings])
    films = np.array([b.film is not None for b in bushings])
    k = np.where(films, np.maximum(k, abs(speed) * c / 2), k)
    memory = np.array([_memory_size(f, b.gap, b.n_coordinates) for f, b in zip(fillings, bushings)])
    linear = np.array([filling.is_linear() for filling in fillings]) & ~films
    table = law.table(len(bushings))
    impacts = np.array([_depends_on_impact_speed(table, b.gap, j) for j, b in enumerate(bushings)])
    rubs = np.array([b.friction is not None and b.friction.coefficient > 0 for b in bushings])
    room = max(2, *(f.states(b.n_coordinates) for f, b in zip(fillings, bushings)))
    records, places = clearance_records(rig, law, 1.0), places_of(rig)
    middles = [(row, row + size - 1) for row, size in zip(places[:, 0], records.bushings["coordinates"])]
    touching = records.bushings["touching"]
    ends = places[:, 1:].reshape(-1, 2).copy()
    ends[:, 0] = np.where(np.repeat(touching, 2) == 2, ends[:, 0], ends[:, 1])
    rows = np.vstack((middles, ends)).astype(int)
    width = np.concatenate((records.bushings["coordinates"], np.repeat(touching, 2))).astype(int)
    return Laws(*records, k, np.ascontiguousarray(c), memory, linear, impacts | rubs, room, 0.0, rows, width)


def _active_coordinates(
    driven: DrivenModel, laws: Laws, stiffest: np.ndarray, spin: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return orthonormal coordinates (n_rows, r) of rows that move enough to matter, and their clearances (r,).

    ``stiffest`` (n_bushings,) is the stiffest contact of each clearance, N/m; bearings are those at the spin, rad/s.
    """
    at = driven.points
    compliance = at @ np.linalg.solve(driven.model.elastic(spin), at.T)
    columns, owner = [], []
    for j, stiffest_contact in enumerate(stiffest):
        of_points = laws.rows_of(j)
        groups = [sorted(set(of_points[:, 1].tolist()))]
        if laws.width[len(stiffest) + 2 * j] == 2:
            along = set(of_points[:, 0].tolist()) if laws.width[j] == 2 else {int(of_points[1, 0])}
            groups.insert(0, sorted(along))
        for rows in groups:
            values, vectors = np.linalg.eigh(compliance[np.ix_(rows, rows)])
            least = min(STIFF / stiffest_contact if stiffest_contact else np.inf, 1e-3 * values[-1])
            for value, vector in zip(values, vectors.T):
                if value > least and value > 1e-12 * values[-1]:
                    column = np.zeros(len(compliance))
                    column[rows] = vector
                    columns.append(column)
                    owner.append(j)
    return np.ascontiguousarray(np.array(columns).T), np.array(owner)


def _memory_size(filling: GreaseModel, gap: float, coordinates: int) -> int:
    """Return the number of a filling's state variables; 0 if a motion through the gap does not change them."""
    size = filling.states(coordinates)
    state, out, angle = [0.0] * size, [0.0] * 6, np.arange(1, 20)
    orbit = [gap * np.sin(angle)] if coordinates == 1 else [gap * np.sin(angle), gap * np.cos(angle) / 2]
    places = [(0.0,) * coordinates, *(tuple(map(float, r)) for r in np.transpose(orbit))]
    for before, now in itertools.pairwise(places):
        moved = tuple(b - a for a, b in zip(before, now))
        filling.law(filling.parameters(), state, now, moved, 0.0, 1e-3, out)
    return size if any(state) else 0


def _depends_on_impact_speed(table: LawTable, gap: float, j: int) -> bool:
    """Return True if a contact's force depends on the speed at which it began."""
    slow, fast = [0.0, 0.0], [0.0, 0.0]
    parameters = [float(number) for number in table.parameters[0, j]]
    table.kinds[j].law(parameters, gap, 100 * gap, 100 * gap, slow)
    table.kinds[j].law(parameters, gap, 100 * gap, 1000 * gap, fast)
    return slow != fast


@functools.lru_cache(maxsize=16)
def grid(harmonics: int, samples: int) -> Grid:
    """Return the harmonic functions at the samples of a period."""
    angle = 2 * np.pi * np.arange(samples) / samples
    order = np.arange(1, 2 * harmonics + 1)
    products = np.ones((samples, 4 * harmonics + 1))
    products[:, 1::2], products[:, 2::2] = np.cos(np.outer(angle, order)), np.sin(np.outer(angle, order))
    basis, rate = products[:, : 2 * harmonics + 1].copy(), np.zeros((samples, 2 * harmonics + 1))
    rate[:, 1::2] = -order[:harmonics] * basis[:, 2::2]
    rate[:, 2::2] = order[:harmonics] * basis[:, 1::2]
    weights = np.full(2 * harmonics + 1, 2 / samples)
    weights[0] = 1 / samples
    half = np.outer(np.arange(harmonics + 1), angle[: samples // 2 + 1])
    return Grid(basis, rate, np.ascontiguousarray((basis * weights).T), np.cos(half), np.sin(half), products / samples)


def slopes(laws: Laws, samples: int, harmonics: int) -> Slopes:
    """Allocate the derivatives of the forces at samples of a period."""
    points, most = len(laws.width), max(int(laws.memory.max()), 2)
    x, v = np.zeros((2, points, 2, 2, samples))
    step = np.zeros((points, samples, most + 2, most + 8))
    rows = np.zeros((points, 2, 2, samples, 2 * harmonics + 1))
    onto, used = np.zeros((points, samples, 2 * harmonics + 1)), np.zeros(points, dtype=int)
    return Slopes(x, v, step, np.zeros((points, samples), dtype=bool), rows, onto, used)
