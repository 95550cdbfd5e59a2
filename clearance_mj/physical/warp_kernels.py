"""Kernels for MuJoCo Warp: the step of `friction_loop` and `drive_loop`, for every world, with the same formulas."""

from collections.abc import Callable
from typing import Any

from . import drive_loop, friction_loop
from .drives import ANGLE, BEGUN, BRISTLES, DRIVE, INPUT, MOTOR_TORQUE, SPEED
from .friction_loop import FRICTION, OF_FRICTION
from .packages import naming_package
from .softener_loop import JOINT, PAIR

with naming_package("kernels for MuJoCo Warp", "clearance-mj[warp]"):
    import warp as wp

__all__ = ["Bristles", "Drive", "DrivePlace", "FrictionPlace", "bend_all", "link", "rub_all", "turn_all"]


def _structure(name: str, names: Any, kind: type) -> Any:
    """Return a Warp structure with fields of one type."""
    return wp.struct(type(name, (), {"__annotations__": dict.fromkeys(names, kind), "__module__": __name__}))


def _formula(function: Any) -> Callable[..., Any]:
    """Return a function of the compiled loops as a Warp function."""
    return wp.func(getattr(function, "py_func", function))


Bristles = _structure("Bristles", ("largest", "k", "c", "torsion", "rolling"), float)
Drive = _structure("Drive", DRIVE.names, float)
FrictionPlace = _structure("FrictionPlace", FRICTION.names, int)
DrivePlace = _structure("DrivePlace", drive_loop.PLACE.names, int)

_between, _bend, _bend_in_plane = map(
    _formula, (friction_loop.is_between, friction_loop.advance_bristle, friction_loop.bend_in_plane)
)
_accelerate, _enter, _exert, _press, _slip = map(_formula, (
    drive_loop.accelerate, drive_loop.filter_control, drive_loop.motor_force, drive_loop.teeth_torque, drive_loop.slip,
))  # fmt: skip
_TINY = wp.constant(1e-30)
_Numbers = wp.types.vector(length=10, dtype=float)


@wp.kernel(enable_backward=False)
def bend_all(
    timestep: wp.array[float], time: wp.array[float], places: wp.array[FrictionPlace], numbers: wp.array2d[Bristles],
    first: int, size: int, qvel: wp.array2d[float], ten_velocity: wp.array2d[float], ten_J: wp.array2d[float],
    ten_J_colind: wp.array[int],
    memory: wp.array2d[float], passive: wp.array2d[float], heads: wp.array2d[int], steps: wp.array[float],
) -> None:  # fmt: skip
    """Begin a step of each world, and advance the bristles of its joints and tendons.

    As `softener_loop.soften`: the memory before the step is saved, so that the step may be repeated.
    """
    w = wp.tid()
    repeated = memory[w, first] != 0.0 and time[w] == memory[w, first + 1]
    for i in range(size):
        if repeated:
            memory[w, first + i] = memory[w, first + size + i]
        else:
            memory[w, first + size + i] = memory[w, first + i]
    step = timestep[w % timestep.shape[0]]
    if memory[w, first] == 0.0 or time[w] < memory[w, first + 1]:
        for i in range(2, size):
            memory[w, first + i] = 0.0
        steps[w] = 0.0
    else:
        steps[w] = step
    memory[w, first] = step
    memory[w, first + 1] = time[w]
    for i in range(places.shape[0]):
        place, p, adr = places[i], numbers[w % numbers.shape[0], i], first + 2 + OF_FRICTION * i
        heads[w, i] = -1
        if place.kind == JOINT:
            bristle, force = _bend(p.largest, p.k, p.c, memory[w, adr], steps[w], qvel[w, place.dof])
            memory[w, adr] = bristle
            passive[w, place.dof] -= force
        elif place.kind != PAIR:
            bristle, force = _bend(p.largest, p.k, p.c, memory[w, adr], steps[w], ten_velocity[w, place.geom1])
            memory[w, adr] = bristle
            for j in range(place.dof, place.dof + place.size):
                passive[w, ten_J_colind[j]] -= ten_J[w, j] * force


