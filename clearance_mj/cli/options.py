"""Options of several commands, and their values: plugins, columns of files, a rig under excitation."""

from __future__ import annotations

import argparse
import functools
import importlib
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..core.checks import naming
from ..core.errors import ClearanceError
from ..core.units import si_value
from ..engines import default_engine
from ..estimate import Estimates
from ..identify.structure import priors
from ..io.channel_map import ChannelMap
from ..io.formats import Contents, read, read_channels
from ..model import Model, model_warnings
from ..rig import Rig
from ..rig.plausible import check_units
from ..signals import excitation as excitations
from ..signals.excitation import Excitation
from ..signals.psd import PSD
from ..signals.road import road_psd
from .command import Group, Option, Options, inform, option

MAX_NUMBERS = 10_000  # numbers of a range
T = TypeVar("T")


def numbers(text: str, quantity: str = "") -> tuple[float, ...]:
    """Return the numbers above 0 of a list, such as 0.5,1,2, or of a range FROM:TO:COUNT, such as 0.5:10:50.

    Those of a quantity may have a unit, such as 0.1mm,0.2mm.
    """
    number = si_number_parser(quantity) if quantity else float
    try:
        if ":" in text:
            low, high, count = text.split(":")
            values = tuple(_evenly(number(low), number(high), int(count)))
        else:
            values = tuple(number(part) for part in text.split(","))
    except ValueError:
        values = ()
    if not values or not all(0 < number < math.inf for number in values):
        raise argparse.ArgumentTypeError(
            f"{text!r} is neither a list of numbers above 0, such as 0.5,1,2, nor a range FROM:TO:COUNT of up to "
            f"{MAX_NUMBERS}, such as 0.5:10:50"
        )
    return values


def number_list_parser(kind: type[float], words: str) -> Callable[[str], list[float]]:
    """Return a parser of a list of numbers of one kind; ``words`` say in messages of what it is, such as "of modes"."""

    def parse(text: str) -> list[float]:
        try:
            return [kind(part) for part in text.split(",")]
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a list {words}") from None

    return parse


def _evenly(low: float, high: float, count: int) -> Iterator[float]:
    if not 2 <= count <= MAX_NUMBERS:
        raise ValueError
    return ((low * (count - 1 - i) + high * i) / (count - 1) for i in range(count))


def _with_unit(text: str, quantity: str) -> float:
    try:
        return si_value(text, quantity)
    except ClearanceError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def si_number_parser(quantity: str) -> Callable[[str], float]:
    """Return a parser of numbers that may have a unit of a quantity, such as 5mil, or an SI unit, such as kg/m3."""
    return functools.partial(_with_unit, quantity=quantity)


length, pressure, spin, seconds, hertz = map(
    si_number_parser, ("displacement", "pressure", "spin", "time", "frequency")
)
lengths, frequencies = (functools.partial(numbers, quantity=each) for each in ("displacement", "frequency"))
LEVEL_OF = {"base": "acceleration", "force": "force"}  # quantity of an excitation's level; else it is a factor


def _of_kind(read: Callable[[str, str], T], text: str, kind: str) -> T:
    """Read a level, which may have a unit such as 0.5g or 3N, now that the kind of the excitation is known."""
    with naming(f'level {text} of kind "{kind}"', argparse.ArgumentTypeError, ClearanceError):
        return read(text, LEVEL_OF.get(kind, "factor"))


def _by_kind(read: Callable[[str, str], T], text: str) -> Callable[[str], T]:
    """Return a parser of a level's text for a known kind of excitation; it raises an error for other texts."""
    try:
        read(text, "force")
    except argparse.ArgumentTypeError:
        read(text, "acceleration")
    return functools.partial(_of_kind, read, text)


def point(text: str) -> float | str:
    """Return a place on the shaft in m, which may have a unit, or the name of another point, such as "12:+Z"."""
    try:
        return si_value(text, "displacement")
    except ClearanceError:
        return text


level, levels = (functools.partial(_by_kind, read) for read in (_with_unit, numbers))


def kmh(text: str) -> float:
    """Return a speed, km/h, of a number in these or with another unit, such as 22m/s or 50mph."""
    try:
        return float(text)
    except ValueError:
        return round(3.6 * _with_unit(text, "velocity"), 9)


