"""Sound radiated by a plate, WAV files in physical units, and loudness (ISO 532-1)."""

from typing import TYPE_CHECKING

from ..core.deprecation import old_names
from ..signals.sampling import resampled
from .over_level import LoudnessOverLevel, audible_sound, loudness_of_each, loudness_over_level, sound_over_level
from .pressure import Sound
from .radiation import radiate, velocity
from .wav import Wav, full_scale, read_wav, wav_bytes, write_wav
from .zwicker import Loudness, has_mosqito, loudness, loudness_level

__all__ = [
    "Loudness", "LoudnessOverLevel", "Sound", "Wav", "audible_sound", "full_scale", "has_mosqito", "loudness",
    "loudness_level", "loudness_of_each", "loudness_over_level", "radiate", "read_wav", "resampled", "sound_over_level",
    "velocity", "wav_bytes", "write_wav",
]  # fmt: skip

if not TYPE_CHECKING:
    __getattr__ = old_names(__name__, {"heard": "clearance_mj.sound.audible_sound"})
