"""Functions of laws for plain numbers and for the lanes of a register: several cases side by side.

A law made of + - * /, abs and these functions, without branches, works on all lanes at once; see `registers`.
Called from Python it also works on JAX arrays, for the engine mjx.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.cgutils import get_or_insert_function
from numba.extending import intrinsic, overload, register_jitable

from .registers import Register, define, in_all_lanes

__all__ = [
    "all_below", "any_below", "choose", "exponential", "larger", "power", "root", "signed", "smaller", "where_above",
    "whole",
]  # fmt: skip


def _or_arrays(of_arrays: Callable[..., Any]) -> Callable[[Callable[..., Any]], Any]:
    """Add an implementation for arrays, called from Python, to a function of plain numbers; a decorator."""

    def decorate(function: Callable[..., Any]) -> Any:
        @functools.wraps(function)
        def of_any(*numbers: Any) -> Any:
            arrays = [n for n in numbers if hasattr(n, "__array_namespace__") and not isinstance(n, float)]
            return of_arrays(arrays[0].__array_namespace__(), *numbers) if arrays else function(*numbers)

        return of_any

    return decorate


def _of_plain_numbers(of_arrays: Callable[..., Any]) -> Callable[[Callable[..., Any]], Any]:
    """Register a function of two plain numbers for compiled code, and one of arrays for Python; a decorator."""

    def decorate(function: Callable[..., Any]) -> Any:
        of_any = _or_arrays(of_arrays)(function)

        @overload(of_any)
        def plain(a, b):  # type: ignore[no-untyped-def]
            return None if isinstance(a, Register) or isinstance(b, Register) else function

        return of_any

    return decorate


@_of_plain_numbers(lambda library, a, b: library.maximum(a, b))
def larger(a, b):  # type: ignore[no-untyped-def]
    """Return the larger of two numbers, lane by lane."""
    return max(a, b)


@_of_plain_numbers(lambda library, a, b: library.minimum(a, b))
def smaller(a, b):  # type: ignore[no-untyped-def]
    """Return the smaller of two numbers, lane by lane."""
    return min(a, b)


@_of_plain_numbers(lambda library, a, b: library.where(b > 0.0, a, 0.0))
def where_above(a, b):  # type: ignore[no-untyped-def]
    """Return the number a where b is above 0, and 0 elsewhere."""
    return a if b > 0.0 else 0.0


@_of_plain_numbers(lambda library, a, b: library.where(b > 0.0, a, -a))
def signed(a, b):  # type: ignore[no-untyped-def]
    """Return the number a where b is above 0, and -a elsewhere."""
    return a if b > 0.0 else -a


@_or_arrays(lambda library, a, b, c: library.where(c > 0.0, a, b))
def choose(a, b, c):  # type: ignore[no-untyped-def]
    """Return the number a where c is above 0, and b elsewhere."""
    return a if c > 0.0 else b


@_or_arrays(lambda library, a: library.sqrt(a))
def root(a):  # type: ignore[no-untyped-def]
    """Return the square root of a number that is not negative."""
    return math.sqrt(a)


@_of_plain_numbers(lambda library, a, b: True)  # as if one were below
def any_below(a, b):  # type: ignore[no-untyped-def]
    """Return True if a number a is below a plain number b in any lane; always True for arrays."""
    return a < b


@_of_plain_numbers(lambda library, a, b: library.all(a < b))
def all_below(a, b):  # type: ignore[no-untyped-def]
    """Return True if a number a is below a number b in all lanes; NaN is not."""
    return a < b


@_or_arrays(lambda library, a: library.exp(a))
def exponential(a):  # type: ignore[no-untyped-def]
    """Return e to the power of a number below 700; of registers to a relative error of 1e-14 down to -30."""
    return math.exp(a)


def whole(a):  # type: ignore[no-untyped-def]
    """Return a number that is whole and equal in all lanes as an integer."""
    return int(a)


@_of_plain_numbers(lambda library, a, b: library.power(a, b))
def power(a, b):  # type: ignore[no-untyped-def]
    """Return a number a, not negative, to the power b; of registers to a relative error of 1e-14."""
    return a * a if b == 2.0 else a**b


define(larger, lambda builder, a, b: builder.select(builder.fcmp_ordered(">", a, b), a, b))
define(smaller, lambda builder, a, b: builder.select(builder.fcmp_ordered("<", a, b), a, b))


def _define_one(generate_one: Callable[..., Any]) -> Any:
    """Return an intrinsic function from one register to another."""

    @intrinsic
    def operate(_: Any, a: Any) -> Any:
        def generate(_: Any, builder: Any, __: Any, values: Any) -> Any:
            return generate_one(builder, values[0], a.count)

        return (a(a), generate) if isinstance(a, Register) else None

    return operate


def _split_bits(builder: Any, number: Any, count: int) -> tuple[Any, Any]:
    """Return the bits of a register's numbers, and their exponents of 2 for mantissas between √½ and √2."""
    whole = ir.VectorType(ir.IntType(64), count)
    bits = builder.bitcast(number, whole)
    half = ir.Constant(whole, [0x3FE6A09E667F3BCD] * count)
    return bits, builder.ashr(builder.sub(bits, half), ir.Constant(whole, [52] * count))


