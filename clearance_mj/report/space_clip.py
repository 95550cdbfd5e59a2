"""What an animation in space shows: the shape of a shaft that whirls in its bushings, out of a response."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from ..rig import Rig
from ..rotors.whirling import whirl
from ..signals.response import Response
from .clip import AnyClip, cut, require_shafts
from .deflection import deflection

__all__ = ["SpaceClip", "space_clip"]


@dataclass(frozen=True, eq=False)
class SpaceClip(AnyClip):
    """What an animation in space shows."""

    angle: np.ndarray  #: (n,) rad, of the shaft; 0 of one that does not turn
    path: np.ndarray  #: (n_t, n_bushings, 2) m, place of the shaft's line in its bushings, from their middles


def space_clip(rig: Rig, response: Response, start: float | None = None, seconds: float = 0.15, slow: float = 60.0,
               exaggeration: float | None = None, rate: float = 20.0) -> SpaceClip:  # fmt: skip
    """Cut a response of a spatial rig to what an animation shows; as `clip` does of a planar one, with its defaults."""
    require_shafts(rig, "orbits")
    seen = whirl(rig, response)
    deflected = partial(deflection, rig, response)
    common, shown, trace = cut(rig, response, deflected, start, seconds, slow, exaggeration, rate)
    contact = np.asarray(response.contact_force).reshape(len(rig.bushings), 2, -1)
    return SpaceClip(
        **common, trace=np.hypot(*contact.transpose(1, 0, 2)).T[trace], path=seen.position.transpose(2, 0, 1)[trace],
        angle=np.zeros(shown.size) if seen.angle is None else seen.angle[shown],
    )  # fmt: skip
