"""One open page, by its websocket: what it asks for, what it waits for, and what it is last_report."""

from __future__ import annotations

import asyncio
import functools
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Protocol

from tornado.web import RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from ..core.errors import ClearanceError
from .figures import Numbers
from .session import Session, Watch
from .wire import Cancel, Export, Follow, Hear, Message, Set, Step, Sweep, Window, packed, parsed

__all__ = ["Client", "Host"]

MAX_CLIENTS = 32  # at once
PATIENCE = 0.7  # s that a simulation may go on after a newer setting has come
REPORT_INTERVAL = 0.1  # s between two words about progress


class Superseded(Exception):
    """Raised in a computation whose result nobody waits for any more."""


class Host(Protocol):
    """State common to all clients of the page."""

    clients: set[Client]
    inputs: Sequence[Path]
    quick: ThreadPoolExecutor
    long: ThreadPoolExecutor

    @property
    def session(self) -> Callable[[], Session]:
        """Makes a session for each of them."""

    def refusal(self, handler: RequestHandler, token: str) -> int:
        """Return the status with which a request is refused, 0 if it is not."""


class Client(WebSocketHandler):
    """One open page: its session, the setting that it waits for, and at most one thing that takes long."""

    def initialize(self, page: Host) -> None:
        """Store the page; Tornado constructs handlers so."""
        self.page, self.waiting, self.busy, self.over = page, None, False, False
        self.began = 0.0
        self.stop: threading.Event | None = None
        self.loop = asyncio.get_running_loop()
        self.jobs: set[asyncio.Task[None]] = set()

    waiting: Set | None

    def prepare(self) -> None:
        """Refuse requests that the page's rules do not allow."""
        status = self.page.refusal(self, self.path_args[0])
        if status or len(self.page.clients) >= MAX_CLIENTS:
            self.set_status(status or 503)
            self.finish("refused\n")

    def check_origin(self, origin: str) -> bool:
        """Return True: `Page.refusal` has checked the origin."""
        return True

    def open(self, *args: str, **_: str) -> None:
        """Send the controls to the page."""
        self.page.clients.add(self)
        self.session = self.page.session()
        self._send(packed("hello", Numbers(self.session.described())))

    def on_close(self) -> None:
        """Stop computations whose results nobody waits for."""
        self.over, self.waiting = True, None
        self.page.clients.discard(self)
        if self.stop:
            self.stop.set()

    def on_message(self, message: str | bytes) -> None:
        """Handle a message of the page; a malformed one has no effect."""
        wanted: Message | None = parsed(message)
        if isinstance(wanted, Set):
            self.waiting = wanted
            if not self.busy:
                self._begin(self._show())
        elif isinstance(wanted, Cancel) and self.stop:  # at once: what is being compiled ends unheard
            self.stop.set()
            self.stop = None
            self._send(packed("ended", Numbers()))
        elif isinstance(wanted, Follow | Step | Sweep) and self.stop is None:
            self.stop = threading.Event()
            self._begin(self._run_long(wanted, self.stop))
        elif isinstance(wanted, Window):
            self._send(packed("window", self.session.window(float(wanted.low), float(wanted.high))))
        elif isinstance(wanted, Export | Hear):
            self._begin(self._give_shown(wanted))

    def _begin(self, job: Any) -> None:
        task = asyncio.ensure_future(job)
        self.jobs.add(task)
        task.add_done_callback(self.jobs.discard)

    def _send(self, data: bytes) -> None:
        if data and not self.over:
            try:
                self.write_message(data, binary=True)
            except WebSocketClosedError:
                self.over = True

    async def _answer(self, pool: ThreadPoolExecutor, work: Callable[[], bytes], **words: Any) -> bytes:
        """Return what work gives, in words why it gives nothing, or nothing if nobody waits for it."""
        try:
            return await self.loop.run_in_executor(pool, work)
        except Superseded:
            return b""
        except ClearanceError as error:
            text = str(error)
        except Exception as error:  # the page goes on, whatever happened
            text = f"{type(error).__name__}: {error}"
        return packed("problem", Numbers({"text": text, **words}))

    async def _show(self) -> None:
        """Show the newest setting, until there is none that is newer."""
        self.busy = True
        while (wanted := self.waiting) is not None:
            self.waiting, self.began = None, time.monotonic()
            work = functools.partial(self._simulate_numbers, wanted)
            self._send(await self._answer(self.page.quick, work, of="set", id=wanted.id))
        self.busy = False

    def _simulate_numbers(self, wanted: Set) -> bytes:
        session = self.session

        def ended() -> bool:
            return self.over or (self.waiting is not None and time.monotonic() - self.began > PATIENCE)

        watch = self._watcher("set", ended, 2 * REPORT_INTERVAL, time.monotonic())
        values = session.setting(wanted.values)
        numbers = session.show(values, watch)
        if wanted.record:
            numbers.add(session.overlay(wanted.record, float(values["resolution"])))
        return packed("figures", numbers, id=wanted.id)

    def _watcher(self, of: str, ended: Callable[[], bool], every: float = REPORT_INTERVAL, last: float = 0.0) -> Watch:
        """Return a progress callback: it informs the page now and then, and stops superseded computations."""

        def watch(share: float) -> None:
            nonlocal last
            if ended():
                raise Superseded
            if time.monotonic() - last > every:
                last = time.monotonic()
                # Computations are in other threads than the page's.
                self.loop.call_soon_threadsafe(self._send, packed("progress", Numbers({"of": of, "share": share})))

        return watch

    async def _run_long(self, wanted: Follow | Step | Sweep, stop: threading.Event) -> None:
        watch = self._watcher(wanted.type, stop.is_set)
        answer = await self._answer(self.page.long, lambda: self._compute_long(wanted, watch), of=wanted.type)
        if not stop.is_set():
            self.stop = None
            self._send(answer)

    def _compute_long(self, wanted: Follow | Step | Sweep, watch: Watch) -> bytes:
        from . import on_demand

        watch(0.0)
        session, low, high = self.session, float(wanted.low), float(wanted.high)
        values = session.setting(wanted.values)
        if isinstance(wanted, Follow):
            numbers = on_demand.branch(session, values, low, high, watch)
        elif isinstance(wanted, Step):
            numbers = on_demand.steps(session, values, low, high, wanted.count, float(wanted.hold), watch)
        else:
            numbers = on_demand.sweep(session, values, wanted.name, low, high, wanted.count, watch)
        return packed(wanted.type, numbers)

    async def _give_shown(self, wanted: Export | Hear) -> None:
        self._send(await self._answer(self.page.quick, lambda: self._pack_shown(wanted), of=wanted.type))

    def _pack_shown(self, wanted: Export | Hear) -> bytes:
        """Return what is shown as files or as a sound."""
        if (shown := self.session.shown) is None:
            raise ClearanceError("nothing is shown yet")
        if isinstance(wanted, Hear):
            from .hear import heard

            return packed(wanted.type, heard(shown, wanted.sensor), slot=wanted.slot)
        from .export import exported

        frf = self.session.record_frf(wanted.record, float(shown.values["resolution"])) if wanted.record else None
        return packed(wanted.type, Numbers()) + exported(shown, frf, self.page.inputs)
