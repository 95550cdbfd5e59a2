"""A rig's shafts as chains of rigid links, with supports and springs; matrices in the joints' coordinates.

The coordinates are those along y, if the rig moves there, then those along z, then the twist of shafts under torques.
Supports at the left end of a shaft are joints of its chain. All others, and springs, act on linear combinations of the
coordinates: rows of the curved shaft's motions. Rotation couples the planes: G and H are those of linear/model.py, with
the chains' slopes and hinges.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
import scipy.linalg

from ..core.errors import RigError
from ..linear import PlaneRows, RigRows
from ..rig import Bushing, Rig
from ..rig.loads import forced_points
from ..structure import Beam, Shaft, Shafts
from ..structure.base import parse_direction, ratios_of_modes
from ..structure.reduction import vibration_modes
from ..structure.shaft import OF_TWIST
from ..structure.shafts import Spring
from .bending_chain import BendingChain
from .chain import Chain, cut, elements_of
from .twist_chain import TwistChain

__all__ = ["Linkage", "Member", "cannot_be_linked", "linkage"]

Points: TypeAlias = Sequence[float | str] | np.ndarray  # Positions, m, or named points on shafts


class Member(NamedTuple):
    """The motion of one shaft along one axis."""

    axis: Literal["x", "y", "z"]  #: x for its twist
    shaft: int  #: its number
    chain: Chain
    part: slice  #: its coordinates


class Fixed(NamedTuple):
    """Constraints by rigid supports, in addition to joints."""

    axes: list[str]  #: axis of each row, as in `Member`
    rows: np.ndarray  #: (n, nv)


class Springs(NamedTuple):
    """Springs and dampers between shafts and base, or two shafts."""

    axes: list[str]  #: axis of each row, as in `Member`
    rows: np.ndarray  #: (n, nv) their elongation per coordinate
    stiffness: np.ndarray  #: (n,) N/m, or N m/rad
    damping: np.ndarray  #: (n,) N s/m, or N m s/rad


class Linkage:
    """A rig's shafts as chains, in the coordinates of all their joints. Made by `linkage`.

    Parameters
    ----------
    rig : Rig
        The rig.
    members : sequence of (str, int, Chain)
        Axis, number of the shaft and chain, in the order of the coordinates: y, z, x.
    """

    def __init__(self, rig: Rig, members: Sequence[tuple[Literal["x", "y", "z"], int, Chain]]) -> None:
        ends = np.cumsum([0, *(chain.stiffness.size for _, _, chain in members)]).tolist()
        self.rig, self.size = rig, ends[-1]
        self.members = [Member(*each, slice(*span)) for each, span in zip(members, zip(ends, ends[1:]))]

    def along(self, axis: str) -> list[Member]:
        """Return the members along an axis, shaft by shaft."""
        return [member for member in self.members if member.axis == axis]

    @property
    def bends_across(self) -> bool:
        """True if shafts bend along y, too."""
        return bool(self.along("y"))

    @functools.cached_property
    def spans(self) -> tuple[slice, slice]:
        """The coordinates along y, perhaps none, and those along z and of twist."""
        first = self.along("z")[0].part.start
        return slice(0, first), slice(first, self.size)

    @functools.cached_property
    def rayleigh(self) -> tuple[float, float]:
        """Rayleigh damping of the whole, point masses and springs included."""
        whole = self.rig.linear
        return whole.rayleigh if isinstance(whole, Beam | Shaft | Shafts) else (0.0, 0.0)

    def _part_rayleigh(self, chain: Chain) -> tuple[float, float]:
        """Return the additional Rayleigh damping of one of several shafts."""
        return chain.shaft.rayleigh if isinstance(self.rig.linear, Shafts) else (0.0, 0.0)

    def along_own(self, points: Points, across: bool = False, straight: bool = False) -> np.ndarray:
        """Return motions of points along their directions: rotations for RY or RX, curvatures for KZ, zeros for others.

        Parameters
        ----------
        points : sequence of Point, length n_points
            Positions, m, or named points.
        across : bool
            True for the coordinates along y, with points named as in `Structure.in_other_plane`.
        straight : bool
            As in `Chain.motion`.

        Returns
        -------
        ndarray, shape (n_points, n)
            Motions per coordinate of `spans`.
        """
        span = self.spans[not across]
        places = [(self.rig.linear.place(p), parse_direction(p) or ("Z", 1)) for p in points]
        motions = np.zeros((len(places), self.size))
        for _, shaft, chain, part in self.along("y") if across else (*self.along("z"), *self.along("x")):
            for axis, (order, factor) in chain.axes.items():
                here = [(n, x, sign) for n, ((i, x), (own, sign)) in enumerate(places) if (i, own) == (shaft, axis)]
                if here:
                    rows, x, signs = zip(*here)
                    motions[rows, part] = factor * np.array(signs)[:, None] * chain.motion(x, order, straight)
        return motions[:, span]

    def _rows(self, straight: bool) -> RigRows:
        """Return the rows of points on the straight links or the curved shafts."""
        y, z = (
            PlaneRows(functools.partial(self.along_own, across=across, straight=straight), np.eye(n), span)
            for across, span in zip((True, False), self.spans)
            for n in (span.stop - span.start,)
        )
        return RigRows(self.rig, (y if self.bends_across else None, z))

    @functools.cached_property
    def rows(self) -> RigRows:
        """Motions of the rig's points per coordinate."""
        return self._rows(False)

    def contact(self, bushing: Bushing) -> Literal["plates", "limits", "annulus"]:
        """Return a clearance's element in MuJoCo: plates around links, limits of a linear combination, or annulus."""
        if bushing.is_round:
            return "annulus"
        alone = bushing.to is None and parse_direction(bushing.position) is None and not self.bends_across
        return "plates" if alone else "limits"

    @functools.cached_property
    def at_points(self) -> np.ndarray:
        """(3 n_rows, nv) as of `RigRows`; at ends of the straight links where MuJoCo detects their contact."""
        kinds = [self.contact(b) for b in self.rig.bushings for _ in range(2 * b.n_coordinates)]
        limits = np.array([kind == "limits" for kind in kinds], dtype=bool)[:, None]
        ends = np.where(limits, self.rows.at_ends, self._rows(True).at_ends)
        return np.ascontiguousarray(np.vstack((self.rows.at_bushings, ends)))

    @functools.cached_property
    def stiffness(self) -> np.ndarray:
        """(nv,) for the joints."""
        return np.concatenate([m.chain.stiffness for m in self.members])

    @functools.cached_property
    def damping(self) -> np.ndarray:
        """(nv,) for the joints."""
        chains, eta2 = [m.chain for m in self.members], self.rayleigh[1]
        return np.concatenate([c.dashpots + (eta2 + self._part_rayleigh(c)[1]) * c.stiffness for c in chains])

    @functools.cached_property
    def mass(self) -> np.ndarray:
        """(nv, nv) mass matrix."""
        return scipy.linalg.block_diag(*(m.chain.mass for m in self.members))

    @functools.cached_property
    def influence(self) -> np.ndarray:
        """(nv, 2) force of a unit gravity along y and z."""
        influence = np.zeros((self.size, 2))
        for axis, _, chain, part in self.members:
            if isinstance(chain, BendingChain):
                influence[part, "yz".index(axis)] = chain.weight
        return influence

    @functools.cached_property
    def fixed(self) -> Fixed:
        """Rows of motions that supports fix."""
        constraints = [(m.axis, self._expand(m, row)) for m in self.members for row in m.chain.held]
        rows = np.array([row for _, row in constraints]).reshape(-1, self.size)
        if np.linalg.matrix_rank(rows, 1e-9) < len(rows):
            raise RigError(
                f"rig {self.rig.name!r}: supports are too close together for the links between them; use more links, "
                "or the modal engine"
            )
        return Fixed([axis for axis, _ in constraints], rows)

    @functools.cached_property
    def springs(self) -> Springs:
        """Springs and dampers other than joints."""
        eta2, elements = self.rayleigh[1], []
        for axis, span, springs in zip("yz", self.spans, (_springs(self.rig, True), _springs(self.rig))):
            for spring in springs if self.along(axis) else ():
                ends, row = self.along_own(spring.joined, axis == "y"), np.zeros(self.size)
                row[span] = ends[0] - ends[1] if len(ends) > 1 else ends[0]
                if row.any():
                    elements.append((axis, row, spring.stiffness, spring.damping + eta2 * spring.stiffness))
        for member in self.members:
            eta = eta2 + self._part_rayleigh(member.chain)[1]
            elements += [(member.axis, self._expand(member, row), k, c + eta * k) for row, k, c in member.chain.springs]
        axes, rows, stiffness, damping = zip(*elements) if elements else ((), (), (), ())
        return Springs([*axes], np.array(rows).reshape(-1, self.size), np.array(stiffness), np.array(damping))

    def _expand(self, member: Member, row: np.ndarray) -> np.ndarray:
        """Expand a row of one member's coordinates to those of all."""
        expanded = np.zeros(self.size)
        expanded[member.part] = row
        return expanded

    @functools.cached_property
    def free(self) -> np.ndarray:
        """(nv, n) basis of the motions that the supports allow, block-diagonal by member."""
        if not len(self.fixed.rows):
            return np.eye(self.size)
        return scipy.linalg.block_diag(*(_null_space(member.chain.held) for member in self.members))

    @property
    def ratios(self) -> tuple[float, ...]:
        """Damping ratios of the modes of each plane; the last one holds for all that follow."""
        whole = self.rig.linear
        return (whole.damping_ratios or ()) if isinstance(whole, Beam | Shaft | Shafts) else ()

    @property
    def other_elements(self) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray] | tuple[()]:
        """Stiffness and damping of elements other than joints, and `free`; empty for joints alone."""
        if not len(self.springs.rows) and not len(self.fixed.rows) and not any(self.ratios):
            return ()
        _, rows, stiffness, damping = self.springs
        viscous = self.viscous if self.viscous.size else 0.0
        return ((rows.T * stiffness) @ rows, (rows.T * damping) @ rows + viscous), self.free

    @functools.cached_property
    def whole_stiffness(self) -> np.ndarray:
        """(nv, nv) stiffness of joints and springs."""
        _, rows, stiffness, _ = self.springs
        return np.diag(self.stiffness) + (rows.T * stiffness) @ rows

    @functools.cached_property
    def dampers(self) -> np.ndarray:
        """(nv, nv) damping of joints and springs."""
        _, rows, _, damping = self.springs
        return np.diag(self.damping) + (rows.T * damping) @ rows

    @functools.cached_property
    def viscous(self) -> np.ndarray:
        """(nv, nv) further damping: η1 M and that of the modes; (0, 0) for none."""
        etas, ratios = [self._part_rayleigh(m.chain)[0] for m in self.members], self.ratios
        if not self.rayleigh[0] and not any(etas) and not any(ratios):
            return np.zeros((0, 0))
        damping = self.rayleigh[0] * self.mass
        if any(etas):
            masses = (eta * m.chain.without_load.mass for eta, m in zip(etas, self.members))
            damping = damping + scipy.linalg.block_diag(*masses)
        for span in self.spans if any(ratios) else ():
            free, mass = self.free[span], self.mass[span, span]
            free = free[:, free.any(axis=0)]
            if free.size:
                modes = vibration_modes(free.T @ mass @ free, free.T @ self.whole_stiffness[span, span] @ free)
                p = mass @ free @ modes.shapes
                damping[span, span] += (p * (2 * modes.omega * ratios_of_modes(ratios, modes.omega.size))) @ p.T
        return damping

    @functools.cached_property
    def gyroscopic(self) -> np.ndarray:
        """(nv, nv) G, skew, per rad/s of the spin; (0, 0) for a rig that does not turn."""
        return self._skew("polar") if self.rig.spin else np.zeros((0, 0))

    @functools.cached_property
    def circulatory(self) -> np.ndarray:
        """(nv, nv) H, skew, of rotating damping; (0, 0) if there is none."""
        eta2 = self.rayleigh[1] if self.rig.spin else 0.0
        return eta2 * self._skew("strain") if eta2 else np.zeros((0, 0))

    def _skew(self, name: str) -> np.ndarray:
        (y,), (z,) = self.along("y"), self.along("z")
        rows = np.zeros((2, len(getattr(z.chain, name)), self.size))
        for row, member in zip(rows, (y, z)):
            row[:, member.part] = getattr(member.chain, name)
        coupling = rows[0].T @ rows[1]
        return np.asarray(coupling - coupling.T)


