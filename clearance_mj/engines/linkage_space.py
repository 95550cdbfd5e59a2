"""A rig's shafts as chains of rigid links in both bending planes; matrices in the coordinates of both, y before z.

Each plane is a `Linkage` of its own, whose supports and sections are those of that plane. What couples them is the
turning of the shaft: G and H are those of linear/model.py, with the chains' slopes and hinges.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from ..linear import PlaneRows, RigRows
from ..linear.making import skew
from ..rig import Rig
from ..structure import Beam
from .chain import Chain
from .linkage import Linkage, linkage

__all__ = ["SpatialLinkage", "spatial_linkage"]


@dataclass(frozen=True, eq=False)
class SpatialLinkage:
    """A rig's shafts as chains along y and z. Made by `spatial_linkage`."""

    rig: Rig
    planes: tuple[Linkage, Linkage]
    """along y and along z"""

    @property
    def size(self) -> int:
        """Number of coordinates, of both planes."""
        return sum(plane.size for plane in self.planes)

    @property
    def spans(self) -> tuple[slice, slice]:
        """The coordinates along y and those along z."""
        first = self.planes[0].size
        return slice(0, first), slice(first, self.size)

    def diagonal(self, of_plane: Callable[[Linkage], np.ndarray]) -> np.ndarray:
        """Return the matrix (nv, nv) of both planes, which it does not couple.

        Parameters
        ----------
        of_plane : callable
            Returns the matrix of one plane, or (0, 0) for none.
        """
        found = np.zeros((self.size, self.size))
        for plane, part in zip(self.planes, self.spans):
            own = of_plane(plane)
            if own.size:
                found[part, part] = own
        return found

    @functools.cached_property
    def rows(self) -> RigRows:
        """How points move per coordinate, at clearances' ends on the straight links, where MuJoCo looks for contact."""
        y, z = (PlaneRows(p.along_own, np.eye(p.size), s, p.lever) for p, s in zip(self.planes, self.spans))
        return RigRows(self.rig, (y, z))

    @functools.cached_property
    def influence(self) -> np.ndarray:
        """(nv, 2) force of a unit gravity along y and z."""
        found = np.zeros((self.size, 2))
        for d, (plane, part) in enumerate(zip(self.planes, self.spans)):
            found[part, d] = np.concatenate([_weight(chain) for chain in plane.chains])
        return found

    @functools.cached_property
    def gyroscopic(self) -> np.ndarray:
        """(nv, nv) G, skew, per rad/s of the spin; (0, 0) of a rig that does not turn."""
        return self._skew(_polar) if self.rig.spin else np.zeros((0, 0))

    @functools.cached_property
    def circulatory(self) -> np.ndarray:
        """(nv, nv) H, skew, of the damping that turns with the shaft; (0, 0) if there is none."""
        eta2 = self.planes[1].rayleigh[1] if self.rig.spin else 0.0
        return eta2 * self._skew(_strain) if eta2 else np.zeros((0, 0))

    def _skew(self, rows: Callable[[Chain], np.ndarray]) -> np.ndarray:
        (y,), (z,) = (plane.chains for plane in self.planes)
        return skew(rows(y).T @ rows(z))

    @functools.cached_property
    def free(self) -> np.ndarray:
        """(nv, n) basis of the motions that the supports allow."""
        return np.asarray(scipy.linalg.block_diag(*(plane.free for plane in self.planes)))

    @functools.cached_property
    def dampers(self) -> np.ndarray:
        """(nv, nv) damping of joints and springs."""
        springs = self.diagonal(lambda plane: (plane.springs.rows.T * plane.springs.damping) @ plane.springs.rows)
        return np.diag(np.concatenate([plane.damping for plane in self.planes])) + springs


@functools.lru_cache(maxsize=32)
def spatial_linkage(rig: Rig, links: int) -> SpatialLinkage:
    """Cut every shaft of a spatial rig into so many links, along y and along z.

    Parameters
    ----------
    rig : Rig
        The rig.
    links : int
        Number of links of each shaft.

    Raises
    ------
    RigError
        As `linkage`.
    """
    upright = linkage(rig, links)
    across = rig.linear.in_other_plane
    if across == rig.linear:
        return SpatialLinkage(rig, (upright, upright))
    turned = rig.replace(beam=across) if isinstance(across, Beam) else rig.replace(structure=across)
    return SpatialLinkage(rig, (linkage(turned, links), upright))


def _weight(chain: Chain) -> np.ndarray:
    masses = np.array([link.mass for link in chain.links])
    return np.asarray(masses @ chain.lever([link.centre for link in chain.links]))


def _polar(chain: Chain) -> np.ndarray:
    """(n, nv) slopes times the root of the polar inertia there: of sections, twice their rotary inertia, and discs."""
    shaft = chain.shaft
    places, inertia = [d.position for d in shaft.discs], [d.about_axis for d in shaft.discs]
    for element in chain.elements:
        at, weight, rigidity = shaft.integration(element.start, element.end)
        places.extend(at)
        inertia.extend(2 * weight * rigidity.rotary)
    return np.asarray(np.sqrt(inertia)[:, None] * chain.slope(places))


def _strain(chain: Chain) -> np.ndarray:
    """(n_hinges, nv) strains of unit energy of the hinges."""
    roots = chain.slides + chain.turns
    return np.diag(np.sqrt(chain.stiffness))[roots:]
