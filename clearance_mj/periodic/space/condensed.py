"""A rig in space condensed to its clearances: its linear structure, and what acts beyond it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...linear import linear_model
from ...model import Model
from ...rig import Rig
from ..condensed import coordinates_of, laws_of, require_periodic, without_stiffness
from ..forces import Laws
from .forces import RoundSlopes
from .linear import DrivenModel

__all__ = ["UNBALANCE", "RoundCondensed", "round_condensed", "round_slopes"]

UNBALANCE = "unbalance"
STIFF = 3e-3
"""Contact stiffness times compliance from which on a motion of the points is unknown; others are substituted."""
FILM = 100.0  # stiffness of a film near the wall over that in its middle


class RoundCondensed(NamedTuple):
    """What the harmonic balance of a rig in space, a law and an excitation works with."""

    model: Model
    kind: str  #: "base", "force" or "unbalance"
    modes: int
    driven: DrivenModel
    basis: np.ndarray  #: (2 n_points, r) B, orthonormal; every column is of one bushing and one direction
    owner: np.ndarray  #: (r,) which bushing
    laws: Laws
    size: float  #: m, that motions are measured by: the smallest distance of a wall
    stiffest: float  #: 1/s², the largest stiffness of a contact on the modes
    levels: np.ndarray  #: (n_levels,) complex amplitudes of the excitation; a factor of the rig's unbalances

    @property
    def rig(self) -> Rig:
        """Rig of the model."""
        return self.model.rig

    @property
    def undriven(self) -> RoundCondensed:
        """The same without excitation, of which the mean alone is a harmonic."""
        return self._replace(driven=self.driven._replace(drive=self.driven.drive[:1]))


def round_condensed(
    model: Model, kind: str, levels: Sequence[complex], harmonics: int, modes: int, speed: float
) -> RoundCondensed:
    """Condense a rig in space to its clearances.

    Parameters
    ----------
    model : Model
        Rig and law of its clearances.
    kind : str
        Kind of the excitation: "base", "force" or "unbalance".
    levels : sequence of complex
        Amplitudes of the excitation's harmonics from the first on, m/s² or N; one factor of the rig's unbalances.
    harmonics : int
        Number of harmonics of the motion, H.
    modes : int
        Modes of each plane.
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
    laws = laws_of(rig, law, speed)
    structure = linear_model(rig, modes).filled(laws.spring, laws.damper)
    drive = np.zeros((harmonics + 1, structure.size), dtype=complex)
    if kind == UNBALANCE:
        drive[1] = levels[0] * (structure.unbalance[0] - 1j * structure.unbalance[1])
    elif levels:
        drive[1 : len(levels) + 1] = np.outer(levels, structure.input(kind))
    stiffness = structure.elastic(speed)
    if np.linalg.eigvalsh(stiffness + stiffness.T)[0] <= 2e-12 * structure.omega.max() ** 2:
        raise without_stiffness(rig)
    of_contact = np.broadcast_to(law.largest([b.gap for b in rig.bushings])[0], len(rig.bushings))
    stiffest = of_contact + [FILM * k if b.film else 0.0 for k, b in zip(laws.spring, rig.bushings)]
    on_modes = float(np.max(np.repeat(of_contact, 2) * np.sum(structure.at_bushings**2, axis=1)))
    basis, owner = coordinates_of(structure, STIFF, stiffest, speed)
    room = min(b.wall_model.reach(b.gap) - np.hypot(b.offset_y, b.offset) for b in rig.bushings)
    return RoundCondensed(
        model, kind, modes, DrivenModel(structure, drive, kind == UNBALANCE), basis, owner, laws, float(room),
        on_modes, np.asarray(levels, dtype=complex),
    )  # fmt: skip


def round_slopes(laws: Laws, points: int, samples: int, harmonics: int) -> RoundSlopes:
    """Return room for the derivatives of the forces at samples of a period."""
    most = max(int(laws.memory.max()), 2)
    x, v = np.zeros((2, points, 2, 2, samples))
    step = np.zeros((points, samples, most + 2, most + 8))
    rows = np.zeros((points, 2, 2, samples, 2 * harmonics + 1))
    onto, used = np.zeros((points, samples, 2 * harmonics + 1)), np.zeros(points, dtype=int)
    return RoundSlopes(x, v, step, np.zeros((points, samples), dtype=bool), rows, onto, used)
