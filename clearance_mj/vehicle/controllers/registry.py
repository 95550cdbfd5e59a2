"""Registry of controllers: `register` adds one for cases, tuning, reports and the command line."""

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

TUNED = FilePath(__file__).parents[1] / "tuned.toml"  # tuned settings of the package's controllers
LineStyle = str | tuple[float, tuple[float, ...]]


class ClearancePrior(NamedTuple):
    """Prior information on the clearance, for the controllers that take it into account."""

    half_gap: float  # rad
    friction: float  # N m
    compliance: float  # rad/(N m), beyond that of the nominal vehicle
    stiffness: float = math.inf  # N m/rad, of the steering against friction


@dataclass(frozen=True)
class Registration:
    """Registered controller with its names, bounds of tuning, and style in figures."""

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
    """Name of the controller whose settings are used where the file has none of this one"""
    adapt: Callable[[Controller, Task, ClearancePrior], Controller] | None = None
    """Function that adapts the controller to prior information on the clearance"""
    prior: str = "nothing"
    """Prior information of `adapt`, in words; all know the nominal vehicle, the servo and the steering's stiffness"""
    colour: str | None = None
    """Colour in figures; None: the next of a cycle"""
    line: LineStyle = "-"
    """Line style in figures"""

    def tuned_controller(self, tuned: str = "ideal") -> Controller:
        """Return the controller with its settings of a set, without prior information on the clearance."""
        return self.controller(**(self._stored(tuned) if self.tuned is None else self.tuned))

    def with_settings(self, settings: Mapping[str, Any], tuned: str = "ideal") -> Controller:
        """Return the controller with given settings, and the others from a set of the controller it is tuned as."""
        return self.controller(**(self._inherited(tuned) | dict(settings)))

    def _inherited(self, tuned: str) -> dict[str, Any]:
        return CONTROLLERS[self.tuned_as]._stored(tuned) if self.tuned_as in CONTROLLERS else {}

    def _stored(self, tuned: str) -> dict[str, Any]:
        """Return the stored settings of a set, completed by those of the controller it is tuned as."""
        stored = _read(self.settings_file).get(tuned, {})
        return self._inherited(tuned) | (stored[self.name]["settings"] if self.name in stored else {})

    def informed(self, controller: Controller, task: Task, prior: ClearancePrior) -> Controller:
        """Return a controller of this class for a task, adapted to prior information on the clearance."""
        return self.adapt(controller, task, prior) if self.adapt else controller


CONTROLLERS: dict[str, Registration] = {}
"""Every registered controller by its name, in the order of tables."""


def register(registration: Registration) -> None:
    """Register a controller; its name must be new, and bounds must be of its settings."""
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
