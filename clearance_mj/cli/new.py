"""clearance-mj new: start a rig file."""

from __future__ import annotations

import math
import os
import re
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..clearance.bushing_layer import LAYER_MATERIALS, layer_contact
from ..clearance.law_files import law_schema
from ..core.errors import ClearanceError, RigError
from ..core.files import to_json, write_text
from ..core.plain_numbers import get_number, numbers, path_of
from ..core.quantities import QUANTITIES
from ..core.units import si_value
from ..core.validation import from_plain
from ..io.dataset import dataset_schema
from ..rig import PointMass, Rig, Sensor, Shaker, Spin, Tolerance, Unbalance, rig_schema
from ..rig.clearance import Bushing, Contact, Friction, Grease, OilFilm
from ..rig.plausible import check_units
from ..structure import Structure
from ..structure.base import parse_dof
from ..version import __version__
from .command import Group, Options, Result, command, given, option, spelled
from .new_gears import EXAMPLES as OF_GEARS
from .new_gears import GEARS, ONLY_GEARS, gear_fields
from .new_shaft import ONLY_SHAFT, SHAFT, STRUCTURES
from .options import length, point, si_number_parser, spin
from .rig_text import rig_lines

WORDS = {
    "beam": "a uniform cantilever",
    "shaft": "a shaft of sections, with supports and discs",
    "shafts": "several parallel shafts",
    "gears": "two gears with backlash under a mean torque",
    "matrices": "mass and stiffness matrices out of files",
    "modes": "the modes of a test or of a finite element program, out of a file",
    "mjcf": "a MuJoCo model",
}
SHORTEST_FINITE = 0.25  # L/D up to which a short bearing's oil is near enough
EXAMPLES: dict[str, tuple[Any, str]] = {
    "length": (1.0, "beam.length sections.length"), "diameter": (0.01, "diameter parts.sections.inner_diameter"),
    "young_modulus": (210e9, "young_modulus"), "density": (7850.0, "density"), "rayleigh": ((0.5, 1e-5), "rayleigh"),
    "support": (None, "supports.position supports.translation supports.translation_damping"),
    "bushings": (None, "bushings.position bushings.to"), "gap": (3e-4, "bushings.gap"),
    "bushing_length": (0.012, "bushings.length"), "contact": ((1e4, 4.0), "contact.stiffness contact.damping"),
    "grease": ((4e3, 3.0), "grease.stiffness grease.damping"), "sensors": (None, "sensors.position"),
}  # fmt: skip
"""Values of options that are not given, where one value does, and the ends of the paths of these numbers."""
KNOWN_TO = {
    "diameter": "5 %", "inner_diameter": "5 %", "young_modulus": "3 %", "density": "1 %", "gap": "20 %",
    "stiffness": "230 %", "damping": "230 %", "translation": "230 %", "translation_damping": "230 %",
}  # fmt: skip
"""Standard deviations of examples, by their fields; 230 % is a factor of ten where records decide"""
EXAMPLE_FILES = {"matrices": ["model.npz"], "modes": ["modes.uff"], "mjcf": ["model.xml"]}
"""Examples of the files of each kind of structure."""