@wp.kernel(enable_backward=False)
def link(
    count: wp.array[int], worlds: wp.array[int], geoms: wp.array[wp.vec2i], rows: wp.array2d[int],
    places: wp.array[FrictionPlace], heads: wp.array2d[int], next_contact: wp.array[int],
) -> None:  # fmt: skip
    """Build linked lists of the contacts of each world and pair: their heads and successors, -1 for none."""
    contact = wp.tid()
    if contact >= count[0] or rows[contact, 0] < 0:
        return
    for i in range(places.shape[0]):
        if places[i].kind == PAIR and _between(geoms[contact], places[i].geom1, places[i].geom2):
            next_contact[contact] = wp.atomic_exch(heads, worlds[contact], i, contact)


@wp.func
def _tangential(vector: wp.vec3, normal: wp.vec3) -> wp.vec3:
    return vector - wp.dot(vector, normal) * normal


@wp.func
def _velocity(motion: wp.spatial_vector, arm: wp.vec3) -> wp.vec3:
    return wp.spatial_bottom(motion) + wp.cross(wp.spatial_top(motion), arm)


@wp.kernel(enable_backward=False)
def rub_all(
    places: wp.array[FrictionPlace], numbers: wp.array2d[Bristles], first: int, steps: wp.array[float],
    heads: wp.array2d[int], next_contact: wp.array[int], points: wp.array[wp.vec3], frames: wp.array[wp.mat33],
    geoms: wp.array[wp.vec2i], rows: wp.array2d[int], surfaces: wp.array[wp.vec3], surfaces_move: bool,
    geom_bodyid: wp.array[int], body_weldid: wp.array[int], body_rootid: wp.array[int], body_dofadr: wp.array[int],
    body_dofnum: wp.array[int], dof_parentid: wp.array[int], moves: wp.array2d[int], centres: wp.array2d[wp.vec3],
    cvel: wp.array2d[wp.spatial_vector], cdof: wp.array2d[wp.spatial_vector], accelerations: wp.array2d[float],
    is_sparse: bool, jacobian: wp.array3d[float], row_sizes: wp.array2d[int], row_starts: wp.array2d[int],
    columns: wp.array3d[int], inertias: wp.array2d[float],
    reference: wp.array2d[float], memory: wp.array2d[float], passive: wp.array2d[float],
) -> None:  # fmt: skip
    """Advance the bristles between two geoms of a world as `friction_loop.rub` does, and exert their force."""
    w, i = wp.tid()
    if places[i].kind != PAIR:
        return
    p, adr = numbers[w % numbers.shape[0], i], first + 2 + OF_FRICTION * i
    first_contact = heads[w, i]
    if first_contact < 0:
        for j in range(OF_FRICTION):
            memory[w, adr + j] = 0.0
        return
    origin = points[first_contact]  # offsets from it lose no digits in single precision
    bodies = wp.vec2i(geom_bodyid[geoms[first_contact][0]], geom_bodyid[geoms[first_contact][1]])
    spin = wp.spatial_top(cvel[w, bodies[1]]) - wp.spatial_top(cvel[w, bodies[0]])
    total_force, spin_rate = wp.float32(0.0), wp.float32(0.0)
    centre, normal, speed, orbit = wp.vec3(), wp.vec3(), wp.vec3(), wp.vec3()
    contact = first_contact
    while contact >= 0:
        row = rows[contact, 0]
        frame = frames[contact]
        point = points[contact]
        force = wp.max(reference[w, row] * inertias[w, row], 0.0)
        velocity = _velocity(cvel[w, bodies[1]], point - centres[w, body_rootid[bodies[1]]])
        velocity -= _velocity(cvel[w, bodies[0]], point - centres[w, body_rootid[bodies[0]]])
        slip, turn = _tangential(velocity, frame[0]), wp.dot(spin, frame[0])
        if surfaces_move:
            slip += surfaces[contact][0] * frame[1] + surfaces[contact][1] * frame[2]
            turn += surfaces[contact][2]
        total_force += force
        centre += force * (point - origin)
        normal += force * frame[0]
        speed += force * slip
        orbit += force * wp.cross(point - origin, slip)
        spin_rate += force * turn
        contact = next_contact[contact]
    per_force = 1.0 / wp.max(total_force, _TINY)
    centre, normal, speed = centre * per_force, wp.normalize(normal), speed * per_force
    arm, square = wp.float32(0.0), wp.float32(0.0)  # means over points: arm, m, and its square
    rolls = wp.vec3()
    contact = first_contact
    while contact >= 0:
        row = rows[contact, 0]
        weight = wp.max(reference[w, row] * inertias[w, row], 0.0) * per_force
        offset = points[contact] - origin - centre
        arm += weight * wp.length(offset)
        square += weight * wp.length_sq(offset)
        rolls += weight * _tangential(spin, frames[contact][0])
        contact = next_contact[contact]
    spin_rate *= per_force
    by_points = arm > p.torsion
    if by_points:
        spin_rate = wp.dot(normal, orbit * per_force - wp.cross(centre, speed)) / square
    else:
        arm = p.torsion
        square = arm * arm
    largest, rolling, step = p.largest * total_force, p.rolling / p.largest, steps[w]
    bx, by, bz, fx, fy, fz = _bend_in_plane(
        wp.vec3(memory[w, adr], memory[w, adr + 1], memory[w, adr + 2]), largest, p.k, p.c, step, speed, normal
    )
    angle, torque = wp.float32(0.0), wp.float32(0.0)
    if square > 0.0:
        angle, torque = _bend(largest * arm, p.k * square, p.c * square, memory[w, adr + 3], step, spin_rate)
    rx, ry, rz, tx, ty, tz = _bend_in_plane(
        wp.vec3(memory[w, adr + 4], memory[w, adr + 5], memory[w, adr + 6]), largest * rolling,
        p.k * rolling * rolling, p.c * rolling * rolling, step, rolls, normal,
    )  # fmt: skip
    memory[w, adr] = bx
    memory[w, adr + 1] = by
    memory[w, adr + 2] = bz
    memory[w, adr + 3] = angle
    memory[w, adr + 4] = rx
    memory[w, adr + 5] = ry
    memory[w, adr + 6] = rz
    resultant, moment = wp.vec3(), wp.vec3()
    contact = first_contact
    while contact >= 0:
        row = rows[contact, 0]
        frame = frames[contact]
        force = wp.max(reference[w, row] * inertias[w, row], 0.0)
        weight, offset = force * per_force, points[contact] - origin - centre
        pull, twist = wp.vec3(fx, fy, fz), _tangential(wp.vec3(tx, ty, tz), frame[0])
        if by_points:
            pull += torque / square * wp.cross(normal, offset)
        else:
            twist += torque * frame[0]
        pull = _tangential(pull, frame[0])
        resultant += weight * pull
        moment += weight * (twist + wp.cross(offset, pull))
        acceleration = wp.float32(0.0)  # of the last step, compensates the parasitic mass
        if is_sparse:
            for j in range(row_starts[w, row], row_starts[w, row] + row_sizes[w, row]):
                acceleration += jacobian[w, 0, j] * accelerations[w, columns[w, 0, j]]
        else:
            for j in range(accelerations.shape[1]):
                acceleration += jacobian[w, row, j] * accelerations[w, j]
        reference[w, row] = acceleration + force / inertias[w, row]
        contact = next_contact[contact]
    for side in range(2):
        body = body_weldid[bodies[side]]
        other = bodies[1 - side]
        couple = moment + wp.cross(origin + centre - centres[w, body_rootid[body]], resultant)
        dof = body_dofadr[body] + body_dofnum[body] - 1
        while dof >= 0:
            if moves[other, dof] == 0:  # not a dof of both bodies
                axis = cdof[w, dof]
                force = wp.dot(wp.spatial_top(axis), couple) + wp.dot(wp.spatial_bottom(axis), resultant)
                wp.atomic_add(passive, w, dof, float(1 - 2 * side) * force)
            dof = dof_parentid[dof]


