"""Gallery of MuJoCo models with physical contacts and play: `python -m experiments.physical.gallery --out FOLDER`.

A ball set down on a floor, a box on a slope, a robot with backlash, a door latch with play and a ball in a tube, each
against its closed form and beside what MuJoCo's default solref, its friction, two hinges or a tube of boxes give.
Figures by matplotlib alone.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import NamedTuple

import mujoco
import mujoco.rollout
import numpy as np
from matplotlib.figure import Figure
from scipy.linalg import expm
from scipy.optimize import brentq, fsolve

import clearance_mj.physical as physical
from clearance_mj.clearance import ContactLaw, HuntCrossley

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


# A robot with backlash

TEETH = {
    "base": (3 * ARCMIN, 3e4, 20), "shoulder": (3 * ARCMIN, 3e4, 20), "elbow": (3 * ARCMIN, 1.5e4, 10),
    "roll": (6 * ARCMIN, 3e3, 0.1), "pitch": (6 * ARCMIN, 3e3, 0.1), "spin": (6 * ARCMIN, 3e3, 0.1),
}  # fmt: skip
"""Play to either side, rad, stiffness, N m/rad, and damping, N m s/rad, of each joint"""
OTHERS = tuple(TEETH)[:5]  # All joints but the last, which is looked at alone where theirs are braked
REACH = np.array([0.3, 0.5, -0.3, 0.6, -0.5, 0.0])  # rad, a pose in which gravity loads the four middle joints


def robot(recipe: bool = False, braked: Sequence[str] = (), timestep: float = 2e-4) -> mujoco.MjModel:
    """The arm with play in its joints, ours or by a second hinge with a small range each; some may be braked."""
    spec = load("robot_arm")
    spec.option.timestep = timestep
    for joint in braked:
        spec.delete(spec.actuator(joint))
        spec.delete(spec.joint(joint))
    for joint, (gap, k, c) in TEETH.items():
        if joint in braked:
            continue
        if recipe:
            _second_hinge(spec, joint, gap)
        else:
            physical.add_backlash(spec, joint, gap, k, c)
    return spec.compile() if recipe else physical.compile(spec)


def _second_hinge(spec: mujoco.MjSpec, joint: str, gap: float) -> None:
    """The usual recipe: the joint is the drive's, a hinge behind it is limited; their sum, the load, is damped."""
    drive = spec.joint(joint)
    drive.parent.add_joint(
        name=f"{joint} play", axis=drive.axis, limited=mujoco.mjtLimited.mjLIMITED_TRUE, range=[-gap, gap]
    )
    both = spec.add_tendon(name=f"{joint} load", damping=drive.damping)
    both.wrap_joint(joint, 1)
    both.wrap_joint(f"{joint} play", 1)
    drive.damping = [0, 0, 0]


def angles(model: mujoco.MjModel, joint: str) -> np.ndarray:
    """(2, nq) matrix that makes the angles of drive and load, rad, of a pose."""
    found, known = np.zeros((2, model.nq)), [model.joint(i).name for i in range(model.njnt)]
    drive = f"{joint} drive" if f"{joint} drive" in known else joint
    found[0, model.joint(drive).qposadr] = 1
    for part in {joint, f"{joint} play"} & set(known):
        found[1, model.joint(part).qposadr] = 1
    return found


def reversal(model: mujoco.MjModel, period: float = 20.0, joint: str = "spin") -> tuple[np.ndarray, np.ndarray]:
    """Drive and load while a joint goes slowly to and fro by 30'; from the first quarter of a period on."""
    time = np.arange(round(1.5 * period / model.opt.timestep)) * model.opt.timestep
    control = np.zeros((1, time.size, model.nu))
    control[0, :, model.actuator(joint).id] = 30 * ARCMIN * np.sin(2 * np.pi * time / period)
    drive, moved = angles(model, joint) @ march(model, 1.5 * period, control=control).qpos[0].T
    return drive[time > period / 4], moved[time > period / 4]


