"""Forces of a `Softener` within a step, compiled."""

from __future__ import annotations

import ctypes
from typing import Any

import llvmlite.binding
import mujoco
import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from ..clearance.follower import contact_force
from ..clearance.kernel import answered, depth_in, film_force, follow_law, forget, press
from ..clearance.lanes import signed
from ..clearance.pointers import caller
from ..clearance.record import BUSHING
from ..core.jit import OPTIONS, STRICT, jit
from . import drive_loop
from .bushing_loop import SITE_BUSHING, apply_bushing
from .friction_loop import FRICTION, OF_FRICTION, advance_bristle, apply_friction, is_between, normal_rows
from .library import CONTACT_SIZE, doubles, field, integers, offsets_of, pointer

__all__ = ["ELEMENT", "FRICTION", "HEAD", "JOINT", "OF_FRICTION", "PAIR", "ROW", "SITE_BUSHING", "TENDON", "soften"]

JOINT, TENDON, ROW, PAIR = range(4)
"""Kinds of elements: joint coordinate, tendon length, constraint row (of a ball joint's limit), pair of geoms"""

DATA = (
    "time", "userdata", "qpos", "qvel", "qfrc_passive", "ten_length", "ten_velocity", "ten_J", "ncon", "nefc",
    "contact", "qacc_warmstart", "efc_J", "efc_J_rowadr", "efc_J_rownnz", "efc_J_colind", "efc_type", "efc_id",
    "efc_pos", "efc_R", "efc_aref", "efc_vel", "site_xmat",
)  # fmt: skip
MODEL = ("signature", "nnumericdata", "numeric_data", "jnt_range", "tendon_range", "ten_J_colind", "nv", "eq_data")
CONTACT = ("pos", "frame", "geom", "dim", "mu", "friction", "solref", "solimp", "efc_address")
PLACES = offsets_of(DATA, MODEL, ("timestep", "jacobian"), CONTACT) | {"contact_size": CONTACT_SIZE} | drive_loop.PLACES
"""Offsets in MuJoCo's structures, bytes"""

_HEAD_FIELDS = (
    "soften",  # address of the compiled function
    "signature", "numeric",  # of its models, and address of the key in numeric_data
    "elements", "n_elements", "first_pair",  # address and number of ELEMENT, and the first of them that is a pair
    "bushings",  # address of their records of the kernel
    "frictions", "n_frictions", "first_friction",  # of FRICTION, and address of their bristles in the memory
    "joined", "n_joined",  # of JOINED
    "joints", "tendons",  # addresses of the element of each joint and tendon, -1 for none
    "template", "first", "size",  # initial memory, its address in the userdata and its length, in doubles
    "sensed", "n_sensed",  # address and number of SENSED
    "drives", "n_drives", "of_actuators",  # address and number of PLACE; drive of each actuator, -1 for none
)  # fmt: skip
HEAD = np.dtype([("key", np.float64, 2), *((name, np.int64) for name in (*_HEAD_FIELDS, *PLACES))])
"""Data of the compiled loop, passed by one address"""

_INTEGERS = (
    "kind", "index", "place", "dof", "geom1", "geom2", "numbers", "size", "impact", "grease", "always", "from_zero",
    "shared",
)  # fmt: skip
ELEMENT = np.dtype([*((name, np.int64) for name in _INTEGERS), ("release", np.float64), ("behind", np.float64)])
"""A contact or limit with a law: ``place`` and ``dof`` are addresses in qpos and qvel, or begin and length of a row of
the tendons' Jacobian; ``numbers`` and ``size``: address and length of the kernel's numbers in the memory, ``impact``
that of the impact speed; ``always``: evaluated in the gap too, for grease or a law over time; ``behind``: Â, 1/kg, if
its damping depends on the impact speed, else 0"""
_LARGEST_SLOWDOWN = 0.25  # largest fraction of a speed that damping of such an element may remove in a step
ONE = (0,)  # lane of the kernel
FAR = 1e9  # m or rad, position of an absent wall, finite for the userdata
_POSITIONS = int(mujoco.mjtStage.mjSTAGE_POS)
_LIMIT_JOINT = int(mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT)
_LIMIT_TENDON = int(mujoco.mjtConstraint.mjCNSTR_LIMIT_TENDON)

SOFTEN = types.void(types.intp, types.intp, types.intp)
call_soften = caller(SOFTEN)
IN_USE = np.zeros(1 + 4096, dtype=np.int64)
"""Number of slots in use, and the addresses of the HEADs in them; 0 for none"""
_IN_USE = "clearance_mj_softeners_in_use"
llvmlite.binding.add_symbol(_IN_USE, IN_USE.ctypes.data)


