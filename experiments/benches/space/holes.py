"""Bushings as they really are, and as arrays that compiled code takes."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from clearance_mj import ClearanceError

from . import physics
from .table import film_table

FAR = 1e6  # m, a gap that no shaft crosses


@dataclass(frozen=True)
class Hole:
    """A bushing as it really is, SI; the numbers are those of `physics.Bushings`."""

    position: float
    length: float
    gap: float
    oval: float  #: the gap is gap (1 + oval cos 2(θ - axis))
    axis: float  #: rad from y towards z, of the widest gap
    offset_y: float  #: of the unloaded shaft's centre from the bushing's middle
    offset_z: float
    radius: float  #: of the shaft
    contact: tuple[float, float, float, float]
    friction: float
    bristle: float  #: N/m, of both ends together
    elastic: float = 0.0
    slip: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())
    squeeze: tuple[float, float] = (0.0, 1.0)
    viscosity: float = 0.0  #: Pa s; 0 without oil

    @property
    def narrowest(self) -> float:
        """Smallest radial gap of all directions, m."""
        return self.gap * (1 - abs(self.oval))


def as_arrays(holes: Iterable[Hole]) -> physics.Bushings:
    """Return bushings as compiled code takes them; those with oil share one ratio of length to diameter."""
    holes = tuple(holes)
    slip = np.zeros((len(holes), 2, max((len(h.slip[0]) for h in holes), default=0)))
    for row, hole in zip(slip, holes):
        row[:, : len(hole.slip[0])] = hole.slip
    widths = {h.length / (2 * h.radius) for h in holes if h.viscosity}
    table = film_table(round(widths.pop(), 4)) if widths else np.zeros((2, 2, 2))
    if widths:
        raise ClearanceError("all bushings with oil of one bench share one ratio of length to diameter")

    def column(name: str) -> np.ndarray:
        return np.array([getattr(h, name) for h in holes], dtype=float)

    oval = column("oval")[:, None] * np.column_stack((np.cos(2 * column("axis")), np.sin(2 * column("axis"))))
    film = 12 * column("viscosity") * column("radius") * column("length") * (column("radius") / column("gap")) ** 2
    values = {
        "gap": column("gap"), "oval_cosine": oval[:, 0], "oval_sine": oval[:, 1], "offset_y": column("offset_y"),
        "offset_z": column("offset_z"), **dict(zip(("k", "k3", "alpha", "c"), column("contact").reshape(-1, 4).T)),
        "mu": column("friction"), "bristle": column("bristle"), "radius": column("radius"),
        "elastic": column("elastic"), **dict(zip(("squeeze", "height"), column("squeeze").reshape(-1, 2).T)),
        "film": film,
    }  # fmt: skip
    return physics.Bushings(np.column_stack([values[name] for name in physics.COLUMNS]), slip, table)


def dashpot(position: float, damping: float) -> Hole:
    """Return a dashpot from the shaft to the base, N s/m, as a hole."""
    return Hole(position, 0.0, FAR, 0.0, 0.0, 0.0, 0.0, FAR, (1.0, 0.0, 0.0, 0.0), 0.0, 1.0, squeeze=(damping, FAR))