class Sag(NamedTuple):
    """How far loads hang behind their drives, rad, in the order of `TEETH`."""

    measured: np.ndarray
    expected: np.ndarray  # gap + torque / k, from the torques of gravity; not a number where there is none
    tip: float  # m, distance of the tip from where the drives' angles say it is
    tip_expected: float


def sag(model: mujoco.MjModel, seconds: float = 3.0) -> Sag:
    """Hold the arm in `REACH` until it is at rest."""
    data, both = mujoco.MjData(model), np.array([angles(model, joint) for joint in TEETH])
    start = np.linalg.lstsq(both.reshape(-1, model.nq), np.repeat(REACH, 2), rcond=None)[0]
    control = np.broadcast_to(REACH, (1, round(seconds / model.opt.timestep), 6)).copy()
    data.qpos[:] = march(model, seconds, start, control=control).qpos[0, -1]
    drives, loads = (both @ data.qpos).T
    mujoco.mj_forward(model, data)
    torque = np.array([-data.joint(joint).qfrc_bias[0] for joint in TEETH])
    gap, k, _ = np.array(list(TEETH.values())).T
    expected = np.where(np.abs(torque) > 1e-6, gap * np.sign(torque) + torque / k, np.nan)
    return Sag(
        loads - drives, expected, float(np.linalg.norm(_tip(loads) - _tip(drives))),
        float(np.linalg.norm(_tip(drives + np.where(np.isnan(expected), loads - drives, expected)) - _tip(drives))),
    )  # fmt: skip


def _tip(pose: np.ndarray) -> np.ndarray:
    """Where the tip of the rigid arm is, m."""
    model = load("robot_arm").compile()
    data = mujoco.MjData(model)
    data.qpos[:] = pose
    mujoco.mj_kinematics(model, data)
    return data.site("tip").xpos.copy()


def hunting(model: mujoco.MjModel, seconds: float = 1.5) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, drive and load of the spin joint, whose servo sees the load's angle instead of its own."""
    data, servo, both = mujoco.MjData(model), model.actuator("spin").id, angles(model, "spin")
    data.joint("spin").qvel = 0.5
    found = np.zeros((round(seconds / model.opt.timestep), 2))
    for row in found:
        drive, moved = row[:] = both @ data.qpos
        data.ctrl[servo] = drive - moved
        mujoco.mj_step(model, data)
    return (np.arange(len(found)) * model.opt.timestep, *found.T)


class Loop(NamedTuple):
    """The servo that sees the load, through play: inertias of drive and load, gains, damping of the load, teeth."""

    drive: float
    load: float
    kp: float
    kv: float
    damping: float
    gap: float
    k: float
    c: float


SPIN = Loop(0.1, 2 * 0.1**2 / 2, 1500, 17, 0.1, *TEETH["spin"])
"""Of the arm's spin joint: the tool is a cylinder of 2 kg and 0.1 m radius"""


def first_harmonic(loop: Loop = SPIN) -> tuple[float, float]:
    """Frequency, Hz, and amplitude of the load, rad, of the limit cycle by the describing function of play.

    Teeth that are met for a part of the period press like a spring and damper N(A) (k + i ω c), with
    N = 2/π (θ - sin θ cos θ), cos θ = gap/A, A the amplitude between drive and load (Gelb and Vander Velde,
    Multiple-Input Describing Functions, 1968: dead zone).
    """

    def stiffness(omega):
        s = 1j * omega
        free = (loop.drive * s**2 + loop.kv * s) * (loop.load * s**2 + loop.damping * s)
        locked = (loop.drive + loop.load) * s**2 + (loop.kv + loop.damping) * s + loop.kp
        return -free / ((1 + loop.c / loop.k * s) * locked)

    omegas = np.linspace(1, np.sqrt(loop.k / loop.load), 4000)
    turn = np.flatnonzero(np.diff(np.sign(np.imag([stiffness(omega) for omega in omegas]))))[0]
    omega = brentq(lambda omega: stiffness(omega).imag, omegas[turn], omegas[turn + 1])
    kappa = stiffness(omega).real
    theta = brentq(lambda t: 2 / np.pi * (t - np.sin(t) * np.cos(t)) - kappa / loop.k, 1e-6, np.pi / 2)
    s = 1j * omega
    torque = kappa * (1 + loop.c / loop.k * s) * loop.gap / np.cos(theta)
    return omega / (2 * np.pi), abs(torque / (loop.load * s**2 + loop.damping * s))