@intrinsic
def _in_use_address(_: Any) -> Any:
    """Return the address of `IN_USE`, by symbol name, since compiled code is cached between sessions."""

    def generate(context: Any, builder: Any, __: Any, ___: Any) -> Any:
        symbol = cgutils.get_or_insert_function(builder.module, ir.FunctionType(ir.VoidType(), ()), _IN_USE)
        return builder.ptrtoint(symbol, cgutils.intp_t)

    return types.intp(), generate


_in_use: Any = _in_use_address


def soften(head_address: int, model: int, data: int) -> None:
    """Apply the force of its law to every contact and limit, and add grease and friction to the passive forces.

    To be called with the address of a HEAD after a step's positions, velocities and constraints and before its forces,
    like a control callback. The memory before the step is saved, so that the step may be repeated.
    """
    head = numba.carray(pointer(head_address), 1, HEAD)[0]
    base = field(data + head.d_userdata) + 8 * head.first
    memory, saved, n = doubles(base, head.size), doubles(base + 8 * head.size, head.size), head.n_elements
    time = doubles(data + head.d_time, 1)[0]
    if memory[0] != 0.0 and time == memory[1]:  # the same step again, as in mj_transitionFD and mj_forward
        memory[:] = saved
    else:
        saved[:] = memory
    step = time - memory[1]
    restarts = memory[0] == 0.0 or step < 0.0 or step > 1.5 * memory[0]
    if restarts:
        memory[:] = doubles(head.template, head.size)
        step = 0.0
    memory[0], memory[1] = doubles(model + head.m_timestep, 1)[0], time
    n_rows, n_contacts = integers(data + head.d_nefc, 1)[0], integers(data + head.d_ncon, 1)[0]
    if n > 0:
        elements = numba.carray(pointer(head.elements), n, ELEMENT)
        rows = memory[2 : 2 + n]  # of the elements' constraints, -1 for none
        for e in range(n):
            rows[e] = -1
        joints, tendons = integers(head.joints, 1), integers(head.tendons, 1)
        kinds = integers(field(data + head.d_efc_type), n_rows)
        ids = integers(field(data + head.d_efc_id), n_rows)
        for r in range(n_rows):
            e = -1
            if kinds[r] == _LIMIT_JOINT:
                e = joints[ids[r]]
            elif kinds[r] == _LIMIT_TENDON:
                e = tendons[ids[r]]
            if e >= 0:
                rows[e] = r
        for i in range(n_contacts):
            contact = field(data + head.d_contact) + i * head.contact_size
            geoms, r = integers(contact + head.c_geom, 2), integers(contact + head.c_efc_address, 1)[0]
            if r >= 0:
                for e in range(head.first_pair, n):
                    if is_between(geoms, elements[e].geom1, elements[e].geom2):
                        rows[e] = r
        bushings = numba.carray(pointer(head.bushings), n, BUSHING)
        for e in range(n):
            if rows[e] >= 0 or elements[e].always:
                numbers = doubles(base + 8 * elements[e].numbers, elements[e].size)
                _apply_law(head, model, data, elements[e], bushings[e : e + 1], numbers, int(rows[e]), restarts, time,
                        step, n_rows, n_contacts)  # fmt: skip
            elif memory[elements[e].impact] != 0.0:
                memory[elements[e].impact] = 0.0
    frictions = numba.carray(pointer(head.frictions), head.n_frictions, FRICTION)
    qvel, passive = doubles(field(data + head.d_qvel), 1), doubles(field(data + head.d_qfrc_passive), 1)
    for i in range(head.n_frictions):
        friction, start = frictions[i], head.first_friction + i * OF_FRICTION
        bristles = memory[start : start + OF_FRICTION]
        numbers = doubles(field(model + head.m_numeric_data) + 8 * friction.numeric, friction.numbers)
        if friction.kind == JOINT:
            bristles[0], force = advance_bristle(
                numbers[0], numbers[1], numbers[2], bristles[0], step, qvel[friction.dof]
            )
            passive[friction.dof] -= force
        elif friction.kind == TENDON:
            speed = doubles(field(data + head.d_ten_velocity) + 8 * friction.geom1, 1)[0]
            bristles[0], force = advance_bristle(numbers[0], numbers[1], numbers[2], bristles[0], step, speed)
            _add_tension(head, model, data, friction.dof, friction.size, force, passive)
        else:
            apply_friction(head, model, data, friction, numbers, bristles, step)
    bushings_between_sites = numba.carray(pointer(head.joined), head.n_joined, SITE_BUSHING)
    for i in range(head.n_joined):
        apply_bushing(head, model, data, bushings_between_sites[i])


