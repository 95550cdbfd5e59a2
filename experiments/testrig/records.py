"""The dataset of a virtual rig, the same bytes each time: its records as sensors and converter see them."""

import math
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from tqdm import tqdm

from clearance_mj.core.quantities import QUANTITIES
from clearance_mj.io.channels import Channel
from clearance_mj.io.dataset import Record, write_dataset
from clearance_mj.rig import Rig
from clearance_mj.signals import Excitation, Response, excitation
from experiments.testrig.bench import simulate_rig
from experiments.testrig.rigs import RIGS, Truth

COMMAND = "python -m experiments.testrig"
FS = 2048.0  # Hz
BAND = (5.0, 220.0)  # Hz
SINE = 1.0  # m/s², amplitude of the stepped sine
STEPS = (7.0, 8.5, 9.5, 10.1, 10.4, 10.6, 10.8, 11.0, 12.0, 20.0, 34.0, 40.0, 46.0, 55.0)
"""Hz, closest where the lowest mode jumps"""
HOLD = 1.5  # s of each
NOISE = 0.01  # RMS of a sensor's noise over the RMS of its signal
NOISE_STREAM = 2  # Second word of the noise's seed, so that no other generator of the same seed draws the same numbers
BITS = 24
THREADS = 2
Signal = tuple[str, int, str, str, np.ndarray]  # Name, node, direction, quantity, values


@dataclass(frozen=True)
class Plan:
    """A record to take: the base's excitation, and the seed of excitation and noise."""

    name: str
    role: Literal["identify", "validate", "sine"]
    excitation: Excitation
    description: str
    seed: int
    level: float | None = None


def plans() -> tuple[Plan, ...]:
    """The records of a dataset; the second seed of a level shows the repeatability."""
    ramp = excitation.level_ramp(32.0, FS, BAND, start_rms=0.3, end_rms=9.0, seed=1, kind="base")
    # The first pulse leaves the shaft inside the gap, the last drives it far into the bushings.
    peaks, times = (8.0, 25.0, 60.0, 140.0), (0.5, 4.5, 8.5, 12.5)
    hammer = excitation.hammer(16.0, FS, peak=peaks, width=0.006, times=times, kind="base")
    words = "free decays after half-sine base pulses of 6 ms and 8, 25, 60, 140 m/s² at 0.5, 4.5, 8.5, 12.5 s"
    sine = excitation.stepped_sine(2 * HOLD * len(STEPS), FS, [*STEPS, *STEPS[::-1]], SINE, kind="base")
    of_sine = "stepped sine of 1 m/s², 7 to 55 Hz up and down again, 1.5 s each"
    stationary = (
        _stationary(level, letter, 10 * i + j)
        for i, level in enumerate((0.5, 1.0, 2.0, 5.0, 8.0), 1)
        for j, letter in enumerate("ab", 1)
    )
    return (
        Plan("ramp", "identify", ramp, "random 5-220 Hz, level rising from 0.3 to 9 m/s² RMS", 1),
        Plan("hammer", "identify", hammer, words, 2),
        *stationary,
        Plan("sine_1", "sine", sine, of_sine, 3, SINE / math.sqrt(2)),
    )


def _stationary(level: float, letter: str, seed: int) -> Plan:
    shake = excitation.random(24.0, FS, BAND, rms=level, seed=seed, kind="base")
    return Plan(f"level_{level:g}_{letter}", "validate", shake, "stationary random 5-220 Hz", seed, level)


def digitise(signal: np.ndarray, noise: float, rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """Add white noise, RMS relative to the signal's, and convert to 24 bits over ± the next power of two of the peak.

    Returns the values, whole multiples of ``full_scale / 2**23`` that single precision stores exactly, and full_scale.
    """
    noisy = signal + noise * math.sqrt(np.mean(signal**2)) * rng.standard_normal(signal.size)
    _, exponent = math.frexp(np.abs(noisy).max())
    full_scale = math.ldexp(1.0, exponent)
    step = full_scale / 2 ** (BITS - 1)
    return np.minimum(np.rint(noisy / step), 2 ** (BITS - 1) - 1) * step, full_scale


def convert(signals: Iterable[Signal], fs: float, rng: np.random.Generator, noise: float = NOISE) -> list[Channel]:
    """Return channels as the converter writes them; their names say the range."""
    channels = []
    for name, node, direction, quantity, signal in signals:
        value, full_scale = digitise(signal, noise, rng)
        volts = "V" if quantity == "unknown" else ""
        label = f"{name}, synthetic, range +-{full_scale:.9g} {volts or QUANTITIES[quantity].ascii_unit}"
        channels.append(Channel(label, node, direction, quantity, value, fs, unit=volts))
    return channels


def acquire_channels(rig: Rig, response: Response, seed: int) -> list[Channel]:
    """Return base acceleration, accelerometers and probes as the converter writes them."""
    signals = [("base", 100, "+Z", "acceleration", response.excitation)]
    for sensor, value in zip(rig.sensors, response.acceleration):
        signals.append((f"accelerometer {sensor.node}", sensor.node, "+Z", "acceleration", value))
    probes = () if response.displacement is None else response.displacement
    for j, (label, value) in enumerate(zip(rig.probe_labels, probes), 1):
        signals.append((f"probe in bushing {j}", int(label.split(":")[0]), "+Z", "displacement", value))
    return convert(signals, response.fs, np.random.default_rng((seed, NOISE_STREAM)))


def take(plan: Plan, rig: Rig, truth: Truth | Sequence[Truth], command: str = COMMAND) -> Record:
    """Shake a virtual rig as planned and measure it; the command goes into the record's provenance."""
    response = simulate_rig(rig, truth, plan.excitation, plan.seed)
    provenance = {
        "source": "synthetic: virtual test rig, not measured",
        "command": command,
        "noise": f"white, {NOISE:.0%} RMS of each channel",
        "converter": f"{BITS} bit, range of each channel in its name",
    }
    return Record(
        plan.name, plan.role, rig, plan.excitation.fs, acquire_channels(rig, response, plan.seed), level=plan.level,
        description=plan.description, seed=plan.seed, band=plan.excitation.band, provenance=provenance,
    )  # fmt: skip


def generate(path: str | Path, name: str = "table1") -> None:
    """Write a virtual rig's records as a dataset.

    Parameters
    ----------
    path : str or Path
        The folder.
    name : str
        Of the rig, see `rigs.RIGS`.
    """
    virtual, todo = RIGS[name](), plans()
    command = COMMAND if name == "table1" else f"{COMMAND} --rig {name}"
    # The compiled integrator releases the interpreter's lock. Each record has its own seed, so order does not matter.
    with ThreadPoolExecutor(THREADS) as pool:
        running = pool.map(lambda plan: take(plan, virtual.rig, virtual.truth, command), todo)
        records = list(tqdm(running, total=len(todo), desc=f"virtual rig {name}", unit="record"))
    write_dataset(path, virtual.rig, records)
