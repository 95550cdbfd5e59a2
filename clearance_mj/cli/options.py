"""Options that several commands have, and what is made of them: plugins, columns of files, a rig under excitation."""

from __future__ import annotations

import argparse
import functools
import importlib
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from ..core.errors import ClearanceError
from .command import say

if TYPE_CHECKING:  # the command line starts without the library
    import numpy as np

    from ..estimate import Estimates
    from ..model import Model
    from ..signals.excitation import Excitation
    from ..signals.psd import PSD

MAX_NUMBERS = 10_000  # numbers of a range
T = TypeVar("T")


def add_plugin(parser: argparse.ArgumentParser, what: str) -> None:
    """Add the option; ``what`` the file registers has an article."""
    parser.add_argument("--plugin", type=Path, metavar="FILE", help=f"Python file that registers {what} of your own")


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


def add_columns(parser: argparse.ArgumentParser, name: str = "--column", of: str = "a CSV, LVM or MATLAB file") -> None:
    """Add the option ``name`` that maps columns ``of`` some file."""
    words = (
        f'what a column of {of} is, such as "Accel 1=acc:1 [g]" or "Temp=skip"; may be repeated. Headers time, base, '
        "force, keyphasor, acc:NODE and disp:NODE need none; units in brackets, SI without"
    )
    parser.add_argument(name, action="append", default=[], metavar="HEADER=CHANNEL", help=words)


def add_rate(parser: argparse.ArgumentParser) -> None:
    """Add the options that say the sampling rate of files, and another to which their records are brought."""
    parser.add_argument("--fs", type=hertz, help="samples per second of what has no times, or uneven ones of this rate")
    words = "bring all records to this many samples per second, over the time that they share, uneven ones too"
    parser.add_argument("--resample", type=hertz, metavar="RATE", help=words)


def add_records(parser: argparse.ArgumentParser) -> None:
    """Add the options that say what the channels of records are, see `reading`."""
    add_columns(parser)
    words = "map of the files' channels (TOML), as clearance-mj map writes it"
    parser.add_argument("--map", type=Path, metavar="MAP", help=words)
    add_rate(parser)


def add_files(parser: argparse.ArgumentParser) -> None:
    """Add the options with which files of any format are read, see `reading`."""
    add_records(parser)
    words = 'units of a universal file, whatever its data set 164 says: SI, or length and force, such as "mm,N"'
    parser.add_argument("--units", metavar="UNITS", help=words)
    add_plugin(parser, "a file format")


def reading(options: argparse.Namespace) -> dict[str, Any]:
    """Return the options of `add_records` or `add_files` as arguments of `read_channels` and `read_record`."""
    from ..io.channel_map import ChannelMap

    mapped = ChannelMap.load(options.map) if options.map else None
    given = {"columns": parse_columns(options.column), "fs": options.fs, "resample": options.resample}
    return given | {"units": getattr(options, "units", None), "channel_map": mapped}


def parse_columns(pairs: Sequence[str], option: str = "--column") -> dict[str, str]:
    """Return the header and channel of each "HEADER=CHANNEL"; a ClearanceError names the option if one is none."""
    found = {}
    for pair in pairs:
        header, equals, channel = pair.rpartition("=")
        if not (header and equals and channel):
            raise ClearanceError(f'{option} "{pair}": needs HEADER=CHANNEL, such as "Accel 1=acc:1 [g]"')
        found[header.strip()] = channel.strip()
    return found


def add_rig(parser: argparse.ArgumentParser) -> None:
    """Add the options that name a model, see `load_model`."""
    option = parser.add_argument
    option("rig", type=Path, help="rig file (TOML), or a folder with rig.toml and, if one was identified, law.json")
    option("--law", type=Path, help="law file (default: the folder's, or the rig's datasheet contact)")
    words = (
        "radial gap instead of the rig's: m, with a unit such as 0.09mm, or a factor such as x0.5; of all bushings, "
        "or of one, such as 7:+Z=x0.5 or bushings[0]=0.09mm, which may be repeated"
    )
    option("--gap", action="append", default=[], metavar="[BUSHING=]VALUE", help=words)