def _null_space(constraints: np.ndarray) -> np.ndarray:
    """Return a basis (n, m) of the null space of rows (n_held, n)."""
    return scipy.linalg.null_space(constraints) if len(constraints) else np.eye(constraints.shape[1])


def cannot_be_linked(rig: Rig) -> str:
    """Return why a rig cannot be a chain of rigid links; "" if it can.

    Parameters
    ----------
    rig : Rig
        The rig.
    """
    shafts = rig.linear.shafts
    if not shafts:
        return "links needs a shaft; use modal"
    if any(shaft.bending_theory == "timoshenko" for shaft in shafts):
        return 'links has no shear flexibility; use modal, or theory = "euler" for the shaft'
    for mass in rig.point_masses:
        if (axis := (parse_direction(mass.position) or ("RX", 1))[0]) != "RX":
            return f'links has masses that move in every direction, and "{mass.position}" names {axis}; use modal'
    for name, present in (
        ("fixture", rig.fixture), ("bushings.housing", any(b.housing for b in rig.bushings)), ("planes", rig.planes),
        ("oscillators", rig.oscillators), ("bearings", rig.bearings), ("orders", rig.orders),
    ):  # fmt: skip
        if present:
            return f"links knows no {name}; use modal"
    return ""


@functools.lru_cache(maxsize=32)
def linkage(rig: Rig, links: int) -> Linkage:
    """Cut every shaft of a rig into so many links.

    Parameters
    ----------
    rig : Rig
        The rig.
    links : int
        Number of links of each shaft, without a first one that its left end's joints move.

    Raises
    ------
    RigError
        If the rig's structure has no shafts, or shafts with shear flexibility.
    """
    if refusal := cannot_be_linked(rig):
        raise RigError(f"rig {rig.name!r}: {refusal}")
    across = rig.linear.in_other_plane if rig.moves_across else None
    members: list[tuple[Literal["x", "y", "z"], int, Chain]] = []
    for i, shaft in enumerate(rig.linear.shafts):
        masses = [(_twists(m.position), rig.linear.place(m.position), m.mass) for m in rig.point_masses]
        carried = BendingChain.discs(shaft) + [(x, m, 0.0) for twists, (n, x), m in masses if n == i and not twists]
        twisting = TwistChain.discs(shaft) + [(x, 0.0, m) for twists, (n, x), m in masses if n == i and twists]
        pieces = cut(shaft, links, _element_ends(rig, i, carried))
        along_z = BendingChain(shaft, elements_of(shaft, pieces, "bending"), tuple(carried))
        members.append(("z", i, along_z))
        if across:
            other = across.shafts[i]
            along_y = BendingChain(other, elements_of(other, pieces, "bending"), tuple(carried))
            members.append(("y", i, along_z if other == shaft else along_y))
        if torques := [rig.linear.place(p)[1] for p in _loaded_points(rig) if _twists(p) and _is_on(rig, i, p)]:
            supports = [s.position for s in shaft.supports if s.twist or s.twist_damping or s.holds_twist]
            pieces = cut(shaft, links, [*torques, *supports, *(x for x, _, inertia in twisting if inertia)])
            members.append(("x", i, TwistChain(shaft, elements_of(shaft, pieces, "torsion"), tuple(twisting))))
    return Linkage(rig, sorted(members, key=lambda member: "yzx".index(member[0])))


