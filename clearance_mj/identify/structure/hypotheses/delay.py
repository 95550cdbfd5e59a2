"""A channel that is late against the others."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Literal

from ....calibrate.free import with_values
from ....core.plain_numbers import Key, get_number, path_of
from ....rig import Rig
from .candidate import Bench, Candidate, hypothesis, opened

DELAYS = 0.5, 2.0, -2.0, 4.0, -4.0, 9.0, -9.0  # samples
REACH = 3.0  # samples, 1 σ


@hypothesis("delay", "a channel that is late")
def delays(bench: Bench) -> Iterator[Candidate]:
    """Yield each accelerometer, each probe, and the excitation."""
    for key, label in _channels(bench):
        for delay in DELAYS:
            make = partial(_with, bench, key, delay)
            size: Literal["signed", "fixed"] = "signed" if delay == DELAYS[0] else "fixed"
            yield Candidate("delay", make, partial(_words, key, label, bench), size=size)


def _channels(bench: Bench) -> Iterator[tuple[Key, str]]:
    """Yield keys of the delays of channels that are not late in the rig file, and the names of the channels."""
    rig = bench.rig
    for i, sensor in enumerate(rig.sensors):
        if not sensor.delay:
            yield ("sensors", i, "delay"), f"accelerometer {sensor.label}"
    for j, (bushing, label) in enumerate(zip(rig.bushings, rig.probe_labels)):
        if bench.probes and not bushing.probe_delay:
            yield ("bushings", j, "probe_delay"), f"probe {label}"
    if not rig.shaker.delay:
        yield ("shaker", "delay"), "the excitation's channel"


def _with(bench: Bench, key: Key, samples: float, factor: float) -> Rig:
    late = with_values(bench.rig, {key: factor * samples / bench.fs})
    return opened(late, {path_of(key): f"{REACH / bench.fs!r} s"})


def _words(key: Key, label: str, bench: Bench, rig: Rig) -> str:
    delay = get_number(rig.to_dict(), key) or 0.0
    ms, samples, which = 1e3 * abs(delay), abs(delay) * bench.fs, "late" if delay > 0 else "early"
    return f"{label} is {ms:.3g} ms ({samples:.1f} samples) too {which}"
