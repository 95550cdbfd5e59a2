"""Whole command lines: valid ones of every command with options, values and files that nobody should give."""

import argparse
import asyncio
import contextlib
import io
import json
import os
import re
import shutil
import socket
import tempfile
import webbrowser
from functools import cache
from pathlib import Path
from unittest import mock

from clearance_mj import ClearanceError, write_dataset
from clearance_mj.cli import Parser, find, main
from clearance_mj.core import tasks
from clearance_mj.io import formats
from clearance_mj.live import server

from . import samples
from .mutations import toml

ASIDE = re.compile(r"clearance-mj: (warning|note): ")
LINES = {
    "new": "new bench --kind beam",
    "simulate": "simulate rig.toml --engine modal --duration 0.05 --fs 1024 --out response.nc",
    "animate": "animate rig.toml --engine modal --duration 0.1 --fs 1024 --seconds 0.02 --slow 9 --renderer matplotlib",
    "motion": "motion rig.toml --engine modal --duration 0.1 --fs 1024 --levels 1 --sine 50",
    "listen": "listen rig.toml --duration 1 --fs 1024 --levels 1 --sensor 7 --area 0.1 --distance 1 --method none",
    "compare": "compare frf.uff frf.csv --modes 0",
    "show": "show record.uff frf.csv",
    "convert": "convert record.uff copy.csv",
    "modes": "modes modal.uff --modes 2",
    "calibrate": "calibrate rig.toml frequencies.csv --free beam.length=0.9:1.1 --starts 1",
    "update-rig": "update-rig bench --as-drawn",
    "identify": "identify bench --method nominal --no-figures --out new",
    "identify a law": "identify bench --method constant --no-figures --out new",
    "identify a bench": "identify bench --no-figures",
    "place": "place rig.toml --sensors 4 --candidates 6 --modes 1,2",
    "sweep": "sweep plan.toml --workers 1",
    "response": "response rig.toml --level 1 --from 8 --to 9 --harmonics 1 --modes 2",
    "backbone": "backbone rig.toml --harmonics 1 --modes 2 --from 1e-5 --to 2e-5",
    "rattle-map": "rattle-map rig.toml --levels 1 --from 8 --to 9 --steps 2 --harmonics 1 --modes 2 --workers 1",
    "twin": "twin bench/ramp.uff --rig bench/rig.toml --learn 2 --window 1 --rig-exact",
    "study": "study bench --engines modal --methods nominal",
    "vehicle": "vehicle --controller smc --manoeuvre slalom --speed 60 --plant single-track",
    "live": "live rig.toml --no-browser --out address.txt",
}  # Of each command one that is cheap and ends well
SELDOM = {
    "sweep": 0.2, "rattle-map": 0.3, "vehicle": 0.2, "animate": 0.2, "motion": 0.2, "listen": 0.2,
    "calibrate": 0.4, "place": 0.5, "response": 0.4, "backbone": 0.4, "update-rig": 0.2, "identify a law": 0.2,
    "identify a bench": 0.04, "twin": 0.3, "study": 0.04,
}  # fmt: skip
"""Weights of those that take long, or do nothing"""
NUMBERS = (
    "nan", "inf", "-inf", "-1", "0", "1", "2", "1e308", "-1e300", "1e-308", "1e12", "1e300", "99999999999", "10000",
    "99999999999999999999", "1000000", "-0.0", "1_0", "0x10", "١", "0,0", "1,2", "1:2:3", "1:10:100000", "0:1",
    "5e-324",
)  # fmt: skip
TEXTS = (
    "", " ", "abc", ",", "=", "a=b", "--", "-", "%s", "{}", "a\nb", "\udcff", "𝔘", "ä" * 300, "é", "x" * 5000, "None",
)  # fmt: skip
WORDS = ("modal", "links", "nominal", "constant", "ridge", "all", "beam", "modes", "frf", "base", "force",
         "identify", "validate", "trace", "exhaustive", "1:+Z", "6:+Z", "100:+Z", "beam.length=0.9:1.1", "acc 6=skip",
         "bushings.gap=1e-4:5e-4", "mujoco", "friction")  # fmt: skip
