"""The dataset of a bench in space: its records in the package's format, and truth.toml, which nothing reads."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tomli_w

from clearance_mj import Channel, Record, SimulationError, write_dataset
from clearance_mj.rig import BASE_NODE, SHAKER_NODE, Spin
from clearance_mj.signals import sampling
from experiments.testrig.records import FS, NOISE, Signal, convert

from . import motion
from .bench import Bench
from .plans import Plan, plans

FACTOR = 8  # time steps per sample; half as long ones change FRFs by 0.006 dB (RMS) where motion is not chaotic
BLOCK = 2048  # samples between two filterings
SETTLING = 0.4  # s, with much damping and without unbalance, after which the shaft rests
SETTLING_DAMPING = 0.3
RUN_IN = 1.5  # s before a record, at the speed at which it begins; unbalance rises within the first half of it
KEYPHASOR_NODE = 400
PULSE = math.radians(60)  # of the shaft's turn, in which the keyphasor sees its mark
PULSE_HEIGHT = 5.0  # V
STREAM = 7  # second word of the seeds of noise


@dataclass(frozen=True)
class Motion:
    """Readings of ideal sensors at their true places."""

    acceleration: np.ndarray  #: (n_stations, 2, n_t) absolute, along y and z, m/s²
    displacement: np.ndarray  #: (n_bushings, 2, n_t) along y and z from where the shaft rests when it stands still, m
    rest: np.ndarray  #: (n_bushings, 2) displacement at rest from the unloaded shaft, m


def simulate(
    bench: Bench, base: np.ndarray | None = None, force: np.ndarray | None = None, spin: Spin | None = None,
    size: int | None = None, fs: float = FS, factor: int = FACTOR,
) -> Motion:  # fmt: skip
    """Simulate a bench from where it rests, or turns steadily.

    ``base`` and ``force``: (2, n_t) accelerations of the base and hammer forces along y and z; ``size``: number of
    samples n_t where neither is given. The shaft rests before the record under gravity, at the first speed of ``spin``.
    """
    spin = spin or Spin(0.0)
    given = [part for part in (base, force) if part is not None]
    count = given[0].shape[1] if given else size or 0
    step, lead = 1 / (fs * factor), round(RUN_IN * fs)
    bushings = bench.bushings()
    settling, real = bench.scheme(step, SETTLING_DAMPING), bench.scheme(step)
    state = motion.unloaded(real, bushings)
    stations, probes = 2 * len(bench.stations), 2 * len(bench.probes)

    def advance(scheme: motion.Scheme, inputs: np.ndarray, start: float) -> np.ndarray:
        out = np.empty((len(inputs), stations + probes))
        done = motion.march(scheme, state, bushings, inputs, out)
        if done < len(inputs) or not np.isfinite(out[-1]).all():
            raise SimulationError(f"bench {bench.name}: no convergence at {start + done * step:.6f} s")
        return out

    quiet = np.zeros((round(SETTLING * fs * factor), 7))
    rest = advance(settling, quiet, -RUN_IN - 2 * SETTLING)[-1, stations:]  # standing still: zero of the probes
    quiet[:, motion.SPIN] = spin.speed
    advance(settling, quiet, -RUN_IN - SETTLING)
    decimator, slow = sampling.Decimator(stations + probes, factor), []
    for start, inputs in _inputs(base, force, spin, count, lead, fs, factor):
        out = advance(real, inputs, start)
        out[:, stations:] -= rest
        slow.append(decimator.push(out))
    samples = np.concatenate((*slow, decimator.flush()))[lead : lead + count].T
    shape = (-1, 2, count)
    return Motion(samples[:stations].reshape(shape), samples[stations:].reshape(shape), rest.reshape(-1, 2))


def _inputs(
    base: np.ndarray | None, force: np.ndarray | None, spin: Spin, count: int, lead: int, fs: float, factor: int
) -> Iterator[tuple[float, np.ndarray]]:
    """Blocks of the inputs of `motion.march` from the run-in on, and the time at which each begins, s."""
    ahead = sampling.lowpass(factor).size // 2 // factor + 1
    total = lead + count + ahead
    fast = np.zeros((4, total * factor))
    for first, part in ((motion.BASE_Y, base), (motion.FORCE_Y, force)):
        if part is not None:
            for axis in range(2):
                late = np.concatenate((np.zeros(lead), part[axis], np.zeros(ahead)))
                fast[first + axis] = sampling.interpolate(late, factor)
    for start in range(0, total * factor, BLOCK * factor):
        inputs = np.zeros((min(BLOCK * factor, total * factor - start), motion.INPUTS))
        time = (start + np.arange(len(inputs))) / (fs * factor) - lead / fs
        speed, angle = spin.speed_at(np.maximum(time, 0.0)), turned(spin, time)
        rate = np.where((time >= 0) & (time < spin.ramp_end), spin.rate, 0.0)
        ramp = np.clip((time + lead / fs) / (0.5 * RUN_IN), 0.0, 1.0)
        smooth = ramp**2 * (3 - 2 * ramp)
        inputs[:, :4] = fast[:, start : start + len(inputs)].T
        inputs[:, motion.SPIN] = speed
        y, z = motion.whirl(angle, speed, rate)
        turning = y, z, *(wave(times) for times in np.outer(angle, (1, 2)).T for wave in (np.cos, np.sin))
        inputs[:, motion.WHIRL_Y :] = smooth[:, None] * np.column_stack(turning)
        yield time[0], inputs


def turned(spin: Spin, time: np.ndarray) -> np.ndarray:
    """Return the shaft's angle, rad, at times of which those before 0 are at the first speed."""
    return spin.angle_at(np.maximum(time, 0.0)) + spin.speed * np.minimum(time, 0.0)


