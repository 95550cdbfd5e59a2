"""Frozen data types whose values pydantic checks; errors in one line: where, which value, which rule.

A type is a class with annotated fields under `checked`. `Positive` and its kin are the fields' types; the strings that
follow the fields are their descriptions in JSON Schemas. Rules between fields are validators
(``@pydantic.model_validator(mode="after")``) that raise ValueError with a text that begins with the field's path.
"""

from __future__ import annotations

import ast
import dataclasses
import difflib
import functools
import inspect
import json
import textwrap
import tomllib
import types
import typing
from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeVar

import pydantic
from pydantic import ConfigDict, Field, ValidationError
from pydantic_core import core_schema

from .errors import ClearanceError

__all__ = [
    "Flag", "NotNegative", "Number", "OneOf", "Positive", "Registered", "Share", "Text", "Whole", "checked",
    "descriptions", "from_plain", "json_schema", "read_plain", "register", "to_plain",
]  # fmt: skip

Number = Annotated[float, Field(strict=True)]
"""Any finite number; a whole one counts, text and booleans do not."""
Positive = Annotated[float, Field(strict=True, gt=0)]
NotNegative = Annotated[float, Field(strict=True, ge=0)]
Share = Annotated[float, Field(strict=True, ge=0, le=1)]
Whole = Annotated[int, Field(strict=True)]
Text = Annotated[str, Field(strict=True)]
Flag = Annotated[bool, Field(strict=True)]

T = TypeVar("T")


@typing.dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field, Field))
def checked(
    error: type[ClearanceError], name: str | None = None, eq: bool = True, schema: dict[str, Any] | None = None
) -> Callable[[type[T]], type[T]]:
    """Make a class a frozen dataclass that checks its fields; a decorator.

    ``error`` is raised for values that no object can have; ``name`` is what messages call an object that is made by
    itself (default: the class's name in lower case); ``eq`` compares and hashes by values; ``schema`` is more for its
    JSON Schema: rules between fields.
    """

    def describe(found: dict[str, Any], kind: type) -> None:
        for field, words in descriptions(kind).items():
            found["properties"][field]["description"] = words
        found.update(schema or {})

    config = ConfigDict(
        extra="forbid",
        allow_inf_nan=False,
        arbitrary_types_allowed=True,
        json_schema_extra=describe,
    )

    def decorate(cls: type[T]) -> type[T]:
        made = pydantic.dataclasses.dataclass(frozen=True, eq=eq, config=config)(cls)
        where, names = cls.__name__.lower() if name is None else name, tuple(_names(made))

        def init(self: T, *args: Any, **kwargs: Any) -> None:
            # Values by name: pydantic takes them three times as fast as arguments by position.
            values = dict(zip(names, args)) | kwargs if args else kwargs
            if len(values) < len(args) + len(kwargs):
                raise error(f"{where or cls.__name__} takes each of {', '.join(names)} once")
            try:
                made.__pydantic_validator__.validate_python(values, self_instance=self)
            except ValidationError as found:
                raise error(_message(found, made, where)) from None

        made.__init__ = init  # type: ignore[method-assign, assignment]
        return made  # type: ignore[return-value]

    return decorate


class Registered:
    """What `register` knows by name: base of the kinds of models."""

    name: ClassVar[str]
    """in files and commands"""
    known: ClassVar[dict[str, Any]]
    """of the kind, by name"""
    refusal: ClassVar[type[ClearanceError]]
    """raised for values that no object can have"""
    called: ClassVar[str]
    """what messages call an object, with {name}"""


Model = TypeVar("Model", bound=Registered)


@typing.dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field, Field))
def register(model: type[Model]) -> type[Model]:
    """Make a class a frozen dataclass that checks its fields, and is known by its ``name``; a class decorator.

    Parameters
    ----------
    model : type
        Subclass of a kind of models, such as `ContactModel`, `GreaseModel` or `Engine`.
    """
    made = checked(model.refusal, name=model.called.format(name=model.name))(model)
    made.known[made.name] = made
    return made


