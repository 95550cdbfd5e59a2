"""Simulated records, and records with a channel changed."""

import dataclasses

import numpy as np

from clearance_mj.engines import simulate
from clearance_mj.io.dataset import BASE_NODE, Record
from clearance_mj.io.uff import Channel

FS = 2048.0


def record_of(rig, excitation, law, engine="modal", noise=0.01, name="simulated"):
    """A simulated record with white noise on every channel, and the simulation."""
    response, rng = simulate(rig, excitation, law, engine), np.random.default_rng(7)
    columns = [(BASE_NODE, "acceleration", response.excitation)]
    columns += [(s.node, "acceleration", a) for s, a in zip(rig.sensors, response.acceleration, strict=True)]
    columns += [(node, "displacement", x) for node, x in zip((6, 7), response.displacement, strict=True)]
    channels = [
        Channel(f"{quantity} {node}", node, "+Z", quantity, v + noise * v.std() * rng.standard_normal(v.size), FS)
        for node, quantity, v in columns
    ]
    return Record(name, "identify", rig, FS, channels), response


def with_channel(record, node, quantity, change):
    """The record with the samples of one channel changed, or without it where the change is None."""
    channels = []
    for c in record.channels:
        if (c.node, c.quantity) != (node, quantity):
            channels.append(c)
        elif change is not None:
            channels.append(dataclasses.replace(c, value=change(c.value.copy())))
    return dataclasses.replace(record, channels=channels)