def limit_cycle(loop: Loop = SPIN) -> tuple[float, float]:
    """Frequency, Hz, and amplitude of the load, rad, of the limit cycle, exactly.

    The loop is linear in the gap and linear on a tooth: matrix exponentials from leaving one tooth to meeting the other
    and to leaving that, which must be the start with its sign changed.
    """

    def matrix(k, c):
        return np.array([
            [0, 1, 0, 0], [-k / loop.drive, -(loop.kv + c) / loop.drive, (k - loop.kp) / loop.drive, c / loop.drive],
            [0, 0, 0, 1], [k / loop.load, c / loop.load, -k / loop.load, -(c + loop.damping) / loop.load],
        ])  # fmt: skip

    free, met = matrix(0, 0), np.zeros((5, 5))
    met[:4, :4], met[1, 4], met[3, 4] = (
        matrix(loop.k, loop.c),
        loop.k * loop.gap / loop.drive,
        -loop.k * loop.gap / loop.load,
    )
    apart = np.array([1, 0, -1, 0])

    def states(times):
        flies, presses = expm(free * times[0]), expm(met * times[1])
        start = -np.linalg.solve(presses[:4, :4] @ flies + np.eye(4), presses[:4, 4])
        return start, flies @ start

    def wrong(times):
        start, meets = states(times)
        force = loop.k * (-apart @ start - loop.gap) - loop.c * (np.roll(apart, 1) @ start)
        return force / (loop.k * loop.gap), apart @ meets / loop.gap - 1

    reduced = loop.drive * loop.load / (loop.drive + loop.load)
    half = np.pi / np.sqrt(loop.k / reduced)  # on a tooth, of drive and load left to themselves
    for flight in np.linspace(0.2, 5, 20) * half:
        times, _, solved, _ = fsolve(wrong, (flight, half), full_output=True)
        if solved == 1 and times[0] > 0 and 0 < times[1] < 1.6 * half:
            break
    else:
        raise RuntimeError(f"no limit cycle of {loop}")
    start, meets = states(times)
    swings = [*_follow(free, start, times[0]), *_follow(met, np.append(meets, 1), times[1])]
    return 1 / (2 * times.sum()), float(np.abs([state[2] for state in swings]).max())


def _follow(matrix: np.ndarray, state: np.ndarray, seconds: float, steps: int = 500) -> Iterator[np.ndarray]:
    """Yield the states of a linear system at equal steps."""
    step = expm(matrix * seconds / steps)
    for _ in range(steps):
        state = step @ state
        yield state


def draw_robot() -> Figure:
    """The arm, its loop at a slow reversal, how far it sags, and how it hunts."""
    figure = Figure(figsize=(9.5, 7.4), layout="constrained")
    axes = figure.subplot_mosaic([["arm", "reversal"], ["sag", "hunting"]])
    _draw_arm(axes["arm"])
    _draw_reversal(axes["reversal"])
    _draw_sag(axes["sag"], axes["arm"])
    _draw_hunting(axes["hunting"])
    return figure


