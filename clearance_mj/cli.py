"""The command line. Bad input ends with one line that says what and where, and status 2."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ._version import __version__
from .errors import ClearanceError
from .identify.laws import METHODS as LAWS
from .io.files import replacing, to_json

__all__ = ["main"]


def main(arguments=None) -> int:
    """Run ``clearance-mj``.

    Parameters
    ----------
    arguments : sequence of str, optional
        Default: the process's own.

    Returns
    -------
    int
        0 when done, 1 when interrupted or failed in computing, 2 for bad input.
    """
    options = _parser().parse_args(arguments)
    try:
        result = options.run(options)
    except ClearanceError as error:
        print(f"clearance-mj: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("clearance-mj: interrupted; run the same command again to go on", file=sys.stderr)
        return 1
    except BrokenPipeError:
        return 1
    if options.json:
        print(to_json(result), end="")
    return 0


def _parser():
    parser = argparse.ArgumentParser(prog="clearance-mj", description="Vibration of shafts with clearance.")
    parser.add_argument("--version", action="version", version=f"clearance-mj {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    _study(commands)
    _identify(commands)
    _simulate(commands)
    _compare(commands)
    return parser


def _command(commands, name, run, help_, **out):
    parser = commands.add_parser(name, help=help_, description=help_)
    parser.set_defaults(run=run)
    parser.add_argument("--json", action="store_true", help="print the result as JSON")
    parser.add_argument("--quiet", action="store_true", help="show no progress bars")
    parser.add_argument("--out", type=Path, **out)
    return parser


def _study(commands):
    parser = _command(
        commands, "study", _run_study, "compare every law on every engine with a dataset's validation records",
        default=Path("results/study"), help="folder of the report (default: %(default)s)",
    )  # fmt: skip
    parser.add_argument("dataset", type=Path, help="dataset folder: rig.toml, dataset.toml, one .uff per record")
    parser.add_argument("--engines", default="links,modal,modal-mj", help="comma-separated (default: %(default)s)")
    parser.add_argument("--methods", help=f"comma-separated, of {', '.join(LAWS)} (default: all but as printed)")
    parser.add_argument("--workers", type=int, help="threads (default: one for each processor)")


def _run_study(options):
    from .study import METHODS, run_study

    engines, methods = options.engines.split(","), options.methods.split(",") if options.methods else METHODS
    study = run_study(options.dataset, options.out, engines, methods, options.workers, not options.quiet)
    if not options.json:
        print(f"report: {options.out / 'report.html'}")
    return {"out": str(options.out), "results": study.rows()}


def _identify(commands):
    parser = _command(
        commands, "identify", _run_identify, "identify the clearance's law from a dataset's records to identify",
        default=Path("law.json"), help="law file (default: %(default)s)",
    )  # fmt: skip
    parser.add_argument("dataset", type=Path, help="dataset folder")
    parser.add_argument("--method", default="output-error", help=f"one of {', '.join(LAWS)} (default: %(default)s)")


def _run_identify(options):
    from .identify import law
    from .io.dataset import Dataset

    found = law(Dataset.load(options.dataset), options.method, None if options.quiet else options.method)
    found.save(options.out)
    if not options.json:
        print(f"law: {options.out}")
    return {"out": str(options.out), "law": found.to_dict()}


def _simulate(commands):
    parser = _command(
        commands, "simulate", _run_simulate, "simulate a rig under random base or shaker excitation",
        default=Path("response.nc"), help="response file, NetCDF (default: %(default)s)",
    )  # fmt: skip
    parser.add_argument("rig", type=Path, help="rig file (TOML)")
    parser.add_argument("--law", type=Path, help="law file (default: the rig's datasheet contact)")
    parser.add_argument("--engine", default="links", help="links, modal or modal-mj (default: %(default)s)")
    parser.add_argument("--duration", type=float, default=24.0, help="s (default: %(default)s)")
    parser.add_argument("--fs", type=float, default=2048.0, help="samples per second (default: %(default)s)")
    parser.add_argument("--band", type=float, nargs=2, default=(5.0, 220.0), metavar=("LOW", "HIGH"), help="Hz")
    parser.add_argument("--rms", type=float, default=1.0, help="m/s², or N for a force shaker (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of the excitation (default: %(default)s)")


def _run_simulate(options):
    from .clearance import load_law
    from .engines import simulate
    from .excitation import random
    from .identify.laws import nominal
    from .io.results import save
    from .rig import Rig

    rig = Rig.load(options.rig)
    law = load_law(options.law) if options.law else nominal(rig)
    noise = {"band": tuple(options.band), "rms": options.rms, "seed": options.seed, "kind": rig.shaker.kind}
    response = simulate(rig, random(options.duration, options.fs, **noise), law, options.engine)
    save(options.out, response)
    if not options.json:
        print(f"response: {options.out}")
    rms = dict(zip(response.responses, response.acceleration.std(axis=0).tolist()))
    return {"out": str(options.out), "acceleration_rms": rms}


def _compare(commands):
    parser = _command(
        commands, "compare", _run_compare, "compare the FRFs of two universal files (test first)",
        default=None, help="also write the comparison to this JSON file",
    )  # fmt: skip
    parser.add_argument("test", type=Path, help="universal file with the test's FRFs")
    parser.add_argument("model", type=Path, help="universal file with the model's FRFs")


def _run_compare(options):
    from .correlation import compare
    from .errors import RecordError
    from .frf import FRF
    from .io.uff import read_uff

    frfs = [read_uff(path) for path in (options.test, options.model)]
    for path, frf in zip((options.test, options.model), frfs):
        if not isinstance(frf, FRF):
            raise RecordError(f"{path}: holds time records, compare needs FRFs")
    summary = compare(*frfs).summary()
    if options.out:
        with replacing(options.out) as temporary:
            temporary.write_text(to_json(summary), encoding="utf-8")
    if not options.json:
        for name, value in summary.items():
            print(f"{name:24s} {value:.4g}")
    return summary


if __name__ == "__main__":
    sys.exit(main())
