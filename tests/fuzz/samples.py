"""Whole files of every kind, small so that one change is a large one."""

import dataclasses
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
import scipy.linalg
import scipy.sparse
import tomli_w

import clearance_mj as cm
from clearance_mj.clearance import HuntCrossley, KelvinVoigt
from clearance_mj.io import formats
from clearance_mj.io.registry import Format
from clearance_mj.signals import Modes
from clearance_mj.structure import ModalStructure
from tests.conftest import ROOT
from tests.io.sheets_by_hand import TABLE as SHEET
from tests.io.sheets_by_hand import ods, xlsx
from tests.io.test_lvm import AS_LABVIEW, BODY, restarted
from tests.io.test_lvm import text as lvm_text
from tests.structures import chain, stepped, two_shafts

from . import loggers, samples_uff

N = 6
T = np.arange(N) / 64
GREASE = cm.Grease(4e3, 2.0, 0.5, 1.0, 3.0, 1.0, 2.0, 5e-4, 0.3)
RIG = cm.Rig(
    "small", cm.Beam(1.0, 7e10, 2700.0, 0.02, rayleigh=(0.5, 1e-5)),
    (cm.Bushing(0.55, 3e-4, 0.01, GREASE, cm.Contact(8e3, 3.0)), cm.Bushing(0.8, 3e-4, 0.01, GREASE, cm.Contact(8e3))),
    (cm.Sensor(6, 0.55), cm.Sensor(7, 0.8, 0.01)), (cm.PointMass(0.3, 0.1, "collar"),), cm.Shaker("base", 0.2), "a rig",
)  # fmt: skip
LAWS = (
    cm.ConstantLaw(1e4, [1.0, 2.0], grease=GREASE), cm.TimeLaw([0.0, 1.0], [[1e4, 2e4], [2e4, 3e4]], [1.0, 2.0]),
    cm.AmplitudeLaw([0.0, 1e-3, 2e-3], [1e4, 2e4, 2e4], [0.0, 1.0, 2.0], grease=[GREASE, GREASE]),
    cm.ContactLaw([HuntCrossley(1e6, 0.7), KelvinVoigt(1e4, 3.0, adhesion=True)]),
)  # fmt: skip


def channels(n=N):
    wave = np.sin(np.arange(n))
    places = [("base", 100, "acceleration"), ("acc 6", 6, "acceleration"), ("acc 7", 7, "acceleration")]
    places += [("probe 6", 6, "displacement")]
    return [
        cm.Channel(name, node, "+Z", quantity, (i + 1) * wave, 64.0) for i, (name, node, quantity) in enumerate(places)
    ]


def frf(even=True, coherence=True):
    frequency = 1.0 + np.arange(4) if even else np.array([1.0, 2.0, 4.0, 5.0])
    value = np.exp(1j * np.arange(8)).reshape(2, 4)
    return cm.FRF(frequency, value, np.full((2, 4), 0.5) if coherence else None, ("6:+Z", "7:+Z"), "100:+Z")


def modal_frf():
    """Accelerance of a chain of three masses on springs to a force at the first, around its first two modes."""
    squares, shapes = scipy.linalg.eigh(STIFFNESS, MASS)
    omega = 2 * np.pi * np.arange(2.0, 40.0, 0.25)
    below = squares[:, None] - omega**2 + 0.04j * np.sqrt(squares)[:, None] * omega
    value = -(omega**2) * np.einsum("ik,kf->if", shapes * shapes[0], 1 / below)
    labels = tuple(f"{i}:+Z" for i in (1, 2, 3))
    return cm.FRF(omega / (2 * np.pi), value, None, labels, "1:+Z", quantity="acceleration/force")


@functools.cache
def bench() -> tuple[cm.Rig, list[cm.Record]]:
    """A rig whose rig file is right, with records to identify and to validate."""
    rig = dataclasses.replace(
        RIG, name="bench", beam=cm.Beam(0.6, 2.1e11, 7850.0, 0.008, rayleigh=(1.0, 2e-5)), description="",
        bushings=(cm.Bushing(0.4, 2e-4, 0.01, cm.Grease(3000.0, 3.0), cm.Contact(2e4, 5.0)),),
        masses=(cm.PointMass(0.6, 0.2),), sensors=tuple(map(cm.Sensor, (1, 2, 3, 4), (0.15, 0.3, 0.45, 0.6))),
    )  # fmt: skip
    records = []
    for name, role, drive in (
        ("ramp", "identify", cm.excitation.level_ramp(6.0, 512.0, (5.0, 100.0), start_rms=0.3, end_rms=8.0, seed=1)),
        ("loud", "validate", cm.excitation.random(4.0, 512.0, (5.0, 100.0), 2.0, 2)),
    ):
        measured = formats.to_channels(cm.simulate(rig, drive, cm.ConstantLaw(2e4, 5.0), "modal"), rig)
        level = 2.0 if role == "validate" else None
        records.append(cm.Record(name, role, rig, 512.0, measured, "base", "random", level, 1, (5.0, 100.0)))
    return rig, records


