"""Whole files of every kind, small so that one change is a large one."""

import functools
import io
import itertools
import json
import math
import tempfile
import tomllib
from pathlib import Path

import numpy as np
import scipy.io

from clearance_mj.clearance import AmplitudeLaw, ConstantLaw, ContactLaw, HuntCrossley, KelvinVoigt, TimeLaw
from clearance_mj.clearance.law import Law
from clearance_mj.io import formats
from clearance_mj.io.channels import Channel
from clearance_mj.io.dataset import Record, write_dataset
from clearance_mj.io.registry import Format
from clearance_mj.io.uff import write_uff
from clearance_mj.rig import Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor, Shaker
from clearance_mj.signals.ema import Modes
from clearance_mj.signals.frf import FRF
from clearance_mj.signals.response import Response
from clearance_mj.sweep.store import Table
from tests.io.test_lvm import BODY
from tests.io.test_lvm import text as lvm_text
from tests.io.test_uff import by_hand, units_by_hand

N = 6
T = np.arange(N) / 64
GREASE = Grease(4e3, 2.0, 0.5, 1.0, 3.0, 1.0, 2.0, 5e-4, 0.3)
RIG = Rig(
    name="small",
    beam=Beam(1.0, 7e10, 2700.0, 0.02, rayleigh=(0.5, 1e-5)),
    bushings=(Bushing(0.55, 3e-4, 0.01, GREASE, Contact(8e3, 3.0)), Bushing(0.8, 3e-4, 0.01, GREASE, Contact(8e3))),
    sensors=(Sensor(6, 0.55), Sensor(7, 0.8, 0.01)),
    masses=(PointMass(0.3, 0.1, "collar"),),
    shaker=Shaker("base", 0.2),
    description="a rig",
)
LAWS = (
    ConstantLaw(1e4, [1.0, 2.0], grease=GREASE),
    TimeLaw([0.0, 1.0], [[1e4, 2e4], [2e4, 3e4]], [1.0, 2.0]),
    AmplitudeLaw([0.0, 1e-3, 2e-3], [1e4, 2e4, 2e4], [0.0, 1.0, 2.0], grease=[GREASE, GREASE]),
    ContactLaw([HuntCrossley(1e6, 0.7), KelvinVoigt(1e4, 3.0, adhesion=True)]),
)


def channels(n=N):
    wave = np.sin(np.arange(n))
    places = [("base", 100, "acceleration"), ("acc 6", 6, "acceleration"), ("acc 7", 7, "acceleration")]
    places += [("probe 6", 6, "displacement")]
    return [
        Channel(name, node, "+Z", quantity, (i + 1) * wave, 64.0) for i, (name, node, quantity) in enumerate(places)
    ]


def frf(even=True, coherence=True):
    frequency = 1.0 + np.arange(4) if even else np.array([1.0, 2.0, 4.0, 5.0])
    value = np.exp(1j * np.arange(8)).reshape(2, 4)
    return FRF(frequency, value, np.full((2, 4), 0.5) if coherence else None, ("6:+Z", "7:+Z"), "100:+Z")


def response():
    wave = np.sin(np.arange(N))
    two = np.stack((wave, 2 * wave))
    return Response(
        64.0, wave, two, two, two, two, "base", (1.0, 20.0), ("6:+Z", "7:+Z"), "100:+Z", {"engine": "modal"}
    )


def modes():
    shape = np.array([[1.0, 1.0], [0.5 + 0.1j, -1.0]])
    return Modes(np.array([9.25, 39.75]), np.array([0.01, 0.02]), shape, ("6:+Z", "7:+Z"))


def whole(known: Format) -> list[bytes]:
    """Files of a format: what it writes of what it holds, and files by other hands."""
    objects = {
        Channel: [channels()], FRF: [frf(), frf(even=False, coherence=False)], Modes: [modes()],
        Response: [response()], Rig: [RIG], Law: LAWS,
    }  # fmt: skip
    found = list(BY_HAND.get(known.name, list)())
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"a{known.suffixes[0]}"
        for obj in (obj for held in known.holds for obj in objects[held] if known.write):
            formats.write(path, obj, RIG if known.geometry and isinstance(obj, Modes) else None)
            found.append(path.read_bytes())
    return found


def uff() -> list[bytes]:
    row = "".join(f"{math.sin(i):13.5e}" for i in range(N))
    uneven = ["".join(f"{i / 64:13.5e}{i:13.5e}" for i in range(a, a + 3)) for a in (0, 3)]
    doubles = ["".join(f"{math.sin(i):20.11e}" for i in range(a, min(a + 4, N))) for a in (0, 4)]
    time = {"count": N, "dof": (6, 3, 100, 3), "step": f"{1 / 64:.5e}", "unit": "g"}
    frf = {"kind": 4, "ordinate": 5, "count": 3, "axis": 18, "denominator": 12, "dof": (6, 3, 100, 3)}
    return [
        by_hand([row], **time),
        by_hand(uneven, spacing=0, **time),
        by_hand(doubles, ordinate=4, **time),
        by_hand([row], **frf),
        units_by_hand(1e3, 1.0) + by_hand([row], **time | {"unit": "NONE"}),
    ]


