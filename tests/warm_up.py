"""Compile what the tests call, on every core, before their workers start: ``python -m tests.warm_up``.

Each task calls the package as its users do, so that numba keeps the machine code; what is there already is loaded, and
a second run takes seconds. Whatever a task does not reach is compiled by the test that needs it first.
"""

import dataclasses
import multiprocessing
import os
import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np

import clearance_mj as cm
from clearance_mj import periodic
from clearance_mj.engines import Modal, simulate_together
from clearance_mj.rig import Grease, OilFilm, Spin, Unbalance
from clearance_mj.wear.marched import Marching

from . import processes
from .conftest import TABLE1

SPACE = TABLE1.with_shape("round")
NOISE = cm.excitation.random(0.05, 2048.0, band=(5, 220), rms=6.0, seed=3)
MODEL = cm.Model(TABLE1)
FEW = {"n_harmonics": 3}


def assertions():
    """Let pytest rewrite the asserts of all files once, instead of every worker."""
    processes.run("-m", "pytest", "--collect-only", "-q", "-q", "tests", patience=600)


def modal():
    cm.simulate(TABLE1, NOISE, engine="modal")
    march(TABLE1)


def march(rig):
    rubs = dataclasses.replace(rig.bushings[0], wear=1e-15, radius=5e-3)
    model, engine = cm.Model(rig.replace(bushings=(rubs,))), Modal()
    run = Marching(model, engine, "base", engine.largest_step(model.rig, model.law), None)
    run.advance(np.zeros(4))


def modal_lanes():
    for count in (3, 5):
        simulate_together([(TABLE1, MODEL.law)] * count, NOISE)
    periodic.follow_response(MODEL, 6.0, (45.0, 46.0), 5)


def modal_space():
    cm.simulate(SPACE, NOISE, engine="modal")
    march(SPACE)


def lanes_in_space():
    simulate_together([(SPACE, cm.Model(SPACE).law)] * 3, NOISE)


def links():
    for rig, engine in ((TABLE1, "links"), (SPACE, "links")):
        cm.simulate(rig, NOISE, engine=engine)
    for rig in (TABLE1, SPACE):
        cm.energy_balance(rig, NOISE, engine="modal")


def branches_over_level():
    scatter = cm.tolerance.Scatter((cm.tolerance.Scattered("bushings.gap", std="8 %"),))
    for limit in (None, "contact_force > 3 N"):
        sines = cm.tolerance.Sines([1.0, 6.0], [11.0], limit)
        cm.tolerance.production(MODEL, scatter, sines, 2, runner=cm.tolerance.Runner(1))


def periodic_in_space():
    oil = {"film": OilFilm(0.02, 1e-6, width="finite"), "radius": 5e-3, "grease": Grease(0.0, 0.0)}
    film = dataclasses.replace(SPACE.bushings[0], **oil)
    turning = SPACE.replace(spin=Spin(100.0), unbalances=(Unbalance(1.0, 1e-5),), bushings=(film,))
    periodic.follow_unbalance(cm.Model(turning), (15.0, 15.2), **FEW)
    periodic.map_rattle(cm.Model(SPACE), (0.5, 1.0), [20.0, 20.2], workers=1, **FEW)


def benches():
    from experiments.benches.bench import make_bench
    from experiments.benches.records import shake

    shake(make_bench(1), np.zeros(64))


def benches_in_space():
    from experiments.benches.space.bench import make_bench
    from experiments.benches.space.records import simulate

    simulate(make_bench(1), size=64)


def virtual_rig():
    from experiments.testrig import Truth, simulate_rig

    simulate_rig(TABLE1, Truth(), NOISE, 1)


def vehicles():
    from clearance_mj.vehicle.experiment import Case, run_case
    from experiments.drives.virtual import Gear

    run_case(Case("smc-cm", 72.0, sensors="car"))
    Gear.drawn(3).run("free", 1.0, 1)


def softening():
    import mujoco

    from clearance_mj import physical

    spec = mujoco.MjSpec.from_string(
        "<mujoco><worldbody><body><joint name='a' type='slide' range='0 1' damping='1'/><geom size='.1' mass='2'/>"
        "</body></worldbody><actuator><motor name='m' joint='a'/></actuator></mujoco>"
    )
    physical.joint_limit(spec, "a", law=cm.ConstantLaw(1e4, 10.0))
    physical.add_drive(spec, "m", 1e-3, 1e4, 1.0, inertia=1.0)
    model = physical.compile(spec)
    with physical.Softener(model):
        mujoco.mj_step(model, mujoco.MjData(model))


TASKS = (
    branches_over_level, periodic_in_space, modal_lanes, modal_space, assertions, lanes_in_space, benches,
    benches_in_space, virtual_rig, vehicles, links, softening, modal,
)  # fmt: skip
"""Longest first, and those that compile alike apart from each other."""


def run(name: str) -> str:
    """Run a task; what goes wrong is only told, for the tests are to find it."""
    began = time.perf_counter()
    try:
        globals()[name]()
    except Exception as error:
        return f"{name}: {type(error).__name__}: {error}"
    return f"{time.perf_counter() - began:6.1f} s  {name}"


def main() -> None:
    workers = os.cpu_count() or 1
    began = time.perf_counter()
    with ProcessPoolExecutor(workers, multiprocessing.get_context("fork")) as pool:
        for line in pool.map(run, [task.__name__ for task in TASKS]):
            print(line, flush=True)
    print(f"compiled in {time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()
