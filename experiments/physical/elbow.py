"""Play in the elbow of a two-link arm, identified from torques and encoders of a virtual record.

The record is synthetic, and not by MuJoCo: the arm's equations of motion with a drive's inertia, a tooth law and dry
friction, integrated at 1e-5 s by a Runge-Kutta method of order four, seen by encoders of 4096 counts per turn and
torque sensors with noise. The model that is fitted is an MjSpec with `add_backlash`, integrated by MuJoCo.
"""

import json
import sys
import time
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import scipy.signal
from matplotlib.figure import Figure

from clearance_mj import physical
from clearance_mj.core.jit import jit
from clearance_mj.physical.identification import ModelFit, ModelRecord, fit_model
from experiments.script import run

FS = 1000.0  # Hz, of the record
DURATION = 20.0  # s
COUNT = 2 * np.pi / 4096  # rad, of an encoder
JITTER = 2e-4  # rad RMS, of an encoder before it counts
TORQUE_NOISE = 0.02  # N m RMS, of a torque sensor
GRID = 1e-4  # s, between values of a torque, which is linear there
FINE = 1e-5  # s, step of the virtual arm

MASS = (2.0, 1.5)  # kg, of the links; the second carries the payload
PAYLOAD = 1.0  # kg
LENGTH = (0.40, 0.35)  # m
CENTRE = (0.20, 0.16)  # m, of a link's mass from its joint
INERTIA = (0.030, 0.016)  # kg m², of a link about its centre
DRIVE = (0.08, 0.04)  # kg m², inertia of a drive at its joint: rotor times gear ratio squared
TRUE = {
    "elbow backlash.gap": np.deg2rad(0.5),
    "elbow backlash.k": 4000.0,
    "elbow backlash.c": 4.0,
    "shoulder.damping": 1.0,
    "shoulder.frictionloss": 0.40,
    "elbow drive.damping": 0.40,
    "elbow drive.frictionloss": 0.30,
}  # Only the virtual arm and the final comparison know them
LAG = 3e-3  # s, of the motors
SLIP = 1e-3  # rad/s, at which friction is fully there


@jit
def _rate(x, t1, t2, arm, values):
    """Of shoulder, elbow and elbow drive: positions, then velocities; angles from hanging, the elbow's relative."""
    a, b, e, armature, drive, g1, g2 = arm
    gap, k, c, damping_1, friction_1, damping_2, friction_2 = values
    q1, q2, qd, v1, v2, vd = x
    beyond = max(qd - q2 - gap, 0.0) + min(qd - q2 + gap, 0.0)
    tooth = 0.0
    if beyond != 0.0:
        tooth = k * beyond + c * (vd - v2)
        if tooth * beyond < 0.0:
            tooth = 0.0
    cos, sin = np.cos(q2), np.sin(q2)
    m11, m12 = a + 2 * e * cos + armature, b + e * cos
    weight = g2 * np.sin(q1 + q2)
    f1 = t1 - damping_1 * v1 - friction_1 * np.tanh(v1 / SLIP)
    f1 += e * sin * (2 * v1 * v2 + v2 * v2) - g1 * np.sin(q1) - weight
    f2 = tooth - e * sin * v1 * v1 - weight
    det = m11 * b - m12 * m12
    fd = t2 - tooth - damping_2 * vd - friction_2 * np.tanh(vd / SLIP)
    return v1, v2, vd, (b * f1 - m12 * f2) / det, (m11 * f2 - m12 * f1) / det, fd / drive


@jit
def _moved(x, k, h):
    return (
        x[0] + h * k[0], x[1] + h * k[1], x[2] + h * k[2], x[3] + h * k[3], x[4] + h * k[4], x[5] + h * k[5]
    )  # fmt: skip


