"""Vibrations that a sweep from rest does not meet: a doubled period, and isolas found from random starts."""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import clearance_mj as cm
from experiments.periodic.responses import curve, one_sided
from experiments.script import run

ROOT = Path(__file__).parents[2]
TURN = 2 * np.pi


def between_walls() -> cm.Rig:
    """Return 1 kg on 1 N/m, between walls of 3 N/m at ± 1 m."""
    matrices = cm.structure.Matrices("m-kg-s", mass=[[1.0]], stiffness=[[1.0]], damping=[[0.1]], dofs=["1:X"])
    walls = cm.Bushing("1:X", 1.0, 0.0, cm.Grease(0.0), cm.Contact(3.0))
    return cm.Rig(
        "between walls", None, (walls,), (cm.Sensor(1, "1:X"),), shaker=cm.Shaker("force", "1:X"), structure=matrices
    )


def draw() -> Figure:
    """A period that doubles beside isolas with the shares of the starts."""
    figure = Figure(figsize=(9, 4), layout="constrained")
    axes = figure.subplot_mosaic([["doubled", "isolas"], ["doubled", "shares"]], height_ratios=(3, 1))
    _doubled(axes["doubled"])
    _isolas(axes["isolas"], axes["shares"])
    return figure


def _doubled(axes) -> None:
    branch = cm.periodic.follow_response(
        cm.Model(one_sided(), cm.ConstantLaw(100.0, 0.0)), 0.1, (0.8 / TURN, 0.5 / TURN), 61, 1024
    )
    curve(axes, branch, branch.frequency * TURN, branch.amplitude("displacement")[:, 1], "C0", "period of the force")
    *_, point = (point for point in branch.special if point.kind == "period doubling")
    twice = cm.periodic.follow_doubled(branch, point)
    print(f"one-sided spring: doubled from {point.frequency * TURN:.5f} rad/s; {twice.ended}")
    curve(axes, twice, twice.frequency * TURN, twice.amplitude("displacement")[:, 1], "C3", "twice that")
    axes.set(xlim=(0.73, 0.76), ylim=(0.94, 1.12), xlabel="angular frequency (rad/s)")
    axes.set_ylabel("amplitude of the second mass (m)")
    axes.legend()


def _isolas(upper, lower) -> None:
    branch = cm.periodic.follow_response(
        cm.Model(between_walls(), cm.ConstantLaw(3.0, 0.0)), 8.0, (2 / TURN, 9 / TURN), 13
    )
    isolas = cm.periodic.find_isolas(branch, n_starts=32, frequencies=16, progress=True)
    base = np.zeros(isolas.frequency.size)
    for i, (each, fraction) in enumerate(zip((branch, *isolas.branches), isolas.basins.T)):
        print(f"between walls, {each.periods} periods: {each.frequency.min():.4f} to {each.frequency.max():.4f} Hz")
        name = "period of the force" if each is branch else f"{each.periods} of them"
        curve(upper, each, each.frequency, each.amplitude("displacement")[:, 0], f"C{i}", name)
        lower.bar(isolas.frequency, fraction, 0.035, base, color=f"C{i}")
        base = base + fraction
    upper.set(yscale="log", ylabel="amplitude (m)")
    upper.legend()
    lower.set(xlabel="frequency (Hz)", ylabel="share of starts", ylim=(0, 1))
    lower.sharex(upper)


def main(out: Path = ROOT / "docs" / "subharmonics.png") -> None:
    """Make a figure of docs/periodic.md."""
    draw().savefig(out, dpi=110)


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