def _element_ends(rig: Rig, shaft: int, masses: Sequence[tuple[float, float, float]]) -> list[float]:
    """Return positions, m, at which a shaft's elements should end, in order of importance."""
    parts, place = rig.linear.shafts[shaft], rig.linear.place
    middles = [p for b in rig.bushings for p in b.joined]
    of_clearances = middles + [end for b in rig.bushings for p in b.joined for end in b.ends_of(p)]
    joined = [p for spring in _springs(rig) for p in spring.joined]
    return [
        *(s.position for s in parts.supports), *(d.position for d in parts.discs if d.inertia),
        *(place(p)[1] for p in joined + of_clearances if _is_on(rig, shaft, p)),
        *(x for x, _, _ in sorted(masses, key=lambda m: -m[1])),
    ]  # fmt: skip


def _loaded_points(rig: Rig) -> list[float | str]:
    """Return points of forces and torques; a shaft twists if one of them names its twist."""
    joined = [p for points in (*(b.joined for b in rig.bushings), *(s.joined for s in _springs(rig))) for p in points]
    return [*joined, *(m.position for m in rig.point_masses), *(p for p, _ in forced_points(rig.inputs, rig.loads))]


def _is_on(rig: Rig, shaft: int, point: float | str) -> bool:
    return rig.linear.place(point)[0] == shaft


def _twists(point: float | str) -> bool:
    return (parse_direction(point) or "Z")[0] in OF_TWIST


def _springs(rig: Rig, across: bool = False) -> tuple[Spring, ...]:
    """Return springs other than supports, named for motion along y or as in the rig file."""
    whole, attached = (rig.linear.in_other_plane, rig.attached.in_other_plane) if across else (rig.linear, rig.attached)
    return (*(whole.springs if isinstance(whole, Shafts) else ()), *attached.springs)
