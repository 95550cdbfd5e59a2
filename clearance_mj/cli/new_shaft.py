"""Shafts that clearance-mj new makes of its options: a cantilever, a shaft on supports, a rod in a tube."""

from __future__ import annotations

from typing import Any

from ..core.checks import naming
from ..core.errors import ClearanceError
from ..core.units import si_value
from ..structure import Beam, Disc, Material, Section, Shaft, Shafts, Support
from .command import Group, Options, option
from .options import length, pressure, si_number_parser

__all__ = ["ONLY_SHAFT", "SHAFT", "STRUCTURES"]

BEARING = "1e7:1e3"  # N/m and N s/m, the example of a shaft that turns: a small rolling bearing in its pedestal
HELD = ("clamped", "pinned", "guided")
ONLY_SHAFT = ("inner_diameter", "step", "support", "disc")


SHAFT = (
    option("--length", "m, or with a unit such as 620mm or 24in, as all lengths (example: 1)", length),
    Group(None, (
        option("--diameter", "m (example: 0.01)", length),
        option("--section", "m, of a rectangular shaft, the height in the direction of vibration", length, nargs=2,
               metavar=("WIDTH", "HEIGHT")),
    )),
    option("--inner-diameter", "m, of a tube", length, metavar="M"),
    option("--step", "length, diameter and, of a tube, inner diameter of a section, from one end to the other", length,
           nargs="+", action="append", metavar="M"),
    option("--support", f"at a point: {', '.join(HELD)} or a bearing's N/m and N s/m, {BEARING} (example: two)",
           nargs=2, action="append", metavar=("POINT", "KIND")),
    option("--young-modulus", "Pa or such as 210GPa (example: steel)", pressure, metavar="E"),
    option("--density", "kg/m³ or 0.284lb/in3 (example: steel)", si_number_parser("kg/m3")),
    option("--rayleigh", "1/s and s (example: 0.5 1e-5)", float, nargs=2, metavar=("ETA1", "ETA2")),
    option("--mass", "a mass at a point, kg or such as 450g or 1lb, without inertia", nargs=2, action="append",
           metavar=("POINT", "MASS")),
    option("--disc", "a body at a point, with the inertia of a disc of this size", nargs=4, action="append",
           metavar=("POINT", "MASS", "DIAMETER", "WIDTH")),
)  # fmt: skip
"""Options that describe a shaft"""


def _section(options: Options, factor: float = 1.0) -> dict[str, Any]:
    names = ("width", "height") if options.section else ("diameter",)
    return {name: factor * size for name, size in zip(names, options.section or [options.diameter])}


def _beam(options: Options) -> Beam:
    material = options.young_modulus, options.density
    return Beam(options.length, *material, rayleigh=tuple(options.rayleigh), **_section(options))


def _shaft(options: Options) -> Shaft:
    with naming("--step", ClearanceError):
        steps = [Section(*step) for step in options.step]
    steps = steps or [Section(options.length, **_section(options), inner_diameter=options.inner_diameter)]
    options.length = float(f"{sum(section.length for section in steps):.15g}")
    ends = [(str(x), "pinned" if options.spin is None else BEARING) for x in (0.0, options.length)]
    supports, discs = (_support(*s) for s in options.support or ends), (_disc(*d) for d in options.disc)
    material = Material(options.young_modulus, options.density)
    return Shaft(tuple(steps), tuple(supports), tuple(discs), material, rayleigh=tuple(options.rayleigh))


def _support(point: str, text: str) -> Support:
    x, (stiffness, _, damping) = si_value(point, "displacement"), text.partition(":")
    if text in HELD:
        return Support(x, text)  # type: ignore[arg-type]
    return Support(x, "elastic", si_value(stiffness, "N/m"), 0.0, si_value(damping or "0", "N s/m"))


def _disc(point: str, mass: str, diameter: str, width: str) -> Disc:
    """A solid cylinder: m (3 r² + w²)/12 about a diameter, m r²/2 about its axis."""
    m, (x, d, w) = si_value(mass, "mass"), [si_value(text, "displacement") for text in (point, diameter, width)]
    if not (d > 0 and w >= 0):
        raise ClearanceError(f"--disc {point} {mass} {diameter} {width}: diameter must be > 0 m and width >= 0 m")
    about, polar = (float(f"{inertia:.6g}") for inertia in (m * (3 * d**2 / 4 + w**2) / 12, m * d**2 / 8))
    return Disc(x, m, about, polar_inertia=min(polar, 2 * about))


def _shafts(options: Options) -> Shafts:
    """Return a rod in a tube, or two parallel bars, both clamped."""
    material = Material(options.young_modulus, options.density)
    rod = Section(options.length, **_section(options))
    tube = Section(options.length, **_section(options, 3.0))
    if not options.section:
        tube = Section(options.length, diameter=2 * options.diameter, inner_diameter=1.6 * options.diameter)
    parts = (
        Shaft((section,), (Support(0.0, "clamped"),), material=material, rayleigh=tuple(options.rayleigh), name=name)
        for name, section in (("rod", rod), ("tube", tube))
    )
    return Shafts(tuple(parts))


STRUCTURES = {"beam": _beam, "shaft": _shaft, "shafts": _shafts}
