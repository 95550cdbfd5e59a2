"""The article's figures and tables, computed again on this project's engines, with the published values beside ours.

An item is a module with ``run(context, **parameters) -> Result``; `registry.ITEMS` lists them.
"""

from .context import Context
from .registry import ITEMS
from .result import Result
from .runner import main, reproduce

__all__ = ["ITEMS", "Context", "Result", "main", "reproduce"]
