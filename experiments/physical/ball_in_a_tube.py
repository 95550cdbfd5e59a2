"""A ball that whirls in a tube."""

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import mujoco.rollout
import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import brentq

import clearance_mj.physical as physical
from experiments.physical.scene import ASKED, DEFAULT, load, march

# A ball in a tube

TUBE_GAP, TUBE_K, TUBE_C = 1e-3, 1e5, 30.0
BALL = 0.033  # kg
STAVES = 16


def tube(default: bool = False) -> mujoco.MjModel:
    """The ball in an annular clearance, or between boxes with contacts as MuJoCo makes them."""
    spec = load("ball_in_tube")
    if not default:
        physical.add_annular_clearance(spec, "ball", "axis", TUBE_GAP, TUBE_K, TUBE_C)
        return physical.compile(spec)
    for angle in 2 * np.pi * np.arange(STAVES) / STAVES:
        place = (0.01 + TUBE_GAP + 0.005) * np.array([np.cos(angle), np.sin(angle), 0])
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.005, 0.004, 1], pos=place, condim=1,
            quat=[np.cos(angle / 2), 0, 0, np.sin(angle / 2)],
        )  # fmt: skip
    return spec.compile()


class Orbit(NamedTuple):
    """A ball's way about the axis, from several starts."""

    time: np.ndarray  # (n_t,)
    place: np.ndarray  # (n, n_t, 3), m
    momentum: np.ndarray  # (n, n_t), angular, about the axis, kg m²/s
    radius: np.ndarray  # (n,), m, at last
    frequency: np.ndarray  # (n,), Hz, at last


def orbit(model: mujoco.MjModel, start: Sequence[float], speeds: np.ndarray, seconds: float) -> Orbit:
    """March the ball from a place (x, y) at speeds (n, 2)."""
    speeds = np.atleast_2d(speeds)
    count = len(speeds)
    motion = march(model, seconds, (0.0, *start), np.hstack((np.zeros((count, 1)), speeds)))
    qpos, qvel = motion.qpos, motion.qvel
    (x, y), (vx, vy) = np.moveaxis(qpos[..., 1:], -1, 0), np.moveaxis(qvel[..., 1:], -1, 0)
    momentum, radius = BALL * (x * vy - y * vx), np.hypot(x, y)
    late = motion.time > 0.75 * seconds
    frequency = (np.abs(momentum) / (BALL * radius**2) / (2 * np.pi))[:, late].mean(axis=1)
    return Orbit(motion.time, qpos[..., [1, 2, 0]], momentum, radius[:, late].mean(axis=1), frequency)


def whirl(momentum: float) -> tuple[float, float]:
    """Radius, m, and frequency, Hz, of the whirl of an angular momentum: m ω² R = k (R - gap), m ω R² = momentum."""
    pull = momentum**2 / BALL
    radius = brentq(lambda r: TUBE_K * (r - TUBE_GAP) * r**3 - pull, TUBE_GAP, 100 * TUBE_GAP)
    return radius, abs(momentum) / (BALL * radius**2) / (2 * np.pi)


def draw_tube() -> Figure:
    """A ball that falls, its way seen from above, and how deep it presses into the tube."""
    figure = Figure(figsize=(10.5, 4.3))
    layout = figure.add_gridspec(
        1, 3, width_ratios=(0.9, 1, 1.2), left=0.01, right=0.98, bottom=0.13, top=0.92, wspace=0.34
    )
    ours, boxes = tube(), tube(default=True)
    start, speed = (-0.8e-3, 0.0), (0.08, 0.16)
    annular, usual = orbit(ours, start, speed, 0.2), orbit(boxes, start, speed, 0.2)
    fall = figure.add_subplot(layout[0], projection="3d")
    above, depth = figure.add_subplot(layout[1]), figure.add_subplot(layout[2])
    _draw_fall(fall, annular)
    _draw_above(above, annular, usual)
    _draw_depth(depth, ours, boxes)
    radius, frequency = whirl(annular.momentum[0, 0])
    for name, way in (("annular clearance", annular), ("boxes", usual)):
        print(f"tube, {name}: radius {1e3 * way.radius[0]:.6f} mm, {way.frequency[0]:.5f} Hz; closed form "
              f"{1e3 * radius:.6f} mm, {frequency:.5f} Hz")  # fmt: skip
    return figure


def _draw_fall(axes, tube: Orbit) -> None:
    x, y, z = 1e3 * tube.place[0].T
    axes.plot(x, y, z, ASKED, linewidth=1)
    turn = np.linspace(0, 2 * np.pi, 60)
    for height in (z.min(), 0):
        axes.plot(np.cos(turn), np.sin(turn), height, "k", linewidth=0.8)
    axes.set(xlabel="x (mm)", ylabel="y (mm)", title="centre of the falling ball")
    axes.set_zlabel("height (mm)", labelpad=20)
    axes.tick_params(axis="z", pad=7)
    axes.set(xticks=(-1, 0, 1), yticks=(-1, 0, 1), zticks=(-200, -100, 0))
    axes.set_box_aspect((1, 1, 1.7), zoom=0.88)


def _draw_above(axes, tube: Orbit, usual: Orbit) -> None:
    for way, colour, name in ((usual, DEFAULT, f"{STAVES} boxes, default solref"), (tube, ASKED, "annular clearance")):
        axes.plot(*(1e3 * way.place[0, :, :2].T), colour, linewidth=0.8, label=name)
    turn = np.linspace(0, 2 * np.pi, 200)
    axes.plot(np.cos(turn), np.sin(turn), "k:", linewidth=1, label="where the ball touches")
    axes.set(aspect="equal", xlim=(-1.7, 1.7), ylim=(-1.5, 3.3), xlabel="x (mm)", ylabel="y (mm)", title="from above")
    axes.legend(loc="upper center")


def _draw_depth(axes, ours, boxes) -> None:
    speeds = np.geomspace(0.02, 1.5, 10)
    sideways = np.stack((np.zeros_like(speeds), speeds), 1)
    for model, colour, name in ((ours, ASKED, "annular clearance"), (boxes, DEFAULT, f"{STAVES} boxes, deepest")):
        way = orbit(model, (TUBE_GAP, 0), sideways, 0.15)
        if colour == ASKED:
            axes.loglog(way.frequency, 1e6 * (way.radius - TUBE_GAP), "o", color=colour, label=name)
            off = (way.radius - TUBE_GAP) / (BALL * ((2 * np.pi * way.frequency) ** 2) * way.radius / TUBE_K) - 1
            print(f"tube: depth off by {np.max(np.abs(off)):.1e}")
            continue
        reach = np.hypot(*np.moveaxis(way.place[..., :2], -1, 0)).max(axis=1) - TUBE_GAP
        axes.loglog(speeds / TUBE_GAP / (2 * np.pi), 1e6 * reach, "s", color=colour, label=name)
    frequency = np.geomspace(2, 240, 50)
    ratio = BALL * (2 * np.pi * frequency) ** 2 / TUBE_K
    axes.plot(frequency, 1e6 * TUBE_GAP * ratio / (1 - ratio), "k:", label="m ω² R / k")
    axes.set(xlabel="whirl frequency (Hz)", ylabel="depth in the wall (µm)", title="pressed out by the whirl")
    axes.legend()