def load_model(options: argparse.Namespace) -> Model:
    """Return the model of the options of `add_rig`, see `Model.load`, with the gaps that are asked for.

    An engine that was not asked for is then known.
    """
    from ..model import Model, model_warnings
    from ..rig.plausible import check_units

    model = Model.load(options.rig, options.law)
    for words in model_warnings(model, None if options.gap else options.rig):
        say(f"{options.rig}: {words}", "warning")
    if getattr(options, "engine", "") is None:
        from ..engines import default_engine

        options.engine = default_engine(model.rig)
    if not options.gap:
        return model
    model = model.with_gap(by_bushing(options.gap, "--gap"))
    check_units(model.rig.linear, model.rig.bushings)
    if model.law.table(len(model.rig.bushings)).by_amplitude:
        words = "the law's stiffness over amplitude was found at the gap before; a contact model holds at any gap"
        say(f"--gap: {words} (identify by method bench finds one)")
    return model


def by_bushing(texts: Sequence[str], option: str) -> str | dict[str, str]:
    """Return the one value of an option that may be repeated, or the values by the bushings that they are given for."""
    parts = [text.rpartition("=") for text in texts]
    if len(parts) > 1 and not all(name for name, _, _ in parts):
        raise ClearanceError(f"{option} {f' {option} '.join(texts)}: give one for all, or BUSHING=VALUE of each")
    return {name: value for name, _, value in parts} if parts[0][0] else parts[0][2]


def add_simulation(
    parser: argparse.ArgumentParser, duration: float, fs: float = 8192.0, engine: str | None = None
) -> None:
    """Add the options of a command that simulates a rig; its engine, if none is given, see `load_model`."""
    add_rig(parser)
    option = parser.add_argument
    default = engine or "links where it can, else modal"
    option("--engine", default=engine, help=f"links or modal (default: {default})")
    option("--sine", type=hertz, metavar="HZ", help="drive with a sine (default: with noise)")
    option("--band", type=hertz, nargs=2, default=(5.0, 220.0), metavar=("LOW", "HIGH"), help="of noise, Hz (5 220)")
    option("--seed", type=int, default=0, help="of noise (default: %(default)s)")
    option("--duration", type=seconds, default=duration, help="s that are simulated (default: %(default)s)")
    option("--fs", type=hertz, default=fs, help="samples per second (default: %(default)s)")


PERIODIC = ("harmonics", "samples", "modes")  # options that say how vibrations are found


def add_periodic(parser: argparse.ArgumentParser, harmonics: int | None = 21) -> None:
    """Add the options of a command that finds periodic vibrations: a model, see `load_model`, and how."""
    add_rig(parser)
    option = parser.add_argument
    option("--harmonics", type=int, default=harmonics, help=f"of the motion (default: {harmonics or 'as modes need'})")
    option("--samples", type=int, help="of a period (default: the power of two from 12 for each harmonic on)")
    option("--modes", type=int, default=8, help="of the rig's Ritz basis (default: %(default)s)")


def add_forced(parser: argparse.ArgumentParser, harmonics: int | None = 21) -> None:
    """Add the options of `add_periodic`, and the one that says what excites a vibration: unbalance too."""
    add_periodic(parser, harmonics)
    words = "what excites (default: unbalance of a rig that has some, else as the rig's shaker); under unbalance "
    words += "frequencies are turns in a second and levels factors of the rig's unbalances"
    parser.add_argument("--kind", choices=("base", "force", "unbalance"), help=words)


def periodic_settings(options: argparse.Namespace) -> dict[str, Any]:
    """Return the options of `add_periodic` that say how vibrations are found, as arguments of `periodic`."""
    return {f"n_{name}": getattr(options, name) for name in PERIODIC}


def add_kind(parser: argparse.ArgumentParser, *more: str, default: str = "as the rig's shaker") -> None:
    """Add the option that says what excites: base, force, or ``more``; ``default`` says what does without it."""
    parser.add_argument("--kind", choices=("base", "force", *more), help=f"what excites (default: {default})")


