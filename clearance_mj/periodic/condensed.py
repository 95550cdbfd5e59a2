"""A rig condensed to its clearances: poles and residues of what is linear, the laws of what is not."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..clearance.grease import GreaseModel
from ..clearance.law import AmplitudeLaw, Law, TimeLaw
from ..clearance.record import clearance_records, fillings_of
from ..clearance.table import LawTable
from ..core.errors import ExcitationError, LawError, RigError
from ..linear import LinearModel, linear_model
from ..linear.refusals import one_kind
from ..model import Model
from ..rig import Rig
from .forces import Laws, Slopes
from .harmonic_balance import Grid, Linear

__all__ = [
    "Condensed",
    "condensed",
    "coordinates_of",
    "grid",
    "in_gap",
    "laws_of",
    "require_periodic",
    "slopes",
    "without_stiffness",
]

STIFF = 1e-3
"""Contact stiffness times compliance from which on a motion of the points is unknown; others are substituted."""


class Condensed(NamedTuple):
    """What the harmonic balance of a rig, a law and an excitation works with."""

    model: Model
    kind: str
    periods: int  #: of the excitation, after which a motion comes again
    modes: int
    in_gap: LinearModel
    linear: Linear
    laws: Laws
    size: float  #: m, that motions are measured by: the smallest distance of a wall
    stiffest: float  #: 1/s², the largest stiffness of a contact on the modes

    @property
    def rig(self) -> Rig:
        """Rig of the model."""
        return self.model.rig

    def modes_of(self, omega: np.ndarray, excitation: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Return complex amplitudes (n_f, n, H + 1) of the modes under excitation and forces of the points.

        Parameters
        ----------
        omega : ndarray, shape (n_f,)
            Angular frequencies of the first harmonic, 1/s.
        excitation : ndarray, shape (n_f, H + 1), complex
            Of the rig, m/s² or N.
        force : ndarray, shape (n_f, n_points, H + 1), complex
            N.
        """
        model, drive = self.in_gap, self.in_gap.drive()
        value, motion = model.poles()
        of_poles = (drive @ model.input(self.kind))[:, None] * excitation[:, None]
        of_poles = of_poles - np.einsum("jp,nph->njh", drive @ model.at_points.T, force)
        of_poles /= 1j * np.arange(force.shape[2]) * omega[:, None, None] - value[:, None]
        return np.einsum("mj,njh->nmh", motion, of_poles)


def in_gap(of: Model, modes: int) -> LinearModel:
    """Return the in-gap linear system of a rig, each grease a spring and a damper as in small motions.

    Raises
    ------
    RigError
        If it can move without stiffness: its mean position is then not defined.
    """
    rig, (k, c) = of.rig, np.transpose([filling.small_motion() for filling in fillings_of(of.rig, of.law)])
    model = linear_model(rig, modes).filled(k, c)
    values = np.abs(model.poles().value)
    if values.min() < 1e-9 * values.max() or np.linalg.eigvalsh(model.stiff() + model.stiff().T)[0] <= 0:
        raise without_stiffness(rig)
    return model


def without_stiffness(rig: Rig) -> RigError:
    """Return the error of a rig that nothing holds in its gaps."""
    return RigError(
        f"rig {rig.name!r}: in its gaps it can move without any stiffness, so the middle of a vibration is not "
        "defined; add a support, oil, or grease with stiffness"
    )


def require_periodic(model: Model, kind: str) -> None:
    """Refuse a model that has no periodic vibration, or that an excitation does not reach.

    Raises
    ------
    RigError
        If the rig has no clearance.
    LawError
        For a law over time or amplitude.
    ExcitationError
        If the rig has no position for a force.
    """
    rig, law = model.rig, model.law
    one_kind(rig, "harmonic balance")
    if not rig.bushings:
        raise RigError(f"rig {rig.name!r} has no clearance, so its vibration is linear; use cm.beam.linear_frf")
    if isinstance(law, TimeLaw):
        raise LawError("a law over time has no periodic vibration; give a ConstantLaw or a ContactLaw")
    if isinstance(law, AmplitudeLaw):
        raise LawError(
            "a law over amplitude remembers the envelope for longer than a period, and harmonic balance does not "
            "follow that; give a ConstantLaw or a ContactLaw"
        )
    if kind == "force" and rig.shaker.position is None:
        raise ExcitationError(f"rig {rig.name!r} has no shaker.position, where the force acts")
    if (rig.loads or rig.gravity) and not rig.moves_across:
        raise RigError(f"rig {rig.name!r}: harmonic balance of slots knows no constant load yet; simulate it")
    if rig.orders:
        raise RigError(f"rig {rig.name!r}: harmonic balance knows no orders of the spin yet; simulate them")


