"""Contacts and limits whose stiffness and damping follow a law at every step, and friction that does not creep."""

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
from .bristles import Friction, frictions
from .bushings import Joined, joined
from .drive_loop import PLACE, SENSED
from .drives import PlacedDrive, drives
from .elements import KINDS, Asked, asked, find, inverse_inertia
from .records import MARK, note_softener, write_numbers
from .rotor_sensors import rotor_sensors

__all__ = ["Softener", "drive_places", "friction_places", "reserve", "reserved"]

_MEMORY = f"{MARK}memory"  # name of the custom number that says where in the user data laws remember


class Softener:
    """What lets a model's contacts, limits and friction follow their laws, and its drives turn, at every step.

    Between ``mj_step1`` and ``mj_step2`` of a loop of your own call `update`; or use it as a context, in which every
    ``mj_step``, ``mujoco.rollout`` and ``mujoco.batch`` of such models follows the laws, on any number of threads::

        with physical.Softener(model):
            mujoco.mj_step(model, data, 1000)

    Forces are those of the step's own positions and velocities, exact but for the parasitic mass of all softness
    here. What laws remember (impact speeds, envelopes, hysteresis, bristles) is in ``data.userdata``, where `compile`
    has reserved room: it is copied, saved, restored and reset with the data. Drives are in ``data.act``.

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
        laws, bristles, turning = _laws(model), list(frictions(model)), list(drives(model))
        between = list(joined(model))
        self._softens = bool(laws or bristles or between)
        if not self._softens and not turning:
            raise ModelError(
                "no contact or limit follows a law, none has friction, no actuator a drive, and there is no bushing; "
                "constant ones need no Softener"
            )
        _refuse_integrator(model, bool(laws))
        self.model = model
        self._parts = _parts(model, laws, bristles, between)
        self._drives = drive_places(model, turning)
        self._of_actuators = np.full(len(model.actuator_trntype), -1, dtype=np.int64)
        self._of_actuators[self._drives["actuator"]] = np.arange(len(self._drives))
        size = self._parts.template.size if self._softens else 0
        room = reserved(model, size, laws, bristles, turning, between)
        self._head = np.zeros(1, loop.HEAD)
        index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, _MEMORY)
        own = {"first": room.first, "size": size, "numeric": model.numeric_adr[index] + 2}
        own |= {"drives": self._drives.ctypes.data, "n_drives": len(self._drives)}
        own["of_actuators"] = self._of_actuators.ctypes.data
        self._sensed = np.array(
            [(sensor.address, turning.index(sensor.drive)) for sensor in rotor_sensors(model)], SENSED
        )  # fmt: skip
        own |= {"sensed": self._sensed.ctypes.data, "n_sensed": len(self._sensed)}
        own["soften"] = address(loop.soften, loop.SOFTEN)
        for name, value in {**self._parts.places(), **loop.PLACES, **own}.items():
            self._head[name] = value
        self._head["signature"], self._head["key"] = np.uint64(model.signature).view(np.int64), room[2:]
        self._address = self._head.ctypes.data
        self._called: tuple[Any, ...] = (None, None)

    def update(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Let forces follow the laws; to be called between ``mj_step1`` and ``mj_step2``, or as a control callback.

        Drives turn by a step too, unless a Softener of such a model is in use and turns them, so controls are to be set
        before, and a step has one call.

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
        called = self._called
        if called[0] is not model or called[1] is not data:
            called = self._called = self._call(model, data)
        if self._softens:
            loop.soften_at(called[2])
        if len(self._drives):
            loop.turn_at(called[2])

    def _call(self, model: mujoco.MjModel, data: mujoco.MjData) -> tuple[mujoco.MjModel, mujoco.MjData, int, Any]:
        """Return what `update` was given, and the address of their addresses in an array, and the array."""
        alike = model.signature == self.model.signature or not (model.signature and self.model.signature)
        if not alike or _reserved(model) != _reserved(self.model):
            raise ModelError("the Softener was made for another model")
        places = np.array([self._address, model._address, data._address])
        return model, data, places.ctypes.data, places

    def __enter__(self) -> Softener:
        """Let MuJoCo call it in every step of such a model.

        Raises
        ------
        ModelError
            If MuJoCo calls something else, or nothing, since the model's flag actuation is disabled.
        """
        if self.model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_ACTUATION:
            raise ModelError("flag actuation is disabled, so MuJoCo would not call it; call update() instead")
        with _CHANGING:
            places = loop.IN_USE[1:]
            if places.all():
                raise ModelError(f"{places.size} Softeners are in use, no more can be")
            if not places.any():
                if mujoco.get_mjcb_control() is not None:
                    raise ModelError("MuJoCo has a control callback already; call update() in it instead")
                if mujoco.get_mjcb_act_dyn() is not None:
                    raise ModelError("MuJoCo has a callback for the dynamics of actuators already; take it away")
            senses = mujoco.get_mjcb_sensor() in (None, _sensors())
            if len(self._sensed) and not senses:
                raise ModelError("MuJoCo has a callback for users' sensors already, which rotors' sensors need")
            if not places.any():
                mujoco.set_mjcb_control(_control())
                mujoco.set_mjcb_act_dyn(_dynamics())
                if senses:
                    mujoco.set_mjcb_sensor(_sensors())
            place = int(np.argmin(places != 0))
            places[place] = self._address
            loop.IN_USE[0] = max(loop.IN_USE[0], place + 1)
        return self

    def __exit__(self, *_: object) -> None:
        """Take it away again."""
        with _CHANGING:
            places = loop.IN_USE[1:]
            places[places == self._address] = 0
            loop.IN_USE[0] = np.flatnonzero(places).max(initial=-1) + 1
            if not places.any():
                mujoco.set_mjcb_control(None)
                mujoco.set_mjcb_act_dyn(None)
                if mujoco.get_mjcb_sensor() is _sensors():
                    mujoco.set_mjcb_sensor(None)


class _Parts(NamedTuple):
    """Arrays that compiled code reads at their addresses."""

    elements: np.ndarray  # (n,) ELEMENT; pairs last
    frictions: np.ndarray  # (m,) FRICTION
    joined: np.ndarray  # (b,) JOINED
    joints: np.ndarray  # (njnt,) which element each one is, or -1
    tendons: np.ndarray  # (ntendon,)
    bushings: np.ndarray  # (n,) BUSHING
    template: np.ndarray  # (size,) the memory's beginning

    def places(self) -> dict[str, int]:
        """Return what a HEAD holds of them."""
        arrays = {
            "elements": self.elements, "frictions": self.frictions, "joints": self.joints, "tendons": self.tendons,
            "joined": self.joined,
            "bushings": self.bushings, "template": self.template,
        }  # fmt: skip
        return {name: array.ctypes.data for name, array in arrays.items()} | {
            "n_elements": len(self.elements), "first_pair": int(np.sum(self.elements["kind"] != loop.PAIR)),
            "n_joined": len(self.joined),
            "n_frictions": len(self.frictions), "first_friction": 2 + len(self.elements), "size": self.template.size,
        }  # fmt: skip


def drive_places(model: mujoco.MjModel, placed: Sequence[PlacedDrive]) -> np.ndarray:
    """(n,) where compiled code finds the drives of a model."""
    found = np.zeros(len(placed), PLACE)
    for place, drive in zip(found, placed):
        index = drive.actuator
        place["actuator"], place["numeric"], place["slips"] = index, drive.numeric, drive.hysteresis
        place["act"], place["size"] = model.actuator_actadr[index], model.actuator_actnum[index]
        place["output"], place["control"] = output_of(model, index), control_of(model, index)
    return found


def _laws(model: mujoco.MjModel) -> list[Asked]:
    """Elements with a law, pairs last."""
    return sorted((e for e in asked(model) if e.softness.law), key=lambda e: (e.kind == "pair", e.kind, e.name))


def _parts(
    model: mujoco.MjModel, laws: Sequence[Asked], bristles: Sequence[Friction], between: Sequence[Joined]
) -> _Parts:  # fmt: skip
    elements, bushings = np.zeros(len(laws), loop.ELEMENT), np.zeros(len(laws), BUSHING)
    memory = [np.zeros(2 + len(laws) + loop.OF_FRICTION * len(bristles))]
    joints, tendons = (np.full(max(n, 1), -1, dtype=np.int32) for n in (model.njnt, model.ntendon))
    for e, (element, (kind, name, softness)) in enumerate(zip(elements, laws)):
        law, index = softness.law, find(model, KINDS[kind].object, name)
        assert law is not None
        _describe(model, kind, index, element)
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
        opening = _Opening([Bushing(0.0, softness.depth, 0.0, Grease(0.0), Contact(1.0))])
        record, numbers = clearance_records(opening, law, model.opt.timestep)
        numbers[record["wall"][0] :][:2] = -loop.FAR, 0.0  # where the model's range is not read
        bushings[e], element["numbers"], element["size"] = record[0], sum(part.size for part in memory), numbers.size
        element["impact"] = element["numbers"] + record["ends"][0]
        memory.append(numbers)
    places = np.zeros(len(between), loop.JOINED)
    for row, bushing in zip(places, between):
        row["numeric"], row["equality"], row["axes"], row["site"] = (
            bushing.numeric, bushing.equality, bushing.axes, bushing.site
        )  # fmt: skip
    rubbing = friction_places(model, bristles, {law.name for law in laws if law.kind == "pair"})
    return _Parts(elements, rubbing, places, joints, tendons, bushings, np.concatenate(memory))


class _Opening(NamedTuple):
    """What laws get of a clearance."""

    bushings: list[Bushing]


def _describe(model: mujoco.MjModel, kind: str, index: int, element: Any) -> None:
    """Say where compiled code finds an element."""
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
    model: mujoco.MjModel, bristles: Sequence[Friction], pairs_with_law: Container[str] = ()
) -> np.ndarray:
    """(n,) FRICTION: where compiled code finds the bristles of a model."""
    found = np.zeros(len(bristles), loop.FRICTION)
    for row, friction in zip(found, bristles):
        index = find(model, KINDS[friction.kind].object, friction.name)
        row["numeric"], row["numbers"] = friction.numeric, friction.size
        if friction.kind == "joint":
            row["kind"], row["dof"] = loop.JOINT, model.jnt_dofadr[index]
        elif friction.kind == "tendon":
            row["kind"], row["geom1"] = loop.TENDON, index
            row["dof"], row["size"] = model.ten_J_rowadr[index], model.ten_J_rownnz[index]
        else:
            row["kind"], row["law"] = loop.PAIR, friction.name in pairs_with_law
            row["geom1"], row["geom2"] = model.pair_geom1[index], model.pair_geom2[index]
    return found


def reserve(spec: mujoco.MjSpec, model: mujoco.MjModel) -> bool:
    """Reserve room in a specification's user data for what laws and friction remember; say whether it has changed."""
    laws, bristles, turning, between = _laws(model), list(frictions(model)), list(drives(model)), list(joined(model))
    softens = bool(laws or bristles or between)
    size = 2 * _parts(model, laws, bristles, between).template.size if softens else 0  # before a step and after
    before = _reserved(model)
    first = before.first if before.first + before.size == spec.nuserdata else max(spec.nuserdata, 0)  # others have come
    now = Reserved(first, size, *_key(model, first, laws, bristles, turning, between))
    if now == before or not (size or turning or any(before)):
        return False
    spec.nuserdata = first + size
    note_softener(spec)
    write_numbers(spec, _MEMORY, now)
    return True


