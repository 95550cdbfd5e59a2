"""The pages name only commands, flags, files, modules, functions and keywords that are there."""

import ast
import contextlib
import importlib
import importlib.util
import inspect
import io
import re
import shlex

import pytest

from clearance_mj.cli import main

from .conftest import ROOT

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
    output = io.StringIO()
    with contextlib.redirect_stdout(output), pytest.raises(SystemExit) as ended:
        main([command, "--help"])
    assert ended.value.code == 0
    return set(re.findall(r"--[a-z][\w-]*", output.getvalue()))


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


def wrong_names(code):
    """Names of what code imports that are not there, and keywords that the functions which it calls do not take."""
    tree, known, wrong = ast.parse(code), {}, []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                known[alias.asname or alias.name.partition(".")[0]] = imported(alias.name, bool(alias.asname))
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                known[alias.asname or alias.name] = member(imported(node.module, True), alias.name)
    wrong += [name for name, value in known.items() if value is None]
    for node in ast.walk(tree):
        chain = ast.unparse(node) if isinstance(node, ast.Attribute) else ""
        if re.fullmatch(r"\w+(\.\w+)+", chain) and value_of(chain, known) is None:
            wrong.append(chain)
        if isinstance(node, ast.Call):
            taken = keywords_of(value_of(ast.unparse(node.func), known))
            wrong += [k.arg for k in node.keywords if k.arg and taken is not None and k.arg not in taken]
    return wrong


def imported(path, whole):
    """Module of a dotted path, or the package that it is in; None where it is missing."""
    with contextlib.suppress(ImportError):
        module = importlib.import_module(path)
        return module if whole else importlib.import_module(path.partition(".")[0])
    return None


def member(value, name):
    """What a module holds under a name; anything of what is no module, as instances have what classes do not."""
    if not inspect.ismodule(value):
        return ANYTHING
    return getattr(value, name, None) or imported(f"{value.__name__}.{name}", True)


ANYTHING = object()


def value_of(chain, known):
    """What a dotted name stands for, where it begins with an imported one."""
    root, *rest = chain.split(".")
    value = known.get(root, ANYTHING)
    for name in rest:
        value = value if value is None else getattr(value, name, None) or member(value, name)
    return value


def keywords_of(function):
    """Keywords that a function takes, or None if it takes any."""
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return None
    return None if any(p.kind is p.VAR_KEYWORD for p in parameters) else {p.name for p in parameters}


@all_pages
def test_names_of_python_are_there(page):
    """Its code, which the slow tests run: blocks parse, what they name is there, and functions take their keywords."""
    blocks = re.findall(r"^```python\n(.*?)^```$", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    modules = {name for block in blocks for name in re.findall(r"^# (\w+)\.py$", block, re.MULTILINE)}
    for block in blocks:
        assert modules.issuperset(wrong_names(block)), block


def test_wrong_names_of_python_are_found():
    code = "import clearance_mj as cm\nfrom clearance_mj.rig import Rigg\ncm.simulat(1)\ncm.identify.sdof(fs=1, mas=2)"
    assert sorted(wrong_names(code)) == ["Rigg", "cm.simulat", "mas"]


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
