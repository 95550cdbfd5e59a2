"""Peak memory of a large batch whose responses are taken one after the other, and of one long run whole and in blocks.

Each case is measured in a process of its own.
"""

import re
import resource
import subprocess
import sys
from pathlib import Path

import clearance_mj as cm

from .case import BAND, FS, LAW, RIG, RMS, excitation

LIMIT = 2e9  # bytes for a thousand simulations
CASES = ((0, 10.0), (10, 10.0), (100, 10.0), (1000, 10.0), (100, 20.0), (100, 40.0))
RUNS = {"whole": (10, 40, 160, 600), "blocks": (10, 40, 160, 600, 3600)}  # s


def measure():
    """Return peak bytes against number and duration of the simulations; without any, of the program itself."""
    rows = [{"simulations": n, "seconds": s, "peak": _measured("batch", n, s)} for n, s in CASES]
    runs = [{"seconds": s, "way": way, "peak": _measured(way, 1, s)} for way, seconds in RUNS.items() for s in seconds]
    return {"rows": rows, "runs": runs, "limit": LIMIT, "sensors": len(RIG.sensors), "engine": "modal"}


def _measured(way, simulations, seconds) -> int:
    command = [sys.executable, "-m", "benchmarks.memory", way, str(simulations), str(seconds)]
    return int(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def _batch(simulations, seconds):
    """Simulate as many records and keep one number of each."""
    drive = excitation(seconds)
    laws = [cm.ConstantLaw(LAW.k * (1 + 1e-6 * i), LAW.c) for i in range(simulations)] or [LAW]
    drives = drive if simulations else excitation(0.1)
    for response in cm.simulate_each(RIG, drives, laws, "modal"):
        response.acceleration.max()


def _whole(_, seconds):
    """FRFs of one record that is in memory as a whole."""
    cm.estimate_frf(cm.simulate(RIG, excitation(seconds), LAW, "modal"))


def _blocks(_, seconds):
    """FRFs of one record of which only blocks are ever in memory."""
    drive = cm.excitation.random_blocks(seconds, FS, band=BAND, rms=RMS, seed=1)
    cm.estimate_frf_blocks(cm.simulate_blocks(RIG, drive, LAW, "modal"))


WAYS = {"batch": _batch, "whole": _whole, "blocks": _blocks}


def _peak() -> int:
    """Bytes of memory that this process has had at most."""
    status = Path("/proc/self/status")
    if status.exists():  # the figure of resource is no smaller than that of the process that started this one
        return 1024 * int(re.search(r"VmHWM:\s*(\d+) kB", status.read_text()).group(1))
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


if __name__ == "__main__":
    WAYS[sys.argv[1]](int(sys.argv[2]), float(sys.argv[3]))
    print(_peak())
