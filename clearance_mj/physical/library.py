"""MuJoCo's library for compiled code: its functions by name, and where its structures keep their fields;
addresses as arrays.
"""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite.binding
import mujoco
import numba
import numpy as np
from mujoco.introspect import ast_nodes, structs
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from ..core.jit import OPTIONS, jit

__all__ = [
    "CONTACT", "CONTACT_SIZE", "DATA", "LIBRARY", "MODEL", "OPTION", "doubles", "external", "field", "integers",
    "pointer",
]  # fmt: skip

_FILES = sorted(p for p in Path(mujoco.__file__).parent.iterdir() if p.name.startswith(("libmujoco", "mujoco.dll")))
LIBRARY = ctypes.CDLL(
    str(next((p for p in _FILES if mujoco.mj_versionString() in p.name), _FILES[0]))  # another may have stayed behind
)  # The MuJoCo library that the Python module has loaded


def external(name: str, *arguments: Any) -> Any:
    """Return a function of the library, without a result, for compiled code.

    Code that is cached between sessions knows it by name and not by address.
    """
    llvmlite.binding.add_symbol(name, ctypes.cast(getattr(LIBRARY, name), ctypes.c_void_p).value)
    return numba.types.ExternalFunction(name, numba.types.void(*arguments))


_NUMBERS: dict[str, Any] = {
    "mjtNum": ctypes.c_double, "mjtSize": ctypes.c_int64, "mjtBool": ctypes.c_bool, "mjtByte": ctypes.c_uint8,
    "int": ctypes.c_int, "float": ctypes.c_float, "char": ctypes.c_char, "unsigned char": ctypes.c_ubyte,
    "size_t": ctypes.c_size_t, "uint64_t": ctypes.c_uint64, "uintptr_t": ctypes.c_size_t,
}  # fmt: skip


@cache
def _structure(name: str) -> Any:
    fields = [(field.name, _kind(field.type)) for field in structs.STRUCTS[name].fields]
    return type(name, (ctypes.Structure,), {"_fields_": fields})


def _kind(declared: Any) -> Any:
    if isinstance(declared, ast_nodes.PointerType):
        return ctypes.c_void_p
    if isinstance(declared, ast_nodes.ArrayType):
        kind = _kind(declared.inner_type)
        for extent in reversed(declared.extents):
            kind *= extent
        return kind
    if isinstance(declared, ast_nodes.AnonymousStructDecl):
        return type("inner", (ctypes.Structure,), {"_fields_": [(f.name, _kind(f.type)) for f in declared.fields]})
    name = declared.name
    if name in structs.STRUCTS:
        return _structure(name)
    return _NUMBERS.get(name, ctypes.c_int)  # what is left are enumerations


def _offsets(name: str) -> dict[str, int]:
    whole = _structure(name)
    return {field: getattr(whole, field).offset for field, _ in whole._fields_}


MODEL, OPTION, DATA, CONTACT = (_offsets(name) for name in ("mjModel", "mjOption", "mjData", "mjContact"))
"""Offsets of their fields, bytes"""
CONTACT_SIZE = ctypes.sizeof(_structure("mjContact"))


@intrinsic
def _to_pointer(_: Any, place: Any) -> Any:
    """An address as a pointer."""

    def generate(context: Any, builder: Any, __: Any, values: Any) -> Any:
        return builder.inttoptr(values[0], cgutils.voidptr_t)

    return types.voidptr(types.intp), generate


pointer: Any = _to_pointer  # Address as a pointer, for compiled code


@jit(**OPTIONS)
def doubles(place: int, n: int) -> np.ndarray:
    """Numbers of 8 bytes at an address."""
    return numba.carray(pointer(place), n, np.float64)


@jit(**OPTIONS)
def integers(place: int, n: int) -> np.ndarray:
    """Integers of 4 bytes at an address."""
    return numba.carray(pointer(place), n, np.int32)


@jit(**OPTIONS)
def field(place: int) -> int:
    """A pointer that a structure holds."""
    return numba.carray(pointer(place), 1, np.int64)[0]
