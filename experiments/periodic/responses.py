"""Periodic responses of the Table-1 rig and of two masses with a one-sided spring, and how fast they are found."""

import sys
import time
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import clearance_mj as cm
from experiments.script import run

ROOT = Path(__file__).parents[2]
LAW = cm.ConstantLaw(7.8e3, 4.0)
LEVELS = (2.0, 4.0, 6.0, 8.0)  # m/s²
MARCHED = 6.0  # m/s², level at which a stepped sine is marched beside
STIFFNESS = np.array([[1.0, -1.0], [-1.0, 2.0]])
KINDS = {"fold": "o", "period doubling": "s", "Neimark-Sacker": "^", "branch point": "D"}


def one_sided() -> cm.Rig:
    """Return NLvib's third example, two masses of which one meets a spring of 100 N/m beyond a gap of 1 m."""
    matrices = cm.structure.Matrices(
        "m-kg-s", mass=np.eye(2), stiffness=STIFFNESS, damping=0.03 * STIFFNESS, dofs=["1:X", "2:X"]
    )
    stop = cm.Bushing("1:X", 1.0, 0.0, cm.Grease(0.0), cm.Contact(100.0), stops="upper")
    sensors = (cm.Sensor(1, "1:X"), cm.Sensor(2, "2:X"))
    return cm.Rig("one-sided spring", None, (stop,), sensors, shaker=cm.Shaker("force", "2:X"), structure=matrices)


def stepped(rig: cm.Rig, frequencies: np.ndarray) -> np.ndarray:
    """Amplitudes, m, of the first clearance's fundamental by the modal engine, one frequency after the other.

    The phase goes on from one frequency to the next, so that the motion stays on its branch.
    """
    fs, hold = 4096.0, 3.0
    phase = 2 * np.pi * np.cumsum(np.repeat(frequencies, int(hold * fs))) / fs
    excitation = cm.Excitation(MARCHED * np.cos(phase) * np.minimum(np.arange(phase.size) / fs, 1), fs)
    x = cm.simulate(rig, excitation, LAW, "modal").displacement[0]
    rows = (x * np.exp(-1j * phase)).reshape(frequencies.size, -1)[:, -int(fs) :]
    window = np.hanning(rows.shape[1])
    return 2 * np.abs(rows @ window) / window.sum()


def draw(rig: cm.Rig) -> Figure:
    """Responses over level, with a stepped sine, beside those of the one-sided spring."""
    figure = Figure(figsize=(9, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    for i, level in enumerate(LEVELS):
        branch = cm.periodic.follow_response(cm.Model(rig, LAW), level, (25.0, 60.0))
        amplitude = np.abs(branch.clearance_displacement[:, 0, 1]) / rig.bushings[0].gap
        curve(left, branch, branch.frequency, amplitude, f"C{i}", f"{level:g} m/s²")
    for marker, steps in (("4", np.arange(42.0, 49.0, 0.5)), ("3", np.arange(48.5, 41.9, -0.5))):
        marched = stepped(rig, steps) / rig.bushings[0].gap
        left.plot(steps, marched, marker, color="k", ms=6, label="marched up" if marker == "4" else "marched down")
    left.set(xlabel="frequency (Hz)", ylabel="displacement at the first bushing over its gap")
    left.legend(fontsize=7)
    turn = 2 * np.pi
    branch = cm.periodic.follow_response(
        cm.Model(one_sided(), cm.ConstantLaw(100.0, 0.0)), 0.1, (0.8 / turn, 0.5 / turn), 61
    )
    curve(right, branch, branch.frequency * turn, np.abs(branch.displacement[:, 1, 1]), "C0", None)
    for kind, marker in KINDS.items():
        points = [point for point in branch.special if point.kind == kind]
        for point in points:
            print(f"one-sided spring: {kind} at {turn * point.frequency:.6f} rad/s")
        if at := [point.index for point in points]:
            x, y = branch.frequency[at] * turn, np.abs(branch.displacement[at, 1, 1])
            right.plot(x, y, marker, color="k", mfc="w", label=kind)
    right.set(xlabel="angular frequency (rad/s)", ylabel="displacement of the second mass (m)")
    right.legend(fontsize=7)
    return figure


def curve(axes, branch: cm.periodic.Branch, x: np.ndarray, y: np.ndarray, colour: str, label: str | None) -> None:
    """Draw a branch, dashed where it is not stable."""
    axes.plot(x, y, "--", color=colour, lw=1)
    axes.plot(x, np.where(branch.stable, y, np.nan), color=colour, label=label)


def speed(rig: cm.Rig) -> None:
    """Print points per second, 21 harmonics and 256 samples."""
    for stability in (False, True):
        rates = []
        for _ in range(3):
            begun = time.perf_counter()
            points = sum(
                cm.periodic.follow_response(
                    cm.Model(rig, LAW), MARCHED, ends, 21, 256, stability=stability
                ).frequency.size
                for ends in ((30.0, 220.0), (220.0, 5.0))
            )
            rates.append(points / (time.perf_counter() - begun))
        print(f"{max(rates):.0f} points/s {'with' if stability else 'without'} stability")


def main(out: Path = ROOT / "docs" / "periodic.png") -> None:
    """Make the figure of docs/periodic.md."""
    rig = cm.Rig.load(ROOT / "models" / "table1_rig.toml")
    draw(rig).savefig(out, dpi=110)
    speed(rig)


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
