"""The list of public calls, docs/public_calls.csv, is that of the code, and all calls follow one convention.

`python -m tests.test_public_calls` writes the list.
"""

import csv
import importlib
import inspect
import pkgutil

import clearance_mj

from .conftest import ROOT

LIST = ROOT / "docs" / "public_calls.csv"
PARTS = [m.name for m in pkgutil.iter_modules(clearance_mj.__path__) if not m.name.startswith("_")]
COUNTS = {"harmonics", "modes", "samples", "starts", "tries", "draws", "orders"}  # counts, if they are whole numbers


def public():
    """Every function that the package or a part of it exports, by the shortest name that users call it by."""
    functions = {}
    for part in ["", *PARTS]:
        module = importlib.import_module(f"clearance_mj.{part}".rstrip("."))
        for name in getattr(module, "__all__", ()):
            value = getattr(module, name)
            value = inspect.unwrap(getattr(value, "py_func", value)) if callable(value) else value
            if inspect.isfunction(value) and value.__module__.startswith("clearance_mj"):
                functions.setdefault(value, f"{part}.{name}".lstrip("."))
    return {name: inspect.signature(function) for function, name in functions.items()}


def returned(signature):
    annotation = signature.return_annotation
    return annotation if isinstance(annotation, str) else getattr(annotation, "__name__", str(annotation))


def rows():
    """Header, then call and result of every public function."""
    calls = [
        [f"cm.{name}({', '.join(signature.parameters)})", returned(signature)]
        for name, signature in sorted(public().items())
    ]
    return [["call", "returns"], *calls]


def test_the_list_is_that_of_the_code():
    with LIST.open(encoding="utf-8", newline="") as file:
        assert list(csv.reader(file)) == rows()


def test_progress_is_a_switch_everywhere():
    switches = {name: s.parameters["progress"] for name, s in public().items() if "progress" in s.parameters}
    assert switches
    assert {n for n, p in switches.items() if (p.annotation, p.default) != ("bool", False)} == set()


def test_counts_begin_with_n():
    whole = (
        (n, p) for n, s in public().items() for p in s.parameters.values() if p.annotation in ("int", "int | None")
    )
    assert {(n, p.name) for n, p in whole if p.name in COUNTS} == set()


def test_one_object_is_returned():
    tuples = {n: s.return_annotation for n, s in public().items() if str(s.return_annotation).startswith("tuple[")}
    pairs = {n for n, returned in tuples.items() if not returned.endswith("...]")}
    assert pairs == {"solref_solimp"}  # two arrays that MuJoCo itself keeps apart


def test_no_function_shadows_its_module():
    modules = {
        m.name.removeprefix("clearance_mj.") for m in pkgutil.walk_packages(clearance_mj.__path__, "clearance_mj.")
    }
    assert set(public()) & modules == set()


def test_excitation_comes_second():
    """What is simulated, then its excitation, then options."""
    calls = {n: list(s.parameters) for n, s in public().items() if {"excitation", "excitations"} & set(s.parameters)}
    assert {n for n, names in calls.items() if names[1] not in ("excitation", "excitations")} == set()


if __name__ == "__main__":
    with LIST.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows())