@jit
def _march(torque, fine, arm, values):
    """Positions and velocities (n, 6) at torques (n, 2) every `GRID` seconds, linear between."""
    steps = int(round(GRID / fine))
    out = np.empty((len(torque), 6))
    x = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for i in range(len(torque)):
        for j in range(6):
            out[i, j] = x[j]
        first, second = torque[i], torque[min(i + 1, len(torque) - 1)]
        for j in range(steps):
            now, mid, end = [first + (second - first) * ((j + s) / steps) for s in (0.0, 0.5, 1.0)]
            k1 = _rate(x, now[0], now[1], arm, values)
            k2 = _rate(_moved(x, k1, fine / 2), mid[0], mid[1], arm, values)
            k3 = _rate(_moved(x, k2, fine / 2), mid[0], mid[1], arm, values)
            k4 = _rate(_moved(x, k3, fine), end[0], end[1], arm, values)
            for k, h in ((k1, fine / 6), (k2, fine / 3), (k3, fine / 3), (k4, fine / 6)):
                x = _moved(x, k, h)
    return out


def constants() -> tuple[float, ...]:
    """Of the equations of motion: moments of inertia, armature, drive, and moments of weight."""
    hand = MASS[1] * CENTRE[1] + PAYLOAD * LENGTH[1]
    b = INERTIA[1] + MASS[1] * CENTRE[1] ** 2 + PAYLOAD * LENGTH[1] ** 2
    beyond = MASS[1] + PAYLOAD
    a = INERTIA[0] + MASS[0] * CENTRE[0] ** 2 + beyond * LENGTH[0] ** 2 + b
    weight = 9.81 * (MASS[0] * CENTRE[0] + beyond * LENGTH[0])
    return a, b, LENGTH[0] * hand, DRIVE[0], DRIVE[1], weight, 9.81 * hand


def torques(time: np.ndarray, seed: int) -> np.ndarray:
    """(n, 2) of a multisine at the shoulder, and of one with steps across zero at the elbow; from zero at rest."""
    rng = np.random.default_rng(seed)
    shoulder = _multisine(time, rng, 0.3, 4.0, 3.0)
    elbow = _multisine(time, rng, 1.0, 12.0, 1.2)
    edges = np.cumsum(rng.uniform(0.1, 0.4, 200))
    levels = rng.uniform(0.5, 3.0, 201) * np.where(np.arange(201) % 2, -1, 1)
    steps = levels[np.searchsorted(edges, time)]
    raw = np.stack((shoulder, elbow + steps), axis=1) * np.minimum(time / 0.5, 1.0)[:, None]
    weight = 1 - np.exp(-GRID / LAG)
    return scipy.signal.lfilter([weight], [1, weight - 1], raw, axis=0)


def _multisine(time: np.ndarray, rng: np.random.Generator, low: float, high: float, rms: float) -> np.ndarray:
    lines = np.arange(np.ceil(low * DURATION), np.floor(high * DURATION) + 1) / DURATION
    lines = rng.choice(lines, min(lines.size, 40), replace=False)
    phases = rng.uniform(0, 2 * np.pi, lines.size)
    return rms * np.sqrt(2 / lines.size) * sum(np.sin(2 * np.pi * f * time + p) for f, p in zip(lines, phases))


def virtual_arm(excitation: int, duration: float = DURATION, fine: float = FINE) -> tuple[np.ndarray, np.ndarray]:
    """Torques (n, 2) and motion (n, 6) of the virtual arm at the record's samples."""
    torque = torques(np.arange(round(duration / GRID)) * GRID, excitation)
    motion = _march(torque, fine, constants(), tuple(TRUE.values()))
    every = round(1 / (FS * GRID))
    return torque[::every], motion[::every]


