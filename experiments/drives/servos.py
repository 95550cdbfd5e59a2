"""Virtual servos with physics of their own, and how near `fit_model` comes to what they are from one log.

    python -m experiments.drives.servos --first 0 --seeds 10 --out results/servos.csv
    python -m experiments.drives.servos --first 0 --seeds 10 --lossy --out results/servos_lossy.csv

A rotor behind play and elastic teeth moves a pendulum. Friction at the rotor is a clipped bristle with Stribeck's
curve; of lossy servos also Dahl's friction in proportion to the torque of the teeth, by other shares as power flows
to the load and back, and an exponent of Stribeck's curve of their own. A PD loop at 1 kHz reads the load by 12 bits.
It is integrated at 2e-5 s. All numbers are drawn, the motor's constant too: the log has its current. The loop jitters,
and both angles are counted by 12 bits; synthetic. The model has a drive inside its actuator; fits begin with numbers
that are wrong by up to a half.
"""

from __future__ import annotations

import sys
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
import pandas as pd

from clearance_mj import physical
from clearance_mj.core.jit import jit
from clearance_mj.physical.identification import ModelFit, ModelRecord, fit_model
from clearance_mj.report.tables import write_csv
from experiments.script import run

FINE = 2e-5  # s, step of the virtual servo
LOOP = 1e-3  # s, of its control loop and its log
JITTER = 1e-4  # s RMS, of the loop's rounds
SECONDS = 10.0
COUNT = 2 * np.pi / 4096  # rad
PROPORTIONAL, DERIVATIVE, LARGEST = 12.0, 0.25, 2.5  # N m/rad, N m s/rad, N m
MASS_MOMENT = 0.35 / 9.81  # kg m, of the pendulum
INERTIA = 0.012  # kg m², of the pendulum about its joint
DRAG = 0.01  # N m s/rad
WIDTH = 2e-4  # rad, after which most of the teeth's friction is there
START = 1.5  # factor, by which starts are wrong at most
FRICTION = ("coulomb", "viscous", "stribeck", "stribeck_speed", "stribeck_exponent")
WANTED = ("gap", "k", "c", "gain", "coulomb", "stribeck", "viscous")
WANTED_OF_LOSSY = ("stribeck_speed", "stribeck_exponent", "loss_forward", "loss_backward")
TARGETS = {"servo.gap": 0.03, "servo.k": 0.10, "servo.gain": 0.02}
CONFIDENCE = 0.9


@dataclass(frozen=True)
class Servo:
    """A servo as it really is, at its load; SI units."""

    gap: float
    k: float
    c: float
    inertia: float
    coulomb: float
    stribeck: float
    stribeck_speed: float
    viscous: float
    gain: float
    stribeck_exponent: float = 2.0
    loss_forward: float = 0.0  #: friction per torque of the teeth, of a rotor that drives its load
    loss_backward: float = 0.0  #: of one that is driven

    @classmethod
    def drawn(cls, seed: int, lossy: bool = False) -> Servo:
        """Draw a servo, without losses in its gear or with."""
        rng = np.random.default_rng((seed, 4097))
        usual = (np.deg2rad(0.25), 150.0, 0.3, 0.012, 0.1, 0.04, 0.08, 0.08, 0.8)
        servo = cls(*(value * 1.5 ** rng.uniform(-1, 1) for value in usual))
        exponent, forward, backward = rng.uniform((1.0, 0.1, 0.1), (2.0, 0.5, 0.5)).tolist()
        losses = {"stribeck_exponent": exponent, "loss_forward": forward, "loss_backward": backward}
        return replace(servo, **losses) if lossy else servo

    def log(self, seed: int) -> ModelRecord:
        """Return ten seconds of it."""
        rng = np.random.default_rng((seed, 9))
        at = np.arange(round(SECONDS / LOOP)) * LOOP
        wanted = (
            sum(
                a * np.sin(2 * np.pi * f * at + p)
                for a, f, p in zip((0.36, 0.18, 0.09, 0.036), (0.23, 0.61, 1.37, 2.9), rng.uniform(0, 6.28, 4))
            )
            + np.repeat(rng.uniform(-0.25, 0.25, 13), 800)[: at.size]
        )
        numbers = [value for name, value in asdict(self).items() if name != "gain"]
        late = np.clip(rng.normal(0, JITTER, at.size), -0.4 * LOOP, 0.4 * LOOP)
        starts = np.round((at + late - late[0]) / FINE).astype(np.int64)
        states = _march(wanted, starts, np.array(numbers))
        angles = COUNT * np.round(states[:, :2] / COUNT)
        return ModelRecord.of_time(
            FINE * starts, {"servo": states[:, 2] / self.gain},
            {"servo.angle": angles[:, 0], "load": angles[:, 1]}, hold="zero",
        )  # fmt: skip

    def bare(self) -> mujoco.MjSpec:
        """Return a MuJoCo model of the pendulum and its motor, without a drive."""
        arm, inertia = 0.1, INERTIA - MASS_MOMENT * 0.1
        return mujoco.MjSpec.from_string(f"""
<mujoco><compiler angle="radian"/><option timestep="2.5e-4"/><worldbody><body>
  <joint name="joint" axis="0 1 0" damping="{DRAG}"/>
  <inertial pos="0 0 {-arm}" mass="{MASS_MOMENT / arm}" diaginertia="{inertia} {inertia} {inertia}"/></body></worldbody>
  <actuator><motor name="servo" joint="joint"/></actuator>
  <sensor><jointpos name="load" joint="joint"/></sensor></mujoco>""")

    def model(self) -> mujoco.MjSpec:
        """Return a MuJoCo model with these numbers."""
        spec = self.bare()
        named = {name: value for name, value in asdict(self).items() if name in FRICTION}
        efficiency = physical.Efficiency(1 / (1 + self.loss_forward), 1 - self.loss_backward)
        friction = physical.DriveFriction(2e3, 0.2, efficiency=efficiency, **named)
        physical.add_drive(spec, "servo", self.gap, self.k, self.c, inertia=self.inertia, friction=friction)
        spec.actuator("servo").gainprm[0] = self.gain
        return spec

    def truth(self) -> dict[str, float]:
        """Return what a fit looks for, by its names."""
        lossy = self.loss_forward or self.loss_backward
        return {f"servo.{n}": v for n, v in asdict(self).items() if n in WANTED or (lossy and n in WANTED_OF_LOSSY)}


