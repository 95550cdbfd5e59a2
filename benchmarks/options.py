"""Time of the parts of a step of links, and cost and error of other settings of MuJoCo."""

import copy
import ctypes
import dataclasses
from dataclasses import dataclass
from functools import partial

import llvmlite.binding
import mujoco
import numba
import numpy as np
from mujoco import mjtDisableBit, mjtIntegrator, mjtJacobian, mjtSolver
from tqdm import tqdm

import clearance_mj as cm
from clearance_mj.core.errors import ClearanceError
from clearance_mj.engines import plant
from clearance_mj.engines.base import step_factor
from clearance_mj.engines.links_plant import LinksPlant, links_plant
from clearance_mj.engines.links_run import LinksRun
from clearance_mj.physical.library import LIBRARY
from clearance_mj.signals.sampling import interpolate

from .case import FS, LAW, RIG, SECONDS, error, excitation, timed

STAGES = {
    "mj_kinematics": "where every link is",
    "mj_comPos": "centres of mass, motion axes",
    "mj_tendon": "tendon lengths",
    "mj_makeM": "mass matrix",
    "mj_factorM": "its factorisation",
    "mj_collision": "contact detection",
    "mj_makeConstraint": "constraint rows",
    "mj_projectConstraint": "their inverse inertia",
    "mj_fwdVelocity": "velocities, springs, dampers, bias forces",
    "mj_fwdAcceleration": "acceleration without constraints",
    "mj_fwdConstraint": "constraint solver",
    "mj_sensorPos": "sensors of position",
    "mj_sensorAcc": "sensors of acceleration",
    "mj_Euler": "integrator",
}
STATES, CALLS = 200, 50


def measure():
    """Return µs of each stage of a step, and time and error of every option."""
    return {
        "profile": {"links": _profile(cm.Links())},
        "options": [_try(*option) for option in tqdm(_options(), desc="options", unit="option")],
        "armature": [_try(*option) for option in tqdm(_armatures(), desc="armature", unit="option")],
    }


def _options():
    engine = Changed(16)
    flags = int(engine._plant(RIG).model.opt.disableflags)
    rows = [
        (engine, name, fields)
        for name, fields in {
            "as it is: Euler, PGS, 3 iterations": {},
            "PGS, 1 iteration": {"iterations": 1},
            "PGS, 50 iterations": {"iterations": 50},
            "solver Newton": {"solver": mjtSolver.mjSOL_NEWTON, "iterations": 20},
            "solver CG": {"solver": mjtSolver.mjSOL_CG, "iterations": 20},
            "Jacobian dense": {"jacobian": mjtJacobian.mjJAC_DENSE},
            "Jacobian sparse": {"jacobian": mjtJacobian.mjJAC_SPARSE},
            "integrator implicitfast": {"integrator": mjtIntegrator.mjINT_IMPLICITFAST},
            "integrator implicit": {"integrator": mjtIntegrator.mjINT_IMPLICIT},
            "integrator RK4": {"integrator": mjtIntegrator.mjINT_RK4},
            "islands looked for": {"disableflags": flags & ~int(mjtDisableBit.mjDSBL_ISLAND)},
            "no warm start": {"disableflags": flags | mjtDisableBit.mjDSBL_WARMSTART},
            "joint dampers explicit": {"disableflags": flags | mjtDisableBit.mjDSBL_EULERDAMP},
        }.items()
    ]
    return [*rows, (dataclasses.replace(engine, shapes=True), "with shapes that touch nothing", {})]


def _armatures():
    shares = {"none": 0.0, "1/12": 1 / 12, "1/7": 1 / 7, "1/6": 1 / 6, "1/5": 1 / 5}
    cases = [(n, name) for n in (12, 16, 20) for name in shares]
    return [(Changed(n, armature=shares[name]), f"{n} links, armature {name}", {}) for n, name in cases]


@dataclass(frozen=True, eq=False)
class WithArmature(LinksPlant):
    """Chains of which all joints have the same armature."""

    share: float

    @property
    def armature(self):
        return np.full(self.maps.order.size, self.share)


@dataclass(frozen=True)
class Changed(cm.engines.Engine):
    """Links with options of their MuJoCo model overwritten."""

    size: int
    fields: tuple = ()
    armature: float = plant.ARMATURE  #: as in `LinksPlant`
    shapes: bool = False  #: keep the shapes that touch nothing

    name = "changed"

    def largest_step(self, rig, law):
        whole = links_plant(rig, self.size).whole
        limit = plant.stable_step(whole.mass, whole.stiffness, whole.at_points, rig, law, self.armature)
        return cm.Links().safety * limit

    def start(self, rig, law, kind, step):
        built = self._plant(rig)
        model = copy.copy(built.model)
        for name, value in self.fields:
            setattr(model.opt, name, value)
        built = WithArmature(model, built.whole, built.maps, built.explicit, self.armature)
        return LinksRun(self, rig, law, kind, step, built)

    def _plant(self, rig):
        built = links_plant(rig, self.size)
        if not self.shapes:
            return built
        model = cm.engines.build_links(rig, self.size).compile()
        cm.physical.set_inverse_inertia(model)
        return dataclasses.replace(built, model=model)


def _try(engine, name, fields):
    engine = dataclasses.replace(engine, fields=tuple((k, int(v)) for k, v in fields.items()))
    row = {"engine": "links", "option": name}
    drive = excitation()
    try:
        seconds, response = timed(lambda: cm.simulate(RIG, drive, LAW, engine))
    except ClearanceError as problem:
        return row | {"failed": str(problem)}
    factor = step_factor(FS, engine.largest_step(RIG, LAW))
    per_step = seconds / (drive.value.size * factor)
    return row | {"per_step": per_step, "cost": seconds / SECONDS, "error": error(response)}


def _profile(engine):
    """µs of each stage, mean over states of a run in contact; and of a whole step, and of a step of the engine."""
    factor = step_factor(FS, engine.largest_step(RIG, LAW))
    drive = excitation()
    run = engine.start(RIG, LAW, "base", 1 / (FS * factor))
    model, data = run.model, run.data
    times = dict.fromkeys(STAGES, 0.0) | {"mj_step": 0.0}
    blocks = np.array_split(interpolate(drive.value, factor)[: round(0.5 * FS * factor)], STATES)
    for block in blocks:
        run.advance(block)
        state = data.qpos.copy(), data.qvel.copy(), data.time
        for stage in times:
            mujoco.mj_forward(model, data)
            seconds, _ = timed(partial(_calls(stage), model._address, data._address, CALLS))
            times[stage] += seconds / CALLS / STATES * 1e6
            data.qpos[:], data.qvel[:], data.time = state
            data.qacc_warmstart[:] = 0
    seconds, _ = timed(lambda: cm.simulate(RIG, drive, LAW, engine))
    return times | {"engine": seconds / SECONDS / FS / factor * 1e6}


_COMPILED = {}


def _calls(name):
    """A compiled loop over a function of the MuJoCo library that takes model and data."""
    if name not in _COMPILED:
        address = ctypes.cast(getattr(LIBRARY, name), ctypes.c_void_p).value
        llvmlite.binding.add_symbol(name, address)
        function = numba.types.ExternalFunction(name, numba.types.void(numba.types.intp, numba.types.intp))

        @numba.njit
        def loop(model, data, n):
            for _ in range(n):
                function(model, data)

        _COMPILED[name] = loop
    return _COMPILED[name]
