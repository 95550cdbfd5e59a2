"""clearance-mj live: a local page on which gaps, laws and the excitation are sliders."""

from __future__ import annotations

import os
import signal
import sys
import threading
import webbrowser
from pathlib import Path

from ..core.errors import ClearanceError
from ..core.files import replacing
from ..io.dataset import Dataset
from .command import Options, Result, command, flag, inputs, option, out_file
from .options import RIG, load_model, plugin


@command(
    "live", *RIG,
    option("--dataset", "records to lay over the figures and to drive the rig with (default: those in the rig's "
           "folder)", Path, metavar="FOLDER"),
    option("--port", "on which the page is, on this machine alone (default: any free one)", int, 0),
    flag("--no-browser", "open no browser; the page's address is printed"),
    plugin("an engine, a contact or a grease"),
    out_help="file for the page's address, which only you can read (default: none); it ends with the page",
)  # fmt: skip
def run(options: Options) -> Result:
    """Open a local page on which gaps, laws and the excitation are sliders and the figures follow."""
    try:
        from ..live.server import Page, serve
    except ModuleNotFoundError as error:
        if error.name != "tornado":
            raise
        raise ClearanceError('live needs Tornado: pip install "clearance-mj[live]"') from None
    if options.out:
        out_file(options.out, (options.out.suffix.lower(),), inputs(options), _holds_address)
    model = load_model(options)
    folder = options.dataset or (options.rig if (options.rig / "dataset.toml").is_file() else None)
    page = Page(model, Dataset.load(folder) if folder else None, options.port, inputs(options))
    written: list[Path] = []

    def ready() -> None:
        if options.out:
            file = Path(os.path.realpath(options.out))
            if file.is_file():  # of a page that was killed; `replacing` would keep its permissions
                file.unlink()
            with replacing(file) as temporary:
                temporary.chmod(0o600)
                temporary.write_text(page.address + "\n", encoding="utf-8")
            written.append(file)
        print(f"live: {page.address}\nCtrl-C ends it", file=sys.stderr if options.json else sys.stdout, flush=True)
        if not options.no_browser:
            threading.Thread(target=webbrowser.open, args=(page.address,), daemon=True).start()

    before = signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends it as Ctrl-C does
    try:
        serve(page, ready)
    except KeyboardInterrupt:
        pass
    finally:
        signal.signal(signal.SIGTERM, before)
        for file in written:
            file.unlink(missing_ok=True)
    return Result({"port": page.port}, ["closed"])


def _holds_address(path: Path) -> bool:
    return path.read_bytes().startswith(b"http://")
