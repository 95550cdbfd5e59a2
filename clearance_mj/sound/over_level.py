"""Loudness of a design over the level of its excitation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..core.errors import ExcitationError
from ..core.overview import HasOverview, Overview
from ..core.tasks import run_tasks
from ..engines import Engine, simulate_batch
from ..model import Model
from ..rig import Plate, Rig
from ..signals.excitation import Excitation
from ..signals.response import Response
from .pressure import Sound
from .radiation import radiate
from .zwicker import Field, Loudness, Method, loudness

__all__ = ["LoudnessOverLevel", "audible_sound", "loudness_of_each", "loudness_over_level", "sound_over_level"]

SETTLING = 0.5  # s, removed from the beginning of a simulation from rest
WORTH_PROCESSES = 6.0  # s of sounds, above which processes are faster


@dataclass(frozen=True, eq=False, repr=False)
class LoudnessOverLevel(HasOverview):
    """Sounds and their loudness over the level of an excitation."""

    level: tuple[float, ...]
    """RMS of the excitation, m/s² or N"""
    sound: tuple[Sound, ...]
    """one for each level"""
    loudness: tuple[Loudness, ...]
    """one for each level"""
    unit: str = "m/s²"
    """of the level"""

    @property
    def n5(self) -> np.ndarray:
        """(n_levels,) sone, exceeded in 5 % of the time"""
        return np.array([value.n5 for value in self.loudness])

    @property
    def phon(self) -> np.ndarray:
        """(n_levels,) loudness level of N5, phon"""
        return np.array([value.phon for value in self.loudness])

    @property
    def pressure_level(self) -> np.ndarray:
        """(n_levels,) sound pressure level, dB re 20 µPa"""
        return np.array([sound.level for sound in self.sound])

    def _overview(self) -> Overview:
        head = (f"level ({self.unit} RMS)", "sound pressure (dB)", "loudness N5 (sone)", "loudness level (phon)")
        columns = zip(self.level, self.pressure_level, self.n5, self.phon)
        return Overview(
            f"Loudness at {len(self.level)} levels",
            {"method": f"ISO 532-1, {self.loudness[0].method}, {self.loudness[0].field} field"},
            [head, *((f"{a:.4g}", f"{b:.1f}", f"{c:.3g}", f"{d:.1f}") for a, b, c, d in columns)],
        )


def loudness_over_level(
    model: Model, excitation: Excitation, levels: Sequence[float], plate: Plate | None = None,
    engine: str | Engine = "modal", method: Method = "time-varying", field: Field = "free",
    workers: int | None = None, progress: bool = False,
) -> LoudnessOverLevel:  # fmt: skip
    """Simulate a model at several levels of an excitation, and return the loudness of its plate at each.

    Parameters
    ----------
    model : Model
        Rig and law.
    excitation : Excitation
        Excitation, scaled to each level; its sampling rate limits the audible band.
    levels : sequence of float
        RMS of the excitation, m/s² or N, each above 0.
    plate : Plate, optional
        Radiating plate; None: that of the rig.
    engine : str or Engine
        As in `clearance_mj.simulate`.
    method, field
        As in `loudness`.
    workers : int, optional
        Threads that simulate, and processes that compute loudness; None: one for each core.
    progress : bool
        Show progress bars.

    Returns
    -------
    LoudnessOverLevel
        Of the sounds without their first half second, in which the motion builds up from rest.

    Raises
    ------
    ClearanceError
        As `sound_over_level`, `clearance_mj.simulate` and `loudness`.
    """
    sounds = sound_over_level(model, excitation, levels, plate, engine, workers, progress)
    values = loudness_of_each(sounds, method, field, workers, progress)
    return LoudnessOverLevel(tuple(map(float, levels)), sounds, values, "m/s²" if excitation.kind == "base" else "N")


def sound_over_level(
    model: Model, excitation: Excitation, levels: Sequence[float], plate: Plate | None = None,
    engine: str | Engine = "modal", workers: int | None = None, progress: bool = False,
) -> tuple[Sound, ...]:  # fmt: skip
    """Simulate a model at several levels of an excitation, and return the sound of its plate at each.

    Parameters
    ----------
    model, excitation, levels, plate, engine, workers, progress
        As in `loudness_over_level`.

    Returns
    -------
    tuple of Sound
        Without their first half second.

    Raises
    ------
    ExcitationError
        If a level is not above 0, or the excitation is zero or shorter than a second.
    ClearanceError
        As `clearance_mj.simulate` and `radiate`.
    """
    rms = float(np.sqrt(np.mean(excitation.value**2)))
    if not levels or not all(0 < level < np.inf for level in levels):
        raise ExcitationError(f"levels must be one or more numbers > 0, got {list(levels)}")
    if not rms:
        raise ExcitationError("an excitation that is zero has no level to scale")
    if excitation.value.size < 2 * SETTLING * excitation.fs:
        raise ExcitationError(f"an excitation to listen to lasts at least {2 * SETTLING:g} s")
    scaled = [
        replace(excitation, value=excitation.value * (level / rms), description=excitation.description | {"rms": level})
        for level in map(float, levels)
    ]
    responses = simulate_batch(model, scaled, engine=engine, workers=workers, progress=progress)
    return tuple(audible_sound(response, model.rig, plate) for response in responses)


def audible_sound(response: Response, rig: Rig, plate: Plate | None = None) -> Sound:
    """Return the sound of a simulation from rest without its first half second, faded in and out.

    Parameters
    ----------
    response, rig, plate
        As in `radiate`.
    """
    return radiate(response, rig, plate).between(SETTLING).faded()


def loudness_of_each(
    sounds: Sequence[Sound], method: Method = "time-varying", field: Field = "free", workers: int | None = None,
    progress: bool = False,
) -> tuple[Loudness, ...]:  # fmt: skip
    """Return the loudness of several sounds, computed in parallel processes if that is faster.

    A script that calls it for long sounds needs ``if __name__ == "__main__":``, like any script that starts processes.

    Parameters
    ----------
    sounds : sequence of Sound
        Of any lengths.
    method, field
        As in `loudness`.
    workers : int, optional
        Processes; None: one for each core.
    progress : bool
        Show a progress bar.

    Raises
    ------
    ClearanceError
        As `loudness`.
    """
    worthwhile = method == "time-varying" and sum(sound.duration for sound in sounds) > WORTH_PROCESSES
    use_processes = worthwhile and len(sounds) > 1 and workers != 1
    compute, description = partial(loudness, method=method, field=field), "loudness" if progress else ""
    results = dict(run_tasks(compute, sounds, workers, processes=use_processes, progress=description))
    return tuple(results[sound] for sound in sounds)
