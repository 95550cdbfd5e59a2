"""WAV files with the physical unit of their samples.

Microsoft and IBM, Multimedia Programming Interface and Data Specifications 1.0 (1991): a RIFF file of chunks. The chunk
LIST of type INFO has the full scale, the value of the largest sample, 1.0, and its unit.
"""

from __future__ import annotations

import io
import re
import struct
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil, floor, log10
from os import PathLike

import numpy as np
import scipy.io.wavfile

from ..core.errors import RecordError
from ..core.files import read_bytes, replacing
from ..core.quantities import QUANTITIES
from ..signals.arrays import ArrayData
from ..signals.response import Response
from ..signals.sampling import resampled
from ..version import __version__
from .pressure import Sound

__all__ = ["RATE", "Wav", "full_scale", "read_wav", "wav_bytes", "write_wav"]

RATE = 48_000.0
"""Default samples per second of written files, and of sounds whose loudness is computed."""
UNIT_OF_PRESSURE = "Pa"
SCALE = re.compile(r"full_scale=(\S+) unit=(\S*)")
ENCODINGS = {"PCM16": 16, "PCM24": 24, "FLOAT": 32}  # bits of a sample
PCM, IEEE_FLOAT = 1, 3  # format tags


@dataclass(frozen=True, eq=False)
class Wav(ArrayData):
    """Content of a WAV file in physical units."""

    value: np.ndarray
    """(n_channels, n_t) in ``unit``, read-only"""
    fs: float
    """samples per second"""
    unit: str
    """"Pa", "m/s2", or "" where the file says none: 1 is then the largest sample"""
    full_scale: float = 1.0
    """value of the largest sample, in ``unit``"""
    name: str = ""
    """description of the recording"""

    @property
    def sound(self) -> Sound:
        """The first channel as a sound; RecordError if it is no pressure."""
        if self.unit != UNIT_OF_PRESSURE:
            raise RecordError(f'a WAV file in "{self.unit or "no unit"}" is no sound pressure; needs Pa')
        return Sound(self.value[0], self.fs, self.name)


def write_wav(
    path: str | PathLike[str], signal: Sound | Response, full_scale: float, row: int = 0, encoding: str = "PCM24",
    rate: float = RATE,
) -> None:  # fmt: skip
    """Write a sound, or one acceleration of a response, as a WAV file.

    The samples are resampled band-limited. Files of one full scale can be compared by ear.

    Parameters
    ----------
    path : str or Path
        The file, .wav; an existing one is replaced when the new one is complete.
    signal : Sound or Response
        Sound pressure in Pa, or accelerations in m/s².
    full_scale : float
        Value of the largest sample, Pa or m/s².
    row : int
        Row of the response's acceleration.
    encoding : {"PCM24", "PCM16", "FLOAT"}
        24 or 16 bits, or floating point numbers of 32 bits.
    rate : float
        Samples per second of the file, a whole number; 48000 is that of ISO 532-1, supported by every player.

    Raises
    ------
    RecordError
        If a sample exceeds the full scale; the message suggests one. If the row or the encoding is unknown.
    """
    data = wav_bytes(signal, full_scale, row, encoding, rate)
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def wav_bytes(
    signal: Sound | Response, full_scale: float, row: int = 0, encoding: str = "PCM24", rate: float = RATE
) -> bytes:
    """Return the WAV file that `write_wav` writes.

    Parameters
    ----------
    signal, full_scale, row, encoding, rate
        As in `write_wav`.

    Raises
    ------
    RecordError
        As `write_wav`.
    """
    RecordError.require_known("encoding", encoding, ENCODINGS)
    RecordError.require_positive(full_scale=full_scale)
    if rate != int(rate) or rate < 1:
        raise RecordError(f"rate must be a whole number of samples per second, got {rate}")
    value, unit, name = _samples_of(signal, row)
    samples = resampled(value, signal.fs, rate)
    peak = float(np.abs(samples).max())
    if peak > full_scale:
        raise RecordError(
            f"the largest sample is {peak:.4g} {unit}, beyond the full scale of {full_scale:g} {unit}; "
            f"give full_scale={_round_up(peak):g}"
        )
    info = {b"ISFT": f"clearance-mj {__version__}", b"INAM": name, b"ICMT": f"full_scale={full_scale:.17g} unit={unit}"}
    return _riff(samples / full_scale, int(rate), encoding, info)