def _draw_arm(axes) -> None:
    model = load("robot_arm").compile()
    data = mujoco.MjData(model)
    data.qpos[:] = REACH
    mujoco.mj_kinematics(model, data)
    points = np.vstack((np.zeros(3), data.xpos[1:], data.site("tip").xpos))
    out = points[:, :2] @ (np.cos(REACH[0]), np.sin(REACH[0]))  # within the plane of the upper arm
    axes.plot(out, points[:, 2], "-", color="0.6", linewidth=7, solid_capstyle="round", solid_joinstyle="round")
    axes.plot(out[1:-1], points[1:-1, 2], "o", color="k", markersize=5)
    sides = {"base": (0.03, -0.05), "shoulder": (0.05, -0.01), "elbow": (-0.15, -0.02), "roll": (-0.04, 0.05)}
    for i, joint in enumerate(TEETH):
        dx, dz = sides.get(joint, (0.04, 0.0))
        axes.annotate(joint, (out[i + 1] + dx, points[i + 1, 2] + dz))
    axes.axhline(0, color="0.6", linewidth=1)
    axes.set(
        aspect="equal", adjustable="datalim", xlabel="forward (m)", ylabel="height (m)", title="the arm, held in a pose"
    )


def _draw_reversal(axes) -> None:
    gap = TEETH["spin"][0]
    for recipe, colour, name in ((True, DEFAULT, "two hinges"), (False, ASKED, "add_backlash")):
        drive, moved = reversal(robot(recipe, OTHERS, 5e-4))
        axes.plot(drive / ARCMIN, moved / ARCMIN, colour, linewidth=4 if recipe else 1.5, label=name)
        print(
            f"reversal, {name}: lost motion {lost_motion(drive, moved) / ARCMIN:.4f}', 2 gap = {2 * gap / ARCMIN:.4f}'"
        )
    ends = np.array([-30.0, 30.0])
    for side in (-1, 1):
        axes.plot(ends, ends + side * gap / ARCMIN, "k:", linewidth=1, label="drive ± gap" if side > 0 else None)
    axes.set(xlabel="drive (arcmin)", ylabel="load (arcmin)", title="slow reversal of the spin joint")
    axes.legend(loc="upper left")


def lost_motion(drive: np.ndarray, moved: np.ndarray) -> float:
    """By how much less the load moves than the drive, rad."""
    return float(np.ptp(drive) - np.ptp(moved))


def _draw_sag(axes, arm) -> None:
    joints = list(TEETH)[1:5]
    place, found, usual = np.arange(4), sag(robot()), sag(robot(recipe=True))
    bars = (
        ("gap + torque / k", found.expected, "0.7"), ("add_backlash", found.measured, ASKED),
        ("two hinges", usual.measured, DEFAULT),
    )  # fmt: skip
    for i, (name, values, colour) in enumerate(bars):
        axes.bar(place + 0.27 * (i - 1), np.abs(values[1:5]) / ARCMIN, 0.25, color=colour, label=name)
    axes.set(ylabel="load behind drive (arcmin)", title="sag under gravity, unseen by the encoders")
    axes.set_xticks(place, joints)
    axes.set_ylim(0, 14)
    axes.legend(loc="upper left", ncols=2)
    arm.text(
        0.97, 0.06, f"tip off by {1e3 * found.tip:.2f} mm\nclosed form {1e3 * found.tip_expected:.2f} mm\n"
        f"two hinges {1e3 * usual.tip:.2f} mm", transform=arm.transAxes, va="bottom", ha="right",
    )  # fmt: skip
    off = np.nanmax(np.abs(found.measured / found.expected - 1))
    print(f"sag: off by {off:.1e}; tip {1e3 * found.tip:.4f} mm, closed form {1e3 * found.tip_expected:.4f} mm, "
          f"two hinges {1e3 * usual.tip:.4f} mm")  # fmt: skip