def response():
    wave = np.sin(np.arange(N))
    two = np.stack((wave, 2 * wave))
    return cm.Response(64.0, wave, *4 * [two], "base", (1.0, 20.0), ("6:+Z", "7:+Z"), "100:+Z", {"engine": "modal"})


def modes():
    shape = np.array([[1.0, 1.0], [0.5 + 0.1j, -1.0]])
    return Modes(np.array([9.25, 39.75]), np.array([0.01, 0.02]), shape, ("6:+Z", "7:+Z"))


def whole(known: Format) -> list[bytes]:
    """Files of a format: what it writes of what it holds, and files by other hands."""
    objects = {
        cm.Channel: [channels()], cm.FRF: [frf(), frf(even=False, coherence=False)], Modes: [modes()],
        cm.Spectra: [samples_uff.spectra(), samples_uff.spectra(turning=True)], cm.Geometry: [samples_uff.geometry()],
        cm.Response: [response()], cm.Rig: [RIG], cm.Law: LAWS,
    }  # fmt: skip
    files = list(BY_HAND.get(known.name, list)())
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"a{known.suffixes[0]}"
        for obj in (obj for held in known.holds for obj in objects[held] if known.write):
            formats.write(path, obj, RIG if known.geometry and isinstance(obj, Modes) else None)
            files.append(path.read_bytes())
    return files


def csv() -> list[bytes]:
    by_hand = ["time [ms];base [g];acc:6:-Z [mm/s2]", "0;1;2", "1;2;3", "2;3;4"]
    headless = [f"{t:.6f}\t{math.sin(i):.9g}\t{i}" for i, t in enumerate(T)]
    functions = ["frequency,acc:6/base magnitude [g/g],acc:6/base phase [deg]", "1,2,3", "2,3,4", "3,4,5"]
    comments = ["# of a logger", '"time","base [g]","Temp"', *(f"{t},{i},20" for i, t in enumerate(T))]
    return ["\n".join(lines).encode() for lines in (by_hand, headless, functions, comments)]


def lvm() -> list[bytes]:
    texts = [*map(lvm_text, BODY), lvm_text(segments=2), lvm_text(point=","), *AS_LABVIEW.values()]
    texts.append(restarted("23:59:59.75", (0.0, 0.25)))
    return [text.encode() for text in texts]


def sheets() -> list[bytes]:
    files = []
    with tempfile.TemporaryDirectory() as folder:
        for write in (xlsx, ods):
            write(Path(folder) / "a", Notes=[["a note"]], Data=SHEET[:9])
            files.append((Path(folder) / "a").read_bytes())
    return files


def mat() -> list[bytes]:
    variables = {"fs": 64.0, "base": np.arange(4.0), "acc_6": np.ones(4, "f4"), "s": {"x": 1}, "note": "text"}
    matrix = {"time": T, "data": np.ones((N, 2)), "columns": np.array(["base", "acc:6"], dtype=object)}
    return saved(variables, matrix)


def saved(*tables) -> list[bytes]:
    """Files of MATLAB, each plain and compressed."""
    pairs = itertools.product(tables, (False, True))
    return [written(functools.partial(scipy.io.savemat, mdict=held, do_compression=packed)) for held, packed in pairs]


BY_HAND = {"UFF": samples_uff.uff, "CSV": csv, "LVM": lvm, "MATLAB": mat, "TDMS": loggers.tdms, "MDF": loggers.mdf,
           "Excel": sheets}  # fmt: skip


PLAN = {
    "rig": "rig.toml", "engine": {"name": "modal", "modes": 4},
    "excitation": {"generator": "random", "duration": 1, "fs": 256, "band": [5, 100], "rms": 2, "seed": 1},
    "outputs": {"resolution": 4, "frf": [7], "natural_frequencies": 2},
    "design": {"method": "latin-hypercube", "samples": 4, "seed": 1},
    "vary": [{"path": "rig.bushings.gap", "low": 2e-4, "high": 5e-4},
             {"path": "excitation.rms", "low": 0.5, "high": 5, "scale": "log"}],
}  # fmt: skip
GRID = {"rig": "rig.toml", "law": "law.json",
        "vary": [{"path": "law.k[0]", "values": [1e4, 2e4]},
                 {"path": "rig.beam.length", "low": 1.0, "high": 1.1, "count": 2}]}  # fmt: skip