@command(
    "new",
    option("name", "name of the rig", nargs="?"),
    option("--kind", "of structure (default: beam; asked for at a terminal if there is no name)", choices=WORDS),
    option("--file", "of kind matrices: a .npz or .mat, or files of M, K and perhaps C, and a .csv of degrees of "
           "freedom; of modes: a .uff or .csv; of mjcf: a .xml", Path, nargs="+"),
    option("--units", "of kind matrices: such as m-kg-s or mm-t-s"),
    option("--schema", "also write a JSON Schema here, for editors", Path),
    option("--schema-of", "of which files", default="rig", choices=("rig", "dataset", "law")),
    Group("shaft (of kinds beam, shaft and shafts)", SHAFT),
    Group("gears (of kind gears, with --contact of the mesh and --spin)", GEARS),
    Group("bushings, all alike", (
        option("--bushings", 'm along the shaft, or a text: a degree of freedom "12:+Z" or a shaft\'s "rod@0.4" '
               "(example: two)", point, nargs="+", metavar="POINT"),
        option("--gap", "radial clearance, m or such as 0.3mm or 5mil (example: 3e-4)", length),
        option("--bushing-length", "m (example: 0.012)", length),
        *(option(name, f"N/m, N s/m (example: {values})", float, nargs=2, metavar=("STIFFNESS", "DAMPING"))
          for name, values in (("--contact", "1e4 4"), ("--grease", "4e3 3"))),
        option("--bushing-material", "lining, from which contact stiffness is proposed", choices=LAYER_MATERIALS),
        option("--bushing-thickness", "m, of that lining", length),
    )),
    Group("in space: round bushings, motion along y and z", (
        option("--shape", 'of the bushings; "round" goes without saying with what follows', choices=("slot", "round")),
        option("--gravity", "m/s² or g", si_number_parser("acceleration"), nargs=3, metavar=("X", "Y", "Z")),
        option("--spin", "of a shaft that turns: rad/s, or such as 1500rpm", spin, metavar="SPEED"),
        option("--unbalance", "at a point of a shaft that turns, kg m or such as 20g-mm", nargs=2, action="append",
               metavar=("POINT", "MOMENT")),
        option("--friction", "coefficient of friction in the bushings", float, metavar="MU"),
        option("--oil", "Pa s: oil in the bushings, not grease", si_number_parser("Pa s"), metavar="VISCOSITY"),
    )),
    Group("test", (
        option("--sensors", "with nodes 1, 2, ... or those of degrees of freedom (example: a quarter of the length, "
               "every bushing, the tip)", point, nargs="+", metavar="POINT"),
        option("--reads", "what the sensors read", default="acceleration",
               choices=[name for name in QUANTITIES if name != "force"]),
        option("--force-at", "driven by a force, not by its base", point, metavar="POINT"),
    )),
    out_help="rig file (default: NAME.toml)",
)  # fmt: skip
def run(options: Options) -> Result:
    """Write a commented rig file to go on from; what is not given is an example."""
    files = _files(options)
    for path in files:
        if path.exists():
            raise ClearanceError(f"{path} is there already and stays as it is; give another file")
    for path, text in files.items():
        write_text(path, text)
    words = [*options.notes, *(f"written: {path}" for path in files)]
    if options.examples:
        words += [f"nobody gave these numbers; they are examples until you put in yours: {', '.join(options.examples)}"]
    if options.mass:
        words += ["masses are points without inertia; --disc gives a body of a size"]
    if rigs := [path for path in files if path.suffix == ".toml"]:
        if options.spin and options.kind != "gears":
            following = f"{spelled('campbell', rigs[0])}: its critical speeds"
        elif options.shape == "round" or options.kind == "gears":
            following = f"{spelled('simulate', rigs[0])}: how it vibrates"
        else:
            following = f"{spelled('map', 'FILE...', '--rig', rigs[0])}: which channel of your records is which sensor"
        words += [f"next: {following}"]
    return Result({"files": [str(path) for path in files], "examples": options.examples}, words)


def _files(options: Options) -> dict[Path, str]:
    """Return the texts to write, by file."""
    schemas = {"rig": rig_schema, "dataset": dataset_schema, "law": law_schema}
    options.examples, options.notes = [], []
    files = {options.schema: to_json(schemas[options.schema_of]())} if options.schema else {}
    if not (options.name or options.out or options.schema) and sys.stdin.isatty():
        _ask(options)
    if options.name is None:
        if options.out or not options.schema:
            raise ClearanceError("a rig needs a name: clearance-mj new myrig")
        return files
    if Path(options.name).name != options.name:
        raise ClearanceError(f"name {options.name!r} must not hold a folder; give that to --out")
    out = options.out or Path(f"{options.name}.toml")
    rig = _with_markers(options, _with_examples(options), _fields(options, out))
    head = [f"# Begun by clearance-mj new {__version__}."]
    head += ["# SI units. A line that begins with # holds a default, or a key that may be added."]
    if options.schema and options.schema_of == "rig":
        head.insert(0, f"#:schema ./{Path(os.path.relpath(options.schema, out.parent)).as_posix()}")
    text = "\n".join([*head, *rig_lines(rig)]) + "\n"
    data = tomllib.loads(text)
    if "structure" in data and (missing := _missing_files(data["structure"], out)):
        options.notes = [f"note: {missing[0]} is not there yet; the rig can be loaded once it is"]
    else:
        loaded = Rig.from_dict(data, out.parent)
        check_units(loaded.linear, loaded.bushings)
    return {out: text} | files