def _draw_hunting(axes) -> None:
    for recipe, colour, name in ((True, DEFAULT, "two hinges"), (False, ASKED, "add_backlash")):
        time, _, moved = hunting(robot(recipe, OTHERS, 5e-5))
        late = time > time[-1] - 0.2
        axes.plot(1e3 * (time[late] - time[late][0]), moved[late] / ARCMIN, colour, label=name)
        found = rings(time[late], moved[late] - moved[late].mean()), np.ptp(moved[late]) / 2 / ARCMIN
        print(f"hunting, {name}: {found[0]:.3f} Hz, ±{found[1]:.3f}'")
    for (frequency, amplitude), style, name in (
        (limit_cycle(), "-", "exact"), (first_harmonic(), ":", "describing function")
    ):  # fmt: skip
        print(f"hunting, {name}: {frequency:.3f} Hz, ±{amplitude / ARCMIN:.3f}'")
        for side in (-1, 1):
            label = f"amplitude, {name} ({frequency:.1f} Hz)" if side > 0 else None
            axes.axhline(side * amplitude / ARCMIN, color="k", linestyle=style, linewidth=1, label=label)
    axes.set(xlabel="time (ms)", ylabel="load (arcmin)", title="the servo sees the load: it hunts", xlim=(0, 200))
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.6 * (high - low))
    axes.legend(loc="upper left")


# A door latch with play

LATCH_GAP, LATCH_K, LATCH_C = 1e-3, 1e6, 600.0
ARM, LEAF = 0.91, 0.81  # m, of the bolt about the hinge; m³, area of the leaf times the lever of its middle
DOOR_INERTIA = 25 * (0.9**2 + 0.04**2) / 12 + 25 * 0.45**2 + 0.1 * (ARM**2 + 0.4 * 0.008**2)
SEAL, SEAL_C = 40.0, 0.5
HUM = 8.0  # Hz, of the pressure


def latch(default: bool = False, timestep: float = 2e-4) -> mujoco.MjModel:
    """The closed door, with contacts in N/m or as MuJoCo makes them."""
    spec = load("door_latch")
    spec.option.timestep = timestep
    if not default:
        physical.contact(spec, ("bolt", "stop"), LATCH_K, LATCH_C)
        physical.contact(spec, ("bolt", "lip"), LATCH_K, LATCH_C)
        physical.joint_limit(spec, "bolt", k=1e5, c=50)
    return spec.compile() if default else physical.compile(spec)


def swing(pressure: float) -> complex:
    """Angle, rad, of the door that touches nothing: of a mass on spring and damper under a sine."""
    omega = 2 * np.pi * HUM
    return LEAF * pressure / (SEAL - DOOR_INERTIA * omega**2 + 1j * SEAL_C * omega)


def first_contact() -> float:
    """Pressure, Pa, above which the bolt meets the strike plate; it is there at an angle whose sine is gap over arm."""
    return float(np.arcsin(LATCH_GAP / ARM) / abs(swing(1.0)))


def rattle(model: mujoco.MjModel, pressures: Sequence[float], seconds: float) -> Motion:
    """March the door from the motion that it would have without strike plate."""
    time = (np.arange(round(seconds / model.opt.timestep)) + 0.5) * model.opt.timestep  # of a step's middle
    control = np.multiply.outer(pressures, np.cos(2 * np.pi * HUM * time))[..., None]
    starts = np.array([swing(p) for p in pressures])
    zero = np.zeros(len(pressures))
    qpos, qvel = np.stack((starts.real, zero), 1), np.stack(((2j * np.pi * HUM * starts).real, zero), 1)
    return march(model, seconds, qpos, qvel, control)


def bolt(motion: Motion) -> np.ndarray:
    """How far the bolt is off the middle of its play, m, (n, n_t)."""
    return (ARM + motion.qpos[..., 1]) * np.sin(motion.qpos[..., 0])


def pressed(default: bool = False, pressure: float = 60.0) -> tuple[Motion, float, float]:
    """Motion of the door that is pressed on the stop and tapped, depth, m, and frequency, Hz."""
    start, steps = (np.arcsin(LATCH_GAP / ARM), 0.0), 10000
    push = np.full((1, steps, 1), pressure)
    rest = march(latch(default), 1.0, start, control=push)
    tapped = march(latch(default, 5e-5), 0.15, rest.qpos[0, -1], (2e-4, 0.0), push)
    about = bolt(rest)[0, -1]
    return tapped, float(about - LATCH_GAP), rings(tapped.time, bolt(tapped)[0] - about)


