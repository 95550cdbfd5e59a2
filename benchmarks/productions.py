"""Productions: time and memory of a thousand designs, how both grow with designs, and what workers save.

Designs of the Table-1 rig scatter as ``models/scatter/table1.toml`` says, 50 levels and 400 frequencies of a base
excitation. Ten thousand are looked at beside fewer at 10 of the frequencies. Memory is that of this process and all
workers, what they share counted once, as the kernel of Linux tells it four times a second.
"""

import multiprocessing
import threading
import time
from pathlib import Path

import numpy as np

import clearance_mj as cm
from clearance_mj.periodic import map_rattle
from clearance_mj.tolerance import Runner, Scatter, Sines, production

from .case import row

MODEL = cm.Model(cm.Rig.load("models/table1_rig.toml"))
SCATTER, LIMIT = Scatter.load("models/scatter/table1.toml"), "contact_force > 3 N"
LEVELS, FREQUENCIES = np.linspace(0.2, 10.0, 50), np.linspace(5.0, 220.0, 400)
FEW = FREQUENCIES[::40]
MAPS, BESIDE = 3, 64  # designs whose rattle maps are made, and that are looked at by one worker and by all


def measure():
    """Return rows as of `periodic`."""
    _seconds(4, FREQUENCIES)  # compiles
    rows = []
    for n in (100, 1000, 10_000):
        seconds, peak = _seconds(n, FEW)
        rows.append(row(f"{n} designs, 50 levels, 10 frequencies", [seconds], "s", ""))
    rows.append(row("10000 designs, memory of all processes", [peak / 1e9], "GB", "<= 1"))
    alone, _ = _seconds(BESIDE, FREQUENCIES, workers=1)
    together, _ = _seconds(BESIDE, FREQUENCIES)
    rows.append(row(f"{BESIDE} designs, 50 levels, 400 frequencies, one worker", [alone], "s", ""))
    rows.append(row(f"{BESIDE} designs, 50 levels, 400 frequencies, one worker / all", [alone / together], "x", ""))
    designs = SCATTER.draw(MODEL, MAPS)
    ratios = [_map(designs.model(i)) / (alone / BESIDE) for i in range(MAPS)]
    rows.append(row("rattle map of a design / a design by branches over the level, one worker", ratios, "x", ""))
    seconds, peak = _seconds(1000, FREQUENCIES)
    rows.append(row("1000 designs, 50 levels, 400 frequencies", [seconds], "s", "<= 600"))
    rows.append(row("1000 designs, memory of all processes", [peak / 1e9], "GB", "<= 1"))
    return {"rows": rows, "skipped": {}}


def _seconds(n, frequencies, workers=None):
    """Seconds and bytes of a production."""
    most, done = [0.0], threading.Event()
    watch = threading.Thread(target=_watch, args=(most, done))
    watch.start()
    begun = time.perf_counter()
    try:
        production(MODEL, SCATTER, Sines(LEVELS, frequencies, LIMIT), n, runner=Runner(workers))
    finally:
        done.set()
        watch.join()
    return time.perf_counter() - begun, most[0]


def _watch(most, done):
    while not done.wait(0.25):
        pids = ["self", *(str(process.pid) for process in multiprocessing.active_children())]
        most[0] = max(most[0], sum(_proportional(pid) for pid in pids))


def _proportional(pid):
    """Bytes of a process, of what it shares its part."""
    try:
        text = Path(f"/proc/{pid}/smaps_rollup").read_text()
    except OSError:  # it has just ended, or this is no Linux
        return 0
    return 1024 * next(int(line.split()[1]) for line in text.splitlines() if line.startswith("Pss:"))


def _map(model):
    begun = time.perf_counter()
    map_rattle(model, LEVELS, FREQUENCIES, workers=1)
    return time.perf_counter() - begun
