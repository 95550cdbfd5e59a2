"""What turns and slides of a rig, as controls: spin, gravity, unbalance, friction, oil."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..rig import Bushing, Friction, Rig, Spin
from ..structure.base import parse_place
from .control import Control, Value

__all__ = ["motion_changes", "of_motion", "of_round", "round_changes"]

GROUP = "Weight and spin"
RPM = 30 / math.pi
EARTH = 9.80665  # m/s²
FASTEST = 1000.0  # rad/s, to which the slider of a rig without a spin reaches
DOWN = (0.0, 0.0, -1.0)
MOST_FRICTION = 0.5


def of_motion(rig: Rig) -> Iterator[Control]:
    """Return what a rig can be moved by as a whole: weight, where it has some or moves across z, spin, unbalance."""
    pull = float(np.linalg.norm(rig.gravity or 0.0))
    if pull or rig.moves_across:
        yield Control("gravity", GROUP, "Gravity", pull, "m/s²", 1.0, 0.0, max(2 * EARTH, 2 * pull))
    if spin := rig.spin:
        most = 2 * (spin.fastest or FASTEST)
        ends = spin.until is not None
        label = "Spin at the start" if ends else "Spin"
        yield Control("spin.speed", GROUP, label, spin.speed, "rev/min", RPM, 0.0, most)
        if ends:
            yield Control("spin.until", GROUP, "Spin at the end", float(spin.until or 0.0), "rev/min", RPM, 0.0, most)
        if spin.rate:
            yield Control.about("spin.rate", GROUP, "Rate of the spin", abs(spin.rate), "rad/s²")
    for i, each in enumerate(rig.unbalances):
        label = f"Unbalance{f' {i + 1}' if len(rig.unbalances) > 1 else ''}"
        yield Control.about(f"unbalances[{i}].moment", GROUP, label, each.moment, "g mm", 1e6)


def motion_changes(rig: Rig, values: Mapping[str, Value]) -> dict[str, Any]:
    """Return the fields of a rig that controls of `of_motion` change."""
    pull = float(values.get("gravity", 0.0))
    along = np.array(rig.gravity or DOWN) / np.linalg.norm(rig.gravity or DOWN)
    unbalances = tuple(
        dataclasses.replace(each, moment=float(values[f"unbalances[{i}].moment"]))
        for i, each in enumerate(rig.unbalances)
    )
    gravity = tuple((pull * along).tolist()) if pull else None
    return {"gravity": gravity, "spin": _spin(rig.spin, values), "unbalances": unbalances}


def _spin(spin: Spin | None, values: Mapping[str, Value]) -> Spin | None:
    if spin is None:
        return None
    speed, rate = float(values["spin.speed"]), spin.rate
    if rate:
        rate = math.copysign(float(values["spin.rate"]), rate)
    if spin.until is None:
        return dataclasses.replace(spin, speed=speed, rate=rate)
    until = float(values["spin.until"])
    if until == speed:
        return dataclasses.replace(spin, speed=speed, rate=0.0, until=None)
    return dataclasses.replace(spin, speed=speed, rate=math.copysign(rate, until - speed), until=until)


def of_round(rig: Rig, i: int) -> Iterator[Control]:
    """Return where a round clearance rests along y, and what slides in any: friction, oil."""
    bushing = rig.bushings[i]
    group, name, gap = f"Clearance {i + 1}, {bushing.where}", f"bushings[{i}]", bushing.gap
    if bushing.is_round:
        yield Control(f"{name}.offset_y", group, "Offset at rest along y", bushing.offset_y, "µm", 1e6, -gap, gap)
    if bushing.friction or (bushing.is_round and (bushing.radius or parse_place(bushing.position))):
        friction = bushing.friction.coefficient if bushing.friction else 0.0
        most = max(MOST_FRICTION, friction)
        yield Control(f"{name}.friction", group, "Friction coefficient", friction, "", 1.0, 0.0, most)
    if film := bushing.film:
        yield Control.about(f"{name}.viscosity", group, "Oil: viscosity", film.viscosity, "mPa s", 1e3)


def round_changes(bushing: Bushing, values: Mapping[str, Value], name: str) -> dict[str, Any]:
    """Return the fields of a bushing that controls of `of_round` change."""
    found: dict[str, Any] = {}
    if f"{name}.offset_y" in values:
        found["offset_y"] = float(values[f"{name}.offset_y"])
    if f"{name}.friction" in values:
        coefficient = float(values[f"{name}.friction"])
        known = bushing.friction or (Friction(coefficient) if coefficient else None)
        found["friction"] = known and dataclasses.replace(known, coefficient=coefficient)
    if bushing.film and f"{name}.viscosity" in values:
        found["film"] = dataclasses.replace(bushing.film, viscosity=float(values[f"{name}.viscosity"]))
    return found
