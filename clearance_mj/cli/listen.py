"""clearance-mj listen: hear how a design rattles, and how loud, alone or beside another one."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.errors import ClearanceError
from .command import command, settings, write_results
from .options import add_psd, add_simulation, excitation, in_si, length, levels, load_model, psd_of

if TYPE_CHECKING:  # a command imports what it needs when it runs
    from ..model import Model
    from ..rig import Plate
    from ..signals.response import Response
    from ..sound import LoudnessOverLevel, Sound

LEVELS = (0.5, 1.0, 2.0, 5.0)  # RMS, without a PSD


def _options(parser: argparse.ArgumentParser) -> None:
    option = parser.add_argument
    add_simulation(parser, duration=3.0, engine="modal")
    words = "m/s² or such as 0.1g,1g, or N for a force shaker (default: 0.5,1,2,5, or that of the PSD)"
    option("--levels", type=levels, metavar="RMS,...", help=words)
    add_psd(parser)
    words = "noises of each level, which give an interval (default: 1; with --psd, --road or --scatter 5)"
    option("--realisations", type=int, metavar="COUNT", help=words)
    words = "another design for each, drawn as this file of production says"
    option("--scatter", type=Path, metavar="FILE", help=words)
    words = "listen to this response or record of the rig's sensors instead of a simulation; may be repeated"
    option("--record", type=Path, action="append", default=[], metavar="FILE", help=words)
    option("--against", type=Path, metavar="RIG", help="another rig file, or folder of a model, under --law if given")
    option("--against-gap", metavar="GAP", help="another radial gap at all bushings, such as x0.5 or 0.09mm")
    option("--what", choices=("sound", "acceleration"), default="sound", help="of the WAV files (default: %(default)s)")
    option("--full-scale", type=float, help="Pa or m/s², largest sample of all WAV files (default: what fits)")
    option("--sensor", type=int, metavar="NODE", help="that the plate moves with (default: of the rig's [plate])")
    option("--area", type=in_si("m2"), help="of the plate, m² (default: of the rig's [plate])")
    option("--distance", type=length, help="at which one listens, m (default: of the rig's [plate])")
    option(
        "--method", choices=("time-varying", "stationary", "none"), default="time-varying",
        help="of ISO 532-1 for loudness: of all sounds (2 s for each of their seconds), or of stationary ones; none "
        "for WAV files alone (default: %(default)s)",
    )  # fmt: skip
    option("--field", choices=("free", "diffuse"), default="free", help="sound field (default: %(default)s)")
    option("--workers", type=int, help="threads and processes (default: one for each core)")


@command(
    "listen", "hear what a plate radiates, and how loud it is, over level: WAV files, loudness by ISO 532-1", _options,
    out=Path("results/listen"), out_help="folder for WAV files, loudness.csv, .json and .png (default: %(default)s)",
    writes=("loudness.csv", "loudness.json", "loudness.png"),
)  # fmt: skip
def _run(options: argparse.Namespace) -> dict[str, Any]:
    from ..periodic.axes import level_axis
    from ..sound import has_mosqito, heard, radiate

    if options.method != "none" and not has_mosqito():
        raise ClearanceError(
            'loudness needs the package mosqito: pip install "clearance-mj[sound]"; or give --method none'
        )
    models = _models(options)
    plates = {name: _plate(options, model, models["A"]) for name, model in models.items()}
    responses = {name: _responses(options, name, model) for name, model in models.items()}
    sound_of = radiate if options.record else heard  # of a simulation without its start
    sounds = {
        name: [sound_of(response, models[name].rig, plates[name]) for _, response in each]
        for name, each in responses.items()
    }
    files = _write_wavs(options, models, plates, responses, sounds)
    result: dict[str, Any] = {"designs": {name: settings(model) for name, model in models.items()}, "files": files}
    if options.method != "none":
        shaker = models["A"].rig.shaker
        unit = level_axis((psd_of(options, shaker.kind) or shaker).kind).unit
        levels = {name: [level for level, _ in each] for name, each in responses.items()}
        result["loudness"] = _loudness(options, unit, levels, sounds)
    return write_results(options, "loudness", result | {"method": options.method, "field": options.field})


def _models(options: argparse.Namespace) -> dict[str, Model]:
    """Design A and, if there is one to compare with, B."""
    from ..model import Model

    if options.record and (options.against or options.against_gap):
        raise ClearanceError("--record is measured: give no --against, nor --against-gap")
    first = load_model(options)
    if not (options.against or options.against_gap):
        return {"A": first}
    second = Model.load(options.against, options.law) if options.against else first
    return {"A": first, "B": second.with_gap(options.against_gap) if options.against_gap else second}


def _plate(options: argparse.Namespace, model: Model, first: Model) -> Plate:
    """What radiates: the rig's plate, or else that of A, with the numbers that were asked for."""
    from ..rig import Plate

    given = {name: getattr(options, name) for name in ("sensor", "area", "distance")}
    given = {name: value for name, value in given.items() if value is not None}
    plate = model.rig.plate or first.rig.plate
    if plate is None and len(given) < 3:
        raise ClearanceError(
            f'rig "{model.rig.name}" has no [plate]: give --sensor, --area and --distance, or the table in its file'
        )
    return replace(plate, **given) if plate else Plate(**given)