def print_parameters(estimates: Estimates, width: int, head: str) -> None:
    """Print each parameter before and now; ``head`` names the columns behind those of its name and of before."""
    from ..identify.structure.priors import parameter_words

    print(f"{'parameter':{width}s} {'before':>11s} {head}")
    for row in estimates.beside_priors():
        words = "{before:11.5g} {value:11.5g} ± {std:.2g} {unit} ({posterior_over_prior:.2f})".format(**row)
        print(f"{parameter_words(row['name']):{width}s} {words}")


def numbers(text: str, quantity: str = "") -> tuple[float, ...]:
    """Return the numbers above 0 of a list, such as 0.5,1,2, or of a range FROM:TO:COUNT, such as 0.5:10:50.

    Those of a quantity may have a unit, such as 0.1mm,0.2mm.
    """
    number = in_si(quantity) if quantity else float
    try:
        if ":" in text:
            low, high, count = text.split(":")
            found = tuple(_evenly(number(low), number(high), int(count)))
        else:
            found = tuple(number(part) for part in text.split(","))
    except ValueError:
        found = ()
    if not found or not all(0 < number < math.inf for number in found):
        raise argparse.ArgumentTypeError(
            f"{text!r} is neither a list of numbers above 0, such as 0.5,1,2, nor a range FROM:TO:COUNT of up to "
            f"{MAX_NUMBERS}, such as 0.5:10:50"
        )
    return found


def listed(kind: type[float], words: str) -> Callable[[str], list[float]]:
    """Return what reads a list of numbers of one kind; ``words`` say in messages of what it is, such as "of modes"."""

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


def add_grid(parser: argparse.ArgumentParser) -> None:
    """Add the options that say over which levels and frequencies of a sine a map goes, see `grid`."""
    option = parser.add_argument
    words = "amplitudes of a sine, m/s² of the base or N, or factors of the unbalances: a list, such as 0.1g,1g, or "
    words += "a range FROM:TO:COUNT (default: 0.5:10:20)"
    option("--levels", type=levels, metavar="A,...", help=words)
    option("--from", dest="start", type=hertz, metavar="HZ", help=f"(default: {GRID['start']})")
    option("--to", dest="stop", type=hertz, metavar="HZ", help=f"(default: {GRID['stop']})")
    option("--steps", type=int, metavar="COUNT", help=f"frequencies, evenly spaced (default: {GRID['steps']})")


def grid(options: argparse.Namespace, kind: str, least: int) -> tuple[tuple[float, ...], np.ndarray]:
    """Return the levels and the frequencies, Hz, of `add_grid`, of which there must be at least so many."""
    import numpy as np

    given = GRID | {name: value for name in GRID if (value := getattr(options, name)) is not None}
    if not least <= given["steps"] <= MAX_NUMBERS:
        raise ClearanceError(f"--steps must be between {least} and {MAX_NUMBERS}, got {given['steps']}")
    return given["levels"](kind), np.linspace(given["start"], given["stop"], given["steps"])


def _with_unit(text: str, quantity: str) -> float:
    from ..core.units import si_value

    try:
        return si_value(text, quantity)
    except ClearanceError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def in_si(quantity: str) -> Callable[[str], float]:
    """Return what reads a number that may have a unit of a quantity, such as 5mil, or of an SI unit, such as kg/m3."""
    return functools.partial(_with_unit, quantity=quantity)


length, pressure, spin, seconds, hertz = map(in_si, ("displacement", "pressure", "spin", "time", "frequency"))
lengths, frequencies = (functools.partial(numbers, quantity=each) for each in ("displacement", "frequency"))
LEVEL_OF = {"base": "acceleration", "force": "force"}  # quantity of an excitation's level; else it is a factor


