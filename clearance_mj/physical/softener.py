"""Contacts and limits that follow a law at every step, friction without creep, and drives inside actuators."""

from __future__ import annotations

import threading
import zlib
from collections.abc import Container, Sequence
from functools import cache
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numba import types

from ..clearance.pointers import address
from ..clearance.record import BUSHING, clearance_records
from ..core.errors import ModelError
from ..rig import Bushing, Contact, Grease
from . import softener_loop as loop
from .actuators import control_of, output_of
from .bristles import BristleSettings, bristles_of
from .bushings import SiteBushing, bushings_of
from .drive_loop import PLACE, SENSED
from .drives import PlacedDrive, drives
from .elements import KINDS, SoftElement, find, inverse_inertia, requested_softness
from .records import MARK, note_softener, write_numbers
from .rotor_sensors import rotor_sensors

__all__ = ["ActiveParts", "Softener", "drive_places", "friction_places", "reserve", "reserved"]

_MEMORY = f"{MARK}memory"  # name of the custom numeric with the address of the laws' state in the user data


class Softener:
    """Computes the forces of a model's laws and friction, and advances its drives, at every step.

    Between ``mj_step1`` and ``mj_step2`` of your loop call `update`; or use it as a context, in which every
    ``mj_step``, ``mujoco.rollout`` and ``mujoco.batch`` of such models follows the laws, on any number of threads::

        with physical.Softener(model):
            mujoco.mj_step(model, data, 1000)

    Forces are those at the step's positions and velocities, exact but for the parasitic mass of the constraints. The
    state of laws (impact speeds, envelopes, hysteresis, bristles) is in ``data.userdata``, where `compile` has
    reserved room: it is copied, saved, restored and reset with the data. Drives are in ``data.act``.

    Parameters
    ----------
    model : mujoco.MjModel
        Compiled with `compile`. Changes of its numbers, such as ranges, act; laws are read once.

    Raises
    ------
    ModelError
        If nothing in the model follows a law, has friction or a drive, there is no room reserved, or the integrator
        would ask for forces between the steps (``RK4``) or changes those of laws (``discrete``).
    """

    def __init__(self, model: mujoco.MjModel):
        if not isinstance(model, mujoco.MjModel):
            raise ModelError(f"got {type(model).__name__}, needs a mujoco.MjModel; compile() makes it of an MjSpec")
        parts = ActiveParts.of(model)
        if not any(parts):
            raise ModelError(
                "no contact or limit follows a law, none has friction, no actuator a drive, and there is no bushing; "
                "constant ones need no Softener"
            )
        _check_integrator(model, bool(parts.laws))
        self.model, self._has_forces = model, parts.have_forces
        self._tables = _build_tables(model, parts)
        self._drives = drive_places(model, parts.drives)
        self._drive_of_actuator = np.full(len(model.actuator_trntype), -1, dtype=np.int64)
        self._drive_of_actuator[self._drives["actuator"]] = np.arange(len(self._drives))
        sensed = [(sensor.address, parts.drives.index(sensor.drive)) for sensor in rotor_sensors(model)]
        self._rotor_sensors = np.array(sensed, SENSED)
        size = self._tables.template.size if self._has_forces else 0
        room = reserved(model, size, parts)
        self._head = np.zeros(1, loop.HEAD)
        fields = {
            "first": room.first, "size": size, "numeric": int(model.numeric(_MEMORY).adr[0]) + 2,
            "drives": self._drives.ctypes.data, "n_drives": len(self._drives),
            "of_actuators": self._drive_of_actuator.ctypes.data, "soften": address(loop.soften, loop.SOFTEN),
            "sensed": self._rotor_sensors.ctypes.data, "n_sensed": len(self._rotor_sensors),
        }  # fmt: skip
        for name, value in {**self._tables.places(), **loop.PLACES, **fields}.items():
            self._head[name] = value
        self._head["signature"], self._head["key"] = np.uint64(model.signature).view(np.int64), room[2:]
        self._address = self._head.ctypes.data
        self._last_call: tuple[Any, ...] = (None, None)

    def update(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Set the forces of the laws; to be called between ``mj_step1`` and ``mj_step2``, or as a control callback.

        Drives advance by a step, unless a Softener of this model is in use and advances them, so that controls must be
        set before, and a step has one call.

        Parameters
        ----------
        model : mujoco.MjModel
            This one, or a copy of it.
        data : mujoco.MjData
            Data whose constraint forces, passive forces and user data are changed.

        Raises
        ------
        ModelError
            For another model.
        """
        call = self._last_call
        if call[0] is not model or call[1] is not data:
            call = self._last_call = self._call(model, data)
        if self._has_forces:
            loop.soften_at(call[2])
        if len(self._drives):
            loop.turn_at(call[2])

    def _call(self, model: mujoco.MjModel, data: mujoco.MjData) -> tuple[mujoco.MjModel, mujoco.MjData, int, Any]:
        """Return model, data, and an array of their addresses, preceded by the array's address."""
        same_model = model.signature == self.model.signature or not (model.signature and self.model.signature)
        if not same_model or _read_reserved(model) != _read_reserved(self.model):
            raise ModelError("the Softener was made for another model")
        addresses = np.array([self._address, model._address, data._address])
        return model, data, addresses.ctypes.data, addresses

    def __enter__(self) -> Softener:
        """Let MuJoCo call it in every step of this model.

        Raises
        ------
        ModelError
            If MuJoCo calls something else, or nothing, since the model's flag actuation is disabled.
        """
        if self.model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_ACTUATION:
            raise ModelError("flag actuation is disabled, so MuJoCo would not call it; call update() instead")
        with _LOCK:
            slots, (control, dynamics, sensors) = loop.IN_USE[1:], _callbacks()
            if slots.all():
                raise ModelError(f"{slots.size} Softeners are in use, no more can be")
            if not slots.any():
                if mujoco.get_mjcb_control() is not None:
                    raise ModelError("MuJoCo has a control callback already; call update() in it instead")
                if mujoco.get_mjcb_act_dyn() is not None:
                    raise ModelError("MuJoCo has a callback for the dynamics of actuators already; take it away")
            sensors_free = mujoco.get_mjcb_sensor() in (None, sensors)
            if len(self._rotor_sensors) and not sensors_free:
                raise ModelError("MuJoCo has a callback for users' sensors already, which rotors' sensors need")
            if not slots.any():
                mujoco.set_mjcb_control(control)
                mujoco.set_mjcb_act_dyn(dynamics)
                if sensors_free:
                    mujoco.set_mjcb_sensor(sensors)
            slot = int(np.argmin(slots != 0))
            slots[slot] = self._address
            loop.IN_USE[0] = max(loop.IN_USE[0], slot + 1)
        return self

    def __exit__(self, *_: object) -> None:
        """Remove it from MuJoCo's callbacks."""
        with _LOCK:
            slots = loop.IN_USE[1:]
            slots[slots == self._address] = 0
            loop.IN_USE[0] = np.flatnonzero(slots).max(initial=-1) + 1
            if not slots.any():
                mujoco.set_mjcb_control(None)
                mujoco.set_mjcb_act_dyn(None)
                if mujoco.get_mjcb_sensor() is _callbacks()[2]:
                    mujoco.set_mjcb_sensor(None)


class ActiveParts(NamedTuple):
    """Elements of a model that act only within a `Softener`."""

    laws: Sequence[SoftElement]  # pairs last
    bristles: Sequence[BristleSettings]
    drives: Sequence[PlacedDrive]
    bushings: Sequence[SiteBushing]

    @classmethod
    def of(cls, model: mujoco.MjModel) -> ActiveParts:
        """Return those of a model."""
        laws = [element for element in requested_softness(model) if element.softness.law]
        laws.sort(key=lambda element: (element.kind == "pair", element.kind, element.name))
        return cls(laws, list(bristles_of(model)), list(drives(model)), list(bushings_of(model)))

    @property
    def have_forces(self) -> bool:
        """True if there is more than drives, which need no user data."""
        return bool(self.laws or self.bristles or self.bushings)

    def key(self, model: mujoco.MjModel, first: int) -> tuple[int, int]:
        """Return a hash of them and their addresses, as two numbers of six digits, as MJCF keeps."""
        bristle_names = [(bristle.kind, bristle.name) for bristle in self.bristles]
        names = [(law.kind, law.name) for law in self.laws] + bristle_names
        ids = [find(model, kind, name) for kind, name in names]
        sizes = first, model.nq, model.nv, model.na, getattr(model, "nJten", 0), model.ngeom, model.nbody
        laws = [(law.kind, law.name, law.softness.data) for law in self.laws]
        key = zlib.crc32(repr((laws, bristle_names, list(self.drives), ids, sizes, *self.bushings)).encode())
        return key % 1_000_000, key // 1_000_000


class _Tables(NamedTuple):
    """Arrays that compiled code reads by address."""

    elements: np.ndarray  # (n,) ELEMENT; pairs last
    frictions: np.ndarray  # (m,) FRICTION
    joined: np.ndarray  # (b,) JOINED
    joints: np.ndarray  # (njnt,) index of its element, or -1
    tendons: np.ndarray  # (ntendon,)
    bushings: np.ndarray  # (n,) BUSHING
    template: np.ndarray  # (size,) initial state of the laws

    def places(self) -> dict[str, int]:
        """Return the fields of a HEAD that describe them."""
        return {name: array.ctypes.data for name, array in self._asdict().items()} | {
            "n_elements": len(self.elements), "first_pair": int(np.sum(self.elements["kind"] != loop.PAIR)),
            "n_joined": len(self.joined), "n_frictions": len(self.frictions), "first_friction": 2 + len(self.elements),
            "size": self.template.size,
        }  # fmt: skip


def drive_places(model: mujoco.MjModel, placed: Sequence[PlacedDrive]) -> np.ndarray:
    """Return the addresses (n,) of a model's drives for compiled code, a PLACE each."""
    places = np.zeros(len(placed), PLACE)
    for row, drive in zip(places, placed):
        index = drive.actuator
        row["actuator"], row["numeric"], row["slips"] = index, drive.numeric, drive.hysteresis
        row["act"], row["size"] = model.actuator_actadr[index], model.actuator_actnum[index]
        row["output"], row["control"] = output_of(model, index), control_of(model, index)
    return places


def _build_tables(model: mujoco.MjModel, parts: ActiveParts) -> _Tables:
    laws, bristles = parts.laws, parts.bristles
    elements, bushings = np.zeros(len(laws), loop.ELEMENT), np.zeros(len(laws), BUSHING)
    memory = [np.zeros(2 + len(laws) + loop.OF_FRICTION * len(bristles))]
    joints, tendons = (np.full(max(n, 1), -1, dtype=np.int32) for n in (model.njnt, model.ntendon))
    for e, (element, (kind, name, softness)) in enumerate(zip(elements, laws)):
        law, index = softness.law, find(model, kind, name)
        assert law is not None
        _locate_element(model, kind, index, element)
        table, greased = law.table(1), law.grease is not None
        if element["kind"] in (loop.ROW, loop.PAIR) and (greased or table.by_amplitude):
            raise ModelError(
                f'{KINDS[kind].noun} "{name}": a ball joint or a pair of geoms has no place in its gap, so its law can '
                "have no grease and not be over amplitude; give such a law to a clearance"
            )
        element["index"], element["grease"], element["release"] = index, greased, table.release
        element["shared"] = softness.shared
        element["behind"] = inverse_inertia(model, kind, index) if softness.c == 0 else 0.0
        element["always"] = greased or len(table.abscissa) > 1
        if kind != "pair":
            (joints if kind == "joint" else tendons)[index] = e
        clearance = _ClearanceStub([Bushing(0.0, softness.depth, 0.0, Grease(0.0), Contact(1.0))])
        record, numbers = clearance_records(clearance, law, model.opt.timestep)
        numbers[record["wall"][0] :][:2] = -loop.FAR, 0.0  # used where the model's range is not read
        bushings[e], element["numbers"], element["size"] = record[0], sum(part.size for part in memory), numbers.size
        element["impact"] = element["numbers"] + record["ends"][0]
        memory.append(numbers)
    joined = np.array([(b.numeric, b.equality, b.axes, b.site) for b in parts.bushings], loop.SITE_BUSHING)
    friction_table = friction_places(model, bristles, {law.name for law in laws if law.kind == "pair"})
    return _Tables(elements, friction_table, joined, joints, tendons, bushings, np.concatenate(memory))


class _ClearanceStub(NamedTuple):
    """The attributes of a clearance that laws read."""

    bushings: list[Bushing]


def _locate_element(model: mujoco.MjModel, kind: str, index: int, element: Any) -> None:
    """Write the addresses of an element for compiled code."""
    if kind == "joint":
        ball = mujoco.mjtJoint(int(model.jnt_type[index])) == mujoco.mjtJoint.mjJNT_BALL
        element["kind"] = loop.ROW if ball else loop.JOINT
        element["place"], element["dof"] = model.jnt_qposadr[index], model.jnt_dofadr[index]
    elif kind == "tendon":
        element["kind"] = loop.TENDON
        element["place"], element["dof"] = model.ten_J_rowadr[index], model.ten_J_rownnz[index]
        spatial = model.wrap_type[model.tendon_adr[index]] != int(mujoco.mjtWrap.mjWRAP_JOINT)
        element["from_zero"] = spatial and model.tendon_range[index, 0] == 0
    else:
        element["kind"] = loop.PAIR
        element["geom1"], element["geom2"] = model.pair_geom1[index], model.pair_geom2[index]


def friction_places(
    model: mujoco.MjModel, bristles: Sequence[BristleSettings], pairs_with_law: Container[str] = ()
) -> np.ndarray:
    """Return the addresses (n,) of a model's bristles for compiled code, a FRICTION each."""
    table = np.zeros(len(bristles), loop.FRICTION)
    for row, friction in zip(table, bristles):
        index = find(model, friction.kind, friction.name)
        row["numeric"], row["numbers"] = friction.numeric, friction.size
        if friction.kind == "joint":
            row["kind"], row["dof"] = loop.JOINT, model.jnt_dofadr[index]
        elif friction.kind == "tendon":
            row["kind"], row["geom1"] = loop.TENDON, index
            row["dof"], row["size"] = model.ten_J_rowadr[index], model.ten_J_rownnz[index]
        else:
            row["kind"], row["law"] = loop.PAIR, friction.name in pairs_with_law
            row["geom1"], row["geom2"] = model.pair_geom1[index], model.pair_geom2[index]
    return table


def reserve(spec: mujoco.MjSpec, model: mujoco.MjModel) -> bool:
    """Reserve user data for the state of laws and friction; return True if the specification has changed."""
    parts = ActiveParts.of(model)
    size = 2 * _build_tables(model, parts).template.size if parts.have_forces else 0  # before and after a step
    previous = _read_reserved(model)
    first = previous.first if previous.first + previous.size == spec.nuserdata else max(spec.nuserdata, 0)
    room = Reserved(first, size, *parts.key(model, first))
    if room == previous or not (size or parts.drives or any(previous)):
        return False
    spec.nuserdata = first + size
    note_softener(spec)
    write_numbers(spec, _MEMORY, room)
    return True


def reserved(model: mujoco.MjModel, size: int, parts: ActiveParts) -> Reserved:
    """Return the room that `reserve` made in a model's user data for 2 ``size`` numbers.

    Raises
    ------
    ModelError
        For a model that was compiled without.
    """
    room = _read_reserved(model)
    if room[1:] != (2 * size, *parts.key(model, room.first)) or room.first + room.size > model.nuserdata:
        raise ModelError(
            "the model has no room in its userdata for what these laws, friction and drives remember; "
            "make it with clearance_mj.physical.compile()"
        )
    return room


class Reserved(NamedTuple):
    """Reserved user data of a model, and the key of the laws that it is for, as a custom numeric of the model."""

    first: int
    size: int
    key: int
    other_key: int


def _read_reserved(model: mujoco.MjModel) -> Reserved:
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, _MEMORY)
    if index < 0:
        return Reserved(0, 0, 0, 0)
    return Reserved(*map(int, model.numeric(index).data))


def _check_integrator(model: mujoco.MjModel, laws: bool) -> None:
    integrators = mujoco.mjtIntegrator
    integrator = integrators(int(model.opt.integrator))
    if integrator == integrators.mjINT_RK4:
        raise ModelError("integrator RK4 asks for forces between the steps; use Euler, implicit or implicitfast")
    if laws and integrator == getattr(integrators, "mjINT_DISCRETE", None):
        raise ModelError("integrator DISCRETE changes the forces of laws; use Euler, implicit or implicitfast")


@cache
def _callbacks() -> tuple[Any, Any, Any]:
    """Return MuJoCo's callbacks of control, actuator dynamics and user sensors, which call the model's Softener."""
    dynamics = loop.as_c(loop.dynamics, types.int32, result=types.float64)
    return loop.as_c(loop.control), dynamics, loop.as_c(loop.sensors, types.int32)


_LOCK = threading.Lock()
