"""What `Softener` does between a step's velocities and its forces, compiled."""

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
from ..clearance.kernel import answered, depth_in, fill, follow_law, forget, press
from ..clearance.lanes import signed
from ..clearance.pointers import caller
from ..clearance.record import BUSHING
from ..core.jit import OPTIONS, STRICT, jit
from . import drive_loop, library
from .bushing_loop import JOINED, press_back
from .friction_loop import FRICTION, OF_FRICTION, bend, between, normal_rows, rub
from .library import doubles, field, integers, pointer

__all__ = ["ELEMENT", "FRICTION", "HEAD", "JOINED", "JOINT", "OF_FRICTION", "PAIR", "ROW", "TENDON", "soften"]

JOINT, TENDON, ROW, PAIR = range(4)
"""Kinds: a coordinate, a tendon's length, a row of the constraints alone (of a ball joint's limit), a pair of geoms"""

DATA = (
    "time", "userdata", "qpos", "qvel", "qfrc_passive", "ten_length", "ten_velocity", "ten_J", "ncon", "nefc",
    "contact", "qacc_warmstart", "efc_J", "efc_J_rowadr", "efc_J_rownnz", "efc_J_colind", "efc_type", "efc_id",
    "efc_pos", "efc_R", "efc_aref", "efc_vel", "site_xmat",
)  # fmt: skip
MODEL = ("signature", "nnumericdata", "numeric_data", "jnt_range", "tendon_range", "ten_J_colind", "nv", "eq_data")
CONTACT = ("pos", "frame", "geom", "dim", "mu", "friction", "solref", "solimp", "efc_address")
PLACES = {
    **{f"d_{name}": library.DATA[name] for name in DATA},
    **{f"m_{name}": library.MODEL[name] for name in MODEL},
    **{f"c_{name}": library.CONTACT[name] for name in CONTACT},
    **{f"m_{name}": library.MODEL["opt"] + library.OPTION[name] for name in ("timestep", "jacobian")},
    "contact_size": library.CONTACT_SIZE,
    **drive_loop.PLACES,
}  # Offsets in MuJoCo's structures, bytes

_OWN = (
    "soften",  # address of the compiled function
    "signature", "numeric",  # of the models that this is for, and where in their custom numbers the key is
    "elements", "n_elements", "first_pair",  # address and number of ELEMENT, and the first of them that is a pair
    "bushings",  # address of their records of the kernel
    "frictions", "n_frictions", "first_friction",  # of FRICTION, and where in the memory their bristles begin
    "joined", "n_joined",  # of JOINED
    "joints", "tendons",  # addresses: which element a joint or tendon is, -1 for none
    "template", "first", "size",  # the memory's beginning, and where it is in the user's data: numbers of 8 bytes
    "sensed", "n_sensed",  # address and number of SENSED
    "drives", "n_drives", "of_actuators",  # address and number of their PLACE, and which each actuator has, -1 for none
)  # fmt: skip
HEAD = np.dtype([("key", np.float64, 2), *((name, np.int64) for name in (*_OWN, *PLACES))])
"""All that a compiled loop needs to know, by one address"""

_INTEGERS = (
    "kind", "index", "place", "dof", "geom1", "geom2", "numbers", "size", "impact", "grease", "always", "from_zero",
    "shared",
)  # fmt: skip
ELEMENT = np.dtype([*((name, np.int64) for name in _INTEGERS), ("release", np.float64), ("behind", np.float64)])
"""A contact or limit with a law: ``place`` and ``dof`` are where a coordinate is in qpos and qvel, or where a tendon's
row of the Jacobian begins and its length; ``numbers``: where in the memory its numbers of the kernel begin, of
``size``, and ``impact`` where its speed of impact is; ``always``: something happens in the gap too, or over time;
``behind``: Â, 1/kg, of one whose damping depends on that speed, else 0"""
_SLOWED = 0.25  # share of a speed that the damping of all points of such an element may take away in a step
ONE = (0,)  # lane of the kernel
FAR = 1e9  # m or rad, where a wall is that is not there: the user's data stay finite
_POSITIONS = int(mujoco.mjtStage.mjSTAGE_POS)
_LIMIT_JOINT = int(mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT)
_LIMIT_TENDON = int(mujoco.mjtConstraint.mjCNSTR_LIMIT_TENDON)

SOFTEN = types.void(types.intp, types.intp, types.intp)
call_soften = caller(SOFTEN)
IN_USE = np.zeros(1 + 4096, dtype=np.int64)
"""Number of places in use and, in these, the addresses of the HEADs that `control` knows; 0 for none"""
_IN_USE = "clearance_mj_softeners_in_use"
llvmlite.binding.add_symbol(_IN_USE, IN_USE.ctypes.data)


@intrinsic
def _place_in_use(_: Any) -> Any:
    """Address of `IN_USE`, which code that is cached between sessions knows by name."""

    def generate(context: Any, builder: Any, __: Any, ___: Any) -> Any:
        symbol = cgutils.get_or_insert_function(builder.module, ir.FunctionType(ir.VoidType(), ()), _IN_USE)
        return builder.ptrtoint(symbol, cgutils.intp_t)

    return types.intp(), generate


