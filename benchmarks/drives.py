"""Play of drives: inside the actuators, and between two joints, over the same chain of links without play.

Between two joints teeth are rows of the solver's, or MuJoCo's own dead band, a tendon with a spring (``native=True``).

Links on hinges in a row, each with a position servo, 1 to 30 of them. Costs are of the processor's time over mj_step of
the chain without play, of runs in turn: free, at rest in the middle of the play without weight or servo, and engaged,
servos that hold their links against gravity. 64 environments are stepped by ``mujoco.batch``.
"""

import contextlib
import functools
import statistics
import time

import mujoco
import mujoco.batch
import numpy as np

from clearance_mj import physical

from .case import row

JOINTS = 1, 2, 5, 10, 20, 30
STEPS, ROUNDS, ENVIRONMENTS = 4000, 15, 64
GAP, K, C = 2e-3, 3000.0, 0.5  # rad, N m/rad, N m s/rad
FORMS = {
    "actuator": "play in the actuators",
    "joint": "play between two joints each",
    "native": "dead band between two joints each",
}


def measure():
    """Return rows as of `periodic`."""
    rows, series = [], {}
    for joints in JOINTS:
        plain_model, models = _chain(joints, "none"), {form: _chain(joints, form) for form in FORMS}
        softener = physical.Softener(models["actuator"])
        for state, gain in (("free", 0.0), ("engaged", 1.0)):
            costs, plain = _costs(plain_model, models, softener, functools.partial(_march, gain=gain))
            for form, ratios in costs.items():
                series.setdefault(f"{form} {state}", []).append(statistics.median(ratios))
            rows += _rows(f"{joints}, {state} ({1e6 * plain / STEPS:.1f} µs a step without play)", costs)
        if joints in (1, 10, 30):
            costs, _ = _costs(plain_model, models, softener, _batch)
            rows += _rows(f"{joints}, {ENVIRONMENTS} environments", costs)
    return {"rows": rows, "joints": JOINTS, "series": series, "skipped": {}}


def _costs(plain_model, models, softener, run):
    """Return the times of models over that without play, by form, of runs in turn, and the last of that."""
    costs = {form: [] for form in models}
    for _ in range(ROUNDS):
        plain = run(plain_model)
        for form, model in models.items():
            with softener if form == "actuator" else contextlib.nullcontext():
                costs[form].append(run(model) / plain)
    return costs, plain


def _rows(begin, costs):
    targets = {"actuator": "<= 1.2"}
    return [row(f"{begin}: {FORMS[form]}", ratios, "x", targets.get(form, "")) for form, ratios in costs.items()]


def _chain(joints, form):
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.integrator = 1e-4, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    parent, length = spec.worldbody, 0.2
    for i in range(joints):
        parent = parent.add_body(pos=[length if i else 0, 0, 0])
        parent.add_joint(name=f"joint {i}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, i % 2, 1 - i % 2], armature=0.02)
        parent.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[0, 0, 0, length, 0, 0], size=[0.02, 0, 0])
        servo = spec.add_actuator(name=f"servo {i}", target=f"joint {i}", trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.set_to_position(kp=200.0, kv=5.0)
    for i in range(joints):
        if form == "actuator":
            physical.add_drive(spec, f"servo {i}", GAP, K, C)
        elif form != "none":
            physical.add_backlash(spec, f"joint {i}", GAP, K, C, native=form == "native")
    return physical.compile(spec)


def _march(model, gain):
    model.actuator_gainprm[:, 0], model.actuator_biasprm[:, 1:3] = 200.0 * gain, np.array((-200.0, -5.0)) * gain
    model.opt.gravity[2] = -9.81 * gain
    data = mujoco.MjData(model)
    begun = time.process_time()
    mujoco.mj_step(model, data, STEPS)
    spent = time.process_time() - begun
    assert np.isfinite(data.qpos).all() and data.time > (STEPS - 1) * model.opt.timestep
    return spent


def _batch(model):
    batch = mujoco.batch.Batch(model, ENVIRONMENTS, 2)
    batch.ctrl[:] = 0.1
    begun = time.perf_counter()
    batch.step(nstep=STEPS // 8)
    return time.perf_counter() - begun
