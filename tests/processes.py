"""Processes that end within a limit, and processes with faults on purpose: full disks, kills, interrupts.

Those of `Apart` are forked, so that nothing has to be imported or compiled again; what they patch is gone with them.
"""

import contextlib
import multiprocessing
import os
import resource
import signal
import subprocess
import sys
import time
import traceback
from pathlib import Path

from clearance_mj.cli import main

DEVNULL = subprocess.DEVNULL
FORK = multiprocessing.get_context("fork")
PATIENCE = 120  # Seconds that a process may take for what takes one on a quiet machine
LONGEST = 1200  # Seconds that any test may take; the longest takes 150 on a quiet machine


def heed_interrupts():
    """Let SIGINT interrupt this process and its children: a shell's background jobs inherit that it is ignored."""
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@contextlib.contextmanager
def limited(seconds):
    """Raise a TimeoutError in this thread, where it computes or waits, once so many seconds are over."""

    def late(*_):
        raise TimeoutError(f"a test may take {seconds} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def run(*command, patience=PATIENCE, **options) -> subprocess.CompletedProcess[str]:
    """Run Python with arguments, or another program by its full path, and return its status and what it wrote."""
    command = [*map(str, command)] if os.path.isabs(command[0]) else [sys.executable, *map(str, command)]
    options = {"capture_output": True, "encoding": "utf-8", "check": False} | options
    return subprocess.run(command, timeout=patience, **options)


@contextlib.contextmanager
def started(*arguments, out=DEVNULL, error=None, interrupts=signal.default_int_handler):
    """Start Python with arguments; yield the process, which ends with the block at the latest."""
    before = signal.signal(signal.SIGINT, interrupts)  # of which the process inherits that they are ignored
    process = subprocess.Popen([sys.executable, *map(str, arguments)], stdout=out, stderr=error, text=True)
    signal.signal(signal.SIGINT, before)
    try:
        yield process
    finally:
        process.kill()
        process.communicate(timeout=PATIENCE)


def wait_for(condition, patience=PATIENCE):
    """Wait until a function returns something true, and return that."""
    end = time.monotonic() + patience
    while not (outcome := condition()):
        assert time.monotonic() < end, "it took too long"
        time.sleep(0.02)
    return outcome


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
        ended(self.process)
        lines = self.errors.read_text().splitlines()
        assert self.process.exitcode == status, lines
        return lines


def ended(process, moment=PATIENCE) -> int:
    """Exit code of a forked process, which is killed at a moment, s, if it has not ended before."""
    process.join(moment)
    process.kill()
    process.join(PATIENCE)
    return process.exitcode


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
