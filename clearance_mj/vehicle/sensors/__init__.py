"""Sensors: what controllers see of the vehicle; ideal ones, and those of a car."""

from .base import Sensors, SensorsRun
from .car import CarSensors
from .ideal import IdealSensors
from .registry import SENSORS, get_sensors

__all__ = ["SENSORS", "CarSensors", "IdealSensors", "Sensors", "SensorsRun", "get_sensors"]