def keyphasor(angle: np.ndarray) -> np.ndarray:
    """Return the voltage of one raised-cosine pulse per turn, which passes half of its height at angle 0."""
    apart = (angle - (PULSE / 4) + np.pi) % (2 * np.pi) - np.pi
    return np.where(np.abs(apart) < PULSE / 2, PULSE_HEIGHT / 2 * (1 + np.cos(2 * np.pi * apart / PULSE)), 0.0)


def measure_channels(bench: Bench, plan: Plan, rng: np.random.Generator) -> list[Channel]:
    """Return a record as written: gains, cross-axis sensitivity, turned probes, run-out, noise, 24 bits."""
    driven = None if plan.excitation is None else np.outer(plan.direction[1:], plan.excitation.value)
    is_base = plan.kind == "base"
    spin = bench.structure.spin(plan.spin or Spin(0.0), plan.size / FS)
    moved = simulate(bench, driven if is_base else None, driven if plan.kind == "force" else None, spin, plan.size)
    signals = []
    if plan.excitation is not None:
        node = BASE_NODE if is_base else SHAKER_NODE
        name, quantity = ("base", "acceleration") if is_base else ("hammer", "force")
        signals.append((name, node, f"+{plan.axis}", quantity, plan.excitation.value))
    if plan.accelerometers:
        signals += _accelerometers(bench, moved)
    angle = turned(spin, np.arange(plan.size) / FS)
    signals += probe_signals(bench, moved, angle if plan.spin else None)
    if plan.spin:
        signals.append(("keyphasor", KEYPHASOR_NODE, "S", "unknown", keyphasor(angle)))
    return convert(signals, FS, rng)


def _accelerometers(bench: Bench, moved: Motion) -> list[Signal]:
    read = []
    for station, (y, z) in zip(bench.stations, moved.acceleration):
        read.append(station.gains[0] * (y + station.cross[0] * z))
        read.append(station.gains[1] * (z + station.cross[1] * y))
    return [
        (f"accelerometer {sensor.label}", sensor.node, sensor.label.split(":")[1], "acceleration", value)
        for sensor, value in zip(bench.rig.sensors, read)
    ]


def probe_signals(bench: Bench, moved: Motion, angle: np.ndarray | None) -> list[Signal]:
    signals = []
    labels = iter(bench.rig.probe_labels)
    for j, (pair, (y, z)) in enumerate(zip(bench.probes, moved.displacement), 1):
        c, s = math.cos(pair.angle), math.sin(pair.angle)
        for seen, at, gain in zip((c * y + s * z, c * z - s * y), (0.0, np.pi / 2), pair.gains):
            if angle is not None:  # each probe sees the same surface, a quarter of a turn apart
                for times, (size, phase) in enumerate(pair.runout, 1):
                    seen = seen + size * np.cos(times * (at + pair.angle - angle) + phase)
            node, direction = next(labels).split(":")
            signals.append((f"probe {direction[1]} in bushing {j}", int(node), direction, "displacement", gain * seen))
    return signals


def write_bench(
    bench: Bench, folder: str | Path, short: bool = False, roles: Sequence[str] = ("identify", "orbit", "validate"),
    kinds: Sequence[str] = ("base", "force", "spin"),
) -> None:  # fmt: skip
    """Simulate the records of a bench that have one of the roles and kinds, and write dataset and truth."""
    taken = list(enumerate(plans(bench, short)))
    write_records(bench, folder, [(i, plan) for i, plan in taken if plan.role in roles and plan.kind in kinds])
    (Path(folder) / "truth.toml").write_text(tomli_w.dumps(bench.truth()), encoding="utf-8")


def write_records(
    bench: Bench, folder: str | Path, taken: Sequence[tuple[int, Plan]], command: str = ""
) -> None:  # fmt: skip
    """Simulate records of a bench, each with the number that its noise is drawn from, and write the dataset."""
    records = []
    for i, plan in taken:
        channels = measure_channels(bench, plan, np.random.default_rng((bench.seed, STREAM, i)))
        provenance = {
            "source": f"synthetic: virtual bench {bench.name}, not measured",
            "noise": f"white, {NOISE:.0%} RMS of each channel",
        } | ({"command": command} if command else {})  # fmt: skip
        band = None if plan.excitation is None else plan.excitation.band
        direction = None if plan.excitation is None else plan.direction
        records.append(
            Record(
                plan.name, plan.role, bench.rig, FS, channels, plan.kind, plan.words, plan.level, None, band,
                provenance, direction, plan.spin or Spin(0.0),
            )
        )  # fmt: skip
    write_dataset(folder, bench.rig, records)
