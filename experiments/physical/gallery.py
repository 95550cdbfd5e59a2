"""Gallery of MuJoCo models with physical contacts and play: `python -m experiments.physical.gallery --out FOLDER`.

A quadruped on its feet, a ball set down on a floor, a box on a slope, a robot with backlash, a door latch with play and
a ball in a tube, each against its closed form and beside what MuJoCo's default solref, its friction, two hinges or a
tube of boxes give. Figures by matplotlib alone.
"""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

from matplotlib.figure import Figure

from experiments.physical.ball_in_a_tube import draw_tube
from experiments.physical.ball_on_a_floor import draw_floor
from experiments.physical.box_on_a_slope import draw_slope
from experiments.physical.door_latch import draw_latch
from experiments.physical.quadruped import draw_quadruped
from experiments.physical.robot_arm import draw_robot
from experiments.physical.scene import ROOT
from experiments.script import run

FIGURES: dict[str, Callable[[], Figure]] = {
    "quadruped": draw_quadruped, "default": draw_floor, "slope": draw_slope, "robot": draw_robot,
    "latch": draw_latch, "tube": draw_tube,
}  # fmt: skip


def main(out: Path = ROOT / "docs", only: Sequence[Literal[*FIGURES]] = tuple(FIGURES)) -> None:
    """Make the figures of docs/physical.md."""
    out.mkdir(parents=True, exist_ok=True)
    for name in only:
        FIGURES[name]().savefig(out / f"physical_{name}.png", dpi=100)


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
