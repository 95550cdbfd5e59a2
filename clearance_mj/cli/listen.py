"""clearance-mj listen: hear how a design rattles, and how loud, alone or compared with another."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import sound
from ..core.errors import ClearanceError
from ..engines import simulate_batch
from ..io.formats import read, read_record
from ..model import Model
from ..periodic.axes import level_axis
from ..report.loudness import draw, rows, summary_lines
from ..rig import Plate
from ..signals.response import Response
from ..sound.over_level import SETTLING
from ..tolerance import Scatter
from . import options as shared
from .command import RESULTS, Options, Result, command, option, settings

LEVELS = (0.5, 1.0, 2.0, 5.0)  # RMS, without a PSD


@command(
    "listen", *shared.simulation(3.0, engine="modal"),
    option("--levels", "m/s² or such as 0.1g,1g, or N for a force shaker (default: 0.5,1,2,5, or that of the PSD)",
           shared.levels, metavar="RMS,..."),
    *shared.POWER_SPECTRUM,
    option("--realisations", "noises of each level, which give an interval (default: 1; with --psd, --road or "
           "--scatter 5)", int, metavar="COUNT"),
    option("--scatter", "another design for each, drawn as this file of production says", Path, metavar="FILE"),
    option("--record", "listen to this response or record of the rig's sensors instead of a simulation", Path,
           action="append", metavar="FILE"),
    option("--against", "another rig file, or folder of a model, under --law if given", Path, metavar="RIG"),
    option("--against-gap", "another radial gap at all bushings, such as x0.5 or 0.09mm", metavar="GAP"),
    option("--what", "of the WAV files", default="sound", choices=("sound", "acceleration")),
    option("--full-scale", "Pa or m/s², largest sample of all WAV files (default: what fits)", float),
    option("--sensor", "that the plate moves with (default: of the rig's [plate])", int, metavar="NODE"),
    option("--area", "of the plate, m² (default: of the rig's [plate])", shared.si_number_parser("m2")),
    option("--distance", "at which one listens, m (default: of the rig's [plate])", shared.length),
    option("--method", "of ISO 532-1 for loudness: of all sounds (2 s for each of their seconds), or of stationary "
           "ones; none for WAV files alone", default="time-varying", choices=("time-varying", "stationary", "none")),
    option("--field", "sound field", default="free", choices=("free", "diffuse")),
    shared.WORKERS,
    out_help="folder for WAV files, loudness.csv, .json and .png", base="loudness", writes=RESULTS,
)  # fmt: skip
def run(options: Options) -> Result:
    """Hear what a plate radiates, and how loud it is, over level: WAV files, loudness by ISO 532-1."""
    if options.method != "none" and not sound.has_mosqito():
        raise ClearanceError(
            'loudness needs the package mosqito: pip install "clearance-mj[sound]"; or give --method none'
        )
    models = _load_models(options)
    plates = {name: _plate(options, model, models["A"]) for name, model in models.items()}
    responses = {name: _compute_responses(options, name, model) for name, model in models.items()}
    sound_of = sound.radiate if options.record else sound.audible_sound  # of a simulation without its start
    sounds = {
        name: [sound_of(response, models[name].rig, plates[name]) for _, response in each]
        for name, each in responses.items()
    }
    files, said = _write_wavs(options, models, plates, responses, sounds)
    data: dict[str, Any] = {"designs": {name: settings(model) for name, model in models.items()}, "files": files}
    data |= {"method": options.method, "field": options.field}
    if options.method == "none":
        return Result(data, said)
    shaker = models["A"].rig.shaker
    unit = level_axis((shared.psd_of(options, shaker.kind) or shaker).kind).unit
    every = [heard for each in sounds.values() for heard in each]
    loud = iter(sound.loudness_of_each(every, options.method, options.field, options.workers, not options.quiet))
    over = {}
    for name, each in sounds.items():
        level = tuple(level for level, _ in responses[name])
        over[name] = sound.LoudnessOverLevel(level, tuple(each), tuple(next(loud) for _ in each), unit)
    table = rows(over)
    data["loudness"] = [{str(key): value for key, value in row.items()} for row in table.to_dict("records")]
    return Result(data, [*said, *summary_lines(over)], table, [draw(over)])


def _load_models(options: Options) -> dict[str, Model]:
    """Return design A and, if there is one to compare with, B."""
    if options.record and (options.against or options.against_gap):
        raise ClearanceError("--record is measured: give no --against, nor --against-gap")
    first = shared.load_model(options)
    if not (options.against or options.against_gap):
        return {"A": first}
    second = Model.load(options.against, options.law) if options.against else first
    return {"A": first, "B": second.with_gap(options.against_gap) if options.against_gap else second}


def _plate(options: Options, model: Model, first: Model) -> Plate:
    """Return the radiating plate: the rig's, or else that of A, with the numbers that were given."""
    given = {name: getattr(options, name) for name in ("sensor", "area", "distance")}
    given = {name: value for name, value in given.items() if value is not None}
    plate = model.rig.plate or first.rig.plate
    if plate is None and len(given) < 3:
        raise ClearanceError(
            f'rig "{model.rig.name}" has no [plate]: give --sensor, --area and --distance, or the table in its file'
        )
    return replace(plate, **given) if plate else Plate(**given)


