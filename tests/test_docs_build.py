"""The site builds without a warning, and the pages name only commands, flags, files and modules that are there."""

import contextlib
import importlib.util
import io
import re
import shlex
import shutil

import pytest

from clearance_mj.cli import main

from .conftest import ROOT
from .processes import run

HEADS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
PAGES = [*HEADS, *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "docs").glob("experiments/*.md"))]
TARGETS = re.search(r"^\.PHONY: (.*)$", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)[1].split()
all_pages = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())


def commands(text):
    """Words of every command on a page: in a code block, continued lines joined, or between backticks."""
    text = re.sub(r"\\\n", " ", text)
    fenced = "\n".join(re.findall(r"^```sh\n(.*?)^```$", text, re.DOTALL | re.MULTILINE))
    indented = re.findall(r"^ {4}(\S.*)$", text, re.MULTILINE)
    inline = re.findall(r"`([^`\n]+)`", text)
    for line in (*fenced.splitlines(), *indented, *inline):
        if line.startswith(("clearance-mj ", "make ", "python -m ", "python3 -m ")):
            yield shlex.split(line, comments=True)


def flags(command):
    """Flags that the help of a command names."""
    told = io.StringIO()
    with contextlib.redirect_stdout(told), pytest.raises(SystemExit) as ended:
        main([command, "--help"])
    assert ended.value.code == 0
    return set(re.findall(r"--[a-z][\w-]*", told.getvalue()))


def unknown(words):
    """What a command names that is not there."""
    program, *rest = words
    if program == "clearance-mj":
        return {word.partition("=")[0] for word in rest if word.startswith("--")} - flags(rest[0])
    if program == "make":
        return {word for word in rest if "=" not in word} - set(TARGETS)
    return {rest[1]} if importlib.util.find_spec(rest[1]) is None else set()


@all_pages
def test_commands_are_there(page):
    for words in commands(page.read_text(encoding="utf-8")):
        assert not unknown(words), " ".join(words)


def test_modules_that_sources_name_are_there():
    """Usage lines of docstrings, of scripts that write pages, and of the Makefile."""
    files = [*(path for top in ("benchmarks", "clearance_mj", "experiments") for path in (ROOT / top).rglob("*.py"))]
    for path in (*files, ROOT / "Makefile", ROOT / "CHANGELOG.md"):
        for name in re.findall(r"python -m ((?:clearance_mj|experiments|benchmarks)[\w.]*\w)", path.read_text("utf-8")):
            assert importlib.util.find_spec(name), f"{path.relative_to(ROOT)}: {name}"


@pytest.mark.parametrize(
    "words", ["clearance-mj study data --no-such-flag", "make nonsense", "python -m clearance_mj.nonsense"]
)
def test_what_is_not_there_is_found(words):
    assert unknown(words.split())


def test_commands_are_read():
    text = "    make test  # all\n\n```sh\nclearance-mj new a \\\n    --length 1\n```\n\n`clearance-mj audit`, `make`\n"
    assert list(commands(text)) == [
        ["clearance-mj", "new", "a", "--length", "1"],
        ["make", "test"],
        ["clearance-mj", "audit"],
    ]


@all_pages
def test_linked_files_are_there(page):
    """Pictures and links to files; Sphinx looks at those of its own pages only."""
    for path in re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
        assert (page.parent / path).exists(), path


def test_every_picture_is_shown():
    shown = {
        (page.parent / path).resolve()
        for page in PAGES
        for path in re.findall(r"\]\(([^)\s]+\.(?:png|gif))\)", page.read_text(encoding="utf-8"))
    }
    assert {p.resolve() for p in (ROOT / "docs").glob("**/*.png") if "_build" not in p.parts} <= shown


@pytest.mark.slow
def test_build(tmp_path):
    """Every page in a table of contents, every reference and picture found; the pages are not written."""
    pytest.importorskip("furo", reason="the extra docs is not installed")
    shutil.copytree(ROOT / "docs", tmp_path / "docs", ignore=shutil.ignore_patterns("_build", "generated"))
    shutil.copy(ROOT / "README.md", tmp_path)
    command = ("-m", "sphinx", "-q", "-W", "--keep-going", "-j", "auto", "-b", "dummy", "docs", "out")
    done = run(*command, patience=600, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
