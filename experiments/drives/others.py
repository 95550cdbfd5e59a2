"""Fits of virtual servos' logs by other programs: BAM, MuJoCo's own identification, and `fit_model`, side by side.

    python -m experiments.drives.others --first 20 --seeds 2 --out results/others.csv

The servos are those of `experiments.drives.servos`: play, elastic teeth, Stribeck's friction, a motor's constant that
is not known. Each program gets the same ten seconds, and predicts the load's angle of ten others from their currents,
scored after a second: `fit_model` finds the state in the first second and a half, others begin with smoothed angles.
Programs that are not installed are left out: BAM is the package better-actuator-models, MuJoCo's
identification is ``mujoco.sysid`` with what ``pip install "mujoco[sysid]"`` brings.

All know the pendulum and the rotor's inertia. BAM and `fit_model` also know the speed of Stribeck's curve. BAM has one
rigid joint, a curve of Stribeck's and bounds instead of a start; it searches by evolution, as its own script does.
``mujoco.sysid`` varies any number of a MuJoCo model: here one rigid joint, or the two joints, rotor and load, between
which `physical.add_backlash` puts play; neither has Stribeck's curve. Both take the log in pieces of a second, which
begin where the encoders were, for neither estimates a state.
"""

import contextlib
import importlib
import importlib.util
import io
import math
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pandas as pd
import scipy.signal

from clearance_mj import physical
from clearance_mj.physical.identification import ModelRecord, fit_model
from clearance_mj.report.tables import write_csv
from experiments.drives.servos import DRAG, INERTIA, LOOP, MASS_MOMENT, START, WANTED, Servo
from experiments.script import run

PIECE = 1.0  # s, of a log, which BAM and mujoco.sysid begin anew from the encoders
SUBSTEPS = 4  # of MuJoCo, in a sample
SMOOTHED = 31  # samples, over which angles are smoothed for the speeds that pieces begin with
GENERATIONS = 40  # of BAM's search, with 16 points each
ITERATIONS = 25  # of mujoco.sysid at most
Values = dict[str, float]
Answer = tuple[Values, np.ndarray]  # numbers, and the load's angle (n,) that is predicted
LACKS = {
    "fit_model": "-", "BAM, M2": "play, teeth", "mujoco.sysid, one joint": "play, teeth, Stribeck's curve",
    "mujoco.sysid, two joints": "Stribeck's curve",
}  # fmt: skip


def of_fit_model(servo: Servo, start: Servo, log: ModelRecord, other: ModelRecord) -> Answer:
    """Find a servo by `fit_model`."""
    fit = fit_model(start.model(), log, [f"servo.{name}" for name in WANTED])
    predicted = fit.predict(other).sensors["load"]
    values = {name.removeprefix("servo."): value for name, value in fit.values.items()}
    return values, np.concatenate((np.full(other.size - predicted.size, math.nan), predicted))


