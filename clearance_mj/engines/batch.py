"""Batches of simulations: on threads, on an executor, or as one program where the engine supports it."""

from __future__ import annotations

import collections
import functools
import itertools
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import nullcontext
from typing import Any, TypeAlias, TypeVar

import numpy as np
from tqdm import tqdm

from ..clearance.law import Law
from ..clearance.modelled import Modelled, rig_and_law
from ..core.errors import ClearanceError
from ..core.tasks import workers_to_use
from ..rig import Rig
from ..signals.excitation import Excitation
from ..signals.response import Response
from .base import Engine, get_engine, in_columns
from .simulation import BLOCK, Simulation, simulate

__all__ = ["simulate_all", "simulate_batch", "simulate_each"]

CASES_PER_THREAD = 4  # running or queued cases for each thread
LARGEST_RESULT = 2**27  # numbers in the responses that are computed together
LARGEST_BLOCK = 2**24  # numbers at the engine's step that are decimated together

T = TypeVar("T")
One: TypeAlias = T | Sequence[T]


def simulate_batch(
    models: One[Rig | Modelled], excitations: One[Excitation], laws: One[Law] | None = None,
    engine: str | Engine = "links", workers: int | None = None, progress: bool = False,
    executor: Executor | None = None,
) -> list[Response]:  # fmt: skip
    """Simulate many cases at once and return all responses; see `simulate_each`.

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
    models: One[Rig | Modelled], excitations: One[Excitation], laws: One[Law] | None = None,
    engine: str | Engine = "links", workers: int | None = None, progress: bool = False,
    executor: Executor | None = None,
) -> Iterator[Response]:  # fmt: skip
    """Simulate many cases at once and yield one response after the other; results do not depend on the threads.

    Only a few cases run ahead of the consumer, so memory does not grow with their number.

    Parameters
    ----------
    models : Model or Rig, or a sequence of them
        One object for all cases or one for each.
    excitations : Excitation or sequence of Excitation
        One object for all cases or one for each.
    laws : Law or sequence of Law, optional
        Laws of rigs, one object for all cases or one for each; models have laws.
    engine : str or Engine
        Name or settings of the engine, as in `simulate`.
    workers : int, optional
        Threads; compiled loops release the interpreter lock. Default: one for each processor. The engine mjx, whose
        cases are one program, needs none.
    progress : bool
        Show a progress bar.
    executor : concurrent.futures.Executor, optional
        Executor for the cases instead of new threads; it is not shut down. ``workers`` is then the number at once.

    Yields
    ------
    Response
        Responses in the order of the cases.

    Raises
    ------
    ClearanceError
        If the sequences differ in length, and whatever `simulate` raises.
    """
    chosen, threads = get_engine(engine), workers_to_use(workers)
    cases = _cases(models, excitations, laws)
    if chosen.at_once > 1:
        tasks = [functools.partial(tuple, case) for case in cases]
        for response in tqdm(simulate_all(tasks, chosen), "simulating", len(cases), unit="run", disable=not progress):
            if isinstance(response, ClearanceError):
                raise response
            yield response
        return
    waiting, ahead = iter(cases), collections.deque[Future[Response]]()
    with nullcontext(executor) if executor else ThreadPoolExecutor(threads) as pool:
        try:
            for _ in tqdm(cases, desc="simulating", unit="run", disable=not progress):
                room = CASES_PER_THREAD * threads - len(ahead)
                ahead.extend(pool.submit(simulate, *case, chosen) for case in itertools.islice(waiting, room))
                yield ahead.popleft().result()
        finally:
            for job in ahead:  # after an error or an interrupt, do not begin what is still queued
                job.cancel()


def _cases(*columns: Any) -> list[tuple[Rig | Modelled, Excitation, Law | None]]:
    """Return one tuple for each case; an argument that is no list or tuple serves all of them."""
    rows = [column if isinstance(column, list | tuple) else None for column in columns]
    lengths = {len(row) for row in rows if row is not None}
    if len(lengths) > 1:
        raise ClearanceError(
            f"models, excitations and laws differ in number: {sorted(lengths)}; give one or equally many"
        )
    n = lengths.pop() if lengths else 1
    return list(zip(*(row if row is not None else [column] * n for row, column in zip(rows, columns))))


def simulate_all(cases: Sequence[Callable[[], tuple[Any, ...]]], engine: Engine) -> Iterator[Response | ClearanceError]:
    """Simulate every case, together where possible, and yield the response of each, or its error.

    Parameters
    ----------
    cases : sequence of callable
        Return model or rig, excitation and law, or None, of each case when it is its turn.
    engine : Engine
        The engine.

    Yields
    ------
    Response or ClearanceError
        In the order of the cases.
    """
    batch, size = list[Simulation | ClearanceError](), 0
    for case in cases:
        try:
            model, excitation, law = case()
            rig, law = rig_and_law(model, law)
            simulation = Simulation(rig, excitation, law, engine)
            batch.append(simulation)
            size += simulation.columns * excitation.value.shape[-1]
        except ClearanceError as error:
            batch.append(error)
        if len(batch) >= engine.at_once or size > LARGEST_RESULT:
            yield from _simulate_groups(batch)
            batch, size = [], 0
    yield from _simulate_groups(batch)


def _simulate_groups(batch: Sequence[Simulation | ClearanceError]) -> list[Response | ClearanceError]:
    """Return the responses of simulations, computed together for those that are alike."""
    groups = collections.defaultdict[object, dict[int, Simulation]](dict)
    for i, simulation in enumerate(batch):
        if isinstance(simulation, Simulation):
            groups[simulation.run.batch_key() if simulation.engine.at_once > 1 else i][i] = simulation
    results: dict[int, Any] = dict(enumerate(batch))
    for group in groups.values():
        results |= zip(group, _simulate_together(list(group.values())))
    return [*results.values()]


def _simulate_together(simulations: Sequence[Simulation]) -> list[Response | ClearanceError]:
    """Return the responses of simulations whose runs are alike, or of a single one."""
    first = simulations[0]
    if first.engine.at_once == 1:
        try:
            return [first.whole()]
        except ClearanceError as error:
            return [error]
    runs, factor = first.run.combine([simulation.run for simulation in simulations]), first.interpolator.factor
    block = int(np.clip(LARGEST_BLOCK // (len(simulations) * first.columns * factor), 1, BLOCK))
    signals = [_pad(s.excitation.value.T, s.excitation.value.shape[-1] + s.ahead) for s in simulations]
    samples: list[list[np.ndarray]] = [[] for _ in simulations]
    errors: dict[int, ClearanceError] = {}
    for start in range(0, max(map(len, signals)), block):
        inputs = [_pad(signal[start : start + block], block) for signal in signals]
        upsampled = np.stack([in_columns(s.interpolator.push(part)) for s, part in zip(simulations, inputs)])
        for i, (simulation, outputs) in enumerate(zip(simulations, runs.advance(upsampled))):
            try:
                samples[i].append(simulation.sampled(upsampled[i], outputs) if i not in errors else outputs[:0])
            except ClearanceError as error:
                errors[i] = error
    outputs_of = [np.concatenate(parts)[: s.excitation.value.shape[-1]] for parts, s in zip(samples, simulations)]
    return [errors.get(i) or s.response(s.excitation.value.T, outputs_of[i]) for i, s in enumerate(simulations)]


def _pad(samples: np.ndarray, count: int) -> np.ndarray:
    """Return samples, padded with zeros to a count."""
    return np.pad(samples, ((0, count - len(samples)), *((0, 0),) * (samples.ndim - 1)))
