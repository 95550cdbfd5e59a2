"""Vectors of one or two coordinates as tuples, so that a law is written once for both.

The motion in a slot or at a stop has one coordinate, the displacement along it; that in a round clearance has two,
along y and z. Each number may be plain, or one of all lanes (see lanes.py).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import types
from numba.extending import overload

from .lanes import choose, larger, root, smaller

__all__ = [
    "TINY", "along", "answer", "answer_film", "in_plane", "length", "minus", "of_one_or_two", "plus", "read", "times",
    "within", "write",
]  # fmt: skip

TINY = 1e-300  # added to lengths against division by 0


def of_one_or_two(one: Callable[..., Any], two: Callable[..., Any], says: str = "") -> Any:
    """Return a function that calls ``one`` for vectors of one coordinate and ``two`` for others, compiled or not.

    ``says`` is its docstring.
    """

    def function(*arguments: Any) -> Any:
        size = next(len(argument) for argument in arguments if isinstance(argument, tuple))
        return (one if size == 1 else two)(*arguments)

    def compiled(*kinds: Any) -> Any:
        sizes = [len(kind) for kind in kinds if isinstance(kind, types.BaseTuple)]
        return (one if sizes[0] == 1 else two) if sizes else None

    overload(function, strict=False)(compiled)
    function.__doc__ = says
    return function


plus = of_one_or_two(lambda a, b: (a[0] + b[0],), lambda a, b: (a[0] + b[0], a[1] + b[1]), "The sum of two vectors.")
minus = of_one_or_two(
    lambda a, b: (a[0] - b[0],), lambda a, b: (a[0] - b[0], a[1] - b[1]), "The difference of two vectors."
)
times = of_one_or_two(
    lambda factor, r: (factor * r[0],), lambda factor, r: (factor * r[0], factor * r[1]), "A number times a vector."
)
along = of_one_or_two(
    lambda a, b: a[0] * b[0], lambda a, b: a[0] * b[0] + a[1] * b[1], "The scalar product of two vectors."
)
length = of_one_or_two(lambda r: abs(r[0]), lambda r: root(r[0] * r[0] + r[1] * r[1]), "The length of a vector.")
read = of_one_or_two(
    lambda state, i, like: (state[i],),
    lambda state, i, like: (state[2 * i], state[2 * i + 1]),
    "The vector number i of those that a state is of: read(state, i, like), with any vector of as many coordinates.",
)


def _write_one(state: Any, i: int, r: Any) -> None:
    state[i] = r[0]


def _write_two(state: Any, i: int, r: Any) -> None:
    state[2 * i] = r[0]
    state[2 * i + 1] = r[1]


write = of_one_or_two(_write_one, _write_two, "Put a vector in the place of number i of a state: write(state, i, r).")


def _within_one(r: Any, limit: Any) -> Any:
    return (smaller(larger(r[0], 0.0 - limit), limit),)


def _within_two(r: Any, limit: Any) -> Any:
    size = root(r[0] * r[0] + r[1] * r[1])
    excess, size = size - limit, larger(size, TINY)
    return choose(r[0] * limit / size, r[0], excess), choose(r[1] * limit / size, r[1], excess)


within = of_one_or_two(
    _within_one,
    _within_two,
    "A vector, or if it is longer than a limit, one of that length in its direction: within(r, limit).",
)
in_plane = of_one_or_two(
    lambda r: (0.0 * r[0], r[0]), lambda r: r, "A vector as one along y and z: one of one coordinate is along z."
)


def _write_result_one(out: Any, force: Any, damping: Any) -> None:
    out[0] = force[0]
    out[1] = damping


def _write_result_two(out: Any, force: Any, damping: Any) -> None:
    out[0] = force[0]
    out[1] = force[1]
    out[2] = damping
    out[3] = 0.0 * damping
    out[4] = 0.0 * damping
    out[5] = damping


answer = of_one_or_two(
    _write_result_one,
    _write_result_two,
    "Fill in what a filling answers: its elastic force, and its damping, the same in all directions.",
)


def _film_one(out: Any, r: Any, f_y: Any, f_z: Any, yy: Any, yz: Any, zy: Any, zz: Any) -> None:
    out[0] = f_z
    out[1] = zz


def _film_two(out: Any, r: Any, f_y: Any, f_z: Any, yy: Any, yz: Any, zy: Any, zz: Any) -> None:
    out[0] = f_y
    out[1] = f_z
    out[2] = yy
    out[3] = yz
    out[4] = zy
    out[5] = zz


answer_film = of_one_or_two(
    _film_one,
    _film_two,
    "Fill in what a filling answers at r whose damping differs from direction to direction: yy, yz, zy, zz.",
)
