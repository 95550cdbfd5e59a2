"""Judge the twin on orbits: a virtual bench whose gap or oil changes in the middle of a record.

python -m experiments.benches.space.orbits_twin --folder results/benches/orbits
"""

import dataclasses
import math
import sys

import numpy as np

from clearance_mj import Channel, Record
from clearance_mj.rig import Spin
from experiments.benches.space.bench import Bench
from experiments.benches.space.records import (
    KEYPHASOR_NODE,
    Motion,
    keyphasor,
    probe_signals,
    simulate,
    turned,
)
from experiments.script import run
from experiments.testrig.records import FS, NOISE, digitise

CASES = (
    ("rotor", 1, 1950, {"gap": 0.5}, "a rub begins"), ("rotor", 1, 2400, {"gap": 1.1}, "the gap wears"),
    ("pump", 1, 2400, {"gap": 1.2}, "the seal wears"), ("pump", 1, 2400, {"viscosity": 0.6}, "the oil thins"),
    ("rotor", 2, 2400, {}, "nothing changes"), ("pump", 2, 2400, {}, "nothing changes"),
)  # fmt: skip
"""Kind, seed, rev/min, factors on what changes, in words"""


def changing(bench: Bench, speed: float, factors: dict[str, float], seconds: float) -> Record:
    """Return a record at one speed, rad/s, in whose middle numbers of all bushings change by factors."""
    half = round(seconds / 2 * FS)
    later = dataclasses.replace(
        bench,
        holes=tuple(dataclasses.replace(h, **{n: f * getattr(h, n) for n, f in factors.items()}) for h in bench.holes),
    )
    first, second = Spin(speed), Spin(speed, angle=math.fmod(speed * half / FS, 2 * math.pi))
    parts = [simulate(bench, spin=first, size=half), simulate(later, spin=second, size=half)]
    moved = np.concatenate([p.displacement for p in parts], axis=2)
    # Both halves count from where the shaft rested at first.
    moved[:, :, half:] += (parts[1].rest - parts[0].rest)[:, :, None]
    angle = turned(first, np.arange(2 * half) / FS)
    signals = probe_signals(bench, Motion(np.empty((0, 2, 0)), moved, parts[0].rest), angle)
    signals.append(("keyphasor", KEYPHASOR_NODE, "S", "unknown", keyphasor(angle)))
    rng = np.random.default_rng(bench.seed)
    channels = [
        Channel(
            name, node, axis, quantity, digitise(signal, NOISE, rng)[0], FS, unit="V" if quantity == "unknown" else ""
        )
        for name, node, axis, quantity, signal in signals
    ]
    return Record("operation", "orbit", bench.rig, FS, channels, "spin", spin=first)


def main() -> None:
    pass


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
