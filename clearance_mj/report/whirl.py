"""Figures of a shaft's whirl in its bushings, and their numbers: orbits, full spectra, and what changes with speed."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..core.drawing import bode, key
from ..rotors.whirling import Whirl
from ..signals.orbit_figures import RPM, cascade_figure, full_spectrum_figure, orbit_figure
from ..signals.orbits import Orbits
from .style import COLOURS, Drawing

__all__ = ["draw_orbits", "draw_over_speed", "draw_spectra", "finest_resolution", "orbit_rows"]


def finest_resolution(whirl: Whirl, resolution: float) -> float:
    """Return a distance of lines, Hz, that the motion is long enough for: the one asked for, or a coarser one."""
    return max(resolution, 1.001 * whirl.fs / whirl.time.size)


def draw_orbits(whirl: Whirl, turns: int) -> Drawing:
    """Draw the last turns in each bushing; of a shaft that does not turn the whole path."""
    names, gaps = whirl.names, [b.gap for b in whirl.bushings]
    shown: dict[str, Orbits | np.ndarray] = {}
    for j, name in enumerate(names):
        shown[name] = whirl.position[j] if whirl.angle is None else whirl.orbits(j).last(turns)
    words = "the last turns, with the once-per-turn mark and the ellipse that goes with the shaft (1X)"
    caption = (
        f"Orbits in the bushings of rig “{whirl.rig.name}”: {words if whirl.angle is not None else 'the whole path'}. "
        "The circle is the wall: the shaft's line is on it where shaft and bushing begin to touch."
    )
    return Drawing("orbits", orbit_figure(shown, dict(zip(names, gaps))), caption, f"Orbits in {len(gaps)} bushings.")


def draw_spectra(whirl: Whirl, resolution: float) -> Drawing:
    """Draw full spectra in each bushing, with lines every so many Hz or as near as the motion is long."""
    lines = finest_resolution(whirl, resolution)
    spectra = {name: whirl.full_spectrum(j, lines) for j, name in enumerate(whirl.names)}
    spin = None if whirl.spin is None else float(whirl.spin.mean())
    caption = (
        f"Full spectra of the motion in the bushings of rig “{whirl.rig.name}”, {whirl.time[0]:.4g} to "
        f"{whirl.time[-1]:.4g} s: an ellipse of semi-axes a and b is a forward line (a + b)/2 and a backward one "
        "(a - b)/2."
    )
    return Drawing("full_spectra", full_spectrum_figure(spectra, spin), caption, f"{len(spectra)} full spectra.")


def draw_over_speed(whirl: Whirl, resolution: float) -> list[Drawing]:
    """Draw what changes with the speed: full spectra of windows, and the 1X motion turn by turn."""
    whirl = whirl.changing
    lines = finest_resolution(whirl, resolution)
    cascades = {name: whirl.cascade(j, lines) for j, name in enumerate(whirl.names)}
    name, n = whirl.rig.name, len(cascades)
    caption = (
        f"Full spectra over the spin, in the bushings of rig “{name}”. Dashed: the spin (1X), dotted: twice the spin."
    )
    waterfall = Drawing("waterfall", cascade_figure(cascades), caption, f"Full spectra over spin, {n} bushings.")
    caption = (
        f"What goes with the shaft (1X) turn by turn, in the bushings of rig “{name}”: radius of the forward and of "
        "the backward circle, and the forward one's phase lag behind the once-per-turn mark; dotted: the gap."
    )
    return [waterfall, Drawing("bode", _draw_bode(whirl), caption, f"1X motion over spin at {n} bushings.")]


def _draw_bode(whirl: Whirl) -> Figure:
    orbits = [whirl.orbits(j) for j in range(len(whirl.names))]
    forward = {"lw": 0.9, "color": COLOURS[0]}
    curves = {name: [("forward", 1e6 * of.harmonic()[0], forward)] for name, of in zip(whirl.names, orbits)}
    figure, axes = bode(curves, RPM * orbits[0].speed, "1X (µm)")
    for (above, _), orbit, bushing in zip(axes, orbits, whirl.bushings):
        above.plot(RPM * orbit.speed, 1e6 * np.abs(orbit.harmonic()[1]), lw=0.9, color=COLOURS[1], label="backward")
        above.axhline(1e6 * bushing.gap, color="black", lw=0.8, ls=":", label="gap")
    key(figure, axes[0, 0].get_legend_handles_labels()[0])
    return figure


def orbit_rows(whirl: Whirl, turns: int) -> list[dict[str, Any]]:
    """Return the numbers of each bushing's last turns: place, reach, and 1X motion where the shaft turns; SI units."""
    rows = []
    for j, bushing in enumerate(whirl.bushings):
        place = whirl.position[j]
        row: dict[str, Any] = {"bushing": whirl.names[j], "gap": bushing.gap}
        if whirl.angle is not None:
            orbits = whirl.orbits(j).last(turns)
            place = np.concatenate((*orbits.position,), axis=1)
            row |= {"turns": len(orbits.time), "spin": float(orbits.speed.mean())} | _first_turn(orbits)
        radius = np.hypot(*place)
        rows.append(row | {"mean": place.mean(axis=1).tolist(), "largest_radius_over_gap": radius.max() / bushing.gap})
    return rows


def _first_turn(orbits: Orbits) -> dict[str, Any]:
    once = orbits.filtered()
    return {
        "forward": abs(once.forward), "forward_phase": float(np.angle(once.forward)), "backward": abs(once.backward),
        "major": once.major, "minor": once.minor, "inclination": once.inclination, "sense": once.sense,
    }  # fmt: skip
