"""The whole of a rig, its file and its plain data."""

from __future__ import annotations

import dataclasses
import functools
import os
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tomli_w
from pydantic import Field

from ..core.checks import naming
from ..core.errors import RigError
from ..core.files import replacing
from ..core.overview import HasOverview, Overview, few
from ..core.validation import Text, checked, from_plain, json_schema, read_plain, seldom, to_plain
from ..structure import AnyStructure, Beam, Spring, Structure
from ..structure.attached import Attached, FixtureMode, Oscillator, Planes, PointMass
from ..structure.base import in_other_plane
from ..structure.files import is_embedded
from ..structure.modal import Reduction, reduction
from . import dimensions
from .bearing_tables import with_bearing_tables
from .bearings import Bearing
from .clearance import Bushing
from .examples import check_paths
from .extremes import computable
from .files import digest, with_files
from .gaps import Gap, bushings_with_gap
from .instruments import Sensor, Shaker, check_inputs
from .loads import Load, Order, check_points, forced_points
from .overview import bushing_rows, frequencies_in_words, inputs_in_words, structure_in_words
from .plate import Plate, check_plate
from .plausible import warn_of_units
from .points import joined_points, moved_points
from .schema import BEAM_OR_STRUCTURE, OF_BEARINGS, OF_OLDER_FILES
from .sensing import check_sensors
from .spans import check_bushings
from .spinning import Spin, Unbalance
from .tolerance import Tolerance

__all__ = ["PointMass", "Rig", "rig_schema"]


