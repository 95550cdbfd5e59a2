"""Periodic responses: points per second, alone and beside pyHarm on the same oscillator, and the time of a rattle map.

pyHarm (PyPI pyharm-os) needs another pandas than this package, so it runs in an environment of its own, whose
interpreter the variable PYHARM_PYTHON names. Both find the same stretch of one curve with as many harmonics and
samples, to 1e-9, on one core, without stability; each counts the points that it accepts at steps of its own.
Points per second are of the processor's time, which other work on the machine disturbs least.
"""

import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

import clearance_mj as cm
from experiments.periodic.responses import one_sided

from .case import row

RIG, LAW, LEVEL = cm.Rig.load("models/table1_rig.toml"), cm.ConstantLaw(7.8e3, 4.0), 6.0
STOP, FORCE, HARMONICS, SAMPLES = cm.ConstantLaw(100.0, 0.0), 0.1, 21, 1024
LOW, HIGH = 0.5, 0.8  # rad/s
LONGEST = 0.05  # pyHarm's longest step: the curve's peak needs it
ROUNDS = 5


def measure():
    """Return rows as of `speed`, and both curves' peaks."""
    rows, peaks = [], {}
    for stability, target in ((False, ">= 500"), (True, ">= 200")):
        rates = [_table1(stability) for _ in range(ROUNDS + 1)][1:]  # the first one compiles
        rows.append(row(f"table-1 rig, {'with' if stability else 'without'} stability", rates, "points/s", target))
    pairs = [(_own(), _pyharm()) for _ in range(ROUNDS + 1)][1:] if _interpreter() else []
    if pairs:
        for name, runs in zip(("clearance_mj", "pyHarm"), zip(*pairs)):
            rates = [run["omega"].size / run["seconds"] for run in runs]
            rows.append(row(f"one-sided spring, {name}", rates, "points/s", ""))
            top = runs[0]["amplitude"].argmax()
            peaks[name] = {"omega": runs[0]["omega"][top], "amplitude": runs[0]["amplitude"][top]}
        ratios = [_rate(ours) / _rate(other) for ours, other in pairs]
        rows.append(row("one-sided spring, clearance_mj / pyHarm", ratios, "x", ">= 10"))
        peaks["largest difference of amplitudes"] = _apart(*pairs[0])
    rows.append(row("rattle map, 50 levels, 400 frequencies, 3 gaps", [_map()], "s", "<= 60"))
    skipped = {} if pairs else {"pyHarm": "PYHARM_PYTHON names no interpreter that has it; make bench makes one"}
    return {"rows": rows, "peaks": peaks, "skipped": skipped}


def _rate(run):
    return run["omega"].size / run["seconds"]


def _table1(stability):
    begun, points = time.process_time(), 0
    for ends in ((30.0, 220.0), (220.0, 5.0)):
        points += cm.periodic.follow_response(
            cm.Model(RIG, LAW), LEVEL, ends, HARMONICS, 256, stability=stability
        ).frequency.size
    return points / (time.process_time() - begun)


def _own():
    begun, ends = time.process_time(), (HIGH / (2 * np.pi), LOW / (2 * np.pi))
    branch = cm.periodic.follow_response(cm.Model(one_sided(), STOP), FORCE, ends, HARMONICS, SAMPLES, stability=False)
    seconds = time.process_time() - begun
    amplitude = np.abs(branch.displacement[:, 1, 1])
    return {"seconds": seconds, "omega": 2 * np.pi * branch.frequency, "amplitude": amplitude}


def _interpreter():
    path = os.environ.get("PYHARM_PYTHON", "")
    return Path(path).absolute() if path and Path(path).is_file() else None


def _pyharm():
    case = {"harmonics": HARMONICS, "samples": SAMPLES, "low": LOW, "high": HIGH, "force": FORCE, "longest": LONGEST}
    script = Path(__file__).resolve().with_name("pyharm_oscillator.py")
    one = {
        "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1",
        "OPENBLAS_NUM_THREADS": "1",
    }
    with tempfile.TemporaryDirectory() as folder:  # where pyHarm leaves its settings
        run = subprocess.run(
            [_interpreter(), "-W", "ignore", script, json.dumps(case)],
            capture_output=True, text=True, check=True, env=os.environ | one, cwd=folder,
        )  # fmt: skip
    answer = json.loads(run.stdout.splitlines()[-1])
    return {name: np.array(value) for name, value in answer.items()}


def _apart(ours, other):
    """Largest relative distance in amplitude of pyHarm's points from the curve through ours, which may be steep."""
    scale = np.array([HIGH - LOW, ours["amplitude"].max()])
    corners = np.column_stack((ours["omega"], ours["amplitude"])) / scale
    way = np.cumsum(np.append(0.0, np.linalg.norm(np.diff(corners, axis=0), axis=1)))
    fine = CubicSpline(way, corners)(np.linspace(0, way[-1], 100_000))
    inside = (other["omega"] >= LOW) & (other["omega"] <= HIGH)
    points = np.column_stack((other["omega"], other["amplitude"]))[inside] / scale
    nearest = [np.sqrt(np.min(np.sum((fine - point) ** 2, axis=1))) for point in points]
    return float(np.max(np.array(nearest) / points[:, 1]))


def _map():
    levels, frequencies = np.linspace(0.2, 10.0, 50), np.linspace(20.0, 60.0, 400)
    gaps = list(RIG.bushings[0].gap * np.array([0.5, 1.0, 1.5]))
    begun = time.perf_counter()
    cm.periodic.map_rattle(cm.Model(RIG, LAW), levels, frequencies, gaps=gaps, workers=2)
    return time.perf_counter() - begun
