"""Gains of a turning shaft with two probes in each clearance: forces in the clearances, motion away from the probes.

The shaft is linear and known, and nothing excites it but its unbalance: in the frequency domain probes show
d = H F + W s + r, with F the forces in the clearances, s those of the unbalance and r the run-out. There are as
many probes as forces, so that F = H⁻¹ (d - W s - r): the force over the position that the probes show, up to the
numbers of unbalance and run-out, on which it depends linearly.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ...linear import linear_model
from ...rig import Rig

__all__ = ["ORDERS", "ProbeGains", "places_of_unbalance", "probe_gains", "unit_unbalance_forces"]

MODES = 12  # of each plane of the known structure, to which static shapes are added
ORDERS = (1, 2)  # multiples of the shaft's angle that run-out has


class ProbeGains(NamedTuple):
    """A turning shaft at frequencies, as its probes see it; m = 2 n_bushings, u = 2 n_unbalances."""

    per_force: np.ndarray  #: (n_f, m, m) H, m/N: probes' displacement per force in the clearances, against displacement
    points: np.ndarray  #: (n_f, 3 m, m) motion of `LinearModel.at_points` per force
    per_unbalance: np.ndarray  #: (n_f, m, u) W: probes' displacement per force along y and z at the unbalances
    points_per_unbalance: np.ndarray  #: (n_f, 3 m, u) the same of the points

    @property
    def inverse(self) -> np.ndarray:
        """(n_f, m, m) H⁻¹, N/m."""
        return np.linalg.inv(self.per_force)


def places_of_unbalance(rig: Rig) -> list[tuple[float, float]]:
    """Return places, m, and sizes, kg m, of the unbalances that a shaft may have: the rig file's, else of its discs.

    Parameters
    ----------
    rig : Rig
        Whose shaft turns.
    """
    if rig.unbalances:
        return [(float(u.position), u.moment) for u in rig.unbalances]
    discs = [(float(d.position), d.mass) for shaft in rig.linear.shafts for d in shaft.discs]
    discs += [(float(p.position), p.mass) for p in rig.point_masses if isinstance(p.position, int | float)]
    return [(place, ECCENTRICITY * mass) for place, mass in discs]


ECCENTRICITY = 5e-5  # m, of a disc of which the rig file says nothing: a poor balance (ISO 21940-11, above G 16)


def probe_gains(rig: Rig, probes: Mapping[str, float], spin: float, omega: np.ndarray) -> ProbeGains:
    """Return the gains of the probes of a rig that turns.

    Parameters
    ----------
    rig : Rig
        The rig in space.
    probes : mapping of str to float
        Gains and places of its probes, as `LinearModel.at_probes` takes them.
    spin : float
        rad/s.
    omega : ndarray, shape (n_f,)
        rad/s, from 0 on.
    """
    model = linear_model(rig, MODES)
    forces = -model.at_bushings.T
    rows = np.vstack((model.at_probes(probes), model.at_points))
    # Modal forces of unit forces along y and z at each unbalance; `unit_unbalance_forces` drives them.
    unit = model.moved([place for place, _ in places_of_unbalance(rig)]).reshape(-1, model.size).T
    responses = model.responses(rows, np.hstack((forces, unit)), omega, spin)
    m = forces.shape[1]
    return ProbeGains(responses[:, :m, :m], responses[:, m:, :m], responses[:, :m, m:], responses[:, m:, m:])


def unit_unbalance_forces(angle: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Return the forces (n_t, 2, 2) along y and z of unit unbalances along the mark and across it, N/(kg m).

    Parameters
    ----------
    angle, speed : ndarray, shape (n_t,)
        Of the shaft, rad and rad/s.
    """
    c, s = speed**2 * np.cos(angle), speed**2 * np.sin(angle)
    return np.stack((np.stack((c, -s), axis=-1), np.stack((s, c), axis=-1)), axis=1)
