"""The numbers of the page's figures, out of a response: few enough to be drawn at once, and none of a peak lost."""

from __future__ import annotations

import dataclasses
import itertools
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..beam import natural_frequencies
from ..clearance.modelled import rig_in_gap
from ..core.errors import ClearanceError
from ..linear import linear_model
from ..model import Model
from ..report.clip import clip
from ..rig import Bushing, Rig
from ..rotors import clearance_places, turning_shaft
from ..signals.frf import FRF
from ..signals.response import Response
from ..statistics.contact import contact_statistics

__all__ = [
    "Numbers", "frequencies_in_gap", "frf_numbers", "history", "motion", "names", "orbits", "places", "shaft",
    "spectrum", "thinned",
]  # fmt: skip

POINTS = 1600  # of a history over time: what a screen has across
PORTRAIT = 1.0  # s of a phase portrait
SHOWN, SLOW, PICTURES = 0.2, 40.0, 20.0
"""s of the shaft's motion that are shown, how many times slower, and pictures per second"""
MODES = 6  # natural frequencies that are shown
HIGHEST = 250.0  # Hz, of a spectrum
CONTACT_FRACTION, MIN_CONTACT_FORCE = 0.01, 1e-3
"""least contact force, as a fraction of the clearance's highest and in N: the anti-alias filter rings around it"""


@dataclass
class Numbers:
    """Facts, plain data, and arrays by their names."""

    facts: dict[str, Any] = field(default_factory=dict)  #: in words and single numbers
    arrays: dict[str, np.ndarray] = field(default_factory=dict)  #: of figures

    def add(self, other: Numbers) -> None:
        """Add the facts and arrays of another instance."""
        self.facts |= other.facts
        self.arrays |= other.arrays


