"""Orbits and run-ups of test, repeat and laws compared in a bushing."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from ...io.dataset import Record
from ...rotors.whirling import Whirl
from ...signals.orbit_figures import MICRO, RPM, cascade_figure
from ...signals.orbits import Orbits
from ...study.conditions import spin_words
from ...study.orbit_measures import onset_of_contact
from ...study.turning import TurningComparison
from ..style import REPEAT, TEST, Drawing, letters, phase, sheet, tidy
from ..whirl import finest_resolution
from .looks import Looks

__all__ = ["cascades", "orbits_of_bushing", "run_ups_of_bushing"]

LAST = 12  # turns of an orbit that are drawn
SECOND = "test, repeated"
RESOLUTION = 4.0  # Hz, of full spectra over speed
AROUND = np.exp(2j * np.pi * np.linspace(0, 1, 361))


def orbits_of_bushing(turning: TurningComparison, bushing: int) -> Drawing:
    """Draw the orbits in a bushing at every speed: in the clearance on the left, about their middles on the right."""
    looks, speeds = Looks(turning.study), turning.speeds
    n, repeated = len(speeds), any(len(records) > 1 for records in speeds.values())
    figure = sheet(3.1 * n, looks.key("test", SECOND if repeated else "", engines=False))
    axes = figure.subplots(n, 2, squeeze=False, gridspec_kw={"hspace": 0.32, "wspace": 0.2})
    names = iter(letters(2 * n))
    for (condition, records), (left, right) in zip(speeds.items(), axes):
        shown = _curves(turning, bushing, records)
        _in_clearance(left, turning, looks, records[0], bushing, [(o, look) for o, look, _ in shown])
        for orbits, look, _ in shown:
            path = _complex_path(orbits)
            right.plot(*_yz(path - path.mean()), **look)
            mark = path.reshape(len(orbits.time), -1)[:, 0] - path.mean()
            right.plot(*_yz(mark), color=look["color"], marker="o", ms=2.5, ls="", mew=0)
        reach = 1.1 * MICRO * max(np.abs(_complex_path(o) - _complex_path(o).mean()).max() for o, _, _ in shown)
        right.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
        words = spin_words(condition.spin)
        tidy(left, f"{next(names)} {words}, in the clearance", "z (µm)", "y (µm)")
        tidy(right, f"{next(names)} {words}, about the middle", "z (µm)", "y (µm)")
    caption = (
        f"Orbits in bushing {bushing + 1}, {looks.test} and laws, the last {LAST} turns without the probes’ run-out. "
        "Left: in the clearance of each law, the dashed circle, the test’s from where the best law’s shaft rests. "
        "Right: about their middles; dots: once-per-turn marks."
    )
    alt = f"Orbits in bushing {bushing + 1} at {n} speeds, test and laws {looks.laws}."
    return Drawing(f"orbits_bushing_{bushing + 1}", figure, caption, alt, bushing == 0)


def _in_clearance(
    ax: Axes, turning: TurningComparison, looks: Looks, record: Record, bushing: int,
    shown: list[tuple[Orbits, dict[str, Any]]],
) -> None:  # fmt: skip
    """Return each orbit relative to its shaft's rest position, the test's to that of the best law."""
    reach = 0.0
    places = {}
    for law in turning.study.methods:
        placed = turning.placed(law, record)
        gap = placed.motion.rig.bushings[bushing].gap
        places[looks.colour(law)] = complex(*placed.rest[bushing])
        ax.plot(*_yz(gap * AROUND), color=looks.colour(law), lw=0.8, ls="--")
        reach = max(reach, gap)
    best = places[looks.colour(turning.study.best_law)]
    for orbits, look in shown:
        path = _complex_path(orbits) + places.get(look["color"], best)
        ax.plot(*_yz(path), **look)
        reach = max(reach, float(np.abs(path).max()))
    ax.plot(0, 0, "+", color=REPEAT, ms=5, mew=0.7)
    limits = -1.06 * MICRO * reach, 1.06 * MICRO * reach
    ax.set(xlim=limits, ylim=limits, aspect="equal")


def run_ups_of_bushing(turning: TurningComparison, bushing: int, records: tuple[Record, ...]) -> Drawing:
    """Draw the 1X motion in a bushing over speed: forward and backward amplitude, and the forward one's phase."""
    looks = Looks(turning.study)
    figure = sheet(4.9, looks.key("test", SECOND if records[1:] else "", engines=False))
    ratios = {"hspace": 0.22, "height_ratios": (2, 1.2, 1)}
    above, middle, below = figure.subplots(3, 1, sharex=True, gridspec_kw=ratios)
    for orbits, look, law in _curves(turning, bushing, records, last=0):
        rpm, (forward, backward) = RPM * np.abs(orbits.speed), orbits.harmonic()
        above.plot(rpm, MICRO * np.abs(forward), **look)
        middle.plot(rpm, MICRO * np.abs(backward), **look)
        below.plot(rpm, phase(forward), **look)
        if law:
            placed = turning.placed(law, records[0])
            onset = onset_of_contact(orbits, placed.rest[bushing], placed.motion.rig.bushings[bushing].gap)
            if np.isfinite(onset):
                above.axvline(onset, color=look["color"], lw=0.8, ls=":")
    below.set(ylim=(-190, 190), yticks=(-180, 0, 180))
    tidy(above, f"(a) forward, bushing {bushing + 1}", "1X forward (µm)")
    tidy(middle, "(b) backward", "1X backward (µm)")
    tidy(below, "(c) phase of the forward one", "Phase (°)", "Spin (rev/min)")
    figure.align_ylabels((above, middle, below))
    caption = (
        f"Run-up in bushing {bushing + 1}, {looks.test} record {records[0].name} and laws: what goes with the shaft "
        "(1X), turn by turn, without the probes’ run-out. Dotted: where a law’s shaft begins to touch its bushing."
    )
    alt = f"1X amplitude and phase over speed in bushing {bushing + 1}: test and laws {looks.laws}."
    return Drawing(f"run_up_bushing_{bushing + 1}_{records[0].name}", figure, caption, alt, bushing == 0)


