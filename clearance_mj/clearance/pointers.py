"""Compiled functions of contact and grease models, called by address from compiled loops.

An address is a number in a record, so that one compiled loop, cached on disk, runs any model at each bushing.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from ..core.jit import OPTIONS, jit

_NUMBER, _NUMBERS = types.float64, types.CPointer(types.float64)
CONTACT_ENERGY = types.float64(_NUMBERS, _NUMBER)
FILLING_ENERGIES = {
    d: types.void(_NUMBERS, _NUMBERS, _NUMBERS, *[types.UniTuple(_NUMBER, d)] * 2, _NUMBERS) for d in (1, 2)
}
"""by number of coordinates"""

_COMPILED: dict[tuple[Callable[..., Any], Any], tuple[int, Any]] = {}


def address(function: Callable[..., Any], signature: Any) -> int:
    """Return the address of a function, compiled at its first use and cached on disk if it is in a file."""
    if (function, signature) not in _COMPILED:
        compiled = jit(function, **OPTIONS)
        compiled.compile(signature)
        entry = compiled.overloads[signature.args]
        pointer = entry.library.get_pointer_to_function(entry.fndesc.llvm_func_name)
        _COMPILED.setdefault((function, signature), (pointer, compiled))  # one for all threads, never freed
    return _COMPILED[function, signature][0]


def caller(signature: Any) -> Any:
    """Return a function for compiled code that calls the compiled function of the signature at an address."""

    @intrinsic
    def call(_: Any, where: Any, *arguments: Any) -> Any:
        """Call the compiled function at an address."""

        def generate(context: Any, builder: Any, __: Any, values: Any) -> Any:
            convention = context.call_conv
            kind = convention.get_function_type(signature.return_type, signature.args)
            function = builder.inttoptr(values[0], kind.as_pointer())
            passed = cgutils.unpack_tuple(builder, values[1])
            _, result = convention.call_function(builder, function, signature.return_type, signature.args, passed)
            return result

        return signature.return_type(where, types.StarArgTuple(signature.args)), generate

    return call


call_contact_energy = caller(CONTACT_ENERGY)


@intrinsic
def _call(_: Any, where: Any, *arguments: Any) -> Any:
    """Call the law of a contact or a grease, of numbers or of lanes: call_law(address, *arguments)."""
    kind = types.void(*arguments)

    def generate(context: Any, builder: Any, __: Any, values: Any) -> Any:
        convention = context.call_conv
        function = builder.inttoptr(values[0], convention.get_function_type(kind.return_type, kind.args).as_pointer())
        passed = cgutils.unpack_tuple(builder, values[1])
        convention.call_function(builder, function, kind.return_type, kind.args, passed)
        return context.get_dummy_value()

    return types.void(where, types.StarArgTuple(kind.args)), generate


call_law: Any = _call


@intrinsic
def _at(_: Any, numbers: Any, index: Any) -> Any:
    """Return the pointer to the number at an index of a contiguous array."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        view = context.make_array(signature.args[0])(context, builder, values[0])
        return builder.gep(view.data, [values[1]])

    return _NUMBERS(numbers, types.intp), generate


at: Any = _at
