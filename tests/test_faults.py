"""Faults on purpose: full disks, kills, interrupts, NaN, files that carry code. Each in a process of its own.

A full disk is played by a limit on the size of files, which the system enforces where the file grows over it. Processes
are forked, so that nothing has to be imported or compiled again; what they patch is gone with them.
"""

import ast
import json
import pickle
import resource
import shutil
import signal
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io

import clearance_mj
from clearance_mj import report
from clearance_mj.clearance import ConstantLaw, nominal_law
from clearance_mj.cli import main
from clearance_mj.core.cache import ResultCache, load_arrays
from clearance_mj.core.errors import ClearanceError, RecordError, SimulationError
from clearance_mj.core.output_folder import WORK
from clearance_mj.core.runner import Runner
from clearance_mj.engines import get_engine
from clearance_mj.io import formats, results
from clearance_mj.report import report_study
from clearance_mj.rig import Rig
from clearance_mj.signals.frf import FRF
from clearance_mj.study import study as study_module
from clearance_mj.sweep import run_sweep

from .conftest import ROOT
from .processes import FORK, PATIENCE, Apart, calls, content, interrupt, kill, limit_files
from .sweep.plans import finished, loaded, small

# Studies.


def no_report(study, folder, progress):
    """One that costs nothing."""
    (folder / "report.html").write_text("-" * 100)


@pytest.fixture(scope="module")
def studies(small_dataset, tmp_path_factory):
    """Folder with a study of one engine, "out", and one of two, "undisturbed"; reports that cost nothing."""
    folder = tmp_path_factory.mktemp("studies")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report, "write_report", no_report)
        for name, engines in (("out", ["modal"]), ("undisturbed", ["modal", "links"])):
            report_study(small_dataset, folder / name, engines, ["nominal"], progress=False)
        yield folder


@pytest.fixture
def old(studies, small_dataset, tmp_path):
    """A finished study, and the command of another one into its folder, which has four cases more to simulate."""
    out = tmp_path / "out"
    shutil.copytree(studies / "out", out)
    (out / "figures").mkdir()
    (out / "figures" / "photo.png").write_text("not of a study")
    return out, shown(out), (
        "study", small_dataset, "--out", out, "--quiet", "--engines", "modal,links", "--methods", "nominal",
        "--workers", "1",
    )  # fmt: skip


def shown(out):
    """What is not in the hidden folder."""
    return {name: data for name, data in content(out).items() if not name.startswith(WORK)}


def goes_on(tmp_path, old, studies, left):
    """The same command again: it ends well, with the cases that are left and the results of an undisturbed study."""
    out, _, command = old
    counted = tmp_path / "counted"

    def count():
        simulate = study_module.simulate
        study_module.simulate = lambda *args: counted.open("a").write("x") and simulate(*args)

    assert Apart(tmp_path, *command, prepare=count).ends(0) == []
    assert (counted.stat().st_size if counted.exists() else 0) == left
    for name in ("summary.json", "results.nc"):
        assert (out / name).read_bytes() == (studies / "undisturbed" / name).read_bytes()
    assert (out / "figures" / "photo.png").read_text() == "not of a study"
    assert {p.name for p in tmp_path.iterdir()} - {"counted", "stderr.txt"} == {"out"}
    assert not [name for name in content(out) if Path(name).name.startswith(".")]


@pytest.mark.slow
@pytest.mark.parametrize(("size", "left"), [(4_000, 4), (100_000, 0)], ids=["while it simulates", "when it has"])
def test_full_disk_during_a_study(tmp_path, old, studies, size, left):
    """A case takes 62 kB, the results of eight about 700 kB."""
    out, before, command = old
    [line] = Apart(tmp_path, *command, prepare=limit_files(size)).ends(2)
    assert line.startswith(f"clearance-mj: {out}/.clearance-mj/") and "cannot be written (File too large)" in line
    assert shown(out) == before
    names = content(out / WORK)
    assert not [name for name in names if Path(name).name.startswith(".")], "nothing half-written"
    assert len([name for name in names if name.endswith(".nc")]) >= 4 * (left == 0)
    goes_on(tmp_path, old, studies, left)


def test_killed_study(tmp_path, old, studies):
    """Before its third case; then, in the next try, while it writes the file of a case."""
    out, before, command = old
    Apart(tmp_path, *command, prepare=calls(study_module, "simulate", 3, kill)).ends(-signal.SIGKILL)
    assert shown(out) == before
    Apart(tmp_path, *command, prepare=calls(Path, "replace", 1, kill)).ends(-signal.SIGKILL)
    assert shown(out) == before
    goes_on(tmp_path, old, studies, 2)


