"""Simulated records, and records with a channel changed."""

import dataclasses

import numpy as np

from clearance_mj.engines import simulate
from clearance_mj.io.dataset import Record
from clearance_mj.io.formats import to_channels

FS = 2048.0


def record_of(rig, excitation, law, engine="modal", noise=0.01, name="simulated"):
    """A simulated record with white noise on every channel, and the simulation."""
    response = simulate(rig, excitation, law, engine)
    return noisy(rig, response, noise, name), response


def noisy(rig, response, noise=0.01, name="simulated"):
    """A record of what a rig's sensors and probes would measure of a response, with white noise on every channel."""
    rng = np.random.default_rng(7)
    channels = to_channels(response, rig)
    values = (c.value + noise * c.value.std() * rng.standard_normal(c.size) for c in channels)
    channels = [dataclasses.replace(c, value=value) for c, value in zip(channels, values)]
    return Record(name, "identify", rig, response.fs, channels, response.kind, band=response.band)


def with_channel(record, node, quantity, change):
    """The record with the samples of one channel changed, or without it where the change is None."""
    channels = []
    for c in record.channels:
        if (c.node, c.quantity) != (node, quantity):
            channels.append(c)
        elif change is not None:
            channels.append(dataclasses.replace(c, value=change(c.value.copy())))
    return dataclasses.replace(record, channels=channels)
