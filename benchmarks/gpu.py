"""A quadruped on a GPU: steps a second, what friction and drives cost there, and how far it is from the CPU.

``python -m benchmarks.gpu [ENVIRONMENTS ...] [--engine mjx|warp]``, by default 1, 64, 4096 and 16384 in MJX, in an
environment with the extra of that name. The robot is like Unitree's Go1: 12 joints with position servos, four feet.
Costs are over the engine's own step of the same robot with rigid drives, once with the same rows of contact that only
press, once with MuJoCo's friction; of runs in turn. On a CPU only small counts end soon.
"""

import argparse
import importlib
import statistics
import time
import warnings

import mujoco
import numpy as np

from clearance_mj import physical

STEPS, ROUNDS, COMPARED = 50, 7, 200
GAP, TEETH, K, C, MU = 5e-3, (600.0, 1.0), 2e4, 150.0, 0.6  # rad; N m/rad, N m s/rad; N/m, N s/m
STANDING = np.array([0.0, 0.9, -1.8])  # rad, of each leg


def robot(form):
    """Return a model: "physical", or without friction and drives "pressing", or with MuJoCo's friction "mujoco"."""
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.integrator = 1e-3, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.iterations, spec.option.ls_iterations = 4, 8
    floor = {"contype": 0, "conaffinity": 0, "condim": 3 if form == "mujoco" else 1}
    spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[5, 5, 1], **floor)
    trunk = spec.worldbody.add_body(name="trunk", pos=[0, 0, 0.284])
    trunk.add_freejoint()
    trunk.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.19, 0.05, 0.06], mass=5.2, contype=0, conaffinity=0)
    feet = [_leg(spec, trunk, name, place, form) for name, place in PLACES.items()]
    for foot in feet:
        physical.contact(spec, (foot, "floor"), k=K, c=C, frictionless=True)
        if form == "physical":
            physical.friction(spec, (foot, "floor"), MU, 2e4, 60)
        elif form == "mujoco":
            pair = next(pair for pair in spec.pairs if foot in (pair.geomname1, pair.geomname2))
            pair.condim, pair.friction = 3, [MU, MU, 0, 0, 0]
    if form == "physical":
        friction = physical.DriveFriction(2000.0, 1.0, 0.1, 0.02, physical.Efficiency(0.9, 0.85))
        for actuator in list(spec.actuators):
            physical.add_drive(spec, actuator, GAP, *TEETH, friction=friction)
    return physical.compile(spec)


PLACES = {"FR": (0.188, -0.047), "FL": (0.188, 0.047), "RR": (-0.188, -0.047), "RL": (-0.188, 0.047)}


def _leg(spec, trunk, name, place, form):
    """Add a leg and its servos; return its foot's name."""
    side = np.sign(place[1])
    body, at = trunk, [*place, 0.0]
    for part, axis, mass, after in zip(
        ("hip", "thigh", "calf"), ([1, 0, 0], [0, 1, 0], [0, 1, 0]), (0.7, 1.0, 0.23),
        ([0, 0.08 * side, 0], [0, 0, -0.213], [0, 0, -0.213]),
    ):  # fmt: skip
        body = body.add_body(pos=at)
        body.add_joint(name=f"{name}_{part}", axis=axis, armature=0.01, damping=0.01)
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[0, 0, 0, *after], size=[0.02, 0, 0], mass=mass, contype=0,
            conaffinity=0,
        )  # fmt: skip
        servo = spec.add_actuator(
            name=f"{name}_{part}", target=f"{name}_{part}", trntype=mujoco.mjtTrn.mjTRN_JOINT, forcerange=[-30, 30]
        )
        servo.set_to_position(kp=60.0, kv=1.5)
        at = after
    kind = mujoco.mjtGeom.mjGEOM_SPHERE
    body.add_geom(name=name, type=kind, pos=at, size=[0.02, 0, 0], mass=0.06, contype=0, conaffinity=0)
    return name


def standing(model):
    """Return data of the robot on its feet."""
    data = mujoco.MjData(model)
    data.qpos[7:] = np.tile(STANDING, 4)
    return data


def controls(steps):
    """Return the servos' controls (steps, 12), rad: it trots on the spot."""
    swing = 0.15 * np.sin(2 * np.pi * 2e-3 * np.arange(steps)[:, None] + np.array([0, np.pi, np.pi, 0]))
    targets = STANDING + swing[..., None] * np.array([0, 1.0, -2.0])
    return targets.reshape(steps, 12).astype(np.float32)  # the same numbers on the CPU


def error(engine):
    """Return how far the trunk and the joints are from the CPU's at most, m and rad, after COMPARED steps."""
    model = robot("physical")
    data, wanted = standing(model), controls(COMPARED)
    positions = engine.positions(model, data, wanted)
    model.opt.iterations = model.opt.ls_iterations = 100  # the CPU has rows of friction, which need more of them
    expected = []
    with physical.Softener(model):
        for control in wanted:
            data.ctrl[:] = control
            mujoco.mj_step(model, data)
            expected.append(data.qpos.copy())
    away = np.abs(positions - np.array(expected)).max(axis=0)
    return away[:3].max(), away[7:].max()


def measure(counts, engine):
    """Print a line for each number of environments."""
    place, angle = error(engine)
    print(f"{engine.device()}: {COMPARED} steps end within {place:.1e} m and {angle:.1e} rad of the CPU's")
    for count in counts:
        runs = {}
        for form in ("physical", "pressing", "mujoco"):
            model = robot(form)
            runs[form] = engine.runner(model, standing(model), controls(STEPS), count, form == "physical")
        spent = {form: [] for form in runs}
        for run in runs.values():
            run()
        for _ in range(ROUNDS):
            for form, run in runs.items():
                begun = time.perf_counter()
                run()
                spent[form].append(time.perf_counter() - begun)
        seconds = spent["physical"]
        costs = [statistics.median(a / b for a, b in zip(seconds, spent[form])) for form in ("pressing", "mujoco")]
        rate = count * STEPS / statistics.median(seconds)
        print(
            f"{count} environments: {rate:.0f} steps/s, {costs[0]:.2f} times those without friction and drives, "
            f"{costs[1]:.2f} times those with MuJoCo's friction",
            flush=True,
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m benchmarks.gpu", description=__doc__)
    parser.add_argument("environments", nargs="*", type=int, default=[1, 64, 4096, 16384])
    parser.add_argument("--engine", choices=("mjx", "warp"), default="mjx")
    given = parser.parse_args()
    warnings.simplefilter("ignore", physical.ModelWarning)  # that friction and drives do not act by themselves
    measure(given.environments, importlib.import_module(f"benchmarks.gpu_{given.engine}"))