def arm(start: dict[str, float], timestep: float = 2e-4) -> mujoco.MjSpec:
    """The MuJoCo model of the arm, with values that nobody has measured."""
    spec = mujoco.MjSpec.from_string(f"""
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{timestep}" gravity="0 0 -9.81" integrator="Euler"/>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" axis="0 -1 0" armature="{DRIVE[0]}"/>
      <inertial pos="0 0 {-CENTRE[0]}" mass="{MASS[0]}" diaginertia="{INERTIA[0]} {INERTIA[0]} 1e-3"/>
      <body name="lower" pos="0 0 {-LENGTH[0]}">
        <joint name="elbow" axis="0 -1 0"/>
        <inertial pos="0 0 {-CENTRE[1]}" mass="{MASS[1]}" diaginertia="{INERTIA[1]} {INERTIA[1]} 1e-3"/>
        <body name="payload" pos="0 0 {-LENGTH[1]}">
          <inertial pos="0 0 0" mass="{PAYLOAD}" diaginertia="1e-9 1e-9 1e-9"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="shoulder motor" joint="shoulder"/><motor name="elbow motor" joint="elbow"/></actuator>
  <sensor><jointpos name="shoulder encoder" joint="shoulder"/><jointpos name="elbow encoder" joint="elbow"/></sensor>
</mujoco>""")
    teeth = {name: start[f"elbow backlash.{name}"] for name in ("gap", "k", "c")}
    drive = physical.add_backlash(spec, "elbow", inertia=DRIVE[1], **teeth)
    for joint in (spec.joint("shoulder"), drive):
        joint.damping = [start[f"{joint.name}.damping"], 0, 0]
        joint.frictionloss = start[f"{joint.name}.frictionloss"]
        joint.solref_friction, joint.solimp_friction = [2 * timestep, 1], [0.999, 0.999, 1e-3, 0.5, 2]
    return spec


def record(excitation: int, noise: int, motor_side: bool = False) -> ModelRecord:
    """Return what torque sensors show, and encoders at each joint's load, or at the elbow's drive."""
    torque, motion = virtual_arm(excitation)
    rng = np.random.default_rng([excitation, noise])
    torque = torque + rng.normal(0, TORQUE_NOISE, torque.shape)
    angle = motion[:, [0, 2 if motor_side else 1]] + rng.normal(0, JITTER, (len(motion), 2))
    counted = COUNT * np.round(angle / COUNT)
    elbow = "elbow drive encoder" if motor_side else "elbow encoder"
    return ModelRecord(
        FS,
        {"shoulder motor": torque[:, 0], "elbow motor": torque[:, 1]},
        {"shoulder encoder": counted[:, 0], elbow: counted[:, 1]},
        quantisation={"shoulder encoder": COUNT, elbow: COUNT},
    )


def wrong_start(seed: int) -> dict[str, float]:
    """Gap off by up to half, stiffness and damping of the teeth by up to 3, friction and damping by up to 2."""
    rng = np.random.default_rng([seed, 17])
    off = np.r_[rng.uniform(0.5, 1.5), 3.0 ** rng.uniform(-1, 1, 2), 2.0 ** rng.uniform(-1, 1, 4)]
    return dict(zip(TRUE, off * np.array(list(TRUE.values()))))