@jit(**OPTIONS)
def _apply_law(
    head: Any, model: int, data: int, element: Any, bushings: np.ndarray, numbers: np.ndarray, row: int, restarts: bool,
    time: float, step: float, n_rows: int, n_contacts: int,
) -> None:  # fmt: skip
    """Apply the law of an element."""
    bushing = bushings[0]
    depths = doubles(field(data + head.d_efc_pos), n_rows)
    speeds = doubles(field(data + head.d_efc_vel), n_rows)
    softness = doubles(field(data + head.d_efc_R), n_rows)
    reference = doubles(field(data + head.d_efc_aref), n_rows)
    passive = doubles(field(data + head.d_qfrc_passive), 1)
    x, speed = -1.0, 0.0
    if element.kind <= TENDON:
        if element.kind == JOINT:
            walls = doubles(field(model + head.m_jnt_range) + 16 * element.index, 2)
            x = doubles(field(data + head.d_qpos), 1)[element.place]
            speed = doubles(field(data + head.d_qvel), 1)[element.dof]
        else:
            walls = doubles(field(model + head.m_tendon_range) + 16 * element.index, 2)
            x = doubles(field(data + head.d_ten_length), 1)[element.index]
            speed = doubles(field(data + head.d_ten_velocity), 1)[element.index]
        middle = 0.0 if element.from_zero else 0.5 * (walls[0] + walls[1])
        x -= middle
        numbers[bushing.wall + 1] = walls[1] - middle
        numbers[bushing.wall] = -FAR if element.from_zero else walls[0] - middle
    elif element.kind == ROW and row >= 0:
        x, speed = -depths[row], -speeds[row]
    if restarts or not element.grease:
        numbers[bushing.place] = x
    if element.grease:
        record = bushings.copy()  # for this step
        if step > 0.0:
            record[0].step = step
        film_force(record[0], numbers, (x,), 0.0, ONE)
        force = answered(bushing, numbers, 0, ONE) + answered(bushing, numbers, 1, ONE) * speed
        if element.kind == JOINT:
            passive[element.dof] -= force
        else:
            _add_tension(head, model, data, element.place, element.dof, force, passive)
    if step > 0.0 or restarts:
        if bushing.by_amplitude:
            numbers[bushing.decay] = np.exp(-step / element.release)
        follow_law(bushing, numbers, time, ONE)
    c_max = np.inf
    if element.behind > 0.0:  # limited, since the step does not resolve slow impacts
        c_max = _LARGEST_SLOWDOWN / (element.behind * doubles(model + head.m_timestep, 1)[0])
    if element.kind == PAIR and row >= 0:
        points = 0
        for i in range(n_contacts if element.shared or element.behind > 0.0 else 0):
            contact = field(data + head.d_contact) + i * head.contact_size
            touches = integers(contact + head.c_efc_address, 1)[0] >= 0
            points += touches and is_between(integers(contact + head.c_geom, 2), element.geom1, element.geom2)
        fraction = 1.0 / points if element.shared else 1.0
        c_max /= max(points, 1)
        for i in range(n_contacts):
            contact = field(data + head.d_contact) + i * head.contact_size
            geoms, r = integers(contact + head.c_geom, 2), integers(contact + head.c_efc_address, 1)[0]
            if r >= 0 and is_between(geoms, element.geom1, element.geom2):
                rows, single_R = normal_rows(head, data, contact, r)
                push = fraction * _law_force(bushing, numbers, -depths[r], -speeds[r : r + rows].mean(), c_max)
                reference[r : r + rows] = single_R * push
    else:
        force = _law_force(bushing, numbers, x, speed, c_max)
        if row >= 0:
            reference[row] = softness[row] * force


@jit(**OPTIONS)
def _law_force(bushing: Any, numbers: np.ndarray, x: float, speed: float, c_max: float) -> float:
    """Advance a contact with a damping of at most ``c_max``, N s/m, and return its force."""
    g = depth_in(bushing, numbers, x, ONE)
    if g == 0.0:
        forget(bushing, numbers, 0, ONE)
        return 0.0
    k, c = press(bushing, numbers, 0, g, speed, ONE)
    return contact_force(2.0 * k, min(2.0 * c, c_max), abs(g), signed(speed, g), False)


