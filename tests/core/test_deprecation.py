"""Old public names lead to the new objects, with a warning that names them."""

import pytest

from clearance_mj import drives, identify


def test_an_old_name_is_the_new_object_and_warns():
    with pytest.warns(FutureWarning, match=r"identify\.fit_drive is now clearance_mj\.drives\.fit_drive"):
        assert identify.fit_drive is drives.fit_drive


def test_a_name_that_never_was_is_an_attribute_error():
    with pytest.raises(AttributeError, match=r"'clearance_mj\.identify' has no attribute 'fit_nothing'"):
        _ = identify.fit_nothing
