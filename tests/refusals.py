"""Calls that must fail, and what their errors say."""

import pytest


def assert_refused(error: type[Exception], pattern: str | None, call, /, *arguments, **options) -> str:
    """Return the message, one line that holds the pattern, of the error that a call raises."""
    with pytest.raises(error, match=pattern) as caught:
        call(*arguments, **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)
