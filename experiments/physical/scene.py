"""Models, motions, and colours of curves that the scenes of the gallery share."""

from pathlib import Path
from typing import NamedTuple

import mujoco
import mujoco.rollout
import numpy as np

ROOT = Path(__file__).parents[2]
GRAVITY, ARCMIN = 9.81, np.pi / 180 / 60
ASKED, DEFAULT, OTHER = "C0", "C3", "C1"  # Colours of what is asked, of MuJoCo's default, and of a third


def load(name: str) -> mujoco.MjSpec:
    """Read a model of the gallery."""
    return mujoco.MjSpec.from_file(str(ROOT / "models" / f"{name}.xml"))


class Motion(NamedTuple):
    """Motions from several starts."""

    time: np.ndarray  # (n_t,)
    qpos: np.ndarray  # (n, n_t, nq)
    qvel: np.ndarray  # (n, n_t, nv)
    sensors: np.ndarray  # (n, n_t, n_sensors)


def march(model: mujoco.MjModel, seconds: float, qpos=None, qvel=None, control=None) -> Motion:
    """March from starts (n, nq) and (n, nv), under the beginning of controls (n, n_t, nu)."""
    data, steps = mujoco.MjData(model), round(seconds / model.opt.timestep)
    qpos, qvel = np.atleast_2d(model.qpos0 if qpos is None else qpos), np.atleast_2d(0.0 if qvel is None else qvel)
    count = max(len(qpos), len(qvel), 1 if control is None else len(control))
    parts = np.zeros((count, 1)), qpos, qvel * np.ones(model.nv)
    start = np.hstack([np.broadcast_to(part, (count, part.shape[1])) for part in parts])
    control = None if control is None else control[:, :steps]
    states, sensors = mujoco.rollout.rollout(model, data, start, control, nstep=steps)
    end = 1 + model.nq
    return Motion(states[0, :, 0], states[:, :, 1:end], states[:, :, end : end + model.nv], sensors)


def rings(time: np.ndarray, value: np.ndarray) -> float:
    """Frequency, Hz, from the upward passages through zero; not a number if there are fewer than two."""
    up = np.flatnonzero((value[:-1] < 0) & (value[1:] >= 0))
    at = time[up] + value[up] / (value[up] - value[up + 1]) * (time[1] - time[0])
    return float((len(at) - 1) / (at[-1] - at[0])) if len(at) > 1 else np.nan


def ringing(k: float, mass: float, c: float) -> float:
    """Frequency, Hz, of a mass on a spring and a damper."""
    return float(np.sqrt(k / mass - (c / (2 * mass)) ** 2) / (2 * np.pi))
