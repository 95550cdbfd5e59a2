"""Which controllers there are: `register` makes one known to cases, tuning, reports and the command line."""

from __future__ import annotations

import functools
import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any, NamedTuple

from ...core.errors import ManoeuvreError
from .base import Controller, Task

__all__ = ["CONTROLLERS", "TUNED", "ClearancePrior", "Registration", "get_controller", "register"]

TUNED = FilePath(__file__).parents[1] / "tuned.toml"  # what `tune` found for the controllers of the package
LineStyle = str | tuple[float, tuple[float, ...]]


class ClearancePrior(NamedTuple):
    """Prior information on the clearance, for the controllers that take it into account."""

    half_gap: float  # rad
    friction: float  # N m
    compliance: float  # rad/(N m), beyond that of the nominal vehicle
    stiffness: float = math.inf  # N m/rad, of the steering against friction


@dataclass(frozen=True)
class Registration:
    """A controller as cases, tuning and reports know it."""

    name: str
    """Name in commands and files"""
    label: str
    """Name in legends and tables"""
    controller: type[Controller]
    """Class of the controller"""
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Range of each setting that is tuned, searched over its logarithm"""
    tuned: Mapping[str, Any] | None = None
    """Settings; None: those of `settings_file`, the class's defaults where it has none"""
    settings_file: FilePath = TUNED
    """TOML file that `tune` writes, by set ("ideal", "car": `Sensors.tuned`) and name of the controller"""
    tuned_as: str = ""
    """Name of the controller whose settings hold where the file has none of this one"""
    adapt: Callable[[Controller, Task, ClearancePrior], Controller] | None = None
    """Function that takes prior information on the clearance into account"""
    prior: str = "nothing"
    """What `adapt` takes, in words; all know the nominal vehicle, the servo and the steering's stiffness"""
    colour: str | None = None
    """Colour in figures; None: the next of a cycle"""
    line: LineStyle = "-"
    """Line style in figures"""

    def tuned_controller(self, tuned: str = "ideal") -> Controller:
        """Return the controller with its settings of a set, without prior information on the clearance."""
        return self.controller(**(self._stored(tuned) if self.tuned is None else self.tuned))

    def with_settings(self, settings: Mapping[str, Any], tuned: str = "ideal") -> Controller:
        """Return the controller with settings of its own, and the others of a set of what it is tuned as."""
        return self.controller(**(self._inherited(tuned) | dict(settings)))

    def _inherited(self, tuned: str) -> dict[str, Any]:
        return CONTROLLERS[self.tuned_as]._stored(tuned) if self.tuned_as in CONTROLLERS else {}

    def _stored(self, tuned: str) -> dict[str, Any]:
        """Return the settings of a set: its own and, for the others, those of the controller it is tuned as."""
        found = _read(self.settings_file).get(tuned, {})
        own: dict[str, Any] = found[self.name]["settings"] if self.name in found else {}
        return self._inherited(tuned) | own

    def informed(self, controller: Controller, task: Task, prior: ClearancePrior) -> Controller:
        """Return a controller of this class for a task, with what it may know of the clearance."""
        return self.adapt(controller, task, prior) if self.adapt else controller


CONTROLLERS: dict[str, Registration] = {}
"""Every registered controller by its name, in the order of tables."""


def register(registration: Registration) -> None:
    """Make a controller known; its name must be new, and what is bounded must be settings of it."""
    name, settings = registration.name, registration.controller.__dataclass_fields__
    if name in CONTROLLERS:
        raise ManoeuvreError(f'controller "{name}" is registered already')
    if unknown := [key for key in registration.bounds if key not in settings]:
        raise ManoeuvreError(
            f'controller "{name}": bounds of {unknown[0]!r}, but its settings are {", ".join(settings)}'
        )
    CONTROLLERS[name] = registration


def get_controller(name: str) -> Registration:
    """Return the controller of a name; the message on an unknown one lists the known ones."""
    ManoeuvreError.require_known("controller", name, CONTROLLERS)
    return CONTROLLERS[name]


@functools.cache
def _read(path: FilePath) -> dict[str, dict[str, dict[str, Any]]]:
    return tomllib.loads(path.read_text(encoding="utf-8"))