def test_damaged_results_of_a_study(tmp_path, old, studies):
    """Empty, half, garbage, one bit flipped: each is computed anew."""
    out, *_ = old
    kept = [path for path in sorted((out / WORK / "cache").iterdir()) if path.suffix != ".sha256"]
    damages = [lambda d: b"", lambda d: d[: len(d) // 2], lambda d: b"\1" * len(d), flipped]
    for i, path in enumerate(kept):
        path.write_bytes(damages[i % 4](path.read_bytes()))
    assert len(kept) >= 4
    goes_on(tmp_path, old, studies, 8)


def flipped(data):
    return data[:-100] + bytes([data[-100] ^ 1]) + data[-99:]


@pytest.mark.slow
def test_two_studies_at_once(tmp_path, old, studies):
    """The second is refused and named the first; a killed one holds nothing."""
    out, before, command = old
    begun = FORK.Event()

    def wait():
        begun.set()
        time.sleep(PATIENCE)

    first = Apart(tmp_path, *command, prepare=calls(study_module, "simulate", 1, wait))
    assert begun.wait(PATIENCE)
    (tmp_path / "second").mkdir()
    [line] = Apart(tmp_path / "second", *command).ends(2)
    assert line == f"clearance-mj: {out}: another study (process {first.process.pid}) is writing there"
    first.process.kill()
    first.ends(-signal.SIGKILL)
    (tmp_path / "second" / "stderr.txt").unlink()
    (tmp_path / "second").rmdir()
    assert shown(out) == before
    goes_on(tmp_path, old, studies, 4)


# Sweeps.


@pytest.mark.slow
@pytest.mark.parametrize(("size", "done"), [(3_000, 0), (10_000, 4)], ids=["of the cases", "of the results"])
def test_full_disk_during_a_sweep(tmp_path, size, done):
    """Each of 4 cases takes 4 kB, the results 13 kB with their labels."""
    plan = loaded(tmp_path, small(4))
    out = tmp_path / "out"
    command = ("sweep", tmp_path / "plan.toml", "--out", out, "--quiet", "--workers", "1")
    [line] = Apart(tmp_path, *command, prepare=limit_files(size)).ends(2)
    assert "cannot be written (File too large)" in line
    assert {p.name for p in out.iterdir()} == {"lock", "plan.json", "cases"}
    assert finished(out) == done and len([*(out / "cases").iterdir()]) == 2 * done, "nothing half-written"
    after = run_sweep(plan, out, Runner(1))
    assert after["error"].values.tolist() == [""] * 4


@pytest.mark.slow
def test_interrupted_sweep(tmp_path):
    plan = loaded(tmp_path, small(12))
    out = tmp_path / "out"
    command = ("sweep", tmp_path / "plan.toml", "--out", out, "--quiet", "--workers", "1")
    lines = Apart(tmp_path, *command, prepare=calls(ResultCache, "keep", 6, interrupt)).ends(1)
    assert lines == ["clearance-mj: interrupted; run the same command again to go on"]
    assert finished(out) == 5
    assert run_sweep(plan, out, Runner(1)).sizes["case"] == 12


# Exports.


def frf(n):
    value = np.random.default_rng(0).standard_normal((2, n)) * (1 + 1j)
    return FRF(np.arange(1.0, n + 1), value, None, ("6:+Z", "7:+Z"))


EXPORTS = (".uff", ".csv", ".mat", ".nc", ".h5")


@pytest.fixture(params=[EXPORTS[0], *(pytest.param(kind, marks=pytest.mark.slow) for kind in EXPORTS[1:])])
def export(request, tmp_path):
    """A short file that is there, and the command that replaces it by one of 300 kB and more."""
    source, out = tmp_path / "long.csv", tmp_path / f"out{request.param}"
    formats.write(source, frf(10_000))
    formats.write(out, frf(20))
    return out, out.read_bytes(), ("convert", source, out, "--json")


def test_full_disk_during_an_export(tmp_path, export):
    out, before, command = export
    [line] = Apart(tmp_path, *command, prepare=limit_files(100_000)).ends(2)
    assert line == f"clearance-mj: {out}: cannot be written (File too large)"
    assert out.read_bytes() == before
    assert {p.name for p in tmp_path.iterdir()} == {"long.csv", out.name, "stderr.txt"}


def test_killed_export(tmp_path, export):
    """At the worst moment, when all is written under the temporary name."""
    out, before, command = export
    Apart(tmp_path, *command, prepare=calls(Path, "replace", 1, kill)).ends(-signal.SIGKILL)
    assert out.read_bytes() == before
    [left] = {p.name for p in tmp_path.iterdir()} - {"long.csv", out.name, "stderr.txt"}
    assert left.startswith(f".{out.name}.")
    assert main([*map(str, command)]) == 0
    assert formats.read_frf(out).frequency.size == 10_000


def test_full_disk_under_rigs_and_laws(tmp_path):
    rig, law = Rig.load(ROOT / "models" / "table1_rig.toml"), ConstantLaw(1e4, 1.0)
    rig.save(tmp_path / "rig.toml")
    law.save(tmp_path / "law.json")
    before = content(tmp_path)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10, limits[1]))
    try:
        for thing, name in ((rig, "rig.toml"), (law, "law.json")):
            with pytest.raises(ClearanceError, match=rf"{name}: cannot be written \(File too large\)"):
                thing.save(tmp_path / name)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert content(tmp_path) == before


