"""Keep what the library computes, and hold a change to it: ``python -m benchmarks.baseline results/before.npz``.

Raw arrays of every engine, energies, periodic vibrations, both kinds of virtual bench and both studies go into the
file, with the seconds of each first call, compilation included, and of a second one. With ``--against OLD`` every array
is compared with that of an older file: in the plane within 1e-12 of its largest value, round clearances within 1e-9,
what a continuation locates within 1e-6; what is farther off is listed, and the status is 1. First calls are comparable
with an empty cache: ``NUMBA_CACHE_DIR=$(mktemp -d) python -m benchmarks.baseline ...``.
"""

import argparse
import dataclasses
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import clearance_mj as cm
from clearance_mj import clearance, periodic
from clearance_mj.core.files import replacing
from clearance_mj.engines import simulate_together
from clearance_mj.report import report_study
from clearance_mj.rig import Friction, Grease, OilFilm, Spin, Unbalance

PLANE = cm.Rig.load("models/table1_rig.toml")
SPACE = PLANE.with_shape("round")
RUBBING = SPACE.replace(
    bushings=tuple(dataclasses.replace(b, friction=Friction(0.2, damping=0.5)) for b in SPACE.bushings),
    gravity=(0.0, 0.0, -9.81), spin=Spin(100.0), unbalances=(Unbalance(0.5, 1e-5),),
)  # fmt: skip
FILM = SPACE.replace(
    bushings=tuple(dataclasses.replace(b, film=OilFilm(0.02), grease=Grease(0.0)) for b in SPACE.bushings),
    spin=Spin(100.0), unbalances=(Unbalance(0.5, 1e-5),),
)  # fmt: skip
STOP = PLANE.replace(bushings=tuple(dataclasses.replace(b, stops="upper") for b in PLANE.bushings))
HYSTERESIS = Grease(4369.0, 4.0, elastic_ratio=0.5, beta=1.2e7, gamma=0.8e7, film_height=7e-4)
LAWS = {
    "kelvin-voigt": cm.ConstantLaw(8e3, 4.0),
    "maxwell-slip": cm.ContactLaw(
        clearance.Cubic(8e3, 1e11), grease=clearance.MaxwellSlip((3e3, 1e3), (0.2, 0.4), 1e3, 3.0)
    ),
    "hunt-crossley": cm.ContactLaw(clearance.HuntCrossley(stiffness=3e6, restitution=0.6)),
    "bouc-wen": cm.ContactLaw(clearance.HuntCrossley(stiffness=3e6, restitution=0.6), grease=HYSTERESIS),
}
NOISE = cm.excitation.random(1.0, 2048.0, band=(5, 220), rms=6.0, seed=3)
PERIODIC = {"n_harmonics": 5}
WITHIN = {"slot": 1e-12, "round": 1e-9, "periodic": 1e-6, "bench": 1e-12, "study": 1e-6}
"""Distance over an array's largest value up to which two of them are the same, by the first word of their names"""


def motion(run):
    """Arrays of a response."""
    names = ("acceleration", "displacement", "contact_force", "grease_force")
    return {name: value for name in names if (value := getattr(run, name)) is not None}


def energies(balance):
    """Arrays of an energy balance."""
    return {
        "put_in": balance.put_in,
        "contact_loss": balance.contact_loss,
        "impacts": [i.time for i in balance.impacts],
    }


def points(branch):
    """Arrays of a branch: where something special is, and where it ends; its points are where the steps led it."""
    special = [(p.frequency, p.level) for p in branch.special]
    ends = [np.ravel(axis)[[0, -1]] for axis in (branch.frequency, branch.level)]
    return {"special": np.reshape(special, (-1, 2)), "ends": np.concatenate(ends)}


def rattling(model):
    """Arrays of a rattle map."""
    rattle_map = periodic.map_rattle(model, (2.0, 4.0, 6.0), np.linspace(40, 49, 10), workers=1, **PERIODIC)
    return {"share": rattle_map.contact_share, "first_contact": rattle_map.first_contact}


def tables(folder):
    """Columns of numbers of every table that a study wrote."""
    import pandas as pd

    for path in sorted((folder / "tables").glob("*.csv")):
        for name, column in pd.read_csv(path).select_dtypes("number").items():
            yield f"{path.stem} {name}", column.to_numpy()


def study(dataset, method):
    """Tables of a study of a shipped dataset, and the seconds that its page takes."""
    with tempfile.TemporaryDirectory() as folder:
        report_study(dataset, folder, ["modal"], ["nominal", method], None, False)
        return dict(tables(Path(folder)))


def virtual_bench():
    """Raw signals of a virtual bench in the plane."""
    from experiments.benches.bench import make_bench
    from experiments.benches.records import shake

    return dict(zip(("acceleration", "displacement"), shake(make_bench(1), NOISE.value)))


