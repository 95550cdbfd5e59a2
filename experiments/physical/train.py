"""An environment of gymnasium with play in its gear, and a policy that learns to allow for it.

`python -m experiments.physical.train --seconds 60` trains for a minute; it needs `pip install gymnasium`. A servo holds
an arm against its weight; its encoder is at the motor, so the arm rests off by half the play and by torque over
stiffness. The policy sees the motor's angle and speed and the target, and commands the servo; gap, stiffness and load
are drawn anew in every episode (domain randomisation). Trained by the cross-entropy method, with NumPy alone.
"""

import sys
import time
from typing import Any

import gymnasium
import mujoco
import numpy as np

from clearance_mj import physical
from experiments.script import run

ARM = """
<mujoco><option timestep="1e-3" integrator="implicitfast"/><worldbody>
  <body><joint name="elbow" axis="0 -1 0" damping="0.3" armature="0.02"/>
    <geom name="arm" type="capsule" fromto="0 0 0 .3 0 0" size=".02" mass=".5"/>
    <geom name="load" pos=".3 0 0" size=".04" mass="1"/>
  </body></worldbody>
  <actuator><position name="servo" joint="elbow" kp="200" kv="4" ctrlrange="-1.5 1.5"/></actuator></mujoco>"""
GAP, STIFFNESS, LOAD = (0.5, 3.0), (150.0, 400.0), (0.5, 1.5)  # degrees from side to side, N m/rad, kg


class ServoArm(gymnasium.Env):
    """Bring the load's angle to a target and hold it there; each step is 20 of the simulation."""

    frame_skip, steps = 20, 50

    def __init__(self) -> None:
        spec = mujoco.MjSpec.from_string(ARM)
        physical.add_drive(spec, "servo", backlash=2.0, k=300.0, damping_ratio=0.1)
        self.model = physical.compile(spec)
        self.data, self._softener = mujoco.MjData(self.model), physical.Softener(self.model)
        self._softener.__enter__()
        self._body = int(self.model.geom("load").bodyid[0])
        self._mass, self._inertia = self.model.body_mass[self._body], self.model.body_inertia[self._body].copy()
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (3,), np.float64)
        self.action_space = gymnasium.spaces.Box(-0.2, 0.2, (1,), np.float64)  # beside the target, rad

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray, dict]:
        """Draw play, stiffness, load and target, and begin at rest."""
        super().reset(seed=seed)
        drive = next(iter(physical.drives.drives(self.model))).numbers(self.model)
        drive["gap"], drive["k"] = np.deg2rad(self.np_random.uniform(*GAP)) / 2, self.np_random.uniform(*STIFFNESS)
        fraction = (0.5 + self.np_random.uniform(*LOAD)) / self._mass
        self.model.body_mass[self._body], self.model.body_inertia[self._body] = (
            fraction * self._mass,
            fraction * self._inertia,
        )
        mujoco.mj_resetData(self.model, self.data)
        self.target, self._left = self.np_random.uniform(-1.0, 1.0), self.steps
        return self._seen(), {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict]:
        """Command the servo; the reward is the load's distance from the target, degrees, below zero."""
        self.data.ctrl[0] = self.target + np.clip(action, self.action_space.low, self.action_space.high)[0]
        mujoco.mj_step(self.model, self.data, self.frame_skip)
        self._left -= 1
        off = np.rad2deg(abs(self.data.qpos[0] - self.target)) if self._left < self.steps // 2 else 0.0
        return self._seen(), -float(off), False, self._left == 0, {}

    def close(self) -> None:
        """Let MuJoCo go."""
        self._softener.__exit__()

    def _seen(self) -> np.ndarray:
        motor = physical.drive_state(self.model, self.data.act, "servo")
        return np.array([motor.angle, motor.speed, self.target])


def play(env: ServoArm, policy: np.ndarray, episodes: int, seed: int) -> float:
    """Mean distance from the target while it is to be held, degrees, of a policy (4,)."""
    total = 0.0
    for episode in range(episodes):
        seen, _ = env.reset(seed=seed + episode)
        done = False
        while not done:
            # what the load's weight needs grows with the cosine of its angle
            features = np.array([1.0, np.cos(seen[2]), seen[2], seen[2] - seen[0]])
            seen, reward, _, done, _ = env.step(np.array([policy @ features]))
            total -= reward
    return total / episodes / (env.steps // 2)


def train(seconds: float, seed: int = 0, population: int = 12, episodes: int = 6) -> tuple[float, float]:
    """Return how far off the load is held without a policy and with the one that was learnt, degrees."""
    env, rng, end = ServoArm(), np.random.default_rng(seed), time.monotonic() + seconds
    mean, spread, generation = np.zeros(4), np.full(4, 0.05), 0
    while time.monotonic() < end:
        tried = mean + spread * rng.standard_normal((population, 4))
        costs = [play(env, each, episodes, 1000 * generation) for each in tried]
        best = tried[np.argsort(costs)[: population // 4]]
        mean, spread, generation = best.mean(axis=0), best.std(axis=0) + 2e-3, generation + 1
        print(f"generation {generation}: {min(costs):.3f}° off")
    unseen = 10**6
    scores = play(env, np.zeros(4), 20, unseen), play(env, mean, 20, unseen)
    env.close()
    return scores


def main(seconds: float = 60.0) -> None:
    """Train, and say what it has learnt."""
    without, learnt = train(seconds)
    print(f"in 20 episodes that it has not seen: {without:.3f}° off without a policy, {learnt:.3f}° with it")


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
