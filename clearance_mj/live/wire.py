"""Messages between page and server: checked requests one way, packed numbers the other."""

from __future__ import annotations

import json
from typing import Annotated, Any, Literal

import numpy as np
import pydantic
from pydantic import Field

from ..core.files import to_json
from .figures import Numbers

__all__ = [
    "MAX_BYTES", "Cancel", "Export", "Follow", "Hear", "Message", "Set", "Step", "Sweep", "Window", "packed", "parsed",
]  # fmt: skip

MAX_BYTES = 65_536  # of a message to the server
Name = Annotated[str, Field(max_length=200)]
Number = Annotated[int | float, Field(union_mode="left_to_right")]
Values = Annotated[dict[Name, Number | Name], Field(max_length=2000)]
Order = Annotated[int, Field(ge=0, lt=2**53)]


class Request(pydantic.BaseModel, strict=True, extra="forbid", allow_inf_nan=False):
    """Base of the messages to the server, whose types are strict."""


class Set(Request):
    """Show a setting, and a record over it."""

    type: Literal["set"]
    id: Order
    values: Values
    record: Name = ""


class Window(Request):
    """Show an interval of time more finely."""

    type: Literal["window"]
    low: Number
    high: Number


class Between(Request):
    """Request of a long computation for a setting, from a low end to a high one."""

    values: Values
    low: Number
    high: Number


class Follow(Between):
    """Follow a branch of periodic vibrations over frequency."""

    type: Literal["branch"]


class Step(Between):
    """Step a sine through frequencies, upwards and back."""

    type: Literal["steps"]
    count: Order
    hold: Number


class Sweep(Between):
    """Simulate with one control at several values."""

    type: Literal["sweep"]
    name: Name
    count: Order


class Cancel(Request):
    """Cancel the long computation."""

    type: Literal["cancel"]


class Export(Request):
    """Send what is shown as files, with a record over its FRFs."""

    type: Literal["export"]
    record: Name = ""


class Hear(Request):
    """Send what is shown as a sound, to keep in a slot of the page."""

    type: Literal["hear"]
    slot: Literal["A", "B"]
    sensor: Order


Message = Set | Window | Follow | Step | Sweep | Cancel | Export | Hear
_MESSAGE: pydantic.TypeAdapter[Message] = pydantic.TypeAdapter(Annotated[Message, Field(discriminator="type")])


def parsed(text: str | bytes) -> Message | None:
    """Return the message that a text is, None if it is none: such a one does nothing."""
    try:
        return _MESSAGE.validate_json(text)
    except (pydantic.ValidationError, RecursionError):
        return None


def packed(kind: str, numbers: Numbers, **more: Any) -> bytes:
    """Return facts and arrays as bytes.

    Length of the head (4 bytes, little-endian), the head (JSON, padded to whole numbers of 4 bytes) with names and
    shapes of the arrays, and their numbers one array after the other (4-byte floats, little-endian).
    """
    shapes = [[name, list(array.shape)] for name, array in numbers.arrays.items()]
    head = json.loads(to_json({"type": kind, **more, **numbers.facts, "arrays": shapes}))
    text = json.dumps(head, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    with np.errstate(over="ignore"):
        body = b"".join(np.ascontiguousarray(array, dtype="<f4").tobytes() for array in numbers.arrays.values())
    return len(text).to_bytes(4, "little") + text + body