@jit
def _march(wanted, starts, numbers):  # type: ignore[no-untyped-def]
    """Angles of motor and load and the motor's torque (n, 3) in each round of the loop; semi-implicit Euler."""
    gap, k, c, inertia, coulomb, stribeck, usual, viscous, exponent, forward, backward = numbers
    out = np.empty((wanted.size, 3))
    x_m, v_m, x_l, v_l, bristle, torque, before, turn = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0
    rubs = 0.0  # share of the losses that is there after a reversal, from -1 to 1
    stiff = 2e4 * coulomb
    for i in range(starts[-1] + 1):
        if i == starts[turn]:
            seen = np.round(x_l / COUNT) * COUNT
            torque = PROPORTIONAL * (wanted[turn] - seen) - DERIVATIVE * (seen - before) / LOOP
            torque = min(max(torque, -LARGEST), LARGEST)
            before = seen
            out[turn] = x_m, x_l, torque
            turn += 1
        lag, teeth = x_m - x_l, 0.0
        if lag > gap:
            teeth = max(k * (lag - gap) + c * (v_m - v_l), 0.0)
        elif lag < -gap:
            teeth = min(k * (lag + gap) + c * (v_m - v_l), 0.0)
        slips = (coulomb + stribeck * np.exp(-(abs(v_m / usual) ** exponent))) / stiff
        bristle = min(max(bristle + FINE * v_m, -slips), slips)
        rubs = min(max(rubs + FINE * (v_m - abs(v_m) * rubs) / WIDTH, -1.0), 1.0)
        lost = abs(teeth) * rubs * (forward if teeth * rubs > 0.0 else backward)
        v_m += FINE * (torque - teeth - lost - stiff * bristle - viscous * v_m) / inertia
        v_l += FINE * (teeth - MASS_MOMENT * 9.81 * np.sin(x_l) - DRAG * v_l) / INERTIA
        x_m += FINE * v_m
        x_l += FINE * v_l
    return out


def judge(seed: int, lossy: bool = False) -> tuple[list[dict], ModelFit]:
    """Rows of one servo: each number beside its truth."""
    servo = Servo.drawn(seed, lossy)
    truth, rng = servo.truth(), np.random.default_rng((seed, 11))
    wrong = {n.removeprefix("servo."): value * START ** rng.uniform(-1, 1) for n, value in truth.items()}
    spec = replace(servo, **wrong).model()
    begin = time.perf_counter()
    fit = fit_model(spec, servo.log(seed), list(truth))
    seconds = time.perf_counter() - begin
    low, high = fit.estimates.interval(CONFIDENCE)
    misfit = max(fit.misfit.values())
    return [
        {"servo": seed, "what": name, "value": fit.values[name], "truth": value, "low": a, "high": b,
         "held": a <= value <= b, "told": name not in fit.not_told, "misfit": misfit, "std": s, "starts": fit.starts,
         "seconds": seconds}
        for (name, value), a, b, s in zip(truth.items(), low, high, fit.estimates.varied_std)
    ], fit  # fmt: skip


def main(out: Path = Path("results/servos.csv"), first: int = 0, seeds: int = 10, lossy: bool = False) -> None:
    """Judge servos and print what is on target."""
    rows: list[dict] = []
    for seed in range(first, first + seeds):
        judged, fit = judge(seed, lossy)
        rows += judged
        print(f"servo {seed}, {judged[0]['seconds']:.0f} s", fit, sep="\n", flush=True)
    table = pd.DataFrame(rows)
    write_csv(out, table)
    for what, group in table.groupby("what", sort=False):
        error, known = (group.value / group.truth - 1).abs(), group.told
        target = TARGETS.get(str(what))
        near = f", within {target:g}: {np.mean(error[known] <= target):.0%}" if target else ""
        print(
            f"{what}: told for {known.sum()} of {len(group)}, median error {error[known].median():.3g}, largest "
            f"{error[known].max():.3g}{near}; {CONFIDENCE:.0%} intervals hold {group.held.mean():.0%}"
        )


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
