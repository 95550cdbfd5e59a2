"""SIGKILL at random moments of a study, a sweep and the article: what goes on afterwards ends as if nothing had been.

Fifty files of the user's, many named as this program's own are, lie in and around the folder that is written into;
after every kill each is as it was, byte by byte.
"""

import random
import shutil
import sys
import time
from types import ModuleType

import pandas as pd
import pytest

from clearance_mj.core.output_folder import WORK
from clearance_mj.core.runner import Runner
from clearance_mj.report import report_study
from clearance_mj.sweep import load_plan, run_sweep
from experiments.article import ITEMS, Inputs, Item, Result, register, reproduce

from .processes import FORK, PATIENCE, content, ended
from .sweep.plans import loaded, small
from .test_faults import no_report

KILLS = 20
IN_A_ROW = 5  # kills before a run is left to end
BESIDE = [f"{folder}/{name}" for folder in ("out.old", "out.partial", "beside") for name in (
    "report.html", "results.nc", "summary.json", "lock", "plan.json", "cases.npy", "small.csv", "thesis.tex",
    "cache/x.nc", ".DS_Store",
)]  # fmt: skip
INSIDE = [f"{folder}{name}" for folder in ("", "figures/", "notes/", ".ipynb_checkpoints/") for name in (
    "photo.png", "book.tex", "._.DS_Store", "raw.csv", "diary.txt",
)]  # fmt: skip


def a_study(folder, out):
    report_study(folder / "data", out, ["modal"], ["nominal"], 1, progress=False)


def a_sweep(folder, out):
    run_sweep(load_plan(folder / "plan.toml"), out, Runner(1))


def the_article(folder, out):
    reproduce([], out, folder / "data", progress=False)


@pytest.fixture
def prepared(request, tmp_path, small_dataset, monkeypatch):
    """Folder of what each of the three reads."""
    shutil.copytree(small_dataset, tmp_path / "data")
    loaded(tmp_path, small(6))
    monkeypatch.setattr("clearance_mj.report.write_report", no_report)
    module = ModuleType("slow_item")

    def item(name, quick, rig):
        time.sleep(0.1)
        return Result("done", "same", (), {name: pd.DataFrame({"x": [0.5]})}, (), {"ours": "all"})

    module.run = item
    monkeypatch.setitem(sys.modules, "slow_item", module)
    monkeypatch.setattr(Inputs, "rig", None)
    monkeypatch.setattr(Item, "texts", {"article": "a", "differs": "b"}, raising=False)
    kept = dict(ITEMS)
    ITEMS.clear()
    for name in ("first", "second", "third"):
        register(Item(name, name, "slow_item:run", ("quick", "rig")))
    yield tmp_path
    ITEMS.clear()
    ITEMS.update(kept)


def shown(out):
    """What is not in the hidden folder, nor of the sweep's own keeping."""
    files = {name: data for name, data in content(out).items() if not name.startswith(WORK)}
    return {name: data for name, data in files.items() if name != "lock" and name not in INSIDE}


def apart(job, folder, out, moment=None):
    """The job in a process of its own, killed at a moment, s; how long it took."""
    process, since = FORK.Process(target=job, args=(folder, out)), time.monotonic()
    process.start()
    status = ended(process, PATIENCE if moment is None else moment)
    assert moment is not None or status == 0
    return time.monotonic() - since


@pytest.mark.slow
@pytest.mark.parametrize("job", [a_study, a_sweep, the_article])
def test_killed_at_random_moments(prepared, job):
    undisturbed, rng = prepared / "undisturbed", random.Random(20)
    longest = apart(job, prepared, undisturbed)
    expected = shown(undisturbed)
    tree = prepared / "tree"
    # A sweep wants a folder of its own.
    mine = (
        [*BESIDE, *(f"out/{name}" for name in INSIDE)]
        if job is not a_sweep
        else [*BESIDE, *(f"in/{n}" for n in INSIDE)]
    )
    assert len(mine) == 50
    for name in mine:
        (tree / name).parent.mkdir(parents=True, exist_ok=True)
        (tree / name).write_bytes(f"mine {name}".encode())
    before = {name: (tree / name).read_bytes() for name in mine}
    for kill in range(1, KILLS + 1):
        apart(job, prepared, tree / "out", rng.uniform(0, longest))
        assert {name: (tree / name).read_bytes() for name in mine} == before
        if kill % IN_A_ROW == 0:
            apart(job, prepared, tree / "out")
            assert {name: (tree / name).read_bytes() for name in mine} == before
            assert shown(tree / "out") == expected
            for name in expected:
                (tree / "out" / name).unlink()
            shutil.rmtree(tree / "out" / WORK, ignore_errors=True)
    hidden = ("._.DS_Store", ".ipynb_checkpoints", WORK)
    assert not [path for path in (tree / "out").rglob(".*") if path.name not in hidden]
