"""Numbers of compiled loops: of one case, or of several side by side in a SIMD register.

A loop is given ``lanes``, the tuple (0, 1, ... n-1). Its arrays are contiguous, with the lanes as their last axis. For
n = 1 it loads plain numbers, otherwise registers of n numbers, for which + - * / and the functions of `lanes` are
defined: one source serves single simulations and batches of them. `packed` numbers of one case are in registers of
four.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, models, overload, register_model

__all__ = [
    "Register", "block", "contact_law_of", "define", "filling_law_of", "in_all_lanes", "joined", "load", "packed",
    "spread", "store", "wall_law_of",
]  # fmt: skip


class Register(types.Type):
    """Type of as many numbers as there are lanes."""

    def __init__(self, count: int):
        self.count = count
        super().__init__(name=f"Register({count})")


@register_model(Register)
class _RegisterModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Register):
        super().__init__(manager, kind, ir.VectorType(ir.DoubleType(), kind.count))


def _number(lanes: Any) -> types.Type:
    return types.float64 if lanes.count == 1 else Register(lanes.count)


def _pointer(context: Any, builder: Any, signature: Any, values: Any) -> Any:
    """Return the pointer to an array's row, row i at i times the number of lanes."""
    view, count = context.make_array(signature.args[0])(context, builder, values[0]), signature.args[-1].count
    pointer = builder.gep(view.data, [builder.mul(values[1], ir.Constant(values[1].type, count))])
    return pointer if count == 1 else builder.bitcast(pointer, context.get_value_type(Register(count)).as_pointer())


@intrinsic
def _load(_: Any, array: Any, row: Any, lanes: Any) -> Any:
    """Return the numbers in a row of an array: load(array, row, lanes)."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.load(_pointer(context, builder, signature, values), align=8)

    return _number(lanes)(array, types.intp, lanes), generate


@intrinsic
def _store(_: Any, array: Any, row: Any, number: Any, lanes: Any) -> Any:
    """Store numbers in a row of an array: store(array, row, numbers, lanes)."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        builder.store(values[2], _pointer(context, builder, signature, values), align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, _number(lanes), lanes), generate


