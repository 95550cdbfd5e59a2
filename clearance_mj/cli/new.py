"""clearance-mj new: start a rig file."""

from __future__ import annotations

import argparse
import dataclasses
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..clearance.law_files import law_schema
from ..errors import ClearanceError
from ..files import to_json, write_text
from ..io.dataset import dataset_schema
from ..rig import Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor, Shaker, rig_schema
from ..validation import descriptions
from .command import command


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    option("name", nargs="?", help="name of the rig")
    option("--schema", type=Path, help="also write a JSON Schema here, for editors")
    option(
        "--schema-of", choices=("rig", "dataset", "law"), default="rig", help="of which files (default: %(default)s)"
    )
    shaft = parser.add_argument_group("shaft")
    shaft.add_argument("--length", type=float, default=1.0, help="m (default: %(default)s)")
    section = shaft.add_mutually_exclusive_group()
    section.add_argument("--diameter", type=float, default=0.01, help="m (default: %(default)s)")
    section.add_argument(
        "--section", type=float, nargs=2, metavar=("WIDTH", "HEIGHT"),
        help="m, of a rectangular shaft, the height in the direction of vibration",
    )  # fmt: skip
    shaft.add_argument("--young-modulus", type=float, default=210e9, metavar="E", help="Pa (default: steel)")
    shaft.add_argument("--density", type=float, default=7850.0, help="kg/m³ (default: steel)")
    shaft.add_argument(
        "--rayleigh", type=float, nargs=2, default=(0.5, 1e-5), metavar=("ETA1", "ETA2"),
        help="damping, 1/s and s (default: 0.5 1e-5)",
    )  # fmt: skip
    shaft.add_argument(
        "--mass", type=float, nargs=2, action="append", default=[], metavar=("POSITION", "MASS"),
        help="m and kg of a mass on the shaft; may be repeated",
    )  # fmt: skip
    bushings = parser.add_argument_group("bushings, all alike")
    bushings.add_argument(
        "--bushings", type=float, nargs="+", metavar="POSITION", help="m from the clamp (default: 0.55 and 0.8 lengths)"
    )
    bushings.add_argument("--gap", type=float, default=3e-4, help="radial clearance, m (default: %(default)s)")
    bushings.add_argument("--bushing-length", type=float, default=0.012, help="m (default: %(default)s)")
    for name, default in (("--contact", "1e4 4"), ("--grease", "4e3 3")):
        bushings.add_argument(
            name, type=float, nargs=2, default=tuple(map(float, default.split())), metavar=("STIFFNESS", "DAMPING"),
            help=f"N/m and N s/m (default: {default})",
        )  # fmt: skip
    test = parser.add_argument_group("test")
    test.add_argument(
        "--sensors", type=float, nargs="+", metavar="POSITION",
        help="m from the clamp, nodes 1, 2, ... (default: a quarter of the length, every bushing, the tip)",
    )  # fmt: skip
    test.add_argument("--force-at", type=float, metavar="POSITION", help="m: driven by a force, not by its base")


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
    return {"files": [str(path) for path in files]}


def _files(options: argparse.Namespace) -> dict[Path, str]:
    """Texts to write, by file."""
    schemas = {"rig": rig_schema, "dataset": dataset_schema, "law": law_schema}
    files = {options.schema: to_json(schemas[options.schema_of]())} if options.schema else {}
    if options.name is None:
        if options.out or not options.schema:
            raise ClearanceError("a rig needs a name: clearance-mj new myrig")
        return files
    if Path(options.name).name != options.name:
        raise ClearanceError(f"name {options.name!r} must not hold a folder; give that to --out")
    out = options.out or Path(f"{options.name}.toml")
    head = ["# SI units. A line that begins with # holds a default, or a key that may be added."]
    if options.schema and options.schema_of == "rig":
        head.insert(0, f"#:schema ./{Path(os.path.relpath(options.schema, out.parent)).as_posix()}")
    return {out: "\n".join([*head, *_lines(_rig(options))]) + "\n"} | files


def _rig(options: argparse.Namespace) -> Rig:
    """Rig of the options."""
    length = options.length
    section = dict(zip(("width", "height"), options.section)) if options.section else {"diameter": options.diameter}
    positions = options.bushings or [0.55 * length, 0.8 * length]
    sensors = options.sensors or sorted({0.25 * length, *positions, length})
    grease, contact = Grease(*options.grease), Contact(*options.contact)
    return Rig(
        options.name,
        Beam(length, options.young_modulus, options.density, rayleigh=tuple(options.rayleigh), **section),
        tuple(Bushing(x, options.gap, options.bushing_length, grease, contact) for x in positions),
        tuple(Sensor(node, x) for node, x in enumerate(sensors, 1)),
        tuple(PointMass(x, mass) for x, mass in options.mass),
        Shaker() if options.force_at is None else Shaker("force", options.force_at),
    )


def _lines(table: Any, name: str = "", plural: bool = False) -> Iterator[str]:
    """Lines of a table of the file: its own keys, then its tables; what is left at its default as a comment."""
    words = descriptions(table.__class__)
    if name:
        yield from ("", f"[[{name}]]" if plural else f"[{name}]")
    tables = []
    for field in dataclasses.fields(table):
        value = getattr(table, field.name)
        if field.name in ("beam", "structure") and value is None:
            continue
        items = value if isinstance(value, tuple) else (value,)
        if all(map(dataclasses.is_dataclass, items)):
            tables.append((field.name, value, items))
            continue
        line = f"{'# ' if value == field.default else ''}{field.name} = {_toml(value)}"
        yield f"{line:32s}# {words[field.name]}"
    for key, value, items in tables:
        for item in items:
            yield from _lines(item, f"{name}.{key}" if name else key, value is items)
        if not items:  # what may be added
            kind = {"bushings": Bushing, "masses": PointMass}[key]
            yield from ("", f"# [[{key}]]", *(f"{f'# {n} =':32s}# {text}" for n, text in descriptions(kind).items()))


def _toml(value: object) -> str:
    """Value as TOML writes it, numbers short."""
    if isinstance(value, float):
        return f"{value:g}" if float(f"{value:g}") == value else repr(value)
    if isinstance(value, tuple):
        return f"[{', '.join(map(_toml, value))}]"
    return "" if value is None else to_json(value).strip()
