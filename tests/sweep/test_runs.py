"""Sweeps on processes and on clusters that die: every result is there once and equal to an undisturbed run's."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from clearance_mj.cli import main
from clearance_mj.core.errors import ClearanceError
from clearance_mj.core.tasks import run_tasks
from clearance_mj.sweep import run_sweep
from clearance_mj.sweep.store import Table

from .plans import loaded, small

PATIENCE = 120
"""s, for what takes two on a quiet machine"""


def wait_for(condition):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "it took too long"
        time.sleep(0.02)


class Run:
    """``clearance-mj sweep`` as a process of its own."""

    def __init__(self, plan, folder):
        self.plan, self.out = plan, folder / "out"
        command = [sys.executable, "-m", "clearance_mj", "sweep", str(folder / "plan.toml"), "--out", str(self.out)]
        self.process = subprocess.Popen(
            [*command, "--workers", "2", "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )

    def finished(self) -> int:
        path = self.out / "cases.npy"
        return int(Table(path, self.plan.shapes, len(self.plan.points)).finished().sum()) if path.exists() else 0

    def workers(self) -> list[int]:
        pids = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        return [int(pid) for pid in pids if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]

    def wait(self):
        out, error = self.process.communicate(timeout=30 * PATIENCE)
        assert self.process.returncode == 0, error.decode()
        return json.loads(out)


def running(pid) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def disturbed(plan, folder) -> xr.Dataset:
    """One worker is killed after a quarter of the cases, everything after a half; then the same command again."""
    n = len(plan.points)
    first = Run(plan, folder)
    wait_for(lambda: first.finished() >= n / 4)
    os.kill(first.workers()[0], signal.SIGKILL)
    wait_for(lambda: first.finished() >= n / 2)
    workers = first.workers()
    first.process.kill()
    first.process.communicate()
    assert first.finished() < n
    assert not (first.out / "results.nc").exists()
    wait_for(lambda: not any(map(running, workers)))
    left = n - first.finished()
    second = Run(plan, folder)
    summary = second.wait()
    assert (summary["cases"], summary["without_results"]) == (n, {})
    assert left > 0
    figures = {"sweep.html", "sweep.png", "sweep_frf.png"}
    assert {p.name for p in second.out.iterdir()} == {"lock", "plan.json", "results.nc", "results.nc.sha256"} | figures
    return xr.load_dataset(second.out / "results.nc", engine="scipy")


def same_as_computed_here(results, plan):
    """Every case is there once, with what it gives in this process."""
    assert results["case"].values.tolist() == list(range(len(plan.points)))
    np.testing.assert_array_equal(results["parameter"], plan.points)
    for case in range(len(plan.points)):
        for name, value in plan.evaluate(case).items():
            np.testing.assert_array_equal(results[name].values[case], value, err_msg=f"{name} of case {case}")


needs_proc = pytest.mark.skipif(not Path("/proc").exists(), reason="finds the workers through /proc")


@pytest.mark.slow
@needs_proc
def test_killed_worker_and_killed_run(tmp_path):
    plan = loaded(tmp_path, small(24))
    same_as_computed_here(disturbed(plan, tmp_path), plan)


@needs_proc
@pytest.mark.slow
def test_two_thousand_cases_with_a_killed_worker_and_a_killed_run(tmp_path):
    for name in ("quiet", "disturbed"):
        (tmp_path / name).mkdir()
        plan = loaded(tmp_path / name, small(2000))
    quiet = Run(plan, tmp_path / "quiet")
    quiet.wait()
    results = disturbed(plan, tmp_path / "disturbed")
    assert results.sizes["case"] == np.unique(results["case"]).size == 2000
    assert results.identical(xr.load_dataset(quiet.out / "results.nc", engine="scipy"))
    assert not np.isnan(results["frf"]).any()


def kill_own_worker(case):
    if case == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return -case


@pytest.mark.slow
def test_case_that_kills_its_worker_is_named():
    done = []
    with pytest.raises(ClearanceError, match="case 3 lost its worker 3 times"):
        done.extend(run_tasks(kill_own_worker, range(4), 1, processes=True))


# Clusters.


@pytest.fixture
def small_plan(tmp_path):
    return loaded(tmp_path, small(12))


def test_local_cluster(small_plan, tmp_path):
    distributed = pytest.importorskip("distributed")
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": False, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster:
        results = run_sweep(small_plan, tmp_path / "out", scheduler=cluster.scheduler_address, progress=False)
    same_as_computed_here(results, small_plan)


def dask(*arguments):
    return subprocess.Popen([sys.executable, "-m", "dask", *arguments], stderr=subprocess.DEVNULL)


@pytest.mark.slow
def test_two_workers_over_tcp_of_which_one_is_killed(tmp_path):
    distributed = pytest.importorskip("distributed")
    plan, file = loaded(tmp_path, small(60)), str(tmp_path / "scheduler.json")
    started = [dask("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", file)]
    worker = ("worker", "--scheduler-file", file, "--nthreads", "1", "--no-nanny", "--no-dashboard")
    try:
        wait_for(lambda: Path(file).exists() and Path(file).stat().st_size)
        started += [dask(*worker, "--local-directory", str(tmp_path)) for _ in range(2)]
        address = json.loads(Path(file).read_text())["address"]
        assert address.startswith("tcp://127.0.0.1:")
        with distributed.Client(address, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=PATIENCE)
        finished = []
        results = run_sweep_and(lambda: finished or finished.append(started[2].kill()), plan, tmp_path / "out", address)
    finally:
        for process in reversed(started):
            process.kill()
            process.wait()
    assert finished
    same_as_computed_here(results, plan)


def run_sweep_and(do, plan, out, scheduler):
    """Run a sweep, and do something after each case that is stored."""
    write = Table.write

    def written(table, case, values):
        write(table, case, values)
        do()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Table, "write", written)
        return run_sweep(plan, out, scheduler=scheduler, progress=False)


def test_scheduler_that_does_not_answer(small_plan, tmp_path, capsys, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("clearance_mj.core.tasks.PATIENCE", 0.5)
    command = ["sweep", str(tmp_path / "plan.toml"), "--out", str(tmp_path / "out"), "--quiet", "--scheduler"]
    for address in ("tcp://127.0.0.1:9", "nonsense://x"):
        assert main([*command, address]) == 2
        error = capsys.readouterr().err
        assert error.count("\n") == 1
        assert f"--scheduler {address}: no scheduler answers there" in error


def test_dask_is_not_installed(small_plan, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ClearanceError, match=r"needs Dask: pip install .clearance-mj\[cluster\]"):
        run_sweep(small_plan, tmp_path / "out", scheduler="tcp://127.0.0.1:9", progress=False)