def thinned(values: np.ndarray, most: int = POINTS) -> tuple[np.ndarray, np.ndarray]:
    """Return fewer samples, with the highest and lowest of every row.

    Parameters
    ----------
    values : ndarray, shape (n_rows, n)
        Samples at equal distances.
    most : int
        Largest number of points that may be left, even.

    Returns
    -------
    tuple of ndarray
        Places (m,), in samples, and values (n_rows, m): of every stretch of samples the lowest and the highest, in
        their order, at a quarter and at three quarters of it. As they came, if there are no more than ``most``.
    """
    n = values.shape[1]
    if n <= most:
        return np.arange(n, dtype=float), values
    length = -(-n // (most // 2))
    count = -(-n // length)
    padded = np.pad(values, ((0, 0), (0, count * length - n)), mode="edge").reshape(len(values), count, length)
    low, high = padded.argmin(axis=2), padded.argmax(axis=2)
    min_max = np.stack((np.minimum(low, high), np.maximum(low, high)), axis=2)
    extremes = np.take_along_axis(padded, min_max, axis=2).reshape(len(values), 2 * count)
    places = length * (np.arange(count)[:, None] + [0.25, 0.75]).ravel() - 0.5
    return np.minimum(places, n - 1), extremes


def frf_numbers(frf: FRF, prefix: str = "") -> Numbers:
    """Return magnitude, phase (degrees) and coherence of FRFs to one reference; a prefix names the arrays."""
    value = frf.value[:, 0]
    arrays = {"frequency": frf.frequency, "magnitude": np.abs(value), "phase": np.degrees(np.angle(value))}
    if frf.coherence is not None:
        arrays["coherence"] = frf.coherence[:, 0]
    return Numbers({}, {prefix + name: array for name, array in arrays.items()})


def spectrum(response: Response) -> Numbers:
    """Return the amplitudes of the accelerations' sines in the second half of a response, under a Hann window."""
    half = response.channels[:, response.channels.shape[1] // 2 :]
    window = np.hanning(half.shape[1] + 1)[:-1]
    amplitude = np.abs(np.fft.rfft((half - half.mean(axis=1, keepdims=True)) * window)) * 2 / window.sum()
    frequency = np.fft.rfftfreq(half.shape[1], 1 / response.fs)
    lines = (frequency > 0) & (frequency <= HIGHEST)
    return Numbers({"spectrum": True}, {"frequency": frequency[lines], "magnitude": amplitude[:, lines]})


def history(response: Response, first: float = 0.0, last: float = np.inf) -> Numbers:
    """Return the displacements at the clearances between two times, s, thinned."""
    shown = slice(*np.searchsorted(response.time, (first, last)))
    if response.displacement is None or shown.stop - shown.start < 2:
        return Numbers()
    places, x = thinned(response.displacement[:, shown])
    return Numbers({}, {"time": (places + shown.start) / response.fs, "displacement": x})


def names(rig: Rig) -> list[str]:
    """Return the names of the rows of displacements: one of each clearance, or y and z of a round one."""
    labels: list[str] = []
    for j, (axis, _) in zip(rig.bushing_of_row, rig.row_axes):
        words = f", {axis.lower()}" if rig.bushings[j].is_round else " (mrad)" if axis.startswith("R") else ""
        labels.append(f"clearance {j + 1}, {rig.bushings[j].where}{words}")
    return labels


def places(rig: Rig, response: Response) -> Response:
    """Return the response with displacements as they are drawn: in round clearances from their middles."""
    if response.displacement is None or not rig.bushings:
        return response
    return dataclasses.replace(response, displacement=clearance_places(rig, response))


def motion(rig: Rig, response: Response) -> Numbers:
    """Return how each clearance is touched, and its motion about the strongest contact, out of `places`."""
    x, force = response.displacement, response.contact_force
    if x is None or force is None or not len(x):
        return Numbers({"clearances": []})
    contact, pushed = contact_statistics(response), [force[part] for part in rig.clearance_rows]
    size = np.array([np.linalg.norm(each, axis=0) for each in pushed])
    touch = size > np.maximum(CONTACT_FRACTION * size.max(axis=1, keepdims=True), MIN_CONTACT_FORCE)
    rows = [
        {
            "where": bushing.where, "share": contact["contact_share"][i], "rms": contact["displacement_rms"][i],
            "peak": contact["displacement_peak"][i], "force": contact["contact_peak"][i],
            "impacts": float(np.count_nonzero(np.diff(touch[i].astype(int)) > 0) / response.duration),
            "rattle": _contact_kind(pushed[i][:, touch[i]], bushing), "row": rig.clearance_rows[i].start,
        }
        for i, bushing in enumerate(rig.bushings)
    ]  # fmt: skip
    walls = (rig.row_walls + rig.row_offsets[:, None]).tolist()
    part = _about_strongest(response, size)
    return Numbers(
        {"clearances": rows, "walls": walls}, {"x": x[:, part], "v": np.gradient(x, 1 / response.fs, axis=1)[:, part]}
    )


def _contact_kind(force: np.ndarray, bushing: Bushing) -> str:
    """Return the contact's kind from its forces (1 or 2, n): on one side, they fit into half a circle."""
    if not force.size:
        return "free"
    if len(force) == 1:
        return "touches one wall" if bushing.stops != "both" or np.ptp(np.sign(force)) == 0 else "rattles"
    angle = np.sort(np.arctan2(*force[::-1]))
    widest = np.diff(np.append(angle, angle[0] + 2 * np.pi)).max()
    return "touches one side" if widest > np.pi else "rattles"


def _about_strongest(response: Response, force: np.ndarray) -> slice:
    """Return the samples of a second about the largest of forces (n_clearances, n_t)."""
    strongest, size = int(np.argmax(force.max(axis=0))), force.shape[1]
    count = min(int(PORTRAIT * response.fs), size)
    start = min(max(strongest - count // 2, 0), size - count)
    return slice(start, start + count)


def orbits(rig: Rig) -> list[tuple[int, int, bool]]:
    """Return pairs of rows that make an orbit, and whether its wall is a circle.

    They are of a round clearance, or of two slots between the same two nodes in two directions.
    """
    rows = [part.start for part in rig.clearance_rows]
    nodes = [tuple(p.rpartition(":")[0] if isinstance(p, str) else "" for p in b.joined) for b in rig.bushings]
    slots = [j for j, b in enumerate(rig.bushings) if not b.is_round]
    return [(row, row + 1, True) for row, b in zip(rows, rig.bushings) if b.is_round] + [
        (rows[i], rows[j], False) for i, j in itertools.combinations(slots, 2)
        if nodes[i] == nodes[j] and all(nodes[i]) and rig.bushings[i].joined != rig.bushings[j].joined
    ]  # fmt: skip


def shaft(rig: Rig, response: Response) -> Numbers:
    """The shafts' deflection about the strongest contact, a picture after the other; why there is none, if so.

    They are seen from the side (z) and, of a rig that moves along y, too, below from above (y).
    """
    try:
        seen = clip(rig, response, seconds=min(SHOWN, response.duration / 2), slow=SLOW, rate=PICTURES)
    except ClearanceError as error:
        return Numbers({"shaft": str(error)})
    axes, n = "ZY" if rig.moves_across else "Z", len(rig.linear.shafts)
    rows = [
        (row, axes.index(axis), sign) for each in axes for row, (axis, sign) in enumerate(rig.row_axes) if axis == each
    ]
    on = [rig.bushings[rig.bushing_of_row[row]] for row, *_ in rows]
    spots = [(rig.linear.place(b.position), n * view, b.length) for b, (_, view, _) in zip(on, rows)]
    facts: dict[str, Any] = {
        "slow": seen.slow, "rate": seen.rate, "starts": float(seen.time[0]),
        "places": [[lane + below, x, length] for (lane, x), below, length in spots],
        "walls": [sorted((sign * rig.row_walls[row]).tolist()) for row, _, sign in rows],
        "views": "Above: from the side, z upwards; below: from above, y upwards. " if rig.moves_across else "",
    }  # fmt: skip
    arrays = {
        "position": np.tile(seen.position, len(axes)),
        "number": np.concatenate([seen.shaft + n * view for view in range(len(axes))]).astype(float),
        "lift": np.concatenate([seen.lift[:, "YZ".index(axis)] for axis in axes], axis=1),
        "pressed": seen.force[:, [row for row, *_ in rows]] * [sign for *_, sign in rows],
    }  # fmt: skip
    return Numbers({"shaft": facts}, arrays)


def frequencies_in_gap(model: Model) -> list[float]:
    """Return the natural frequencies, Hz, of small motions in the gaps, at the spin of the start if the shaft turns."""
    rig = rig_in_gap(model.rig, model.law)
    if not rig.moves_across:
        return natural_frequencies(rig, MODES).tolist()
    spin = rig.spin
    omega = turning_shaft(rig).poles(spin.speed).value.imag if spin else linear_model(rig, grease=True).omega
    return (np.sort(omega)[:MODES] / (2 * np.pi)).tolist()
