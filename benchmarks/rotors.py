"""Shafts that turn: natural frequencies and damping over spin of three of ROSS' example rotors, beside ROSS itself.

ROSS (PyPI ross-rotordynamics) brings some 60 packages, so it runs in an environment of its own, whose interpreter the
variable ROSS_PYTHON names. Its elements are cubic, one for each section; ours are of high order, on the same sections.
"""

import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

from clearance_mj import Rig, Sensor, excitation, simulate
from clearance_mj.clearance import ShortBearing, nominal_law
from clearance_mj.rig import Bushing, Contact, Grease, Spin, Unbalance
from clearance_mj.rotors import turning_shaft
from clearance_mj.structure import Disc, Material, Section, Shaft, Support

from .case import row

SPEEDS = [0.0, 200.0, 400.0, 800.0]  # rad/s
MODES = 6
OIL = {"viscosity": 0.1, "radius": 0.05, "length": 0.03, "clearance": 1e-4}
BEARINGS = [OIL | {"spin": spin, "load": load} for spin in (50.0, 157.0, 400.0) for load in (100.0, 525.0, 4000.0)]
RUB = {"name": "rotor_example_with_damping", "node": 12, "gap": 7.95e-5, "stiffness": 1.1e6, "moment": 4e-4,
       "phase": -np.pi / 2, "speed": 40 * np.pi, "seconds": 0.3, "steps": [2e-5, 1e-5]}  # fmt: skip
"""ROSS' own rubbing example with twice its unbalance, without friction and damping; each step is half the last"""
HIGHEST_DAMPING = 0.5  # damping ratio up to which a motion counts
SOFT = 1e-3  # of the largest modulus: a sleeve softer than this only has mass


def measure():
    """Return rows as of `speed`, and the frequencies of each rotor, Hz."""
    path = os.environ.get("ROSS_PYTHON", "")
    if not Path(path).is_file():
        return {"rows": [], "skipped": {"ROSS": "ROSS_PYTHON names no interpreter that has it; make bench makes one"}}
    script = Path(__file__).resolve().with_name("ross_rotors.py")
    asked = {"speeds": SPEEDS, "modes": MODES, "bearings": BEARINGS, "rub": RUB}
    with tempfile.TemporaryDirectory() as folder:
        run = subprocess.run(
            [Path(path).absolute(), "-W", "ignore", script, json.dumps(asked)],
            capture_output=True, text=True, check=True, cwd=folder, env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
        )  # fmt: skip
    rows, frequencies = [], {}
    answer = json.loads(run.stdout.splitlines()[-1])
    apart = max(_film_apart(case, other) for case, other in zip(BEARINGS, answer["bearings"]))
    rows.append(row("short oil bearings: eight coefficients", [100 * apart], "%", "<= 0.1"))
    for name, data in answer["rotors"].items():
        begun = time.process_time()
        shaft = turning_shaft(_rig(name, data), 20)
        ours = [shaft.poles(speed).value for speed in SPEEDS]
        seconds = time.process_time() - begun
        ours = _frequencies(ours)
        other, finer = (_frequencies([np.array(at) @ [1, 1j] for at in data[mesh]]) for mesh in ("poles", "finer"))
        for mesh, of in (("one element a section", other), ("three elements a section", finer)):
            apart = 100 * np.abs(ours / of - 1).max()
            rows.append(row(f"{name}, {mesh}: frequencies", [apart], "%", "<= 0.1"))
        rows.append(row(f"{name}, time of ROSS / clearance_mj", [data["seconds"] / seconds], "x", ""))
        frequencies[name] = {"clearance_mj": ours.tolist(), "ROSS": other.tolist(), "ROSS, finer": finer.tolist()}
    rows += _rub(answer["rotors"][RUB["name"]], answer["rub"])
    return {"rows": rows, "speeds": SPEEDS, "frequencies": frequencies, "skipped": {}}


