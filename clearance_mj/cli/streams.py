"""Standard streams as they may be: closed, of another character set, a pipe that nobody reads, a full disk."""

from __future__ import annotations

import contextlib
import io
import os
import sys

__all__ = ["prepare", "silence"]


def prepare() -> None:
    """Make the standard streams take every character, and closed ones take what is written and forget it."""
    with contextlib.suppress(OSError):
        while (number := os.open(os.devnull, os.O_RDWR)) <= 2:  # else the next file that is opened would stand in
            pass
        os.close(number)
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")
    if sys.stdout is None:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def silence() -> None:
    """Let what is left to be written to standard output vanish, so that the end of the process does not complain."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