class OneOf:
    """Annotation of a base class: any of its `checked` subclasses, which the field ``kind`` tells apart.

    ``known`` holds them by their kind; it may grow.
    """

    def __init__(self, known: Mapping[str, type]) -> None:
        self.known = known

    def __get_pydantic_core_schema__(self, base: type, handler: object) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(self._made)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: pydantic.GetJsonSchemaHandler
    ) -> dict[str, Any]:
        found = []
        for cls in self.known.values():
            own = handler.resolve_ref_schema(handler(_adapter(cls).core_schema))
            found.append(own | {"required": ["kind", *own.get("required", ())]})
        return {"oneOf": found}

    def _made(self, value: object) -> object:
        use = f"use {_either(self.known)}"
        if isinstance(value, tuple(self.known.values())):
            return value
        if not isinstance(value, dict):
            raise ValueError(f"must be {_WORDS[dict]}, got {_shown(value)}")
        if "kind" not in value:
            raise _Inside(f"kind is missing; {use}", ["kind"])
        kind = value["kind"]
        if not isinstance(kind, str):
            raise _Inside(_wrong_type("kind", str, kind), ["kind"])
        if kind not in self.known:
            raise _Inside(f'kind "{kind}" is unknown; {use}', ["kind"])
        try:
            return _adapter(self.known[kind]).validate_python(value)
        except ValidationError as found:
            names = [*_names(self.known[kind]), *(str(e["loc"][0]) for e in found.errors() if e["loc"])]
            raise _Inside(_message(found, self.known[kind], ""), names) from None


class _Inside(ValueError):
    """What is wrong inside a value; the text may begin with one of the value's names."""

    def __init__(self, text: str, names: list[str]) -> None:
        super().__init__(text)
        self.names = names


def from_plain(kind: type[T], data: object, where: str, error: type[ClearanceError]) -> T:
    """Make an object of a `checked` class, or a type that pydantic knows, from plain data as TOML and JSON hold it.

    ``where`` is its path in the file, for messages; "" for the whole file. The error names the key that is unknown,
    missing or of a value that it cannot have.
    """
    adapter: pydantic.TypeAdapter[T] = _adapter(kind)
    try:
        return adapter.validate_python(data)
    except ValidationError as found:
        raise error(_message(found, kind, where)) from None


def to_plain(value: Any) -> Any:
    """Return a dataclass as nested dictionaries and lists, without the fields that are None."""
    if dataclasses.is_dataclass(value):
        pairs = ((f.name, getattr(value, f.name)) for f in dataclasses.fields(value))
        return {name: to_plain(item) for name, item in pairs if item is not None}
    if isinstance(value, tuple):
        return [to_plain(item) for item in value]
    return value


def read_plain(path: str | Path, error: type[ClearanceError]) -> dict[str, Any]:
    """Read a TOML or, by its suffix .json, a JSON file as plain data; the error names the file."""
    path = Path(path)
    form, parse = ("JSON", json.loads) if path.suffix == ".json" else ("TOML", tomllib.loads)
    try:
        return parse(path.read_text(encoding="utf-8"))
    except OSError as found:
        raise error(f"{path}: cannot be read ({found.strerror})") from None
    except (ValueError, RecursionError) as found:
        raise error(f"{path}: not valid {form}: {found}") from None


