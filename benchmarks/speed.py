"""The benchmarks: what is run against what, and how the two times make a figure."""

import copy
import os
import statistics
from concurrent.futures import ThreadPoolExecutor

import mujoco
from tqdm import tqdm

import clearance_mj as cm
from clearance_mj.core.jit import jit
from clearance_mj.engines import mujoco_step
from clearance_mj.engines.base import step_factor
from clearance_mj.engines.links_plant import links_plant
from clearance_mj.signals.sampling import interpolate

from .case import timed

RIG = cm.Rig.load("models/table1_rig.toml")
LAW = cm.ConstantLaw([2e4, 2e4], [3.0, 3.0])
SECONDS = 4.0
STEADY = {0.1: 0.003, 4.0: 0.12}
"""Constant base acceleration, m/s², that keeps the shaft moving without contact, or in contact"""
REPEATS, CASES = 5, 8


def measure():
    """Return the rows, each the median of pairs of runs."""
    rows = []
    for name, a, b, combine, unit, target in tqdm(list(_benchmarks()), desc="speed", unit="pair"):
        pairs = [(timed(a, 1)[0], timed(b, 1)[0]) for _ in range(REPEATS + 1)][1:]  # the first compiles and warms up
        values = [combine(*pair) for pair in pairs]
        middle = [statistics.median(t) for t in zip(*pairs)]
        row = {"name": name, "a_seconds": middle[0], "b_seconds": middle[1], "unit": unit, "target": target}
        rows.append(row | {"median": statistics.median(values), "low": min(values), "high": max(values)})
    return rows


def _benchmarks():
    """Rows of (name, run A, run B, figure from their times, unit, target)."""
    for level, state in ((0.1, "no contact"), (4.0, "in contact")):
        excitation, target = _excitation(level), "<= 1.25"
        raw, run = _raw_loop(STEADY[level]), _simulate(excitation, "links")
        yield f"links single / raw mj_step(nstep), {state}", run, raw, _ratio, "x", target
        bare = driven_loop(RIG, LAW, cm.Links(), excitation)
        yield f"links single / mj_step driven alike, {state}", run, bare, _ratio, "x", target
        batch = _batch(excitation)
        for name, loop in (("raw loops", raw), ("driven alike", bare)):
            name = f"links batch / {name}, both on all cores, {state}"
            yield name, batch, _on_all_cores(loop), _ratio, "x", "<= 1.10"
    excitation = _excitation(4.0)
    for engine, target in (("links", ">= 4"), ("modal", ">= 100")):
        yield f"{engine}: times real time", _simulate(excitation, engine), _nothing, _real_time, "x", target
    two, one = (_batch(excitation, workers) for workers in (2, 1))
    yield f"links batch of {CASES}: two threads against one", two, one, _speed_up, "x", ""


def _excitation(level):
    return cm.excitation.random(SECONDS, 2048.0, band=(5, 220), rms=level, seed=1, kind="base")


def _simulate(excitation, engine):
    return lambda: cm.simulate(RIG, excitation, LAW, engine=engine)


def _batch(excitation, workers=None):
    return lambda: cm.simulate_batch(RIG, [excitation] * CASES, LAW, engine="links", workers=workers)


def _model(rig, law, engine):
    """A model of links with its step and constant softness, and its steps per sample."""
    plant = links_plant(rig, engine.links)
    factor = step_factor(2048.0, engine.largest_step(rig, law))
    model = copy.copy(plant.model)
    model.opt.timestep = step = 1 / (2048.0 * factor)
    model.dof_armature[:] = plant.armature * step**2 * model.jnt_stiffness
    model.pair_solref[:] = cm.physical.SOLREF_PER_UNIT * law.k[0] / 2, cm.physical.SOLREF_PER_UNIT * law.c[0] / 2
    return model, factor


def _raw_loop(acceleration):
    """The model of links stepped by mj_step(nstep) alone, nothing updated, under a constant acceleration."""
    model, factor = _model(RIG, LAW, cm.Links())
    model.opt.gravity[2] = -acceleration
    steps = round(SECONDS * 2048 * factor)
    return lambda: mujoco.mj_step(model, mujoco.MjData(model), nstep=steps)


def driven_loop(rig, law, engine, excitation):
    """A compiled loop of mj_step that writes only the base acceleration: the same motion, nothing else updated."""
    model, factor = _model(rig, law, engine)
    drive = interpolate(excitation.value, factor)

    def run():
        model_copy = copy.copy(model)  # a loop writes the gravity of its model
        data = mujoco.MjData(model_copy)
        _drive(model_copy._address, data._address, model_copy.opt.gravity, drive)

    return run


@jit
def _drive(model, data, gravity, drive):
    for a in drive:
        gravity[2] = -a
        mujoco_step.mj_step(model, data)


def _nothing():
    return None


def _ratio(a, b):
    return a / b


def _on_all_cores(loop):
    """As many loops as a batch has cases, on as many threads; neither kind of loop holds the interpreter lock."""

    def run():
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(lambda _: loop(), range(CASES)))

    return run


def _real_time(a, b):
    return SECONDS / a


def _speed_up(a, b):
    return b / a
