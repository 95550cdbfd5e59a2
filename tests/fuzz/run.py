"""Feed inputs to readers in processes of their own, with a limit on memory and on the time of each input."""

import collections
import ctypes
import dataclasses
import gc
import hashlib
import multiprocessing
import re
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from dataclasses import dataclass, field
from pathlib import Path

from tqdm import tqdm

from clearance_mj.errors import ClearanceError

from .readers import Reader, generator

MEMORY = 500 * 2**20
"""bytes that reading may take beyond what the process has"""
PATIENCE = 20.0
"""s for one input; they take milliseconds, but other processes may have the machine"""
BATCH = 250
"""inputs of one process"""
LONGEST = 600
"""characters of a message beyond the file's name"""
FORK = multiprocessing.get_context("fork")


@dataclass
class Outcome:
    """What came of the inputs of one reader."""

    inputs: int = 0
    read: int = 0
    """accepted as whole files"""
    refused: int = 0
    """with a ClearanceError"""
    distinct: set = field(default_factory=set)
    """digests of the inputs"""
    messages: set = field(default_factory=set)
    """the refusals without their numbers and names"""
    growth: int = 0
    """largest growth of memory of a process, bytes"""
    seconds: float = 0.0
    findings: list = field(default_factory=list)
    """(index, what, detail, file) of the inputs that no reader may answer so"""

    def merge(self, other):
        for f in dataclasses.fields(self):
            mine, its = getattr(self, f.name), getattr(other, f.name)
            if isinstance(mine, set):
                mine |= its
            else:
                setattr(self, f.name, max(mine, its) if f.name == "growth" else mine + its)

    def summary(self) -> dict:
        kinds = collections.Counter(what for _, what, *_ in self.findings)
        return {
            "inputs": self.inputs,
            "distinct": len(self.distinct),
            "read": self.read,
            "refused": self.refused,
            "kinds_of_refusal": len(self.messages),
            **{what: kinds[what] for what in ("crashed", "hung", "memory", "escaped", "unclear")},
            "memory_growth_mb": round(self.growth / 2**20),
            "seconds": round(self.seconds, 1),
            "findings": [dict(zip(("index", "what", "detail", "file"), found)) for found in self.findings],
        }


@dataclass
class _Batch:
    """A process under way."""

    reader: Reader
    last: int
    process: FORK.Process
    results: object
    """receiving end of a pipe"""
    index: object
    """shared: the input at work"""
    since: object
    """shared: when it was begun, by the monotonic clock"""
    started: float
    folder: tempfile.TemporaryDirectory
    """where it writes its inputs"""