class Pair(argparse.Action):
    """Keep two values as a tuple."""

    def __call__(self, parser: Any, namespace: argparse.Namespace, values: Any, flag: str | None = None) -> None:
        """Store the two values."""
        setattr(namespace, self.dest, tuple(values))


class Columns(argparse.Action):
    """Keep the header and channel of each "HEADER=CHANNEL"."""

    def __call__(self, parser: Any, namespace: argparse.Namespace, values: Any, flag: str | None = None) -> None:
        """Add a column; a ClearanceError names the option if it is none."""
        header, equals, channel = values.rpartition("=")
        if not (header and equals and channel):
            raise ClearanceError(f'{flag} "{values}": needs HEADER=CHANNEL, such as "Accel 1=acc:1 [g]"')
        setattr(namespace, self.dest, getattr(namespace, self.dest) | {header.strip(): channel.strip()})


def band(help: str, default: tuple[float, float] | None = None) -> Option:
    """Return the option for two frequencies."""
    return option("--band", help, hertz, default, nargs=2, metavar=("LOW", "HIGH"), action=Pair)


def kind(*more: str, default: str = "as the rig's shaker") -> Option:
    """Return the option that says what excites: base, force, or ``more``; ``default`` says what does without it."""
    return option("--kind", f"what excites (default: {default})", choices=("base", "force", *more))


def speeds(name: str, words: str, default: str) -> Option:
    """Return the option for two spins; ``default`` says what is taken without it."""
    words = f"{words}: rad/s, or with a unit such as 3000rpm or 50Hz (default: {default})"
    return option(name, words, spin, nargs=2, metavar=("FROM", "TO"))


def plugin(what: str) -> Option:
    """Return the option for a user's file; ``what`` that registers has an article."""
    return option("--plugin", f"Python file that registers {what} of your own", Path, metavar="FILE")


def columns(name: str = "--column", of: str = "a CSV, LVM or MATLAB file") -> Option:
    """Return the option ``name`` that maps columns ``of`` some file."""
    words = (
        f'what a column of {of} is, such as "Accel 1=acc:1 [g]" or "Temp=skip"; may be repeated. Headers time, base, '
        "force, keyphasor, acc:NODE and disp:NODE need none; units in brackets, SI without"
    )
    return Option(name, {"help": words, "action": Columns, "default": {}, "metavar": "HEADER=CHANNEL"})


SEED = option("--seed", "of what is random: noise, draws, starts", int, 0)
WORKERS = option("--workers", "threads or processes (default: one for each core)", int)
SCHEDULER = option("--scheduler", "of a Dask cluster, such as tcp://10.0.0.1:8786", metavar="ADDRESS")
WHERE = Group(None, (WORKERS, SCHEDULER))
RATE = (
    option("--fs", "samples per second of what has no times, or uneven ones of this rate", hertz),
    option("--resample", "bring all records to this many samples per second, over the time that they share, uneven "
           "ones too", hertz, metavar="RATE"),
)  # fmt: skip
"""Sampling rate of files, and another to which their records are brought"""
RECORDS = (
    columns(), option("--map", "map of the files' channels (TOML), as clearance-mj map writes it", Path, metavar="MAP"),
    *RATE,
)  # fmt: skip
"""Options that name the channels of records, see `reading`"""
FILES = (
    *RECORDS,
    option("--units", "units of a universal file, whatever its data set 164 says: SI, or length and force, such as "
           '"mm,N"', metavar="UNITS"),
    plugin("a file format"),
)  # fmt: skip
"""Options for reading files of any format, see `reading`"""
WHAT = option("--what", 'of a file that holds several things: channels, frf, "frf 2", spectra, modes, geometry')
MODEL_FOLDER = "rig file (TOML), or a folder with rig.toml and, if one was identified, law.json"
LAW_AND_GAP = (
    option("--law", "law file (default: the folder's, or the rig's datasheet contact)", Path),
    option("--gap", "radial gap instead of the rig's: m, with a unit such as 0.09mm, or a factor such as x0.5; of all "
           "bushings, or of one, such as 7:+Z=x0.5 or bushings[0]=0.09mm", action="append", metavar="[BUSHING=]VALUE"),
)  # fmt: skip
RIG = (option("rig", MODEL_FOLDER, Path), *LAW_AND_GAP)
"""A model, see `load_model`"""
POWER_SPECTRUM = (
    option("--psd", "CSV with columns frequency (Hz) and psd, (m/s²)²/Hz or N²/Hz", Path, metavar="FILE"),
    option("--road", "road of ISO 8608 instead, A to H, under a quarter-car", metavar="CLASS"),
    option("--speed", "of the car on the road, km/h, or such as 22m/s or 50mph", kmh, metavar="KM/H"),
    option("--at", "what of the car the rig is fixed to", default="hub", choices=("hub", "body")),
)
"""A power spectral density, see `psd_of`"""
SINES = ("amplitudes of a sine, m/s² of the base or N, or factors of the unbalances: a list, such as 0.1g,1g, or a "
         "range FROM:TO:COUNT")  # fmt: skip
