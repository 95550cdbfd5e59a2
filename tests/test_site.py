"""The site builds without a warning; in a browser, wide and narrow, nothing sticks out; and how to cite."""

import importlib.util
import re
import tomllib
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
import yaml

import clearance_mj

from .conftest import ROOT
from .live.browser import CHROMIUM, chromium
from .processes import run


class Page(HTMLParser):
    """Names that a page can be linked at, and what it links to and shows."""

    def __init__(self, path: Path):
        super().__init__()
        self.names, self.links = set(), []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.names |= {given[key] for key in ("id", "name") if given.get(key)}
        self.links += [given[key] for key in ("href", "src") if given.get(key)]


def broken(pages):
    """Links of pages to files, and to places in pages, that are not there."""
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            known = pages.get(target)
            if not target.exists() or (parts.fragment and known and unquote(parts.fragment) not in known.names):
                yield f"{path.name}: {link}"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    pytest.importorskip("furo", reason="the extra docs is not installed")
    out = tmp_path_factory.mktemp("site").resolve()
    command = (
        "-m",
        "sphinx",
        "-q",
        "-W",
        "--keep-going",
        "-j",
        "auto",
        "-d",
        out / "doctrees",
        ROOT / "docs",
        out / "html",
    )
    done = run(*command, patience=900, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return out / "html"


@pytest.mark.slow
def test_no_link_is_broken(site):
    """Files, pictures and anchors, of the pages and of the reference, every page of which is in a table of contents."""
    pages = {path: Page(path) for path in sorted(site.rglob("*.html"))}
    assert len(pages) > 100 and list(broken(pages)) == []


@pytest.mark.slow
@pytest.mark.skipif(
    not (CHROMIUM and importlib.util.find_spec("playwright")), reason="needs a Chromium, and the extra browser"
)
@pytest.mark.parametrize("width", [1280, *(pytest.param(w, marks=pytest.mark.release) for w in (768, 390))])
def test_nothing_sticks_out(site, width):
    """Every page is as wide as the window; wide tables and code scroll in themselves."""
    wide = []
    with chromium() as browser:
        page = browser.new_context(viewport={"width": width, "height": 900}).new_page()
        for path in sorted(site.rglob("*.html")):
            page.goto(path.as_uri())
            if page.evaluate("document.documentElement.scrollWidth > document.documentElement.clientWidth"):
                wide.append(path.relative_to(site).as_posix())
    assert wide == []


def test_broken_links_are_found(tmp_path):
    (tmp_path / "a.html").write_text('<p id="here"><a href="b.html#there">b</a><a href="#here">a</a><img src="no.png">')
    (tmp_path / "b.html").write_text('<a href="a.html#here">a</a><a href="https://example.org/x">out</a>')
    pages = {path.resolve(): Page(path) for path in tmp_path.glob("*.html")}
    assert list(broken(pages)) == ["a.html: b.html#there", "a.html: no.png"]


def test_how_to_cite():
    """CFF 1.2.0: the keys that it asks for; version and licence are those of the package, the article has its DOI."""
    cff = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert {"cff-version", "message", "title", "authors"} <= cff.keys() and cff["cff-version"] == "1.2.0"
    assert cff["version"] == clearance_mj.__version__
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert set(cff["license"]) == set(re.split(" AND ", project["license"]))
    (article,) = cff["references"]
    assert {"type", "title", "authors"} <= article.keys() and re.fullmatch(r"10\.\d+/\S+", article["doi"])
