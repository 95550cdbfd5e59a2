"""One-line messages for invalid values: where, which value, which rule; and the descriptions of fields."""

from __future__ import annotations

import ast
import dataclasses
import difflib
import functools
import inspect
import textwrap
import types
import typing
from collections.abc import Callable
from itertools import pairwise
from typing import Annotated, Any

from pydantic import ValidationError

__all__ = ["WORDS", "descriptions", "either", "message", "names_of", "shown", "wrong_type"]


def message(error: ValidationError, kind: Any, where: str) -> str:
    """Return one line on the first fault: of unknown keys, or else of the fields in their order."""
    errors = error.errors(include_url=False)
    first = next((e for e in errors if e["type"] in _UNKNOWN), errors[0])
    *above, last = first["loc"] or (None,)
    path = _path(where, first["loc"])
    holder, field = _field_type(kind, above), _field_type(kind, first["loc"])
    rule, context, value = first["type"], first.get("ctx", {}), first["input"]
    if rule in _UNKNOWN:
        return f"{path} is not a known key; known: {', '.join(names_of(holder))}{_closest(last, names_of(holder))}"
    if rule == "value_error":
        text = str(context["error"])
        names = getattr(context["error"], "names", None) or names_of(field)
        return f"{path}{_separator(path, text, names)}{text}"
    if typing.get_origin(holder) is tuple and rule == "missing":  # a list that is too short
        return wrong_type(_path(where, above), holder, value)
    if rule == "missing":
        return f"{path} is missing"
    if rule == "string_too_short":
        return f"{path} must not be empty"
    if rule == "too_short":
        return f"{path} must hold {context['min_length']} or more, got {context['actual_length'] or 'none'}"
    if rule == "literal_error":
        use = either(map(str, typing.get_args(field)))
        return f'{path} "{value}" is unknown; use {use}' if isinstance(value, str) else wrong_type(path, str, value)
    if rule in _RULES:
        return f"{path} must be {_RULES[rule].format(**context)}, got {value:.10g}{_description(holder, last)}"
    return wrong_type(path, field, value) or f"{path}: {first['msg']}, got {shown(value)}"


_UNKNOWN = ("extra_forbidden", "unexpected_keyword_argument")
_RULES = {
    "greater_than": "> {gt:.10g}", "greater_than_equal": ">= {ge:.10g}", "less_than": "< {lt:.10g}",
    "less_than_equal": "<= {le:.10g}", "finite_number": "finite",
}  # fmt: skip
WORDS = {
    float: "a plain number in SI units", int: "a whole number", str: "a string", bool: "true or false",
    dict: "a table of keys",
}  # fmt: skip


def either(names: typing.Iterable[str]) -> str:
    """Write names as "a, b or c"."""
    *others, other = names
    return f"{', '.join(others)} or {other}" if others else other


def shown(value: object) -> str:
    """Write a value, the first part of a long one."""
    text = repr(value)
    return text if len(text) < 200 else f"{text[:150]} ..."


def _path(where: str, steps: typing.Iterable[int | str | None]) -> str:
    """Write a place as bushings[0].gap."""
    text = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in steps if step is not None)
    return f"{where}{text}" if where else text.lstrip(".")


def _separator(path: str, text: str, names: list[str]) -> str:
    """Return the separator between a path and a text that may begin with the name of a field of it."""
    if not path:
        return ""
    name = next((n for n in names if text.startswith(n) and not text[len(n) : len(n) + 1].isidentifier()), None)
    return "." if name else ": " if names else " "


def _bare_type(kind: Any) -> Any:
    """Return a type without its rules and without None."""
    if typing.get_origin(kind) is Annotated:
        return _bare_type(typing.get_args(kind)[0])
    if typing.get_origin(kind) in (types.UnionType, typing.Union):
        parts = [part for part in typing.get_args(kind) if part is not types.NoneType]
        return _bare_type(parts[0]) if len(parts) == 1 else kind
    return kind


def _field_type(kind: Any, steps: typing.Iterable[int | str]) -> Any:
    """Return the type of a part of a type; None if there is none."""
    kind = _bare_type(kind)
    for step in steps:
        arguments = typing.get_args(kind)
        if dataclasses.is_dataclass(kind):
            kind = _hints(kind).get(step)
        elif typing.get_origin(kind) is tuple and arguments and isinstance(step, int):
            kind = arguments[0] if arguments[-1] is Ellipsis else arguments[min(step, len(arguments) - 1)]
        else:
            return None
        kind = _bare_type(kind)
    return kind


_hints: Callable[[Any], dict[Any, Any]] = functools.cache(functools.partial(typing.get_type_hints, include_extras=True))


def names_of(kind: Any) -> list[str]:
    """Return the names of a dataclass's fields; none of other types."""
    return [f.name for f in dataclasses.fields(kind) if f.init] if dataclasses.is_dataclass(kind) else []


def _closest(key: object, names: list[str]) -> str:
    close = difflib.get_close_matches(str(key), names, 1)
    return f"; did you mean {close[0]}?" if close else ""


def wrong_type(path: str, kind: Any, value: object) -> str:
    """Return what a value of a type must be; nothing if it has no name."""
    arguments = typing.get_args(kind)
    if dataclasses.is_dataclass(kind):
        words = WORDS[dict]
    elif typing.get_origin(kind) is not tuple:
        words = WORDS.get(typing.get_origin(kind) or kind, "")
    elif arguments[-1] is not Ellipsis:
        words = f"a list of {len(arguments)} numbers"
    else:
        words = f"a list of tables ([[{path}]])" if dataclasses.is_dataclass(_bare_type(arguments[0])) else "a list"
    return words and f"{path} must be {words}, got {shown(value)}"


def _description(kind: Any, name: object) -> str:
    """Return the description of a field, in brackets."""
    words = descriptions(kind).get(str(name)) if isinstance(kind, type) and dataclasses.is_dataclass(kind) else None
    return f" ({words.partition(';')[0]})" if words else ""


@functools.cache
def descriptions(kind: type) -> dict[str, str]:
    """Return what a `checked` class says of its fields: the strings that follow them.

    Read when they are asked for; pydantic would read every class's source at import.
    """
    texts: dict[str, str] = {}
    for base in (base for base in reversed(kind.__mro__) if dataclasses.is_dataclass(base)):
        try:
            body = ast.parse(textwrap.dedent(inspect.getsource(base))).body[0]
        except OSError:  # typed at a prompt
            continue
        assert isinstance(body, ast.ClassDef)
        for field, words in pairwise(body.body):
            match field, words:
                case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(text))):
                    texts[name] = inspect.cleandoc(text)
    return texts