SPECIAL = ("pipe", "socket", "zero", "full", "null", "loop", "dangling", "huge.csv", "empty.toml", "folder", ".", "..",
           "link.toml", "nowhere/x.nc", "rig.toml/x", "pipe.uff", "zero.csv", "zero.toml")  # fmt: skip
FOREIGN = ("placement.csv", "placement.json", "comparison.html", "report.html", "summary.json", "results.nc", "lock",
           "plan.json", "cases", "rig.toml", "law.json", "response.csv", "backbone.png", "modes.csv", "energy.csv",
           "motion.json", "calibration.json", "identified.json", "index.html", "sweep.html", ".DS_Store",
           ".ipynb_checkpoints/a.ipynb", "figures/rig.png", "tables/modes.csv", "thesis.tex")  # fmt: skip
"""Files of the user's, many with the names of this program's own, in each of two folders"""
FILES = ("rig.toml", "law.json", "record.uff", "frf.uff", "frf.csv", "modal.uff", "frequencies.csv", "plan.toml",
         "data", "bench", "bench/ramp.uff", "bench/rig.toml", "notes.nc", "notes.json", "notes.gif", "notes.csv",
         "mine", "mine/rig.toml")  # fmt: skip
OWN = ("out", "out.nc", "out.json", "out.csv", "out.uff", "out.gif", "out.toml", "mine", "mine/rig.toml", "notes.nc",
       "rig.toml", "record.uff", "data", "notes.json", "notes.gif", "law.json")  # fmt: skip
"""Where to write"""


def make(rng) -> bytes:
    """A command line, as JSON."""
    names = list(LINES)
    line = LINES[rng.choices(names, [SELDOM.get(name, 1.0) for name in names])[0]].split()
    name = line[0]
    for _ in range(rng.choice((1, 1, 1, 2, 2, 3))):
        rng.choice((_value, _value, _option, _option, _out, _dropped, _put_in))(rng, name, line)
    return json.dumps([*line, "--quiet"]).encode()


def prepare(inputs) -> None:
    """Run the valid line of every command among the inputs once."""
    commands = {json.loads(line)[0] for line in inputs}
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "line.json"
        for line in LINES.values():
            if line.split()[0] in commands:
                path.write_text(json.dumps([*line.split(), "--quiet"]))
                with contextlib.suppress(ClearanceError):
                    run(path, None)


def tame() -> contextlib.ExitStack:
    """What would start processes runs in threads, no browser is opened, and live pages end once they answer."""
    stack = contextlib.ExitStack()
    for holder, name, instead in (
        (tasks, "_on_processes", tasks._on_threads), (webbrowser, "open", lambda *_: True), (server, "serve", _served),
        (server.Page, "_warm", lambda page: None),
    ):  # fmt: skip
        stack.enter_context(mock.patch.object(holder, name, instead))
    return stack


def _served(page, ready) -> None:
    """Serve, and end as by Ctrl-C once the page answers."""

    def end():
        ready()
        raise KeyboardInterrupt

    asyncio.run(page.run(end))


def run(path: Path, rng) -> None:
    """Run a command line among files of the user's; ClearanceError if it is refused as it should be."""
    line, world = json.loads(path.read_bytes()), path.parent / "world"
    if not world.exists():
        shutil.copytree(_template(), world)
        _hostile(world)
    before = _kept(world)
    with contextlib.chdir(world):
        outcome = typed(line)
    if (after := _kept(world)) != before:
        shutil.rmtree(world)  # the next line finds it as this one did
    asked = {"data/dataset.toml", "bench/dataset.toml", *line} if "convert" in line else set()
    changed = [file for file in before if after.get(file) != before[file] and file not in asked]
    assert not changed, f"files of the user's were changed: {changed}"
    judge(path, *outcome)


def typed(line) -> tuple[int | str | None, list[str]]:
    """Status of a command line, and the lines that it wrote to standard error without notes."""
    words = io.StringIO()
    with tame(), contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(words):
        try:
            status = main(line)
        except SystemExit as end:
            status = end.code
    return status, [text for text in words.getvalue().splitlines() if not ASIDE.match(text)]