def case(seed: int, motor_side: bool) -> tuple[dict[str, Any], ModelFit, Any]:
    """One record, with an excitation, noise and starts of its own, and the prediction of another excitation."""
    began = time.perf_counter()
    spec = arm(wrong_start(seed))
    if motor_side:
        spec.add_sensor(
            name="elbow drive encoder", type=mujoco.mjtSensor.mjSENS_JOINTPOS, objtype=mujoco.mjtObj.mjOBJ_JOINT,
            objname="elbow drive",
        )  # fmt: skip
    fit = fit_model(spec, record(seed, seed, motor_side), list(TRUE))
    took = time.perf_counter() - began
    prediction = fit.predict(record(1000 + seed, seed, motor_side))
    low, high = fit.estimates.interval()
    noise = float(np.hypot(COUNT / np.sqrt(12), JITTER))
    row = {
        "seed": seed, "encoder": "motor" if motor_side else "load", "seconds": took,
        "error": {n: v / TRUE[n] - 1 for n, v in fit.values.items()},
        "std": dict(zip(TRUE, fit.estimates.varied_std.tolist())),
        "covers": {n: bool(a <= TRUE[n] <= b) for n, a, b in zip(TRUE, low, high)},
        "residual over noise": {n: r / noise for n, r in fit.residual.items()},
        "prediction over noise": {n: r / noise for n, r in prediction.rms.items()},
    }  # fmt: skip
    return row, fit, prediction


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Largest and RMS errors, coverage, and prediction errors over all seeds of an encoder."""
    errors = {n: np.array([row["error"][n] for row in rows]) for n in TRUE}
    return {
        "seeds": len(rows),
        "largest error": {n: float(np.abs(e).max()) for n, e in errors.items()},
        "mean error": {n: float(e.mean()) for n, e in errors.items()},
        "covered": {n: sum(row["covers"][n] for row in rows) for n in TRUE},
        "prediction over noise": {
            n: [float(f([row["prediction over noise"][n] for row in rows])) for f in (np.median, np.max)]
            for n in rows[0]["prediction over noise"]
        },
    }


def draw(rows: list[dict[str, Any]], fit: ModelFit, prediction: Any) -> Figure:
    """An unseen trajectory with its prediction, what is left of it, and errors of all seeds with their intervals."""
    figure = Figure(figsize=(9, 7), layout="constrained")
    axes = figure.subplot_mosaic([["motion", "motion"], ["left", "left"], ["gap", "k"]], height_ratios=(3, 2, 3))
    shown = slice(4000, 7000)
    t = (prediction.begin + np.arange(20000))[shown] / FS
    name = "elbow encoder"
    measured = prediction.sensors[name] + prediction.residual[name]
    axes["motion"].plot(t, np.rad2deg(measured[shown]), "k", lw=2.5, label="encoder (synthetic)")
    axes["motion"].plot(t, np.rad2deg(prediction.sensors[name][shown]), "C1", lw=1, label="predicted")
    axes["motion"].set(ylabel="elbow (°)", title="an excitation that was not fitted")
    axes["motion"].legend(loc="upper right")
    axes["left"].plot(t, prediction.residual[name][shown] / COUNT, "C1", lw=0.6)
    axes["left"].set(ylabel="difference (counts)", xlabel="time (s)", ylim=(-2, 2))
    for key, title in (("gap", "gap"), ("k", "tooth stiffness")):
        full = f"elbow backlash.{key}"
        error, std = (100 * np.array([row[of][full] for row in rows]) for of in ("error", "std"))
        colours = ["C0" if row["encoder"] == "load" else "C2" for row in rows]
        for i, colour in enumerate(colours):
            axes[key].errorbar(i, error[i], 1.96 * std[i], fmt="o", color=colour, ms=4)
        axes[key].axhline(0, color="k", lw=0.8)
        note = " (green: encoder at the motor)" if "C2" in colours else ""
        axes[key].set(xlabel=f"record{note}", ylabel="error (%)", title=title)
    return figure


def main(out: Path = Path("results/elbow"), seeds: int = 10, motor: int = 2) -> None:
    """Identify the elbow of several records; write a figure and JSON."""
    out.mkdir(parents=True, exist_ok=True)
    rows: list[dict[str, Any]] = []
    first: Any = None
    for seed, motor_side in [(s, False) for s in range(seeds)] + [(s, True) for s in range(motor)]:
        row, fit, prediction = case(seed, motor_side)
        first = first or (fit, prediction)
        rows.append(row)
        print(json.dumps(row), flush=True)
        sides = {row["encoder"] for row in rows}
        result = {
            "summary": {s: summary([r for r in rows if r["encoder"] == s]) for s in sorted(sides)},
            "records": rows,
        }
        (out / "elbow.json").write_text(json.dumps(result, indent=1) + "\n")
        draw(rows, *first).savefig(out / "elbow.png", dpi=110)
    print(json.dumps(result["summary"], indent=1))


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