REFERENCE = {"rig": "rig.toml", "reference": "record.uff",
             "outputs": {"band": [4.0, 24.0], "resolution": 4.0, "peaks": [[4.0, 24.0]]},
             "vary": [{"path": "rig.bushings[0].grease.stiffness", "low": 1e3, "high": 1e4}],
             "design": {"method": "saltelli", "samples": 2}}  # fmt: skip
PLANS = (PLAN, GRID, REFERENCE)


def dataset() -> tuple[dict, dict[str, bytes]]:
    """The list of a dataset's records, and the files beside it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "data"
        records = [
            cm.Record(f"r{i}", role, RIG, 64.0, channels(), "base", "random", 2.0, i, (5.0, 20.0), {"a": 1})
            for i, role in enumerate(("identify", "validate"))
        ]
        cm.write_dataset(folder, RIG, records)
        files = {path.name: path.read_bytes() for path in folder.iterdir()}
    return tomllib.loads(files.pop("dataset.toml").decode()), files


def beside_plan() -> dict[str, bytes]:
    """Files that plans name."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        RIG.save(folder / "rig.toml")
        LAWS[0].save(folder / "law.json")
        cm.write_uff(folder / "record.uff", channels(64))
        return {path.name: path.read_bytes() for path in folder.iterdir()}


MASS, STIFFNESS = np.diag([2.0, 1.0, 0.5]), np.array([[6e4, -2e4, 0.0], [-2e4, 3e4, -1e4], [0.0, -1e4, 1e4]])
DOFS = b"node,direction,x,y,z\n1,Z,0,0,0\n2,Z,0.5,0,0\n3,-UX,1,0,0\n"
MODES_CSV = [
    b"dof,mode 1,mode 2,residual at 2:+Z [m/N]\nfrequency [Hz],28.3,62.3\ndamping,0.02,0.01\nmodal mass [kg],1,2\n"
    b"1:+Z,0.19,0.39,-1e-8\n2:+Z,0.59,-0.75,2e-8\nparticipation X [sqrt(kg)],0.1,0.2\n",
    b"dof,mode 1\n2:Z,1\nfrequency [Hz],9\nmodal mass [kg],3\n",
]
MJCF = [
    b"""<mujoco><option gravity="0 0 -9.81"/><worldbody><body name="a" pos="0 0 1">
<joint name="j" type="hinge" axis="0 1 0" stiffness="20" damping="0.1"/><geom type="capsule" size=".02"
fromto="0 0 0 0 0 -.5" mass="1"/><site name="tip" pos="0 0 -.5"/><body name="b" pos="0 0 -.5"><joint type="slide"
axis="1 0 0" stiffness="500"/><geom size=".05" mass=".2"/></body></body></worldbody>
<keyframe><key name="up" qpos="0.1 0"/></keyframe></mujoco>""",
    b"""<mujoco><worldbody><body name="tip"><joint type="slide" axis="1 0 0" stiffness="1e4" damping="2"/>
<geom type="box" size=".1 .1 .1" mass="3"/></body></worldbody></mujoco>""",
]
NAMED_FILES = {
    "M.mtx": {"kind": "matrices", "units": "m-kg-s", "mass": "M.mtx", "stiffness": "K.mtx", "dofs": "dofs.csv"},
    "model.npz": {"kind": "matrices", "units": "mm-t-s", "file": "model.npz", "damping_ratios": [0.01]},
    "model.mat": {"kind": "matrices", "units": "in-lbf-s", "file": "model.mat"},
    "modes.uff": {"kind": "modes", "file": "modes.uff"},
    "modes.csv": {"kind": "modes", "file": "modes.csv"},
    "model.xml": {"kind": "mjcf", "file": "model.xml"},
}  # A structure that is read from each


