"""Modes: data sets 55."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from ...errors import RecordError
from ...signals.ema import Modes
from ._blocks import Block
from ._dataset_55 import AXES, Mode, is_mode, mode_set, read_mode

_TRANSLATION = re.compile(r"(\d{1,9}):([+-])([XYZ])")


def read_modes(blocks: Sequence[Block]) -> Modes:
    """Put the modes of a file together, by frequency; components that move in no mode are left out."""
    modes = []
    for block in blocks:
        try:
            if is_mode(block):
                modes.append(read_mode(block))
        except RecordError as error:
            raise RecordError(f"data set {block.number}: {error}") from None
    if not modes:
        raise RecordError("holds no modes (data sets 55 of analysis type 2, 3 or 7)")
    modes.sort(key=lambda mode: mode.frequency)
    nodes = modes[0].shape.keys()
    if not nodes or any(mode.shape.keys() != nodes for mode in modes):
        raise RecordError("its modes are not of the same nodes, or of none")
    shape = np.array([[mode.shape[node] for node in nodes] for mode in modes])  # (n, nodes, 3)
    moving = np.flatnonzero(np.any(shape, axis=(0, 1)))
    return Modes(
        np.array([mode.frequency for mode in modes]),
        np.array([mode.damping for mode in modes]),
        shape[:, :, moving].reshape(len(modes), -1).T,
        tuple(f"{node}:+{AXES[axis]}" for node in nodes for axis in moving),
    )


def mode_sets(modes: Modes) -> list[dict]:
    labels = modes.responses or tuple(f"{i + 1}:+Z" for i in range(modes.shape.shape[0]))
    places = [_TRANSLATION.fullmatch(label) for label in labels]
    if not all(places):
        raise RecordError(f"mode shape at {labels[places.index(None)]}; data set 55 holds translations, as 3:+Z")
    sets = []
    for number, (frequency, damping, column) in enumerate(zip(modes.frequency, modes.damping, modes.shape.T), 1):
        shape = {int(place[1]): np.zeros(3, dtype=complex) for place in places}
        for place, value in zip(places, column):
            shape[int(place[1])][AXES.index(place[3])] = value if place[2] == "+" else -value
        sets.append(mode_set(number, Mode(frequency, damping, shape)))
    if not sets:
        raise RecordError("there is no mode")
    return sets
