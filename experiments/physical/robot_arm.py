"""A robot arm with backlash in its gear: reversal, sag and hunting."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import mujoco
import mujoco.rollout
import numpy as np
from matplotlib.figure import Figure
from scipy.linalg import expm
from scipy.optimize import brentq, fsolve

import clearance_mj.physical as physical
from experiments.physical.scene import ARCMIN, ASKED, DEFAULT, load, march, rings

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
    directions, known = np.zeros((2, model.nq)), [model.joint(i).name for i in range(model.njnt)]
    drive = f"{joint} drive" if f"{joint} drive" in known else joint
    directions[0, model.joint(drive).qposadr] = 1
    for part in {joint, f"{joint} play"} & set(known):
        directions[1, model.joint(part).qposadr] = 1
    return directions


def reversal(model: mujoco.MjModel, period: float = 20.0, joint: str = "spin") -> tuple[np.ndarray, np.ndarray]:
    """Drive and load while a joint goes slowly to and fro by 30'; from the first quarter of a period on."""
    time = np.arange(round(1.5 * period / model.opt.timestep)) * model.opt.timestep
    control = np.zeros((1, time.size, model.nu))
    control[0, :, model.actuator(joint).id] = 30 * ARCMIN * np.sin(2 * np.pi * time / period)
    drive, moved = angles(model, joint) @ march(model, 1.5 * period, control=control).qpos[0].T
    return drive[time > period / 4], moved[time > period / 4]


class Sag(NamedTuple):
    """Return the angles by which loads hang behind their drives, rad, in the order of `TEETH`."""

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
    """Return the position of the tip of the rigid arm, m."""
    model = load("robot_arm").compile()
    data = mujoco.MjData(model)
    data.qpos[:] = pose
    mujoco.mj_kinematics(model, data)
    return data.site("tip").xpos.copy()


def hunting(model: mujoco.MjModel, seconds: float = 1.5) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, drive and load of the spin joint, whose servo sees the load's angle instead of its own."""
    data, servo, both = mujoco.MjData(model), model.actuator("spin").id, angles(model, "spin")
    data.joint("spin").qvel = 0.5
    samples = np.zeros((round(seconds / model.opt.timestep), 2))
    for row in samples:
        drive, moved = row[:] = both @ data.qpos
        data.ctrl[servo] = drive - moved
        mujoco.mj_step(model, data)
    return (np.arange(len(samples)) * model.opt.timestep, *samples.T)


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
        matrix(loop.k, loop.c), loop.k * loop.gap / loop.drive, -loop.k * loop.gap / loop.load,
    )  # fmt: skip
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
    """Return the angle by which the load moves less than the drive, rad."""
    return float(np.ptp(drive) - np.ptp(moved))


def _draw_sag(axes, arm) -> None:
    joints = list(TEETH)[1:5]
    place, ours, usual = np.arange(4), sag(robot()), sag(robot(recipe=True))
    bars = (
        ("gap + torque / k", ours.expected, "0.7"), ("add_backlash", ours.measured, ASKED),
        ("two hinges", usual.measured, DEFAULT),
    )  # fmt: skip
    for i, (name, values, colour) in enumerate(bars):
        axes.bar(place + 0.27 * (i - 1), np.abs(values[1:5]) / ARCMIN, 0.25, color=colour, label=name)
    axes.set(ylabel="load behind drive (arcmin)", title="sag under gravity, unseen by the encoders")
    axes.set_xticks(place, joints)
    axes.set_ylim(0, 14)
    axes.legend(loc="upper left", ncols=2)
    arm.text(
        0.97, 0.06, f"tip off by {1e3 * ours.tip:.2f} mm\nclosed form {1e3 * ours.tip_expected:.2f} mm\n"
        f"two hinges {1e3 * usual.tip:.2f} mm", transform=arm.transAxes, va="bottom", ha="right",
    )  # fmt: skip
    off = np.nanmax(np.abs(ours.measured / ours.expected - 1))
    print(f"sag: off by {off:.1e}; tip {1e3 * ours.tip:.4f} mm, closed form {1e3 * ours.tip_expected:.4f} mm, "
          f"two hinges {1e3 * usual.tip:.4f} mm")  # fmt: skip


def _draw_hunting(axes) -> None:
    for recipe, colour, name in ((True, DEFAULT, "two hinges"), (False, ASKED, "add_backlash")):
        time, _, moved = hunting(robot(recipe, OTHERS, 5e-5))
        late = time > time[-1] - 0.2
        axes.plot(1e3 * (time[late] - time[late][0]), moved[late] / ARCMIN, colour, label=name)
        ringing = rings(time[late], moved[late] - moved[late].mean()), np.ptp(moved[late]) / 2 / ARCMIN
        print(f"hunting, {name}: {ringing[0]:.3f} Hz, ±{ringing[1]:.3f}'")
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
