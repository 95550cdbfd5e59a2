"""A structure made of measured FRFs of an aircraft.

J.P. Noël and M. Schoukens, F-16 aircraft benchmark based on ground vibration test data, 2017: a shaker below the right
wing, accelerations at the shaker and on both sides of the mounting interface of a dummy payload.
"""

import numpy as np
import pytest
import scipy.io

from clearance_mj import FRF, RecordError
from clearance_mj.structure import modes_from_frf
from experiments.real import f16

from ..refusals import assert_refused

SOURCE = "measured record, which no fit saw"


def test_synthesis_of_the_modes_between_2_and_15_hertz(real_data):
    """Multisine at its lowest level, mean of eight of nine periods of 8192 samples; the first one has the transient."""
    path = real_data / "f16" / "F16Data_FullMSine_Level1.mat"
    if not path.exists():
        pytest.skip(f"{path.name} is missing; it is among the records of nonlinearbenchmark.org")
    record, lines = scipy.io.loadmat(path), slice(41, 308)
    force, acceleration = (record[name].reshape(-1, 9, 8192)[:, 1:].mean(axis=1) for name in ("Force", "Acceleration"))
    value = np.fft.rfft(acceleration)[:, lines] / np.fft.rfft(force)[:, lines]
    frequency = np.arange(8192)[lines] * record["Fs"].item() / 8192
    modal = modes_from_frf(FRF(frequency, value, None, ("1:+Z", "2:+Z", "3:+Z"), "1:+Z", "acceleration/force"))
    assert len(modal.summary()["frequency"]) >= 6 and not modal.left_out
    assert modal.collinearity.min() > 0.98 and modal.frac.min() > 0.98
    assert modal.rmse_db[0] < 0.6 and modal.rmse_db.max() < 2.5


@pytest.mark.slow
def test_level_that_was_left_out(real_data, measured):
    """Level 3 from levels 1, 5 and 7: at most half the linear model's error, and below that of interpolation."""
    if not (real_data / "f16").is_dir():
        pytest.skip("the F-16's records are missing; they are among those of nonlinearbenchmark.org")
    result = f16.analyse(real_data, [1, 5, 7], [3])
    error = {(row["role"], row["level"], row["output"], row["method"]): row["relative"] for row in result["rows"]}
    for output in f16.OUTPUTS:
        law, linear, between = (error["predicted", 3, output, m] for m in ("law", "linear", "interpolation"))
        measured.below(f"F-16, level 3 left out, {output}: error over the linear model's", law / linear, 0.5, SOURCE)
        measured.below(f"F-16, level 3 left out, {output}: error over interpolation's", law / between, 1, SOURCE)
    assert max(value for (role, *_), value in error.items() if role == "fitted") < 0.15
    swept = {(row["level"], row["output"], row["method"]): row["relative"] for row in result["swept"]}
    assert all(swept[7, output, "law"] < 0.25 * swept[7, output, "linear"] for output in f16.OUTPUTS)


def record(path, samples=2 * 8192, **changes):
    force = np.random.default_rng(0).normal(size=samples)
    scipy.io.savemat(path, {"Force": force, "Acceleration": np.tile(force, (3, 1)), "Fs": 400} | changes)


def test_tests_of_the_benchmark_have_longer_names(tmp_path):
    record(tmp_path / "F16Data_FullMSine_Level2_Validation.mat")
    record(tmp_path / "F16Data_FullMSine_Level21.mat")
    assert f16.record_of(tmp_path, f16.MULTISINE, 2).excitation.size == 2 * 8192
    assert f16.record_of(tmp_path, f16.MULTISINE, 3) is None


@pytest.mark.parametrize(("changes", "message"), [
    ({"samples": 9000}, "9000 samples are no whole periods"),
    ({"Acceleration": np.ones((2, 5))}, "needs Force .n., Acceleration"),
])  # fmt: skip
def test_damaged_record(tmp_path, changes, message):
    record(tmp_path / "F16Data_FullMSine_Level1.mat", **changes)
    assert_refused(RecordError, f"Level1.mat: {message}", f16.record_of, tmp_path, f16.MULTISINE, 1)


def test_joint_of_an_unknown_kind(tmp_path, capsys):
    for level in (1, 3):
        record(tmp_path / f"F16Data_FullMSine_Level{level}.mat")
    with pytest.raises(SystemExit) as stopped:
        f16.main([str(tmp_path), "--identify", "1,3", "--joints", "loose", "--out", str(tmp_path / "out")])
    assert stopped.value.code == 2 and "a joint is 'free' or 'payload-wing', not 'loose'" in capsys.readouterr().err


def test_interpolation_between_levels(tmp_path):
    """A response that grows as the square of the force: its FRF at 2 between those at 1 and 3 is the mean of both."""
    records = {}
    for level in (1, 2, 3):
        force = level * np.random.default_rng(0).normal(size=2 * 8192)
        scipy.io.savemat(tmp_path / f"F16Data_FullMSine_Level{level}.mat",
                         {"Force": force, "Acceleration": np.tile(level * force, (3, 1)), "Fs": 400})  # fmt: skip
        records[level] = f16.record_of(tmp_path, f16.MULTISINE, level)
    levels = f16.Levels(records)
    predictions = levels.by_frfs(2, [1, 3])
    np.testing.assert_allclose(predictions["interpolation"][0], 2.0, rtol=1e-12)
    np.testing.assert_allclose(predictions["linear"][0], 1.0, rtol=1e-12)
    assert predictions["interpolation"][1] == [1, 3] and "interpolation" not in levels.by_frfs(3, [1, 2])