def _exponent_bits(builder: Any, number: Any, count: int) -> Any:
    return builder.sitofp(_split_bits(builder, number, count)[1], ir.VectorType(ir.DoubleType(), count))


def _rest_bits(builder: Any, number: Any, count: int) -> Any:
    bits, exponent = _split_bits(builder, number, count)
    shifted = builder.shl(exponent, ir.Constant(exponent.type, [52] * count))
    return builder.bitcast(builder.sub(bits, shifted), ir.VectorType(ir.DoubleType(), count))


def _round(builder: Any, number: Any, count: int) -> Any:
    """Return the nearest whole numbers, for numbers above -2000."""
    real, whole = ir.VectorType(ir.DoubleType(), count), ir.VectorType(ir.IntType(64), count)
    above = builder.fadd(number, ir.Constant(real, [2000.5] * count))
    shifted = builder.sub(builder.fptosi(above, whole), ir.Constant(whole, [2000] * count))
    return builder.sitofp(shifted, real)


def _power_of_two(builder: Any, number: Any, count: int) -> Any:
    whole = ir.VectorType(ir.IntType(64), count)
    exponent = builder.add(builder.fptosi(number, whole), ir.Constant(whole, [1023] * count))
    return builder.bitcast(builder.shl(exponent, ir.Constant(whole, [52] * count)), number.type)


def _clear_sign(builder: Any, number: Any, count: int) -> Any:
    whole = ir.VectorType(ir.IntType(64), count)
    bits = builder.and_(builder.bitcast(number, whole), ir.Constant(whole, [2**63 - 1] * count))
    return builder.bitcast(bits, number.type)


_exponent_of, _rest_of, _nearest = (_define_one(g) for g in (_exponent_bits, _rest_bits, _round))
_two_to, _absolute = (_define_one(g) for g in (_power_of_two, _clear_sign))


def _zeros(like: Any) -> Any:
    return ir.Constant(like.type, [0.0] * like.type.count)


def _is_positive(builder: Any, number: Any) -> Any:
    return builder.fcmp_ordered(">", number, _zeros(number))


define(signed, lambda builder, a, b: builder.select(_is_positive(builder, b), a, builder.fsub(_zeros(a), a)))
define(where_above, lambda builder, a, b: builder.select(_is_positive(builder, b), a, _zeros(a)))


@intrinsic
def _choose(_: Any, a: Any, b: Any, c: Any) -> Any:
    kind = next(kind for kind in (a, b, c) if isinstance(kind, Register))

    def generate(_: Any, builder: Any, signature: Any, values: Any) -> Any:
        pairs = zip(values, signature.args)
        x, y, z = (v if k == kind else in_all_lanes(builder, v, kind.count) for v, k in pairs)
        return builder.select(_is_positive(builder, z), x, y)

    return kind(*(k if k == kind else types.float64 for k in (a, b, c))), generate


@overload(choose)
def _choose_of_any(a, b, c):  # type: ignore[no-untyped-def]
    if any(isinstance(kind, Register) for kind in (a, b, c)):
        return lambda a, b, c: _choose(a, b, c)
    return choose.__wrapped__


