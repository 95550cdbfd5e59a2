"""A ball set down on a floor."""

import mujoco
import mujoco.rollout
import numpy as np
from matplotlib.figure import Figure

import clearance_mj.physical as physical
from experiments.physical.scene import ASKED, DEFAULT, GRAVITY, OTHER, march, ringing, rings

# A ball that is set down on a floor

FLOOR = """
<mujoco>
  <option timestep="{timestep}"/>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1" condim="1"/>
    <body pos="0 0 0.05">
      <joint type="slide" axis="0 0 1"/>
      <geom name="ball" size="0.05" mass="{mass}" condim="1"/>
    </body>
  </worldbody>
</mujoco>"""
FLOOR_K, FLOOR_C, MASS = 1e5, 30.0, 1.0


def floor(how: str, mass: float = MASS, timestep: float = 2e-5) -> mujoco.MjModel:
    """A ball on a floor: "default" solref, "direct" solref="-k -c", or "physical"."""
    spec = mujoco.MjSpec.from_string(FLOOR.format(mass=mass, timestep=timestep))
    if how == "direct":
        for geom in spec.geoms:
            geom.solref = [-FLOOR_K, -FLOOR_C]
    if how != "physical":
        return spec.compile()
    physical.contact(spec, ("ball", "floor"), FLOOR_K, FLOOR_C)
    return physical.compile(spec)


def set_down(how: str) -> tuple[np.ndarray, np.ndarray]:
    """Time and depth, m, of a ball that is let go as it touches the floor."""
    motion = march(floor(how), 0.2)
    return motion.time, -motion.qpos[0, :, 0]


def at_rest(how: str, mass: float) -> float:
    """Depth, m, of a ball long after that; the mean over what is left of its motion."""
    motion = march(floor(how, mass, 1e-4), 3.0)
    return -float(motion.qpos[0, motion.time > 2, 0].mean())


def set_down_expected(time: np.ndarray) -> np.ndarray:
    """Depth, m, of a mass on spring and damper."""
    decay, static = FLOOR_C / (2 * MASS), MASS * GRAVITY / FLOOR_K
    omega = 2 * np.pi * ringing(FLOOR_K, MASS, FLOOR_C)
    return static * (1 - np.exp(-decay * time) * (np.cos(omega * time) + decay / omega * np.sin(omega * time)))


def draw_floor() -> Figure:
    """Depth over time, and at rest over mass."""
    figure = Figure(figsize=(9, 3.8), layout="constrained")
    time_axes, mass_axes = figure.subplots(1, 2)
    names = {"physical": "physical.contact", "direct": 'solref="-1e5 -30"', "default": "default solref"}
    colours = {"physical": ASKED, "direct": OTHER, "default": DEFAULT}
    masses = np.geomspace(0.1, 10, 9)
    for how, name in names.items():
        time, depth = set_down(how)
        time_axes.plot(1e3 * time, 1e6 * depth, colours[how], label=name)
        rest = [at_rest(how, mass) for mass in masses]
        mass_axes.loglog(masses, 1e6 * np.array(rest), "o", color=colours[how])
        heard, asked = rings(time, depth - rest[4]), ringing(FLOOR_K, MASS, FLOOR_C)
        print(f"floor, {name}: 1 kg rests {1e6 * rest[4]:.5g} µm deep, {1e6 * MASS * GRAVITY / FLOOR_K:.5g} asked; "
              f"rings at {heard:.5g} Hz, {asked:.5g} asked")  # fmt: skip
    time_axes.plot(1e3 * time, 1e6 * set_down_expected(time), "k:", label="closed form")
    time_axes.set(xlabel="time (ms)", ylabel="depth of the ball (µm)", title="a ball of 1 kg, set down", yscale="log")
    time_axes.set(xlim=(0, 200), ylim=(5, 1e3))
    mass_axes.plot(masses, 1e6 * masses * GRAVITY / FLOOR_K, "k:")
    mass_axes.set(xlabel="mass (kg)", ylabel="depth at rest (µm)", title="balls of other masses at rest, same contact")
    figure.legend(*time_axes.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure
