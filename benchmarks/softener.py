"""Laws that MuJoCo models follow at every step: what a Softener costs over mj_step, and 64 environments on two threads.

Every limit of a model, and every contact with its floor, has constant stiffness and damping, given to MuJoCo once or as
a law: the motion is the same, pairs are driven alike. Models of gymnasium where it is installed, and the gallery's arm.
Costs are of the processor's time, of runs in turn; threads of the wall clock's.
"""

import time
import warnings
from pathlib import Path

import mujoco
import mujoco.batch
import numpy as np

from clearance_mj import physical
from clearance_mj.clearance import ConstantLaw
from clearance_mj.physical.elements import requested_softness
from experiments.physical.model_rows import load, path_of

from .case import row

FOREIGN = ("humanoid", "ant", "half_cheetah", "hopper")
STEPS, ROUNDS, ENVIRONMENTS = 4000, 15, 64
MOTION = 1e-4  # largest difference of the coordinates after so many steps


def measure():
    """Return rows as of `periodic`, and which models are not there."""
    rows, skipped = [], {}
    for name in FOREIGN:
        label = f"gymnasium {name}"
        if path_of(label):
            rows += _of(label, load(label), "floor")
        else:
            skipped[label] = "not installed (make test-models)"
    arm = mujoco.MjSpec.from_file(str(Path("models/robot_arm.xml")))
    for joint in ("roll", "pitch", "spin"):
        physical.add_backlash(arm, joint, 2e-3, 3000.0, 0.1)
    rows += _of("gallery's arm", arm, None)
    return {"rows": rows, "skipped": skipped}


def _of(name, spec, floor):
    spec.option.integrator, spec.option.timestep = mujoco.mjtIntegrator.mjINT_EULER, 1e-4
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        constant, following = (_model(spec.copy(), floor, law) for law in (False, True))
    softener = physical.Softener(following)
    motion = _march(constant)[1]
    with softener:
        apart = np.max(np.abs(_march(following)[1] - motion))
    assert apart < MOTION, f"{name}: motions differ by {apart:g}"
    costs = {"mj_step": [], "update": [], "threads": []}
    for _ in range(ROUNDS):
        plain = _march(constant)[0]
        with softener:
            costs["mj_step"].append(100 * (_march(following)[0] / plain - 1))
        loop_alone = _loop(constant, None)
        costs["update"].append(100 * (_loop(following, softener) / loop_alone - 1))
    with softener:
        times = [[_batch(following, threads) for threads in (1, 2)] for _ in range(5)]
    costs["threads"] = [one / two for one, two in times]
    n = len(list(requested_softness(following)))
    microseconds = f"{n} elements, {1e6 * plain / STEPS:.1f} µs a step"
    return [
        row(f"{name} ({microseconds}): cost over mj_step", costs["mj_step"], "%", "<= 5"),
        row(f"{name}: cost of update() in a Python loop", costs["update"], "%", "<= 5"),
        row(f"{name}: {ENVIRONMENTS} environments, speed-up by two threads", costs["threads"], "x", ">= 1.7"),
    ]


def _model(spec, floor, law):
    model = spec.compile()
    for i in range(model.njnt):
        if model.jnt_limited[i]:
            physical.joint_limit(spec, model.joint(i).name, **_soft(300.0, 1.0, law))
    for i in range(model.ntendon):
        if model.tendon_limited[i]:
            physical.tendon_limit(spec, model.tendon(i).name, **_soft(3000.0, 0.1, law))
    if floor:
        physical.contact(spec, floor, frictionless=True, **_soft(3e4, 30.0, law))
    return physical.compile(spec)


def _soft(k, c, law):
    return {"law": ConstantLaw(k, c)} if law else {"k": k, "c": c}


def _begin(model):
    data = mujoco.MjData(model)
    data.qvel[:], data.ctrl[:] = 1.0, 0.1
    return data


def _march(model):
    data, begun = _begin(model), time.process_time()
    mujoco.mj_step(model, data, STEPS)
    return time.process_time() - begun, data.qpos.copy()


def _loop(model, softener):
    data, begun = _begin(model), time.process_time()
    first, second = mujoco.mj_step1, mujoco.mj_step2
    if softener is None:
        for _ in range(STEPS):
            first(model, data)
            second(model, data)
    else:
        update = softener.update
        for _ in range(STEPS):
            first(model, data)
            update(model, data)
            second(model, data)
    return time.process_time() - begun


def _batch(model, threads):
    batch = mujoco.batch.Batch(model, ENVIRONMENTS, threads)
    batch.qvel[:], batch.ctrl[:] = 0.02 * np.arange(ENVIRONMENTS)[:, None], 0.1
    begun = time.perf_counter()
    batch.step(nstep=STEPS // 2)
    return time.perf_counter() - begun