@checked(RigError, name="", schema=BEAM_OR_STRUCTURE)
class Rig(dimensions.InSpace, HasOverview):
    """A complete rig.

    Raises
    ------
    RigError
        For any value that no rig can have; the message names the field and the allowed range.
    """

    name: Annotated[Text, Field(min_length=1)]
    """for people; also in messages and results"""
    beam: Beam | None
    """the structure, where it is a uniform cantilever; otherwise None"""
    bushings: tuple[Bushing, ...]
    """the clearances, without overlap; may be none"""
    sensors: Annotated[tuple[Sensor, ...], Field(min_length=1)]
    """at least one"""
    masses: tuple[PointMass, ...] = ()
    """fixed to the structure"""
    shaker: Shaker = Shaker()
    """how the rig is excited"""
    description: Text = ""
    """for people"""
    structure: AnyStructure | None = None
    """the structure, where it is not a ``beam``"""
    springs: tuple[Spring, ...] = seldom(default=())
    """springs and dampers from points of the structure to the base or to each other"""
    fixture: tuple[FixtureMode, ...] = seldom(default=())
    """modes of what carries the rig, between the base's accelerometer and the feet of clamp and bushings"""
    oscillators: tuple[Oscillator, ...] = seldom(default=())
    """what moves on its own on the structure"""
    planes: Planes | None = seldom(default=None)
    """of a shaft whose two bending planes differ; None: they are alike"""
    tolerances: tuple[Tolerance, ...] = seldom(default=())
    """how well numbers are known; others have defaults, see `identify.priors`"""
    examples: tuple[Text, ...] = seldom(default=())
    """paths of numbers that nobody gave, such as "beam.length"; results say so until their names are deleted here"""
    gravity: dimensions.Gravity | None = seldom(default=None)
    """m/s² (x, y, z): it rests under its weight before it vibrates; None: offsets hold what weight does"""
    loads: tuple[Load, ...] = seldom(default=())
    """forces and torques that never change, under which it rests before it vibrates"""
    spin: Spin | None = seldom(default=None)
    """of a shaft in space"""
    unbalances: tuple[Unbalance, ...] = seldom(default=())
    """of a shaft that turns"""
    orders: tuple[Order, ...] = seldom(default=())
    """forces and torques that follow the angle of a shaft that turns"""
    bearings: tuple[Bearing, ...] = seldom(default=())
    """of a shaft in space, with coefficients between both directions that may depend on the spin"""
    plate: Plate | None = seldom(default=None)
    """what radiates sound, see docs/sound.md"""
    shakers: tuple[Shaker, ...] = seldom(default=())
    """that excite it at the same time as ``shaker``; of a file without [shaker], the first one is that"""

    def __post_init__(self) -> None:
        if (self.beam is None) == (self.structure is None):
            raise ValueError(
                f"{'structure stands beside beam' if self.beam else 'beam is missing'}; give either [beam], a uniform "
                f"cantilever, or [structure], of one of the kinds {', '.join(Structure.known)}"
            )
        for name, point in dimensions.named_points(self).items():
            self._check(name, point)
        check_points("loads", self.loads, self._check)
        check_points("orders", self.orders, self._check)
        check_sensors(self)
        check_inputs(self.inputs, [sensor.node for sensor in self.sensors])
        if self.plate:
            check_plate(self.plate, self.sensors)
        for i, spring in enumerate(self.springs):
            if any(set(spring.joined) == set(other.joined) for other in self.springs[:i]):
                raise ValueError(f"springs[{i}] joins what another spring joins; add its numbers to that one")
        for i, mode in enumerate(self.fixture):
            if mode.frequency in [other.frequency for other in self.fixture[:i]]:
                raise ValueError(f"fixture[{i}].frequency {mode.frequency:g} Hz is another mode's; put both into one")
        check_bushings(self.bushings, self.linear.check)
        dimensions.check_motion(self)
        if self.tolerances or self.examples:
            check_paths(to_plain(self), self.tolerances, self.examples)

    def _check(self, name: str, point: float | str) -> None:
        with naming(name, ValueError, ValueError, "{} {}"):
            self.linear.check(point)

    @property
    def linear(self) -> Structure:
        """The linear structure: ``beam`` or ``structure``."""
        return self.beam or self.structure  # type: ignore[return-value]

    @property
    def inputs(self) -> tuple[Shaker, ...]:
        """All excitations: ``shaker``, then ``shakers``."""
        return (self.shaker, *self.shakers)

    @property
    def point_masses(self) -> tuple[PointMass, ...]:
        """Point masses of the shaft, those of sensors included."""
        return (*self.masses, *(PointMass(s.position, s.mass, f"sensor {s.node}") for s in self.sensors if s.mass))

    @property
    def total_mass(self) -> float | None:
        """Mass of structure and point masses in kg; None where the structure's is not known."""
        mass = self.linear.total_mass
        return None if mass is None else mass + sum(m.mass for m in self.point_masses)

    @property
    def sensor_labels(self) -> list[str]:
        """Degree of freedom of each sensor, such as "7:+Z"."""
        return [s.label for s in self.sensors]

    @property
    def delays(self) -> np.ndarray:
        """(n_sensors,) s, by which each sensor's channel is later than the excitation's."""
        return np.array([s.delay for s in self.sensors]) - self.shaker.delay

    @functools.cached_property
    def moves_across(self) -> bool:
        """True if points move along y and z: clearances are round, or something acts across z."""
        return any(b.is_round for b in self.bushings) or bool(dimensions.fields_across(self))

    @property
    def is_loaded(self) -> bool:
        """True if the shaft may rest elsewhere than without load: gravity or loads act, or it moves along y and z."""
        return self.moves_across or bool(self.gravity or self.loads)

    @property
    def clearance_points(self) -> tuple[tuple[float | str, ...], ...]:
        """The points whose relative motion each clearance limits; the second is left out where it is the base.

        It is the bushing's housing where that is elastic, and the base's foot below it where the base has modes.
        """
        return tuple(joined_points(j, b, b.joined, bool(self.fixture)) for j, b in enumerate(self.bushings))

    @property
    def clearance_ends(self) -> tuple[tuple[float | str, ...], ...]:
        """Points (2 n_bushings,) of both ends of each clearance."""
        feet = bool(self.fixture)
        return tuple(joined_points(j, b, ends, feet) for j, b in enumerate(self.bushings) for ends in b.joined_ends)

    @property
    def attached(self) -> Attached:
        """Housings, fixture, springs and oscillators that are attached to the structure."""
        return Attached(
            tuple(b.housing for b in self.bushings), tuple(b.position for b in self.bushings), self.fixture,
            self.springs, self.planes, self.oscillators, tuple(self.shaker.unit_direction.tolist()),
        )  # fmt: skip

    def reduction(
        self, modes: int, grease: bool = False, structure: Structure | None = None,
        more: tuple[tuple[float | str, float], ...] = (), axes: str = "",
    ) -> Reduction:  # fmt: skip
        """Return the structure with its point masses reduced to modes and static shapes; see `linear.linear_model`.

        Parameters
        ----------
        modes : int
            Number of modes; one static shape for every row of a clearance and point of a force shaker is added.
        grease : bool
            Count the in-gap stiffness of the grease to the structure's.
        structure, more
            Instead of ``linear``, and points of forces, with factors, in addition to the shaker's.
        axes : {"Y", "Z", "YZ"}, optional
            "Y": the structure is of shafts as they move along y, see `Structure.in_other_plane`; by default "Z" of
            shafts and "YZ" of others, whose points have directions.

        Raises
        ------
        RigError
            If its mass is not positive or its stiffness negative.
        """
        axes = axes or ("Z" if self.linear.shafts else "YZ")
        masses = tuple((m.position, m.mass) for m in self.point_masses)
        forces = (*forced_points(self.inputs, self.loads), *more)
        rows = [(b, row) for b, points in zip(self.bushings, self.clearance_points) for row in moved_points(b, points)]
        in_axes = [(b.grease.stiffness, points) for b, (axis, points) in rows if axis in axes]
        attached = self.attached.in_other_plane if axes == "Y" else self.attached
        if axes == "Y":
            masses, forces = (tuple((in_other_plane(p), x) for p, x in loads) for loads in (masses, forces))
        pairs, springs = tuple(points for _, points in in_axes), tuple(k for k, _ in in_axes if grease)
        bearing_springs = tuple(spring for bearing in self.bearings for spring in bearing.springs_to_base(axes))
        with computable(self.name, self.to_dict):
            return reduction(structure or self.linear, pairs, masses, forces, springs, modes, attached, bearing_springs)

    __repr__ = HasOverview.__repr__

    def _overview(self) -> Overview:
        mass = self.total_mass
        facts = {
            "structure": structure_in_words(self.linear),
            "mass": "" if mass is None else f"{mass:.4g} kg with point masses",
            "natural frequencies": frequencies_in_words(self),
            "motion": dimensions.motion_in_words(self) if self.moves_across else "",
            "shaker": inputs_in_words(self.inputs),
            "sensors": f"{len(self.sensors)}: {few(self.sensor_labels)}",
            "examples": few(self.examples),
        }
        labels = [self.probe_labels[rows.start] for rows in self.clearance_rows]
        return Overview(f"Rig “{self.name}”", facts, bushing_rows(labels, self.bushings))

    def replace(self, **changes: Any) -> Rig:
        """Return a copy with other values; it is checked again.

        Parameters
        ----------
        **changes
            Fields and their new values.
        """
        return dataclasses.replace(self, **changes)

    def with_gap(self, gap: Gap) -> Rig:
        """Return the rig with another radial gap at its bushings; contact, filling and all else stay.

        Parameters
        ----------
        gap : float, str, sequence or mapping
            Of all bushings: m, a text with a unit such as "0.09 mm", or a factor of each one's gap such as "x0.5";
            or one such value for each; or by bushing, named as in `clearance_labels`, `probe_labels` or "bushings[0]".

        Raises
        ------
        RigError
            If no bushing has that name, or it cannot have such a gap.
        """
        names = list(zip(self.clearance_labels, self.probe_labels))
        return self.replace(bushings=bushings_with_gap(self.bushings, names, gap))

    def with_shape(self, shape: Literal["slot", "stop", "round"] | None) -> Rig:
        """Return the rig with clearances of another shape: "round" moves a rig of slots in space, None back.

        Parameters
        ----------
        shape : {"slot", "stop", "round"} or None
            As of `Bushing`.

        Raises
        ------
        RigError
            If the rig has fields that such clearances do not have.
        """
        return self.replace(bushings=tuple(dataclasses.replace(b, shape=shape) for b in self.bushings))

    @classmethod
    def load(cls, path: str | Path) -> Rig:
        """Read a rig from a TOML file; files that it names are taken relative to its folder.

        Parameters
        ----------
        path : str or Path
            The file.

        Raises
        ------
        RigError
            If the file is missing, is not TOML, has unknown or missing keys or impossible values. Numbers that are in
            mm by all appearances are warned of; the command line refuses them.
        """
        data = read_plain(path, RigError)
        with naming(path, RigError):
            rig = cls.from_dict(data, Path(path).parent)
        warn_of_units(path, rig.linear, rig.bushings)
        return rig

    @classmethod
    def from_dict(cls, data: dict[str, Any], folder: str | Path = ".") -> Rig:
        """Return the rig of the nested dictionary that a rig file holds.

        Parameters
        ----------
        data : dict
            Nested plain data, as a rig file holds them.
        folder : str or Path
            Folder that the names of files in it are relative to.

        Raises
        ------
        RigError
            If it has unknown or missing keys or impossible values.
        """
        if isinstance(data, dict):
            if isinstance(shakers := data.get("shakers"), list) and shakers and "shaker" not in data:
                data = {**data, "shaker": shakers[0], "shakers": shakers[1:]}

            def resolve(name: str) -> str:
                return name if is_embedded(name) else str(Path(folder) / name)

            data = {"beam": None, **dimensions.with_shapes(with_bearing_tables(with_files(data, resolve), resolve))}
        return from_plain(cls, data, "", RigError)

    def to_dict(self) -> dict[str, Any]:
        """Return the rig as nested plain data."""
        return to_plain(self)

    def content(self) -> dict[str, Any]:
        """Return plain data that are equal for equal rigs, for caches: `to_dict` with digests of files."""
        return dimensions.with_motion(self, with_files(self.to_dict(), digest))

    def copied(self, folder: str | Path) -> Rig:
        """Return the same rig, its structure read from copies of its files.

        Parameters
        ----------
        folder : str or Path
            Folder of the copies; made if there are any.
        """
        return self.replace(structure=self.structure.copied(Path(folder))) if self.structure else self

    def save(self, path: str | Path) -> None:
        """Write the rig as TOML; an existing file is replaced only once the new one is whole.

        Files that its structure was read from stay where they are: the rig file names them relative to its folder.
        Arrays that it was given get a file next to the rig file.

        Parameters
        ----------
        path : str or Path
            The file.
        """
        folder = Path(path).absolute().parent
        structure = self.structure and self.structure.saved_beside(Path(path))
        data = self.replace(structure=structure).to_dict()
        data = with_files(data, lambda name: Path(os.path.relpath(name, folder)).as_posix())
        with replacing(path) as temporary:
            temporary.write_text(tomli_w.dumps(data), encoding="utf-8")


def rig_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a rig file; rules between values are checked by `Rig` alone."""
    schema = json_schema(Rig, "clearance_mj rig")
    schema["properties"] |= OF_OLDER_FILES
    schema["$defs"]["Bearing"]["properties"] |= OF_BEARINGS
    return schema
