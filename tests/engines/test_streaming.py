"""Streaming gives what the whole record gives, at memory that does not grow with the duration."""

import dataclasses
import itertools
import tracemalloc

import numpy as np
import pytest
import scipy.signal
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st

from clearance_mj.clearance import AmplitudeLaw, ConstantLaw
from clearance_mj.core.errors import ExcitationError, RecordError
from clearance_mj.engines import simulate, simulate_blocks
from clearance_mj.io.results import load, save_blocks
from clearance_mj.signals.excitation import random, random_blocks
from clearance_mj.signals.frf import estimate_frf, estimate_frf_blocks
from clearance_mj.signals.response import Response
from clearance_mj.signals.sampling import Interpolator, lowpass

FS = 2048.0
LAW = ConstantLaw(7e3, 4.0)
HISTORIES = ("excitation", "acceleration", "displacement", "contact_force", "grease_force")


def cut(whole, edges):
    return [whole[slice(*edge)] for edge in itertools.pairwise((0, *sorted(edges), len(whole)))]


@settings(max_examples=30, deadline=None)
@given(n=st.integers(1, 300), factor=st.sampled_from((1, 2, 7, 24)), edges=st.lists(st.integers(0, 300), max_size=6))
def test_interpolation_does_not_depend_on_the_blocks(n, factor, edges):
    """To the last bit; scipy's upfirdn of the whole record is the reference."""
    value = np.random.default_rng(n).standard_normal(n)
    interpolator, half = Interpolator(factor), lowpass(factor).size // 2
    blocks = [*cut(value, np.minimum(edges, n)), np.zeros(interpolator.ahead)]
    interpolated = np.concatenate([interpolator.push(block) for block in blocks])
    whole = scipy.signal.upfirdn(factor * lowpass(factor), value, up=factor)
    np.testing.assert_array_equal(interpolated, whole[half : half + n * factor])


def test_blocks_are_the_response(rig, engine):
    """Whatever the pieces of the excitation, to the last bit, and every sample once."""
    law = AmplitudeLaw([0, 1e-4], [[5e3, 6e3], [9e3, 9e3]], [[3.0, 4.0], [4.0, 4.0]])
    drive = random(1.0, FS, rms=6.0, seed=3)
    whole = simulate(rig, drive, law, engine)
    pieces = [dataclasses.replace(drive, value=value) for value in cut(drive.value, (1, 5, 700, 701, 1900))]
    blocks = list(simulate_blocks(rig, pieces, law, engine))
    for name in HISTORIES:
        joined = np.concatenate([getattr(block, name) for block in blocks], axis=-1)
        np.testing.assert_array_equal(joined, getattr(whole, name))
    assert all(0 < block.duration < 0.3 for block in blocks)
    assert blocks[-1].provenance == whole.provenance


def test_pieces_that_do_not_belong_together(rig):
    good, other = random(1.0, FS), random(1.0, FS / 2)
    with pytest.raises(ExcitationError, match="base at 1024 Hz, the first one base at 2048 Hz"):
        list(simulate_blocks(rig, [good, other], LAW, "modal"))
    with pytest.raises(ExcitationError, match="no piece"):
        list(simulate_blocks(rig, [], LAW, "modal"))


@pytest.mark.parametrize("estimator", ["H1", "H2", "Hv"])
@pytest.mark.parametrize("overlap, window", [(0.5, "hann"), (0.0, "boxcar"), (2 / 3, "hann")])
def test_frf_of_blocks_is_that_of_the_record(rng, estimator, overlap, window):
    x, noise = rng.standard_normal(5000), rng.standard_normal((2, 5000))
    y = np.stack((scipy.signal.lfilter([1.0], [1, -1.2, 0.7], x), x)) + 0.1 * noise
    whole = Response(512.0, x, y, responses=("3:+Z", "1:-Z"), reference="200:+Z", kind="force")
    pieces = zip(*(cut(each, (100, 101, 2600)) for each in (x, y.T)))
    blocks = [dataclasses.replace(whole, excitation=a, channels=b.T) for a, b in pieces]
    arguments = {"estimator": estimator, "resolution": 1.0, "overlap": overlap, "band": (5, 200), "window": window}
    expected, by_blocks = estimate_frf(whole, **arguments), estimate_frf_blocks(blocks, **arguments)
    np.testing.assert_array_equal(by_blocks.frequency, expected.frequency)
    np.testing.assert_allclose(by_blocks.value, expected.value, rtol=1e-10)
    np.testing.assert_allclose(by_blocks.coherence, expected.coherence, rtol=1e-10)
    labels = ("responses", "reference", "quantity")
    assert [getattr(by_blocks, name) for name in labels] == [getattr(expected, name) for name in labels]


