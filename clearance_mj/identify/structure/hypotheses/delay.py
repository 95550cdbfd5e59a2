"""A channel that is late against the others."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from functools import partial
from typing import Literal

from ....core.plain_numbers import find_numbers, get_number
from ....rig import Rig
from .candidate import Bench, Candidate, hypothesis, opened

DELAYS = 0.5, 2.0, -2.0, 4.0, -4.0, 9.0, -9.0  # samples
REACH = 3.0  # samples, 1 σ
Late = Callable[[Rig, float], Rig]


@hypothesis("delay", "a channel that is late")
def delays(bench: Bench) -> Iterator[Candidate]:
    """Yield each accelerometer, each probe, and the excitation."""
    for path, label, late in _channels(bench):
        for delay in DELAYS:
            make = partial(_with, bench, path, late, delay)
            size: Literal["signed", "fixed"] = "signed" if delay == DELAYS[0] else "fixed"
            yield Candidate("delay", make, partial(_words, path, label, bench), size=size)


def _channels(bench: Bench) -> Iterator[tuple[str, str, Late]]:
    """Paths of the channels' delays in the rig file, what they are called, and what makes them late."""
    rig = bench.rig
    for i, sensor in enumerate(rig.sensors):
        if not sensor.delay:
            yield f"sensors[{i}].delay", f"accelerometer {sensor.label}", partial(_late_sensor, i)
    for j, (bushing, label) in enumerate(zip(rig.bushings, rig.probe_labels)):
        if bench.probes and not bushing.probe_delay:
            yield f"bushings[{j}].probe_delay", f"probe {label}", partial(_late_probe, j)
    if not rig.shaker.delay:
        yield "shaker.delay", "the excitation's channel", _late_excitation


def _with(bench: Bench, path: str, late: Late, samples: float, factor: float) -> Rig:
    return opened(late(bench.rig, factor * samples / bench.fs), {path: f"{REACH / bench.fs!r} s"})


def _late_sensor(i: int, rig: Rig, delay: float) -> Rig:
    changed = (dataclasses.replace(s, delay=delay) if k == i else s for k, s in enumerate(rig.sensors))
    return rig.replace(sensors=tuple(changed))


def _late_probe(j: int, rig: Rig, delay: float) -> Rig:
    changed = (dataclasses.replace(b, probe_delay=delay) if k == j else b for k, b in enumerate(rig.bushings))
    return rig.replace(bushings=tuple(changed))


def _late_excitation(rig: Rig, delay: float) -> Rig:
    return rig.replace(shaker=dataclasses.replace(rig.shaker, delay=delay))


def _words(path: str, label: str, bench: Bench, rig: Rig) -> str:
    (key,) = find_numbers(rig.to_dict(), path)
    delay = get_number(rig.to_dict(), key) or 0.0
    ms, samples, which = 1e3 * abs(delay), abs(delay) * bench.fs, "late" if delay > 0 else "early"
    return f"{label} is {ms:.3g} ms ({samples:.1f} samples) too {which}"
