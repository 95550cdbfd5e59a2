"""Loudness of the rig's plate over level, of the test and of laws, with excerpts to hear."""

from __future__ import annotations

import base64

from ...sound import LoudnessOverLevel, Sound, full_scale, wav_bytes
from ...study import Study
from ...study.heard import StudySounds
from ..html import paragraph, render
from ..loudness import draw, rows, summary_lines
from ..tables import Column, Table
from ..writer import ReportWriter
from . import section

RATE = 16000.0  # samples per second of the excerpts: records reach 8 kHz at most, and the page stays small
CAPTION = (
    "Loudness N5 by ISO 532-1 (method for sounds that vary, free field) and sound pressure level, of excerpts from the "
    "first record of each level and of laws under its excitation."
)


@section("loudness", "Loudness", 64)
def loudness(study: Study, writer: ReportWriter) -> str:
    """Return loudness over level and excerpts to hear; writes loudness.csv. Nothing of a rig without a plate."""
    if study.dataset.rig.plate is None:
        return ""
    heard = StudySounds(study)
    if heard.missing:
        return paragraph(f"No loudness: {heard.missing}.", "note")
    by_design = heard.over_level
    writer.csv("loudness", rows(by_design).rename(columns={"design": "law"}))
    signals = [sound for each in by_design.values() for sound in each.sound]
    scale = max(full_scale(sound) for sound in signals)
    return render(
        "loudness.html.j2", plate=study.dataset.rig.plate, figure=writer.figure(draw(by_design)), scale=scale,
        said=list(summary_lines(by_design)), shown=_levels(by_design), seconds=signals[0].duration,
        unit=heard.study.unit, levels=heard.study.levels, fs=signals[0].fs,
        players={name: [_audio_url(sound, scale) for sound in each.sound] for name, each in by_design.items()},
    )  # fmt: skip


def _audio_url(sound: Sound, scale: float) -> str:
    """Return the data URL of an excerpt."""
    data = base64.b64encode(wav_bytes(sound, scale, encoding="PCM16", rate=RATE)).decode("ascii")
    return f"data:audio/wav;base64,{data}"


def _levels(by_design: dict[str, LoudnessOverLevel]) -> Table:
    first = next(iter(by_design.values()))
    columns = [Column("Level", first.unit, "g")]
    columns += [Column(name, "sone", ".2f", "Loudness N5") for name in by_design]
    columns += [Column(name, "dB", ".1f", "Sound pressure level") for name in by_design]
    cells = [
        (level, *(each.n5[i] for each in by_design.values()), *(each.pressure_level[i] for each in by_design.values()))
        for i, level in enumerate(first.level)
    ]
    return Table("loudness", CAPTION, tuple(columns), tuple(cells))
