"""The dataset of a bench: its records in the package's format, and truth.toml beside them, which nothing reads."""

from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np
import scipy.fft
import scipy.signal
import tomli_w

from clearance_mj import Channel, Excitation, Record, SimulationError, write_dataset
from clearance_mj.core.quantities import QUANTITIES
from clearance_mj.signals import excitation, sampling
from experiments.testrig.records import BAND, FS, NOISE, convert

from . import motion
from .bench import Bench

FACTOR = 16  # time steps per sample: 32 768 a second
BLOCK = 2048  # samples between two filterings
LEVELS = (0.5, 1.0, 2.0, 5.0, 8.0)  # m/s² RMS
STREAM = 7  # second word of the seeds of excitation and noise


Plan: TypeAlias = tuple[str, str, Excitation, str, float | None]
"""Name, role, excitation, words and level of a record"""


def swept(time: float) -> list[Plan]:
    """Sweeps up and down, with as many octaves or as many Hz in every second."""
    runs = ((0.5, BAND, "logarithmic"), (1.0, BAND[::-1], "linear"), (2.0, BAND[::-1], "logarithmic"),
            (5.0, BAND, "linear"))  # fmt: skip
    return [
        (f"sweep_{level:g}", "identify", excitation.sweep(time, FS, band, 2**0.5 * level, method=method),
         f"{method} sine sweep {band[0]:g}-{band[1]:g} Hz", level)
        for level, band, method in runs
    ]  # fmt: skip


def stepped(time: float) -> list[Plan]:
    """Stepped sines of half a second each, upwards and downwards."""
    frequency = np.geomspace(*BAND, round(2 * time))
    return [
        (f"steps_{level:g}", "identify", excitation.stepped_sine(time, FS, frequency[::way], 2**0.5 * level),
         f"sine {BAND[0]:g}-{BAND[1]:g} Hz in {frequency.size} steps {'up' if way > 0 else 'down'}", level)
        for level, way in ((0.5, 1), (1.0, -1), (2.0, 1), (5.0, -1))
    ]  # fmt: skip


SINES = {"swept": swept, "stepped": stepped}
"""Records to identify from under a sine, at four levels"""


def plans(bench: Bench, short: bool = False, sine: str = "") -> list[Plan]:
    """Plan the records of a bench; ``short``: two levels, and half of the time; ``sine``: one of `SINES` to identify.

    What validates a bench is the same whatever it is identified from.
    """
    time = 0.5 if short else 1.0
    seed = iter(np.random.default_rng((bench.seed, STREAM)).integers(1, 2**31, 20).tolist())
    peaks = (8.0, 25.0, 60.0, 140.0)
    hits = tuple((0.5 + 4 * i) * time for i in range(4))
    taken: list[Plan] = [
        ("ramp", "identify", excitation.level_ramp(32 * time, FS, BAND, start_rms=0.3, end_rms=9.0, seed=next(seed)),
         "random 5-220 Hz, level rising from 0.3 to 9 m/s² RMS", None),
        ("hammer", "identify", excitation.hammer(16 * time, FS, peak=peaks, width=0.006, times=hits),
         "free decays after half-sine base pulses of 6 ms and 8, 25, 60, 140 m/s²", None),
    ]  # fmt: skip
    if sine:
        taken = SINES[sine](24 * time)
    for level in (1.0, 5.0) if short else LEVELS:
        for letter in "ab":
            shake = excitation.random(24 * time, FS, BAND, rms=level, seed=next(seed))
            taken.append((f"level_{level:g}_{letter}", "validate", shake, "stationary random 5-220 Hz", level))
    return taken