def _rub(data, of_ross):
    """Rows of a shaft that rubs from rest on, beside ROSS' motion in its smaller step and extrapolated to none.

    ROSS' rubbing force is that of the step before, so its error falls with the step.
    """
    place = float(_places(data["elements"])[RUB["node"]])
    bushing = Bushing(place, RUB["gap"], 0.0, Grease(0.0), Contact(RUB["stiffness"]), shape="round")
    rig = _rig(RUB["name"], data).replace(
        spin=Spin(RUB["speed"]), bushings=(bushing,),
        unbalances=(Unbalance(place, RUB["moment"], RUB["phase"]),),
    )  # fmt: skip
    still, law = excitation.still(RUB["seconds"], 1 / RUB["steps"][0]), nominal_law(rig)
    simulate(rig, still, law, engine="modal")  # compiles
    begun = time.process_time()
    ours = simulate(rig, still, law, engine="modal").displacement
    seconds = time.process_time() - begun
    coarse, fine = (
        np.array(run["motion"])[:: round(RUB["steps"][0] / step)].T for run, step in zip(of_ross, RUB["steps"])
    )
    for words, of, target in (
        (f"in steps of {1e6 * RUB['steps'][1]:g} µs", fine, ""),
        ("extrapolated to step 0", 2 * fine - coarse, "<= 2"),
    ):
        apart = 100 * np.linalg.norm(ours - of) / np.linalg.norm(of)
        yield row(f"rub, ROSS {words}: RMS difference", [apart], "%", target)
    yield row("rub, time of ROSS / clearance_mj", [of_ross[1]["seconds"] / seconds], "x", ">= 20")


def _film_apart(case, other):
    """Largest difference of a bearing's coefficients from ROSS', over the largest of their kind."""
    film = ShortBearing(**{name: case[name] for name in OIL})
    ours = film.coefficients(film.equilibrium([0.0, -case["load"]], case["spin"]), case["spin"])
    return max(np.abs(mine - theirs).max() / np.abs(theirs).max() for mine, theirs in zip(ours, np.array(other)))


def _frequencies(poles):
    """(n_speeds, MODES) Hz of the lowest motions that are not all but critically damped."""
    return np.array([at.imag[-at.real < HIGHEST_DAMPING * np.abs(at)][:MODES] for at in poles]) / (2 * np.pi)


def _rig(name, data):
    """The same rotor: ROSS' x is y here, its y is z; the spin is from the one to the other in both."""
    layers, places = {}, _places(data["elements"])
    for element in data["elements"]:
        layers.setdefault(element["n"], []).append(element)
    stiffest = max(element["young_modulus"] for element in data["elements"])
    sections, discs = [], []
    for n in sorted(layers):
        section, inertia = _section(layers[n], SOFT * stiffest)
        sections.append(section)
        if inertia:
            discs.append(Disc(float(places[n : n + 2].mean()), 0.0, inertia))
    for d in data["discs"]:
        discs.append(Disc(float(places[d["n"]]), d["mass"], d["inertia"], polar_inertia=d["polar"]))
    supports = [
        Support(
            float(places[b["n"]]), "elastic", b["kyy"], 0.0, b["cyy"], translation_y=b["kxx"],
            translation_damping_y=b["cxx"],
        )
        for b in data["bearings"]
    ]  # fmt: skip
    shaft = Shaft(tuple(sections), tuple(supports), tuple(discs), theory="timoshenko")
    return Rig(name, None, (), (Sensor(1, shaft.end),), structure=shaft)


def _places(elements):
    """m of the nodes."""
    lengths = {element["n"]: element["length"] for element in elements}
    return np.concatenate(([0.0], np.cumsum([lengths[n] for n in sorted(lengths)])))


def _section(layers, softest):
    """A section of the layer that is stiff, with the mass of all; and the inertia about a diameter that it lacks."""
    core = max(layers, key=lambda layer: layer["young_modulus"])
    assert all(layer is core or layer["young_modulus"] < softest for layer in layers)
    area, second = _across(core)
    mass = sum(layer["density"] * _across(layer)[0] for layer in layers)
    rotary = sum(layer["density"] * _across(layer)[1] for layer in layers)
    lacks = rotary - mass / area * second if len(layers) > 1 else 0.0
    inner = {"inner_diameter": tuple(core["inner"])} if any(core["inner"]) else {}
    material = Material(core["young_modulus"], mass / area, core["poisson_ratio"])
    section = Section(core["length"], tuple(core["outer"]), material=material, **inner)
    return section, core["length"] * max(lacks, 0.0)


def _across(layer):
    """Area and second moment of area in the layer's middle."""
    outer, inner = (np.mean(layer[side]) for side in ("outer", "inner"))
    return np.pi * (outer**2 - inner**2) / 4, np.pi * (outer**4 - inner**4) / 64
