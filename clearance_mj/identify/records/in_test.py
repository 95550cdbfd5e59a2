"""Models as they were tested: driven along the direction of a record, and turning as its shaft did."""

from __future__ import annotations

import dataclasses

from ...model import Model
from ...rig import Rig
from ...signals.keyphasor import ShaftTurning

__all__ = ["in_test"]


def in_test(model: Model, tested: Rig, turning: ShaftTurning | None) -> Model:
    """Return a model driven as the rig was in a test, and turning as its shaft did.

    Parameters
    ----------
    model : Model
        Rig and law; one that moves in a plane stays as it is.
    tested : Rig
        As it was driven, `Record.tested_rig`.
    turning : ShaftTurning or None
        What the keyphasor shows, `Record.turning`; None of a shaft that did not turn.
    """
    rig = model.rig
    if not rig.moves_across:
        return model
    shaker = dataclasses.replace(rig.shaker, direction=tested.shaker.direction)
    spin = tested.spin
    if spin is not None and turning is not None:
        # Before the first mark the keyphasor tells the angle of a steady shaft alone.
        speed, rate = (spin.speed, spin.rate) if spin.rate else turning.steady_or_creeping
        angle = dataclasses.replace(spin, speed=speed, rate=rate, angle=0.0).angle_at(turning.marks[:1])
        spin = dataclasses.replace(spin, speed=speed, rate=rate, angle=-float(angle[0]))
    rig = rig if spin else rig.replace(unbalances=(), orders=())
    return dataclasses.replace(model, rig=rig.replace(shaker=shaker, spin=spin))
