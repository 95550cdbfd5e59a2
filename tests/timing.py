"""Where the seconds of a test run go: by file, fixture and compiled function; `pytest --timings=FILE` writes the table.

Times are those of all workers added up, so with two workers about twice the time on the clock.
"""

import json
import os
import time
from collections import defaultdict
from pathlib import Path

import pytest

LISTED = 10  # Rows of a table: the slowest decide how long a run takes; the sum of the others follows


class Timings:
    """Seconds of one process by kind ("folder", "file", "fixture", "kernel", "test") and name."""

    def __init__(self):
        self.seconds = defaultdict(lambda: defaultdict(float))
        self.compiling = 0.0

    def add(self, kind: str, name: str, seconds: float) -> None:
        self.seconds[kind][name] += seconds

    def take(self) -> dict:
        """Return what has been added since it was last taken."""
        taken, self.seconds = {kind: dict(names) for kind, names in self.seconds.items()}, Timings().seconds
        return taken


class Recorder:
    """Measures in each process, and writes the tables in the one that has no workers or rules over them."""

    def __init__(self, path: str | None):
        self.path, self.here, self.total = path, Timings(), Timings()
        self.start = time.time()
        self.fixtures: list[float] = []  # seconds of the fixtures that each running fixture has asked for
        self.listen()

    def listen(self) -> None:
        """Let numba tell when it compiles; what it loads from the cache is not told."""
        from numba.core import event

        record = self

        class Compilations(event.Listener):
            depth = 0

            def on_start(self, event):
                self.depth += 1
                if self.depth == 1:
                    self.began = time.perf_counter()

            def on_end(self, event):
                self.depth -= 1
                if self.depth == 0:
                    function = event.data["dispatcher"].py_func
                    name = f"{function.__module__}.{function.__qualname__}"
                    record.here.add("kernel", name, time.perf_counter() - self.began)

        event.register("numba:compile", Compilations())

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef, request):
        self.fixtures.append(0.0)
        began = time.perf_counter()
        try:
            return (yield)
        finally:
            whole = time.perf_counter() - began
            inner = self.fixtures.pop()
            if self.fixtures:
                self.fixtures[-1] += whole
            where = fixturedef.baseid.split("::")[0]
            self.here.add("fixture", f"{where}::{fixturedef.argname}", whole - inner)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item, call):
        report = yield
        file = item.nodeid.partition("::")[0]
        self.here.add("folder", "/".join(file.split("/")[:2]), call.duration)
        self.here.add("file", file, call.duration)
        self.here.add("test", item.nodeid.rpartition("@")[0] or item.nodeid, call.duration)
        if call.when == "teardown":
            report.user_properties = [*report.user_properties, ("timings", json.dumps(self.here.take()))]
        return report

    def pytest_runtest_logreport(self, report):
        if self.path is None:
            return
        for name, value in report.user_properties:
            if name == "timings" and report.when == "teardown":
                for kind, names in json.loads(value).items():
                    for key, seconds in names.items():
                        self.total.add(kind, key, seconds)

    def pytest_sessionfinish(self, session):
        if self.path is None:
            return
        path = Path(self.path)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(tables(self.total.seconds, time.time() - self.start), encoding="utf-8")


def tables(seconds: dict[str, dict[str, float]], clock: float) -> str:
    """Return the tables as Markdown."""
    compiled = sum(seconds["kernel"].values())
    lines = [
        f"Run on {time.strftime('%Y-%m-%d')}, {os.cpu_count()} cores: {clock:.0f} s elapsed, "
        f"{sum(seconds['file'].values()):.0f} s in tests and fixtures, of which {compiled:.0f} s compilation."
    ]
    for kind in ("test", "folder", "file", "fixture", "kernel"):
        rows = sorted(seconds[kind].items(), key=lambda row: -row[1])
        rest = sum(value for _, value in rows[LISTED:])
        lines += ["", f"| {kind} | s |", "|---|---:|"]
        lines += [f"| `{name}` | {value:.1f} |" for name, value in rows[:LISTED]]
        lines += [f"| {len(rows) - LISTED} others | {rest:.1f} |"] if len(rows) > LISTED else []
    return "\n".join(lines) + "\n"
