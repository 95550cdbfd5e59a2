"""Compile functions with numba, and keep the machine code on disk until anything that went into it changes.

numba's own cache compares the file of a function alone, but machine code also holds the functions that it calls, the
constants that they read and the layout of the named tuples that they take, wherever these stand. Here the name of what
is kept is a digest over all of them, taken when a function is first called: over bytecode and values, so that neither a
comment nor a function that it does not call makes it compile again, and the releases of MuJoCo, whose layouts differ in
some constants, use the same code where they are alike.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import sys
import time
import types as python_types
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba import types
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.dispatcher import Dispatcher
from numba.np.ufunc.dufunc import DUFunc
from numba.np.ufunc.ufuncbuilder import UFuncDispatcher

__all__ = ["OPTIONS", "STRICT", "digest", "inlined", "jit"]

OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract", "reassoc", "nsz"}}
"""Options by which engines and models are compiled: no change of their arithmetic hides an infinity or a NaN.

What they call is `inlined`, else the last bits of a result would depend on what else the process has compiled: a
function that several compiled ones call has a copy in each, of which the one that was loaded first is taken.
"""
STRICT: dict[str, Any] = {"error_model": "numpy"}
"""Options by which loops are compiled whose functions call each other: all copies of one round alike."""

UNUSED_FOR = 14 * 86400.0
"""Seconds after which machine code of an older version that nobody loaded is removed: the time of a change's review."""

_BY_NAME = {*sys.stdlib_module_names, "llvmlite", "numba", "numpy", "scipy"}
"""Packages of which a name says enough: numba compares its own version, and freezes no code of the others."""


def jit(function: Any = None, **options: Any) -> Any:
    """Compile a function with numba without the interpreter's lock; a decorator, with or without numba's options.

    Machine code is kept on disk, where the function stands in a file that numba finds a folder for.
    """
    if function is None:
        return lambda given: jit(given, **options)
    compiled: Any = numba.njit(**{"nogil": True, **options})(function)
    if isinstance(compiled, Dispatcher):  # else NUMBA_DISABLE_JIT asks for plain Python
        _share_among_constants(compiled)
        with contextlib.suppress(RuntimeError):  # numba has no place for it
            compiled._cache = _KeptCode(function, compiled)  # type: ignore[attr-defined]
    return compiled


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a function, once, that goes whole into every loop that calls it."""
    return jit(function, **OPTIONS, forceinline=True)


def _share_among_constants(compiled: Any) -> None:
    """Make compiled callers that pass constants use the code of their type; numba compiles anew for each value."""
    of_types = compiled.get_call_template

    def of_plain_types(args: Any, kws: Any) -> Any:
        return of_types(tuple(map(types.unliteral, args)), {name: types.unliteral(kind) for name, kind in kws.items()})

    compiled.get_call_template = of_plain_types


class _KeptCode(FunctionCache):
    """Machine code of one function on disk, in a file for each digest."""

    def __init__(self, function: Callable[..., Any], dispatcher: Any):
        super().__init__(function)
        self._dispatcher = dispatcher
        name = self._impl.filename_base.rpartition("-")[0]  # without the line, which says nothing of the code
        self._cache_file = _Files(self._cache_path, name, None)

    def _index_key(self, signature: Any, codegen: Any) -> str:
        """Digest of the code, the types of its arguments, the processor, numba and Python."""
        kinds = [_type_name(kind) for kind in (signature if isinstance(signature, tuple) else signature.args)]
        place = (numba.__version__, sys.version_info[:2], getattr(sys, "abiflags", ""), codegen.magic_tuple())
        return _hash(repr((kinds, str(signature), place, digest(self._dispatcher))))


class _Files(IndexDataCacheFile):
    """Files of one function, identified by name: there is no index that two processes could write at once."""

    def save(self, key: str, data: Any) -> None:
        """Write whole or not at all; a full disk costs the keeping alone."""
        with contextlib.suppress(OSError):
            self._save_data(self._name(key), data)
            self._remove(lambda path: time.time() - path.stat().st_mtime > UNUSED_FOR)

    def load(self, key: str) -> Any:
        """Return what was kept, or None; a damaged file, or one of classes that are there no more, counts for none."""
        try:
            data = self._load_data(self._name(key))
            os.utime(self._data_path(self._name(key)))
        except Exception:
            return None
        return data

    def flush(self) -> None:
        """Remove the stored code of the function."""
        self._remove(lambda path: True)

    def _name(self, key: str) -> str:
        return f"{self._data_name(0).removesuffix('.0.nbc')}-{key[:32]}.nbc"

    def _remove(self, is_old: Callable[[Path], bool]) -> None:
        for path in Path(self._cache_path).glob(self._name("*")):
            with contextlib.suppress(OSError):  # another process was faster
                if is_old(path):
                    path.unlink()


def digest(function: Any) -> str:
    """Return a digest over all that the machine code of a compiled function is made from but its arguments' types.

    Parameters
    ----------
    function : Dispatcher
        The function as `jit` returns it.

    Returns
    -------
    str
        SHA-256 over bytecode, constants and options of the function and of all functions of it that it refers to, the
        values of global constants, fields of named tuples, and whole files of helpers that are not compiled by
        themselves, since these may define how operators and functions compile.
    """
    entries: dict[str, None] = {}
    waiting: list[tuple[str, Any]] = [("", function)]
    seen: set[int] = set()
    while waiting:
        name, value = waiting.pop()
        value = value._dispatcher if isinstance(value, DUFunc) else value  # type: ignore[attr-defined]
        if isinstance(value, Dispatcher | UFuncDispatcher):
            entries[f"{name} {_options(value)}"] = None
            value = value.py_func
        elif isinstance(value, python_types.FunctionType):
            if _is_foreign(value.__module__):
                entries[f"{name} {value.__module__}.{value.__qualname__}"] = None
                continue
            entries[f"{name} {_file_digest(value.__module__)}"] = None
        if isinstance(value, python_types.FunctionType):
            if id(value) not in seen:
                seen.add(id(value))
                entries[f"{name} {_code_digest(value.__code__)} {value.__defaults__!r}"] = None
                waiting += _references(value)
        else:
            summary, references = _describe_value(value)
            entries[f"{name} {summary}"] = None
            if id(value) not in seen:
                seen.add(id(value))
                waiting += [(name, each) for each in references]
    return _hash("\n".join(sorted(entries)))


def _references(function: Any) -> Iterator[tuple[str, Any]]:
    """Yield names and values of the globals and cells that a function's code may read."""
    names = sorted(_read_names(function.__code__))
    values = {name: function.__globals__[name] for name in names if name in function.__globals__}
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or ()):
        with contextlib.suppress(ValueError):  # not filled yet
            values[name] = cell.cell_contents
    for name, value in values.items():
        yield name, value
        yield from _attributes(name, value, names)