def virtual_bench_in_space():
    """Raw signals of a virtual bench of round bushings."""
    from experiments.benches.space.bench import make_bench
    from experiments.benches.space.records import simulate

    return dataclasses.asdict(simulate(make_bench(1), np.vstack((NOISE.value, NOISE.value[::-1]))))


def parts():
    """Return what is computed, by name: the first word says how closely it is compared."""
    for name, law in LAWS.items():
        for engine in ("modal", "links"):
            yield f"slot {engine} {name}", lambda law=law, e=engine: motion(cm.simulate(PLANE, NOISE, law, e))
        yield f"round modal {name}", lambda law=law: motion(cm.simulate(SPACE, NOISE, law, "modal"))
    yield "slot modal stop", lambda: motion(cm.simulate(STOP, NOISE, engine="modal"))
    for name, rig in {"friction": RUBBING, "film": FILM}.items():
        for engine in ("modal", "links"):
            yield f"round {engine} {name}", lambda r=rig, e=engine: motion(cm.simulate(r, NOISE, engine=e))
    model, turning = cm.Model(PLANE, LAWS["kelvin-voigt"]), cm.Model(SPACE, LAWS["kelvin-voigt"])
    for name, rig in {"slot": PLANE, "round": SPACE}.items():
        law = cm.clearance.nominal_law(rig)
        yield f"{name} lanes", lambda r=rig, law=law: motion(simulate_together([(r, law)] * 5, NOISE)[4])
    yield "slot energies", lambda: energies(cm.energy_balance(PLANE, NOISE, LAWS["bouc-wen"], engine="modal"))
    yield "round energies", lambda: energies(cm.energy_balance(RUBBING, NOISE, engine="modal"))
    yield "periodic response", lambda: points(periodic.follow_response(model, 6.0, (40.0, 49.0), 7))
    yield "periodic level", lambda: points(periodic.follow_response_over_level(model, 45.0, (1.0, 6.0), 7))
    yield "periodic round", lambda: points(periodic.follow_response(turning, 2.0, (8.0, 11.0), **PERIODIC))
    yield "periodic unbalance", lambda: points(periodic.follow_unbalance(cm.Model(RUBBING), (14.0, 15.0), **PERIODIC))
    for name, one in {"slot": model, "round": turning}.items():
        yield f"periodic map {name}", lambda one=one: rattling(one)
    yield "bench plane", virtual_bench
    yield "bench space", virtual_bench_in_space
    yield "study plane", lambda: study("data/table1_rig", "constant")
    yield "study space", lambda: study("data/turning_rig", "bench")


def compute(only):
    """Arrays by name, with seconds of the first and of a second call."""
    results = {}
    for name, call in parts():
        if only and not name.startswith(tuple(only)):
            continue
        seconds = []
        for _ in range(1 if name.startswith("study") else 2):
            began = time.perf_counter()
            arrays = call()
            seconds.append(time.perf_counter() - began)
        results |= {f"{name}: {key}": np.asarray(value) for key, value in arrays.items()}
        results[f"seconds {name}"] = np.array(seconds)
        print(f"{name}: {len(arrays)} arrays, {', '.join(f'{s:.2f}' for s in seconds)} s", flush=True)
    return results


def differences(old, new):
    """Yield names of arrays, how far each is from what it was, and how far it may be; nan where shapes differ."""
    for name in old.keys() & new.keys():
        kind = name.split()[0]
        if kind != "seconds":
            a, b = old[name], new[name]
            largest = np.nanmax(np.abs(a), initial=0.0) or 1.0
            same = a.shape == b.shape and np.array_equal(np.isnan(a), np.isnan(b))
            yield name, float(np.nanmax(np.abs(a - b), initial=0.0) / largest) if same else np.nan, WITHIN[kind]


def main():
    parser = argparse.ArgumentParser(prog="python -m benchmarks.baseline", description=__doc__)
    parser.add_argument("out", type=Path, help="file (NPZ) of what is computed now")
    parser.add_argument("--against", type=Path, help="older file, which it is held to")
    parser.add_argument("--only", nargs="+", help="names of parts, or how they begin (default: all)")
    given = parser.parse_args()
    new = compute(given.only)
    with replacing(given.out) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **new)
    if not given.against:
        return 0
    with np.load(given.against) as file:
        old = dict(file)
    off = [each for each in sorted(differences(old, new)) if not each[1] <= each[2]]
    for name, far, most in off:
        print(f"{name}: off by {far:.1e} of its largest value, allowed {most:.0e}")
    for name in sorted(name for name in new if name.startswith("seconds") and name in old):
        print(
            f"{name}: first {old[name][0]:.2f} -> {new[name][0]:.2f}, then {old[name][-1]:.2f} -> {new[name][-1]:.2f}"
        )
    gone = [name for name in old.keys() - new.keys() if not given.only]
    print(f"{len(off)} of {len(new)} arrays are off, {len(gone)} are gone: {', '.join(sorted(gone)[:5])}")
    return int(bool(off or gone))


if __name__ == "__main__":
    sys.exit(main())
