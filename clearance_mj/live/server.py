"""The web around a session: one page on 127.0.0.1, and a websocket for everyone who has it open.

Who asks must know the token in the address, and come from this page: other hosts, other origins and large messages are
refused. Only the files of the page are served, out of memory, so that no path leads anywhere else.
"""

from __future__ import annotations

import asyncio
import functools
import hmac
import secrets
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from importlib import resources
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.web import Application, RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from ..clearance import Law
from ..errors import ClearanceError
from ..io.dataset import Dataset
from ..rig import Rig
from .figures import Numbers
from .session import Session, Watch
from .wire import MOST_BYTES, Cancel, Export, Follow, Message, Set, Sweep, Window, packed, parsed

__all__ = ["Page", "serve"]

HOST = "127.0.0.1"
KINDS = {"html": "text/html", "js": "text/javascript", "css": "text/css"}
OWN, VENDORED = "live/page", "report/vendor"
FILES = {
    "": (OWN, "index.html"),
    "live.js": (OWN, "live.js"),
    "charts.js": (OWN, "charts.js"),
    "live.css": (OWN, "live.css"),
    "uPlot.iife.min.js": (VENDORED, "uPlot.iife.min.js"),
    "uPlot.min.css": (VENDORED, "uPlot.min.css"),
}
"""of the page, by their paths below the token: folder in the package, and name"""
MOST_CLIENTS = 32
PATIENCE = 0.7
"""s that a simulation may go on after a newer setting has come"""
TOLD_EVERY = 0.1
"""s between two words about progress"""


class Superseded(Exception):
    """Nobody waits for it any more."""


class Page:
    """A page that is served until its event loop ends.

    Parameters
    ----------
    rig, law, dataset
        As in `Session`.
    port : int
        To listen on; 0: any that is free.

    Raises
    ------
    ClearanceError
        If the port cannot be had, or the law does not fit the rig.
    """

    def __init__(self, rig: Rig, law: Law, dataset: Dataset | None = None, port: int = 0) -> None:
        self.session = lambda: Session(rig, law, dataset)
        self.session()
        self.token = secrets.token_urlsafe(32)
        self.clients: set[Socket] = set()
        self.quick, self.long = ThreadPoolExecutor(2, "figures"), ThreadPoolExecutor(2, "branches")
        package = resources.files("clearance_mj")
        self.files = {
            path: (package.joinpath(folder, name).read_bytes(), f"{KINDS[name.rpartition('.')[2]]}; charset=utf-8")
            for path, (folder, name) in FILES.items()
        }
        if not 0 <= port <= 65535:
            raise ClearanceError(f"--port {port}: needs a number from 0 to 65535")
        try:
            self.sockets = bind_sockets(port, HOST)
        except OSError as error:
            raise ClearanceError(f"--port {port}: cannot be listened on ({error})") from None
        self.port = self.sockets[0].getsockname()[1]
        self.hosts = {f"{name}:{self.port}" for name in (HOST, "localhost")}

    @property
    def address(self) -> str:
        """Of the page, with its token."""
        return f"http://{HOST}:{self.port}/{self.token}/"

    async def run(self, ready: Callable[[], Any] = lambda: None) -> None:
        """Serve until cancelled; ``ready`` is called once the page answers."""
        routes = [("/([^/]*)/socket", Socket, {"page": self}), ("/([^/]*)/(.*)", File, {"page": self})]
        application = Application(
            routes, default_handler_class=File, default_handler_args={"page": self},
            websocket_max_message_size=MOST_BYTES, log_function=lambda handler: None,
        )  # fmt: skip
        server = HTTPServer(application, max_body_size=0, max_header_size=16_384, idle_connection_timeout=600)
        server.add_sockets(self.sockets)
        self.quick.submit(self._warm)
        ready()
        try:
            await asyncio.Event().wait()
        finally:
            server.stop()
            for client in list(self.clients):
                client.on_close()
            for pool in (self.quick, self.long):
                pool.shutdown(wait=False, cancel_futures=True)

    def _warm(self) -> None:
        """Compile what the first setting needs before someone waits for it."""
        session = self.session()
        session.simulated(session.setting({"duration": 4.0}))

    def refusal(self, handler: RequestHandler, token: str) -> int:
        """Return the status with which a request is refused, 0 if it is not."""
        request = handler.request
        own = {f"http://{host}" for host in self.hosts}
        origin = request.headers.get("Origin")
        if request.headers.get_list("Host")[1:] or request.headers.get("Host", "").lower() not in self.hosts:
            return 403
        if (origin is None and isinstance(handler, Socket)) or (origin is not None and origin.lower() not in own):
            return 403
        if request.headers.get("Sec-Fetch-Site", "none") not in ("none", "same-origin"):
            return 403
        return 0 if hmac.compare_digest(token.encode(), self.token.encode()) else 403


