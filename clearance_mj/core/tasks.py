"""Run many tasks of one function: on threads, on processes, on a Dask cluster, or on an executor that is given."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, as_completed, wait
from concurrent.futures.process import BrokenProcessPool, ProcessPoolExecutor
from functools import partial
from multiprocessing.process import BaseProcess
from typing import TypeVar

from tqdm import tqdm

from .cache import code
from .errors import ClearanceError

__all__ = ["print_duration", "run_tasks", "workers_to_use"]

Task = TypeVar("Task")
Result = TypeVar("Result")
Results = Generator[tuple[Task, Result], None, None]
QUEUED = 1000  # tasks that an executor, whose number of workers is not known, has at once
QUEUED_PER_WORKER = 2  # tasks that wait at each worker, so that none idles
MAX_LOSSES = 3  # times that a task may lose its worker
PATIENCE = 10.0  # s to wait for a scheduler's answer
DELAY = 1.0  # s until a bar shows: what is refused at once says so in one line
TIMED = 5.0  # s for which samples are timed
SMOOTHING = 0.1  # of the time left: a little more weight to the latest tasks, for a machine that gets busier


MAX_WORKERS = 1024  # threads or processes of one machine


def workers_to_use(workers: int | None) -> int:
    """Return a number of threads or processes, one for each core by default; a ClearanceError if it is impossible."""
    if workers is None:
        return os.cpu_count() or 1
    if not 1 <= workers <= MAX_WORKERS:
        raise ClearanceError(f"workers must be 1 to {MAX_WORKERS}, got {workers}")
    return workers


def print_duration(what: str, samples: Sequence[Callable[[], object]], times: float, workers: int) -> None:
    """Say how long so many times the mean of samples take on workers; they are timed for some seconds.

    The first one, which compiles its code, is called once more before.
    """
    samples[0]()
    start, completed = time.perf_counter(), 0
    while completed < len(samples) and time.perf_counter() - start < TIMED:
        samples[completed]()
        completed += 1
    alone = times * (time.perf_counter() - start) / completed
    least, most = (f"{s:.0f} s" if s < 100 else f"{s / 60:.0f} min" for s in (alone / workers, alone))
    shared = f"es (up to {most} where they share cores with each other or with other work)" if workers > 1 else ""
    print(f"{what}: about {least} on {workers} process{shared}, by {completed} timed here", file=sys.stderr)


def run_tasks(
    function: Callable[[Task], Result], tasks: Sequence[Task], workers: int | None = None, *, processes: bool = False,
    scheduler: str | None = None, executor: Executor | None = None, progress: str = "", done: int = 0,
) -> Iterator[tuple[Task, Result]]:  # fmt: skip
    """Run tasks and yield each with its result, in the order in which they end.

    They run on threads, on processes (dead ones are replaced), on the Dask cluster of a scheduler's address such as
    "tcp://10.0.0.1:8786", or on an executor, which is left open; but for threads, function and tasks can be pickled.
    ``progress`` describes a progress bar, if not empty, on which ``done`` tasks are done already. A ClearanceError says
    if a task loses its worker again and again; if Dask is not installed, no scheduler answers or it is lost, or a
    worker runs other code; if both a scheduler and an executor are given.
    """
    workers = workers_to_use(workers)
    if scheduler and executor:
        raise ClearanceError("give a scheduler or an executor, not both")
    if executor:
        results = _on_executor(function, tasks, executor)
    elif scheduler:
        results = _on_cluster(function, tasks, scheduler)
    elif processes:
        results = _on_processes(function, tasks, workers)
    else:
        results = _on_threads(function, tasks, workers)
    bar = tqdm(
        total=len(tasks) + done, initial=done, desc=progress, unit="run", smoothing=SMOOTHING, disable=not progress,
        delay=DELAY,
    )  # fmt: skip
    shown = threading.Timer(DELAY, bar.refresh)  # else it would show with the first result
    shown.daemon = True
    with bar, contextlib.closing(results):
        if progress:
            shown.start()
        try:
            for task, result in results:
                yield task, result
                bar.update()
        finally:
            shown.cancel()


def _on_threads(function: Callable[[Task], Result], tasks: Sequence[Task], workers: int) -> Results[Task, Result]:
    with ThreadPoolExecutor(workers) as pool:
        futures = {pool.submit(function, task): task for task in tasks}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        finally:
            for future in futures:
                future.cancel()


def _on_executor(
    function: Callable[[Task], Result], tasks: Sequence[Task], executor: Executor
) -> Results[Task, Result]:
    pending, known = deque(tasks), code()
    flying: set[Future[tuple[Task, Result]]] = set()
    try:
        while pending or flying:
            while pending and len(flying) < QUEUED:
                flying.add(executor.submit(_with_same_code, known, function, pending.popleft()))
            ended, flying = wait(flying, return_when=FIRST_COMPLETED)
            for future in ended:
                yield future.result()
    finally:
        for future in flying:
            future.cancel()


def _on_processes(function: Callable[[Task], Result], tasks: Sequence[Task], workers: int) -> Results[Task, Result]:
    pending, losses = deque(tasks), Counter[Task]()
    while pending:
        lost: list[Task] = []
        with _pool(workers) as pool:
            flying = _submit(pool, function, pending, {}, QUEUED_PER_WORKER * workers)
            while flying:
                for future in wait(flying, return_when=FIRST_COMPLETED).done:
                    task = flying.pop(future)
                    if isinstance(future.exception(), BrokenProcessPool):
                        lost.append(task)
                    else:
                        yield task, future.result()
                if not lost:
                    _submit(pool, function, pending, flying, QUEUED_PER_WORKER * workers)
        pending.extendleft(lost)
        losses.update(lost)
        if fatal := [task for task, n in losses.items() if n == MAX_LOSSES]:
            raise ClearanceError(
                f"case {fatal[0]} lost its worker {MAX_LOSSES} times (out of memory?); try fewer workers"
            )


@contextlib.contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Return a pool whose processes start afresh, not as copies of this one, its threads and locks."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # of the processes: there is one for each core
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), _initialize_worker)
    try:
        yield pool
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _submit(
    pool: ProcessPoolExecutor, function: Callable[[Task], Result], pending: deque[Task],
    flying: dict[Future[Result], Task], most: int,
) -> dict[Future[Result], Task]:  # fmt: skip
    """Submit tasks until as many run as are wanted."""
    while pending and len(flying) < most:
        try:
            future = pool.submit(function, pending[0])
        except BrokenProcessPool as error:
            future = Future()
            future.set_exception(error)
            most = 0
        flying[future] = pending.popleft()
    return flying


def _initialize_worker() -> None:
    """Make a worker end silently on Ctrl-C, and with the process that started it, however that ended."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    threading.Thread(target=_die_with, args=(multiprocessing.parent_process(),), daemon=True).start()


def _die_with(parent: BaseProcess) -> None:
    parent.join()
    os._exit(1)


def _on_cluster(function: Callable[[Task], Result], tasks: Sequence[Task], scheduler: str) -> Results[Task, Result]:
    """Run tasks on a Dask cluster, whose scheduler gives the tasks of dead workers to others."""
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
        submitted = client.map(partial(_with_same_code, code(), function), list(tasks), pure=False, key="case")
        try:
            for _, result in as_completed(submitted, loop=client.loop, with_results=True):
                yield result
        except KilledWorker as error:
            raise ClearanceError(f"--scheduler {scheduler}: a case kills its workers ({error})") from None
        except (OSError, FutureCancelledError) as error:
            raise ClearanceError(
                f"--scheduler {scheduler}: lost ({error}); run the same command again to go on"
            ) from None


def _with_same_code(known: str, function: Callable[[Task], Result], task: Task) -> tuple[Task, Result]:
    if code() != known:
        raise ClearanceError("a worker of the cluster runs another version of clearance_mj, or of its libraries")
    return task, function(task)
