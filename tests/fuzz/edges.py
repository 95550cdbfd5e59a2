"""Whole commands on rigs at their edges, of every kind that ``new`` writes, and on short records of every kind."""

import contextlib
import io
import json
import random
import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from clearance_mj import ClearanceError, Rig, RigError
from clearance_mj.cli import main

from . import command_lines

NEW = {
    "beam": "", "a force": "--force-at 0.4", "shaft": "--kind shaft", "deep shaft": "--kind shaft --diameter 0.1",
    "shafts": "--kind shafts", "turning": "--kind shaft --spin 50Hz", "in space": "--shape round",
    "mass on a support": "--kind shaft --mass 0.0 2.0", "one sensor": "--sensors 0.5",
}  # fmt: skip
LINES = (
    "map r.csv --rig rig.toml", "map r.csv --rig rig.toml --kind force", "map r.csv --rig rig.toml --kind base",
    "show r.csv", "show rig.toml", "show rig.toml --out rig.png", "convert r.csv data --rig rig.toml",
    "convert r.csv data --rig rig.toml --leave-out 1:+Z", "convert r.csv frf.uff --frf 2 --rig rig.toml",
    "convert r.csv frf.uff --frf 2", "hammer r.csv --rig rig.toml", "hammer r.csv --at 1:+Z",
    "simulate rig.toml --duration 0.2 --fs 2048 --rms 0 --out out.nc", "simulate rig.toml --duration 0.2 --out out.nc",
    "simulate rig.toml --duration 0.2 --fs 2048 --rms 40 --out out.nc", "modes rig.toml",
    "simulate rig.toml --duration 0.2 --fs 2048 --sine 20 --engine modal --out out.nc",
    "response rig.toml --level 1 --from 8 --to 9 --harmonics 1 --modes 2",
    "backbone rig.toml --harmonics 1 --modes 2 --from 1e-5 --to 2e-5",
    "rattle-map rig.toml --levels 1 --from 8 --to 9 --steps 2 --harmonics 1 --modes 2 --workers 1",
    "campbell rig.toml --speeds 0 3000rpm", "unbalance rig.toml --speeds 0 3000rpm --operating 500rpm 2000rpm",
    "running-clearance rig.toml --speeds 10 3000rpm --operating 500rpm 2000rpm",
    "orbits rig.toml --duration 0.3 --fs 2048", "motion rig.toml --duration 0.2 --fs 1024 --levels 1",
    "animate rig.toml --duration 0.1 --fs 1024 --seconds 0.02 --slow 9 --renderer matplotlib",
    "place rig.toml --sensors 2 --candidates 4 --modes 1,2", "twin r.csv --rig rig.toml --learn 0.5 --window 0.2",
    "update-rig r.csv --rig rig.toml", "identify r.csv --rig rig.toml --method constant --no-figures",
    "identify r.csv --rig rig.toml --method nominal",
)  # fmt: skip
SELDOM = {"identify": 0.1, "update-rig": 0.2, "twin": 0.3, "animate": 0.3, "motion": 0.3}
EXCITATIONS = {
    "noise": lambda rng, t: rng.standard_normal(t.size),
    "hits": lambda rng, t: np.where(np.arange(t.size) % (t.size // 2 + 1) < 5, 50.0, 0.0),
    "a sine": lambda rng, t: np.sin(40 * np.pi * t), "hardly any": lambda rng, t: 1e-6 * rng.standard_normal(t.size),
    "a ramp": lambda rng, t: t * rng.standard_normal(t.size), "nothing": lambda rng, t: np.zeros(t.size),
}  # fmt: skip


def _along_y(part):
    return replace(part, direction=(0.0, 1.0, 0.0))


def _bushing(rig, rng, **changed):
    """The rig with one of its bushings changed."""
    bushings = [*rig.bushings]
    if bushings:
        number = rng.randrange(len(bushings))
        bushings[number] = replace(bushings[number], **{k: v(bushings[number]) for k, v in changed.items()})
    return rig.replace(bushings=tuple(bushings))


EDGES = {
    "as written": lambda rig, rng: rig,
    "grease 0": lambda rig, rng: _bushing(rig, rng, grease=lambda b: replace(b.grease, stiffness=0.0)),
    "no grease": lambda rig, rng: _bushing(rig, rng, grease=lambda b: replace(b.grease, stiffness=0.0, damping=0.0)),
    "offset = gap": lambda rig, rng: _bushing(rig, rng, offset=lambda b: 0.999 * b.gap),
    "no bushings": lambda rig, rng: rig.replace(bushings=()),
    "one sensor": lambda rig, rng: rig.replace(sensors=rig.sensors[:1]),
    "no sensor along the base": lambda rig, rng: rig.replace(sensors=tuple(map(_along_y, rig.sensors))),
    "heavy": lambda rig, rng: rig.replace(masses=tuple(replace(m, mass=1e4) for m in rig.masses)),
    "a base that moves across": lambda rig, rng: rig.replace(shaker=_along_y(rig.shaker)),
}


def make(rng) -> bytes:
    """A rig, a record and a command, as JSON."""
    lines = [*LINES]
    weights = [SELDOM.get(line.split()[0], 1.0) for line in lines]
    drawn = {"rig": rng.choice([*NEW]), "edge": rng.choice([*EDGES]), "excitation": rng.choice([*EXCITATIONS]),
             "seed": rng.randrange(10**6), "line": rng.choices(lines, weights)[0]}  # fmt: skip
    return json.dumps(drawn).encode()


def run(path: Path, rng) -> None:
    """Run a command; ClearanceError if it is refused in one line, as it should be where it cannot be done."""
    drawn = json.loads(path.read_bytes())
    choices = random.Random(drawn["seed"])
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), contextlib.suppress(RigError):
        EDGES[drawn["edge"]](_new(drawn["rig"]), choices).save("rig.toml")
        _record(_new(drawn["rig"]), drawn, choices)
        command_lines.judge(path, *command_lines.typed([*drawn["line"].split(), "--quiet"]))


def prepare(inputs) -> None:
    """Compile what the commands among the inputs need, once: each on a beam under noise."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "edge.json"
        for line in sorted({json.loads(each)["line"] for each in inputs}):
            for kind in ("beam", "turning"):
                drawn = {"rig": kind, "edge": "as written", "excitation": "noise", "seed": 1, "line": line}
                path.write_text(json.dumps(drawn))
                with contextlib.suppress(ClearanceError):
                    run(path, None)


@cache
def _new(kind: str) -> Rig:
    """What ``clearance-mj new`` writes."""
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        path = Path(folder) / "rig.toml"
        assert main(["new", "rig", "--out", str(path), *NEW[kind].split()]) == 0
        return Rig.load(path)


def _record(rig: Rig, drawn: dict, choices: random.Random) -> None:
    """Write a record of some of the rig's sensors and probes, with columns of a logger's names or of this program's."""
    rng, fs = np.random.default_rng(drawn["seed"]), choices.choice((512.0, 2048.0))
    time = np.arange(int(fs * choices.choice((0.1, 1.0, 2.0)))) / fs
    x = EXCITATIONS[drawn["excitation"]](rng, time)
    columns = {"time": time, choices.choice(("base", "force", "Ref [g]")): x}
    for label in rig.sensor_labels[: choices.choice((1, 2, 5, 20))]:
        ring = rng.standard_normal(30) * np.exp(-np.arange(30) / 9)
        name = choices.choice((f"acc:{label}", f"A{label.partition(':')[0]} [g]"))
        columns[name] = np.convolve(x, ring)[: time.size] + choices.choice((0.0, 0.01)) * rng.standard_normal(time.size)
    for label in rig.probe_labels[: choices.choice((0, 1, 9))]:
        columns[f"disp:{label}"] = 1e-5 * np.cumsum(rng.standard_normal(time.size))
    header, rows = ",".join(columns), np.column_stack([*columns.values()])
    np.savetxt("r.csv", rows, "%.8g", ",", header=header, comments="")
