"""A live page in headless Chromium that reaches nothing but this machine."""

from __future__ import annotations

import contextlib
import shutil
import time
from pathlib import Path

import pytest

from ..processes import PATIENCE, started, wait_for

CHROMIUM = next((p for n in ("chromium", "chromium-browser", "google-chrome") if (p := shutil.which(n))), None)


@contextlib.contextmanager
def served(folder: Path, *arguments):
    """Start ``clearance-mj live`` on arguments and yield the page's address."""
    out = folder / "address"
    with started("-m", "clearance_mj", "live", *arguments, "--no-browser", "--out", out) as process:
        wait_for(lambda: out.exists() or process.poll() is not None)
        yield out.read_text().strip()
        process.terminate()
        process.wait(PATIENCE)


@contextlib.contextmanager
def chromium():
    """Yield a browser without a network: every name but this machine's is unknown to it."""
    from playwright.sync_api import sync_playwright

    rules = "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", rules])
        yield browser
        browser.close()


def until(page, expression: str):
    """Wait until a JavaScript expression is true, and return it; the page's policy allows no eval of Playwright's."""
    end = time.monotonic() + PATIENCE
    while not (answer := page.evaluate(expression)):
        if time.monotonic() > end:
            seen = page.evaluate("[live.drawn, live.state.order, document.visibilityState]")
            pytest.fail(f"{expression}: {seen}, {page.inner_text('#status')}, {page.inner_text('#problem')}")
        page.wait_for_timeout(10)
    return answer


def opened(browser, address: str, **options):
    """Open the page in a context of its own and wait until its figures are drawn; returns the page and its errors."""
    options.setdefault("viewport", {"width": 1280, "height": 900})
    page = browser.new_context(**options).new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda message: message.type == "error" and errors.append(message.text))
    allowed = (address, "data:", "blob:")
    page.on("request", lambda request: request.url.startswith(allowed) or errors.append(request.url))
    page.goto(address)
    until(page, "Boolean(window.live && live.drawn)")
    return page, errors


def settled(page) -> None:
    """Wait until what is shown is the newest setting."""
    until(page, "live.drawn === live.state.order")


def slide(page, name: str, place: int) -> None:
    """Move a slider to a place of 0 to 1000, as a hand does: input, then change when it is released."""
    page.evaluate(
        """([id, place]) => {
            const slider = document.getElementById(id).parentElement.querySelector("input[type=range]");
            slider.value = place;
            slider.dispatchEvent(new Event("input", { bubbles: true }));
            slider.dispatchEvent(new Event("change", { bubbles: true }));
        }""",
        [f"c-{name}", place],
    )
