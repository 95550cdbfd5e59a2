"""What several test folders share."""

import inspect
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from clearance_mj.clearance import ConstantLaw
from clearance_mj.cli import main
from clearance_mj.engines import simulate
from clearance_mj.io.dataset import BASE_NODE, Record, write_dataset
from clearance_mj.io.uff import Channel
from clearance_mj.rig import Grease, Rig
from clearance_mj.signals.excitation import level_ramp, random

from . import timing
from .processes import LONGEST, heed_interrupts, limited
from .store import kept
from .verification.page import Measured, Row, cases, page

ROOT = Path(__file__).parent.parent
SMALL_LAW = ConstantLaw(6e3, 12.0, grease=Grease(stiffness=4000.0, damping=5.0))
"""What the small dataset below was simulated with"""


TABLE1 = Rig.load(ROOT / "models" / "table1_rig.toml")


def pytest_make_parametrize_id(val: object) -> str | None:
    """Name the content of a file by its length: a header may hold the time, and workers must collect the same names."""
    if isinstance(val, bytes):
        return f"{len(val)} bytes"
    return f"{len(val)} characters" if isinstance(val, str) and len(val) > 150 else None


@pytest.fixture(scope="session")
def rig() -> Rig:
    return TABLE1


@pytest.fixture(params=["links", "modal"])
def engine(request) -> str:
    return request.param


def record_of(rig, name, role, level, seed, duration=6.0, start=None) -> Record:
    """A record that is not measured but simulated by the modal engine, without noise; a ramp if ``start`` is given."""
    excitation = random(duration, 2048.0, band=(5, 220), rms=level, seed=seed)
    if start is not None:
        excitation = level_ramp(duration, 2048.0, band=(5, 220), start_rms=start, end_rms=level, seed=seed)
    response = simulate(rig, excitation, SMALL_LAW, "modal")
    columns = [("base", BASE_NODE, "acceleration", response.excitation)]
    columns += [
        (f"acc {s.node}", s.node, "acceleration", a) for s, a in zip(rig.sensors, response.acceleration, strict=True)
    ]
    columns += [("probe 6", 6, "displacement", response.displacement[0])]
    columns += [("probe 7", 7, "displacement", response.displacement[1])]
    channels = [Channel(label, node, "+Z", quantity, value, 2048.0) for label, node, quantity, value in columns]
    provenance = {"origin": "synthetic: modal engine"}
    return Record(name, role, rig, 2048.0, channels, "base", "random", level, seed, (5.0, 220.0), provenance)


@pytest.fixture(scope="session")
def small_dataset(rig, tmp_path_factory) -> Iterator[Path]:
    """A dataset folder: one record to identify, two levels with two seeds to validate. Copy it to write into it."""
    levels = [(f"level_{v}_{s}", "validate", v, 10 * v + s) for v in (1, 4) for s in (1, 2)]

    def make(folder):
        records = [record_of(rig, "ramp", "identify", 6.0, 1, 20.0, start=0.3)]
        write_dataset(folder, rig, records + [record_of(rig, *given) for given in levels])

    made_from = [rig.to_dict(), SMALL_LAW.to_dict(), levels, Path(__file__).read_text(encoding="utf-8")]
    with kept(tmp_path_factory, "small", made_from, make) as folder:
        yield folder


@pytest.fixture(scope="session", autouse=True)
def no_sines():
    """Studies of tests leave out periodic vibrations, which take half a minute: tests/report/test_sines.py has them."""
    from clearance_mj.study.periodic import PeriodicVibrations

    with pytest.MonkeyPatch.context() as patch:
        left_out = lambda name, *_: PeriodicVibrations(name, (), None, "tests leave them out")  # noqa: E731
        patch.setattr("clearance_mj.study.study.periodic_vibrations", left_out)
        yield


def dense(band: np.ndarray) -> np.ndarray:
    """(n, n) full symmetric matrix of (4, n) lower bands."""
    n = band.shape[1]
    full = np.zeros((n, n))
    for k, diagonal in enumerate(band):
        rows = np.arange(n - k)
        full[rows + k, rows] = full[rows, rows + k] = diagonal[: n - k]
    return full


@pytest.fixture
def answer(capsys):
    """Run the command line, expect success, and return its JSON."""

    def run(*arguments):
        assert main([*map(str, arguments), "--json"]) == 0
        return json.loads(capsys.readouterr().out)

    return run


@pytest.fixture
def refused(capsys):
    """Run the command line, expect status 2 and one line on standard error alone, and return it."""

    def run(*arguments):
        assert main([*map(str, arguments)]) == 2
        captured = capsys.readouterr()
        assert captured.out == "" and captured.err.count("\n") == 1
        return captured.err

    return run


@pytest.fixture
def rng():
    return np.random.default_rng(20261120)


LONGEST_FILES = ("test_docs", "test_production", "test_study", "test_items", "test_report", "test_fuzz")
ROWS = pytest.StashKey[dict[str, list[Row]]]()


def pytest_addoption(parser):
    parser.addoption(
        "--verification", metavar="FILE", help="run the tests that measure; write a page, and every case as CSV"
    )
    parser.addoption("--timings", metavar="FILE", help="write a page of where the seconds go")


def pytest_configure(config):
    config.stash[ROWS] = {}
    heed_interrupts()
    if path := config.getoption("timings"):
        config.pluginmanager.register(timing.Recorder(None if hasattr(config, "workerinput") else path))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup():
    with limited(LONGEST):
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call():
    with limited(LONGEST):
        return (yield)


@pytest.hookimpl(tryfirst=True)  # before xdist, which reads the groups
def pytest_collection_modifyitems(config, items):
    """Keep together what shares something: quick tests by file, others by the fixtures of their module."""
    for item in items:
        item.add_marker(pytest.mark.xdist_group(group_of(item)))
    # What takes long goes first, or the last of it would keep one worker busy while the others wait.
    items.sort(key=lambda item: not item.path.name.startswith(LONGEST_FILES))
    if not config.getoption("verification"):
        return
    items[:] = [item for item in items if "measured" in item.fixturenames]
    for item in items:
        config.stash[ROWS].setdefault(subject(item.module), [])


def group_of(item) -> str:
    file = item.nodeid.partition("::")[0]
    if not (item.get_closest_marker("slow") or item.get_closest_marker("release")):
        return file
    known = item._fixtureinfo.name2fixturedefs
    shared = sorted(name for name, made in known.items() if made[-1].scope == "module")
    return "::".join((file, *shared)) if shared else item.nodeid


def pytest_sessionfinish(session, exitstatus):
    path = session.config.getoption("verification")
    if path and exitstatus == pytest.ExitCode.OK:
        path, rows = Path(path), session.config.stash[ROWS]
        file = path.with_suffix(".csv")
        before = file.read_text(encoding="utf-8") if file.is_file() else ""
        file.write_text(cases(rows, before), encoding="utf-8")
        path.write_text(page(rows, file.name), encoding="utf-8")


def subject(module) -> str:
    """Subject of a module's rows: the first sentence of its docstring."""
    return inspect.getdoc(module).partition("\n\n")[0].partition(". ")[0].rstrip(".").replace("\n", " ")


@pytest.fixture
def measured(request) -> Measured:
    return Measured(request.config.stash[ROWS].setdefault(subject(request.module), []))