def pressed_expected(pressure: float = 60.0) -> tuple[float, float]:
    """Depth and frequency of a lever that two springs and dampers hold, its angle small."""
    depth = (LEAF * pressure - SEAL * LATCH_GAP / ARM) / (LATCH_K * ARM + SEAL / ARM)
    return depth, ringing(SEAL + LATCH_K * ARM**2, DOOR_INERTIA, SEAL_C + LATCH_C * ARM**2)


def draw_latch() -> Figure:
    """Motions below and above first contact, peak force over pressure, ringing on the stop."""
    figure = Figure(figsize=(9.5, 6.6), layout="constrained")
    axes = figure.subplot_mosaic([["motion", "motion"], ["force", "rings"]])
    _draw_motion(axes["motion"], first_contact())
    _draw_force(axes["force"], first_contact())
    _draw_pressed(axes["rings"])
    return figure


def _draw_motion(axes, first: float) -> None:
    for default, share, colour, name in (
        (False, 0.9, "0.4", ""), (True, 2.0, DEFAULT, ", default solref"), (False, 2.0, ASKED, ", physical.contact")
    ):  # fmt: skip
        motion = rattle(latch(default), [share * first], 2.0)
        late = motion.time > 1.5
        axes.plot(motion.time[late] - 1.5, 1e3 * bolt(motion)[0, late], colour, label=f"{share * first:.0f} Pa{name}")
    for side in (-1, 1):
        axes.axhspan(side * 1e3 * LATCH_GAP, side * 5, color="0.92", linewidth=0)
    axes.text(0.004, 2.9, "stop", va="top")
    axes.text(0.004, -2.9, "lip of the strike plate", va="bottom")
    axes.set(xlim=(0, 0.5), ylim=(-3, 4.2), xlabel="time (s)", ylabel="bolt (mm)")
    axes.set_title(f"closed door under a pressure of {HUM:g} Hz")
    axes.legend(loc="upper center", ncols=3)


def _draw_force(axes, first: float) -> None:
    pressures = first * np.linspace(0.05, 2.95, 30)
    for default, colour, name in ((False, ASKED, "physical.contact"), (True, DEFAULT, "default solref")):
        motion = rattle(latch(default), pressures, 2.0)
        axes.plot(pressures, motion.sensors[:, motion.time > 1, 0].max(axis=1), ".-", color=colour, label=name)
    axes.axvline(first, color="k", linestyle=":", label=f"first contact at {first:.2f} Pa (closed form)")
    axes.set(xlabel="amplitude of the pressure (Pa)", ylabel="largest force (N)", title="impacts", ylim=(-20, 740))
    axes.legend(loc="upper left")
    print(f"latch: first contact by closed form {first:.4f} Pa")


def _draw_pressed(axes) -> None:
    depth, frequency = pressed_expected()
    for default, colour, name in ((False, ASKED, "physical.contact"), (True, DEFAULT, "default solref")):
        tapped, deep, heard = pressed(default)
        told = f"{heard:.2f} Hz" if np.isfinite(heard) else "does not ring"
        axes.plot(
            1e3 * tapped.time, 1e6 * (bolt(tapped)[0] - LATCH_GAP - deep), colour,
            label=f"{name}: {told}, {1e6 * deep:.1f} µm deep",
        )  # fmt: skip
        print(f"latch, {name}: {1e6 * deep:.6g} µm deep, {1e6 * depth:.6g} asked; {told}, {frequency:.5g} Hz asked")
    axes.plot([], [], " ", label=f"closed form: {frequency:.2f} Hz, {1e6 * depth:.1f} µm deep")
    axes.set(xlabel="time (ms)", ylabel="bolt, about its rest (µm)", title="pressed on the stop by 60 Pa and tapped")
    axes.set_ylim(-0.6, 4.2)
    axes.legend(loc="upper right")


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
    found, usual = orbit(ours, start, speed, 0.2), orbit(boxes, start, speed, 0.2)
    fall = figure.add_subplot(layout[0], projection="3d")
    above, depth = figure.add_subplot(layout[1]), figure.add_subplot(layout[2])
    _draw_fall(fall, found)
    _draw_above(above, found, usual)
    _draw_depth(depth, ours, boxes)
    radius, frequency = whirl(found.momentum[0, 0])
    for name, way in (("annular clearance", found), ("boxes", usual)):
        print(f"tube, {name}: radius {1e3 * way.radius[0]:.6f} mm, {way.frequency[0]:.5f} Hz; closed form "
              f"{1e3 * radius:.6f} mm, {frequency:.5f} Hz")  # fmt: skip
    return figure


