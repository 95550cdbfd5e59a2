"""Frozen data types whose values pydantic checks; errors in one line: where, which value, which rule.

A type is a class with annotated fields under `checked`. `Positive` and its kin are the fields' types; the strings that
follow the fields are their descriptions in JSON Schemas. Rules between fields are validators
(``@pydantic.model_validator(mode="after")``) that raise ValueError with a text that begins with the field's path.
"""

from __future__ import annotations

import dataclasses
import functools
import json
import tomllib
import typing
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeVar

import pydantic
from pydantic import ConfigDict, Field, ValidationError
from pydantic_core import core_schema

from .errors import ClearanceError
from .files import plain_file
from .messages import WORDS, descriptions, either, message, names_of, shown, wrong_type

__all__ = [
    "Count", "Flag", "NotNegative", "Number", "OneOf", "Positive", "Registered", "Share", "Text", "Whole",
    "checked", "descriptions", "from_plain", "json_schema", "read_plain", "register", "seldom", "to_plain",
]  # fmt: skip

Number = Annotated[float, Field(strict=True)]  # any finite number; a whole one counts, text and booleans do not.
Positive = Annotated[float, Field(strict=True, gt=0)]
NotNegative = Annotated[float, Field(strict=True, ge=0)]
Share = Annotated[float, Field(strict=True, ge=0, le=1)]
Whole = Annotated[int, Field(strict=True)]
Count = Annotated[int, Field(strict=True, ge=1)]
Text = Annotated[str, Field(strict=True)]
Flag = Annotated[bool, Field(strict=True)]

T = TypeVar("T")
SELDOM = "seldom"


def seldom(*, default: Any) -> Any:
    """Make a field of a `checked` class that plain data hold only if it is not at its default."""
    return dataclasses.field(default=default, metadata={SELDOM: True})


@typing.dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field, Field, seldom))
def checked(
    error: type[ClearanceError], name: str | None = None, eq: bool = True, schema: dict[str, Any] | None = None
) -> Callable[[type[T]], type[T]]:
    """Make a class a frozen dataclass that checks its fields; a decorator.

    ``error`` is raised for values that no object can have; ``name`` is what messages call an object that is made by
    itself (default: the class's name in lower case); ``eq`` compares and hashes by values; ``schema`` is more for its
    JSON Schema: rules between fields.
    """

    def describe(schema_of_class: dict[str, Any], kind: type) -> None:
        for field, words in descriptions(kind).items():
            schema_of_class["properties"][field]["description"] = words
        schema_of_class.update(schema or {})

    config = ConfigDict(extra="forbid", allow_inf_nan=False, arbitrary_types_allowed=True, json_schema_extra=describe)

    def decorate(cls: type[T]) -> type[T]:
        validated = pydantic.dataclasses.dataclass(frozen=True, eq=eq, config=config)(cls)
        where, names = cls.__name__.lower() if name is None else name, tuple(names_of(validated))

        def init(self: T, *args: Any, **kwargs: Any) -> None:
            # Values by name: pydantic takes them three times as fast as arguments by position.
            values = dict(zip(names, args)) | kwargs if args else kwargs
            if len(values) < len(args) + len(kwargs):
                raise error(f"{where or cls.__name__} takes each of {', '.join(names)} once")
            try:
                validated.__pydantic_validator__.validate_python(values, self_instance=self)
            except ValidationError as failure:
                raise error(message(failure, validated, where)) from None

        validated.__init__ = init  # type: ignore[method-assign, assignment]
        return validated  # type: ignore[return-value]

    return decorate


class Registered:
    """Base of the kinds of models that `register` knows by name."""

    name: ClassVar[str]  #: in files and commands
    known: ClassVar[dict[str, Any]]  #: of the kind, by name
    refusal: ClassVar[type[ClearanceError]]  #: raised for values that no object can have
    called: ClassVar[str]  #: what messages call an object, with {name}


Model = TypeVar("Model", bound=Registered)


@typing.dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field, Field))
def register(model: type[Model]) -> type[Model]:
    """Make a class a frozen dataclass that checks its fields, and is known by its ``name``; a class decorator.

    Parameters
    ----------
    model : type
        Subclass of a kind of models, such as `ContactModel`, `GreaseModel` or `Engine`.
    """
    registered_class = checked(model.refusal, name=model.called.format(name=model.name))(model)
    registered_class.known[registered_class.name] = registered_class
    return registered_class


class OneOf:
    """Annotation of a base class: any of its `checked` subclasses, distinguished by the field ``kind``.

    ``known`` holds them by their kind; it may grow.
    """

    def __init__(self, known: Mapping[str, type]) -> None:
        self.known = known

    def __get_pydantic_core_schema__(self, base: type, handler: object) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(self._make)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: pydantic.GetJsonSchemaHandler
    ) -> dict[str, Any]:
        schemas = []
        for cls in self.known.values():
            schema_of_class = handler.resolve_ref_schema(handler(_adapter(cls).core_schema))
            schemas.append(schema_of_class | {"required": ["kind", *schema_of_class.get("required", ())]})
        return {"oneOf": schemas}

    def _make(self, value: object) -> object:
        use = f"use {either(self.known)}"
        if isinstance(value, tuple(self.known.values())):
            return value
        if not isinstance(value, dict):
            raise ValueError(f"must be {WORDS[dict]}, got {shown(value)}")
        if "kind" not in value:
            raise _Inside(f"kind is missing; {use}", ["kind"])
        kind = value["kind"]
        if not isinstance(kind, str):
            raise _Inside(wrong_type("kind", str, kind), ["kind"])
        if kind not in self.known:
            raise _Inside(f'kind "{kind}" is unknown; {use}', ["kind"])
        try:
            return _adapter(self.known[kind]).validate_python(value)
        except ValidationError as failure:
            names = [*names_of(self.known[kind]), *(str(e["loc"][0]) for e in failure.errors() if e["loc"])]
            raise _Inside(message(failure, self.known[kind], ""), names) from None


class _Inside(ValueError):
    """An error inside a value; the text may begin with one of the value's names."""

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
    except ValidationError as failure:
        raise error(message(failure, kind, where)) from None


def to_plain(value: Any) -> Any:
    """Return a dataclass as nested dictionaries and lists, without the fields that are None or of `seldom`."""
    if dataclasses.is_dataclass(value):
        pairs = ((f, getattr(value, f.name)) for f in dataclasses.fields(value))
        kept = ((f, item) for f, item in pairs if item is not None and not (SELDOM in f.metadata and item == f.default))
        return {f.name: to_plain(item) for f, item in kept}
    if isinstance(value, tuple):
        return [to_plain(item) for item in value]
    return value


def read_plain(path: str | Path, error: type[ClearanceError]) -> dict[str, Any]:
    """Read a TOML or, by its suffix .json, a JSON file as plain data; the error names the file."""
    path = Path(path)
    form, parse = ("JSON", json.loads) if path.suffix == ".json" else ("TOML", tomllib.loads)
    try:
        return parse(plain_file(path).read_text(encoding="utf-8"))
    except OSError as failure:
        raise error(f"{path}: cannot be read ({failure.strerror})") from None
    except (ValueError, RecursionError) as failure:
        raise error(f"{path}: not valid {form}: {failure}") from None


def json_schema(kind: type, title: str) -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a file that holds an object, for editors."""
    schema = _adapter(kind).json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": title}


_adapter: Callable[[Any], pydantic.TypeAdapter[Any]] = functools.cache(pydantic.TypeAdapter)
