"""Measured records: hobby servos that hold while others pull, with the lost motion that their authors read."""

import pytest

from clearance_mj.drives import ServoLog, fit_held

READ = {
    "single": {5: (14.78, 7.03)},
    "nocomp2": {1: (7.00, 5.33), 2: (7.67, 5.25)},
    "comp2": {1: (0.44, 0.22), 2: (1.44, 0.20)},
}  # ticks between the pulls, stretched and let go (Kotov, Measuring-Backlash-in-Popular-UART-Servos)


@pytest.mark.parametrize("name", READ)
def test_lost_motion_is_what_the_authors_read(real_data, name):
    path = real_data / "servos" / f"motor_telemetry_{name}.csv"
    if not path.is_file():
        pytest.skip("the logs of the servos are missing")
    for servo in fit_held(ServoLog.read(path)):
        for lost, read in zip((servo.stretched, servo.let_go), READ[name][servo.servo]):
            assert lost.ticks == pytest.approx(read, abs=0.25) and lost.low <= read <= lost.high
        assert any("gear and loop are not told apart" in words for words in servo.not_told)
