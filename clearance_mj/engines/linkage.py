"""A rig's shafts as chains of rigid links, with what holds and joins them; matrices in the joints' coordinates.

Supports at the left end of a shaft are joints of its chain. All others, and springs, act on linear combinations of the
coordinates: the rows of the curved shaft's deflection or slope.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple, TypeAlias

import numpy as np
import scipy.linalg

from ..core.errors import RigError
from ..linear import PlaneRows, RigRows
from ..rig import Rig
from ..rig.dimensions import directed_points
from ..structure import Beam, Shaft, Shafts
from ..structure.base import parse_direction, ratios_of_modes
from ..structure.reduction import vibration_modes
from ..structure.shaft import OF_BENDING
from ..structure.shafts import Spring
from .chain import Chain, chain_of, of_discs

__all__ = ["Linkage", "Springs", "linkage"]


Points: TypeAlias = Sequence[float | str] | np.ndarray  # Positions, m, or named points on shafts


class Springs(NamedTuple):
    """Springs and dampers between shafts and base, or two shafts."""

    rows: np.ndarray  #: (n, nv) their elongation per coordinate
    stiffness: np.ndarray  #: (n,) N/m, or N m/rad
    damping: np.ndarray  #: (n,) N s/m, or N m s/rad


@dataclass(frozen=True, eq=False)
class Linkage:
    """A rig's shafts as chains, in the coordinates of all their joints."""

    rig: Rig
    chains: tuple[Chain, ...]

    @functools.cached_property
    def rayleigh(self) -> tuple[float, float]:
        """Of the whole, point masses and springs included."""
        whole = self.rig.linear
        return whole.rayleigh if isinstance(whole, Beam | Shaft | Shafts) else (0.0, 0.0)

    def _own_rayleigh(self, chain: Chain) -> tuple[float, float]:
        """Of one of several shafts, in addition."""
        return chain.shaft.rayleigh if isinstance(self.rig.linear, Shafts) else (0.0, 0.0)

    @functools.cached_property
    def slices(self) -> tuple[slice, ...]:
        """The coordinates of each chain."""
        ends = np.cumsum([0, *(chain.stiffness.size for chain in self.chains)]).tolist()
        return tuple(slice(*pair) for pair in pairwise(ends))

    def lever(self, points: Points) -> np.ndarray:
        """Return (n_points, nv) deflection of points on the straight links per coordinate."""
        return self._rows("lever", points)

    def deflection(self, points: Points) -> np.ndarray:
        """Return (n_points, nv) deflection of points on the curved shafts per coordinate."""
        return self._rows("deflection", points)

    def along_own(self, points: Sequence[float | str]) -> np.ndarray:
        """Return the same along the points' own directions: rotations of RY, curvatures of KZ, zeros of others."""
        named = [(parse_direction(point) or ("Z", 1)) for point in points]
        orders, signs = zip(*(OF_BENDING.get(axis, (0, 0.0)) for axis, _ in named)) if named else ((), ())
        found = np.zeros((len(named), self.size))
        for order, kind in enumerate(("deflection", "slope", "curvature")):
            here = [i for i, own in enumerate(orders) if own == order]
            found[here] = self._rows(kind, [points[i] for i in here])
        return found * (np.array(signs) * [sign for _, sign in named])[:, None]

    @functools.cached_property
    def rows(self) -> RigRows:
        """How the rig's points move per coordinate."""
        return RigRows(self.rig, (None, PlaneRows(self.along_own, np.eye(self.size), slice(0, self.size))))

    def _rows(self, kind: str, points: Points) -> np.ndarray:
        places = [self.rig.linear.place(point) for point in points]
        found = np.zeros((len(places), self.size))
        for i, (chain, part) in enumerate(zip(self.chains, self.slices)):
            here = [n for n, (index, _) in enumerate(places) if index == i]
            found[here, part] = getattr(chain, kind)([places[n][1] for n in here])
        return found

    @functools.cached_property
    def at_bushings(self) -> np.ndarray:
        """(n_bushings, nv) relative displacement in the middle of each clearance."""
        return np.array([self._relative(b.joined, "deflection") for b in self.rig.bushings]).reshape(-1, self.size)

    @functools.cached_property
    def at_ends(self) -> np.ndarray:
        """(2 n_bushings, nv) relative displacement at both ends of each clearance, of links or, between two, shafts."""
        ends = [
            self._relative(points, "lever" if b.to is None else "deflection")
            for b in self.rig.bushings
            for points in b.joined_ends
        ]
        return np.array(ends).reshape(-1, self.size)

    def _relative(self, joined: Sequence[float | str], kind: str) -> np.ndarray:
        rows = self._rows(kind, joined)
        return rows[0] - rows[1] if len(rows) > 1 else rows[0]

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return self.stiffness.size

    @functools.cached_property
    def stiffness(self) -> np.ndarray:
        """(nv,) of the joints."""
        return np.concatenate([c.stiffness for c in self.chains])

    @functools.cached_property
    def damping(self) -> np.ndarray:
        """(nv,) of the joints."""
        eta2 = self.rayleigh[1]
        return np.concatenate([c.dashpots + (eta2 + self._own_rayleigh(c)[1]) * c.stiffness for c in self.chains])

    @functools.cached_property
    def mass(self) -> np.ndarray:
        """(nv, nv) mass matrix."""
        return scipy.linalg.block_diag(*(c.mass for c in self.chains))

    @functools.cached_property
    def fixed(self) -> np.ndarray:
        """(n, nv) rows of deflections and slopes that supports hold at zero."""
        rows = {}
        for chain in self.chains:
            for support in (s for s in chain.shaft.supports if not chain.at_start(s)):
                if support.kind in ("clamped", "pinned"):
                    rows[chain, support.position, "z"] = self._of(chain, chain.deflection(support.position))
                if support.kind in ("clamped", "guided"):
                    rows[chain, support.position, "turn"] = self._of(chain, chain.slope(support.position))
        found = np.array(list(rows.values())).reshape(-1, self.size)
        if np.linalg.matrix_rank(found, 1e-9) < len(found):
            raise RigError(
                f"rig {self.rig.name!r}: supports are too close together for the links between them; use more links, "
                "or the modal engine"
            )
        return found

    @functools.cached_property
    def springs(self) -> Springs:
        """What is elastic beside the joints."""
        found = [
            (self._relative(s.joined, "deflection"), s.stiffness, s.damping + self.rayleigh[1] * s.stiffness)
            for s in _joining(self.rig)
        ]
        for chain in self.chains:
            eta2 = self.rayleigh[1] + self._own_rayleigh(chain)[1]
            for s in (s for s in chain.shaft.supports if not chain.at_start(s)):
                for k, c, row in (
                    (s.translation, s.translation_damping, chain.deflection(s.position)),
                    (s.rotation, s.rotation_damping, chain.slope(s.position)),
                ):
                    if k or c:
                        found.append((self._of(chain, row), k, c + eta2 * k))
        rows, stiffness, damping = zip(*found) if found else ((), (), ())
        return Springs(np.array(rows).reshape(-1, self.size), np.array(stiffness), np.array(damping))

    def _of(self, chain: Chain, row: np.ndarray) -> np.ndarray:
        """A row of one chain's coordinates in those of all."""
        found = np.zeros(self.size)
        found[self.slices[self.chains.index(chain)]] = row[0]
        return found

    @functools.cached_property
    def free(self) -> np.ndarray:
        """(nv, n) basis of the motions that the supports allow."""
        return scipy.linalg.null_space(self.fixed) if len(self.fixed) else np.eye(self.size)

    @property
    def ratios(self) -> tuple[float, ...]:
        """Damping ratios of the modes; the last one holds for all that follow."""
        whole = self.rig.linear
        return (whole.damping_ratios or ()) if isinstance(whole, Beam | Shaft | Shafts) else ()

    @property
    def beside(self) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray] | tuple[()]:
        """Stiffness and damping of what is no joint, and `free`; nothing for joints alone."""
        if not len(self.springs.rows) and not len(self.fixed) and not any(self.ratios):
            return ()
        rows, stiffness, damping = self.springs
        viscous = self.viscous if self.viscous.size else 0.0
        return ((rows.T * stiffness) @ rows, (rows.T * damping) @ rows + viscous), self.free

    @functools.cached_property
    def whole_stiffness(self) -> np.ndarray:
        """(nv, nv) of joints and springs."""
        rows, stiffness, _ = self.springs
        return np.diag(self.stiffness) + (rows.T * stiffness) @ rows

    @functools.cached_property
    def viscous(self) -> np.ndarray:
        """(nv, nv) damping that neither joints nor springs have: η1 M and that of the modes; (0, 0) for none."""
        own, ratios = [self._own_rayleigh(chain)[0] for chain in self.chains], self.ratios
        if not self.rayleigh[0] and not any(own) and not any(ratios):
            return np.zeros((0, 0))
        found = self.rayleigh[0] * self.mass
        if any(own):
            found = found + scipy.linalg.block_diag(*(eta * c.without_load.mass for eta, c in zip(own, self.chains)))
        if any(ratios):
            project = self.free.T
            modes = vibration_modes(project @ self.mass @ self.free, project @ self.whole_stiffness @ self.free)
            of_modes = 2 * modes.omega * ratios_of_modes(ratios, modes.omega.size)
            pull = self.mass @ self.free @ modes.shapes
            found = found + (pull * of_modes) @ pull.T
        return found


