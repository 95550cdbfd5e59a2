"""Every command that a command or a page prints is typed as it stands, on each kind of rig that ``new`` writes."""

import html
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.cli import main
from clearance_mj.io.channels import NOWHERE
from clearance_mj.io.columns import channel_name
from clearance_mj.io.formats import to_channels
from experiments.benches.space.records import keyphasor

from ..conftest import ROOT
from ..signals.test_hammer import beam
from .test_hammer import table

RIG, RECORDS, CHECK = "my rig.toml", ("run 1.csv", "run 2.csv"), "check.csv"
FS, SECONDS, BAND = 1024.0, 6.0, (5.0, 220.0)
FRAME = [f"{ROOT}/models/pump_frame/{name}" for name in ("M.mtx", "K.mtx", "dofs.csv")]
KINDS = {
    "beam": "", "force": "--force-at 0.4", "shaft": "--kind shaft", "deep shaft": "--kind shaft --diameter 0.1",
    "shafts": "--kind shafts", "in space": "--shape round",
    "turning": "--kind shaft --spin 50Hz --unbalance 0.5 20g-mm",
    "matrices": f"--kind matrices --units mm-t-s --bushings 36:Y --sensors 33:+Y 34:+Y --force-at 18:+Y "
    f"--file {' '.join(FRAME)}",
    "mjcf": f"--kind mjcf --file {ROOT}/models/table1_rig_links.xml",
}  # fmt: skip
STAND_INS = {"FILE...": RECORDS, "RIG": [RIG], "NAME": [RIG.partition(".")[0]]}
CHEAP = {"identify": "--method nominal --no-figures", "study": "--methods nominal"}
"""What is added, since minutes of identification are not what these tests are about"""


def printed(text):
    """Commands that a text prints; of a page those in its boxes."""
    boxes = "\n".join(html.unescape(box) for box in re.findall(r"<pre><code>(.*?)</code></pre>", text, re.DOTALL))
    lines = re.findall(r"^(?:.*: )?(clearance-mj .+?)(?:: [a-z].*)?$", boxes or text, re.MULTILINE)
    return [tuple(shlex.split(line)[1:]) for line in lines]


@pytest.fixture
def typed(tmp_path, monkeypatch, capsys):
    """Type commands, then all that they, those after them and their pages print; return what was typed."""
    monkeypatch.chdir(tmp_path)

    def follow(*first):
        waiting, done, named = [*first], [], {}
        while waiting:
            command = tuple(word for each in waiting.pop(0) for word in STAND_INS.get(each, (each,)))
            if command in done:
                continue
            done.append(command)
            pages = {path: path.stat().st_mtime_ns for path in Path().rglob("*.html")}
            capsys.readouterr()
            status = main([*command, *CHEAP.get(command[0], "").split()])
            said = capsys.readouterr()
            assert status == 0, (command, said.err)
            texts = [
                said.out,
                *(p.read_text("utf-8") for p in Path().rglob("*.html") if pages.get(p) != p.stat().st_mtime_ns),
            ]
            waiting += [following for text in texts for following in printed(text)]
            match command[0]:
                case "new":
                    named, more = recorded(cm.Rig.load(RIG))
                    waiting += more
                case "map" if '"?"' in Path("map.toml").read_text("utf-8"):
                    cm.ChannelMap(named).save("map.toml")  # what the program cannot tell the user knows
                case "convert" if command[-1] != "validate" and "orbit" not in command:
                    what = [w for pair in zip(command, command[1:]) if pair[0] in ("--map", "--column") for w in pair]
                    waiting.insert(0, ("convert", CHECK, "bench", *what, "--role", "validate"))
        return {command[0] for command in done}

    return follow


def recorded(rig):
    """Write what a logger records of a rig, names its own; return what they are, and commands if ``map`` is no help."""
    for seed, path in enumerate((*RECORDS, CHECK)):
        noise = cm.excitation.random(SECONDS, FS, BAND, 1.0, seed, kind=rig.shaker.kind)
        named = logged(path, to_channels(cm.simulate(rig, noise)), rig.spin, seed)
    if not rig.moves_across:
        return named, []
    more = [("convert", *RECORDS, "bench", *["--rig", RIG, *_columns(named)])]
    if rig.spin:
        still = cm.simulate(rig, cm.excitation.still(SECONDS, FS))
        probes = [c for c in to_channels(still, rig) if c.quantity == "displacement"]
        more.append(("convert", "orbit.csv", "machine", "--rig", RIG, "--role", "orbit",
                     *_columns(logged("orbit.csv", probes, rig.spin, 4))))  # fmt: skip
    return named, more


def logged(path, channels, spin, seed):
    """Write channels under a logger's names, with noise and a keyphasor; return what each one is."""
    rng = np.random.default_rng(seed)
    rows = [(c.quantity, c.value + 1e-3 * c.value.std() * rng.standard_normal(c.value.size)) for c in channels]
    if spin:
        rows.append(("unknown", keyphasor(spin.angle_at(np.arange(rows[0][1].size) / FS))))
    cm.write(path, [cm.Channel(f"CH{i}", *NOWHERE, quantity, value, FS) for i, (quantity, value) in enumerate(rows)])
    names = [*(channel_name(c.label, c.quantity) for c in channels), *["keyphasor"] * bool(spin)]
    return {f"CH{i}": name for i, name in enumerate(names)}


def _columns(named):
    return [word for name, channel in named.items() for word in ("--column", f"{name}={channel}")]


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_every_printed_command_runs(typed, kind):
    """From ``new`` to the page of the study; of a shaft that turns also to its clearances from orbits."""
    done = typed(("new", "my rig", *KINDS[kind].split()))
    assert {"convert", "identify", "simulate", "study"} <= done
    assert ("orbit-gaps" in done) == (kind == "turning") and ("map" in done) == (kind not in ("turning", "in space"))


@pytest.mark.slow
def test_every_command_after_hits_runs(typed, tmp_path):
    """From a file of hits over modes to a rig of what was hit, and its study."""
    table(tmp_path / "a.csv", beam(), "Time [s],Hammer [N],A1 [g],A2 [g]")
    done = typed(("hammer", "a.csv", "--at", "2:+Z", "--column", "A1=acc:1 [g]", "--column", "A2=acc:2 [g]"))
    assert {"modes", "new", "map", "convert", "identify", "study"} <= done


@pytest.mark.slow
def test_what_show_prints_runs(typed, tmp_path):
    """Of a record whose channels have no place."""
    assert main(["new", "my rig", "--length", "620mm"]) == 0
    recorded(cm.Rig.load(RIG))
    assert {"map", "convert", "identify", "simulate", "study"} <= typed(("show", RECORDS[0]))
