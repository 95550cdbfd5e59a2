"""Every public argument is documented: the names in a signature against those in its docstring (read by numpydoc).

Public is what `clearance_mj` and its subpackages export (``__all__`` of an ``__init__``, and that of a module which is
exported itself), with the methods of its classes. A field of a dataclass is documented under Parameters or by the
string that follows it. All other functions and classes without a leading underscore have a docstring.
"""

import ast
import dataclasses
import importlib
import inspect
import pkgutil
import textwrap
import types

import pytest
from numpydoc.docscrape import FunctionDoc

import clearance_mj

INFOS = list(pkgutil.walk_packages(clearance_mj.__path__, "clearance_mj."))
MODULES = ["clearance_mj", *(m.name for m in INFOS if "._" not in m.name)]
PACKAGES = ["clearance_mj", *(m.name for m in INFOS if m.ispkg and m.name.count(".") == 1)]


def exported(module):
    """What a package exports, by name, and what a module that it exports does."""
    for name in getattr(module, "__all__", ()):
        value = getattr(module, name)
        if inspect.ismodule(value) and value is not module:
            yield from exported(value)
        else:
            yield name, value


def defined(module):
    """Functions and classes without a leading underscore that a module defines, by name."""
    public = {name: value for name, value in vars(module).items() if not name.startswith("_")}
    return {name: value for name, value in public.items() if getattr(value, "__module__", "") == module.__name__}


def plain(value):
    """Return the Python function behind a method, a decorator or a compiled function; None for anything else."""
    value = getattr(value, "__func__", value)
    value = inspect.unwrap(getattr(value, "py_func", value))
    return value if inspect.isfunction(value) else None


def named(docstring):
    """Names under Parameters; "k, c" names two."""
    entries = [p.name for p in FunctionDoc(None, doc=inspect.cleandoc(docstring or ""))["Parameters"]]
    return {name.strip(" *") for entry in entries for name in entry.split(",")}


def described(cls):
    """Names of the class's own fields that a string follows."""
    body = ast.parse(textwrap.dedent(inspect.getsource(cls))).body[0].body
    return {
        field.target.id
        for field, words in zip(body, body[1:])
        if isinstance(field, ast.AnnAssign) and isinstance(words, ast.Expr) and isinstance(words.value, ast.Constant)
    }


def missing_arguments(function, docstrings):
    if not any(docstrings):
        return ["has no docstring"]
    first = "self" if "self" in inspect.signature(function).parameters else "cls"
    known = set().union({first}, *map(named, docstrings))
    return [f"argument {name}" for name in inspect.signature(function).parameters if name not in known]


def missing_fields(cls):
    """Fields that neither the class nor what it inherits from documents."""
    bases = [base for base in cls.__mro__ if dataclasses.is_dataclass(base)]
    known = set().union(*(named(base.__doc__) | described(base) for base in bases))
    return [f"field {f.name}" for f in dataclasses.fields(cls) if f.name not in known and not f.name.startswith("_")]


def missing_of_class(name, cls):
    """What is missing of a class and its methods; a method that overrides another may leave its arguments to that."""
    if dataclasses.is_dataclass(cls):
        yield from (f"{name}: {what}" for what in missing_fields(cls))
    elif init := plain(vars(cls).get("__init__")):
        yield from (f"{name}: {what}" for what in missing_arguments(init, [cls.__doc__, init.__doc__]))
    for method, function in ((m, plain(value)) for m, value in vars(cls).items() if not m.startswith("_")):
        if function:
            docstrings = [vars(base)[method].__doc__ for base in cls.__mro__ if method in vars(base)]
            yield from (f"{name}.{method}: {what}" for what in missing_arguments(function, docstrings))


def missing(values):
    """What the docstrings of functions and classes leave out, one line each."""
    for name, value in values:
        if inspect.isclass(value):
            yield from missing_of_class(name, value)
        elif function := plain(value):
            yield from (f"{name}: {what}" for what in missing_arguments(function, [function.__doc__]))


def without_docstring(values):
    """Names of functions, classes and methods that have none."""
    for name, value in values:
        if inspect.isclass(value):
            methods = [(f"{name}.{m}", v) for m, v in vars(value).items() if not m.startswith("_")]
            yield from without_docstring(methods)
        if (inspect.isclass(value) or plain(value)) and not inspect.getdoc(plain(value) or value):
            yield name


@pytest.mark.parametrize("name", PACKAGES)
def test_every_public_argument_is_documented(name):
    assert not list(missing(exported(importlib.import_module(name))))


@pytest.mark.parametrize("name", MODULES)
def test_everything_has_a_docstring(name):
    for engine, package in (("mjx", "mujoco.mjx"), ("warp", "mujoco_warp")):
        if name.startswith(f"clearance_mj.physical.{engine}"):
            pytest.importorskip(package)
    module = importlib.import_module(name)
    assert module.__doc__
    assert not list(without_docstring(defined(module).items()))


def bad(a, b):
    """Do it.

    Parameters
    ----------
    a : float
        m.
    """


@dataclasses.dataclass
class Bad:
    """A thing."""

    known: float
    """m"""
    unknown: float

    def method(self, x):
        pass


def test_what_is_missing_is_found():
    module = types.ModuleType(__name__)
    module.bad, module.Bad, module.__all__ = bad, Bad, ["bad", "Bad"]
    assert list(missing(exported(module))) == ["bad: argument b", "Bad: field unknown", "Bad.method: has no docstring"]
    assert list(without_docstring(defined(module).items())) == ["Bad.method"]
