"""A box on a slope, held by friction, and stopped by it."""

from contextlib import nullcontext

import mujoco
import mujoco.rollout
import numpy as np
from matplotlib.figure import Figure

import clearance_mj.physical as physical
from clearance_mj.clearance import ContactLaw, HuntCrossley
from experiments.physical.scene import ASKED, DEFAULT, GRAVITY, march

# A box on a slope

SLOPE, MU, BRISTLE = np.deg2rad(20), 0.5, 1e6
SAND = HuntCrossley(stiffness=1e8, restitution=0.5)
BOX = """
<mujoco>
  <option timestep="5e-5" gravity="{g[0]} 0 {g[1]}"/>
  <worldbody>
    <geom name="slope" type="plane" size="5 5 1" friction="0.5" condim="3"/>
    <body pos="0 0 {height}">
      <freejoint/><geom name="box" type="{shape}" size="0.1 0.1 0.05" mass="2" friction="0.5"/>
    </body>
  </worldbody>
</mujoco>"""


def on_slope(default: bool = False, angle: float = SLOPE) -> mujoco.MjModel:
    """A box of 2 kg on a slope, with Hertz contacts and bristles, or with MuJoCo's friction."""
    gravity = GRAVITY * np.sin(angle), -GRAVITY * np.cos(angle)
    spec = mujoco.MjSpec.from_string(BOX.format(g=gravity, height=0.05, shape="box"))
    if not default:
        physical.contact(spec, ("box", "slope"), law=ContactLaw(SAND), frictionless=True)
        physical.friction(spec, ("box", "slope"), MU, k=BRISTLE, c=500)
    return physical.compile(spec)


def slides(model: mujoco.MjModel, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Time, s, and way down the slope, m."""
    follows = nullcontext() if model.nuserdata == 0 else physical.Softener(model)
    with follows:
        motion = march(model, seconds)
    return motion.time, motion.qpos[0, :, 0]


def impact(speed: float) -> tuple[np.ndarray, np.ndarray]:
    """Depth, m, and force, N, while a ball of 2 kg hits the floor."""
    spec = mujoco.MjSpec.from_string(BOX.format(g=(0, 0), height=0.1, shape="sphere"))
    physical.contact(spec, ("box", "slope"), law=ContactLaw(SAND), frictionless=True)
    model = physical.compile(spec)
    model.opt.timestep = 5e-6
    with physical.Softener(model):
        motion = march(model, 0.01 / np.sqrt(speed), qvel=[0, 0, -speed, 0, 0, 0])
    velocity = np.append(-speed, motion.qvel[0, :, 2])
    return np.append(0, 0.1 - motion.qpos[0, :-1, 2]), 2 * np.diff(velocity) / model.opt.timestep


def draw_slope() -> Figure:
    """Way of a box that ought to stay, and force over depth of impacts."""
    figure = Figure((10, 3.6), layout="constrained")
    way, loops = figure.subplots(1, 2)
    for default, colour, name in (
        (False, ASKED, "friction(..., 0.5, k=1e6)"),
        (True, DEFAULT, "MuJoCo's friction 0.5"),
    ):
        time, x = slides(on_slope(default), 5.0)
        way.plot(time, 1e6 * x, color=colour, label=name)
        speed = (x[-1] - x[len(x) // 2]) / (time[-1] - time[len(x) // 2])
        print(f"slope: {name} creeps at {1e6 * speed:.3g} µm/s")
    way.set(xlabel="time (s)", ylabel="way down the slope (µm)", title="a box of 2 kg on a slope of 20°")
    way.set_yscale("symlog", linthresh=10)
    way.legend()
    for speed, colour in zip((0.1, 0.3, 0.6), ("C0", "C2", "C4")):
        depth, force = impact(speed)
        loops.plot(1e6 * depth, force, color=colour, label=f"{speed} m/s")
        inside = depth > 0
        law = SAND.stiffness * depth[inside] ** 1.5 * (1 + SAND.kappa * np.gradient(depth, 5e-6)[inside] / speed)
        loops.plot(
            1e6 * depth[inside], np.maximum(law, 0), "k:", lw=1, label="K δ^1.5 (1 + κ δ̇/v)" if speed == 0.6 else None
        )
    loops.set(xlabel="depth (µm)", ylabel="force (N)", title="a ball hits the floor (Hunt and Crossley, e = 0.5)")
    loops.set_xlim(left=-20)
    loops.legend()
    return figure