def of_bam(servo: Servo, start: Servo, log: ModelRecord, other: ModelRecord) -> Answer:
    """Find a servo by BAM's model M2, a generation of its search at once, for BAM takes arrays."""
    from bam.actuator import CurrentControlledActuator
    from bam.model import Model
    from bam.parameter import Parameter
    from bam.simulate import Simulator
    from bam.testbench import Pendulum
    from cmaes import CMA

    class Motor(CurrentControlledActuator):
        """A motor whose torque is a constant times its current."""

        def initialize(self) -> None:
            self.model.kt = Parameter(1.0, 0.1, 3.0)

        def get_extra_inertia(self) -> float:
            return servo.inertia

    class Several(Parameter):
        """Values of a whole generation, copied when they are read, for BAM adds to its base friction in place."""

        value = property(lambda self: np.copy(self.kept), lambda self, values: setattr(self, "kept", values))

    model = Model(stribeck=True)
    model.set_actuator(Motor(Pendulum, vin=12.0, kp=1.0))
    model.dtheta_stribeck.value, model.alpha.value = servo.stribeck_speed, servo.stribeck_exponent
    names = {"kt": "gain", "friction_base": "coulomb", "friction_stribeck": "stribeck", "friction_viscous": "viscous"}
    for name in names:
        bounds = getattr(model, name)
        setattr(model, name, Several(bounds.value, bounds.min, bounds.max))
    open_ = [getattr(model, name) for name in names]
    low, high = (np.array([getattr(p, end) for p in open_]) for end in ("min", "max"))

    def rollout(record: ModelRecord, points: np.ndarray, reset: float | None) -> np.ndarray:
        """Angles (n, n_points) of points (n_points, 4)."""
        for parameter, values in zip(open_, (low + points * (high - low)).T):
            parameter.value = values
        angle, speed = _smooth(record, "load")
        ones, current = np.ones(len(points)), np.asarray(record.control["servo"])
        entries = [
            {"position": a * ones, "speed": v * ones, "control": i * ones, "torque_enable": True}
            for a, v, i in zip(angle, speed, current)
        ]
        length = INERTIA / MASS_MOMENT
        bench = {"mass": MASS_MOMENT / length, "arm_mass": 0.0, "length": length, "kp": 1.0}
        logs = Simulator(model).rollout_log(bench | {"dt": 1 / record.fs, "entries": entries}, reset_period=reset)
        return np.array(logs[0])

    search = CMA(
        mean=np.full(4, 0.5), sigma=0.25, bounds=np.array([[0.0, 1.0]] * 4), population_size=16, seed=0
    )  # fmt: skip
    best, measured = (math.inf, np.zeros(4)), np.asarray(log.sensors["load"])[:, None]
    for _ in range(GENERATIONS):
        points = np.array([search.ask() for _ in range(search.population_size)])
        errors = np.mean(np.abs(rollout(log, points, PIECE) - measured), axis=0)  # BAM's own measure
        search.tell(list(zip(points, errors.tolist())))
        best = min(best, (float(errors.min()), points[errors.argmin()]), key=lambda each: each[0])
    values = dict(zip(names.values(), (low + best[1] * (high - low)).tolist()))
    values["viscous"] -= DRAG  # of the pendulum's joint, which BAM's does not have
    return values, rollout(other, best[1][None], None)[:, 0]


def of_sysid(servo: Servo, start: Servo, log: ModelRecord, other: ModelRecord, play: bool) -> Answer:
    """Find a servo by mujoco.sysid: of one rigid joint, or of rotor and load with play between them."""
    from mujoco import rollout, sysid

    names = ("gain", "coulomb", "viscous", *(("gap", "k", "c") if play else ()))
    begun = {name: getattr(start, name) for name in names}
    sensors = ("load", "rotor") if play else ("load",)

    def built(values: Values) -> mujoco.MjModel:
        return physical.compile(_joints(replace(servo, **values), play))

    def values_of(given: Any) -> Values:
        return {name: value * math.exp(float(given[name].value[0])) for name, value in begun.items()}

    def states(model: mujoco.MjModel, record: ModelRecord, at: int) -> np.ndarray:
        angles, speeds = zip(*(_smooth(record, name) for name in ("load", "servo.angle")[: len(sensors)]))
        return sysid.create_initial_state(model, np.array(angles)[:, at], np.array(speeds)[:, at])

    model = built(begun)
    size, pieces = round(PIECE / LOOP), []
    for at in range(0, log.size - size, size):
        time_ = log.time[: size + 1]
        current = np.repeat(np.asarray(log.control["servo"])[at : at + size], SUBSTEPS)
        shown = np.stack([np.asarray(log.sensors["servo.angle" if s == "rotor" else s]) for s in sensors], axis=1)
        pieces.append(
            (
                states(model, log, at),
                sysid.TimeSeries.from_control_names(np.arange(current.size) * LOOP / SUBSTEPS, current[:, None], model),
                sysid.TimeSeries.from_names(time_[:size], shown[at : at + size], model, list(sensors)),
            )
        )
    wanted = sysid.ParameterDict(
        {name: sysid.Parameter(name, 0.0, -math.log(30.0), math.log(30.0)) for name in names}
    )  # fmt: skip
    sequences = sysid.ModelSequences(
        "servo", _joints(start, play), [f"piece {i}" for i in range(len(pieces))], *map(list, zip(*pieces))
    )  # fmt: skip
    residual = sysid.build_residual_fn(
        models_sequences=[sequences], build_model=lambda given, _spec: built(values_of(given))
    )
    with contextlib.redirect_stdout(io.StringIO()):  # it prints every iteration
        optimum, _ = sysid.optimize(wanted, residual, verbose=False, max_iters=ITERATIONS)
    values = values_of(optimum)
    model = built(values)
    current = np.repeat(np.asarray(other.control["servo"]), SUBSTEPS)[None, :, None]
    _, seen = rollout.rollout(model, mujoco.MjData(model), states(model, other, 0)[None], current)
    return values, np.asarray(seen)[0, ::SUBSTEPS, 0]