def _square_root(builder: Any, number: Any, count: int) -> Any:
    function = ir.FunctionType(number.type, [number.type])
    return builder.call(get_or_insert_function(builder.module, function, f"llvm.sqrt.v{count}f64"), [number])


_root = _define_one(_square_root)


@overload(root)
def _root_of_any(a):  # type: ignore[no-untyped-def]
    return (lambda a: _root(a)) if isinstance(a, Register) else root.__wrapped__


def _define_comparison(function: Callable[..., Any], of_all: bool) -> None:
    """Define "a below b" for a register a and a register or plain number b: in all lanes, or in any."""

    @intrinsic
    def below(_: Any, a: Any, b: Any) -> Any:
        def generate(_: Any, builder: Any, signature: Any, values: Any) -> Any:
            right = values[1] if signature.args[1] == a else in_all_lanes(builder, values[1], a.count)
            bits = builder.bitcast(builder.fcmp_ordered("<", values[0], right), ir.IntType(a.count))
            if of_all:
                return builder.icmp_unsigned("==", bits, bits.type(2**a.count - 1))
            return builder.icmp_unsigned("!=", bits, bits.type(0))

        return types.boolean(a, a if b == a else types.float64), generate

    @overload(function)
    def of_registers(a, b):  # type: ignore[no-untyped-def]
        return (lambda a, b: below(a, b)) if isinstance(a, Register) else None


_define_comparison(any_below, of_all=False)
_define_comparison(all_below, of_all=True)


@intrinsic
def _whole(_: Any, a: Any) -> Any:
    def generate(_: Any, builder: Any, __: Any, values: Any) -> Any:
        number = builder.extract_element(values[0], ir.IntType(32)(0)) if isinstance(a, Register) else values[0]
        return builder.fptosi(number, ir.IntType(64))

    return types.intp(a), generate


@overload(whole)
def _whole_of_any(a):  # type: ignore[no-untyped-def]
    return lambda a: _whole(a)


@overload(abs)
def _abs_of_registers(a):  # type: ignore[no-untyped-def]
    return (lambda a: _absolute(a)) if isinstance(a, Register) else None


@overload(power)
def _power_of_registers(a, b):  # type: ignore[no-untyped-def]
    """Implement 2^(b log2 a): log2 by the series of artanh, 2^f by that of exp, both to the last digit."""
    if not isinstance(a, Register):
        return None

    def of_registers(a, b):  # type: ignore[no-untyped-def]
        rest = _rest_of(a)
        s = (rest - 1.0) / (rest + 1.0)
        t = s * s
        t2 = t * t
        t4 = t2 * t2
        low = (1 / 3 + t * (1 / 5)) + t2 * (1 / 7 + t * (1 / 9))
        high = (1 / 11 + t * (1 / 13)) + t2 * (1 / 15 + t * (1 / 17))
        series = low + t4 * (high + t4 * (1 / 19 + t * (1 / 21)))
        log2 = _exponent_of(a) + 2.8853900817779268 * (s + s * t * series)
        return _exponential_2(larger(b * log2, -1020.0))

    return of_registers


@register_jitable
def _exponential_2(y):  # type: ignore[no-untyped-def]
    """Return 2^y of a register, by the series of e^f."""
    whole = _nearest(y)
    f = 0.6931471805599453 * (y - whole)
    f2 = f * f
    f4 = f2 * f2
    low = (1.0 + f) + f2 * (1 / 2 + f * (1 / 6))
    middle = (1 / 24 + f * (1 / 120)) + f2 * (1 / 720 + f * (1 / 5040))
    high = (1 / 40320 + f * (1 / 362880)) + f2 * (1 / 3628800 + f * (1 / 39916800))
    return _two_to(whole) * (low + f4 * (middle + f4 * (high + f4 * (1 / 479001600 + f * (1 / 6227020800)))))


@overload(exponential)
def _exponential_of_any(a):  # type: ignore[no-untyped-def]
    if isinstance(a, Register):
        return lambda a: _exponential_2(larger(1.4426950408889634 * a, -1020.0))
    return lambda a: math.exp(a)