@pytest.mark.parametrize("arguments, message", [
    ({"estimator": "H3"}, 'estimator "H3" is unknown'),
    ({"window": "flat"}, 'window "flat" is unknown'),
    ({"overlap": 1.0}, "overlap must be in"),
    ({"resolution": 0.0}, "resolution must be > 0 Hz"),
    ({"resolution": 0.1}, "lasts 2 s, shorter than one segment of 10 s"),
    ({"band": (5, 400)}, "below twice the band"),
    ({"band": (5.1, 5.2)}, "no line between"),
])  # fmt: skip
def test_frf_of_blocks_refuses(rng, arguments, message):
    block = Response(512.0, rng.standard_normal(512), rng.standard_normal((2, 512)))
    with pytest.raises(RecordError, match=message):
        estimate_frf_blocks([block, block], **arguments)


def test_frf_of_blocks_refuses_bad_samples(rng):
    block = Response(512.0, np.ones(1024), rng.standard_normal((2, 1024)))
    with pytest.raises(RecordError, match="constant at 1"):
        estimate_frf_blocks([block, block])
    bad = dataclasses.replace(block, channels=np.full((2, 1024), np.nan))
    with pytest.raises(RecordError, match="acceleration row 0 is not finite"):
        estimate_frf_blocks([block, bad])
    with pytest.raises(RecordError, match="no block"):
        estimate_frf_blocks([])


def test_random_blocks_are_stationary_band_limited_gaussian_noise():
    value = np.concatenate([piece.value for piece in list(random_blocks(400.3, FS, band=(20, 200), rms=2.0, seed=1))])
    assert value.size == round(400.3 * FS)
    # 2 B T = 144 000 independent samples: σ of the RMS 0.2 %, of the kurtosis √(24 / 144 000) = 0.013.
    assert value.std() == pytest.approx(2.0, rel=0.008)
    assert scipy.stats.kurtosis(value) == pytest.approx(0.0, abs=0.05)
    frequency, density = scipy.signal.welch(value, FS, "blackmanharris", nperseg=8192, detrend=False)
    inside, outside = (frequency > 22) & (frequency < 198), (frequency < 18.5) | (frequency > 201.5)
    assert density[inside].mean() == pytest.approx(4.0 / 180, rel=0.01)
    assert density[outside].max() < 1e-6 * density[inside].mean()
    # No seams: the variance of a place within the pieces is that of any other, over 50 pieces.
    parts = value[: 50 * 16384].reshape(50, 16, 1024)
    assert np.ptp(np.mean(parts**2, axis=(0, 2))) / 4.0 < 6 * np.sqrt(2 / (50 * 360 * 0.5))


def test_random_blocks_follow_their_seed():
    first, again, other = (next(random_blocks(20.0, FS, seed=seed)).value for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert abs(np.corrcoef(first, other)[0, 1]) < 0.1
    with pytest.raises(ExcitationError, match="rms"):
        next(random_blocks(20.0, FS, rms=-1.0))


def peak(call, duration) -> int:
    """Most bytes that Python and numpy hold at once."""
    tracemalloc.start()
    try:
        call(duration)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_memory_is_flat_in_duration(rig):
    def stream(duration):
        blocks = simulate_blocks(rig, random_blocks(duration, FS, rms=2.0), LAW, "modal")
        return estimate_frf_blocks(blocks, resolution=1.0)

    def whole(duration):
        return estimate_frf(simulate(rig, random(duration, FS, rms=2.0), LAW, "modal"), resolution=1.0)

    stream(1.0)  # compiled code and cached filters stay
    assert peak(stream, 80.0) - peak(stream, 20.0) < 60 * FS * 8 / 2  # half of what the excitation alone would take
    assert peak(whole, 40.0) - peak(whole, 20.0) > 5e6  # the measure sees what grows


def test_blocks_are_written_as_they_pass(rig, tmp_path):
    """The file holds what `simulate` returns; without its last block there is none."""
    pytest.importorskip("h5netcdf")
    drive, path = random(2.0, FS, rms=2.0), tmp_path / "run.h5"
    whole = simulate(rig, drive, LAW, "modal")
    blocks = save_blocks(path, simulate_blocks(rig, drive, LAW, "modal"))
    next(blocks)
    assert not path.exists()
    assert 0 < sum(1 for _ in blocks) < 20
    stored = load(path)
    for name in (*HISTORIES, "time"):
        np.testing.assert_array_equal(getattr(stored, name), getattr(whole, name))
    assert stored.provenance == whole.provenance
    with pytest.raises(RecordError, match="blocks are appended to HDF5 only"):
        next(save_blocks(tmp_path / "run.nc", []))
    with pytest.raises(RecordError, match="no block to write"):
        next(save_blocks(path, []))