GRID: dict[str, Any] = {"levels": levels("0.5:10:20"), "start": 5.0, "stop": 220.0, "steps": 400}
"""Values of `OVER_GRID` that are not given"""
OVER_GRID = (
    option("--levels", f"{SINES} (default: 0.5:10:20)", levels, metavar="A,..."),
    option("--from", f"(default: {GRID['start']})", hertz, dest="start", metavar="HZ"),
    option("--to", f"(default: {GRID['stop']})", hertz, dest="stop", metavar="HZ"),
    option("--steps", f"frequencies, evenly spaced (default: {GRID['steps']})", int, metavar="COUNT"),
)
"""Over which levels and frequencies of a sine a map goes, see `grid`"""
PERIODIC = ("harmonics", "samples", "modes")  # options of the solver of periodic vibrations


def periodic(harmonics: int | None = 21) -> tuple[Option, ...]:
    """Return the options of a command that finds periodic vibrations: a model, see `load_model`, and how."""
    return (
        *RIG,
        option("--harmonics", f"of the motion (default: {harmonics or 'as modes need'})", int, harmonics),
        option("--samples", "of a period (default: the power of two from 12 for each harmonic on)", int),
        option("--modes", "of the rig's Ritz basis", int, 8),
    )


def forced(harmonics: int | None = 21) -> tuple[Option, ...]:
    """Return the options of `periodic`, and the one that says what excites a vibration: unbalance too."""
    words = (
        "what excites (default: unbalance of a rig that has some, else as the rig's shaker); under unbalance "
        "frequencies are turns in a second and levels factors of the rig's unbalances"
    )
    return *periodic(harmonics), option("--kind", words, choices=("base", "force", "unbalance"))


def noise(duration: float, fs: float, words: str = "s that are simulated") -> tuple[Option, ...]:
    """Return the options that noise has."""
    return (
        band("of noise, Hz (default: 5 220)", (5.0, 220.0)),
        SEED,
        option("--duration", words, seconds, duration),
        option("--fs", "samples per second", hertz, fs),
    )


def simulation(
    duration: float, fs: float = 8192.0, engine: str | None = None, rig: str = MODEL_FOLDER
) -> tuple[Option, ...]:
    """Return the options of a command that simulates a rig; its engine, if none is given, see `load_model`."""
    sine = option("--sine", "drive with a sine (default: with noise)", hertz, metavar="HZ")
    words = f"links, modal or mjx (default: {engine or 'links where it can, else modal'})"
    engines = option("--engine", words, str, engine)
    return option("rig", rig, Path), *LAW_AND_GAP, engines, sine, *noise(duration, fs)


def load_plugin(plugin: Path | None) -> None:
    """Import a file, if one was given, by its name, so that other processes can import it too."""
    if plugin is None:
        return
    if not plugin.is_file():
        raise ClearanceError(f"--plugin {plugin}: no such file")
    sys.path.insert(0, str(plugin.resolve().parent))
    try:
        module = importlib.import_module(plugin.stem)
    except Exception as error:  # whatever a user's file does wrong
        raise ClearanceError(f"--plugin {plugin}: {type(error).__name__}: {error}") from error
    if Path(module.__file__ or "").resolve() != plugin.resolve():
        raise ClearanceError(f"--plugin {plugin}: another module has this name; rename the file")


def reading(options: Options) -> dict[str, Any]:
    """Return the options `RECORDS` or `FILES` as arguments of `read_channels` and `read_record`."""
    mapped = ChannelMap.load(options.map) if options.map else None
    given = {"columns": options.column, "fs": options.fs, "resample": options.resample}
    return given | {"units": getattr(options, "units", None), "channel_map": mapped}


