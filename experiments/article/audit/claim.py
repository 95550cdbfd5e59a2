"""A claim of the article, and what comes out when it is computed again."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Claim:
    """Something the article says, and what comes out when it is computed again."""

    part: str
    """what it is about: a table, or the equations"""
    where: str
    """place in the article"""
    text: str
    """what it says, in words"""
    printed: str
    """the value as printed"""
    recomputed: str
    """the value that comes out here"""
    verdict: str
    """such as "ok" or "wrong" """

    @property
    def holds(self) -> bool:
        """Whether nothing is wrong with it."""
        return self.verdict.split(";")[0] in ("ok", "ok within the table's rounding")