def judge(path: Path, status, said) -> None:
    """Raise a ClearanceError if a command was refused in one line; anything but that or success is a finding."""
    assert status in (0, None, 2), f"status {status}: {said[-1:]}"
    if status == 2:
        assert len(said) == 1 and said[0].isprintable(), f"{len(said)} lines: {said[:3]}"
        raise ClearanceError(f"{path}: {said[0]}")


def _value(rng, name, line):
    """Another value for a word of the line."""
    place = rng.randrange(1, len(line)) if len(line) > 1 else 0
    if place and not line[place].startswith("--"):
        line[place] = _any(rng)


def _option(rng, name, line):
    """An option of the command, with as many values as it has."""
    flags = [action for action in _actions(name) if action.option_strings and action.dest not in ("help", "out")]
    action = rng.choice(flags)
    line.append(action.option_strings[0])
    count = {None: 1, "+": rng.choice((1, 2)), "*": 1, "?": 1}.get(action.nargs, action.nargs)
    for _ in range(count):
        line.append(rng.choice(list(action.choices)) if action.choices and rng.random() < 0.5 else _any(rng))


def _out(rng, name, line):
    line += ["--out", rng.choice((rng.choice(OWN), rng.choice(OWN), rng.choice(SPECIAL), rng.choice(TEXTS)))]


def _dropped(rng, name, line):
    del line[rng.randrange(1, len(line)) if len(line) > 1 else 0 :][:1]


def _put_in(rng, name, line):
    line.insert(rng.randrange(1, len(line) + 1), _any(rng))


def _any(rng) -> str:
    return rng.choice(rng.choices((NUMBERS, TEXTS, WORDS, SPECIAL, FILES), (6, 2, 2, 2, 2))[0])


@cache
def _actions(name) -> list[argparse.Action]:
    parser = Parser()
    find(name).add(parser.add_subparsers())
    [commands] = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    return commands.choices[name]._actions


@cache
def _template() -> Path:
    """Folder of whole files, and of foreign ones."""
    folder = Path(tempfile.mkdtemp(prefix="fuzz_world_"))
    entries, files = samples.dataset()
    whole = samples.beside_plan() | {"frequencies.csv": samples.FREQUENCIES[1], "plan.toml": toml(samples.PLAN)}
    whole |= {f"data/{file}": data for file, data in (files | {"dataset.toml": toml(entries)}).items()}
    whole |= {f"{place}/{file}": f"{place} {file}".encode() for place in ("mine", "beside") for file in FOREIGN}
    whole |= {f"notes.{kind}": b"the user's\n" for kind in ("nc", "json", "gif", "csv")}
    for file, data in whole.items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_bytes(data)
    for file, frf in (("frf.uff", samples.frf()), ("frf.csv", samples.frf()), ("modal.uff", samples.modal_frf())):
        formats.write(folder / file, frf)
    write_dataset(folder / "bench", *samples.bench())
    return folder


def _hostile(world: Path) -> None:
    """What cannot be copied."""
    for name in ("pipe", "pipe.uff"):
        os.mkfifo(world / name)
    with contextlib.chdir(world), socket.socket(socket.AF_UNIX) as open_one:
        open_one.bind("socket")
    for name, target in (("zero", "/dev/zero"), ("zero.csv", "/dev/zero"), ("zero.toml", "/dev/zero"), ("loop", "loop"),
                         ("full", "/dev/full"), ("null", "/dev/null"), ("dangling", "not-there"),
                         ("link.toml", "rig.toml")):  # fmt: skip
        (world / name).symlink_to(target)
    (world / "empty.toml").touch()
    (world / "folder").mkdir()
    with (world / "huge.csv").open("wb") as file:
        file.truncate(2**40)


def _kept(world: Path) -> dict[str, bytes]:
    """What no command may change: all that was there, but what is this program's own output."""
    content = {}
    for path in world.rglob("*"):
        name = str(path.relative_to(world))
        if path.is_symlink():
            content[name] = os.readlink(path).encode()
        elif path.is_file() and name != "huge.csv":
            content[name] = path.read_bytes()
        else:
            content[name] = str(os.lstat(path).st_mode).encode()
    return content