class File(RequestHandler):
    """The files of the page; nothing else is there."""

    def initialize(self, page: Page) -> None:
        """Take the page; Tornado's way of construction."""
        self.page = page
        self._guard()

    def prepare(self) -> None:
        """Refuse who may not ask."""
        if status := self.page.refusal(self, self.path_args[0] if self.path_args else ""):
            self.set_status(status)
            self.finish("refused\n")

    def get(self, token: str, path: str) -> None:
        """Return a file of the page."""
        if path not in self.page.files:
            self.set_status(404)
            self.finish("there is no such file\n")
            return
        data, kind = self.page.files[path]
        self.set_header("Content-Type", kind)
        self.finish(data)

    def _guard(self) -> None:
        """Nothing from elsewhere, and nothing about this address to elsewhere."""
        self.clear_header("Server")
        policy = (
            "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
            f"connect-src 'self' {' '.join(f'ws://{host}' for host in sorted(self.page.hosts))}; base-uri 'none'; "
            "form-action 'none'; frame-ancestors 'none'"
        )
        for name, value in {
            "Content-Security-Policy": policy, "Referrer-Policy": "no-referrer", "Cache-Control": "no-store",
            "X-Content-Type-Options": "nosniff", "Cross-Origin-Resource-Policy": "same-origin",
            "Content-Type": "text/plain; charset=utf-8",
        }.items():  # fmt: skip
            self.set_header(name, value)


