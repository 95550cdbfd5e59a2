"""The numbers of the page's figures of a rig in space: places in its round clearances, contact, the shaft twice."""

from __future__ import annotations

import dataclasses

import numpy as np

from ..clearance.modelled import rig_in_gap
from ..core.errors import ClearanceError
from ..linear import linear_model
from ..model import Model
from ..report.clip import space_clip
from ..rig import Rig
from ..rotors import turning_shaft, whirl
from ..signals.response import Response
from .figures import MODES, PICTURES, SHOWN, SLOW, Numbers, about_strongest

__all__ = ["frequencies", "motion", "names", "pairs", "places", "shafts"]

TOUCH, LEAST = 0.01, 1e-3
"""share of a clearance's highest force, and N, above both of which it touches: the anti-alias filter rings around it"""


def names(rig: Rig) -> list[str]:
    """Return the names of the rows of displacements: y and z of each clearance."""
    return [f"clearance {i + 1}, {b.where}, {axis}" for i, b in enumerate(rig.bushings) for axis in "yz"]


def pairs(rig: Rig) -> list[tuple[int, int]]:
    """Return the rows that make an orbit."""
    return [(2 * i, 2 * i + 1) for i in range(len(rig.bushings))]


def places(rig: Rig, response: Response) -> Response:
    """Return the response with displacements from the middles of the bushings, along y and z."""
    if not rig.bushings:
        return response
    return dataclasses.replace(response, displacement=whirl(rig, response).position.reshape(2 * len(rig.bushings), -1))


def motion(rig: Rig, response: Response) -> Numbers:
    """How each round clearance is touched, and its motion about the strongest contact, out of `places`."""
    x, force = response.displacement, response.contact_force
    if x is None or force is None or not len(x):
        return Numbers({"clearances": []})
    place, pushed = (values.reshape(len(rig.bushings), 2, -1) for values in (x, force))
    rows = []
    for i, bushing in enumerate(rig.bushings):
        size = np.hypot(*pushed[i])
        touch = size > max(TOUCH * size.max(), LEAST)
        about = place[i] - place[i].mean(axis=1, keepdims=True)
        share = np.nan if response.contact_share is None else float(response.contact_share[i])
        rows.append(
            {
                "where": bushing.where, "share": share, "rms": float(np.sqrt(np.mean(np.sum(about**2, axis=0)))),
                "peak": float(np.hypot(*place[i]).max()), "force": float(size.max()),
                "impacts": float(np.count_nonzero(np.diff(touch.astype(int)) > 0) / response.duration),
                "rattle": _rattle(np.arctan2(*pushed[i][::-1, touch])),
                "walls": [-bushing.gap - bushing.offset, bushing.gap - bushing.offset],
            }
        )  # fmt: skip
    part = about_strongest(response, np.hypot(*pushed.transpose(1, 0, 2)))
    facts = {"clearances": rows, "walls": [[-b.gap, b.gap] for b in rig.bushings for _ in "yz"], "round": True}
    return Numbers(facts, {"x": x[:, part], "v": np.gradient(x, 1 / response.fs, axis=1)[:, part]})


def _rattle(direction: np.ndarray) -> str:
    """What directions of the contact force, rad, say: those of a shaft that leans on one side fit into a half."""
    if not direction.size:
        return "free"
    turned = np.sort(direction)
    widest = np.diff(np.append(turned, turned[0] + 2 * np.pi)).max()
    return "touches one side" if widest > np.pi else "rattles"


def shafts(rig: Rig, response: Response) -> Numbers:
    """The shafts from the side (z) and from above (y) about the strongest contact; why there are none, if so."""
    try:
        seen = space_clip(rig, response, seconds=min(SHOWN, response.duration / 2), slow=SLOW, rate=PICTURES)
    except ClearanceError as error:
        return Numbers({"shaft": str(error)})
    n = len(rig.linear.shafts)
    spots = [[*rig.linear.place(b.position), b.length] for b in rig.bushings]
    ends = [[[-b.gap - off, b.gap - off] for b, off in zip(rig.bushings, offsets)] for offsets in
            ([b.offset for b in rig.bushings], [b.offset_y for b in rig.bushings])]  # fmt: skip
    facts = {
        "slow": seen.slow, "rate": seen.rate, "starts": float(seen.time[0]),
        "places": [*spots, *([lane + n, x, length] for lane, x, length in spots)], "walls": [*ends[0], *ends[1]],
        "views": "Above: from the side, z upwards; below: from above, y upwards. ",
    }  # fmt: skip
    pushed = np.asarray(response.contact_force).reshape(len(rig.bushings), 2, -1)
    at = np.rint(seen.time * response.fs).astype(int)
    pressed = np.concatenate((pushed[:, 1, at], pushed[:, 0, at])).T
    arrays = {
        "position": np.tile(seen.position, 2), "number": np.concatenate((seen.shaft, seen.shaft + n)).astype(float),
        "lift": np.concatenate((seen.lift[:, 1], seen.lift[:, 0]), axis=1), "pressed": pressed,
    }  # fmt: skip
    return Numbers({"shaft": facts}, arrays)


def frequencies(model: Model) -> list[float]:
    """Return the natural frequencies, Hz, of small motions in the gaps, at the spin of the start if the shaft turns."""
    rig = rig_in_gap(model.rig, model.law)
    found = (
        linear_model(rig, grease=True).omega
        if rig.spin is None
        else turning_shaft(rig).poles(rig.spin.speed).value.imag
    )
    return (np.sort(found)[:MODES] / (2 * np.pi)).tolist()
