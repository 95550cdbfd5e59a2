"""Draw the figures of docs/wear.md: two lives under a sine, and what is left of a virtual machine.

    python -m experiments.benches.wear.figures --out docs

The first life reaches its limit, the second one jumps on the way.
"""

import sys
from pathlib import Path

import numpy as np

from clearance_mj import Rig, beam
from clearance_mj.core.drawing import canvas
from clearance_mj.wear import Sine, predict_life, predict_remaining
from experiments.benches.wear.accelerated import LIMIT, RIG, worn_model
from experiments.benches.wear.machine import make_machine
from experiments.script import run

COEFFICIENT = 1e-12  # m²/N


def main(out: Path = Path("docs")) -> None:
    """Write both figures, and print what they say."""
    rig = Rig.load(RIG)
    one = rig.replace(bushings=rig.bushings[:1])
    swept = 0.9 * float(beam.natural_frequencies(one, 2)[1])
    figure = canvas(3.2)
    left, right = figure.subplots(1, 2)
    for axes, of, sine in ((left, rig, Sine(39.0, 5.0)), (right, one, Sine(42.0, 4.0, swept_from=swept))):
        life = predict_life(worn_model(of, COEFFICIENT), sine, LIMIT)
        print(*life.words(), sep="\n")
        life.draw_on(axes)
    figure.savefig(out / "wear.png", dpi=150)
    machine = make_machine(0)
    assert machine is not None
    limits = {f"bushings[{j}]": float(limit) for j, limit in enumerate(machine.limit) if np.isfinite(limit)}
    remaining = predict_remaining(machine.model, machine.operation, machine.history(), limits)
    print(*remaining.words(), sep="\n")
    remaining.plot().savefig(out / "wear_remaining.png", dpi=150)


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