def _ask(options: Options) -> None:
    """Ask at a terminal for options that are not given."""
    options.name = input("Name of the rig: ").strip() or None
    if options.kind is None:
        print("\n".join(f"  {kind:10s}{WORDS[kind]}" for kind in WORDS))
        options.kind = input("Kind of structure [beam]: ").strip() or None
        if options.kind not in (*WORDS, None):
            raise ClearanceError(f'kind "{options.kind}" is unknown; use {", ".join(WORDS)}')
    if options.kind in EXAMPLE_FILES and not options.file:
        options.file = [Path(name) for name in input(f"File [{EXAMPLE_FILES[options.kind][0]}]: ").split()] or None
    if options.kind == "matrices" and not options.units:
        options.units = input("Units of the matrices, such as m-kg-s or mm-t-s: ").strip() or None


def _fields(options: Options, out: Path) -> dict[str, Any]:
    """Return the rig's fields of the options, the structure as an object or plain data."""
    kind = options.kind
    if kind != "beam" and kind not in Structure.known:
        raise ClearanceError(f'kind "{kind}" is not installed; use beam, {", ".join(Structure.known)}')
    if kind == "gears":
        return {"name": options.name} | gear_fields(options) | _instruments(options, options.sensors or ["1:X", "2:X"])
    if kind in EXAMPLE_FILES:
        structure: Any = _of_files(kind, options, out)
        loaded = None if _missing_files(structure, out) else _load(structure, out)
        points = options.sensors or _first_points(loaded)
        if loaded and options.force_at is None and loaded.refusal("base"):
            options.force_at = points[0]
        clearances: Sequence[float | str] = options.bushings or points[:1]
    else:
        structure = STRUCTURES[kind](options)
        length = options.length
        first, *places, last = [f"rod@{s * length:g}" if kind == "shafts" else s * length for s in (0.25, 0.55, 0.8, 1)]
        clearances = options.bushings or places
        points = options.sensors or sorted({first, *clearances, *([] if kind == "shaft" else [last])}, key=_position)
    grease = Grease(*options.grease) if options.oil is None else Grease(0.0)  # oil is in its place
    friction = None if options.friction is None else Friction(options.friction)
    to = {x: x.replace("rod@", "tube@") if kind == "shafts" and isinstance(x, str) else None for x in clearances}
    length = 0.0 if kind in EXAMPLE_FILES else options.bushing_length
    layers = [_contact_and_film(options, None if kind in EXAMPLE_FILES else structure, x) for x in clearances]
    in_space = _in_space(options)
    shape = options.shape if options.shape == "round" else None
    bushings = tuple(
        Bushing(x, options.gap, length, grease, contact, to=to[x], friction=friction, film=film, shape=shape)
        for x, (contact, film) in zip(clearances, layers)
    )
    return {
        "name": options.name,
        "beam" if kind == "beam" else "structure": structure, "bushings": bushings, **_instruments(options, points),
        "shaker": Shaker() if options.force_at is None else Shaker("force", options.force_at),
    } | in_space  # fmt: skip


def _instruments(options: Options, points: Sequence[float | str]) -> dict[str, Any]:
    """Return sensors at points, and masses."""
    return {
        "sensors": tuple(Sensor(_node(x, i), x, quantity=options.reads) for i, x in enumerate(points, 1)),
        "masses": tuple(PointMass(point(x), si_value(mass, "mass")) for x, mass in options.mass),
    }


def _with_examples(options: Options) -> list[str]:
    """Fill in examples for missing options; return the ends of the paths of these numbers."""
    only = {"gears": given(options, *ONLY_GEARS), "shaft": given(options, *ONLY_SHAFT)}
    likely = [kind for kind, names in only.items() if names] or ["shaft" if options.spin is not None else "beam"]
    options.kind = options.kind or likely[0]
    for kind, names in only.items():
        if names and options.kind != kind:
            structure_name = "a shaft" if kind == "shaft" else kind
            raise ClearanceError(f"{names[0]} is of {structure_name}: give --kind {kind}, not {options.kind}")
    if bool(options.bushing_material) != (options.bushing_thickness is not None):
        raise ClearanceError("--bushing-material and --bushing-thickness belong together: give both")
    if options.bushing_material and (options.contact or options.section or options.kind in EXAMPLE_FILES):
        raise ClearanceError("--bushing-material proposes the contact of a round shaft: leave it out, or --contact")
    instead = {"diameter": options.section or options.step, "length": options.step, "grease": options.oil is not None}
    lines = []
    for name, (value, paths) in (OF_GEARS if options.kind == "gears" else EXAMPLES).items():
        if getattr(options, name) in (None, []) and not instead.get(name):
            lines += paths.split()
            setattr(options, name, value)
    return [path for path in lines if not (options.bushing_material and path == "contact.stiffness")]