def cascades(turning: TurningComparison, bushing: int, records: tuple[Record, ...]) -> Drawing:
    """Draw full spectra over speed in a bushing, the test's above those of the best law."""
    best, looks = turning.study.best_law, Looks(turning.study)
    motions: dict[str, Whirl] = {looks.test: turning.test(records[0])}
    motions[f"law “{best}”"] = turning.placed(best, records[0]).motion
    spectra = {name: motion.cascade(bushing, finest_resolution(motion, RESOLUTION)) for name, motion in motions.items()}
    caption = (
        f"Full spectra over speed in bushing {bushing + 1}, {looks.test} record {records[0].name} and the best law. "
        "Dashed: the spin (1X), dotted: twice the spin."
    )
    alt = f"Full spectra over spin in bushing {bushing + 1}, test and law {best}."
    name = f"cascade_bushing_{bushing + 1}_{records[0].name}"
    return Drawing(name, cascade_figure(spectra), caption, alt, sharp=False)


def _curves(
    turning: TurningComparison, bushing: int, records: tuple[Record, ...], last: int = LAST
) -> list[tuple[Orbits, dict[str, Any], str]]:
    """Return orbits of repeat, test and laws with their line styles, and the law's name, "" for the test."""
    looks = Looks(turning.study)
    tests = [turning.test(record).orbits(bushing) for record in records[:2]]
    repeated: dict[str, Any] = {"color": REPEAT, "lw": 1.3, "label": SECOND}
    orbits = [(again, repeated, "") for again in tests[1:]]
    orbits.append((tests[0], {"color": TEST, "lw": 0.9, "label": "test"}, ""))
    for law in turning.study.methods:
        look = looks.line(law, turning.engine) | {"linestyle": "-"}
        orbits.append((turning.placed(law, records[0]).motion.orbits(bushing), look, law))
    return [(o.last(last) if last else o, look, law) for o, look, law in orbits]


def _complex_path(orbits: Orbits) -> np.ndarray:
    """Return the path y + i z (n,) of all turns one after the other, m."""
    return np.asarray((orbits.position[:, 0] + 1j * orbits.position[:, 1]).ravel())


def _yz(path: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return MICRO * path.real, MICRO * path.imag
