"""Numbers of compiled loops that stand for one case, or for several side by side in a SIMD register.

A loop is given ``lanes``, the tuple (0, 1, ... n-1). Its arrays are contiguous, with the lanes as their last axis. For
n = 1 the numbers that it loads are plain ones, otherwise registers of n numbers, for which + - * / and `larger` are
defined: one source serves single simulations and batches of them.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, models, overload, register_model

__all__ = ["larger", "load", "spread", "store"]


class _Register(types.Type):
    def __init__(self, count: int):
        self.count = count
        super().__init__(name=f"Register({count})")


@register_model(_Register)
class _RegisterModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: _Register):
        super().__init__(manager, kind, ir.VectorType(ir.DoubleType(), kind.count))


def _number(lanes: Any) -> types.Type:
    return types.float64 if lanes.count == 1 else _Register(lanes.count)


def _pointer(context: Any, builder: Any, signature: Any, values: Any) -> Any:
    """Where the numbers of an array's row begin, row i at i times the number of lanes."""
    view, count = context.make_array(signature.args[0])(context, builder, values[0]), signature.args[-1].count
    place = builder.gep(view.data, [builder.mul(values[1], ir.Constant(values[1].type, count))])
    return place if count == 1 else builder.bitcast(place, context.get_value_type(_Register(count)).as_pointer())


@intrinsic
def _load(_: Any, array: Any, row: Any, lanes: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.load(_pointer(context, builder, signature, values), align=8)

    return _number(lanes)(array, types.intp, lanes), generate


@intrinsic
def _store(_: Any, array: Any, row: Any, number: Any, lanes: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        builder.store(values[2], _pointer(context, builder, signature, values), align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, _number(lanes), lanes), generate


@intrinsic
def _spread(_: Any, number: Any, lanes: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return _in_all_lanes(builder, values[0], lanes.count)

    return _number(lanes)(types.float64, lanes), generate


def _in_all_lanes(builder: Any, number: Any, count: int) -> Any:
    if count == 1:
        return number
    nothing = ir.Constant(ir.VectorType(ir.DoubleType(), count), ir.Undefined)
    first = builder.insert_element(nothing, number, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, nothing, ir.Constant(ir.VectorType(ir.IntType(32), count), [0] * count))


load: Any = _load
"""load(array, row, lanes): the numbers in a row of an array"""
store: Any = _store
"""store(array, row, numbers, lanes)"""
spread: Any = _spread
"""spread(number, lanes): one number for all lanes"""


def larger(a: Any, b: Any) -> Any:
    """The larger of two numbers, lane by lane; for compiled code."""
    return max(a, b)


@overload(larger, inline="always")
def _larger_of_plain_numbers(a, b):  # type: ignore[no-untyped-def]
    if not isinstance(a, _Register) and not isinstance(b, _Register):
        return lambda a, b: max(a, b)
    return None


def _define(function: Callable[..., Any], generate_one: Callable[..., Any]) -> None:
    """Let a function of two numbers work on registers; a plain number stands in all lanes."""

    @intrinsic
    def operate(_: Any, a: Any, b: Any) -> Any:
        kind = a if isinstance(a, _Register) else b

        def generate(_: Any, builder: Any, signature: Any, values: Any) -> Any:
            pairs = zip(values, signature.args)
            both = [v if k == kind else _in_all_lanes(builder, v, kind.count) for v, k in pairs]
            return generate_one(builder, *both)

        return kind(*(k if k == kind else types.float64 for k in (a, b))), generate

    @overload(function, inline="always")
    def of_registers(a, b):  # type: ignore[no-untyped-def]
        if isinstance(a, _Register) or isinstance(b, _Register):
            return lambda a, b: operate(a, b)
        return None


_define(operator.add, lambda builder, a, b: builder.fadd(a, b))
_define(operator.iadd, lambda builder, a, b: builder.fadd(a, b))
_define(operator.sub, lambda builder, a, b: builder.fsub(a, b))
_define(operator.mul, lambda builder, a, b: builder.fmul(a, b))
_define(operator.truediv, lambda builder, a, b: builder.fdiv(a, b))
_define(larger, lambda builder, a, b: builder.select(builder.fcmp_ordered(">", a, b), a, b))