def json_schema(kind: type, title: str) -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a file that holds an object, for editors."""
    schema = _adapter(kind).json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": title}


_adapter: Callable[[Any], pydantic.TypeAdapter[Any]] = functools.cache(pydantic.TypeAdapter)


# Messages.


def _message(found: ValidationError, kind: Any, where: str) -> str:
    """One line on what is wrong first: of unknown keys, or else of the fields in their order."""
    errors = found.errors(include_url=False)
    first = next((e for e in errors if e["type"] in _UNKNOWN), errors[0])
    *above, last = first["loc"] or (None,)
    path = _path(where, first["loc"])
    holder, field = _field(kind, above), _field(kind, first["loc"])
    rule, context, value = first["type"], first.get("ctx", {}), first["input"]
    if rule in _UNKNOWN:
        return f"{path} is not a known key; known: {', '.join(_names(holder))}{_meant(last, _names(holder))}"
    if rule == "value_error":
        text = str(context["error"])
        names = getattr(context["error"], "names", None) or _names(field)
        return f"{path}{_joint(path, text, names)}{text}"
    if typing.get_origin(holder) is tuple and rule == "missing":  # a list that is too short
        return _wrong_type(_path(where, above), holder, value)
    if rule == "missing":
        return f"{path} is missing"
    if rule == "string_too_short":
        return f"{path} must not be empty"
    if rule == "too_short":
        return f"{path} must hold {context['min_length']} or more, got {context['actual_length'] or 'none'}"
    if rule == "literal_error":
        use = _either(map(str, typing.get_args(field)))
        return f'{path} "{value}" is unknown; use {use}' if isinstance(value, str) else _wrong_type(path, str, value)
    if rule in _RULES:
        return f"{path} must be {_RULES[rule].format(**context)}, got {value:.10g}{_about(holder, last)}"
    return _wrong_type(path, field, value) or f"{path}: {first['msg']}, got {_shown(value)}"


_UNKNOWN = ("extra_forbidden", "unexpected_keyword_argument")
_RULES = {
    "greater_than": "> {gt:.10g}",
    "greater_than_equal": ">= {ge:.10g}",
    "less_than": "< {lt:.10g}",
    "less_than_equal": "<= {le:.10g}",
    "finite_number": "finite",
}
_WORDS = {
    float: "a plain number in SI units",
    int: "a whole number",
    str: "a string",
    bool: "true or false",
    dict: "a table of keys",
}


def _either(names: typing.Iterable[str]) -> str:
    """Write names as "a, b or c"."""
    *others, other = names
    return f"{', '.join(others)} or {other}" if others else other


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) < 200 else f"{text[:150]} ..."


def _path(where: str, steps: typing.Iterable[int | str | None]) -> str:
    """Write a place as bushings[0].gap."""
    text = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in steps if step is not None)
    return f"{where}{text}" if where else text.lstrip(".")


def _joint(path: str, text: str, names: list[str]) -> str:
    """What stands between a path and a text that may begin with the name of a field of it."""
    if not path:
        return ""
    name = next((n for n in names if text.startswith(n) and not text[len(n) : len(n) + 1].isidentifier()), None)
    return "." if name else ": " if names else " "


def _bare(kind: Any) -> Any:
    """A type without its rules and without None."""
    if typing.get_origin(kind) is Annotated:
        return _bare(typing.get_args(kind)[0])
    if typing.get_origin(kind) in (types.UnionType, typing.Union):
        parts = [part for part in typing.get_args(kind) if part is not types.NoneType]
        return _bare(parts[0]) if len(parts) == 1 else kind
    return kind


def _field(kind: Any, steps: typing.Iterable[int | str]) -> Any:
    """Type of a part of a type; None if there is none."""
    kind = _bare(kind)
    for step in steps:
        arguments = typing.get_args(kind)
        if dataclasses.is_dataclass(kind):
            kind = _hints(kind).get(step)
        elif typing.get_origin(kind) is tuple and arguments and isinstance(step, int):
            kind = arguments[0] if arguments[-1] is Ellipsis else arguments[min(step, len(arguments) - 1)]
        else:
            return None
        kind = _bare(kind)
    return kind


_hints: Callable[[Any], dict[Any, Any]] = functools.cache(functools.partial(typing.get_type_hints, include_extras=True))


def _names(kind: Any) -> list[str]:
    return [f.name for f in dataclasses.fields(kind) if f.init] if dataclasses.is_dataclass(kind) else []


def _meant(key: object, names: list[str]) -> str:
    close = difflib.get_close_matches(str(key), names, 1)
    return f"; did you mean {close[0]}?" if close else ""


def _wrong_type(path: str, kind: Any, value: object) -> str:
    """What a value of a type must be; nothing if it has no name."""
    arguments = typing.get_args(kind)
    if dataclasses.is_dataclass(kind):
        words = _WORDS[dict]
    elif typing.get_origin(kind) is not tuple:
        words = _WORDS.get(typing.get_origin(kind) or kind, "")
    elif arguments[-1] is not Ellipsis:
        words = f"a list of {len(arguments)} numbers"
    else:
        words = f"a list of tables ([[{path}]])" if dataclasses.is_dataclass(_bare(arguments[0])) else "a list"
    return words and f"{path} must be {words}, got {_shown(value)}"


def _about(kind: Any, name: object) -> str:
    """What a field is, in brackets."""
    words = descriptions(kind).get(str(name)) if isinstance(kind, type) and dataclasses.is_dataclass(kind) else None
    return f" ({words.partition(';')[0]})" if words else ""


@functools.cache
def descriptions(kind: type) -> dict[str, str]:
    """What a `checked` class says of its fields: the strings that follow them.

    Read when they are asked for; pydantic would read every class's source at import.
    """
    found: dict[str, str] = {}
    for base in (base for base in reversed(kind.__mro__) if dataclasses.is_dataclass(base)):
        try:
            body = ast.parse(textwrap.dedent(inspect.getsource(base))).body[0]
        except OSError:  # typed at a prompt
            continue
        assert isinstance(body, ast.ClassDef)
        for field, words in pairwise(body.body):
            match field, words:
                case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(text))):
                    found[name] = inspect.cleandoc(text)
    return found
