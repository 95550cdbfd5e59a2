"""Linear rigs as the rig file and its tolerances allow them, with springs for whatever acts in the clearances."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...estimate.parameter import Parameter
from ...rig import Rig
from ..structure.force_gains import SpectralLines, force_gains
from ..structure.priors import priors

__all__ = ["DrawnRig", "draw_rigs", "transfer_functions"]

CUT = 2.0  # prior standard deviations, at which draws are cut
SOFTER_STIFFER = 0.7  # powers of ten about the filling's stiffness
DAMPED = 1.0  # powers of ten about the filling's damping
LOSS = 0.1  # loss factor of a spring that stands for contact: impacts dissipate


@dataclass(frozen=True, eq=False)
class DrawnRig:
    """Values of a rig's uncertain numbers, and the springs and dashpots that act in its clearances."""

    values: dict[str, float]  #: by the names of `priors`, SI units
    stiffness: np.ndarray  #: (n_bushings,) N/m
    damping: np.ndarray  #: (n_bushings,) N s/m


def draw_rigs(rig: Rig, highest: float, count: int, seed: int = 0) -> list[DrawnRig]:
    """Return rigs drawn from the priors of the rig file; the first is that of the file.

    Parameters
    ----------
    rig : Rig
        The rig.
    highest : float
        Hz, upper end of the band.
    count : int
        Number of draws.
    seed : int
        Of the draws.
    """
    rng = np.random.default_rng(seed)
    # Of a bushing its place alone is a part of the structure.
    opened = [p for p in priors(rig, highest) if not p.name.startswith("sensors")]
    drawn = [p for p in opened if not p.name.startswith("bushings") or p.name.endswith((".position", ".to"))]
    rigs, n = [], len(rig.bushings)
    stiffness = np.array([b.grease.stiffness for b in rig.bushings])
    damping = np.array([b.grease.damping for b in rig.bushings])
    wall = np.array([b.contact.stiffness for b in rig.bushings])
    for number in range(count):
        values = {p.name: _draw_value(p, rng) if number else p.start for p in drawn}
        soft = stiffness * 10 ** rng.uniform(-SOFTER_STIFFER, SOFTER_STIFFER, n)
        # Every other draw has walls that are met: a spring between none and the contact's.
        walls = wall * rng.uniform(0, 1, n) ** 2
        viscous = damping * 10 ** rng.uniform(-DAMPED, DAMPED, n)
        rigs.append(DrawnRig(values, soft + walls * (number % 2), viscous))
    return rigs


def transfer_functions(rig: Rig, drawn: DrawnRig, kind: str, frequency: np.ndarray) -> np.ndarray:
    """Return the transfer functions from the excitation to accelerometers and a probe in every clearance.

    Parameters
    ----------
    rig : Rig
        The rig.
    drawn : DrawnRig
        Values of its uncertain numbers, and its springs.
    kind : str
        Kind of excitation: "base" or "force".
    frequency : ndarray, shape (n_f,)
        Hz.

    Returns
    -------
    ndarray, shape (n_f, n_sensors + n_bushings), complex
    """
    omega, count = 2 * np.pi * frequency, len(rig.bushings)
    (gains,) = force_gains(rig, drawn.values, True, [SpectralLines(kind, omega, rig)])
    of_forces, of_excitation = gains[:, :-1, :-1], gains[:, :-1, -1]
    if not count:
        return of_excitation
    dynamic = drawn.stiffness * (1 + LOSS * 1j) + 1j * omega[:, None] * drawn.damping
    probes = slice(-count, None)
    closed = np.eye(count) - of_forces[:, probes] * dynamic[:, None, :]
    motion = np.linalg.solve(closed, of_excitation[:, probes, None])
    return np.asarray(of_excitation + (of_forces @ (dynamic[:, :, None] * motion))[:, :, 0])


def _draw_value(parameter: Parameter, rng: np.random.Generator) -> float:
    centre = parameter.to_varied(parameter.start)
    varied = centre + parameter.prior_std * np.clip(rng.standard_normal(), -CUT, CUT)
    return float(np.clip(parameter.from_varied(np.array(varied)), parameter.low, parameter.high))
