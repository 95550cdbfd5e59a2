"""MuJoCo's library for compiled code: functions by name, offsets of structure fields, and arrays at addresses."""

from __future__ import annotations

import ctypes
from collections.abc import Iterable
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
    "CONTACT_SIZE", "LIBRARY", "doubles", "external", "field", "integers", "offsets_of", "pointer",
]  # fmt: skip

_FILES = sorted(p for p in Path(mujoco.__file__).parent.iterdir() if p.name.startswith(("libmujoco", "mujoco.dll")))
LIBRARY = ctypes.CDLL(
    str(next((p for p in _FILES if mujoco.mj_versionString() in p.name), _FILES[0]))  # others may be left there
)  # The MuJoCo library that the Python module has loaded


def external(name: str, *arguments: Any) -> Any:
    """Return a function of the library, without a result, for compiled code.

    Code that is cached between sessions refers to it by name, not by address.
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
    fields = [(field.name, _ctype(field.type)) for field in structs.STRUCTS[name].fields]
    return type(name, (ctypes.Structure,), {"_fields_": fields})


def _ctype(declaration: Any) -> Any:
    if isinstance(declaration, ast_nodes.PointerType):
        return ctypes.c_void_p
    if isinstance(declaration, ast_nodes.ArrayType):
        ctype = _ctype(declaration.inner_type)
        for extent in reversed(declaration.extents):
            ctype *= extent
        return ctype
    if isinstance(declaration, ast_nodes.AnonymousStructDecl):
        return type("inner", (ctypes.Structure,), {"_fields_": [(f.name, _ctype(f.type)) for f in declaration.fields]})
    name = declaration.name
    if name in structs.STRUCTS:
        return _structure(name)
    return _NUMBERS.get(name, ctypes.c_int)  # all others are enumerations


def _offsets(name: str) -> dict[str, int]:
    structure = _structure(name)
    return {field: getattr(structure, field).offset for field, _ in structure._fields_}


MODEL, OPTION, DATA, CONTACT = (_offsets(name) for name in ("mjModel", "mjOption", "mjData", "mjContact"))
"""Offsets of their fields, bytes"""
CONTACT_SIZE = ctypes.sizeof(_structure("mjContact"))


def offsets_of(
    data: Iterable[str], model: Iterable[str], options: Iterable[str], contact: Iterable[str] = ()
) -> dict[str, int]:  # fmt: skip
    """Return offsets of fields by their names, with d_, m_ or c_ before them; options are within the model."""
    return {
        **{f"d_{name}": DATA[name] for name in data},
        **{f"m_{name}": MODEL[name] for name in model},
        **{f"c_{name}": CONTACT[name] for name in contact},
        **{f"m_{name}": MODEL["opt"] + OPTION[name] for name in options},
    }


@intrinsic
def _to_pointer(_: Any, address: Any) -> Any:
    """An address as a pointer."""

    def generate(context: Any, builder: Any, __: Any, values: Any) -> Any:
        return builder.inttoptr(values[0], cgutils.voidptr_t)

    return types.voidptr(types.intp), generate


pointer: Any = _to_pointer  # Address as a pointer, for compiled code


@jit(**OPTIONS)
def doubles(address: int, n: int) -> np.ndarray:
    """Return n doubles at an address."""
    return numba.carray(pointer(address), n, np.float64)


@jit(**OPTIONS)
def integers(address: int, n: int) -> np.ndarray:
    """Return n 32-bit integers at an address."""
    return numba.carray(pointer(address), n, np.int32)


@jit(**OPTIONS)
def field(address: int) -> int:
    """Return the pointer stored at an address."""
    return numba.carray(pointer(address), 1, np.int64)[0]