def _draw_fall(axes, found: Orbit) -> None:
    x, y, z = 1e3 * found.place[0].T
    axes.plot(x, y, z, ASKED, linewidth=1)
    turn = np.linspace(0, 2 * np.pi, 60)
    for height in (z.min(), 0):
        axes.plot(np.cos(turn), np.sin(turn), height, "k", linewidth=0.8)
    axes.set(xlabel="x (mm)", ylabel="y (mm)", title="centre of the falling ball")
    axes.set_zlabel("height (mm)", labelpad=20)
    axes.tick_params(axis="z", pad=7)
    axes.set(xticks=(-1, 0, 1), yticks=(-1, 0, 1), zticks=(-200, -100, 0))
    axes.set_box_aspect((1, 1, 1.7), zoom=0.88)


def _draw_above(axes, found: Orbit, usual: Orbit) -> None:
    for way, colour, name in ((usual, DEFAULT, f"{STAVES} boxes, default solref"), (found, ASKED, "annular clearance")):
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
            omega2 = (2 * np.pi * way.frequency) ** 2
            off = (way.radius - TUBE_GAP) / (BALL * omega2 * way.radius / TUBE_K) - 1
            print(f"tube: depth off by {np.max(np.abs(off)):.1e}")
            continue
        reach = np.hypot(*np.moveaxis(way.place[..., :2], -1, 0)).max(axis=1) - TUBE_GAP
        axes.loglog(speeds / TUBE_GAP / (2 * np.pi), 1e6 * reach, "s", color=colour, label=name)
    frequency = np.geomspace(2, 240, 50)
    share = BALL * (2 * np.pi * frequency) ** 2 / TUBE_K
    axes.plot(frequency, 1e6 * TUBE_GAP * share / (1 - share), "k:", label="m ω² R / k")
    axes.set(xlabel="whirl frequency (Hz)", ylabel="depth in the wall (µm)", title="pressed out by the whirl")
    axes.legend()


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
        rate = np.gradient(depth, 5e-6)
        law = SAND.stiffness * depth[inside] ** 1.5 * (1 + SAND.kappa * rate[inside] / speed)
        loops.plot(
            1e6 * depth[inside], np.maximum(law, 0), "k:", lw=1, label="K δ^1.5 (1 + κ δ̇/v)" if speed == 0.6 else None
        )
    loops.set(xlabel="depth (µm)", ylabel="force (N)", title="a ball hits the floor (Hunt and Crossley, e = 0.5)")
    loops.set_xlim(left=-20)
    loops.legend()
    return figure


FIGURES: dict[str, Callable[[], Figure]] = {
    "default": draw_floor, "slope": draw_slope, "robot": draw_robot, "latch": draw_latch, "tube": draw_tube
}  # fmt: skip


def main(arguments: list[str] | None = None) -> None:
    """Make the figures of docs/physical.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "docs")
    parser.add_argument("--only", nargs="*", choices=FIGURES, default=list(FIGURES))
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    for name in options.only:
        FIGURES[name]().savefig(options.out / f"physical_{name}.png", dpi=100)


if __name__ == "__main__":
    main()
