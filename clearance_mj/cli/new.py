"""clearance-mj new: start a rig file."""

from __future__ import annotations

import argparse
import os
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..clearance.law_files import law_schema
from ..core.errors import ClearanceError, RigError
from ..core.files import to_json, write_text
from ..core.units import si_value
from ..core.validation import from_plain
from ..io.dataset import dataset_schema
from ..rig import (
    Beam,
    Bushing,
    Contact,
    Friction,
    Grease,
    OilFilm,
    PointMass,
    Rig,
    Sensor,
    Shaker,
    Spin,
    Unbalance,
    rig_schema,
)
from ..rig.plausible import check_units
from ..structure import Material, Section, Shaft, Shafts, Structure, Support
from ..structure.base import parse_dof
from ..version import __version__
from .command import command, spelled
from .options import in_si, length, pressure, spin
from .rig_text import rig_lines

WORDS = {
    "beam": "a uniform cantilever",
    "shaft": "a shaft of sections, with supports and discs",
    "shafts": "several parallel shafts",
    "matrices": "mass and stiffness matrices out of files",
    "modes": "the modes of a test or of a finite element program, out of a file",
    "mjcf": "a MuJoCo model",
}
KINDS = tuple(WORDS)
MOTIONS = ("planar", "spatial")
SHORTEST_FINITE = 0.25  # L/D up to which a short bearing's oil is near enough
EXAMPLE_FILES = {"matrices": ["model.npz"], "modes": ["modes.uff"], "mjcf": ["model.xml"]}
"""Examples of the files of each kind of structure."""


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    option("name", nargs="?", help="name of the rig")
    option("--kind", choices=KINDS, help="of structure (default: beam; asked for at a terminal if there is no name)")
    option(
        "--file", type=Path, nargs="+",
        help="of kind matrices: a .npz or .mat, or files of M, K and perhaps C, and a .csv of degrees of freedom; of "
        "modes: a .uff or .csv; of mjcf: a .xml",
    )  # fmt: skip
    option("--units", help="of kind matrices: such as m-kg-s or mm-t-s")
    option("--schema", type=Path, help="also write a JSON Schema here, for editors")
    option(
        "--schema-of", choices=("rig", "dataset", "law"), default="rig", help="of which files (default: %(default)s)"
    )
    shaft = parser.add_argument_group("shaft (of kinds beam, shaft and shafts)")
    words = "m, or with a unit such as 620mm or 24in, as all lengths (default: %(default)s)"
    shaft.add_argument("--length", type=length, default=1.0, help=words)
    section = shaft.add_mutually_exclusive_group()
    section.add_argument("--diameter", type=length, default=0.01, help="m (default: %(default)s)")
    section.add_argument(
        "--section", type=length, nargs=2, metavar=("WIDTH", "HEIGHT"),
        help="m, of a rectangular shaft, the height in the direction of vibration",
    )  # fmt: skip
    shaft.add_argument(
        "--young-modulus", type=pressure, default=210e9, metavar="E", help="Pa or such as 210GPa (default: steel)"
    )
    shaft.add_argument("--density", type=in_si("kg/m3"), default=7850.0, help="kg/m³ or 0.284lb/in3 (default: steel)")
    shaft.add_argument(
        "--rayleigh", type=float, nargs=2, default=(0.5, 1e-5), metavar=("ETA1", "ETA2"),
        help="damping, 1/s and s (default: 0.5 1e-5)",
    )  # fmt: skip
    shaft.add_argument(
        "--mass", nargs=2, action="append", default=[], metavar=("POINT", "MASS"),
        help="a mass at a point, kg or such as 450g or 1lb; may be repeated",
    )  # fmt: skip
    bushings = parser.add_argument_group("bushings, all alike")
    bushings.add_argument(
        "--bushings",
        type=_point,
        nargs="+",
        metavar="POINT",
        help='m along the shaft, or a text: a degree of freedom "12:+Z" or a shaft\'s "rod@0.4" (default: 0.55 and 0.8 '
        "lengths, or the first degree of freedom)",
    )
    words = "radial clearance, m or such as 0.3mm or 5mil (default: %(default)s)"
    bushings.add_argument("--gap", type=length, default=3e-4, help=words)
    bushings.add_argument("--bushing-length", type=length, default=0.012, help="m (default: %(default)s)")
    for name, default in (("--contact", "1e4 4"), ("--grease", "4e3 3")):
        bushings.add_argument(
            name, type=float, nargs=2, default=tuple(map(float, default.split())), metavar=("STIFFNESS", "DAMPING"),
            help=f"N/m and N s/m (default: {default})",
        )  # fmt: skip
    space = parser.add_argument_group("in space: round bushings, motion along y and z")
    space.add_argument("--motion", choices=MOTIONS, help='"spatial" goes without saying with what follows')
    space.add_argument("--gravity", type=in_si("acceleration"), nargs=3, metavar=("X", "Y", "Z"), help="m/s² or g")
    space.add_argument("--spin", type=spin, metavar="SPEED", help="of a shaft that turns: rad/s, or such as 1500rpm")
    space.add_argument(
        "--unbalance", nargs=2, action="append", default=[], metavar=("POINT", "MOMENT"),
        help="at a point of a shaft that turns, kg m or such as 20g-mm; may be repeated",
    )  # fmt: skip
    space.add_argument("--friction", type=float, metavar="MU", help="coefficient of friction in the bushings")
    space.add_argument("--oil", type=in_si("Pa s"), metavar="VISCOSITY", help="Pa s: oil in the bushings, not grease")
    test = parser.add_argument_group("test")
    test.add_argument(
        "--sensors", type=_point, nargs="+", metavar="POINT",
        help="with nodes 1, 2, ... or those of degrees of freedom (default: a quarter of the length, every bushing, "
        "the tip)",
    )  # fmt: skip
    test.add_argument("--force-at", type=_point, metavar="POINT", help="driven by a force, not by its base")


