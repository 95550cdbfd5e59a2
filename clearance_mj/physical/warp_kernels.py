"""Kernels for MuJoCo Warp: what `friction_loop` and `drive_loop` do in a step, for every world, with their formulas."""

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
    """Return a structure of Warp with fields of one kind."""
    return wp.struct(type(name, (), {"__annotations__": dict.fromkeys(names, kind), "__module__": __name__}))


def _formula(function: Any) -> Callable[..., Any]:
    """Return a formula of the compiled loops for kernels."""
    return wp.func(getattr(function, "py_func", function))


Bristles = _structure("Bristles", ("largest", "k", "c", "torsion", "rolling"), float)
Drive = _structure("Drive", DRIVE.names, float)
FrictionPlace = _structure("FrictionPlace", FRICTION.names, int)
DrivePlace = _structure("DrivePlace", drive_loop.PLACE.names, int)

_between, _bend, _bend_in_plane = map(
    _formula, (friction_loop.between, friction_loop.bend, friction_loop.bend_in_plane)
)
_accelerate, _enter, _exert, _press, _slip = map(
    _formula, (drive_loop.accelerate, drive_loop.enter, drive_loop.exert, drive_loop.press, drive_loop.slip)
)
_TINY = wp.constant(1e-30)
_Numbers = wp.types.vector(length=10, dtype=float)


@wp.kernel(enable_backward=False)
def bend_all(
    timestep: wp.array[float], time: wp.array[float], places: wp.array[FrictionPlace], numbers: wp.array2d[Bristles],
    first: int, size: int, qvel: wp.array2d[float], ten_velocity: wp.array2d[float], ten_J: wp.array2d[float],
    ten_J_colind: wp.array[int],
    memory: wp.array2d[float], passive: wp.array2d[float], heads: wp.array2d[int], steps: wp.array[float],
) -> None:  # fmt: skip
    """Begin a step of each world, and bend the bristles of its joints and tendons.

    As `softener_loop.soften`: what was remembered before the step is kept, so that the step may be asked for again.
    """
    w = wp.tid()
    again = memory[w, first] != 0.0 and time[w] == memory[w, first + 1]
    for i in range(size):
        if again:
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
        place, own, at = places[i], numbers[w % numbers.shape[0], i], first + 2 + OF_FRICTION * i
        heads[w, i] = -1
        if place.kind == JOINT:
            bent, force = _bend(own.largest, own.k, own.c, memory[w, at], steps[w], qvel[w, place.dof])
            memory[w, at] = bent
            passive[w, place.dof] -= force
        elif place.kind != PAIR:
            bent, force = _bend(own.largest, own.k, own.c, memory[w, at], steps[w], ten_velocity[w, place.geom1])
            memory[w, at] = bent
            for j in range(place.dof, place.dof + place.size):
                passive[w, ten_J_colind[j]] -= ten_J[w, j] * force


@wp.kernel(enable_backward=False)
def link(
    count: wp.array[int], worlds: wp.array[int], geoms: wp.array[wp.vec2i], rows: wp.array2d[int],
    places: wp.array[FrictionPlace], heads: wp.array2d[int], following: wp.array[int],
) -> None:  # fmt: skip
    """Chain the contacts of each world and pair: their heads, and which one follows each, -1 for none."""
    contact = wp.tid()
    if contact >= count[0] or rows[contact, 0] < 0:
        return
    for i in range(places.shape[0]):
        if places[i].kind == PAIR and _between(geoms[contact], places[i].geom1, places[i].geom2):
            following[contact] = wp.atomic_exch(heads, worlds[contact], i, contact)


@wp.func
def _in_plane(vector: wp.vec3, normal: wp.vec3) -> wp.vec3:
    return vector - wp.dot(vector, normal) * normal


@wp.func
def _velocity(motion: wp.spatial_vector, arm: wp.vec3) -> wp.vec3:
    return wp.spatial_bottom(motion) + wp.cross(wp.spatial_top(motion), arm)