def shake(bench: Bench, base: np.ndarray, fs: float = FS, factor: int = FACTOR) -> tuple[np.ndarray, np.ndarray]:
    """Simulate a bench under accelerations (n_t,) of its base, with ideal sensors at their true places.

    Returns what the sensors read (n_accelerometers, n_t), such as absolute accelerations, m/s², and displacements
    (n_probes, n_t) from rest, m.
    """
    scheme = motion.scheme(bench, 1 / (fs * factor))
    state, bushings = motion.at_rest(scheme, bench.bushings())
    rest, accelerometers, probes = scheme.probes @ state.q, bench.accelerometers, bench.probes
    fast, channels = sampling.interpolate(base, factor), len(accelerometers) + len(probes)
    felt = np.column_stack((fast, np.zeros((fast.size, 2))))
    for mode in bench.structure.base:
        felt[:, :2] += mode.motion(fast, fs * factor)[:, None] * (mode.shift, mode.tilt)
    felt[:, 2] = (np.cumsum(felt[:, 0]) - felt[:, 0] / 2) / (fs * factor)  # its velocity, from rest
    decimator, slow = sampling.Decimator(channels, factor), []
    for start in range(0, fast.size, BLOCK * factor):
        block = felt[start : start + BLOCK * factor]
        out = np.empty((len(block), channels))
        done = motion.march(scheme, state, bushings, block, out)
        if done < len(block) or not np.isfinite(out[-1]).all():
            raise SimulationError(f"bench {bench.name}: no convergence at {(start + done) * scheme.step:.6f} s")
        out[:, len(accelerometers) :] -= rest
        slow.append(decimator.push(out))
    samples = np.concatenate((*slow, decimator.flush()))[: base.size].T
    return samples[: len(accelerometers)], samples[len(accelerometers) :]


def measure_channels(
    bench: Bench, base: np.ndarray, rng: np.random.Generator, fs: float = FS, noise: float = NOISE
) -> list[Channel]:
    """Return what the converter writes: gains, noise over each channel's RMS and 24 bits."""
    accelerations, displacements = shake(bench, base, fs, round(FACTOR * FS / fs))
    if late := bench.structure.late:
        accelerations[late[0]] = later(accelerations[late[0]], late[1])
    signals = [("base", 100, "+Z", "acceleration", base)]
    for sensor, real, value in zip(bench.rig.sensors, bench.accelerometers, accelerations):
        name = f"{QUANTITIES[sensor.quantity].instrument} {sensor.node}"
        signals.append((name, sensor.node, "+Z", sensor.quantity, real.gain * value))
    for j, (label, real, value) in enumerate(zip(bench.rig.probe_labels, bench.probes, displacements), 1):
        signals.append((f"probe in bushing {j}", int(label.split(":")[0]), "+Z", "displacement", real.gain * value))
    if corner := bench.structure.filtered:
        low_pass = scipy.signal.butter(6, 2 * corner, output="sos")
        signals = [(*about, scipy.signal.sosfilt(low_pass, values)) for *about, values in signals]
    return convert(signals, fs, rng, noise)


def later(signal: np.ndarray, samples: float) -> np.ndarray:
    """A signal (n_t,) by a number of samples later, between its samples as its spectrum says."""
    padded = scipy.fft.next_fast_len(2 * signal.size, real=True)
    shift = np.exp(-2j * np.pi * samples * scipy.fft.rfftfreq(padded))
    return scipy.fft.irfft(scipy.fft.rfft(signal, padded) * shift, padded)[: signal.size]


def write_bench(
    bench: Bench, folder: str | Path, short: bool = False, roles: Sequence[str] = ("identify", "validate"),
    sine: str = "",
) -> None:  # fmt: skip
    """Simulate the records of a bench that have one of the roles, and write dataset and truth."""
    records = []
    for i, (name, role, base, words, level) in enumerate(plans(bench, short, sine)):
        if role not in roles:
            continue
        channels = measure_channels(bench, base.value, np.random.default_rng((bench.seed, STREAM, i)))
        provenance = {
            "source": f"synthetic: virtual bench {bench.name}, not measured",
            "noise": f"white, {NOISE:.0%} RMS of each channel",
        }
        record = Record(
            name, role, bench.rig, FS, channels, level=level, description=words, band=base.band, provenance=provenance
        )
        records.append(record)
    write_dataset(folder, bench.rig, records)
    (Path(folder) / "truth.toml").write_text(tomli_w.dumps(bench.truth()), encoding="utf-8")