def _attributes(name: str, value: Any, names: list[str]) -> Iterator[tuple[str, Any]]:
    """Yield the attributes that code may read of a module, with the modules in it."""
    if isinstance(value, python_types.ModuleType) and not _is_foreign(value.__name__):
        for inner in names:
            if hasattr(value, inner):
                yield f"{name}.{inner}", getattr(value, inner)
                yield from _attributes(f"{name}.{inner}", getattr(value, inner), [n for n in names if n != inner])


def _describe_value(value: Any) -> tuple[str, list[Any]]:
    """Return the description of a value that code freezes, and the values that it refers to."""
    if isinstance(value, bool | int | float | complex | str | bytes | np.generic | np.dtype | types.Type | None):
        return f"{type(value).__name__} {value!r}", []
    if isinstance(value, np.ndarray):
        return f"{value.dtype!r} {value.shape} {_hash(value.tobytes())}", []
    if isinstance(value, tuple | list):
        return f"{type(value).__name__} {len(value)}", list(value)
    if isinstance(value, type):
        return _class_name(value), []
    if defined := getattr(value, "_defn", None):  # an intrinsic
        return f"intrinsic {value}", [defined]
    return f"{type(value).__module__}.{type(value).__qualname__}", []


def _class_name(kind: type) -> str:
    return f"{kind.__module__}.{kind.__qualname__} {getattr(kind, '_fields', ())}"


def _type_name(kind: Any) -> str:
    """Return an argument type's description: numba's name, fields of named tuples, the file of a type of ours."""
    parts = [str(kind)]
    if isinstance(kind, types.Dispatcher):
        return digest(kind.dispatcher)
    if isinstance(kind, types.BaseNamedTuple):
        parts.append(_class_name(kind.__dict__["instance_class"]))
    if not _is_foreign(type(kind).__module__):
        parts.append(_file_digest(type(kind).__module__))
    inner = getattr(kind, "types", ())
    return " ".join(parts + [_type_name(each) for each in inner if isinstance(each, types.Type)])


def _is_foreign(module: str | None) -> bool:
    return (module or "").partition(".")[0] in _BY_NAME


def _options(dispatcher: Any) -> str:
    return repr(sorted((name, _plain(value)) for name, value in dispatcher.targetoptions.items()))


def _plain(value: Any) -> str:
    return repr(sorted(value)) if isinstance(value, set | frozenset) else repr(value)


def _read_names(code: python_types.CodeType) -> set[str]:
    """Return the names that code reads, those of functions inside it too."""
    inner = (_read_names(each) for each in code.co_consts if isinstance(each, python_types.CodeType))
    return set(code.co_names).union(*inner)


def _code_digest(code: python_types.CodeType) -> str:
    """Return the digest of bytecode, without line numbers and docstrings."""
    consts = list(code.co_consts)
    documented = sys.version_info < (3, 13) or code.co_flags & 0x4000000  # CO_HAS_DOCSTRING
    if consts and isinstance(consts[0], str) and documented and not code.co_name.startswith("<"):
        consts[0] = ""
    plain = [_code_digest(each) if isinstance(each, python_types.CodeType) else _plain(each) for each in consts]
    parts = (code.co_code, code.co_names, code.co_varnames, code.co_freevars, code.co_argcount, code.co_exceptiontable)
    return _hash(repr((*parts, plain)))


@cache
def _file_digest(module: str | None) -> str:
    """Return the digest of a module's file, without comments and docstrings."""
    path = getattr(sys.modules.get(module or ""), "__file__", None)
    if path is None or not path.endswith(".py"):
        return ""
    return _code_digest(compile(Path(path).read_text(encoding="utf-8"), "", "exec", dont_inherit=True))


def _hash(text: str | bytes) -> str:
    return hashlib.sha256(text if isinstance(text, bytes) else text.encode()).hexdigest()