def _with_markers(options: Options, ends: Sequence[str], rig: dict[str, Any]) -> dict[str, Any]:
    """Add to a rig the paths of the numbers that are examples, and tolerances of those, and of a proposed contact."""
    data = tomllib.loads("\n".join(rig_lines(rig)))
    paths = dict.fromkeys(re.sub(r"\[\d+\]", "", path_of(key)) for key in numbers(data) if get_number(data, key))
    options.examples = [path for path in paths if f".{path}".endswith(tuple(f".{end}" for end in ends))]
    stds = {path: KNOWN_TO.get(path.rpartition(".")[2]) for path in options.examples}
    if options.bushing_material:
        stds["bushings.contact.stiffness"] = f"{100 * options.spread:.0f} %"
    tolerances = tuple(Tolerance(path, std) for path, std in stds.items() if std)
    return rig | {"examples": tuple(options.examples), "tolerances": tolerances}


def _contact_and_film(
    options: Options, structure: Structure | None, point: float | str
) -> tuple[Contact, OilFilm | None]:
    """Return contact and oil of a bushing: as given, examples, or from its material and the shaft in it."""
    which, x = structure.place(point) if structure else (0, 0.0)
    radius = structure.shafts[which].half_depth(x) if structure else math.inf
    width: Any = "finite" if options.bushing_length > SHORTEST_FINITE * 2 * radius else "short"
    film = None if options.oil is None else OilFilm(options.oil, width=width)
    if not options.bushing_material:
        return Contact(*options.contact), film
    sizes = options.bushing_thickness, options.bushing_length, radius, options.gap
    contact = layer_contact(options.bushing_material, *sizes)
    options.spread = max(getattr(options, "spread", 0.0), contact.spread)
    rounded = [float(f"{value:.3g}") for value in (contact.stiffness, contact.bearable_depth)]
    return Contact(rounded[0], options.contact[1], rounded[1]), film


def _in_space(options: Options) -> dict[str, Any]:
    """Return the fields of a rig in space, if any of its options is given."""
    if options.shape is None and given(options, "gravity", "spin", "friction", "oil", "unbalance"):
        options.shape = "round"
    fields = {
        "gravity": options.gravity and tuple(options.gravity),
        "spin": None if options.spin is None else Spin(options.spin),
        "unbalances": tuple(Unbalance(point(x), si_value(moment, "kg m")) for x, moment in options.unbalance),
    }
    return {name: value for name, value in fields.items() if value}


def _node(point: float | str, number: int) -> int:
    """Return the node of a degree of freedom; of other points and named places, the number of the sensor."""
    dof = parse_dof(point)
    return dof[0] if dof and isinstance(dof[0], int) else number


def _position(point: float | str) -> float:
    try:
        return float(str(point).rpartition("@")[2])
    except ValueError:
        raise ClearanceError(f'"{point}" is no place on the shaft; give m, or SHAFT@M') from None


def _of_files(kind: str, options: Options, out: Path) -> dict[str, Any]:
    """Return the plain data of a structure read from files, with paths relative to the rig file."""
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


def _load(structure: dict[str, Any], out: Path) -> Structure:
    kind = Structure.known[structure["kind"]]
    named = {name: str(out.parent / structure[name]) for name in kind.files if name in structure}
    return from_plain(kind, structure | named, "structure", RigError)


def _first_points(structure: Structure | None) -> list[float | str]:
    """Return one degree of freedom of the structure, along Z if possible, where its files exist already."""
    points = structure.named_points if structure else ()
    along_z = [point for point in points if point.endswith("Z") and "R" not in point]
    return list((along_z or points)[:1]) or ["1:+Z"]


def _missing_files(structure: dict[str, Any], out: Path) -> list[Path]:
    """Return the files that do not exist yet."""
    files = Structure.known[structure["kind"]].files
    paths = [out.parent / structure[name] for name in files if isinstance(structure.get(name), str)]
    return [path for path in paths if not path.exists()]
