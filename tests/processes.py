"""Processes with faults on purpose: full disks, kills, interrupts.

They are forked, so that nothing has to be imported or compiled again; what they patch is gone with them.
"""

import multiprocessing
import os
import resource
import signal
import sys
import time
import traceback
from pathlib import Path

from clearance_mj.cli import main

FORK = multiprocessing.get_context("fork")
PATIENCE = 120
"""s, for what takes one on a quiet machine"""


class Apart:
    """``clearance-mj ARGUMENTS`` in a process of its own, once ``prepare`` has been called there."""

    def __init__(self, folder, *arguments, prepare=lambda: None):
        self.errors = Path(folder) / "stderr.txt"
        self.process = FORK.Process(target=self._run, args=([*map(str, arguments)], prepare))
        self.process.start()

    def _run(self, arguments, prepare):
        with self.errors.open("w", buffering=1) as file, open(os.devnull, "w") as sys.stdout:
            os.dup2(file.fileno(), 2)
            sys.stderr = file
            try:
                prepare()
                status = main(arguments)
            except BaseException:
                traceback.print_exc()
                status = 70
        os._exit(status)

    def ends(self, status) -> list[str]:
        """Wait; the lines of its errors."""
        self.process.join(PATIENCE)
        lines = self.errors.read_text().splitlines()
        assert self.process.exitcode == status, lines
        return lines


def limit_files(size):
    """No file may grow over a size, as on a disk that is full then."""
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


def calls(module, name, number, fault):
    """Patch a function so that a fault happens in its n-th call, before it does anything."""

    def prepare():
        function, count = getattr(module, name), iter(range(1, 10**6))

        def patched(*args, **kwargs):
            if next(count) == number:
                fault()
            return function(*args, **kwargs)

        setattr(module, name, patched)

    return prepare


def kill():
    os.kill(os.getpid(), signal.SIGKILL)


def interrupt():
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(1.0)  # the main thread hears of it meanwhile


def content(folder) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(Path(folder).rglob("*")) if p.is_file()}
