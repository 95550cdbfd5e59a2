"""A channel that is late against the others."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from functools import partial

from ....rig import Rig
from .candidate import Bench, Candidate, hypothesis, opened

DELAY = 0.5  # samples
REACH = 2.0  # samples, 1 σ


@hypothesis("delay", "a channel that is late")
def delays(bench: Bench) -> Iterator[Candidate]:
    """Yield each accelerometer, and the excitation."""
    for i, sensor in enumerate(bench.rig.sensors):
        if not sensor.delay:
            words = partial(_sensor_words, i, bench.fs)
            yield Candidate("delay", partial(_late_sensor, bench.rig, i, bench.fs), words, signed=True)
    if not bench.rig.shaker.delay:
        words = partial(_excitation_words, bench.fs)
        yield Candidate("delay", partial(_late_excitation, bench.rig, bench.fs), words, signed=True)


def _late_sensor(rig: Rig, i: int, fs: float, factor: float) -> Rig:
    sensors = list(rig.sensors)
    sensors[i] = dataclasses.replace(sensors[i], delay=factor * DELAY / fs)
    return opened(rig.replace(sensors=tuple(sensors)), {f"sensors[{i}].delay": f"{REACH / fs!r} s"})


def _late_excitation(rig: Rig, fs: float, factor: float) -> Rig:
    shaker = dataclasses.replace(rig.shaker, delay=factor * DELAY / fs)
    return opened(rig.replace(shaker=shaker), {"shaker.delay": f"{REACH / fs!r} s"})


def _sensor_words(i: int, fs: float, rig: Rig) -> str:
    return f"accelerometer {rig.sensors[i].label} is {_time(rig.sensors[i].delay, fs)}"


def _excitation_words(fs: float, rig: Rig) -> str:
    return f"the excitation's channel is {_time(rig.shaker.delay, fs)}"


def _time(delay: float, fs: float) -> str:
    return f"{1e3 * abs(delay):.3g} ms ({abs(delay) * fs:.2g} samples) too {'late' if delay > 0 else 'early'}"