def _responses(options: argparse.Namespace, name: str, model: Model) -> list[tuple[float, Response]]:
    """Level, RMS, and response of each simulation, or of each record."""
    import numpy as np

    from ..engines import simulate_batch
    from ..sound.over_level import SETTLING
    from ..tolerance import Scatter

    if options.record:
        measured = [_measured(path, model) for path in options.record]
        return [(float(np.sqrt(np.mean(response.excitation**2))), response) for response in measured]
    if options.duration < 2 * SETTLING:
        raise ClearanceError(f"--duration {options.duration:g}: must be at least {2 * SETTLING:g} s")
    psd, count = psd_of(options, model.rig.shaker.kind), options.realisations
    kind = (psd or model.rig.shaker).kind
    if psd and options.sine is not None:
        raise ClearanceError("give --sine, or --psd or --road, one of them")
    count = (5 if psd or options.scatter else 1) if count is None else count
    if not 1 <= count <= 1000:
        raise ClearanceError(f"--realisations {count}: must be 1 to 1000")
    rms = options.levels(kind) if options.levels else (psd.rms,) if psd else LEVELS
    drawn = Scatter.load(options.scatter).draw(model, count, options.seed) if options.scatter else None
    cases = [(level, i) for level in rms for i in range(count)]
    found = simulate_batch(
        [drawn.model(i) if drawn else model for _, i in cases],
        [excitation(options, kind, level, i, psd) for level, i in cases], None, options.engine, options.workers,
        not options.quiet,
    )  # fmt: skip
    return [(level, response) for (level, _), response in zip(cases, found)]


def _measured(path: Path, model: Model) -> Response:
    from ..io.formats import read, read_record
    from ..signals.response import Response

    found = read(path)
    return found if isinstance(found, Response) else read_record(path, model.rig, "validate").response()


def _write_wavs(
    options: argparse.Namespace, models: dict[str, Model], plates: dict[str, Plate],
    heard: dict[str, list[tuple[float, Response]]], sounds: dict[str, list[Sound]],
) -> list[str]:  # fmt: skip
    """Write the WAV files, all of one full scale, and return where they are."""
    from ..sound import full_scale, write_wav

    signals: dict[str, tuple[Sound | Response, int]] = {}
    for name, each in heard.items():
        row = plates[name].row(models[name].rig.sensors)
        for i, (level, response) in enumerate(each):
            title = f"{name}_{options.record[i].stem}" if options.record else f"{name}_{level:g}"
            if f"{title}.wav" in signals and not options.record:
                continue  # of several realisations one is to be heard
            title += f"_{i + 1}" if f"{title}.wav" in signals else ""
            signals[f"{title}.wav"] = (sounds[name][i], 0) if options.what == "sound" else (response, row)
    if (scale := options.full_scale) is None:
        scale = max(full_scale(signal, row) for signal, row in signals.values())
    for file, (signal, row) in signals.items():
        write_wav(options.new / file, signal, scale, row)
        print(f"{options.what}: {options.out / file}")
    print(f"full scale of all: {scale:g} {'Pa' if options.what == 'sound' else 'm/s²'}")
    return [str(options.out / file) for file in signals]


def _loudness(
    options: argparse.Namespace, unit: str, levels: dict[str, list[float]], sounds: dict[str, list[Sound]]
) -> list[dict[str, Any]]:
    """Compute, write and say how loud each sound is."""
    from ..report.loudness import draw, rows, words
    from ..report.tables import write_csv
    from ..sound import LoudnessOverLevel, loudness_of_each

    every = [sound for each in sounds.values() for sound in each]
    found = iter(loudness_of_each(every, options.method, options.field, options.workers, not options.quiet))
    over: dict[str, LoudnessOverLevel] = {}
    for name, each in sounds.items():
        over[name] = LoudnessOverLevel(tuple(levels[name]), tuple(each), tuple(next(found) for _ in each), unit)
    table = rows(over)
    write_csv(options.new / "loudness.csv", table)
    draw(over).write(options.new)
    print("\n".join(words(over)))
    print(f"loudness: {options.out / 'loudness.png'}")
    return [{str(key): value for key, value in row.items()} for row in table.to_dict("records")]