def _joints(servo: Servo, play: bool) -> mujoco.MjSpec:
    """Return the pendulum with its rotor as an armature, or behind the play of `physical.add_backlash`."""
    spec = servo.bare()
    motor, joint = spec.actuator("servo"), spec.joint("joint")
    motor.gainprm[0] = servo.gain
    if play:
        joint = physical.add_backlash(spec, "joint", gap=servo.gap, k=servo.k, c=servo.c, inertia=servo.inertia)
        spec.add_sensor(
            name="rotor", type=mujoco.mjtSensor.mjSENS_JOINTPOS, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=joint.name
        )  # fmt: skip
        joint.damping = [servo.viscous, 0, 0]
    else:
        joint.armature = servo.inertia
        joint.damping = [joint.damping[0] + servo.viscous, 0, 0]
    joint.frictionloss = servo.coulomb
    joint.solref_friction, joint.solimp_friction = [5e-4, 1], [0.999, 0.999, 1e-3, 0.5, 2]
    return spec


def _smooth(record: ModelRecord, sensor: str) -> tuple[np.ndarray, np.ndarray]:
    """Return angle and speed (n,) of a sensor."""
    x = np.asarray(record.sensors[sensor])
    return tuple(scipy.signal.savgol_filter(x, SMOOTHED, 3, deriv, 1 / record.fs) for deriv in (0, 1))  # type: ignore[return-value]


def methods() -> dict[str, Callable[..., Answer]]:
    """Return the programs that are installed."""
    by_name: dict[str, Callable[..., Answer]] = {"fit_model": of_fit_model}
    if importlib.util.find_spec("bam") and importlib.util.find_spec("cmaes"):
        by_name["BAM, M2"] = of_bam
    if importlib.util.find_spec("mujoco.sysid") and hasattr(importlib.import_module("mujoco.sysid"), "optimize"):
        by_name["mujoco.sysid, one joint"] = lambda *given: of_sysid(*given, play=False)
        by_name["mujoco.sysid, two joints"] = lambda *given: of_sysid(*given, play=True)
    return by_name


def judge(seed: int) -> list[dict]:
    """Rows of one servo: errors of each program's numbers, and of its prediction of another log."""
    servo = Servo.drawn(seed)
    rng = np.random.default_rng((seed, 11))
    start = replace(servo, **{name: getattr(servo, name) * START ** rng.uniform(-1, 1) for name in WANTED})
    log, other, rows = servo.log(seed), servo.log(1000 + seed), []
    for name, method in methods().items():
        begun = time.perf_counter()
        values, predicted = method(servo, start, log, other)
        seconds, left = (
            time.perf_counter() - begun,
            (predicted - np.asarray(other.sensors["load"]))[round(PIECE / LOOP) :],
        )
        errors = {what: values[what] / getattr(servo, what) - 1 if what in values else math.nan for what in WANTED}
        rows.append({"servo": seed, "program": name, **errors, "prediction": 1e3 * float(np.sqrt(np.nanmean(left**2))),
                     "seconds": seconds})  # fmt: skip
        print(rows[-1], flush=True)
    return rows


def main(out: Path = Path("results/others.csv"), first: int = 20, seeds: int = 2) -> None:
    """Judge the programs and print the table of the page."""
    table = pd.DataFrame([row for i in range(seeds) for row in judge(first + i)])
    write_csv(out, table)
    print("| program | cannot represent |", " | ".join(WANTED), "| prediction, mrad | seconds |")
    for program, rows in table.groupby("program", sort=False):
        cells = [_cell(rows[what].abs()) for what in WANTED]
        print(f"| {program} | {LACKS[str(program)]} |", " | ".join(cells), end=" | ")
        print(f"{rows.prediction.median():.2g} (largest {rows.prediction.max():.2g}) | {rows.seconds.median():.0f} |")


def _cell(errors: pd.Series) -> str:
    """Median and largest error in words; a dash of what a program does not have."""
    known = errors.dropna()
    return f"{known.median():.2%} ({known.max():.2%})" if len(known) else "-"


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
