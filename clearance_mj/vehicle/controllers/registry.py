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

TUNED = FilePath(__file__).parents[1] / "tuned.toml"
"""Settings that `tune` found, by set ("ideal", "car": `Sensors.tuned`) and name of the controller"""
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
    """in commands and files"""
    label: str
    """in legends and tables"""
    controller: type[Controller]
    """its class"""
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """range of each setting that is tuned, searched over its logarithm"""
    tuned: Mapping[str, Any] | None = None
    """settings; None: those of `TUNED`, the class's defaults if it has none"""
    tuned_as: str = ""
    """controller whose settings of `TUNED` are taken but for those that `TUNED` has of its own"""
    adapt: Callable[[Controller, Task, ClearancePrior], Controller] | None = None
    """takes prior information on the clearance into account"""
    prior: str = "nothing"
    """what `adapt` takes, in words; all know the nominal vehicle, the servo and the steering's stiffness"""
    colour: str | None = None
    """in figures; None: the next of a cycle"""
    line: LineStyle = "-"
    """style in figures"""

    def tuned_controller(self, tuned: str = "ideal") -> Controller:
        """Return the controller with its settings of a set, without prior information on the clearance."""
        return self.controller(**(self._stored(_tuned().get(tuned, {})) if self.tuned is None else self.tuned))

    def with_settings(self, settings: Mapping[str, Any], tuned: str = "ideal") -> Controller:
        """Return the controller with settings of its own, and the others of a set of what it is tuned as."""
        return self.controller(**(self._inherited(_tuned().get(tuned, {})) | dict(settings)))

    def _inherited(self, found: dict[str, dict[str, Any]]) -> dict[str, Any]:
        return CONTROLLERS[self.tuned_as]._stored(found) if self.tuned_as in CONTROLLERS else {}

    def _stored(self, found: dict[str, dict[str, Any]]) -> dict[str, Any]:
        """Settings of a set: its own, and of the others those of what it is tuned as."""
        own: dict[str, Any] = found[self.name]["settings"] if self.name in found else {}
        return self._inherited(found) | own

    def informed(self, controller: Controller, task: Task, prior: ClearancePrior) -> Controller:
        """Return a controller of this class for a task, with what it may know of the clearance."""
        return self.adapt(controller, task, prior) if self.adapt else controller


CONTROLLERS: dict[str, Registration] = {}
"""By name, in the order of tables"""


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
    if name not in CONTROLLERS:
        raise ManoeuvreError(f'controller "{name}" is unknown; known: {", ".join(CONTROLLERS)}')
    return CONTROLLERS[name]


@functools.cache
def _tuned() -> dict[str, dict[str, dict[str, Any]]]:
    return tomllib.loads(TUNED.read_text(encoding="utf-8"))