@command(
    "new", "write a commented rig file to go on from; what is not given is an example", _options,
    out_help="rig file (default: NAME.toml)",
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    files = _files(options)
    for path in files:
        if path.exists():
            raise ClearanceError(f"{path} is there already and stays as it is; give another file")
    for path, text in files.items():
        write_text(path, text)
        print(f"written: {path}")
    if rigs := [path for path in files if path.suffix == ".toml"]:
        if options.motion == "spatial":
            print(f"next: {spelled('simulate', rigs[0])}: how it vibrates")
        else:
            print(f"next: {spelled('map', 'FILE...', '--rig', rigs[0])}: which channel of your records is which sensor")
    return {"files": [str(path) for path in files]}


def _files(options: argparse.Namespace) -> dict[Path, str]:
    """Texts to write, by file."""
    schemas = {"rig": rig_schema, "dataset": dataset_schema, "law": law_schema}
    files = {options.schema: to_json(schemas[options.schema_of]())} if options.schema else {}
    if not (options.name or options.out or options.schema) and sys.stdin.isatty():
        _asked(options)
    if options.name is None:
        if options.out or not options.schema:
            raise ClearanceError("a rig needs a name: clearance-mj new myrig")
        return files
    if Path(options.name).name != options.name:
        raise ClearanceError(f"name {options.name!r} must not hold a folder; give that to --out")
    out = options.out or Path(f"{options.name}.toml")
    rig = _fields(options, out)
    head = [f"# Begun by clearance-mj new {__version__}."]
    head += ["# SI units. A line that begins with # holds a default, or a key that may be added."]
    if options.schema and options.schema_of == "rig":
        head.insert(0, f"#:schema ./{Path(os.path.relpath(options.schema, out.parent)).as_posix()}")
    text = "\n".join([*head, *rig_lines(rig)]) + "\n"
    _check(text, out)
    return {out: text} | files


def _point(text: str) -> float | str:
    """Place on the shaft in m, which may have a unit, or the name of another point, such as "12:+Z"."""
    try:
        return si_value(text, "displacement")
    except ClearanceError:
        return text


def _asked(options: argparse.Namespace) -> None:
    """Ask at a terminal for what is not given."""
    options.name = input("Name of the rig: ").strip() or None
    if options.kind is None:
        print("\n".join(f"  {kind:10s}{WORDS[kind]}" for kind in KINDS))
        options.kind = input("Kind of structure [beam]: ").strip() or None
        if options.kind not in (*KINDS, None):
            raise ClearanceError(f'kind "{options.kind}" is unknown; use {", ".join(KINDS)}')
    if options.kind in EXAMPLE_FILES and not options.file:
        options.file = [Path(name) for name in input(f"File [{EXAMPLE_FILES[options.kind][0]}]: ").split()] or None
    if options.kind == "matrices" and not options.units:
        options.units = input("Units of the matrices, such as m-kg-s or mm-t-s: ").strip() or None


def _fields(options: argparse.Namespace, out: Path) -> dict[str, Any]:
    """Fields of the rig of the options, the structure an object or plain data."""
    kind, length = options.kind or "beam", options.length
    if kind != "beam" and kind not in Structure.known:
        raise ClearanceError(f'kind "{kind}" is not installed; use beam, {", ".join(Structure.known)}')
    if kind in EXAMPLE_FILES:
        structure: Any = _of_files(kind, options, out)
        loaded = None if _missing(structure, out) else _loaded(structure, out)
        points = options.sensors or _first_points(loaded)
        if loaded and options.force_at is None and loaded.refusal("base"):
            options.force_at = points[0]
        clearances: Sequence[float | str] = options.bushings or points[:1]
    else:
        structure = {"beam": _beam, "shaft": _shaft, "shafts": _shafts}[kind](options)
        on = "rod@" if kind == "shafts" else ""
        clearances = options.bushings or [_on(on, share * length) for share in (0.55, 0.8)]
        last = [] if kind == "shaft" else [_on(on, length)]
        points = options.sensors or _sorted([_on(on, 0.25 * length), *clearances, *last])
    grease, contact = Grease(*options.grease), Contact(*options.contact)
    if options.oil is not None:
        grease = Grease(0.0)  # oil is in its place
    friction = None if options.friction is None else Friction(options.friction)
    film = None if options.oil is None else _film(options)
    to = {x: x.replace("rod@", "tube@") if kind == "shafts" and isinstance(x, str) else None for x in clearances}
    bushing_length = 0.0 if kind in EXAMPLE_FILES else options.bushing_length
    return {
        "name": options.name,
        "beam" if kind == "beam" else "structure": structure,
        "bushings": tuple(
            Bushing(x, options.gap, bushing_length, grease, contact, to=to[x], friction=friction, film=film)
            for x in clearances
        ),
        "sensors": tuple(Sensor(_node(x, i), x) for i, x in enumerate(points, 1)),
        "masses": tuple(PointMass(_point(x), si_value(mass, "mass")) for x, mass in options.mass),
        "shaker": Shaker() if options.force_at is None else Shaker("force", options.force_at),
    } | _in_space(options)


def _in_space(options: argparse.Namespace) -> dict[str, Any]:
    """Fields of a rig in space, if any of its options is given."""
    given = (options.gravity, options.spin, options.friction, options.oil, options.unbalance or None)
    if options.motion is None and any(value is not None for value in given):
        options.motion = "spatial"
    fields = {
        "motion": options.motion,
        "gravity": options.gravity and tuple(options.gravity),
        "spin": None if options.spin is None else Spin(options.spin),
        "unbalances": tuple(Unbalance(_point(x), si_value(moment, "kg m")) for x, moment in options.unbalance),
    }
    return {name: value for name, value in fields.items() if value}


def _film(options: argparse.Namespace) -> OilFilm:
    depth = options.section[1] if options.section else options.diameter
    return OilFilm(options.oil, width="finite" if options.bushing_length > SHORTEST_FINITE * depth else "short")


def _node(point: float | str, number: int) -> int:
    """That of a degree of freedom; of other points and of places with names the number of the sensor."""
    dof = parse_dof(point)
    return dof[0] if dof and isinstance(dof[0], int) else number


def _on(shaft: str, x: float) -> float | str:
    return f"{shaft}{x:g}" if shaft else x


def _sorted(points: Sequence[float | str]) -> list[float | str]:
    """Each once, along the shaft."""
    return sorted(set(points), key=_position)


def _position(point: float | str) -> float:
    try:
        return float(str(point).rpartition("@")[2])
    except ValueError:
        raise ClearanceError(f'"{point}" is no place on the shaft; give m, or SHAFT@M') from None


def _section(options: argparse.Namespace, factor: float = 1.0) -> dict[str, Any]:
    names = ("width", "height") if options.section else ("diameter",)
    return {name: factor * size for name, size in zip(names, options.section or [options.diameter])}


def _beam(options: argparse.Namespace) -> Beam:
    material = options.young_modulus, options.density
    return Beam(options.length, *material, rayleigh=tuple(options.rayleigh), **_section(options))


def _shaft(options: argparse.Namespace) -> Shaft:
    """A stepped shaft on two pins."""
    lengths, factors = (0.6 * options.length, 0.4 * options.length), (1.0, 0.8)
    sections = tuple(Section(length, **_section(options, factor)) for length, factor in zip(lengths, factors))
    supports = Support(0.0, "pinned"), Support(options.length, "pinned")
    material = Material(options.young_modulus, options.density)
    return Shaft(sections, supports, material=material, rayleigh=tuple(options.rayleigh))


def _shafts(options: argparse.Namespace) -> Shafts:
    """A rod in a tube, or a bar beside another, clamped both."""
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


def _of_files(kind: str, options: argparse.Namespace, out: Path) -> dict[str, Any]:
    """Plain data of a structure that is read from files, named from the rig file."""
    files = options.file or [Path(name) for name in EXAMPLE_FILES[kind]]
    names = [Path(os.path.relpath(path, out.parent)).as_posix() for path in files]
    if kind != "matrices":
        if len(names) > 1:
            raise ClearanceError(f"--file: kind {kind} is read from one file, got {len(names)}")
        return {"kind": kind, "file": names[0]}
    if not options.units:
        raise ClearanceError("--units is missing: of matrices, such as m-kg-s for m, kg, N or mm-t-s for mm, t, N")
    tables = [name for name in names if name.endswith(".csv")]
    matrices = [name for name in names if name not in tables]
    if len(matrices) not in (1, 2, 3) or len(tables) != int(len(matrices) > 1):
        raise ClearanceError("--file: give one file that holds all, or those of M, K and perhaps C, and a .csv of dofs")
    fields = dict(zip(("mass", "stiffness", "damping"), matrices)) | {"dofs": tables[0]} if tables else {}
    return {"kind": kind, "units": options.units, **(fields or {"file": matrices[0]})}


def _loaded(structure: dict[str, Any], out: Path) -> Structure:
    kind = Structure.known[structure["kind"]]
    named = {name: str(out.parent / structure[name]) for name in kind.files if name in structure}
    return from_plain(kind, structure | named, "structure", RigError)


def _first_points(structure: Structure | None) -> list[float | str]:
    """One of the structure's degrees of freedom, along Z if there is one, where its files are there already."""
    points = structure.named_points if structure else ()
    along_z = [point for point in points if point.endswith("Z") and "R" not in point]
    return list((along_z or points)[:1]) or ["1:+Z"]


def _missing(structure: dict[str, Any], out: Path) -> list[Path]:
    """Files that are not there yet."""
    files = Structure.known[structure["kind"]].files
    paths = [out.parent / structure[name] for name in files if isinstance(structure.get(name), str)]
    return [path for path in paths if not path.exists()]


def _check(text: str, out: Path) -> None:
    """Refuse a rig file that cannot be loaded, unless files are still to come."""
    data = tomllib.loads(text)
    if "structure" in data and (missing := _missing(data["structure"], out)):
        print(f"note: {missing[0]} is not there yet; the rig can be loaded once it is")
        return
    rig = Rig.from_dict(data, out.parent)
    check_units(rig.linear, rig.bushings)