def full_scale(signal: Sound | Response, row: int = 0) -> float:
    """Return a full scale without clipping of a signal's WAV file: two digits, Pa or m/s².

    Parameters
    ----------
    signal, row
        As in `write_wav`; for several signals take the largest.

    Raises
    ------
    RecordError
        If the row is unknown.
    """
    value, _, _ = _samples_of(signal, row)
    peak = float(np.abs(resampled(value, signal.fs, RATE)).max())
    return _round_up(peak) if peak else 1.0


def _samples_of(signal: Sound | Response, row: int) -> tuple[np.ndarray, str, str]:
    """Return the samples of a signal, their unit and their name."""
    if isinstance(signal, Sound):
        return signal.pressure, UNIT_OF_PRESSURE, signal.name
    count = len(signal.channels)
    if not 0 <= row < count:
        raise RecordError(f"row must be between 0 and {count - 1}, got {row}")
    label = signal.responses[row] if row < len(signal.responses) else f"row {row}"
    quantity = signal.quantities[row]
    return signal.channels[row], next(iter(QUANTITIES[quantity].units)), f"{quantity} {label}"


def _round_up(value: float) -> float:
    """Return the next larger number of two digits."""
    step = 10.0 ** (floor(log10(value)) - 1)
    return float(f"{ceil(value / step * (1 + 1e-9)) * step:.6g}")


def _riff(samples: np.ndarray, rate: int, encoding: str, info: dict[bytes, str]) -> bytes:
    bits = ENCODINGS[encoding]
    if encoding == "FLOAT":
        tag, data = IEEE_FLOAT, samples.astype("<f4").tobytes()
    else:
        full = 2 ** (bits - 1)
        integers = np.clip(np.rint(samples * full), -full, full - 1).astype("<i4")
        tag, data = PCM, integers[:, None].view(np.uint8)[:, : bits // 8].tobytes()
    width = bits // 8
    texts = b"".join(_chunk(key, text.encode() + b"\0") for key, text in info.items() if text)
    format_chunk = struct.pack("<HHIIHH", tag, 1, rate, rate * width, width, bits)
    fact_chunk = _chunk(b"fact", struct.pack("<I", samples.size)) if encoding == "FLOAT" else b""
    body = _chunk(b"fmt ", format_chunk) + fact_chunk + _chunk(b"LIST", b"INFO" + texts) + _chunk(b"data", data)
    return _chunk(b"RIFF", b"WAVE" + body)


def _chunk(name: bytes, body: bytes) -> bytes:
    return name + struct.pack("<I", len(body)) + body + b"\0" * (len(body) % 2)


def read_wav(path: str | PathLike[str]) -> Wav:
    """Read a WAV file; one that `write_wav` wrote comes back in physical units.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    Wav
        Samples of every channel, times the full scale in the file. A file without one has no unit, and its largest
        sample is 1.

    Raises
    ------
    RecordError
        If it cannot be read or is no complete WAV file.
    """
    data = read_bytes(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", scipy.io.wavfile.WavFileWarning)  # of skipped chunks
            fs, samples = scipy.io.wavfile.read(io.BytesIO(data))
        info = _info(data)
    except Exception as error:  # any error of a damaged file
        raise RecordError(f"{path}: not a whole WAV file: {' '.join(str(error).split())}") from None
    value = np.atleast_2d(samples.T).astype(float)
    if samples.dtype.kind == "u":
        value -= 128.0
    if samples.dtype.kind != "f":
        value /= 2.0 ** (8 * samples.dtype.itemsize - 1)
    if not value.size or not np.isfinite(value).all():
        raise RecordError(f"{path}: holds no finite samples")
    name, scale_match = info.get(b"INAM", ""), SCALE.search(info.get(b"ICMT", ""))
    if scale_match is None:
        return Wav(value, float(fs), "", name=name)
    try:
        scale = float(scale_match[1])
    except ValueError:
        scale = np.nan
    if not 0 < scale < np.inf:
        raise RecordError(f'{path}: full scale "{scale_match[1]}" must be a number > 0')
    return Wav(scale * value, float(fs), scale_match[2], scale, name)


def _info(data: bytes) -> dict[bytes, str]:
    """Return the texts of the chunk LIST of type INFO by their names; {} without such a chunk."""
    for name, body in _chunks(data[12:]):
        if name == b"LIST" and body[:4] == b"INFO":
            return {key: text.split(b"\0")[0].decode("utf-8", "replace") for key, text in _chunks(body[4:])}
    return {}


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    offset = 0
    while offset + 8 <= len(data):
        size = struct.unpack("<I", data[offset + 4 : offset + 8])[0]
        yield data[offset : offset + 4], data[offset + 8 : offset + 8 + size]
        offset += 8 + size + size % 2
