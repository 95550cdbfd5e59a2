"""The rig: a clamped shaft, its point masses, bushings with clearance, sensors and shaker.

Plain frozen data in SI units, read from and written to TOML. Every impossible value is refused by
`RigError` with a message that names the field.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import tomllib
import types
import typing
from dataclasses import dataclass, field
from pathlib import Path

import tomli_w

from .errors import RigError
from .files import replacing

__all__ = [
    "Beam",
    "Bushing",
    "Contact",
    "Grease",
    "PointMass",
    "Rig",
    "Sensor",
    "Shaker",
    "from_plain",
    "to_plain",
]

BASE_NODE = 100
"""Node of the base acceleration in records."""
SHAKER_NODE = 200
"""Node of the shaker's (or hammer's) force in records."""


@dataclass(frozen=True)
class Beam:
    """A uniform Euler-Bernoulli shaft, clamped at x = 0 and free at x = length.

    Give ``diameter`` for a round section, or ``width`` and ``height`` (in the direction of vibration) for a
    rectangular one.
    """

    length: float
    """m"""
    young_modulus: float
    """Pa"""
    density: float
    """kg/m³"""
    diameter: float | None = None
    """m"""
    width: float | None = None
    """m"""
    height: float | None = None
    """m, in the direction of vibration"""
    rayleigh: tuple[float, float] = (0.0, 0.0)
    """(η1 in 1/s, η2 in s): damping η1 M + η2 K, Eq. 6"""

    def __post_init__(self):
        for name in ("length", "young_modulus", "density"):
            _require(getattr(self, name) > 0, f"beam.{name}", getattr(self, name), "must be > 0")
        round_, rectangular = self.diameter is not None, (self.width is not None or self.height is not None)
        if round_ == rectangular or (self.width is None) != (self.height is None):
            raise RigError("beam: give either diameter, or width and height")
        for name in ("diameter", "width", "height"):
            value = getattr(self, name)
            _require(value is None or value > 0, f"beam.{name}", value, "must be > 0 m")
        if len(self.rayleigh) != 2 or not all(0 <= eta < math.inf for eta in self.rayleigh):
            raise RigError(f"beam.rayleigh must be two numbers >= 0 (1/s, s), got {list(self.rayleigh)}")

    @property
    def area(self) -> float:
        """Cross-section in m²."""
        return math.pi * self.diameter**2 / 4 if self.diameter else self.width * self.height

    @property
    def second_moment(self) -> float:
        """Second moment of area in m⁴."""
        return math.pi * self.diameter**4 / 64 if self.diameter else self.width * self.height**3 / 12

    @property
    def bending_stiffness(self) -> float:
        """E I in N m²."""
        return self.young_modulus * self.second_moment

    @property
    def mass_per_length(self) -> float:
        """ρ A in kg/m."""
        return self.density * self.area


@dataclass(frozen=True)
class PointMass:
    """A mass fixed to the shaft at one position."""

    position: float
    """m from the clamp"""
    mass: float
    """kg"""
    name: str = ""
    """for people"""


@dataclass(frozen=True)
class Grease:
    """Grease in a bushing: Bouc-Wen hysteresis (Eq. 9) and a squeeze film (physics of the thinning film).

    The force on the shaft is φ = λ k x + (1-λ) k z + c ẋ / max(1-|x|/h, ε)², with
    ż = A ẋ - β|ẋ||z|ⁿ⁻¹z - γ ẋ|z|ⁿ. The default λ = 1 without film height is a linear spring and damper.
    """

    stiffness: float
    """k, N/m"""
    damping: float = 0.0
    """c, N s/m, of the centred shaft"""
    elastic_ratio: float = 1.0
    """λ, share of the stiffness that does not slide"""
    amplitude: float = 1.0
    """A"""
    beta: float = 0.0
    """β, 1/mⁿ (the article's ζ)"""
    gamma: float = 0.0
    """γ, 1/mⁿ"""
    exponent: float = 2.0
    """n"""
    film_height: float | None = None
    """h, m: film thickness at which the squeeze film would close; None: damping does not grow"""
    film_limit: float = 0.2
    """ε, smallest relative film thickness (the asperities' share of h)"""

    def __post_init__(self):
        where = "grease"
        _require(self.stiffness >= 0, f"{where}.stiffness", self.stiffness, "must be >= 0 N/m")
        _require(self.damping >= 0, f"{where}.damping", self.damping, "must be >= 0 N s/m")
        _require(0 <= self.elastic_ratio <= 1, f"{where}.elastic_ratio", self.elastic_ratio, "must be in 0..1")
        _require(self.amplitude > 0, f"{where}.amplitude", self.amplitude, "must be > 0")
        _require(self.exponent >= 1, f"{where}.exponent", self.exponent, "must be >= 1")
        if not -self.beta <= self.gamma <= self.beta:
            raise RigError(
                f"{where}.gamma {self.gamma:g} makes the Bouc-Wen element create energy "
                f"(needs -beta <= gamma <= beta, beta = {self.beta:g})"
            )
        if self.elastic_ratio < 1 and self.beta + self.gamma <= 0:
            raise RigError(f"{where}.beta + gamma must be > 0 when elastic_ratio < 1, or the loop never yields")
        _require(
            self.film_height is None or self.film_height > 0,
            f"{where}.film_height",
            self.film_height,
            "must be > 0 m",
        )
        _require(0 < self.film_limit <= 1, f"{where}.film_limit", self.film_limit, "must be in 0..1, above 0")

    @property
    def yield_displacement(self) -> float:
        """z_ult = (A/(β+γ))^(1/n) in m; infinite for a linear grease."""
        total = self.beta + self.gamma
        return (self.amplitude / total) ** (1 / self.exponent) if total > 0 else math.inf


@dataclass(frozen=True)
class Contact:
    """Datasheet contact of shaft and bushing, linearised at one gap of penetration."""

    stiffness: float
    """k, N/m"""
    damping: float = 0.0
    """c, N s/m"""

    def __post_init__(self):
        _require(self.stiffness > 0, "contact.stiffness", self.stiffness, "must be > 0 N/m")
        _require(self.damping >= 0, "contact.damping", self.damping, "must be >= 0 N s/m")


@dataclass(frozen=True)
class Bushing:
    """A bushing around the shaft: it touches at its two ends once the shaft has moved by the radial gap."""

    position: float
    """m from the clamp to the bushing's middle"""
    gap: float
    """radial clearance d, m"""
    length: float
    """m along the shaft; contact happens at both ends, each with half of k and c"""
    grease: Grease
    """what fills the gap"""
    contact: Contact
    """what happens beyond it"""

    @property
    def ends(self) -> tuple[float, float]:
        """Positions of the two contact points in m."""
        return self.position - self.length / 2, self.position + self.length / 2


@dataclass(frozen=True)
class Sensor:
    """An accelerometer on the shaft, identified by its node number in files."""

    node: int
    """positive, unique in the rig; 100 (base) and 200 (shaker) are taken"""
    position: float
    """m from the clamp"""
    mass: float = 0.0
    """kg, loads the shaft like a point mass"""


@dataclass(frozen=True)
class Shaker:
    """How the rig is driven: the base plate that carries clamp and bushings, or a force at one point."""

    kind: typing.Literal["base", "force"] = "base"
    """ "base" or "force" """
    position: float | None = None
    """m from the clamp; for a force"""


@dataclass(frozen=True)
class Rig:
    """A complete rig.

    Raises
    ------
    RigError
        For any value that no rig can have; the message names the field and the allowed range.
    """

    name: str
    """for people; also in messages and results"""
    beam: Beam
    """the shaft"""
    bushings: tuple[Bushing, ...]
    """around the shaft, without overlap; may be none"""
    sensors: tuple[Sensor, ...]
    """at least one"""
    masses: tuple[PointMass, ...] = ()
    """fixed to the shaft"""
    shaker: Shaker = field(default_factory=Shaker)
    """how the rig is driven"""
    description: str = ""
    """for people"""

    def __post_init__(self):
        l = self.beam.length
        if not self.name:
            raise RigError("name must not be empty")
        for kind in ("masses", "bushings", "sensors"):
            for i, item in enumerate(getattr(self, kind)):
                _require_on_beam(item.position, f"{kind}[{i}].position", l)
        for i, mass in enumerate(self.masses):
            _require(mass.mass > 0, f"masses[{i}].mass", mass.mass, "must be > 0 kg")
        for i, sensor in enumerate(self.sensors):
            _require(sensor.mass >= 0, f"sensors[{i}].mass", sensor.mass, "must be >= 0 kg")
            if not 0 < sensor.node < 1e9 or sensor.node in (BASE_NODE, SHAKER_NODE):
                raise RigError(
                    f"sensors[{i}].node {sensor.node} must be a positive whole number of at most 9 digits, and not "
                    f"{BASE_NODE} (base) or {SHAKER_NODE} (shaker)"
                )
        nodes = [s.node for s in self.sensors]
        for i, node in enumerate(nodes):
            if node in nodes[:i]:
                raise RigError(f"sensors[{i}].node {node} is used twice; each sensor needs its own node")
        if not self.sensors:
            raise RigError("sensors: a rig needs at least one")
        self._check_bushings()
        if self.shaker.kind not in ("base", "force"):
            raise RigError(f'shaker.kind "{self.shaker.kind}" is unknown; use "base" or "force"')
        if self.shaker.kind == "force" and self.shaker.position is None:
            raise RigError('shaker.position is missing; a shaker of kind "force" pushes at one point')
        if self.shaker.position is not None:
            _require_on_beam(self.shaker.position, "shaker.position", l)

    def _check_bushings(self):
        l = self.beam.length
        for i, b in enumerate(self.bushings):
            _require(b.gap > 0, f"bushings[{i}].gap", b.gap, "must be > 0 m (radial clearance)")
            _require(b.length > 0, f"bushings[{i}].length", b.length, "must be > 0 m")
            if b.ends[0] <= 0 or b.ends[1] > l:
                raise RigError(
                    f"bushings[{i}].length {b.length:g} m makes it reach from {b.ends[0]:g} to {b.ends[1]:g} m, "
                    f"past the beam (0 < x <= {l:g} m)"
                )
        order = sorted(range(len(self.bushings)), key=lambda i: self.bushings[i].position)
        for i, j in zip(order, order[1:]):
            if self.bushings[i].ends[1] >= self.bushings[j].ends[0]:
                raise RigError(
                    f"bushings[{j}] overlaps bushings[{i}]: it starts at {self.bushings[j].ends[0]:g} m, "
                    f"the other ends at {self.bushings[i].ends[1]:g} m"
                )

    @property
    def point_masses(self) -> tuple[PointMass, ...]:
        """Point masses of the shaft, the sensors' own included."""
        loading = (PointMass(s.position, s.mass, f"sensor {s.node}") for s in self.sensors if s.mass)
        return (*self.masses, *loading)

    @property
    def total_mass(self) -> float:
        """Mass of shaft and point masses in kg."""
        return self.beam.mass_per_length * self.beam.length + sum(m.mass for m in self.point_masses)

    @property
    def sensor_labels(self) -> list[str]:
        """Degree of freedom of each sensor as "node:+Z"."""
        return [f"{s.node}:+Z" for s in self.sensors]

    def replace(self, **changes) -> Rig:
        """Return a copy with other values; it is checked again.

        Parameters
        ----------
        **changes
            Fields and their new values.
        """
        return dataclasses.replace(self, **changes)

    @classmethod
    def load(cls, path) -> Rig:
        """Read a rig from a TOML file.

        Parameters
        ----------
        path : str or Path
            The file.

        Raises
        ------
        RigError
            If the file is missing, is not TOML, has unknown or missing keys or impossible values.
        """
        path = Path(path)
        try:
            data = tomllib.loads(path.read_text(encoding="utf-8"))
        except OSError as error:
            raise RigError(f"{path}: cannot be read ({error.strerror})") from None
        except (ValueError, RecursionError) as error:
            raise RigError(f"{path}: not valid TOML: {error}") from None
        try:
            return cls.from_dict(data)
        except RigError as error:
            raise RigError(f"{path}: {error}") from None

    @classmethod
    def from_dict(cls, data: dict) -> Rig:
        """Build a rig from the nested dictionary that a rig file holds.

        Parameters
        ----------
        data : dict
            Nested plain data.

        Raises
        ------
        RigError
            If it has unknown or missing keys or impossible values.
        """
        return from_plain(cls, data, "")

    def to_dict(self) -> dict:
        """Return the rig as nested plain data."""
        return to_plain(self)

    def save(self, path):
        """Write the rig as TOML; an existing file is replaced only once the new one is whole.

        Parameters
        ----------
        path : str or Path
            The file.
        """
        with replacing(path) as temporary:
            temporary.write_text(tomli_w.dumps(self.to_dict()), encoding="utf-8")


def _require(condition, name, value, rule):
    if not condition or (value is not None and not math.isfinite(value)):
        raise RigError(f"{name} {rule}, got {value:g}")


def _require_on_beam(position, name, length):
    if not 0 < position <= length:
        raise RigError(f"{name} {position:g} m lies outside the beam (0 < x <= {length:g} m)")


def from_plain(kind, data, where):
    """Make the dataclass ``kind`` from a dictionary, refusing unknown, missing and mistyped keys.

    Parameters
    ----------
    kind : type
        A dataclass of this module.
    data : dict
        Nested plain data, as TOML or JSON hold it.
    where : str
        Path of the field in the file, for messages.

    Raises
    ------
    RigError
        Naming the key.
    """
    if not isinstance(data, dict):
        raise RigError(f"{where or 'rig'} must be a table of keys, got {data!r}")
    hints = _hints(kind)
    fields = {f.name: f for f in dataclasses.fields(kind)}
    prefix = f"{where}." if where else ""
    for key in data:
        if key not in fields:
            raise RigError(f"{prefix}{key} is not a known key; known: {', '.join(fields)}")
    required = (
        n for n, f in fields.items() if f.default is dataclasses.MISSING and f.default_factory is dataclasses.MISSING
    )
    for name in required:
        if name not in data:
            raise RigError(f"{prefix}{name} is missing")
    values = {key: _convert(hints[key], value, f"{prefix}{key}") for key, value in data.items()}
    try:
        return kind(**values)
    except RigError as error:
        # An element checks itself under its own name; put the place in the file before it.
        message, own = str(error), kind.__name__.lower()
        if where and message.startswith(own):
            message = where + message[len(own) :]
        raise RigError(message) from None


_hints = functools.cache(typing.get_type_hints)


def _convert(hint, value, where):
    origin, args = typing.get_origin(hint), typing.get_args(hint)
    if origin is types.UnionType:  # an optional field
        return _convert(args[0], value, where)
    if origin is tuple and args[-1] is Ellipsis:
        if not isinstance(value, list):
            of_tables = f" of tables ([[{where}]])" if dataclasses.is_dataclass(args[0]) else ""
            raise RigError(f"{where} must be a list{of_tables}, got {value!r}")
        return tuple(_convert(args[0], item, f"{where}[{i}]") for i, item in enumerate(value))
    if origin is tuple:
        if not isinstance(value, list) or len(value) != len(args):
            raise RigError(f"{where} must be a list of {len(args)} numbers, got {value!r}")
        return tuple(_convert(a, item, f"{where}[{i}]") for i, (a, item) in enumerate(zip(args, value)))
    if dataclasses.is_dataclass(hint):
        return from_plain(hint, value, where)
    if origin is typing.Literal or hint is str:
        if not isinstance(value, str):
            raise RigError(f"{where} must be a string, got {value!r}")
        return value
    if hint is bool:
        if not isinstance(value, bool):
            raise RigError(f"{where} must be true or false, got {value!r}")
        return value
    if hint is int:
        if isinstance(value, bool) or not isinstance(value, int):
            raise RigError(f"{where} must be a whole number, got {value!r}")
        return value
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise RigError(f"{where} must be a plain number in SI units, got {value!r}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise RigError(f"{where} must be finite, got {number!r}")
    return number


def to_plain(value):
    """Return a dataclass as nested dictionaries and lists, without the fields that are None.

    Parameters
    ----------
    value : dataclass, tuple or plain value
        What to turn into plain data.
    """
    if dataclasses.is_dataclass(value):
        pairs = ((f.name, getattr(value, f.name)) for f in dataclasses.fields(value))
        return {name: to_plain(item) for name, item in pairs if item is not None}
    if isinstance(value, tuple):
        return [to_plain(item) for item in value]
    return value
