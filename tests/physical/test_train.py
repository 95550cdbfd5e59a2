"""The example of gymnasium learns to allow for the play of its gear."""

import numpy as np
import pytest

pytestmark = pytest.mark.slow


def test_a_policy_halves_the_error():
    """Half of the play and torque over stiffness are what a servo with its encoder at the motor is off without it."""
    pytest.importorskip("gymnasium", exc_type=ImportError)
    train = pytest.importorskip("experiments.physical.train")
    env = train.ServoArm()
    try:
        seen, _ = env.reset(seed=1)
        assert env.observation_space.contains(seen)
        assert train.play(env, np.zeros(4), 3, 7) == train.play(env, np.zeros(4), 3, 7)
    finally:
        env.close()
    without, learnt = train.train(15.0)
    assert 1.0 < without < 4.0
    assert learnt < without / 2
