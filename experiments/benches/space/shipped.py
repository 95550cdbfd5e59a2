"""The shipped dataset of a turning rig, data/turning_rig: a virtual pump with short records.

python -m experiments.benches.space.shipped data/turning_rig

What really stands there is `shipped_bench().truth()`; it is not in the folder.
"""

import sys
from pathlib import Path

import numpy as np

from clearance_mj import excitation
from clearance_mj.rig import Spin
from experiments.script import run
from experiments.testrig.records import BAND, FS

from .bench import Bench, make_bench
from .plans import LEVELS, STREAM, Plan, driven, orbits, run_up, turning
from .records import write_records

COMMAND = "python -m experiments.benches.space.shipped"
SEED, KIND = 101, "pump"
LEVEL = 6.0  # m/s² RMS, to validate
SPEEDS = (0.4, 0.8)  # of the top speed, of orbits to validate


def shipped_bench() -> Bench:
    """Return the bench of data/turning_rig."""
    return make_bench(SEED, KIND, name="turning rig")


def shipped_plans(bench: Bench) -> list[Plan]:
    """Return its records: some 60 s, of which the longest have 10."""
    levels, top = LEVELS[KIND], bench.top_speed
    seeds = iter(np.random.default_rng((bench.seed, STREAM)).integers(1, 2**31, 20).tolist())
    first, second, other = (Spin(fraction * top) for fraction in levels.spins)
    taken = [turning("slow_roll", "identify", 2.5, Spin(levels.slow_roll * top))]
    for name, axis, spin in (("ramp_y", "Y", first), ("ramp_z", "Z", second)):
        start, end = levels.ramp
        shake = excitation.level_ramp(10.0, FS, BAND, start, end, next(seeds))
        words = f"random 5-220 Hz, level rising from {start:g} to {end:g} m/s² RMS"
        taken.append(driven(name, "identify", shake, words, spin, axis))
    taken.append(run_up("run_up", "identify", 5.0, top))
    for axis in "YZ":
        for letter in "ab":
            shake = excitation.random(6.0, FS, BAND, rms=LEVEL, seed=next(seeds))
            name = f"level_{LEVEL:g}_{axis.lower()}_{letter}"
            taken.append(driven(name, "validate", shake, "stationary random 5-220 Hz", other, axis, LEVEL))
    for letter in "ab":
        taken += orbits(f"orbit_{letter}", "validate", SPEEDS, 1.5, top)
        taken.append(run_up(f"run_up_{letter}", "validate", 4.0, top, accelerometers=False))
    return taken


def main(path: Path) -> None:
    """Write the dataset, such as data/turning_rig."""
    bench = shipped_bench()
    write_records(bench, path, list(enumerate(shipped_plans(bench))), COMMAND)


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