@wp.kernel(enable_backward=False)
def turn_all(
    timestep: wp.array[float], places: wp.array[DrivePlace], drives: wp.array2d[Drive],
    hysteresis: wp.array3d[wp.vec2], clamped: bool, gears: wp.array2d[wp.spatial_vector],
    ctrllimited: wp.array[bool], ctrlrange: wp.array2d[wp.vec2], actrange: wp.array2d[wp.vec2],
    dynprm: wp.array2d[_Numbers], gainprm: wp.array2d[_Numbers], biasprm: wp.array2d[_Numbers],
    forcerange: wp.array2d[wp.vec2], act: wp.array2d[float], ctrl: wp.array2d[float], lengths: wp.array2d[float],
    velocities: wp.array2d[float],
    act_dot: wp.array2d[float], forces: wp.array2d[float],
) -> None:  # fmt: skip
    """Write the derivative of a drive's activation, as `drive_loop.turn` does, and its actuator's force."""
    w, i = wp.tid()
    place, drive, h = places[i], drives[w % drives.shape[0], i], timestep[w % timestep.shape[0]]
    adr, u = place.act, place.actuator
    gear = gears[w % gears.shape[0], u][0]
    load, load_speed = lengths[w, u] / gear, velocities[w, u] / gear
    begun = act[w, adr + BEGUN] != 0.0
    angle = wp.where(begun, act[w, adr + ANGLE], load)
    speed = wp.where(begun, act[w, adr + SPEED], load_speed)
    step = wp.where(begun, h, 0.0)
    at_motor = drive.encoder == 0.0
    length = gear * wp.where(at_motor, angle, load)
    velocity = gear * wp.where(at_motor, speed, load_speed)
    gain_input, rate = _enter(
        drive, h, act[w, adr + INPUT], ctrl[w, place.control], clamped and ctrllimited[place.control],
        ctrlrange[w % ctrlrange.shape[0], place.control], actrange[w % actrange.shape[0], u],
        dynprm[w % dynprm.shape[0], u][0],
    )  # fmt: skip
    motor, braking = _exert(
        gainprm[w % gainprm.shape[0], u], biasprm[w % biasprm.shape[0], u], forcerange[w % forcerange.shape[0], u],
        gain_input, length, velocity,
    )  # fmt: skip
    motor = gear * motor
    braking = wp.where(at_motor, gear * gear * braking, 0.0)
    closing = speed - load_speed
    torque = _press(drive, angle - load, closing)
    for j in range(place.slips):
        element = hysteresis[w % hysteresis.shape[0], i, j]
        bristle = act[w, adr + BRISTLES + 1 + j]
        slip = element[1] / element[0]
        deflection = wp.clamp(bristle + step * closing, -slip, slip)
        act_dot[w, adr + BRISTLES + 1 + j] = (deflection - bristle) / h
        torque += element[0] * deflection
    largest, smallest = _slip(drive, speed, motor, torque)
    bristle = act[w, adr + BRISTLES]
    deflection, acceleration = _accelerate(drive, h, bristle, step, speed, motor, braking, torque, largest, smallest)
    new_speed = speed + h * acceleration
    act_dot[w, adr + INPUT] = rate
    act_dot[w, adr + BRISTLES] = (deflection - bristle) / h
    act_dot[w, adr + SPEED] = (new_speed - act[w, adr + SPEED]) / h
    act_dot[w, adr + ANGLE] = (angle + h * new_speed - act[w, adr + ANGLE]) / h
    act_dot[w, adr + BEGUN] = (1.0 - act[w, adr + BEGUN]) / h
    act_dot[w, adr + MOTOR_TORQUE] = (motor - braking * (new_speed - speed) - act[w, adr + MOTOR_TORQUE]) / h
    act_dot[w, adr + place.size - 1] = (torque / gear - act[w, adr + place.size - 1]) / h
    forces[w, u] = torque / gear