def csv() -> list[bytes]:
    by_hand = ["time [ms];base [g];acc:6:-Z [mm/s2]", "0;1;2", "1;2;3", "2;3;4"]
    headless = [f"{t:.6f}\t{math.sin(i):.9g}\t{i}" for i, t in enumerate(T)]
    functions = ["frequency,acc:6/base magnitude [g/g],acc:6/base phase [deg]", "1,2,3", "2,3,4", "3,4,5"]
    comments = ["# of a logger", '"time","base [g]","Temp"', *(f"{t},{i},20" for i, t in enumerate(T))]
    return ["\n".join(lines).encode() for lines in (by_hand, headless, functions, comments)]


def lvm() -> list[bytes]:
    texts = [*map(lvm_text, BODY), lvm_text(segments=2), lvm_text(point=",")]
    return [text.encode() for text in texts]


def mat() -> list[bytes]:
    variables = {"fs": 64.0, "base": np.arange(4.0), "acc_6": np.ones(4, "f4"), "s": {"x": 1}, "note": "text"}
    matrix = {"time": T, "data": np.ones((N, 2)), "columns": np.array(["base", "acc:6"], dtype=object)}
    found = []
    for held, packed in itertools.product((variables, matrix), (False, True)):
        file = io.BytesIO()
        scipy.io.savemat(file, held, do_compression=packed)
        found.append(file.getvalue())
    return found


BY_HAND = {"UFF": uff, "CSV": csv, "LVM": lvm, "MATLAB": mat}


@functools.cache
def table() -> list[bytes]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cases.npy"
        held = Table(path, TABLE, 3)
        held.write(0, {"natural_frequency": [1.0, 2.0], "rms": np.zeros(())})
        held.write(2, "why")
        return [path.read_bytes()]


TABLE = {"natural_frequency": (2,), "rms": ()}

PLAN = tomllib.loads("""
rig = "rig.toml"
engine = { name = "modal", modes = 4 }
[excitation]
generator = "random"
duration = 1
fs = 256
band = [5, 100]
rms = 2
seed = 1
[outputs]
resolution = 4
frf = [7]
natural_frequencies = 2
[design]
method = "latin-hypercube"
samples = 4
seed = 1
[[vary]]
path = "rig.bushings.gap"
low = 2e-4
high = 5e-4
[[vary]]
path = "excitation.rms"
low = 0.5
high = 5
scale = "log"
""")
GRID = {
    "rig": "rig.toml",
    "law": "law.json",
    "vary": [
        {"path": "law.k[0]", "values": [1e4, 2e4]},
        {"path": "rig.beam.length", "low": 1.0, "high": 1.1, "count": 2},
    ],
}
REFERENCE = {
    "rig": "rig.toml",
    "reference": "record.uff",
    "outputs": {"band": [4.0, 24.0], "resolution": 4.0, "peaks": [[4.0, 24.0]]},
    "vary": [{"path": "rig.bushings[0].grease.stiffness", "low": 1e3, "high": 1e4}],
    "design": {"method": "saltelli", "samples": 2},
}
PLANS = (PLAN, GRID, REFERENCE)


def dataset() -> tuple[dict, dict[str, bytes]]:
    """The list of a dataset's records, and the files beside it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "data"
        records = [
            Record(f"r{i}", role, RIG, 64.0, channels(), "base", "random", 2.0, i, (5.0, 20.0), {"a": 1})
            for i, role in enumerate(("identify", "validate"))
        ]
        write_dataset(folder, RIG, records)
        files = {path.name: path.read_bytes() for path in folder.iterdir()}
    return tomllib.loads(files.pop("dataset.toml").decode()), files


def beside_plan() -> dict[str, bytes]:
    """Files that plans name."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        RIG.save(folder / "rig.toml")
        LAWS[0].save(folder / "law.json")
        write_uff(folder / "record.uff", channels(64))
        return {path.name: path.read_bytes() for path in folder.iterdir()}


FREQUENCIES = [
    b"mode,frequency_hz,std_hz,shape_6,shape_7\n1,9.25,0.1,0.5,1\n2,39.75,0.1,1,-1\n",
    b"test_hz\n9.25\n39.75\n92.85\n",
]
_HEAD = ["header"] * 5 + ["Low G Accel\tPinLoc\tTime", *["header"] * 3]
DROPBEAR = ["\n".join([*_HEAD, *(f"{math.sin(i):.4f}\t{0.1 * i:.2f}\t{t:.6f}" for i, t in enumerate(T))]).encode()]
DAMPER = [json.dumps({"data": [[float(t), math.sin(i), math.cos(i), 0, 1, 1] for i, t in enumerate(T)]}).encode()]
