"""clearance-mj demo: a bench as a logger leaves it, for those who have no records."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from tqdm import tqdm

from ..clearance import ConstantLaw
from ..core.errors import ClearanceError
from ..core.files import write_text
from ..core.quantities import GRAVITY
from ..engines import simulate
from ..io.channels import NOWHERE, Channel
from ..io.formats import write
from ..model import Model
from ..rig import Bushing, Contact, Grease, PointMass, Rig, Sensor
from ..signals import excitation
from ..structure import Beam
from .command import Options, Result, command, option

RECORDS = {
    "run_0.5": (0.5, 1), "run_2": (2.0, 2), "run_5": (5.0, 3),
    "check_1_a": (1.0, 4), "check_1_b": (1.0, 5), "check_4_a": (4.0, 6), "check_4_b": (4.0, 7),
}  # fmt: skip
"""RMS of the base's acceleration in m/s², and seed, of each record"""
CHANNELS = {"Plate": (-1, 1.0), "A2": (1, 1.0), "A4": (3, -1.0), "A1": (0, 1.0), "A3": (2, 1.0)}
"""Names in the order of the logger, the accelerometer from the clamp on (-1: the base) and the sign of each"""
BAND, FS, DURATION = (5.0, 220.0), 1024.0, 20.0  # Hz, Hz, s
NOISE = 0.01  # of a channel's RMS
README = """A bench as a logger leaves it. Synthetic: simulated by clearance-mj, not measured.

What its designer knows: a steel shaft, 620 mm long and 8.6 mm thick, clamped at one end; a lever of 0.2 kg at its tip;
a short bushing 450 mm from the clamp, with a radial clearance of 0.13 mm. Four accelerometers at 120, 280, 450 and
620 mm, and one on the plate that shakes. Records: noise of 5 to 220 Hz; run_* to identify from, check_* kept back, each
level twice.

{steps}
"""


@command(
    "demo",
    option("folder", "folder of the bench: a new one", Path),
    option("--format", "of the records", default="csv", choices=("csv", "lvm", "tdms", "mf4")),
    out_help="FOLDER, if it is not given as such",
)
def run(options: Options) -> Result:
    """Write a bench as a logger leaves it, for a first hour without records of one's own."""
    folder: Path = options.out or options.folder
    if folder.exists():
        raise ClearanceError(f"{folder}: is there; give a new folder")
    model, files = bench(), []
    for name, (rms, seed) in tqdm(RECORDS.items(), desc="demo", disable=options.quiet):
        channels = measured(model, rms, seed)
        path = folder / f"{name}.{options.format}"
        if options.format == "csv":
            write_text(path, "\n".join(_logger_csv(channels)) + "\n")
        else:
            write(path, channels)
        files.append(str(path))
    steps = [*_command_lines(shlex.quote(str(folder)), options.format)]
    write_text(folder / "README.txt", README.format(steps="\n".join(steps)))
    words = f"{folder}: {len(files)} records of a synthetic bench, and README.txt with what its designer knows"
    return Result({"out": str(folder), "files": files, "next": steps}, [words, f"next: {steps[0]}"])


def bench() -> Model:
    """Return the bench as it really is: every number of its drawing is a little wrong, and the gap by 40 %."""
    rig = Rig(
        "demo bench",
        Beam(0.62, 204e9, 7870.0, 0.0086, damping_ratios=(0.004, 0.005, 0.006, 0.008)),
        (Bushing(0.4492, 1.8e-4, 0.004, Grease(3600.0, 2.6), Contact(1.4e4, 5.0), offset=3e-5),),
        tuple(Sensor(node, x) for node, x in enumerate((0.1213, 0.2788, 0.4509, 0.6200), 1)),
        (PointMass(0.62, 0.206, "lever"),),
        description="synthetic",
    )
    return Model(rig, ConstantLaw(1.4e4, 5.0))


def measured(model: Model, rms: float, seed: int) -> list[Channel]:
    """Return the logger's record of the bench under noise, in g, with the logger's channel names."""
    shaken = excitation.random(DURATION, FS, BAND, rms, seed)
    response = simulate(model, shaken, engine="modal")
    rng = np.random.default_rng(seed)
    channels = []
    for name, (sensor, sign) in CHANNELS.items():
        value = sign * (shaken.value if sensor < 0 else response.acceleration[sensor])
        noisy = value + NOISE * value.std() * rng.standard_normal(value.size)
        channels.append(Channel(name, *NOWHERE, "acceleration", noisy, FS, unit="g"))
    return channels


def _logger_csv(channels: list[Channel]) -> Iterator[str]:
    """Return the lines of a file as data loggers write it: metadata, names, units, decimal commas."""
    yield "Logger;synthetic, simulated by clearance-mj"
    yield f"Sample rate [Hz];{channels[0].fs:g}"
    yield ""
    yield ";".join(["Time", *(channel.name for channel in channels)])
    yield ";".join(["s", *("g" for _ in channels)])
    for i, time in enumerate(channels[0].time):
        numbers = (f"{channel.value[i] / GRAVITY:.6g}" for channel in channels)
        yield ";".join([f"{time:.7f}", *numbers]).replace(".", ",")


def _command_lines(folder: str, suffix: str) -> Iterator[str]:
    """Yield the commands of a first hour, in order."""
    runs, checks = (" ".join(f"{folder}/{n}.{suffix}" for n in RECORDS if n.startswith(w)) for w in ("run", "check"))
    yield (
        f'clearance-mj new "synthetic bench" --length 620mm --diameter 8.6mm --mass 0.62 0.2 --bushings 0.45 '
        f"--gap 0.13mm --bushing-length 4mm --sensors 0.12 0.28 0.45 0.62 --out {folder}/rig.toml"
    )
    yield f"clearance-mj map {runs} --rig {folder}/rig.toml --out {folder}/map.toml"
    common = f"{folder}/bench --rig {folder}/rig.toml --map {folder}/map.toml --band 5 220"
    yield f"clearance-mj convert {runs} {common}"
    yield f"clearance-mj convert {checks} {common} --role validate"
    yield f"clearance-mj identify {folder}/bench --out {folder}/identified"
    yield f"clearance-mj simulate {folder}/identified --rms 2 --band 5 220 --gap x0.5 --out {folder}/half_the_gap.nc"
    yield f"clearance-mj study {folder}/bench --methods nominal,bench --out {folder}/study"