@jit(**OPTIONS)
def _find_head(model: int) -> Any:
    """Return the address of the HEAD in use of a model, 0 for none."""
    count = numba.carray(pointer(_in_use()), 1, np.int64)[0]
    for head_address in numba.carray(pointer(_in_use() + 8), count, np.int64):
        if head_address != 0:
            head = numba.carray(pointer(head_address), 1, HEAD)[0]
            signature = field(model + head.m_signature)
            same_model = head.signature == signature or head.signature == 0 or signature == 0  # 0: saved model
            if same_model and field(model + head.m_nnumericdata) >= head.numeric + 2:
                key = doubles(field(model + head.m_numeric_data) + 8 * head.numeric, 2)
                if key[0] == head.key[0] and key[1] == head.key[1]:
                    return head_address
    return 0


@jit(**OPTIONS)
def control(model: int, data: int) -> None:
    """Call `soften` with the HEAD in use that is the model's; MuJoCo's control callback."""
    head_address = _find_head(model)
    if head_address != 0:
        head = numba.carray(pointer(head_address), 1, HEAD)[0]
        if head.size > 0:  # else there is nothing but drives
            call_soften(head.soften, head_address, model, data)


@jit(**OPTIONS)
def dynamics(model: int, data: int, actuator: int) -> float:
    """Advance the drive inside an actuator; MuJoCo's callback for actuator dynamics."""
    head_address = _find_head(model)
    if head_address != 0:
        head = numba.carray(pointer(head_address), 1, HEAD)[0]
        i = numba.carray(pointer(head.of_actuators), actuator + 1, np.int64)[actuator]
        if i >= 0:
            places = numba.carray(pointer(head.drives), head.n_drives, drive_loop.PLACE)
            drive_loop.turn(head, model, data, places[i])
    return 0.0


@jit(**OPTIONS)
def _write_sensors(head: Any, model: int, data: int) -> None:
    """Write the rotors' angles into the sensors of the model."""
    rotor_sensors = numba.carray(pointer(head.sensed), head.n_sensed, drive_loop.SENSED)
    drives = numba.carray(pointer(head.drives), head.n_drives, drive_loop.PLACE)
    for i in range(head.n_sensed):
        drive_loop.sense(head, model, data, drives[rotor_sensors[i].drive], rotor_sensors[i].address)


@jit(**OPTIONS)
def sensors(model: int, data: int, stage: int) -> None:
    """Write the sensors of rotors' angles; MuJoCo's callback for user sensors."""
    head_address = _find_head(model)
    if stage == _POSITIONS and head_address != 0:
        _write_sensors(numba.carray(pointer(head_address), 1, HEAD)[0], model, data)


@jit(**STRICT)
def turn_at(address: int) -> None:
    """Advance all drives of a model in a user's loop, unless `dynamics` does; ``address`` as in `soften_at`."""
    addresses = numba.carray(pointer(address), 3, np.int64)
    head = numba.carray(pointer(addresses[0]), 1, HEAD)[0]
    if _find_head(addresses[1]) != 0:
        return
    _write_sensors(head, addresses[1], addresses[2])
    drives = numba.carray(pointer(head.drives), head.n_drives, drive_loop.PLACE)
    for i in range(head.n_drives):
        drive_loop.advance(head, addresses[1], addresses[2], drives[i])


@jit(nogil=False, **OPTIONS)  # releasing the interpreter's lock would take longer than the call
def soften_at(address: int) -> None:
    """Call `soften` with the three addresses at an address; one argument is passed faster than three."""
    addresses = numba.carray(pointer(address), 3, np.int64)
    head = numba.carray(pointer(addresses[0]), 1, HEAD)[0]
    call_soften(head.soften, addresses[0], addresses[1], addresses[2])


def as_c(function: Any, *extra: Any, result: Any = types.void) -> Any:
    """Return a numba function of two addresses and extra arguments as a C function."""
    signature = types.intp, types.intp, *extra
    function.compile(signature)
    overload = function.overloads[signature]
    address = overload.library.get_pointer_to_function(overload.fndesc.llvm_cfunc_wrapper_name)
    kinds: Any = {types.intp: ctypes.c_ssize_t, types.int32: ctypes.c_int32, types.float64: ctypes.c_double}
    return ctypes.CFUNCTYPE(kinds.get(result), *(kinds[kind] for kind in signature))(address)


@jit(**OPTIONS)
def _add_tension(head: Any, model: int, data: int, first: int, size: int, force: float, passive: np.ndarray) -> None:
    """Subtract a tendon's force from the passive forces."""
    row = doubles(field(data + head.d_ten_J) + 8 * first, size)
    columns = integers(field(model + head.m_ten_J_colind) + 4 * first, size)
    for i in range(size):
        passive[columns[i]] -= row[i] * force
