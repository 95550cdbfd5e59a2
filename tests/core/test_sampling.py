"""Times that jitter, and those of which one is missing."""

import numpy as np
import pytest

from clearance_mj.core.errors import RecordError
from clearance_mj.core.sampling import even_times

JITTERING = np.arange(2000) / 500 + np.clip(np.random.default_rng(0).normal(0, 5e-4, 2000), -9e-4, 9e-4)


def test_jitter_of_a_quarter_of_the_step_is_no_lost_sample():
    """Steps of 0.6 to 3.6 ms are all meant to be 2 ms."""
    assert np.ptp(np.diff(JITTERING)) > 2e-3
    fs, even = even_times(JITTERING, "run")
    assert fs == pytest.approx(500.0, rel=1e-3)
    np.testing.assert_allclose(np.diff(even), 1 / fs)
    assert np.abs(even - JITTERING).max() < 2e-3


@pytest.mark.parametrize("at", [3, 1000, 1995])
def test_a_lost_sample_is_found_in_jitter(at):
    with pytest.raises(RecordError, match=r"run: .* s instead of 0.00\d+ s \(\d times\): samples are missing"):
        even_times(np.delete(JITTERING, [at, at + 1]), "run")


def test_times_that_do_not_rise():
    with pytest.raises(RecordError, match="must rise"):
        even_times(np.array([0.0, 1.0, 1.0, 2.0]), "run")