def read_file(path: Path, options: Options, rig: Rig | None = None) -> Contents:
    """Return what a file holds, read by the options `FILES` and `WHAT`; a rig says where displacements are."""
    given = reading(options)
    if options.map and options.what in (None, "channels"):
        return read_channels(path, rig=rig, **given)
    return read(path, what=options.what, **{name: value for name, value in given.items() if name != "channel_map"})


def load_model(options: Options) -> Model:
    """Return the model of the options `RIG`, see `Model.load`, with the gaps that are asked for.

    An engine that was not asked for is then known.
    """
    model = Model.load(options.rig, options.law)
    for words in model_warnings(model, None if options.gap else options.rig):
        inform(f"{options.rig}: {words}", "warning")
    if getattr(options, "engine", "") is None:
        options.engine = default_engine(model.rig)
    if not options.gap:
        return model
    model = model.with_gap(by_bushing(options.gap, "--gap"))
    check_units(model.rig.linear, model.rig.bushings)
    if model.law.table(len(model.rig.bushings)).by_amplitude:
        words = "the law's stiffness over amplitude was found at the gap before; a contact model holds at any gap"
        inform(f"--gap: {words} (identify by method bench finds one)")
    return model


def by_bushing(texts: Sequence[str], option: str) -> str | dict[str, str]:
    """Return the one value of an option that may be repeated, or the values by the bushings that they are given for."""
    parts = [text.rpartition("=") for text in texts]
    if len(parts) > 1 and not all(name for name, _, _ in parts):
        raise ClearanceError(f"{option} {f' {option} '.join(texts)}: give one for all, or BUSHING=VALUE of each")
    return {name: value for name, _, value in parts} if parts[0][0] else parts[0][2]


def parameter_words(estimates: Estimates, width: int, head: str) -> Iterator[str]:
    """Yield each parameter before and now; ``head`` names the columns behind those of its name and of before."""
    yield f"{'parameter':{width}s} {'before':>11s} {head}"
    for row in estimates.beside_priors():
        words = "{before:11.5g} {value:11.5g} ± {std:.2g} {unit} ({posterior_over_prior:.2f})".format(**row)
        yield f"{priors.parameter_words(row['name']):{width}s} {words}"


def periodic_settings(options: Options) -> dict[str, Any]:
    """Return the options of `periodic` for the solver, as arguments of that subpackage."""
    return {f"n_{name}": getattr(options, name) for name in PERIODIC}


def grid(options: Options, kind: str, least: int) -> tuple[tuple[float, ...], np.ndarray]:
    """Return the levels and the frequencies, Hz, of `OVER_GRID`, of which there must be at least so many."""
    given = GRID | {name: value for name in GRID if (value := getattr(options, name)) is not None}
    if not least <= given["steps"] <= MAX_NUMBERS:
        raise ClearanceError(f"--steps must be between {least} and {MAX_NUMBERS}, got {given['steps']}")
    return given["levels"](kind), np.linspace(given["start"], given["stop"], given["steps"])


def excitation(options: Options, kind: str, rms: float, realisation: int = 0, psd: PSD | None = None) -> Excitation:
    """Return the excitation of one level; of level 0 none, under which gravity and unbalance alone act."""
    if rms == 0:
        return excitations.still(options.duration, options.fs, kind)
    if options.sine is not None:
        return excitations.stepped_sine(options.duration, options.fs, options.sine, math.sqrt(2) * rms, kind)
    seed = options.seed + realisation
    if psd:
        return excitations.from_psd(psd.scaled(rms), options.duration, options.fs, seed)
    return excitations.random(options.duration, options.fs, tuple(options.band), rms, seed, kind)


def psd_of(options: Options, kind: str) -> PSD | None:
    """Return the excitation that the options `POWER_SPECTRUM` name: a file, whose kind is given, or a road; or None."""
    if options.psd is not None and options.road is not None:
        raise ClearanceError("give --psd FILE or --road CLASS, one of them")
    if options.psd:
        return PSD.load(options.psd, kind)
    if options.road is None:
        return None
    if options.speed is None:
        raise ClearanceError("--road needs --speed, km/h")
    return road_psd(options.road, options.speed / 3.6, at=options.at)
