"""Old names of public objects, kept for one version with a warning."""

import warnings
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

__all__ = ["old_names"]


def old_names(module: str, new_names: Mapping[str, str]) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a module whose old names lead to new ones.

    Parameters
    ----------
    module : str
        ``__name__`` of the module.
    new_names : mapping
        Full new names, such as ``"clearance_mj.drives.fit_drive"``, by old ones.
    """

    def look_up(name: str) -> Any:
        if name not in new_names:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        new = new_names[name]
        warnings.warn(f"{module}.{name} is now {new}; the old name goes in the next version", FutureWarning, 2)
        home, _, attribute = new.rpartition(".")
        return getattr(import_module(home), attribute)

    return look_up
