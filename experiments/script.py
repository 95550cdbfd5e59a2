"""Commands whose options are the parameters of a function."""

import argparse
import inspect
import sys
from collections.abc import Callable, Sequence
from types import NoneType
from typing import Any, Literal, get_args, get_origin

from clearance_mj import ClearanceError


def run(function: Callable, doc: str | None, arguments: Sequence[str] | None = None) -> int:
    """Call a function with what a command line gives for its parameters; return the status, 2 for bad input.

    A parameter without a default is positional, one that is False is a flag; types are those of the annotations, with
    ``Literal`` for choices and ``Sequence`` for several values. The description is the first line of ``doc``.
    """
    parser = argparse.ArgumentParser(description=(doc or "").partition("\n")[0])
    for name, parameter in inspect.signature(function).parameters.items():
        required, default = parameter.default is parameter.empty, parameter.default
        settings = {"action": "store_true"} if default is False else _settings(parameter.annotation)
        option = {} if required else {"default": default, "dest": name, "help": "default: %(default)s"}
        parser.add_argument(name if required else f"--{name.replace('_', '-')}", **settings, **option)
    try:
        return function(**vars(parser.parse_args(arguments))) or 0
    except ClearanceError as error:
        print(error, file=sys.stderr)
        return 2


def _settings(annotation: Any) -> dict[str, Any]:
    """Return type, choices and number of values of an argument."""
    inner = [of for of in get_args(annotation) if of is not NoneType]
    if get_origin(annotation) is Literal:
        return {"choices": inner}
    if get_origin(annotation) is Sequence:
        return {"nargs": "*", **_settings(inner[0])}
    return _settings(inner[0]) if inner else {"type": annotation}
