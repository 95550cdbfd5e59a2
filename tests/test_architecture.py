"""The import graph of the package: layers that import only downwards, no circles, and nothing of the article."""

import ast
import re
from collections import Counter
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import clearance_mj

from .processes import run

PACKAGE = Path(clearance_mj.__file__).parent
PAGE = PACKAGE.parent / "docs" / "architecture.md"
ROWS = re.findall(r"^\| ((?:`\w+`(?:, )?)+) \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
LAYERS = [re.findall(r"`(\w+)`", row) for row in ROWS]  # lowest first; modules of one layer may import each other
OUTSIDE = {"benchmarks", "experiments", "tests"}
EVERYWHERE = ("clearance_mj", *sorted(OUTSIDE))


@cache
def nodes(path) -> list[ast.AST]:
    """Imports of a file, and attributes of plain names: all that these tests look at, of one pass over the file."""
    return [
        node
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Import | ast.ImportFrom)
        or (isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name))
    ]


@cache
def sources(tops=EVERYWHERE) -> list[Path]:
    return [path for top in tops for path in (PACKAGE.parent / top).rglob("*.py")]


@cache
def imports() -> dict[str, set[str]]:
    """What each module imports of the package and of the source tree, within functions and for types too."""
    files = {_name(path): path for path in PACKAGE.rglob("*.py")}
    return {name: _imported(name, path, files) for name, path in files.items()}


def _name(path) -> str:
    parts = ("clearance_mj", *path.relative_to(PACKAGE).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _imported(name, path, files, tops=OUTSIDE | {"clearance_mj"}) -> set[str]:
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    modules = set()
    for node in nodes(path):
        if isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            module = ".".join((*package[: len(package) - node.level + 1], *filter(None, [node.module])))
            module = module if node.level else node.module
            modules |= {inner if (inner := f"{module}.{a.name}") in files else module for a in node.names}
    return {module for module in modules if module.split(".")[0] in tops} - {name}


def test_the_page_has_every_module_in_one_layer():
    tops = {name.split(".")[1] for name in imports() if "." in name}
    assert sorted(tops) == sorted(top for layer in LAYERS for top in layer)


def test_no_module_imports_from_a_higher_layer():
    height = {top: i for i, layer in enumerate(LAYERS) for top in layer}
    upward = [
        (name, target)
        for name, targets in imports().items()
        for target in targets
        if "." in name and (target == "clearance_mj" or height[target.split(".")[1]] > height[name.split(".")[1]])
        if target.startswith("clearance_mj")
    ]
    assert not upward


def test_libraries_of_tables_and_figures_are_loaded_when_they_are_used():
    later = "{'pandas', 'xarray', 'control', 'matplotlib', 'jinja2'}"
    program = f"import sys, clearance_mj; print(*{later} & sys.modules.keys())"
    assert run("-c", program).stdout == "\n"


def test_public_names_are_the_same_for_type_checkers():
    """What `__init__` shows to them, what it imports when it is used, and `__all__`."""
    block = next(n for n in ast.parse((PACKAGE / "__init__.py").read_text()).body if isinstance(n, ast.If))
    shown = {(node.module, alias.name) for node in block.body for alias in node.names}
    modules = {(None, name) for name in ("beam", "identify", "periodic", "physical", "sound", "structure")}
    homes = {(module, name) for name, module in clearance_mj._HOMES.items()}
    assert shown == homes | modules | {("signals", "excitation")}
    assert {name for _, name in shown} | {"__version__"} == set(clearance_mj.__all__)
    assert all(getattr(clearance_mj, name) is not None for name in clearance_mj.__all__)
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = clearance_mj.nothing


def test_a_name_with_an_underscore_stays_in_its_file():
    """Modules and what they hold: whatever another file imports has a name that is meant for it."""
    imported = [
        (path.relative_to(PACKAGE.parent).as_posix(), name)
        for path in sources()
        for node in nodes(path)
        if isinstance(node, ast.Import | ast.ImportFrom)
        for name in (*(getattr(node, "module", None) or "").split("."), *(alias.name for alias in node.names))
        if re.search(r"(^|\.)_(?!_)", name)
    ]
    assert not imported


def test_a_class_name_stands_in_one_file():
    names = Counter(
        node.name
        for path in sources(("clearance_mj",))
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.ClassDef)
    )
    assert not [name for name, count in names.items() if count > 1]


def test_the_glossary_has_at_most_60_terms():
    lines = (PACKAGE.parent / "docs" / "glossary.md").read_text(encoding="utf-8").splitlines()
    assert sum(line.startswith("- ") for line in lines) <= 60


def test_the_core_knows_neither_vehicles_nor_sound():
    """Only what shows results imports them, and the commands; both need extras."""
    users = {name.split(".")[1] for name, targets in imports().items() if "." in name for target in targets
             if target.startswith(("clearance_mj.vehicle", "clearance_mj.sound"))}  # fmt: skip
    assert users <= {"vehicle", "sound", "report", "cli", "live", "study"}


def test_no_file_is_longer_than_400_lines():
    assert not [path for path in sources() if path.read_text(encoding="utf-8").count("\n") > 400]


def test_only_the_helper_with_a_limit_starts_processes():
    """A test that waits for another process must end, whatever becomes of that."""
    files = {p for p in Path(__file__).parent.rglob("*.py") if "subprocess" in _imported("", p, {}, {"subprocess"})}
    assert [path.name for path in files] == ["processes.py"]


def test_one_decorator_compiles():
    """`core.jit` alone knows what machine code on disk is made from; the ufuncs of the walls call nothing."""
    compiling = {
        (path.relative_to(PACKAGE.parent).as_posix(), node.attr)
        for path in sources(("clearance_mj", "experiments", "tests"))
        for node in nodes(path)
        if isinstance(node, ast.Attribute) and node.attr in ("njit", "jit", "vectorize", "guvectorize", "cfunc")
        if node.value.id == "numba"
    }
    assert compiling == {
        ("clearance_mj/core/jit.py", "njit"),
        ("clearance_mj/clearance/walls/slot.py", "vectorize"),
        ("clearance_mj/engines/mujoco_step.py", "cfunc"),
    }


def test_no_circles():
    try:
        TopologicalSorter(imports()).prepare()
    except CycleError as error:
        raise AssertionError(" -> ".join(error.args[1])) from None


def test_the_package_knows_nothing_of_article_tests_and_benchmarks():
    assert not {(name, t) for name, targets in imports().items() for t in targets if t.split(".")[0] in OUTSIDE}
