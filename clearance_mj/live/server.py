"""The web around a session: one page on 127.0.0.1, which nobody reaches who does not know its address.

Who asks must know the token in the address, and come from this page: other hosts, other origins and large messages are
refused. Only the files of the page are served, out of memory, so that no path leads anywhere else.
"""

from __future__ import annotations

import asyncio
import hmac
import secrets
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib import resources
from pathlib import Path
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.web import Application, RequestHandler

from ..core.checks import naming
from ..core.errors import ClearanceError
from ..io.dataset import Dataset
from ..model import Model
from .client import Client
from .session import Session
from .wire import MAX_BYTES

__all__ = ["Page", "serve"]

HOST = "127.0.0.1"
KINDS = {"html": "text/html", "js": "text/javascript", "css": "text/css"}
FILES = {"": ("live/page", "index.html")}
"""of the page, by their paths below the token: folder in the package, and name"""
FILES |= {name: ("live/page", name) for name in ("live.js", "figures.js", "live.css")}
FILES |= {"charts.js": ("report/templates", "charts.js")}
FILES |= {name: ("report/vendor", name) for name in ("uPlot.iife.min.js", "uPlot.min.css")}


class Page:
    """A page that is served until its event loop ends.

    Parameters
    ----------
    model, dataset
        As in `Session`.
    port : int
        To listen on; 0: any that is free.
    inputs : sequence of Path
        Files that model and dataset were read from, which exports name.

    Raises
    ------
    ClearanceError
        If the port cannot be had, or the law does not fit the rig.
    """

    def __init__(self, model: Model, dataset: Dataset | None = None, port: int = 0, inputs: Sequence[Path] = ()):
        self.inputs = inputs
        self.session = lambda: Session(model, dataset)
        self.session()
        self.token = secrets.token_urlsafe(32)
        self.clients: set[Client] = set()
        self.quick, self.long = ThreadPoolExecutor(2, "figures"), ThreadPoolExecutor(2, "branches")
        package = resources.files("clearance_mj")
        self.files = {
            path: (package.joinpath(folder, name).read_bytes(), f"{KINDS[name.rpartition('.')[2]]}; charset=utf-8")
            for path, (folder, name) in FILES.items()
        }
        if not 0 <= port <= 65535:
            raise ClearanceError(f"--port {port}: needs a number from 0 to 65535")
        with naming(f"--port {port}", OSError, ClearanceError, "{}: cannot be listened on ({})"):
            self.sockets = bind_sockets(port, HOST)
        self.port = self.sockets[0].getsockname()[1]
        self.hosts = {f"{name}:{self.port}" for name in (HOST, "localhost")}

    @property
    def address(self) -> str:
        """Address of the page, with its token."""
        return f"http://{HOST}:{self.port}/{self.token}/"

    async def run(self, ready: Callable[[], Any] = lambda: None) -> None:
        """Serve until cancelled; ``ready`` is called once the page answers."""
        routes = [("/([^/]*)/socket", Client, {"page": self}), ("/([^/]*)/(.*)", File, {"page": self})]
        application = Application(
            routes, default_handler_class=File, default_handler_args={"page": self},
            websocket_max_message_size=MAX_BYTES, log_function=lambda handler: None,
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
        """Compile the code that the first setting needs before a client waits for it."""
        session = self.session()
        session.simulated(session.setting({"duration": 4.0}))

    def refusal(self, handler: RequestHandler, token: str) -> int:
        """Return the status with which a request is refused, 0 if it is not."""
        request = handler.request
        origins = {f"http://{host}" for host in self.hosts}
        origin = request.headers.get("Origin")
        if request.headers.get_list("Host")[1:] or request.headers.get("Host", "").lower() not in self.hosts:
            return 403
        if (origin is None and isinstance(handler, Client)) or (origin is not None and origin.lower() not in origins):
            return 403
        if request.headers.get("Sec-Fetch-Site", "none") not in ("none", "same-origin"):
            return 403
        return 0 if hmac.compare_digest(token.encode(), self.token.encode()) else 403


class File(RequestHandler):
    """Handler of the page's files; no other paths exist."""

    def initialize(self, page: Page) -> None:
        """Take the page; Tornado's way of construction."""
        self.page = page
        self._set_headers()

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

    def _set_headers(self) -> None:
        """Set headers: no content from elsewhere, and no referrer with this address to elsewhere."""
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
