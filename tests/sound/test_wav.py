"""WAV files: physical units come back, other readers read them, and nothing is clipped."""

import struct
import wave

import numpy as np
import pytest
import scipy.io.wavfile
import scipy.signal

from clearance_mj.core.errors import RecordError
from clearance_mj.signals.response import Response
from clearance_mj.sound import Sound, read_wav, resampled, write_wav

FS = 2048.0
TIME = np.arange(int(2 * FS)) / FS
TONE = 1.5 * np.sin(2 * np.pi * 200 * TIME)


@pytest.mark.parametrize(("encoding", "bits"), [("PCM16", 16), ("PCM24", 24), ("FLOAT", 32)])
def test_a_sound_comes_back_in_pascal(tmp_path, encoding, bits):
    path = tmp_path / "sound.wav"
    write_wav(path, Sound(TONE, FS, "plate at 8:+Z"), full_scale=2.0, encoding=encoding)
    wav = read_wav(path)
    assert (wav.fs, wav.unit, wav.full_scale, wav.name) == (48000.0, "Pa", 2.0, "plate at 8:+Z")
    step = 2.0 * (2.0**-24 if encoding == "FLOAT" else 2.0 ** (1 - bits))
    expected = resampled(TONE, FS, 48000.0)
    assert np.abs(wav.value[0] - expected).max() <= step
    assert np.array_equal(wav.sound.pressure, wav.value[0])


def test_other_readers_read_it(tmp_path):
    """Python's own module, and SciPy, whose 24 bits stand in the upper part of 32."""
    path = tmp_path / "sound.wav"
    write_wav(path, Sound(TONE, FS), full_scale=2.0)
    with wave.open(str(path)) as file:
        assert (file.getnchannels(), file.getsampwidth(), file.getframerate()) == (1, 3, 48000)
        assert file.getnframes() == 2 * 48000
        first = file.readframes(100)
    _, samples = scipy.io.wavfile.read(path)
    assert np.abs(2.0 * samples / 2.0**31 - resampled(TONE, FS, 48000.0)).max() <= 2.0 * 2.0**-23
    assert [int.from_bytes(first[3 * i : 3 * i + 3], "little", signed=True) for i in range(100)] == [
        sample >> 8 for sample in samples[:100].tolist()
    ]


def test_the_full_scale_is_in_the_file(tmp_path):
    path = tmp_path / "acceleration.wav"
    acceleration = np.vstack([0 * TONE, TONE])
    response = Response(FS, 0 * TONE, acceleration, responses=("1:+Z", "2:+Z"))
    write_wav(path, response, full_scale=100.0, row=1)
    data = path.read_bytes()
    assert struct.unpack("<I", data[4:8])[0] == len(data) - 8
    assert b"LIST" in data and b"ICMT" in data and b"full_scale=100 unit=m/s2\0" in data
    wav = read_wav(path)
    assert (wav.unit, wav.full_scale, wav.name) == ("m/s2", 100.0, "acceleration 2:+Z")
    assert np.abs(wav.value[0]).max() == pytest.approx(1.5, rel=1e-3)
    with pytest.raises(RecordError, match="is no sound pressure; needs Pa"):
        _ = wav.sound


def test_clipping_is_refused_with_a_full_scale_that_does(tmp_path):
    path = tmp_path / "sound.wav"
    with pytest.raises(RecordError, match=r"beyond the full scale of 1 Pa; give full_scale=1\.6$"):
        write_wav(path, Sound(1.02 * TONE, FS), full_scale=1.0)
    assert not path.exists()
    write_wav(path, Sound(1.02 * TONE, FS), full_scale=1.6)


def test_a_lower_rate_makes_a_smaller_file(tmp_path):
    path = tmp_path / "sound.wav"
    write_wav(path, Sound(TONE, FS), full_scale=2.0, encoding="PCM16", rate=16000.0)
    assert read_wav(path).fs == 16000.0 and path.stat().st_size < 2 * 2 * 16000 + 200


@pytest.mark.parametrize("fs", [2048.0, 8192.0, 25600.0, 44100.0, 51200.0, 65536.0, 1e4 / 3])
def test_resampling_keeps_tones_and_adds_none(fs):
    """Within 0.01 dB up to 0.4 of the lower rate, and images 80 dB down, of a whole number of periods."""
    n = int(fs * 1.0)
    frequency = round(0.35 * min(fs, 48000.0))
    resampled_sound = resampled(np.sin(2 * np.pi * frequency * np.arange(n) / fs), fs, 48000.0)
    time = np.arange(resampled_sound.size) / 48000.0
    inner = (time > 0.2) & (time < 0.8)
    error = resampled_sound[inner] - np.sin(2 * np.pi * frequency * time[inner])
    assert np.abs(error).max() < 2e-3
    spectrum = np.abs(np.fft.rfft(resampled_sound[inner] * scipy.signal.windows.blackmanharris(inner.sum())))
    at = np.fft.rfftfreq(int(inner.sum()), 1 / 48000.0)
    assert spectrum[np.abs(at - frequency) > 20].max() < 1e-4 * spectrum.max()


def test_foreign_and_damaged_files(tmp_path):
    path = tmp_path / "foreign.wav"
    scipy.io.wavfile.write(path, 44100, np.array([[0, 16384], [-32768, 1]], dtype=np.int16))
    wav = read_wav(path)
    assert (wav.unit, wav.fs) == ("", 44100.0)
    assert wav.value.tolist() == [[0.0, -1.0], [0.5, 1 / 32768]]
    scipy.io.wavfile.write(path, 8000, np.array([0, 128, 192], dtype=np.uint8))
    assert read_wav(path).value.tolist() == [[-1.0, 0.0, 0.5]]
    for damaged in (b"", b"RIFF", path.read_bytes()[:20], b"\0" * 100):
        path.write_bytes(damaged)
        with pytest.raises(RecordError, match="not a whole WAV file"):
            read_wav(path)
    with pytest.raises(RecordError, match="No such file"):
        read_wav(tmp_path / "none.wav")


def test_damaged_bytes_end_in_one_line_or_in_samples(tmp_path):
    """600 files with bytes changed, cut off or put in, above all in the chunks before the samples."""
    path, rng = tmp_path / "sound.wav", np.random.default_rng(0)
    write_wav(path, Sound(TONE[:200], FS), full_scale=2.0, rate=2000.0)
    whole, refused = path.read_bytes(), 0
    for _ in range(600):
        data = bytearray(whole)
        for at in rng.integers(0, 200, rng.integers(1, 5)):
            data[at] = rng.integers(256)
        stop = rng.integers(len(data)) if rng.random() < 0.3 else len(data)
        path.write_bytes(data[:stop])
        try:
            assert np.isfinite(read_wav(path).value).all()
        except RecordError as error:
            refused += 1
            assert str(path) in str(error) and "\n" not in str(error)
    assert 100 < refused < 600


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"full_scale": 0.0}, "full_scale must be > 0"),
        ({"full_scale": 2.0, "rate": 0.5}, "rate must be a whole number of samples per second"),
        ({"full_scale": 2.0, "encoding": "MP3"}, 'encoding "MP3" is unknown; use PCM16, PCM24, FLOAT'),
    ],
)
def test_impossible_options_are_refused(tmp_path, options, words):
    with pytest.raises(RecordError) as caught:
        write_wav(tmp_path / "sound.wav", Sound(TONE, FS), **options)
    assert words in str(caught.value)
    response = Response(FS, 0 * TONE, TONE[None])
    with pytest.raises(RecordError, match="row must be between 0 and 0"):
        write_wav(tmp_path / "sound.wav", response, full_scale=2.0, row=1)