_in_use: Any = _place_in_use


def soften(where: int, model: int, data: int) -> None:
    """Give every contact and limit the force of its law, and add grease and friction to the passive forces.

    To be called with the address of a HEAD when a step's positions, velocities and constraints are known and its
    forces are not, as a control callback is. What is remembered before the step is kept, so that the step may be asked
    for again.
    """
    head = numba.carray(pointer(where), 1, HEAD)[0]
    here = field(data + head.d_userdata) + 8 * head.first
    memory, before, n = doubles(here, head.size), doubles(here + 8 * head.size, head.size), head.n_elements
    time = doubles(data + head.d_time, 1)[0]
    if memory[0] != 0.0 and time == memory[1]:  # the same step again, as mj_transitionFD and mj_forward ask for it
        memory[:] = before
    else:
        before[:] = memory
    step = time - memory[1]
    begins = memory[0] == 0.0 or step < 0.0 or step > 1.5 * memory[0]
    if begins:
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
                    if between(geoms, elements[e].geom1, elements[e].geom2):
                        rows[e] = r
        bushings = numba.carray(pointer(head.bushings), n, BUSHING)
        for e in range(n):
            if rows[e] >= 0 or elements[e].always:
                numbers = doubles(here + 8 * elements[e].numbers, elements[e].size)
                _follow(head, model, data, elements[e], bushings[e : e + 1], numbers, int(rows[e]), begins, time,
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
            bristles[0], force = bend(numbers[0], numbers[1], numbers[2], bristles[0], step, qvel[friction.dof])
            passive[friction.dof] -= force
        elif friction.kind == TENDON:
            speed = doubles(field(data + head.d_ten_velocity) + 8 * friction.geom1, 1)[0]
            bristles[0], force = bend(numbers[0], numbers[1], numbers[2], bristles[0], step, speed)
            _pull(head, model, data, friction.dof, friction.size, force, passive)
        else:
            rub(head, model, data, friction, numbers, bristles, step)
    bushings_between_sites = numba.carray(pointer(head.joined), head.n_joined, JOINED)
    for i in range(head.n_joined):
        press_back(head, model, data, bushings_between_sites[i])


@jit(**OPTIONS)
def _follow(
    head: Any, model: int, data: int, element: Any, bushings: np.ndarray, numbers: np.ndarray, row: int, begins: bool,
    time: float, step: float, n_rows: int, n_contacts: int,
) -> None:  # fmt: skip
    """Let an element follow its law."""
    bushing = bushings[0]
    depths = doubles(field(data + head.d_efc_pos), n_rows)
    speeds = doubles(field(data + head.d_efc_vel), n_rows)
    softness = doubles(field(data + head.d_efc_R), n_rows)
    wanted = doubles(field(data + head.d_efc_aref), n_rows)
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
    if begins or not element.grease:
        numbers[bushing.place] = x
    if element.grease:
        filled = bushings.copy()  # for this step
        if step > 0.0:
            filled[0].step = step
        fill(filled[0], numbers, (x,), 0.0, ONE)
        force = answered(bushing, numbers, 0, ONE) + answered(bushing, numbers, 1, ONE) * speed
        if element.kind == JOINT:
            passive[element.dof] -= force
        else:
            _pull(head, model, data, element.place, element.dof, force, passive)
    if step > 0.0 or begins:
        if bushing.by_amplitude:
            numbers[bushing.decay] = np.exp(-step / element.release)
        follow_law(bushing, numbers, time, ONE)
    most = np.inf
    if element.behind > 0.0:  # what rests has landed too slowly for the step to resolve
        most = _SLOWED / (element.behind * doubles(model + head.m_timestep, 1)[0])
    if element.kind == PAIR and row >= 0:
        points = 0
        for i in range(n_contacts if element.shared or element.behind > 0.0 else 0):
            contact = field(data + head.d_contact) + i * head.contact_size
            touches = integers(contact + head.c_efc_address, 1)[0] >= 0
            points += touches and between(integers(contact + head.c_geom, 2), element.geom1, element.geom2)
        part = 1.0 / points if element.shared else 1.0
        most /= max(points, 1)
        for i in range(n_contacts):
            contact = field(data + head.d_contact) + i * head.contact_size
            geoms, r = integers(contact + head.c_geom, 2), integers(contact + head.c_efc_address, 1)[0]
            if r >= 0 and between(geoms, element.geom1, element.geom2):
                rows, alone = normal_rows(head, data, contact, r)
                pressing = part * _press(bushing, numbers, -depths[r], -speeds[r : r + rows].mean(), most)
                wanted[r : r + rows] = alone * pressing
    else:
        force = _press(bushing, numbers, x, speed, most)
        if row >= 0:
            wanted[row] = softness[row] * force


@jit(**OPTIONS)
def _press(bushing: Any, numbers: np.ndarray, x: float, speed: float, most: float) -> float:
    """Follow a contact with a damping of at most ``most``, N s/m, and return its force."""
    g = depth_in(bushing, numbers, x, ONE)
    if g == 0.0:
        forget(bushing, numbers, 0, ONE)
        return 0.0
    k, c = press(bushing, numbers, 0, g, speed, ONE)
    return contact_force(2.0 * k, min(2.0 * c, most), abs(g), signed(speed, g), False)


@jit(**OPTIONS)
def _used(model: int) -> Any:
    """Address of the HEAD in use that is a model's, 0 for none."""
    count = numba.carray(pointer(_in_use()), 1, np.int64)[0]
    for where in numba.carray(pointer(_in_use() + 8), count, np.int64):
        if where != 0:
            head = numba.carray(pointer(where), 1, HEAD)[0]
            signature = field(model + head.m_signature)
            alike = head.signature == signature or head.signature == 0 or signature == 0  # 0: of a saved model
            if alike and field(model + head.m_nnumericdata) >= head.numeric + 2:
                key = doubles(field(model + head.m_numeric_data) + 8 * head.numeric, 2)
                if key[0] == head.key[0] and key[1] == head.key[1]:
                    return where
    return 0


@jit(**OPTIONS)
def control(model: int, data: int) -> None:
    """Call `soften` with the HEAD in use that is the model's; MuJoCo's control callback."""
    where = _used(model)
    if where != 0:
        head = numba.carray(pointer(where), 1, HEAD)[0]
        if head.size > 0:  # else there is nothing but drives
            call_soften(head.soften, where, model, data)


@jit(**OPTIONS)
def dynamics(model: int, data: int, actuator: int) -> float:
    """Let the drive inside an actuator turn; MuJoCo's callback for the dynamics of actuators."""
    where = _used(model)
    if where != 0:
        head = numba.carray(pointer(where), 1, HEAD)[0]
        i = numba.carray(pointer(head.of_actuators), actuator + 1, np.int64)[actuator]
        if i >= 0:
            places = numba.carray(pointer(head.drives), head.n_drives, drive_loop.PLACE)
            drive_loop.turn(head, model, data, places[i])
    return 0.0


@jit(**OPTIONS)
def _sense(head: Any, model: int, data: int) -> None:
    """Show the rotors' angles in the sensors of the model."""
    sensed = numba.carray(pointer(head.sensed), head.n_sensed, drive_loop.SENSED)
    drives = numba.carray(pointer(head.drives), head.n_drives, drive_loop.PLACE)
    for i in range(head.n_sensed):
        drive_loop.sense(head, model, data, drives[sensed[i].drive], sensed[i].address)


@jit(**OPTIONS)
def sensors(model: int, data: int, stage: int) -> None:
    """Fill in the sensors of rotors' angles; MuJoCo's callback for users' sensors."""
    where = _used(model)
    if stage == _POSITIONS and where != 0:
        _sense(numba.carray(pointer(where), 1, HEAD)[0], model, data)


@jit(**STRICT)
def turn_at(places: int) -> None:
    """Let all drives of a model turn in a user's own loop, unless `dynamics` does; places are those of `soften_at`."""
    given = numba.carray(pointer(places), 3, np.int64)
    head = numba.carray(pointer(given[0]), 1, HEAD)[0]
    if _used(given[1]) != 0:
        return
    _sense(head, given[1], given[2])
    drives = numba.carray(pointer(head.drives), head.n_drives, drive_loop.PLACE)
    for i in range(head.n_drives):
        drive_loop.advance(head, given[1], given[2], drives[i])


@jit(nogil=False, **OPTIONS)  # to let go of the interpreter's lock would take longer than the call
def soften_at(places: int) -> None:
    """Call `soften` with the three places at an address; one argument is passed faster than three."""
    given = numba.carray(pointer(places), 3, np.int64)
    head = numba.carray(pointer(given[0]), 1, HEAD)[0]
    call_soften(head.soften, given[0], given[1], given[2])


def as_c(function: Any, *more: Any, result: Any = types.void) -> Any:
    """Return a function of two places, and more, compiled by numba, as one of C."""
    signature = types.intp, types.intp, *more
    function.compile(signature)
    made = function.overloads[signature]
    address = made.library.get_pointer_to_function(made.fndesc.llvm_cfunc_wrapper_name)
    kinds: Any = {types.intp: ctypes.c_ssize_t, types.int32: ctypes.c_int32, types.float64: ctypes.c_double}
    return ctypes.CFUNCTYPE(kinds.get(result), *(kinds[kind] for kind in signature))(address)


@jit(**OPTIONS)
def _pull(head: Any, model: int, data: int, first: int, size: int, force: float, passive: np.ndarray) -> None:
    """Let a force resist a tendon's lengthening."""
    row = doubles(field(data + head.d_ten_J) + 8 * first, size)
    columns = integers(field(model + head.m_ten_J_colind) + 4 * first, size)
    for i in range(size):
        passive[columns[i]] -= row[i] * force