def _compute_responses(options: Options, name: str, model: Model) -> list[tuple[float, Response]]:
    """Return level (RMS) and response of each simulation, or of each record."""
    if options.record:
        measured = [_read_measured(path, model) for path in options.record]
        return [(float(np.sqrt(np.mean(response.excitation**2))), response) for response in measured]
    if options.duration < 2 * SETTLING:
        raise ClearanceError(f"--duration {options.duration:g}: must be at least {2 * SETTLING:g} s")
    psd, count = shared.psd_of(options, model.rig.shaker.kind), options.realisations
    kind = (psd or model.rig.shaker).kind
    if psd and options.sine is not None:
        raise ClearanceError("give --sine, or --psd or --road, one of them")
    count = (5 if psd or options.scatter else 1) if count is None else count
    if not 1 <= count <= 1000:
        raise ClearanceError(f"--realisations {count}: must be 1 to 1000")
    rms = options.levels(kind) if options.levels else (psd.rms,) if psd else LEVELS
    drawn = Scatter.load(options.scatter).draw(model, count, options.seed) if options.scatter else None
    cases = [(level, i) for level in rms for i in range(count)]
    responses = simulate_batch(
        [drawn.model(i) if drawn else model for _, i in cases],
        [shared.excitation(options, kind, level, i, psd) for level, i in cases], None, options.engine, options.workers,
        not options.quiet,
    )  # fmt: skip
    return [(level, response) for (level, _), response in zip(cases, responses)]


def _read_measured(path: Path, model: Model) -> Response:
    response = read(path)
    return response if isinstance(response, Response) else read_record(path, model.rig, "validate").response()


def _write_wavs(
    options: Options, models: dict[str, Model], plates: dict[str, Plate],
    heard: dict[str, list[tuple[float, Response]]], sounds: dict[str, list[sound.Sound]],
) -> tuple[list[str], list[str]]:  # fmt: skip
    """Write the WAV files, all of one full scale; return where they are, and that in words."""
    signals: dict[str, tuple[sound.Sound | Response, int]] = {}
    for name, each in heard.items():
        row = plates[name].row(models[name].rig.sensors)
        for i, (level, response) in enumerate(each):
            title = f"{name}_{options.record[i].stem}" if options.record else f"{name}_{level:g}"
            if f"{title}.wav" in signals and not options.record:
                continue  # of several realisations one is to be heard
            title += f"_{i + 1}" if f"{title}.wav" in signals else ""
            signals[f"{title}.wav"] = (sounds[name][i], 0) if options.what == "sound" else (response, row)
    if (scale := options.full_scale) is None:
        scale = max(sound.full_scale(signal, row) for signal, row in signals.values())
    for file, (signal, row) in signals.items():
        sound.write_wav(options.new / file, signal, scale, row)
    files = [str(options.out / file) for file in signals]
    said = [f"{options.what}: {file}" for file in files]
    return files, [*said, f"full scale of all: {scale:g} {'Pa' if options.what == 'sound' else 'm/s²'}"]
