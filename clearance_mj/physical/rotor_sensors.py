"""Sensors of the angles of drives' rotors, as encoders at motors read them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import mujoco

from ..core.errors import ModelError
from .drives import PlacedDrive, drives
from .elements import change_spec, compile_target, name_of, require_spec
from .records import texts, write_text

__all__ = ["RotorSensor", "add_rotor_sensor", "rotor_sensors"]

_KIND = "rotor sensor"  # of the text that marks these user sensors


class RotorSensor(NamedTuple):
    """A sensor of a rotor's angle."""

    name: str
    address: int  # in the model's sensordata
    drive: PlacedDrive


def add_rotor_sensor(spec: mujoco.MjSpec, actuator: Any, name: str | None = None) -> mujoco.MjsSensor:
    """Add a sensor of the angle of a drive's rotor, in units of its joint, as a ``jointpos`` shows the load's.

    It is one of MuJoCo's user sensors, which a `Softener` fills in; before the first step it shows the load's angle.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Changed in place.
    actuator : str or mujoco.MjsActuator
        Of `add_drive`.
    name : str, optional
        Of the sensor; "ACTUATOR rotor" without.

    Returns
    -------
    mujoco.MjsSensor
        The sensor, to give it noise or a cutoff.

    Raises
    ------
    ModelError
        For an actuator without a drive.
    """
    target, known = name_of(actuator), [drive.name for drive in drives(compile_target(require_spec(spec)))]
    ModelError.require_known("actuator with a drive", target, known)
    name = name or f"{target} rotor"

    def add(changed: mujoco.MjSpec) -> mujoco.MjsSensor:
        write_text(changed, _KIND, name, target)
        return changed.add_sensor(
            name=name, type=mujoco.mjtSensor.mjSENS_USER, objtype=mujoco.mjtObj.mjOBJ_ACTUATOR, objname=target, dim=1,
            needstage=mujoco.mjtStage.mjSTAGE_POS, datatype=mujoco.mjtDataType.mjDATATYPE_REAL,
        )  # fmt: skip

    return change_spec(spec, add)[0]


def rotor_sensors(model: mujoco.MjModel) -> Iterator[RotorSensor]:
    """Yield the sensors of rotors' angles that a model has."""
    by_actuator = {drive.actuator: drive for drive in drives(model)}
    for kind, name, _ in texts(model):
        if kind == _KIND and (index := mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, name)) >= 0:
            yield RotorSensor(name, int(model.sensor_adr[index]), by_actuator[int(model.sensor_objid[index])])