def condensed(
    model: Model, kind: str, levels: Sequence[complex], harmonics: int, modes: int, periods: int = 1
) -> Condensed:
    """Condense a rig to its clearances.

    Parameters
    ----------
    model : Model
        Rig and law of its clearances.
    kind : str
        Kind of the excitation: "base" or "force".
    levels : sequence of complex
        Amplitudes of the excitation's harmonics from the first on, m/s² or N.
    harmonics : int
        Number of harmonics of the motion, H.
    modes : int
        Number of modes in the Ritz basis.
    periods : int
        Periods of the excitation after which the motion comes again.

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
    linear = in_gap(model, modes)
    (values, shapes), forced = linear.poles(), linear.drive()
    points = linear.at_points @ shapes
    residues = np.ascontiguousarray(np.einsum("pj,jq->jpq", points, forced @ linear.at_points.T))
    driven = np.ascontiguousarray((points * (forced @ linear.input(kind))).T)
    excitation = np.zeros(harmonics + 1, dtype=complex)
    excitation[periods : periods * len(levels) + 1 : periods] = levels
    stiffest = np.broadcast_to(law.largest([b.gap for b in rig.bushings])[0], len(rig.bushings))
    basis, owner = coordinates_of(linear, STIFF, stiffest)
    on_modes = float(np.max(stiffest * np.sum(linear.at_bushings**2, axis=1)))
    shifted = Linear(values, residues, driven, excitation, basis, owner)
    room = min(b.gap - abs(b.offset) for b in rig.bushings)
    return Condensed(model, kind, periods, modes, linear, shifted, laws_of(rig, law), room, on_modes)


def laws_of(rig: Rig, law: Law, speed: float = 0.0) -> Laws:
    """Return what acts in the clearances of a rig.

    Parameters
    ----------
    rig : Rig
        Rig.
    law : Law
        Law of its clearances.
    speed : float
        rad/s: a film has no stiffness of its own in the middle, so Ω c/2 of its coupling at this spin stands for it.
    """
    fillings, bushings = fillings_of(rig, law), rig.bushings
    k, c = np.transpose([filling.small_motion() for filling in fillings])
    films = np.array([b.film is not None for b in bushings])
    k = np.where(films, np.maximum(k, abs(speed) * c / 2), k)
    memory = np.array([_memory(f, b.gap, b.n_coordinates) for f, b in zip(fillings, bushings)])
    linear = np.array([filling.is_linear() for filling in fillings]) & ~films
    table = law.table(len(bushings))
    impacts = np.array([_knows_impacts(table, b.gap, j) for j, b in enumerate(bushings)])
    rubs = np.array([b.friction is not None and b.friction.coefficient > 0 for b in bushings])
    room = max(2, *(f.states(b.n_coordinates) for f, b in zip(fillings, bushings)))
    return Laws(*clearance_records(rig, law, 1.0), k, np.ascontiguousarray(c), memory, linear, impacts | rubs, room)


def coordinates_of(
    model: LinearModel, stiff: float, stiffest: np.ndarray, spin: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return orthonormal coordinates (n_rows, r) of points in which they move enough to matter, and whose they are.

    Parameters
    ----------
    model : LinearModel
        The structure in its gaps.
    stiff : float
        Contact stiffness times compliance from which on a motion matters.
    stiffest : ndarray, shape (n_bushings,)
        Stiffest contact of each clearance, N/m.
    spin : float
        rad/s, at which bearings are what they are.
    """
    at, d, count = model.at_points, model.rig.n_coordinates, len(stiffest)
    compliance = at @ np.linalg.solve(model.elastic(spin), at.T)
    columns, owner = [], []
    for j, direction in np.ndindex(count, d):
        rows = [d * point + direction for point in (j, count + 2 * j, count + 2 * j + 1)]
        values, vectors = np.linalg.eigh(compliance[np.ix_(rows, rows)])
        least = min(stiff / stiffest[j] if stiffest[j] else np.inf, 1e-3 * values[-1])
        for value, vector in zip(values, vectors.T):
            if value > least and value > 1e-12 * values[-1]:
                column = np.zeros(len(compliance))
                column[rows] = vector
                columns.append(column)
                owner.append(j)
    return np.ascontiguousarray(np.array(columns).T), np.array(owner)


def _memory(filling: GreaseModel, gap: float, coordinates: int) -> int:
    """How many numbers a filling remembers: none if a motion through the gap leaves them as they were."""
    size = filling.states(coordinates)
    state, out, angle = [0.0] * size, [0.0] * 6, np.arange(1, 20)
    way = [gap * np.sin(angle)] if coordinates == 1 else [gap * np.sin(angle), gap * np.cos(angle) / 2]
    places = [(0.0,) * coordinates, *(tuple(map(float, r)) for r in np.transpose(way))]
    for before, now in itertools.pairwise(places):
        moved = tuple(b - a for a, b in zip(before, now))
        filling.law(filling.parameters(), state, now, moved, 0.0, 1e-3, out)
    return size if any(state) else 0


def _knows_impacts(table: LawTable, gap: float, j: int) -> bool:
    """Whether a contact's force depends on the speed at which it began."""
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
    project = np.ascontiguousarray((basis * weights).T)
    return Grid(basis, rate, project, np.cos(half), np.sin(half), products / samples)


def slopes(laws: Laws, points: int, samples: int, harmonics: int) -> Slopes:
    """Return room for the derivatives of the forces at samples of a period."""
    most = int(laws.memory.max())
    x, v, begun, entry, climb = np.zeros((5, points, samples))
    memory = np.zeros((len(laws.memory), samples, most + 1, most + 2))
    whole = np.zeros((points, 2 * harmonics + 1, 2 * harmonics + 1))
    return Slopes(x, v, begun, entry, climb, memory, whole, np.zeros(points, dtype=bool))
