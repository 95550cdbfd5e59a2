"""Many simulations at once, on threads or on an executor that is given."""

from __future__ import annotations

import collections
import itertools
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import nullcontext
from typing import Any, TypeAlias, TypeVar

from tqdm import tqdm

from ..clearance.law import Law
from ..clearance.modelled import Modelled
from ..core.errors import ClearanceError
from ..core.tasks import workers_to_use
from ..rig import Rig
from ..signals.excitation import Excitation
from ..signals.response import Response
from .base import Engine, get_engine
from .simulation import simulate

__all__ = ["simulate_batch", "simulate_each"]

CASES_PER_THREAD = 4  # cases for each thread that run, or wait to be run, at once

T = TypeVar("T")
One: TypeAlias = T | Sequence[T]


def simulate_batch(
    models: One[Rig | Modelled],
    excitations: One[Excitation],
    laws: One[Law] | None = None,
    engine: str | Engine = "links",
    workers: int | None = None,
    progress: bool = False,
    executor: Executor | None = None,
) -> list[Response]:
    """Simulate many cases at once and keep every response; otherwise `simulate_each`.

    Parameters
    ----------
    models, excitations, laws, engine, workers, progress, executor
        As in `simulate_each`.

    Returns
    -------
    list of Response
        Responses in the order of the cases.

    Raises
    ------
    ClearanceError
        As in `simulate_each`.
    """
    return list(simulate_each(models, excitations, laws, engine, workers, progress, executor))


def simulate_each(
    models: One[Rig | Modelled],
    excitations: One[Excitation],
    laws: One[Law] | None = None,
    engine: str | Engine = "links",
    workers: int | None = None,
    progress: bool = False,
    executor: Executor | None = None,
) -> Iterator[Response]:
    """Simulate many cases at once and hand over one response after the other; results do not depend on the threads.

    Only a few cases run ahead of the one that is taken, so memory does not grow with their number.

    Parameters
    ----------
    models : Model or Rig, or a sequence of them
        One object for all cases or one for each.
    excitations : Excitation or sequence of Excitation
        One object for all cases or one for each.
    laws : Law or sequence of Law, optional
        Laws of rigs, one object for all cases or one for each; models bring their own.
    engine : str or Engine
        Name or settings of the engine, as in `simulate`.
    workers : int, optional
        Threads; compiled loops release the interpreter lock. Default: one for each processor.
    progress : bool
        Show a progress bar.
    executor : concurrent.futures.Executor, optional
        What runs the cases instead of threads of its own, and is left open; ``workers`` then says how many run at once.

    Yields
    ------
    Response
        Responses in the order of the cases.

    Raises
    ------
    ClearanceError
        If the sequences differ in length, and whatever `simulate` raises.
    """
    used, threads = get_engine(engine), workers_to_use(workers)
    cases = _cases(models, excitations, laws)
    waiting, ahead = iter(cases), collections.deque[Future[Response]]()
    with nullcontext(executor) if executor else ThreadPoolExecutor(threads) as pool:
        try:
            for _ in tqdm(cases, desc="simulating", unit="run", disable=not progress):
                room = CASES_PER_THREAD * threads - len(ahead)
                ahead.extend(pool.submit(simulate, *case, used) for case in itertools.islice(waiting, room))
                yield ahead.popleft().result()
        finally:
            for job in ahead:  # after an error or an interrupt, do not begin what is still queued
                job.cancel()


def _cases(*columns: Any) -> list[tuple[Rig | Modelled, Excitation, Law | None]]:
    """One tuple for each case; what is no list or tuple serves all of them."""
    rows = [column if isinstance(column, list | tuple) else None for column in columns]
    lengths = {len(row) for row in rows if row is not None}
    if len(lengths) > 1:
        raise ClearanceError(
            f"models, excitations and laws differ in number: {sorted(lengths)}; give one or equally many"
        )
    n = lengths.pop() if lengths else 1
    return list(zip(*(row if row is not None else [column] * n for row, column in zip(rows, columns))))
