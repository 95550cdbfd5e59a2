"""Feed inputs to readers in processes of their own, with a limit on memory and on the time of each input."""

import collections
import hashlib
import multiprocessing
import multiprocessing.connection
import os
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

from clearance_mj import ClearanceError

from ..processes import PATIENCE
from .readers import Reader, generator

BATCH = 250  # inputs of one process
LONGEST = 600  # characters of a message beyond the file's name
IDLE = 6.0  # times its processor time that an input may take: other processes have the machine, too
FORK = multiprocessing.get_context("fork")
FINDINGS = ("crashed", "hung", "memory", "escaped", "unclear")


@dataclass
class Outcome:
    """What came of the inputs of one reader."""

    inputs: int = 0
    read: int = 0  #: accepted as whole files
    distinct: set = field(default_factory=set)  #: digests of the inputs
    messages: set = field(default_factory=set)  #: the refusals (ClearanceError) without their numbers and names
    refused: int = 0
    growth: int = 0  #: largest growth of memory of a process, bytes
    findings: list = field(default_factory=list)
    """(index, what, detail, file) of the inputs that no reader may answer so"""

    def add(self, read, message, finding, digest, growth):
        self.inputs += 1
        self.read += read
        self.distinct.add(digest)
        self.growth = max(self.growth, growth)
        if message:
            self.refused += 1
            self.messages.add(message)
        if finding:
            self.findings.append(finding)

    def summary(self) -> dict:
        kinds = collections.Counter(what for _, what, *_ in self.findings)
        return {
            "inputs": self.inputs, "distinct": len(self.distinct), "read": self.read, "refused": self.refused,
            "kinds_of_refusal": len(self.messages), **{what: kinds[what] for what in FINDINGS},
            "memory_growth_mb": round(self.growth / 2**20),
            "findings": [dict(zip(("index", "what", "detail", "file"), finding)) for finding in self.findings],
        }  # fmt: skip


class _Batch:
    """A process that reads inputs one after another and sends what came of each."""

    def __init__(self, reader: Reader, first: int, last: int, seed: int, kept_in: Path):
        self.reader, self.last, self.seed, self.found = reader, last, seed, kept_in
        self.folder = tempfile.TemporaryDirectory(prefix="fuzz_")
        self.results, send = FORK.Pipe(duplex=False)
        arguments = (reader, first, last, seed, Path(self.folder.name), kept_in, send)
        self.process = FORK.Process(target=_work, args=arguments, daemon=True)
        self.process.start()
        self.begin(first)
        send.close()

    def hangs(self) -> bool:
        """Whether the input at hand has had its time, of the processor, or many times that, waiting."""
        waited, patience = time.monotonic() - self.since, self.reader.patience
        if waited > IDLE * patience:
            return True
        return waited > patience and _processor_time(self.process.pid) - self.spent > patience

    def begin(self, index: int):
        """The next input is begun."""
        self.at, self.since, self.spent = index, time.monotonic(), _processor_time(self.process.pid)

    def lost(self, hangs: bool):
        """The input that hangs or has ended the process."""
        self.stop()
        code = self.process.exitcode
        how = f"by {signal.Signals(-code).name}" if code < 0 else f"with exit status {code}"
        what, how = ("hung", f"over {self.reader.patience:g} s") if hangs else ("crashed", how)
        data = self.reader.make(generator(self.reader, self.seed, self.at))
        return False, "", _kept(self.reader, self.seed, self.at, data, what, how, self.found), _digest(data), 0

    def stop(self):
        self.process.kill()
        self.process.join(PATIENCE)
        self.folder.cleanup()


def fuzz(readers, seed, folder, fraction=1.0, workers=2, first=0, count=None, progress=True) -> dict[str, Outcome]:
    """Run inputs ``first`` to ``first + count`` of each reader (default: ``share`` of its own number)."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    outcomes = {reader.name: Outcome() for reader in readers}
    queue, running = collections.deque(), {}
    for reader in readers:
        last = first + (count if count is not None else round(fraction * reader.inputs))
        reader.prepare(reader.make(generator(reader, seed, i)) for i in range(first, min(last, first + BATCH)))
        queue.extend((reader, begin, min(begin + BATCH, last)) for begin in range(first, last, BATCH))
    with tqdm(total=sum(last - begin for _, begin, last in queue), unit="input", disable=not progress) as bar:
        try:
            while queue or running:
                while queue and len(running) < workers:
                    batch = _Batch(*queue.popleft(), seed, folder)
                    running[batch.results] = batch
                ready = multiprocessing.connection.wait([*running], timeout=0.2)
                for results, batch in list(running.items()):
                    if results not in ready and not batch.hangs():
                        continue
                    try:
                        outcome, lost = (results.recv(), False) if results in ready else (batch.lost(True), True)
                    except EOFError:
                        outcome, lost = batch.lost(False), True
                    outcomes[batch.reader.name].add(*outcome)
                    bar.update()
                    batch.begin(batch.at + 1)
                    if lost or batch.at == batch.last:
                        batch.stop()
                        del running[results]
                        if batch.at < batch.last:
                            queue.appendleft((batch.reader, batch.at, batch.last))
        finally:
            for batch in running.values():
                batch.stop()
    return outcomes


def _digest(data: bytes) -> bytes:
    return hashlib.blake2b(data, digest_size=8).digest()


def _kept(reader, seed, index, data, what, detail, folder):
    """Keep the input, and say where."""
    path = folder / f"{re.sub('[^A-Za-z0-9]+', '_', reader.name).strip('_')}-{seed}-{index}{Path(reader.file).suffix}"
    path.write_bytes(data)
    return index, what, detail, path.name


def _work(reader, first, last, seed, folder, kept_in, send):
    """The process of a batch."""
    warnings.simplefilter("ignore")
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_AS, (_address_space() + reader.memory,) * 2)
    before = _peak()
    for file, content in reader.beside().items():
        (folder / file).write_bytes(content)
    for index in range(first, last):
        rng = generator(reader, seed, index)
        data = reader.make(rng)
        path = folder / reader.file
        path.write_bytes(data)
        read, message, finding = _one(reader, path, rng)
        kept = _kept(reader, seed, index, data, *finding, kept_in) if finding else None
        send.send((read, message, kept, _digest(data), max(0, _peak() - before)))


def _one(reader, path, rng):
    """Whether a file is read, the kind of refusal, and what is wrong with the answer, if anything."""
    try:
        reader.read(path, rng)
        return True, "", None
    except ClearanceError as error:
        message = str(error)
        kind = re.sub(r"'[^']*'|\"[^\"]*\"|[-+]?\d[\d.e+-]*", "…", message.replace(str(path.parent), ""))
        return False, kind, _unclear(message, path)
    except MemoryError:
        return False, "", ("memory", f"MemoryError {_place()}")
    except Exception as error:  # whatever leaves a reader is a finding
        return False, "", ("escaped", f"{type(error).__name__}: {str(error)[:200]} {_place()}")


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


def _processor_time(pid: int) -> float:
    """s, of a process; 0 once it has ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except (FileNotFoundError, ProcessLookupError):
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _peak() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