# Simulations.


@pytest.mark.parametrize("bushings", [2, pytest.param(0, marks=pytest.mark.slow)])
@pytest.mark.parametrize("engine", ["links", "modal"])
def test_a_simulation_stops_at_nan(rig, engine, bushings):
    """NaN in the drive at a known instant, deep in a block; the error says when, in simulated time, and where.

    It reaches the bushings within a millisecond; a rig without any may go on to the end of the block.
    """
    rig, engine = rig.replace(bushings=rig.bushings[:bushings]), get_engine(engine)
    law = nominal_law(rig)
    step = engine.largest_step(rig, law)
    drive = np.sin(np.arange(3000) / 50)
    begun = 2001
    drive[begun:] = np.nan
    run = engine.start(rig, law, "base", step)
    with pytest.raises(SimulationError, match=f"the {engine.name} simulation diverged at t = ") as caught:
        run.advance(drive)
    stopped = float(str(caught.value).split("t = ")[1].split()[0])
    latest = begun * step + 1e-3 if bushings else drive.size * step
    assert begun * step - 1e-6 <= stopped <= latest + 1e-6
    assert ("bushings[" if bushings else "at the tip") in str(caught.value)


# Files are data, nothing else.


class Bomb:
    """Whoever unpickles it leaves a mark."""

    def __init__(self, mark):
        self.mark = mark

    def __reduce__(self):
        return Path.touch, (self.mark,)


@pytest.mark.parametrize(
    "read",
    [*{f.name: f.read for f in formats.FORMATS.values()}.values(), load_arrays],
    ids=[*dict.fromkeys(f.name for f in formats.FORMATS.values()), "arrays that a cache keeps"],
)
@pytest.mark.parametrize("carrier", ["pickle", "npy", "npz"])
def test_no_reader_unpickles(tmp_path, read, carrier):
    mark, path = tmp_path / "mark", tmp_path / "file"
    bomb = np.array([Bomb(mark)], dtype=object)
    if carrier == "pickle":
        path.write_bytes(pickle.dumps(bomb))
    else:
        with path.open("wb") as file:
            (np.save if carrier == "npy" else np.savez)(file, bomb)
    with pytest.raises(ClearanceError):
        read(path)
    assert not mark.exists()
    if carrier == "npy":  # the mark works
        np.load(path, allow_pickle=True)
        assert mark.exists()


def test_objects_inside_files(tmp_path):
    """Cells and structures of MATLAB and references of HDF5 are passed over or refused; nothing of them is called."""
    nested = {"fs": 64.0, "base": np.arange(4.0), "s": {"f": np.array(["x", 1], dtype=object)}}
    scipy.io.savemat(tmp_path / "a.mat", nested)
    assert [c.label for c in formats.read(tmp_path / "a.mat")] == ["100:+Z"]
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.attrs["clearance_mj"] = "frf"
        file["value"] = np.zeros(1)
        file.create_dataset("r", data=np.array([file["value"].ref], dtype=h5py.ref_dtype))
    with pytest.raises(RecordError):
        results.load(tmp_path / "a.h5")


def test_the_package_imports_nothing_that_unpickles():
    refused = {"pickle", "dill", "shelve", "marshal", "joblib", "cloudpickle"}
    for path in Path(clearance_mj.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) and node.module else []
            assert not refused & {name.split(".")[0] for name in names}, path
            assert not (isinstance(node, ast.keyword) and node.arg == "allow_pickle"), path


def test_a_study_leaves_data_only(old):
    out, *_ = old
    assert {p.suffix for p in out.rglob("*") if p.is_file()} <= {
        ".html",
        ".json",
        ".nc",
        ".npz",
        ".png",
        ".csv",
        ".sha256",
        "",
    }
    assert {p.name for p in out.rglob("*") if p.is_file() and not p.suffix} == {"README", "lock"}
    json.loads((out / "summary.json").read_text())


# Models of MuJoCo are written, not read.


@pytest.mark.parametrize("damage", [lambda text: text, lambda text: text[: len(text) // 2], lambda text: "\0" + text])
def test_mjcf_in_place_of_a_rig(tmp_path, capsys, damage):
    """The rig is the one source of the models; MJCF, whole or damaged, is refused in one line."""
    text = (ROOT / "models" / "table1_rig_links.xml").read_text(encoding="utf-8")
    (tmp_path / "model.xml").write_text(damage(text), encoding="utf-8")
    assert main(["simulate", str(tmp_path / "model.xml"), "--out", str(tmp_path / "r.nc")]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"clearance-mj: {tmp_path / 'model.xml'}: not valid TOML: ")
    assert error.count("\n") == 1
