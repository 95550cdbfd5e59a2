"""Method "amplitude": contact over the amplitude of the motion, k(A) and c(A), out of the restoring forces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...clearance.law import AmplitudeLaw
from ...io.dataset import Dataset
from ...model import Model
from ...rig import Grease
from ..forces.restoring import SETTLE, RestoringForce, restoring_forces
from ..laws.contact_over_time import RELEASES, amplitude_columns, fill_untouched, require_contact
from ..laws.grease import GreaseFit, grease_force, grease_parameters
from ..laws.regression import non_negative, weights
from ..records.needs import probes
from ..registry import Identified, register

__all__ = ["amplitude_law"]

RELEASE = 0.03  # s, of the envelope that the law follows
NODES = 10  # amplitudes at which the law holds k and c
SMOOTH = 1e-3
"""weight of the change of k and c between amplitudes, so that those the motion never reached hold their neighbours'"""


def amplitude_law(dataset: Dataset, progress: bool = False) -> tuple[AmplitudeLaw, GreaseFit]:
    """Contact stiffness and damping over the envelope of the motion, k(A) and c(A), from the restoring forces.

    The Bouc-Wen grease is fitted inside the gap and subtracted; the rest is regressed on the gap function and its
    rate, each spread over the amplitudes as the law will interpolate between them, all records at once. A bushing that
    is never touched takes the others' mean. Also returns the grease with its uncertainty.
    """
    forces = restoring_forces(dataset, progress)
    require_contact(forces)
    grease = grease_parameters(forces)
    nodes = _nodes(forces)
    k, c = zip(*(_over_amplitude(forces, j, g, nodes) for j, g in enumerate(grease.grease)))
    touched = np.any([f.touched for f in forces], axis=0)
    k, c = (fill_untouched(np.column_stack(v), touched) for v in (k, c))
    return AmplitudeLaw(nodes, k, c, RELEASE, grease.grease), grease


@register(
    "amplitude",
    "the rig file and the records to identify: contact over amplitude, Bouc-Wen grease, from the restoring forces",
    shortest=lambda rig: 4 * SETTLE,
    needs=(probes,),
)
def _identify(dataset: Dataset, progress: bool = False) -> Identified:
    return Identified(model=Model(dataset.rig, amplitude_law(dataset, progress)[0]))


def _nodes(forces: Sequence[RestoringForce]) -> np.ndarray:
    """(NODES,) amplitudes from the smallest gap to the largest motion, denser near the gap.

    Spaced evenly in the root of the penetration, in which the stiffness of a Hertz contact is straight.
    """
    smallest = min(b.gap for b in forces[0].rig.bushings)
    largest = max(np.abs(f.displacement[:, f.valid]).max() for f in forces)
    return smallest + max(largest - smallest, 0.01 * smallest) * np.linspace(0, 1, NODES) ** 2


def _over_amplitude(
    forces: Sequence[RestoringForce], bushing: int, grease: Grease, nodes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and damping (n_nodes,) of one bushing."""
    weight = [weights(f, bushing) for f in forces]
    contact_forces = [w * (f.force[bushing] - grease_force(f, bushing, grease)) for w, f in zip(weight, forces)]
    target = np.concatenate((*contact_forces, np.zeros(2 * (nodes.size - 1))))
    k, c = np.ones(nodes.size), np.zeros(nodes.size)  # at first a spring, which never pulls
    for _ in range(RELEASES):
        columns = [amplitude_columns(f, bushing, nodes, RELEASE, k, c) for f in forces]
        matrix = np.vstack([w[:, None] * part for w, part in zip(weight, columns)])
        k, c = np.split(non_negative(np.vstack((matrix, _smoothness(matrix, nodes))), target), 2)
    return k, c


def _smoothness(matrix: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Rows that hold neighbouring k, and neighbouring c, together a little."""
    n = nodes.size
    difference = np.diff(np.eye(n), axis=0)
    norm = np.sqrt(np.sum(matrix**2, axis=0))
    sizes = norm[:n].max(), norm[n:].max()
    return SMOOTH * np.block([[sizes[0] * difference, 0 * difference], [0 * difference, sizes[1] * difference]])
