"""Peak memory of a large batch whose responses are taken one after the other: each case in a process of its own."""

import resource
import subprocess
import sys

import clearance_mj as cm

from .case import LAW, RIG, excitation

LIMIT = 2e9
"""bytes for a thousand simulations"""
CASES = ((0, 10.0), (10, 10.0), (100, 10.0), (1000, 10.0), (100, 20.0), (100, 40.0))


def measure():
    """Return peak bytes against number and duration of the simulations; without any, of the program itself."""
    rows = []
    for simulations, seconds in CASES:
        command = [sys.executable, "-m", "benchmarks.memory", str(simulations), str(seconds)]
        peak = int(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
        rows.append({"simulations": simulations, "seconds": seconds, "peak": peak})
    return {"rows": rows, "limit": LIMIT, "sensors": len(RIG.sensors), "engine": "modal"}


def _peak(simulations, seconds) -> int:
    """Simulate as many records and keep one number of each; bytes (Linux counts in KiB, macOS in bytes)."""
    drive = excitation(seconds)
    laws = [cm.ConstantLaw(LAW.k * (1 + 1e-6 * i), LAW.c) for i in range(simulations)] or [LAW]
    drives = drive if simulations else excitation(0.1)
    for response in cm.simulate_each(RIG, drives, laws, "modal"):
        response.acceleration.max()
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


if __name__ == "__main__":
    print(_peak(int(sys.argv[1]), float(sys.argv[2])))
