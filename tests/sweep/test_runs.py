"""Sweeps on processes and on clusters that die: every result is there once and equal to an undisturbed run's."""

import json
import os
import signal
import sys
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from clearance_mj.core.cache import ResultCache
from clearance_mj.core.errors import ClearanceError
from clearance_mj.core.runner import Runner
from clearance_mj.core.tasks import run_tasks
from clearance_mj.sweep import run_sweep

from ..processes import DEVNULL, PATIENCE, run, started, wait_for
from .plans import finished, loaded, small


def sweep(folder):
    """Arguments of the command that runs a folder's plan."""
    plan, out = folder / "plan.toml", folder / "out"
    return "-m", "clearance_mj", "sweep", plan, "--out", out, "--workers", "2", "--json"


def workers(process) -> list[int]:
    pids = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    return [int(pid) for pid in pids if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]


def undisturbed(folder) -> dict:
    done = run(*sweep(folder), patience=5 * PATIENCE)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def running(pid) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def disturbed(plan, folder) -> xr.Dataset:
    """One worker is killed after a quarter of the cases, everything after a half; then the same command again."""
    n, out = len(plan.points), folder / "out"
    with started(*sweep(folder)) as first:
        wait_for(lambda: finished(out) >= n / 4)
        os.kill(workers(first)[0], signal.SIGKILL)
        wait_for(lambda: finished(out) >= n / 2)
        left = workers(first)
    assert finished(out) < n and not (out / "results.nc").exists()
    wait_for(lambda: not any(map(running, left)))
    assert finished(out) < n
    summary = undisturbed(folder)
    assert (summary["cases"], summary["without_results"]) == (n, {})
    kept = {"lock", "plan.json", "provenance.json", "results.nc", "results.nc.sha256"}
    assert {p.name for p in out.iterdir()} == kept | {"sweep.html", "sweep.png", "sweep_frf.png"}
    return xr.load_dataset(out / "results.nc", engine="scipy")


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
@pytest.mark.release
def test_two_thousand_cases_with_a_killed_worker_and_a_killed_run(tmp_path):
    for name in ("quiet", "disturbed"):
        (tmp_path / name).mkdir()
        plan = loaded(tmp_path / name, small(2000))
    undisturbed(tmp_path / "quiet")
    results = disturbed(plan, tmp_path / "disturbed")
    assert results.sizes["case"] == np.unique(results["case"]).size == 2000
    quiet = xr.load_dataset(tmp_path / "quiet" / "out" / "results.nc", engine="scipy")
    for each in (quiet, results):
        del each.attrs["provenance"]  # names the folder of the plan
    assert results.identical(quiet) and not np.isnan(results["frf"]).any()


def kill_own_worker(case):
    if case == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return -case


@pytest.mark.slow
def test_case_that_kills_its_worker_is_named():
    done = []
    with pytest.raises(ClearanceError, match="case 3 lost its worker 3 times"):
        done.extend(run_tasks(kill_own_worker, range(4), 1, processes=True))


def kill_worker_of_two(cases):
    if cases.start:
        time.sleep(1.0)  # the other part is done by then
        os.kill(os.getpid(), signal.SIGKILL)
    return {"case": np.array(cases)}


@pytest.mark.slow
def test_cases_that_are_computed_together_are_named_together():
    with pytest.raises(ClearanceError, match="case 2 to 3 lost its worker 3 times"):
        Runner(2).run("sweep", kill_worker_of_two, [range(2), range(2, 4)], str)


# Clusters.


@pytest.fixture
def small_plan(tmp_path):
    return loaded(tmp_path, small(12))


@pytest.mark.parametrize("kind", [ThreadPoolExecutor, ProcessPoolExecutor])
def test_any_executor(small_plan, tmp_path, kind):
    """Results are those of processes of its own, and the executor is left open."""
    alone = run_sweep(small_plan, tmp_path / "alone", Runner(1))
    with kind(2) as executor:
        swept = run_sweep(small_plan, tmp_path / "out", Runner(executor=executor))
        assert executor.submit(int, "3").result() == 3
    xr.testing.assert_identical(swept, alone)
    with pytest.raises(ClearanceError, match="give a scheduler or an executor, not both"):
        run_sweep(small_plan, tmp_path / "both", Runner(scheduler="tcp://127.0.0.1:1", executor=executor))


def test_local_cluster(small_plan, tmp_path):
    distributed = pytest.importorskip("distributed")
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": False, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster:
        results = run_sweep(small_plan, tmp_path / "out", Runner(scheduler=cluster.scheduler_address))
    same_as_computed_here(results, small_plan)


def dask(*arguments):
    return started("-m", "dask", *arguments, error=DEVNULL)


@pytest.mark.slow
def test_two_workers_over_tcp_of_which_one_is_killed(tmp_path):
    distributed = pytest.importorskip("distributed")
    plan, file = loaded(tmp_path, small(60)), str(tmp_path / "scheduler.json")
    scheduler = ("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", file)
    worker = ("worker", "--scheduler-file", file, "--nthreads", "1", "--no-nanny", "--no-dashboard")
    worker += ("--local-directory", tmp_path)
    with dask(*scheduler):
        wait_for(lambda: Path(file).exists() and Path(file).stat().st_size)
        address = json.loads(Path(file).read_text())["address"]
        assert address.startswith("tcp://127.0.0.1:")
        with dask(*worker), dask(*worker) as second:
            with distributed.Client(address, set_as_default=False) as client:
                client.wait_for_workers(2, timeout=PATIENCE)
            killed = []
            results = run_sweep_and(lambda: killed or killed.append(second.kill()), plan, tmp_path / "out", address)
    assert killed
    same_as_computed_here(results, plan)


def run_sweep_and(do, plan, out, scheduler):
    """Run a sweep, and do something after each case that is stored."""
    keep = ResultCache.keep

    def kept(*arguments):
        keep(*arguments)
        do()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ResultCache, "keep", kept)
        return run_sweep(plan, out, Runner(scheduler=scheduler))


def test_scheduler_that_does_not_answer(small_plan, tmp_path, refused, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("clearance_mj.core.tasks.PATIENCE", 0.5)
    command = "sweep", tmp_path / "plan.toml", "--out", tmp_path / "out", "--quiet", "--scheduler"
    for address in ("tcp://127.0.0.1:9", "nonsense://x"):
        assert f"--scheduler {address}: no scheduler answers there" in refused(*command, address)


def test_dask_is_not_installed(small_plan, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ClearanceError, match=r"needs Dask: pip install .clearance-mj\[cluster\]"):
        run_sweep(small_plan, tmp_path / "out", Runner(scheduler="tcp://127.0.0.1:9"))
