"""Who computes the cases: processes of this machine, or a Dask cluster. Both give results in the order they come."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from typing import Any

from .. import workshop
from ..errors import ClearanceError

__all__ = ["on_cluster", "on_processes"]

AHEAD = 2
"""cases that wait at each worker, so that none idles"""
MOST_LOSSES = 3
"""times that a case may lose its worker"""
PATIENCE = 10.0
"""s to wait for a scheduler's answer"""


def on_processes(function: Callable[[int], Any], cases: Iterable[int], workers: int) -> Iterator[tuple[int, Any]]:
    """Compute cases on processes of this machine; dead ones are replaced.

    Parameters
    ----------
    function : callable
        Takes the number of a case; can be pickled.
    cases : iterable of int
        The cases.
    workers : int
        Number of processes.

    Yields
    ------
    tuple
        A case and what the function returned.

    Raises
    ------
    ClearanceError
        If a case loses its worker again and again.
    """
    left, losses = deque(cases), Counter()
    while left:
        lost = []
        with _pool(workers) as pool:
            flying = _send(pool, function, left, {}, AHEAD * workers)
            while flying:
                for future in wait(flying, return_when=FIRST_COMPLETED).done:
                    case = flying.pop(future)
                    if isinstance(future.exception(), BrokenProcessPool):
                        lost.append(case)
                    else:
                        yield case, future.result()
                if not lost:
                    _send(pool, function, left, flying, AHEAD * workers)
        left.extendleft(lost)
        losses.update(lost)
        if fatal := [case for case, n in losses.items() if n == MOST_LOSSES]:
            raise ClearanceError(
                f"case {fatal[0]} lost its worker {MOST_LOSSES} times (out of memory?); try fewer workers"
            )


@contextlib.contextmanager
def _pool(workers):
    """A pool whose processes start afresh, not as copies of this one, its threads and locks."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # of the processes: there is one for each core
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), _begin)
    try:
        yield pool
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _send(pool, function, left, flying: dict[Future, int], most) -> dict[Future, int]:
    """Keep as many cases under way as are wanted."""
    while left and len(flying) < most:
        try:
            future = pool.submit(function, left[0])
        except BrokenProcessPool as error:
            future = Future()
            future.set_exception(error)
            most = 0
        flying[future] = left.popleft()
    return flying


def _begin():
    """In a worker: die of Ctrl-C without a word, and with the process that started it, however that ended."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    threading.Thread(target=_die_with, args=(multiprocessing.parent_process(),), daemon=True).start()


def _die_with(parent):
    parent.join()
    os._exit(1)


def on_cluster(function: Callable[[int], Any], cases: Iterable[int], scheduler: str) -> Iterator[tuple[int, Any]]:
    """Compute cases on a Dask cluster; its scheduler gives the cases of dead workers to others.

    Parameters
    ----------
    function : callable
        As for `on_processes`.
    cases : iterable of int
        The cases.
    scheduler : str
        Address of the scheduler, such as "tcp://10.0.0.1:8786".

    Yields
    ------
    tuple
        A case and what the function returned.

    Raises
    ------
    ClearanceError
        If Dask is not installed, no scheduler answers or it is lost, a worker runs other code, or a case kills workers.
    """
    try:
        from distributed import Client, KilledWorker, as_completed
        from distributed.client import FutureCancelledError
    except ImportError:
        raise ClearanceError('--scheduler needs Dask: pip install "clearance-mj[cluster]"') from None
    try:
        client = Client(scheduler, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise ClearanceError(f"--scheduler {scheduler}: no scheduler answers there ({error})") from None
    with client:
        submitted = client.map(partial(_with_same_code, workshop.code(), function), list(cases), pure=False, key="case")
        try:
            for _, result in as_completed(submitted, loop=client.loop, with_results=True):
                yield result
        except KilledWorker as error:
            raise ClearanceError(f"--scheduler {scheduler}: a case kills its workers ({error})") from None
        except (OSError, FutureCancelledError) as error:
            raise ClearanceError(
                f"--scheduler {scheduler}: lost ({error}); run the same command again to go on"
            ) from None


def _with_same_code(code, function, case) -> tuple[int, Any]:
    if workshop.code() != code:
        raise ClearanceError("a worker of the cluster runs another version of clearance_mj, or of its libraries")
    return case, function(case)