@wp.kernel(enable_backward=False)
def rub_all(
    places: wp.array[FrictionPlace], numbers: wp.array2d[Bristles], first: int, steps: wp.array[float],
    heads: wp.array2d[int], following: wp.array[int], points: wp.array[wp.vec3], frames: wp.array[wp.mat33],
    geoms: wp.array[wp.vec2i], rows: wp.array2d[int], surfaces: wp.array[wp.vec3], surfaces_move: bool,
    geom_bodyid: wp.array[int], body_weldid: wp.array[int], body_rootid: wp.array[int], body_dofadr: wp.array[int],
    body_dofnum: wp.array[int], dof_parentid: wp.array[int], moves: wp.array2d[int], centres: wp.array2d[wp.vec3],
    cvel: wp.array2d[wp.spatial_vector], cdof: wp.array2d[wp.spatial_vector], accelerations: wp.array2d[float],
    is_sparse: bool, jacobian: wp.array3d[float], row_sizes: wp.array2d[int], row_starts: wp.array2d[int],
    columns: wp.array3d[int], inertias: wp.array2d[float],
    wanted: wp.array2d[float], memory: wp.array2d[float], passive: wp.array2d[float],
) -> None:  # fmt: skip
    """Bend the bristles between two geoms of a world as `friction_loop.rub` does, and exert their force."""
    w, i = wp.tid()
    if places[i].kind != PAIR:
        return
    own, at = numbers[w % numbers.shape[0], i], first + 2 + OF_FRICTION * i
    begin = heads[w, i]
    if begin < 0:
        for j in range(OF_FRICTION):
            memory[w, at + j] = 0.0
        return
    origin = points[begin]  # what is near it loses no digits in single precision
    bodies = wp.vec2i(geom_bodyid[geoms[begin][0]], geom_bodyid[geoms[begin][1]])
    spin = wp.spatial_top(cvel[w, bodies[1]]) - wp.spatial_top(cvel[w, bodies[0]])
    pressed, turning = wp.float32(0.0), wp.float32(0.0)
    centre, normal, speed, circling = wp.vec3(), wp.vec3(), wp.vec3(), wp.vec3()
    contact = begin
    while contact >= 0:
        row = rows[contact, 0]
        frame = frames[contact]
        point = points[contact]
        force = wp.max(wanted[w, row] * inertias[w, row], 0.0)
        moving = _velocity(cvel[w, bodies[1]], point - centres[w, body_rootid[bodies[1]]])
        moving -= _velocity(cvel[w, bodies[0]], point - centres[w, body_rootid[bodies[0]]])
        slip, turn = _in_plane(moving, frame[0]), wp.dot(spin, frame[0])
        if surfaces_move:
            slip += surfaces[contact][0] * frame[1] + surfaces[contact][1] * frame[2]
            turn += surfaces[contact][2]
        pressed += force
        centre += force * (point - origin)
        normal += force * frame[0]
        speed += force * slip
        circling += force * wp.cross(point - origin, slip)
        turning += force * turn
        contact = following[contact]
    per_force = 1.0 / wp.max(pressed, _TINY)
    centre, normal, speed = centre * per_force, wp.normalize(normal), speed * per_force
    arm, square = wp.float32(0.0), wp.float32(0.0)  # mean arm, m, of the points, and mean of its square
    rolls = wp.vec3()
    contact = begin
    while contact >= 0:
        row = rows[contact, 0]
        share = wp.max(wanted[w, row] * inertias[w, row], 0.0) * per_force
        away = points[contact] - origin - centre
        arm += share * wp.length(away)
        square += share * wp.length_sq(away)
        rolls += share * _in_plane(spin, frames[contact][0])
        contact = following[contact]
    turning *= per_force
    by_points = arm > own.torsion
    if by_points:
        turning = wp.dot(normal, circling * per_force - wp.cross(centre, speed)) / square
    else:
        arm = own.torsion
        square = arm * arm
    largest, rolling, step = own.largest * pressed, own.rolling / own.largest, steps[w]
    bx, by, bz, fx, fy, fz = _bend_in_plane(
        wp.vec3(memory[w, at], memory[w, at + 1], memory[w, at + 2]), largest, own.k, own.c, step, speed, normal
    )
    angle, torque = wp.float32(0.0), wp.float32(0.0)
    if square > 0.0:
        angle, torque = _bend(largest * arm, own.k * square, own.c * square, memory[w, at + 3], step, turning)
    rx, ry, rz, tx, ty, tz = _bend_in_plane(
        wp.vec3(memory[w, at + 4], memory[w, at + 5], memory[w, at + 6]), largest * rolling,
        own.k * rolling * rolling, own.c * rolling * rolling, step, rolls, normal,
    )  # fmt: skip
    memory[w, at] = bx
    memory[w, at + 1] = by
    memory[w, at + 2] = bz
    memory[w, at + 3] = angle
    memory[w, at + 4] = rx
    memory[w, at + 5] = ry
    memory[w, at + 6] = rz
    total, about = wp.vec3(), wp.vec3()
    contact = begin
    while contact >= 0:
        row = rows[contact, 0]
        frame = frames[contact]
        force = wp.max(wanted[w, row] * inertias[w, row], 0.0)
        share, away = force * per_force, points[contact] - origin - centre
        pull, twist = wp.vec3(fx, fy, fz), _in_plane(wp.vec3(tx, ty, tz), frame[0])
        if by_points:
            pull += torque / square * wp.cross(normal, away)
        else:
            twist += torque * frame[0]
        pull = _in_plane(pull, frame[0])
        total += share * pull
        about += share * (twist + wp.cross(away, pull))
        acceleration = wp.float32(0.0)  # the last step's makes up for the parasitic mass
        if is_sparse:
            for j in range(row_starts[w, row], row_starts[w, row] + row_sizes[w, row]):
                acceleration += jacobian[w, 0, j] * accelerations[w, columns[w, 0, j]]
        else:
            for j in range(accelerations.shape[1]):
                acceleration += jacobian[w, row, j] * accelerations[w, j]
        wanted[w, row] = acceleration + force / inertias[w, row]
        contact = following[contact]
    for side in range(2):
        body = body_weldid[bodies[side]]
        other = bodies[1 - side]
        couple = about + wp.cross(origin + centre - centres[w, body_rootid[body]], total)
        dof = body_dofadr[body] + body_dofnum[body] - 1
        while dof >= 0:
            if moves[other, dof] == 0:  # else it moves both
                axis = cdof[w, dof]
                force = wp.dot(wp.spatial_top(axis), couple) + wp.dot(wp.spatial_bottom(axis), total)
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
    """Write the derivative of a drive's activation, as `drive_loop.turn` does, and what its actuator exerts."""
    w, i = wp.tid()
    place, drive, h = places[i], drives[w % drives.shape[0], i], timestep[w % timestep.shape[0]]
    at, u = place.act, place.actuator
    gear = gears[w % gears.shape[0], u][0]
    load, load_speed = lengths[w, u] / gear, velocities[w, u] / gear
    begun = act[w, at + BEGUN] != 0.0
    angle = wp.where(begun, act[w, at + ANGLE], load)
    speed = wp.where(begun, act[w, at + SPEED], load_speed)
    step = wp.where(begun, h, 0.0)
    at_motor = drive.encoder == 0.0
    length = gear * wp.where(at_motor, angle, load)
    velocity = gear * wp.where(at_motor, speed, load_speed)
    entered, rate = _enter(
        drive, h, act[w, at + INPUT], ctrl[w, place.control], clamped and ctrllimited[place.control],
        ctrlrange[w % ctrlrange.shape[0], place.control], actrange[w % actrange.shape[0], u],
        dynprm[w % dynprm.shape[0], u][0],
    )  # fmt: skip
    motor, braking = _exert(
        gainprm[w % gainprm.shape[0], u], biasprm[w % biasprm.shape[0], u], forcerange[w % forcerange.shape[0], u],
        entered, length, velocity,
    )  # fmt: skip
    motor = gear * motor
    braking = wp.where(at_motor, gear * gear * braking, 0.0)
    closing = speed - load_speed
    torque = _press(drive, angle - load, closing)
    for j in range(place.slips):
        slipping = hysteresis[w % hysteresis.shape[0], i, j]
        bristle = act[w, at + BRISTLES + 1 + j]
        most = slipping[1] / slipping[0]
        bent = wp.clamp(bristle + step * closing, -most, most)
        act_dot[w, at + BRISTLES + 1 + j] = (bent - bristle) / h
        torque += slipping[0] * bent
    largest, smallest = _slip(drive, speed, motor, torque)
    bristle = act[w, at + BRISTLES]
    bent, faster = _accelerate(drive, h, bristle, step, speed, motor, braking, torque, largest, smallest)
    after = speed + h * faster
    act_dot[w, at + INPUT] = rate
    act_dot[w, at + BRISTLES] = (bent - bristle) / h
    act_dot[w, at + SPEED] = (after - act[w, at + SPEED]) / h
    act_dot[w, at + ANGLE] = (angle + h * after - act[w, at + ANGLE]) / h
    act_dot[w, at + BEGUN] = (1.0 - act[w, at + BEGUN]) / h
    act_dot[w, at + MOTOR_TORQUE] = (motor - braking * (after - speed) - act[w, at + MOTOR_TORQUE]) / h
    act_dot[w, at + place.size - 1] = (torque / gear - act[w, at + place.size - 1]) / h
    forces[w, u] = torque / gear
