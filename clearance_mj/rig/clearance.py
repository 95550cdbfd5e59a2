"""Clearances: bushings around shafts, stops of degrees of freedom, the filling of gaps and contact beyond them."""

from __future__ import annotations

import functools
import math
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BeforeValidator, Field

from ..core.errors import RigError
from ..core.validation import NotNegative, Number, Positive, Share, checked, seldom
from ..structure import Point
from ..structure.attached import Housing
from ..structure.base import along_axis, moved, parse_dof, parse_place
from .walls import Wall, coordinates_of, wall_of

__all__ = ["Bushing", "Contact", "Friction", "Grease", "OilFilm"]


RIGHT_ANGLE = 1e-3  # rad, within which two probes stand at right angles


def _first_of_two(value: Any) -> Any:
    if not isinstance(value, list | tuple):
        return value
    if len(value) != 2 or abs(value[1] - value[0] - math.pi / 2) > RIGHT_ANGLE:
        raise ValueError(
            f"{list(value)} rad are not at right angles; give two angles of which the second is pi/2 more than the "
            "first, or the first alone"
        )
    return value[0]


ProbeAngle: TypeAlias = Annotated[Number, BeforeValidator(_first_of_two)]


@checked(RigError)
class Grease:
    """Grease in a bushing: Bouc-Wen hysteresis (Eq. 9) and a squeeze film (physics of the thinning film).

    The force on the shaft is φ = λ k x + (1-λ) k z + c ẋ / max(1-|x|/h, ε)², with
    ż = A ẋ - β|ẋ||z|ⁿ⁻¹z - γ ẋ|z|ⁿ. The default λ = 1 without film height is a linear spring and damper.
    """

    stiffness: NotNegative
    """k, N/m"""
    damping: NotNegative = 0.0
    """c, N s/m, of the centred shaft"""
    elastic_ratio: Share = 1.0
    """λ, share of the stiffness that does not slide"""
    amplitude: Positive = 1.0
    """A"""
    beta: NotNegative = 0.0
    """β, 1/mⁿ (the article's ζ)"""
    gamma: Number = 0.0
    """γ, 1/mⁿ"""
    exponent: Annotated[Number, Field(ge=1)] = 2.0
    """n"""
    film_height: Positive | None = None
    """h, m: film thickness at which the squeeze film would close; None: damping does not grow"""
    film_limit: Annotated[Positive, Field(le=1)] = 0.2
    """ε, smallest relative film thickness (the asperities' share of h)"""

    def __post_init__(self) -> None:
        if abs(self.gamma) > self.beta:
            raise ValueError(
                f"gamma {self.gamma:g} makes the Bouc-Wen element create energy "
                f"(needs -beta <= gamma <= beta, beta = {self.beta:g})"
            )
        if self.elastic_ratio < 1 and self.beta + self.gamma <= 0:
            raise ValueError("beta + gamma must be > 0 when elastic_ratio < 1, or the loop never yields")

    @property
    def yield_displacement(self) -> float:
        """z_ult = (A/(β+γ))^(1/n) in m; infinite for a linear grease."""
        total = self.beta + self.gamma
        return (self.amplitude / total) ** (1 / self.exponent) if total > 0 else math.inf


@checked(RigError)
class Contact:
    """Datasheet contact of shaft and bushing, linearised at one gap of penetration."""

    stiffness: Positive
    """k, N/m"""
    damping: NotNegative = 0.0
    """c, N s/m"""
    bearable_depth: Positive | None = seldom(default=None)
    """m, at which the bushing begins to yield; a deeper contact is warned of where it is predicted"""


@checked(RigError)
class Friction:
    """Dry friction of shaft and bushing: bristles that bend up to the largest force, then slide."""

    coefficient: NotNegative
    """μ, largest friction over the normal force where it slides fast"""
    stiffness: Positive | None = seldom(default=None)
    """N/m, of the bristles; None: that of the datasheet contact"""
    damping: NotNegative = seldom(default=0.0)
    """N s/m, of the bristles while they stick"""
    static_ratio: Annotated[Number, Field(ge=1)] = seldom(default=1.0)
    """largest friction where sliding begins, over that of fast sliding"""
    stribeck_speed: Positive | None = seldom(default=None)
    """m/s, at which the friction has fallen by 63 % of the way to that of fast sliding"""
    along: Point | None = seldom(default=None)
    """of a clearance along one coordinate: the point, of another coordinate, that slides along the wall; None: the
    shaft there along y, of a rig that moves along y and z, whose surface turns with it"""

    def __post_init__(self) -> None:
        if self.static_ratio > 1 and self.stribeck_speed is None:
            raise ValueError("stribeck_speed is missing; static_ratio > 1 needs a speed over which the friction falls")