def cannot_be_linked(rig: Rig) -> str:
    """Return in words why a rig in a plane is no chain of rigid links; "" if it is.

    Parameters
    ----------
    rig : Rig
        The rig.
    """
    shafts, others = rig.linear.shafts, "modal" if rig.is_spatial else "modal or modal-mj"
    if not shafts:
        return f"links needs a shaft; use {others}"
    if any(shaft.bending_theory == "timoshenko" for shaft in shafts):
        return 'links has no shear flexibility; use modal, or theory = "euler" for the shaft'
    for name, axis in directed_points(rig).items():
        return f"links moves along its planes alone, and {name} names {axis}; use {others}"
    for what, there in (
        ("fixture", rig.fixture), ("bushings.housing", any(b.housing for b in rig.bushings)), ("planes", rig.planes),
        ("oscillators", rig.oscillators), ("bearings", rig.bearings), ("orders", rig.orders),
        ("torques", any(load.torque for load in rig.loads)),
    ):  # fmt: skip
        if there:
            return f"links knows no {what}; use {others}"
    return ""


@functools.lru_cache(maxsize=32)
def linkage(rig: Rig, links: int) -> Linkage:
    """Cut every shaft of a rig into so many links.

    Parameters
    ----------
    rig : Rig
        The rig.
    links : int
        Number of links of each shaft.

    Raises
    ------
    RigError
        If the rig's structure has no shafts, or shafts with shear flexibility.
    """
    if refusal := cannot_be_linked(rig):
        raise RigError(f"rig {rig.name!r}: {refusal}")
    shafts = rig.linear.shafts
    masses = [list(of_discs(shaft)) for shaft in shafts]
    for mass in rig.point_masses:
        i, x = rig.linear.place(mass.position)
        masses[i].append((x, mass.mass, 0.0))
    joined = [p for spring in _joining(rig) for p in spring.joined]
    middles = [p for b in rig.bushings for p in b.joined]
    of_clearances = middles + [end for b in rig.bushings for p in b.joined for end in b.ends_of(p)]
    chains = []
    for i, shaft in enumerate(shafts):
        wanted = [s.position for s in shaft.supports] + [d.position for d in shaft.discs if d.inertia]
        wanted += [x for index, x in (rig.linear.place(p) for p in joined + of_clearances) if index == i]
        wanted += [x for x, _, _ in sorted(masses[i], key=lambda m: -m[1])]
        chains.append(chain_of(shaft, links, wanted, masses[i]))
    return Linkage(rig, tuple(chains))


def _joining(rig: Rig) -> tuple[Spring, ...]:
    return (*(rig.linear.springs if isinstance(rig.linear, Shafts) else ()), *rig.springs)
