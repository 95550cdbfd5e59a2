"""Sensors that provide the controllers' observations: ideal ones, and those of a car."""

from ...core.errors import ManoeuvreError
from .base import Sensors, SensorsRun
from .car import CarSensors
from .ideal import IdealSensors

__all__ = ["SENSORS", "CarSensors", "IdealSensors", "Sensors", "SensorsRun", "get_sensors"]

SENSORS: dict[str, Sensors] = {"ideal": IdealSensors.inertial(), "car": CarSensors()}
"""Sensors by their names in cases and on the command line."""


def get_sensors(sensors: str | Sensors) -> Sensors:
    """Return the sensors of a name, or the given sensors; the message on an unknown name lists the known ones."""
    if isinstance(sensors, Sensors):
        return sensors
    if sensors not in SENSORS:
        raise ManoeuvreError(f'sensors "{sensors}" are unknown; known: {", ".join(SENSORS)}')
    return SENSORS[sensors]
