"""The SLURM cluster of docs/sweeps.md as far as it goes without SLURM: dask-jobqueue writes the job script."""

import ast

import pytest

from ..conftest import ROOT


def documented() -> dict:
    """Arguments of the page's SLURMCluster."""
    page = (ROOT / "docs" / "sweeps.md").read_text(encoding="utf-8")
    (script,) = (block for block in page.split("```") if block.startswith("python\n") and "SLURMCluster(" in block)
    calls = [node for node in ast.walk(ast.parse(script.removeprefix("python\n"))) if isinstance(node, ast.Call)]
    (call,) = (call for call in calls if getattr(call.func, "id", "") == "SLURMCluster")
    return {keyword.arg: ast.literal_eval(keyword.value) for keyword in call.keywords}


def test_job_script_of_the_documented_cluster():
    jobqueue = pytest.importorskip("dask_jobqueue")
    with jobqueue.SLURMCluster(**documented(), scheduler_options={"dashboard_address": ":0"}) as cluster:
        script, address = cluster.job_script(), cluster.scheduler_address
    lines = script.splitlines()
    assert lines[0].startswith("#!")
    assert {"#SBATCH -p compute", "#SBATCH -n 1", "#SBATCH --cpus-per-task=16", "#SBATCH -t 04:00:00"} <= set(lines)
    (worker,) = (line for line in lines if "dask_worker" in line)
    assert address in worker and "--nworkers 16" in worker
    assert "--nthreads 1" in worker and lines.index("export OPENBLAS_NUM_THREADS=1") < lines.index(worker)
