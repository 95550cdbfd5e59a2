"""A door whose latch rattles."""

from collections.abc import Sequence

import mujoco
import mujoco.rollout
import numpy as np
from matplotlib.figure import Figure

import clearance_mj.physical as physical
from experiments.physical.scene import ASKED, DEFAULT, Motion, load, march, ringing, rings

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
    """Return the distance of the bolt from the middle of its play, m, (n, n_t)."""
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
    for default, fraction, colour, name in (
        (False, 0.9, "0.4", ""), (True, 2.0, DEFAULT, ", default solref"), (False, 2.0, ASKED, ", physical.contact")
    ):  # fmt: skip
        motion = rattle(latch(default), [fraction * first], 2.0)
        late = motion.time > 1.5
        axes.plot(
            motion.time[late] - 1.5, 1e3 * bolt(motion)[0, late], colour, label=f"{fraction * first:.0f} Pa{name}"
        )
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
        pitch = f"{heard:.2f} Hz" if np.isfinite(heard) else "does not ring"
        axes.plot(
            1e3 * tapped.time, 1e6 * (bolt(tapped)[0] - LATCH_GAP - deep), colour,
            label=f"{name}: {pitch}, {1e6 * deep:.1f} µm deep",
        )  # fmt: skip
        print(f"latch, {name}: {1e6 * deep:.6g} µm deep, {1e6 * depth:.6g} asked; {pitch}, {frequency:.5g} Hz asked")
    axes.plot([], [], " ", label=f"closed form: {frequency:.2f} Hz, {1e6 * depth:.1f} µm deep")
    axes.set(xlabel="time (ms)", ylabel="bolt, about its rest (µm)", title="pressed on the stop by 60 Pa and tapped")
    axes.set_ylim(-0.6, 4.2)
    axes.legend(loc="upper right")
