"""What commands that simulate one rig have in common: the law, the engine, the excitation."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the command line starts without the library
    from ..clearance.law import Law
    from ..rig import Rig
    from ..signals.excitation import Excitation

__all__ = ["add_drive", "excitation", "load"]


def add_drive(parser: argparse.ArgumentParser, duration: float, fs: float = 8192.0) -> None:
    """Add the options."""
    parser.add_argument("rig", type=Path, help="rig file (TOML)")
    parser.add_argument("--law", type=Path, help="law file (default: the rig's datasheet contact)")
    parser.add_argument("--engine", default="links", help="links, modal or modal-mj (default: %(default)s)")
    parser.add_argument("--sine", type=float, metavar="HZ", help="drive with a sine (default: with noise)")
    parser.add_argument(
        "--band", type=float, nargs=2, default=(5.0, 220.0), metavar=("LOW", "HIGH"), help="of noise, Hz (5 220)"
    )
    parser.add_argument("--seed", type=int, default=0, help="of noise (default: %(default)s)")
    parser.add_argument("--duration", type=float, default=duration, help="s that are simulated (default: %(default)s)")
    parser.add_argument("--fs", type=float, default=fs, help="samples per second (default: %(default)s)")


def load(options: argparse.Namespace) -> tuple[Rig, Law]:
    """Return the rig and the law that the options name."""
    from ..clearance import load_law
    from ..identify import nominal
    from ..rig import Rig

    rig = Rig.load(options.rig)
    return rig, load_law(options.law) if options.law else nominal(rig)


def excitation(options: argparse.Namespace, kind: str, rms: float) -> Excitation:
    """Return the excitation of one level."""
    from ..signals.excitation import random, stepped_sine

    if options.sine is not None:
        return stepped_sine(options.duration, options.fs, options.sine, math.sqrt(2) * rms, kind)
    return random(options.duration, options.fs, tuple(options.band), rms, options.seed, kind)
