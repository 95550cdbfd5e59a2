"""Check of the places and units that records state of their channels."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np

from ...core.errors import RecordError
from ...core.quantities import QUANTITIES
from ..records.checks import warn
from ..records.prepared import EXCITATION, PreparedRecord
from .assignment import Assignment, Search
from .mapping import FITS, judged, shows_impacts
from .raw_signals import RawSignals
from .rivals import Judge
from .units import ChannelUnits

__all__ = ["check_places"]

LEAST_MOTION = 0.17  # RMS in a clearance over its gap where records show impacts; of drawn benches 0.3 to 1.6
REFUSED = 6.0  # margin over the stated assignment from which on records are refused: twice that of a sure map
DRAWS = 12  # of the rig, with which the stated assignment is judged


def check_places(records: Sequence[PreparedRecord]) -> None:
    """Refuse records whose channels surely are swapped, inverted or in other units than they say.

    Seconds are spent only where the rig file misses the channels as they are.

    Parameters
    ----------
    records : sequence of PreparedRecord
        Records of one rig.

    Raises
    ------
    RecordError
        Says which channels, and what they are; other assignments are much worse, and this one fits the rig.
    """
    if not (records := [record for record in records if not record.absent]):
        return
    first = records[0]
    alike = [r for r in records if (r.fs, r.kind, r.channels) == (first.fs, first.kind, first.channels)]
    if len(first.channels) <= len(first.rig.bushings) + 2 or any(r.faults for r in alike):
        return
    driven = "acceleration" if first.kind == "base" else "force"
    quantities = {known.instrument: name for name, known in QUANTITIES.items()}
    quantities |= {"probe": "displacement", EXCITATION: driven}
    of_channels, none = tuple(quantities[name.split()[0]] for name in first.channels), ("",) * len(first.channels)
    without_mean = tuple(record.signals - record.signals.mean(axis=0) for record in alike)
    signals = RawSignals(first.channels, of_channels, none, none, first.fs, without_mean, {})
    search = Search(first.rig, signals, first.kind, first.band or signals.band())
    stated = _stated_assignment(search, first.probes)
    judge = Judge(search, stated, np.ones(len(first.channels)))
    if judge.misfit <= FITS:
        _check_motion(search, judge)
        return
    best = search.closest_assignments()[0]
    better, units = judged(search, best)
    same = Judge(search, dataclasses.replace(stated, draws=best.draws), np.ones(len(first.channels)))
    if better.misfit > FITS or same.distance < better.distance + REFUSED:
        return
    if words := "; ".join(_differences(search, stated, best, units)):
        raise RecordError(
            f"channels are not what the records say: {words}; put that right in the records, or map their files anew "
            "(clearance-mj map)"
        )


def _stated_assignment(search: Search, probes: bool) -> Assignment:
    """Return the assignment that the records state."""
    sensors, count = len(search.rig.sensors), len(search.places)
    places = [*range(sensors), *(range(sensors, count - 1) if probes else ()), count - 1]
    channel = tuple(places.index(place) if place in places else -1 for place in range(count))
    ones = (1.0,) * count
    return Assignment(channel, ones, ones, tuple(range(DRAWS)), (0.0,) * count, 0.0)


def _check_motion(search: Search, judge: Judge) -> None:
    """Warn of accelerations that are all in g: transfer functions do not show it, the motion in the clearances does."""
    measured = any(search.places[i].quantity == "displacement" for i in judge.assignment.places)
    if search.kind != "base" or measured or not search.rig.bushings or not shows_impacts(search, judge.assignment):
        return
    if (motion := judge.motion_over_gap()) < LEAST_MOTION:
        warn(
            f"the shaft would move by {100 * motion:.0f} % of its gap, RMS, and yet the records show impacts: "
            "accelerations may be in g instead of m/s², or the gap in the rig file is much too large"
        )


def _differences(search: Search, stated_assignment: Assignment, best: Assignment, units: ChannelUnits) -> Iterator[str]:
    """Yield in words where an assignment differs from that of the records."""
    names = search.signals.names
    inverted = [best.channel[p] for p in best.places[:-1] if best.sign[p] < 0]
    if len(inverted) == len(best.places) - 1:
        yield f"{EXCITATION} (or every other channel) has the wrong sign"
        inverted = []
    in_unit: dict[str, list[str]] = {}
    for place, label, exists in zip(best.places, units.label, units.exists):
        channel, stated = best.channel[place], stated_assignment.channel[place]
        if channel != stated:
            yield f"{names[channel]} is {names[stated] if stated >= 0 else search.places[place].label}"
        if channel in inverted:
            yield f"{names[channel]} has the wrong sign"
        if label:
            in_unit.setdefault(label if exists else f"units of {label}", []).append(names[channel])
    for label, channels in in_unit.items():
        yield f"{', '.join(channels)} {'is' if len(channels) == 1 else 'are'} in {label}"
