"""What calls refuse."""

import pytest

from clearance_mj import RecordError


def assert_refused(words, function, *arguments, **options):
    """A call raises a RecordError of one line in which a regular expression is found."""
    with pytest.raises(RecordError, match=words) as caught:
        function(*arguments, **options)
    assert "\n" not in str(caught.value)