@intrinsic
def _spread(_: Any, number: Any, lanes: Any) -> Any:
    """Return one number for all lanes: spread(number, lanes)."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return in_all_lanes(builder, values[0], lanes.count)

    return _number(lanes)(types.float64, lanes), generate


def in_all_lanes(builder: Any, number: Any, count: int) -> Any:
    """Return the instruction that spreads a number over a register."""
    if count == 1:
        return number
    nothing = ir.Constant(ir.VectorType(ir.DoubleType(), count), ir.Undefined)
    first = builder.insert_element(nothing, number, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, nothing, ir.Constant(ir.VectorType(ir.IntType(32), count), [0] * count))


load: Any = _load
store: Any = _store
spread: Any = _spread


def define(function: Callable[..., Any], generate_one: Callable[..., Any]) -> None:
    """Define a function of two numbers for registers; a plain number is repeated in all lanes."""

    @intrinsic
    def operate(_: Any, a: Any, b: Any) -> Any:
        kind = a if isinstance(a, Register) else b

        def generate(_: Any, builder: Any, signature: Any, values: Any) -> Any:
            pairs = zip(values, signature.args)
            operands = [v if k == kind else in_all_lanes(builder, v, kind.count) for v, k in pairs]
            return generate_one(builder, *operands)

        return kind(*(k if k == kind else types.float64 for k in (a, b))), generate

    @overload(function)
    def of_registers(a, b):  # type: ignore[no-untyped-def]
        if isinstance(a, Register) or isinstance(b, Register):
            return lambda a, b: operate(a, b)
        return None


define(operator.add, lambda builder, a, b: builder.fadd(a, b))
define(operator.iadd, lambda builder, a, b: builder.fadd(a, b))
define(operator.sub, lambda builder, a, b: builder.fsub(a, b))
define(operator.mul, lambda builder, a, b: builder.fmul(a, b))
define(operator.truediv, lambda builder, a, b: builder.fdiv(a, b))


class _Rows(types.Type):
    """Type of a pointer to the numbers of all lanes, row after row, indexed by laws."""

    def __init__(self, count: int):
        self.count = count
        super().__init__(name=f"Rows({count})")


@register_model(_Rows)
class _RowsModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: _Rows):
        super().__init__(manager, kind, ir.VectorType(ir.DoubleType(), kind.count).as_pointer())


@intrinsic
def _get(_: Any, numbers: Any, row: Any) -> Any:
    def generate(_: Any, builder: Any, __: Any, values: Any) -> Any:
        register = builder.load(builder.gep(values[0], [values[1]]), align=8)
        return builder.extract_element(register, ir.IntType(32)(0)) if numbers.count == 1 else register

    return _number(numbers)(numbers, types.intp), generate


@intrinsic
def _set(_: Any, numbers: Any, row: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, __: Any, values: Any) -> Any:
        builder.store(values[2], builder.gep(values[0], [values[1]]), align=8)
        return context.get_dummy_value()

    return types.void(numbers, types.intp, Register(numbers.count)), generate


@overload(operator.getitem)
def _get_row(numbers, row):  # type: ignore[no-untyped-def]
    return (lambda numbers, row: _get(numbers, row)) if isinstance(numbers, _Rows) else None


@overload(operator.setitem)
def _set_row(numbers, row, value):  # type: ignore[no-untyped-def]
    return (lambda numbers, row, value: _set(numbers, row, value)) if isinstance(numbers, _Rows) else None


@intrinsic
def _block(_: Any, array: Any, row: Any, lanes: Any) -> Any:
    """Return the pointer to a law's numbers from a row on: block(array, row, lanes)."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        view, count = context.make_array(signature.args[0])(context, builder, values[0]), lanes.count
        pointer = builder.gep(view.data, [builder.mul(values[1], ir.Constant(values[1].type, count))])
        return pointer if count == 1 else builder.bitcast(pointer, context.get_value_type(_Rows(count)))

    return _numbers(lanes.count)(array, types.intp, lanes), generate


def _numbers(count: int) -> types.Type:
    return types.CPointer(types.float64) if count == 1 else _Rows(count)


def filling_law_of(coordinates: int, count: int) -> Any:
    """Return the signature of a filling's law of one coordinate or two on ``count`` lanes."""
    numbers, number = _numbers(count), _number(types.UniTuple(types.intp, count))
    vector = types.UniTuple(number, coordinates)
    return types.void(numbers, numbers, vector, vector, number, types.float64, numbers)


def contact_law_of(count: int) -> Any:
    """Return the signature of a contact's law on ``count`` lanes."""
    numbers, number = _numbers(count), _number(types.UniTuple(types.intp, count))
    return types.void(numbers, number, number, number, numbers)


def wall_law_of(count: int) -> Any:
    """Return the signature of a wall's law on ``count`` lanes."""
    numbers, number = _numbers(count), _number(types.UniTuple(types.intp, count))
    return types.void(numbers, types.UniTuple(number, 2), numbers)


def packed(lanes):  # type: ignore[no-untyped-def]
    """Return the lanes of modes and rows: those of the cases, or, for one case, four side by side."""
    return (0, 1, 2, 3) if len(lanes) == 1 else lanes


@overload(packed)
def _packed(lanes):  # type: ignore[no-untyped-def]
    return (lambda lanes: (0, 1, 2, 3)) if lanes.count == 1 else (lambda lanes: lanes)


@intrinsic
def _sum_parts(_: Any, a: Any, lanes: Any) -> Any:
    """Return the sum of the four parts of one case's number, or the numbers of several cases unchanged."""

    def generate(_: Any, builder: Any, signature: Any, values: Any) -> Any:
        if lanes.count > 1:
            return values[0]
        parts = [builder.extract_element(values[0], ir.IntType(32)(i)) for i in range(a.count)]
        return builder.fadd(builder.fadd(parts[0], parts[1]), builder.fadd(parts[2], parts[3]))

    return (types.float64 if lanes.count == 1 else a)(a, lanes), generate


block: Any = _block
joined: Any = _sum_parts
