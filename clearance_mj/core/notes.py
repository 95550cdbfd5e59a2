"""Notes on files: the assumptions made where a file leaves something open."""

import warnings
from collections.abc import Sequence

from .errors import ClearanceError

__all__ = ["RecordNote", "note"]


class RecordNote(UserWarning):
    """Note on how a file was understood where it does not say so itself; the command line prints it."""


def note(place: object, words: Sequence[str]) -> None:
    """Say what was made of a file in one line, if there is anything to say."""
    if words:
        warnings.warn(RecordNote(str(ClearanceError(f"{place}: {'; '.join(words)}"))), stacklevel=3)
