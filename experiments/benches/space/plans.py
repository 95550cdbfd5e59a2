"""Which records are taken of a bench in space."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from clearance_mj import Excitation, excitation
from clearance_mj.io.record import Kind, Role
from clearance_mj.rig import Spin
from experiments.testrig.records import BAND, FS

from .bench import Bench

TURNS = 3.5  # at least so many in a record of turning alone
STREAM = 11  # second word of the seeds of excitations
AXES = {"Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class Levels:
    """Levels at which a kind of bench is shaken, and its spins, as fractions of its top speed."""

    ramp: tuple[float, float]  # m/s² RMS, at the start and at the end
    validate: tuple[float, ...]  # m/s² RMS
    peaks: tuple[float, ...]  # N, of the hammer
    spins: tuple[float, float, float]  # two to identify, one to validate
    orbits: tuple[tuple[float, ...], tuple[float, ...]]  # to identify, to validate
    slow_roll: float = 0.05  # so slow that nothing but the run-out moves


LEVELS = {
    "steering": Levels(
        (1.0, 30.0), (3.0, 9.0, 22.0), (20.0, 60.0, 160.0, 320.0), (0.5, 1.0, 0.75),
        ((0.3, 0.5, 0.9), (0.4, 0.6, 0.8)), 0.15,
    ),
    "rotor": Levels(
        (0.3, 4.0), (0.5, 1.5, 3.0), (10.0, 30.0, 80.0, 160.0), (0.3, 0.5, 0.4), ((0.25, 0.5, 0.65), (0.35, 0.55, 0.7))
    ),
    "pump": Levels(
        (1.0, 20.0), (2.0, 6.0, 15.0), (20.0, 80.0, 200.0, 500.0), (0.3, 0.6, 0.45), ((0.3, 0.6, 0.9), (0.4, 0.7, 0.8))
    ),
}  # fmt: skip


@dataclass(frozen=True)
class Plan:
    """A record to take."""

    name: str
    role: Role
    kind: Kind  #: "spin" is turning alone
    size: int  #: samples
    words: str
    spin: Spin | None = None
    excitation: Excitation | None = None
    axis: str = "Z"
    level: float | None = None
    accelerometers: bool = True

    @property
    def direction(self) -> tuple[float, float, float]:
        """Unit vector along which the base moves or the hammer hits."""
        return AXES[self.axis]


def plans(bench: Bench, short: bool = False) -> list[Plan]:
    """Return the records of a bench; ``short``: half of the time, and one level to validate on."""
    time, levels = 0.5 if short else 1.0, LEVELS[bench.kind]
    seeds = iter(np.random.default_rng((bench.seed, STREAM)).integers(1, 2**31, 40).tolist())
    first, second, other = (Spin(fraction * bench.top_speed) for fraction in levels.spins)
    slow = levels.slow_roll * bench.top_speed
    taken = [turning("slow_roll", "identify", max(8 * time, TURNS * 2 * math.pi / slow), Spin(slow))]
    for name, axis, spin, seconds in (
        ("ramp_y", "Y", first, 24),
        ("ramp_z", "Z", first, 24),
        ("ramp_z2", "Z", second, 16),
    ):
        start, end = levels.ramp
        shake = excitation.level_ramp(seconds * time, FS, BAND, start, end, next(seeds))
        words = f"random 5-220 Hz, level rising from {start:g} to {end:g} m/s² RMS"
        taken.append(driven(name, "identify", shake, words, spin, axis))
    taken += [_hammer(axis, levels.peaks, max(10 * time, TURNS * 2 * math.pi / first.speed), first) for axis in "YZ"]
    taken.append(run_up("run_up", "identify", 20 * time, bench.top_speed))
    taken += orbits("orbit", "orbit", levels.orbits[0], 6 * time, bench.top_speed)
    for level in levels.validate[1:2] if short else levels.validate:
        for axis in "YZ":
            for letter in "ab":
                shake = excitation.random(16 * time, FS, BAND, rms=level, seed=next(seeds))
                name = f"level_{level:g}_{axis.lower()}_{letter}"
                taken.append(driven(name, "validate", shake, "stationary random 5-220 Hz", other, axis, level))
    for letter in "ab":
        taken += orbits(f"unseen_{letter}", "validate", levels.orbits[1], 4 * time, bench.top_speed)
        taken.append(run_up(f"run_up_{letter}", "validate", 12 * time, bench.top_speed))
    return taken


def driven(
    name: str, role: Role, what: Excitation, words: str, spin: Spin, axis: str, level: float | None = None
) -> Plan:
    """A record under an excitation along an axis, of a shaft at one speed."""
    text = f"{words} along {axis.lower()}, at {_rpm(spin.speed)}"
    kind: Kind = "force" if what.kind == "force" else "base"
    return Plan(name, role, kind, what.value.size, text, spin, what, axis, level)


def _hammer(axis: str, peaks: tuple[float, ...], seconds: float, spin: Spin) -> Plan:
    times = tuple((0.02 + i / len(peaks)) * seconds for i in range(len(peaks)))
    hits = excitation.hammer(seconds, FS, peak=peaks, width=0.004, times=times, kind="force")
    words = f"half-sine pulses of 4 ms and {', '.join(f'{p:g}' for p in peaks)} N"
    return driven(f"hammer_{axis.lower()}", "identify", hits, words, spin, axis)


def turning(name: str, role: Role, seconds: float, spin: Spin, accelerometers: bool = True) -> Plan:
    """A record of turning alone."""
    words = f"turns at {_rpm(spin.speed)}" + (f" to {_rpm(spin.until)}" if spin.until is not None else "")
    return Plan(name, role, "spin", round(seconds * FS), words, spin, accelerometers=accelerometers)


def run_up(name: str, role: Role, seconds: float, top: float, accelerometers: bool = True) -> Plan:
    """Return a run-up from 0.1 to 0.8 of the top speed; the last twentieth of its time is spent at that speed."""
    low, high = 0.1 * top, 0.8 * top
    return turning(name, role, seconds, Spin(low, (high - low) / (0.95 * seconds), high), accelerometers)


def orbits(name: str, role: Role, shares: tuple[float, ...], seconds: float, top: float) -> Iterator[Plan]:
    """Records of turning alone at shares of the top speed, of probes and keyphasor."""
    for fraction in shares:
        longer = max(seconds, TURNS * 2 * math.pi / (fraction * top))
        yield turning(f"{name}_{_rpm(fraction * top).split()[0]}", role, longer, Spin(fraction * top), False)


def _rpm(speed: float) -> str:
    return f"{speed * 30 / math.pi:.4g} rev/min"
