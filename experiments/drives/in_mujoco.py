"""Virtual gears that were found from logs, inside actuators of MuJoCo models, beside a run under another load.

    python -m experiments.drives.in_mujoco --first 100 --seeds 20

The model has the drive as `fit_drive` found it and the load as it is. Its motor follows the measured angle of a run
that no drive was found from; the load's torque and the motor's, and the load's angle less ratio times the motor's, are
compared with that run's, all of them as means over 0.05 s. Synthetic.
"""

import sys

import mujoco
import numpy as np
import pandas as pd
import scipy.ndimage

from clearance_mj import physical
from clearance_mj.drives import DriveFit, DriveRecord, add_found_drive, fit_drive
from experiments.script import run

from .virtual import FS, LOADS, NOISE, OTHER, Gear

PARTS = "backlash", "damping", "inertia"
STEP = 1e-4  # s
WARM = 1.0  # s, that the beginning takes


def model(gear: Gear, fit: DriveFit) -> mujoco.MjModel:
    """Return the load of a gear behind the drive that was found."""
    spec, inertia = mujoco.MjSpec(), gear.inertia
    spec.option.gravity, spec.option.timestep = (0, 0, 0), STEP
    body = spec.worldbody.add_body(mass=1e-9, inertia=[inertia[1]] * 3, explicitinertial=True)
    body.add_joint(name="load", axis=[0, 1, 0], damping=[gear.drag[1], 0, 0], stiffness=[0.5 * gear.usual, 0, 0])
    motor = spec.add_actuator(name="motor", target="load", trntype=mujoco.mjtTrn.mjTRN_JOINT)
    stiff = 200 * gear.ratio**2 * gear.stiffness
    motor.set_to_position(kp=stiff, kv=2 * np.sqrt(stiff * inertia[0]))
    add_found_drive(spec, "motor", fit.drive, fit.largest_torque, inertia[0], c=0.01 * gear.stiffness)
    physical.joint_friction(spec, "load", gear.friction[1], gear.friction[1] / gear.presliding[1])
    return physical.compile(spec)


def follow(model: mujoco.MjModel, drive_ratio: float, record: DriveRecord, torque: float) -> np.ndarray:
    """Return motor's angle and torque, load's angle and torque (n, 4) of a motor that follows a record's."""
    data, wanted = mujoco.MjData(model), smooth(smooth(record.motor_angle))
    data.qpos[0], data.qfrc_applied[0] = drive_ratio * wanted[0], -torque
    out, steps = np.empty((wanted.size, 4)), round(1 / (FS * STEP))
    with physical.Softener(model):
        for i, (begin, end) in enumerate(zip(wanted, np.append(wanted[1:], wanted[-1]))):
            for fraction in np.arange(steps) / steps:
                data.ctrl[0] = begin + fraction * (end - begin)
                mujoco.mj_step(model, data)
            state = physical.drive_state(model, data.act, "motor")
            out[i] = state.angle / drive_ratio, state.motor_torque * drive_ratio, data.qpos[0], state.load_torque
    return out


def smooth(x: np.ndarray) -> np.ndarray:
    """Mean over 0.05 s."""
    return np.asarray(scipy.ndimage.uniform_filter1d(x, round(0.05 * FS), mode="nearest"))


def judge(seed: int) -> dict[str, float]:
    """Errors of one drive over the range of each channel, and over the noise of the angle."""
    gear = Gear.drawn(seed)
    fit = fit_drive([gear.run(f"load {load:g}", load, 10 * seed + i) for i, load in enumerate(LOADS)], parts=PARTS)
    record, d = gear.run("other", OTHER, 10 * seed + 9), fit.drive
    assert record.load_angle is not None and record.load_torque is not None
    motor, torque, load, carried = follow(model(gear, fit), d.ratio, record, OTHER * gear.usual).T
    lacking = smooth(load - d.ratio * motor) - smooth(record.load_angle - d.zero - d.ratio * record.motor_angle)
    row = {"drive": seed, "play over noise": rms(lacking) / (NOISE * np.ptp(record.load_angle))}
    for what, predicted, measured in (
        ("motor's torque", torque, record.motor_torque), ("load's torque", carried, record.load_torque)
    ):  # fmt: skip
        row[what] = rms(smooth(predicted) - smooth(measured)) / np.ptp(smooth(measured)[round(WARM * FS) :])
    return row


def rms(x: np.ndarray) -> float:
    """RMS after the beginning."""
    return float(np.sqrt(np.mean(x[round(WARM * FS) :] ** 2)))


def main(first: int = 0, seeds: int = 20) -> None:
    """Judge drives and print medians and largest errors."""
    table = pd.DataFrame([judge(first + i) for i in range(seeds)]).set_index("drive")
    print(table.describe().loc[["50%", "max"]].to_string(float_format="%.3g"))


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
