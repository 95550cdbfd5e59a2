"""The article's figures and tables, computed again on this project's engines, with the published values beside ours.

`items.ITEMS` lists them; an item is a function that takes the item and what it needs of `Inputs`, and returns a
`Result`.
"""

from .inputs import Inputs
from .items import ITEMS, Item, register
from .result import Result
from .runner import reproduce

__all__ = ["ITEMS", "Inputs", "Item", "Result", "register", "reproduce"]