@checked(RigError)
class OilFilm:
    """Oil in a plain bearing, which fills a round clearance in the place of grease."""

    viscosity: Positive
    """Pa s"""
    asperities: NotNegative = seldom(default=0.0)
    """m: height of both surfaces' asperities, the thinnest film"""
    cavitated: bool = seldom(default=True)
    """whether oil cannot pull; False: pressure below the surroundings' too, all around"""
    width: Literal["short", "finite"] = seldom(default="short")
    """"short": Ocvirk's short bearing, whose oil flows along it alone, for lengths up to a quarter of the diameter;
    "finite": Reynolds' equation of any length"""


@checked(RigError)
class Bushing:
    """A clearance: a bushing around a shaft, or a degree of freedom that meets a stop, or another one, beyond a gap.

    A bushing touches at its two ends once the shaft has moved by the radial gap.
    """

    position: Point
    """m along the shaft to the bushing's middle, or a degree of freedom such as "12:+Z" """
    gap: Positive
    """radial clearance d, m"""
    length: NotNegative
    """m along the shaft, 0 for a degree of freedom; contact happens at both ends, each with half of k and c"""
    grease: Grease
    """what fills the gap"""
    contact: Contact
    """what happens beyond it"""
    to: Point | None = None
    """the point, of another shaft or part, relative to which ``position`` moves; None: the base"""
    offset: Number = seldom(default=0.0)
    """m from the bushing's middle to where the shaft stands at rest, within the gap; the film is thinner there. Along
    z, and of a rig with gravity without the shaft's weight"""
    stops: Literal["both", "upper", "lower"] = seldom(default="both")
    """where there is a wall: on both sides, or on that of positive or negative displacement alone"""
    shape: str | None = seldom(default=None)
    """of the walls: "slot", one on each side along z or the degree of freedom, "stop", one alone, "round", a circle in
    the y-z plane, "oval", one with two lobes, or another known wall; None: as ``stops`` says, a slot or a stop"""
    wall: dict[str, Number] | None = seldom(default=None)
    """numbers of the shape beside the gap, such as those of `clearance.walls.oval.Oval`"""
    housing: Housing | None = seldom(default=None)
    """what holds the bushing where it gives; None: it is fixed to the base"""
    probe_delay: Number = seldom(default=0.0)
    """s, by which the samples of the bushing's displacement probe are late"""
    offset_y: Number = seldom(default=0.0)
    """m, the same along y, of a round clearance"""
    friction: Friction | None = seldom(default=None)
    """of the contact; None: it slides without"""
    film: OilFilm | None = seldom(default=None)
    """oil in the gap, of a round clearance; None: grease"""
    radius: Positive | None = seldom(default=None)
    """m, of the shaft where it touches; None: half the section's depth there"""
    probe_angle: ProbeAngle = seldom(default=0.0)
    """rad, by which two displacement probes in a round clearance are turned from y and z, > 0 from y to z; or the
    angles of both from y, at right angles"""
    wear: NotNegative | None = seldom(default=None)
    """m²/N, Archard's coefficient: volume worn off per normal force and sliding distance; 1 mm³/(N m) is 1e-9 m²/N"""
    worn: Literal["bushing", "shaft"] = seldom(default="bushing")
    """what wears: the bushing's wall where it is touched, or the shaft, evenly all around where it turns"""

    def __post_init__(self) -> None:
        if math.hypot(self.offset_y, self.offset) >= self.gap:
            where = f"{self.offset:g} m" if not self.offset_y else f"({self.offset_y:g}, {self.offset:g}) m along y, z"
            raise ValueError(f"offset {where} lies beyond the gap {self.gap:g} m: at rest the shaft touches no wall")
        if self.film and (self.grease.stiffness or self.grease.damping):
            raise ValueError("film is oil and grease has a stiffness or damping: one of them fills the gap")
        if self.film and not self.length:
            raise ValueError("film needs the bushing's length: a short bearing carries with its cube")
        if self.film and self.film.asperities >= self.gap:
            raise ValueError(
                f"film.asperities {self.film.asperities:g} m are as high as the gap {self.gap:g} m is wide; there is "
                "no room for oil"
            )
        if self.shape and not self.is_round and self.shape != self.default_shape:
            raise ValueError(
                f'shape "{self.shape}" stands beside stops "{self.stops}", which is a {self.default_shape}'
            )
        if self.is_round and self.stops != "both":
            raise ValueError(f'stops "{self.stops}" is one wall; a round clearance has its wall all around')
        if self.wall and self.wall_model.reach(self.gap) <= 0:
            raise ValueError(f"wall {self.wall} leaves no room in the gap {self.gap:g} m; it has less than it takes")
        if self.housing and self.to is not None:
            raise ValueError('housing holds a bushing to the base, and "to" says that it is on another part')

    def __hash__(self) -> int:
        return hash((self.position, self.gap, self.offset, self.shape))  # the numbers of its wall have no hash

    @property
    def n_coordinates(self) -> int:
        """Coordinates: 1 of walls across one direction, 2, y and z, of a round clearance."""
        return coordinates_of(self.shape) if self.shape else 1

    @property
    def is_round(self) -> bool:
        """True if its wall is all around: it has two coordinates, y and z."""
        return self.n_coordinates == 2

    @functools.cached_property
    def wall_model(self) -> Wall:
        """Model of its wall."""
        side = {} if self.stops == "both" else {"side": self.stops}
        return wall_of(self.shape or self.default_shape, {**side, **(self.wall or {})})

    @property
    def default_shape(self) -> Literal["slot", "stop"]:
        """Shape of a clearance along one coordinate."""
        return "slot" if self.stops == "both" else "stop"

    @property
    def sliding_point(self) -> float | str | None:
        """The point that slides along the wall of a clearance of one coordinate with friction, else None."""
        if self.is_round or self.friction is None:
            return None
        if self.friction.along is not None:
            return self.friction.along
        place = parse_place(self.position)
        return f"{place[0]}@{place[1]!r}:Y" if place else along_axis(self.position, "Y")

    @property
    def round_only_fields(self) -> tuple[str, ...]:
        """Names of its fields that have a meaning only in a round clearance."""
        radius = None if self.wear or self.friction else self.radius  # they act there in a slot, too
        fields = {"offset_y": self.offset_y, "film": self.film, "radius": radius, "probe_angle": self.probe_angle}
        return tuple(name for name, value in fields.items() if value)

    @property
    def walls(self) -> tuple[float, float]:
        """Displacements from rest at which the shaft meets the lower and the upper wall, m; infinite without a wall."""
        lower, upper = -self.gap - self.offset, self.gap - self.offset
        return -math.inf if self.stops == "upper" else lower, math.inf if self.stops == "lower" else upper

    @property
    def ends(self) -> tuple[float | str, float | str]:
        """The two points of contact."""
        return self.ends_of(self.position)

    def ends_of(self, point: float | str) -> tuple[float | str, float | str]:
        """Return the two points half the bushing's length before and behind another one.

        Parameters
        ----------
        point : Point
            ``position`` or ``to``.
        """
        return moved(point, -self.length / 2), moved(point, self.length / 2)

    def holds(self, point: float | str) -> bool:
        """Return True if a point of the structure lies in the bushing, on the side of ``position``.

        Parameters
        ----------
        point : Point
            Such as a sensor's position.
        """
        dof, centre_dof = parse_dof(point), parse_dof(self.position)
        if dof or centre_dof:
            return dof is not None and centre_dof is not None and dof[:2] == centre_dof[:2]
        (shaft, x), (bushing, middle) = parse_place(point) or ("", 0.0), parse_place(self.position) or ("", 0.0)
        return shaft == bushing and middle - self.length / 2 <= x <= middle + self.length / 2

    @property
    def where(self) -> str:
        """Position in words, for messages and tables."""
        return " to ".join(f"x = {p:.4g} m" if isinstance(p, float) else p for p in self.joined)

    @property
    def joined(self) -> tuple[float | str, ...]:
        """The points whose relative motion the clearance limits: ``position`` and, unless it is the base, ``to``."""
        return (self.position,) if self.to is None else (self.position, self.to)

    @property
    def joined_ends(self) -> tuple[tuple[float | str, ...], ...]:
        """Those points of both ends of the bushing."""
        return tuple(zip(*map(self.ends_of, self.joined)))
