"""Sound of a rig: a plate that moves with a sensor and radiates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, WithJsonSchema

from ..core.checks import naming
from ..core.errors import RigError
from ..core.validation import Positive, Whole, checked, seldom
from .instruments import Sensor

__all__ = ["Plate", "check_plate"]

SURROUNDINGS = {"reflecting floor": 2.0, "free field": 4.0}  # solid angle that sound goes into, in π
NUMBERS = {"type": "array", "items": {"type": "number", "exclusiveMinimum": 0}}
EFFICIENCY = {"anyOf": [{"type": "number", "exclusiveMinimum": 0}, {**NUMBERS, "minItems": 1}]}


def _as_list(value: Any) -> Any:
    return (value,) if isinstance(value, int | float) and not isinstance(value, bool) else value


@checked(RigError)
class Plate:
    """A plate or panel that moves as one with a sensor, and where one listens to it."""

    sensor: Whole
    """node of the sensor whose motion the plate has, across its area"""
    area: Positive
    """m², of the radiating surface"""
    distance: Positive
    """m, from the plate to the listener"""
    radiation_efficiency: Annotated[
        tuple[Positive, ...], BeforeValidator(_as_list), Field(min_length=1), WithJsonSchema(EFFICIENCY)
    ] = (1.0,)
    """sound power over that of a large piston of the area and the same mean squared velocity: one number, or one for
    each of ``frequencies``"""
    frequencies: tuple[Positive, ...] = seldom(default=())
    """Hz, rising, of the radiation efficiencies where they are several"""
    surroundings: Literal["reflecting floor", "free field"] = seldom(default="reflecting floor")
    """where sound goes: into the half space above a "reflecting floor", or into a "free field" """
    lowest_frequency: Positive = seldom(default=20.0)
    """Hz; slower motion is taken off, for it is not heard and acceleration does not tell it"""

    def __post_init__(self) -> None:
        n_freq, count = len(self.frequencies), len(self.radiation_efficiency)
        if n_freq != (0 if count == 1 else count):
            raise ValueError(
                f"frequencies holds {n_freq} numbers beside {count} of radiation_efficiency; give one frequency for "
                "each efficiency, or one efficiency and no frequencies"
            )
        if any(b <= a for a, b in zip(self.frequencies, self.frequencies[1:])):
            raise ValueError("frequencies must rise")

    @property
    def solid_angle(self) -> float:
        """Solid angle into which the sound spreads, sr: 2π above a reflecting floor, 4π in a free field."""
        return SURROUNDINGS[self.surroundings] * np.pi

    def efficiency(self, frequency: np.ndarray) -> np.ndarray:
        """Return the radiation efficiency, interpolated between logarithms and constant beyond its ends.

        Parameters
        ----------
        frequency : ndarray, shape (n,)
            Hz, at least 0.
        """
        if len(self.radiation_efficiency) == 1:
            return np.full(np.shape(frequency), self.radiation_efficiency[0])
        log_frequency = np.log(np.maximum(frequency, self.frequencies[0]))
        return np.asarray(np.exp(np.interp(log_frequency, np.log(self.frequencies), np.log(self.radiation_efficiency))))

    def row(self, sensors: Sequence[Sensor]) -> int:
        """Return the row of its sensor among a rig's; a ValueError says which nodes there are if it is none.

        Parameters
        ----------
        sensors : sequence of Sensor
            The rig's.
        """
        rows = [i for i, s in enumerate(sensors) if s.node == self.sensor and s.quantity == "acceleration"]
        if not rows:
            nodes = ", ".join(str(s.node) for s in sensors if s.quantity == "acceleration")
            raise ValueError(f"sensor {self.sensor} is no accelerometer's node; the rig has {nodes}")
        if len(rows) > 1:
            raise ValueError(
                f"sensor {self.sensor} measures along several directions; give the one that radiates its own node"
            )
        return rows[0]


def check_plate(plate: Plate, sensors: Sequence[Sensor]) -> None:
    """Refuse a plate that moves with none of a rig's sensors."""
    with naming("plate", ValueError, ValueError, "{}.{}"):
        plate.row(sensors)
