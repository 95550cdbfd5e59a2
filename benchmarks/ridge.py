"""Time and peak memory of wavelet ridges: eight channels of 48 s at 2048 Hz, in a process of its own."""

import json
import resource
import subprocess
import sys
import time

from clearance_mj.identify import ridge
from clearance_mj.signals.excitation import random

CHANNELS, DURATION, FS = 8, 48.0, 2048.0
LIMITS = {"seconds": 10.0, "peak": 1e9}


def measure():
    """Return seconds and peak bytes, and what they should stay below."""
    command = [sys.executable, "-m", "benchmarks.ridge"]
    result = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    return {"channels": CHANNELS, "duration": DURATION, "fs": FS, **result, "limits": LIMITS}


def _ridges():
    channels = [random(DURATION, FS, band=(60, 66), seed=seed).value for seed in range(CHANNELS)]
    start = time.perf_counter()
    for channel in channels:
        ridge(channel, FS, (20, 200))
    seconds = time.perf_counter() - start
    unit = 1 if sys.platform == "darwin" else 1024
    return {"seconds": seconds, "peak": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit}


if __name__ == "__main__":
    print(json.dumps(_ridges()))
