"""Signals of a car's bus to its controllers."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["Signals"]


class Signals(NamedTuple):
    """Values delivered by the bus at a sample, delayed and noisy."""

    time: float  # s, of the sample at which they are read
    steering_angle: float  # rad at the road wheel: the servo's, before the clearance
    yaw_rate: float  # rad/s
    lateral_acceleration: float  # m/s², at the centre of gravity
    speed: float  # m/s, of the wheels
    position: tuple[float, float] | None = None  # m, of the centre of gravity: a new fix, or none at this sample
    heading: float | None = None  # rad, with the fix where the receiver has it
    delay: float = 0.0  # s, mean age of the values, all that is known of it