def fuzz(readers, seed, folder, share=1.0, workers=2, first=0, count=None, progress=True) -> dict[str, Outcome]:
    """Run inputs ``first`` to ``first + count`` of each reader (default: ``share`` of its own number)."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    outcomes = {reader.name: Outcome() for reader in readers}
    queue = collections.deque()
    for reader in readers:
        last = first + (count if count is not None else round(share * reader.inputs))
        queue.extend((reader, begin, min(begin + BATCH, last)) for begin in range(first, last, BATCH))
    total, running = sum(last - begin for _, begin, last in queue), []
    gc.collect()
    with tqdm(total=total, unit="input", smoothing=0, disable=not progress) as bar:
        try:
            while queue or running:
                while queue and len(running) < workers:
                    running.append(_start(*queue.popleft(), seed, folder))
                for batch in running[:]:
                    outcome, ended = _received(batch)
                    if not ended and (hangs := _hangs(batch)) | (not batch.process.is_alive()):
                        lost, more = _lost(batch, hangs, seed, folder)
                        outcome.merge(lost)
                        queue.extendleft(more)
                        ended = True
                    if ended:
                        batch.process.join()
                        batch.folder.cleanup()
                        outcome.seconds = time.monotonic() - batch.started
                        running.remove(batch)
                    outcomes[batch.reader.name].merge(outcome)
                    bar.update(outcome.inputs)
                time.sleep(0.01)
        finally:
            for batch in running:
                batch.process.kill()
                batch.process.join()
                batch.folder.cleanup()
    return outcomes


def _start(reader, first, last, seed, found) -> _Batch:
    receive, send = FORK.Pipe(duplex=False)
    index, since = FORK.Value(ctypes.c_longlong, first), FORK.Value(ctypes.c_double, time.monotonic())
    folder = tempfile.TemporaryDirectory(prefix="fuzz_")
    arguments = (reader, first, last, seed, Path(folder.name), found, send, index, since)
    process = FORK.Process(target=_work, args=arguments, daemon=True)
    process.start()
    send.close()
    return _Batch(reader, last, process, receive, index, since, time.monotonic(), folder)


def _hangs(batch) -> bool:
    return time.monotonic() - batch.since.value > PATIENCE


def _received(batch) -> tuple[Outcome, bool]:
    """What a process has sent since the last look, and whether it has come to its end."""
    outcome = Outcome()
    while batch.results.poll():
        try:
            part = batch.results.recv()
        except EOFError:
            break
        if part is None:
            return outcome, True
        outcome.merge(part)
    return outcome, False


def _lost(batch, hangs, seed, folder) -> tuple[Outcome, list]:
    """What else was done, the input that hangs or ended the process, and a batch of those that are left."""
    batch.process.kill()
    batch.process.join()
    rest, ended = _received(batch)
    if ended:  # just after the last look
        return rest, []
    at, code = batch.index.value, batch.process.exitcode
    if hangs:
        what, how = "hung", f"over {PATIENCE:g} s"
    else:
        what, how = "crashed", f"by {signal.Signals(-code).name}" if code < 0 else f"with exit status {code}"
    data = (Path(batch.folder.name) / batch.reader.file).read_bytes()
    rest.merge(Outcome(inputs=1, findings=[_kept(batch.reader, seed, at, data, what, how, folder)]))
    return rest, [(batch.reader, at + 1, batch.last)] if at + 1 < batch.last else []


def _kept(reader, seed, index, data, what, detail, folder):
    """Keep the input, and say where."""
    path = folder / f"{re.sub('[^A-Za-z0-9]+', '_', reader.name).strip('_')}-{seed}-{index}{Path(reader.file).suffix}"
    path.write_bytes(data)
    return index, what, detail, path.name


def _work(reader, first, last, seed, folder, found, send, index, since):
    """The process of a batch."""
    warnings.simplefilter("ignore")
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_AS, (_address_space() + MEMORY,) * 2)
    before = _peak()
    for file, content in reader.beside().items():
        (folder / file).write_bytes(content)
    for i in range(first, last):
        index.value, since.value = i, time.monotonic()
        outcome = _one(reader, seed, i, folder / reader.file, found)
        outcome.growth = max(0, _peak() - before)
        send.send(outcome)
    send.send(None)


def _one(reader, seed, index, path, folder) -> Outcome:
    rng = generator(reader, seed, index)
    data = reader.make(rng)
    path.write_bytes(data)
    outcome = Outcome(inputs=1, distinct={hashlib.blake2b(data, digest_size=8).digest()})
    found = None
    try:
        reader.read(path, rng)
        outcome.read = 1
    except ClearanceError as error:
        outcome.refused, message = 1, str(error)
        outcome.messages.add(re.sub(r"'[^']*'|\"[^\"]*\"|[-+]?\d[\d.e+-]*", "…", message.replace(str(path.parent), "")))
        found = _unclear(message, path)
    except MemoryError:
        found = "memory", f"MemoryError {_place()}"
    except Exception as error:  # whatever leaves a reader is a finding
        found = "escaped", f"{type(error).__name__}: {str(error)[:200]} {_place()}"
    if found:
        outcome.findings.append(_kept(reader, seed, index, data, *found, folder))
    return outcome


def _unclear(message, path):
    """What is wrong with a message, if anything."""
    if "Unable to allocate" in message or "MemoryError" in message:
        return "memory", message[:300]
    if str(path) not in message and str(path.parent) not in message:
        return "unclear", f"does not name the file: {message[:200]}"
    if not message.isprintable():
        return "unclear", f"is not one printable line: {message[:200]!r}"
    if len(message) - len(str(path)) > LONGEST:
        return "unclear", f"has {len(message)} characters: {message[:200]}"
    return None


def _place() -> str:
    """Where the exception at hand left the package, or where it was raised."""
    frames = traceback.extract_tb(sys.exc_info()[2])
    frame = next((f for f in reversed(frames) if "clearance_mj/" in f.filename), frames[-1])
    return f"({Path(frame.filename).name}:{frame.lineno})"


def _address_space() -> int:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[0]) * resource.getpagesize()


def _peak() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