class Socket(WebSocketHandler):
    """One open page: its session, the setting that it waits for, and at most one branch or sweep."""

    def initialize(self, page: Page) -> None:
        """Take the page; Tornado's way of construction."""
        self.page, self.waiting, self.busy, self.over = page, None, False, False
        self.began = 0.0
        self.stop: threading.Event | None = None
        self.record = "", 0.0
        self.loop = asyncio.get_running_loop()
        self.jobs: set[asyncio.Task[None]] = set()

    waiting: Set | None

    def prepare(self) -> None:
        """Refuse who may not ask."""
        status = self.page.refusal(self, self.path_args[0])
        if status or len(self.page.clients) >= MOST_CLIENTS:
            self.set_status(status or 503)
            self.finish("refused\n")

    def check_origin(self, origin: str) -> bool:
        """`Page.refusal` has looked at it."""
        return True

    def open(self, *args: str, **_: str) -> None:
        """Tell what can be moved."""
        self.page.clients.add(self)
        self.session = self.page.session()
        self._send(packed("hello", Numbers(self.session.described())))

    def on_close(self) -> None:
        """End what nobody waits for any more."""
        self.over, self.waiting = True, None
        self.page.clients.discard(self)
        if self.stop:
            self.stop.set()

    def on_message(self, message: str | bytes) -> None:
        """Do what a message asks for; one that is malformed does nothing."""
        wanted: Message | None = parsed(message)
        if isinstance(wanted, Set):
            self.waiting = wanted
            if not self.busy:
                self._begin(self._show())
        elif isinstance(wanted, Cancel) and self.stop:
            self.stop.set()
        elif isinstance(wanted, Follow | Sweep) and self.stop is None:
            self.stop = threading.Event()
            self._begin(self._long(wanted, self.stop))
        elif isinstance(wanted, Window):
            self._send(packed("window", self.session.window(float(wanted.low), float(wanted.high))))
        elif isinstance(wanted, Export):
            self._begin(self._export())

    def _begin(self, job: Any) -> None:
        task = asyncio.ensure_future(job)
        self.jobs.add(task)
        task.add_done_callback(self.jobs.discard)

    def _send(self, data: bytes) -> None:
        if not self.over:
            try:
                self.write_message(data, binary=True)
            except WebSocketClosedError:
                self.over = True

    async def _run(self, pool: ThreadPoolExecutor, work: Callable[[], bytes], **words: Any) -> None:
        """Send what work gives, or in words why it gives nothing."""
        try:
            self._send(await self.loop.run_in_executor(pool, work))
        except Superseded:
            self._send(packed("ended", Numbers(words)))
        except ClearanceError as error:
            self._send(packed("problem", Numbers({"text": str(error), **words})))
        except Exception as error:  # the page goes on, whatever happened
            self._send(packed("problem", Numbers({"text": f"{type(error).__name__}: {error}", **words})))

    async def _show(self) -> None:
        """Show the newest setting, until there is none that is newer."""
        self.busy = True
        while (wanted := self.waiting) is not None:
            self.waiting, self.began = None, time.monotonic()
            await self._run(self.page.quick, functools.partial(self._shown, wanted), of="set", id=wanted.id)
        self.busy = False

    def _shown(self, wanted: Set) -> bytes:
        session, told = self.session, time.monotonic()

        def watch(share: float) -> None:
            nonlocal told
            now = time.monotonic()
            if self.over or (self.waiting is not None and now - self.began > PATIENCE):
                raise Superseded
            if now - told > 2 * TOLD_EVERY:
                told = now
                self._tell("progress", of="set", share=share)

        values = session.setting(wanted.values)
        numbers = session.show(values, watch)
        if wanted.record:
            numbers.add(session.overlay(wanted.record, float(values["resolution"])))
        return packed("figures", numbers, id=wanted.id)

    def _tell(self, kind: str, **facts: Any) -> None:
        """Send from another thread."""
        data = packed(kind, Numbers(facts))
        self.loop.call_soon_threadsafe(self._send, data)

    async def _long(self, wanted: Follow | Sweep, stop: threading.Event) -> None:
        told = 0.0

        def watch(share: float) -> None:
            nonlocal told
            if stop.is_set() or self.over:
                raise Superseded
            if time.monotonic() - told > TOLD_EVERY:
                told = time.monotonic()
                self._tell("progress", of=wanted.type, share=share)

        await self._run(self.page.long, lambda: self._found(wanted, watch), of=wanted.type)
        self.stop = None

    def _found(self, wanted: Follow | Sweep, watch: Watch) -> bytes:
        session, low, high = self.session, float(wanted.low), float(wanted.high)
        values = session.setting(wanted.values)
        if isinstance(wanted, Follow):
            return packed("branch", session.branch(values, low, high, watch))
        return packed("sweep", session.sweep(values, wanted.name, low, high, wanted.count, watch))

    async def _export(self) -> None:
        from .export import exported

        def work() -> bytes:
            if self.session.shown is None:
                raise ClearanceError("nothing is shown yet")
            return packed("export", Numbers()) + exported(self.session.shown)

        await self._run(self.page.quick, work, of="export")


def serve(page: Page, ready: Callable[[], Any] = lambda: None) -> None:
    """Serve a page until Ctrl-C.

    Parameters
    ----------
    page : Page
        The page.
    ready : callable
        Called once it answers.
    """
    asyncio.run(page.run(ready))
