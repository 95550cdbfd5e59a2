"""A robot on its feet: as its file has it, and with a stiffness."""

from contextlib import nullcontext

import mujoco
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from clearance_mj import physical
from experiments.physical.scene import ASKED, DEFAULT, GRAVITY, load

STIFFNESS, RADIUS, SECONDS = 3e4, 0.02, 2.0
FEET = ("FL_foot", "FR_foot", "RL_foot", "RR_foot")


def standing(model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray, mujoco.MjData]:
    """Time, s, depth of the feet (n_t, 4), m, and the data at the end, from the robot's home on."""
    data, depth = mujoco.MjData(model), []
    mujoco.mj_resetDataKeyframe(model, data, 0)
    needed = any(physical.bristles.bristles_of(model)) or any(physical.drives.drives(model))
    with physical.Softener(model) if needed else nullcontext():
        for _ in range(round(SECONDS / model.opt.timestep)):
            mujoco.mj_step(model, data)
            depth.append([RADIUS - data.geom(foot).xpos[2] for foot in FEET])
    return model.opt.timestep * np.arange(1, len(depth) + 1), np.array(depth), data


def draw_quadruped() -> Figure:
    """The legs where they meet the ground, and how deep the feet are over time."""
    figure = Figure((10, 3.6), layout="constrained")
    side, over_time = figure.subplots(1, 2)
    spec = load("quadruped")
    models = {
        "as its file has it": (spec.compile(), DEFAULT),
        f"robot(spec, feet, k={STIFFNESS:.0e})".replace("e+0", "e"): (
            physical.robot(spec, FEET, STIFFNESS, damping_ratio=0.3, friction=0.8), ASKED
        ),
    }  # fmt: skip
    for name, (model, colour) in models.items():
        time, depth, data = standing(model)
        over_time.plot(time, 1e3 * depth.mean(axis=1), color=colour, label=name)
        x, _, z = 1e3 * np.array([data.body("RL_thigh").xpos, data.body("RL_shank").xpos, data.geom("RL_foot").xpos]).T
        side.plot(x, z, color=colour, lw=3)
        side.add_patch(Circle((x[-1], z[-1]), 1e3 * RADIUS, color=colour, alpha=0.5, lw=0))
        print(f"quadruped: {name}: {1e3 * depth[-1].mean():.2f} mm deep")
    weight = GRAVITY * models["as its file has it"][0].body_subtreemass[1]
    over_time.axhline(1e3 * weight / 4 / STIFFNESS, color="k", ls=":", lw=1, label="m g/4k")
    side.axhspan(-40, 0, color="0.9", zorder=0)
    side.set(xlabel="along the robot (mm)", ylabel="above the ground (mm)", xlim=(-270, -130), ylim=(-40, 60),
             aspect="equal", title="a foot from the side, at rest")  # fmt: skip
    over_time.set(xlabel="time (s)", ylabel="depth of the feet in the ground (mm)", title="12.2 kg on four feet")
    over_time.legend()
    return figure