def _of_kind(read: Callable[[str, str], T], text: str, kind: str) -> T:
    """Read a level, which may have a unit such as 0.5g or 3N, now that the kind of the excitation is known."""
    try:
        return read(text, LEVEL_OF.get(kind, "factor"))
    except argparse.ArgumentTypeError as error:
        raise ClearanceError(f'level {text} of kind "{kind}": {error}') from None


def _by_kind(read: Callable[[str, str], T], text: str) -> Callable[[str], T]:
    """Return what makes of a level's text its value, once the kind of the excitation is known; refuse what is none."""
    try:
        read(text, "force")
    except argparse.ArgumentTypeError:
        read(text, "acceleration")
    return functools.partial(_of_kind, read, text)


level, levels = (functools.partial(_by_kind, read) for read in (_with_unit, numbers))
GRID: dict[str, Any] = {"levels": levels("0.5:10:20"), "start": 5.0, "stop": 220.0, "steps": 400}
"""Options of `add_grid` that are not given"""


def kmh(text: str) -> float:
    """Return a speed, km/h, of a number in these or with another unit, such as 22m/s or 50mph."""
    try:
        return float(text)
    except ValueError:
        return round(3.6 * _with_unit(text, "velocity"), 9)


def add_speeds(parser: argparse.ArgumentParser, name: str, words: str, default: str = "") -> None:
    """Let a command be given two spins; it needs them where ``default`` does not say what it takes without."""
    words = f"{words}: rad/s, or with a unit such as 3000rpm or 50Hz" + f" (default: {default})" * bool(default)
    parser.add_argument(name, type=spin, nargs=2, metavar=("FROM", "TO"), required=not default, help=words)


def speeds(options: argparse.Namespace) -> np.ndarray:
    """Return the spins, rad/s, that ``--speeds`` and ``--points`` say."""
    import numpy as np

    first, last = options.speeds
    if not 0 <= first < last:
        raise ClearanceError(f"--speeds {first:g} {last:g} rad/s: must rise, from 0 on")
    if options.points < 2:
        raise ClearanceError(f"--points {options.points}: must be at least 2")
    return np.linspace(first, last, options.points)


def excitation(
    options: argparse.Namespace, kind: str, rms: float, realisation: int = 0, psd: PSD | None = None
) -> Excitation:
    """Return the excitation of one level; of level 0 none, under which gravity and unbalance alone act."""
    from ..signals.excitation import from_psd, random, stepped_sine, still

    if rms == 0:
        return still(options.duration, options.fs, kind)
    if options.sine is not None:
        return stepped_sine(options.duration, options.fs, options.sine, math.sqrt(2) * rms, kind)
    seed = options.seed + realisation
    if psd:
        return from_psd(psd.scaled(rms), options.duration, options.fs, seed)
    return random(options.duration, options.fs, tuple(options.band), rms, seed, kind)


def add_psd(parser: argparse.ArgumentParser) -> None:
    """Add the options that name a power spectral density, see `psd_of`."""
    option = parser.add_argument
    option("--psd", type=Path, metavar="FILE", help="CSV with columns frequency (Hz) and psd, (m/s²)²/Hz or N²/Hz")
    option("--road", metavar="CLASS", help="road of ISO 8608 instead, A to H, under a quarter-car")
    option("--speed", type=kmh, metavar="KM/H", help="of the car on the road, km/h, or such as 22m/s or 50mph")
    words = "what of the car the rig is fixed to (default: %(default)s)"
    option("--at", choices=("hub", "body"), default="hub", help=words)


def psd_of(options: argparse.Namespace, kind: str) -> PSD | None:
    """Return the excitation that the options of `add_psd` name: a file, whose kind is given, or a road; or None."""
    from ..signals.psd import PSD
    from ..signals.road import road_psd

    if options.psd is not None and options.road is not None:
        raise ClearanceError("give --psd FILE or --road CLASS, one of them")
    if options.psd:
        return PSD.load(options.psd, kind)
    if options.road is None:
        return None
    if options.speed is None:
        raise ClearanceError("--road needs --speed, km/h")
    return road_psd(options.road, options.speed / 3.6, at=options.at)