def structure_rigs() -> list[dict]:
    """Rigs of every kind of structure whose numbers stand in the rig file."""
    tested = ModalStructure(
        (28.3, 62.3), (0.02,), ("1:+Z", "2:+Z"), ((0.19, 0.39), (0.59, -0.75)), participation=((1, 0, 2), (0, 0, 1)),
        residual_flexibility=((-1e-8,), (2e-8,)), residual_dofs=("2:+Z",),
    )  # fmt: skip
    modal = cm.Rig("tested", None, (cm.Bushing("2:+Z", 1e-4, 0.0, GREASE, cm.Contact(1e5)),), (cm.Sensor(1, "1:-Z"),),
                shaker=cm.Shaker("force", "1:+Z"), structure=tested)  # fmt: skip
    gears = cm.Rig.load(ROOT / "models" / "gear_pair.toml")
    return [rig.to_dict() for rig in (stepped(), two_shafts(), chain(), modal, gears)]


def named(file: str) -> bytes:
    """A rig file whose structure is read from a file."""
    point = {"model.xml": "tip:+X"}.get(file, "2:+Z")
    bushing = {"position": point, "gap": 1e-4, "length": 0.0, "grease": {"stiffness": 0.0}}
    bushing["contact"] = {"stiffness": 1e5}
    structure, sensors = NAMED_FILES[file], [{"node": 1, "position": point}]
    return tomli_w.dumps({"name": "a", "structure": structure, "bushings": [bushing], "sensors": sensors}).encode()


def beside_structure(file: str) -> dict[str, bytes]:
    """The rig file, and what it names besides."""
    rig = named("M.mtx" if file == "dofs.csv" else file)
    if file not in ("M.mtx", "dofs.csv"):
        return {"rig.toml": rig}
    whole = {"M.mtx": matrix_market()[0], "K.mtx": matrix_market()[2], "dofs.csv": DOFS}
    return {"rig.toml": rig, **{name: data for name, data in whole.items() if name != file}}


def written(write_to) -> bytes:
    file = io.BytesIO()
    write_to(file)
    return file.getvalue()


@functools.cache
def matrix_market() -> list[bytes]:
    """Dense and sparse, whole and one half."""
    forms = (MASS, scipy.sparse.coo_array(MASS), scipy.sparse.coo_array(STIFFNESS))
    files = [written(functools.partial(scipy.io.mmwrite, a=form, symmetry="general")) for form in forms]
    return [*files, written(functools.partial(scipy.io.mmwrite, a=forms[2], symmetry="symmetric"))]


@functools.cache
def npz() -> list[bytes]:
    """Dense, sparse and compressed."""
    dofs = np.array(["1:Z", "2:Z", "3:X"])
    sparse: dict[str, np.ndarray] = {"dofs": dofs}
    for name, matrix in (("mass", MASS), ("stiffness", STIFFNESS)):
        rows = scipy.sparse.csr_array(matrix)
        parts = {"data": rows.data, "indices": rows.indices, "indptr": rows.indptr, "shape": np.array(rows.shape)}
        sparse |= {f"{name}_{part}": value for part, value in parts.items()}
    held = {"M": MASS, "K": STIFFNESS, "C": 1e-4 * STIFFNESS, "dofs": dofs, "coordinates": np.eye(3)}
    return [written(lambda file: np.savez(file, **held)), written(lambda file: np.savez_compressed(file, **held)),
            written(lambda file: np.savez(file, **sparse))]  # fmt: skip


@functools.cache
def model_mat() -> list[bytes]:
    """Dense with numbered degrees of freedom, sparse with cells of texts."""
    dense = {"M": MASS, "K": STIFFNESS, "dofs": np.array([[1, 3], [2, 3], [3, 1]])}
    cells = {"dofs": np.array(["1:Z", "2:Z", "3:X"], dtype=object), "coordinates": np.eye(3)}
    sparse = {"mass": scipy.sparse.csc_array(MASS), "stiffness": scipy.sparse.csc_array(STIFFNESS)} | cells
    return saved(dense, sparse)


FREQUENCIES = [b"mode,frequency_hz,std_hz,shape_6,shape_7\n1,9.25,0.1,0.5,1\n2,39.75,0.1,1,-1\n",
               b"test_hz\n9.25\n39.75\n92.85\n"]  # fmt: skip
_HEAD = ["header"] * 5 + ["Low G Accel\tPinLoc\tTime", *["header"] * 3]
DROPBEAR = ["\n".join([*_HEAD, *(f"{math.sin(i):.4f}\t{0.1 * i:.2f}\t{t:.6f}" for i, t in enumerate(T))]).encode()]
DAMPER = [json.dumps({"data": [[float(t), math.sin(i), math.cos(i), 0, 1, 1] for i, t in enumerate(T)]}).encode()]