def reserved(
    model: mujoco.MjModel, size: int, laws: Sequence[Asked], bristles: Sequence[Friction],
    turning: Sequence[PlacedDrive], between: Sequence[Joined],
) -> Reserved:  # fmt: skip
    """Return the room that `reserve` made in the user data of a model for so many numbers, twice.

    Raises
    ------
    ModelError
        For a model that was compiled without.
    """
    room = _reserved(model)
    key = _key(model, room.first, laws, bristles, turning, between)
    if room[1:] != (2 * size, *key) or room.first + room.size > model.nuserdata:
        raise ModelError(
            "the model has no room in its userdata for what these laws, friction and drives remember; "
            "make it with clearance_mj.physical.compile()"
        )
    return room


class Reserved(NamedTuple):
    """The room in the user data of a model, and for which laws it is, as a custom number of the model."""

    first: int
    size: int
    key: int
    other_key: int


def _reserved(model: mujoco.MjModel) -> Reserved:
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, _MEMORY)
    if index < 0:
        return Reserved(0, 0, 0, 0)
    begin = model.numeric_adr[index]
    return Reserved(*(int(value) for value in model.numeric_data[begin : begin + model.numeric_size[index]]))


def _key(
    model: mujoco.MjModel, first: int, laws: Sequence[Asked], bristles: Sequence[Friction],
    turning: Sequence[PlacedDrive], between: Sequence[Joined],
) -> tuple[int, int]:  # fmt: skip
    """Two numbers of six digits, as many as MJCF keeps, that tell laws, friction, drives and their places apart."""
    names = [(e.kind, e.name) for e in laws] + [(f.kind, f.name) for f in bristles]
    places = [find(model, KINDS[kind].object, name) for kind, name in names]
    sizes = first, model.nq, model.nv, model.na, getattr(model, "nJten", 0), model.ngeom, model.nbody
    content = (
        [(e.kind, e.name, e.softness.data) for e in laws], [(f.kind, f.name) for f in bristles], list(turning), places,
        sizes, *between,
    )  # fmt: skip
    key = zlib.crc32(repr(content).encode())
    return key % 1_000_000, key // 1_000_000


def _refuse_integrator(model: mujoco.MjModel, laws: bool) -> None:
    integrators = mujoco.mjtIntegrator
    integrator = integrators(int(model.opt.integrator))
    if integrator == integrators.mjINT_RK4:
        raise ModelError("integrator RK4 asks for forces between the steps; use Euler, implicit or implicitfast")
    if laws and integrator == getattr(integrators, "mjINT_DISCRETE", None):
        raise ModelError("integrator DISCRETE changes the forces of laws; use Euler, implicit or implicitfast")


@cache
def _control() -> Any:
    """Return MuJoCo's control callback, which looks for the Softener of the model that is stepped."""
    return loop.as_c(loop.control)


@cache
def _dynamics() -> Any:
    """Return MuJoCo's callback for the dynamics of actuators, which looks for the Softener of their model."""
    return loop.as_c(loop.dynamics, types.int32, result=types.float64)


@cache
def _sensors() -> Any:
    """Return MuJoCo's callback for users' sensors, which looks for the Softener of their model."""
    return loop.as_c(loop.sensors, types.int32)


_CHANGING = threading.Lock()
