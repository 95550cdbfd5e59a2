"""Growth of cost: per step with links, bushings and modes; in all with links, batch, threads and duration."""

import dataclasses
import os
from functools import partial

import numpy as np
from tqdm import tqdm

import clearance_mj as cm
from clearance_mj.engines.base import get_engine, step_factor

from .case import FS, LAW, RIG, error, excitation, timed

SHORT = 1.0  # s, simulated where cost per second is asked for
ENGINES = ("links", "modal")


def measure():
    """Return series: values, seconds, and the exponent of the straight line through their logarithms."""
    series = [*_links(), *_bushings(), *_modes(), *_batch(), *_duration(), *_threads()]
    rows = []
    for name, unit, values, cost in tqdm(series, desc="scaling", unit="series"):
        seconds = [cost(value) for value in values]
        rows.append({"name": name, "unit": unit, "values": values, "seconds": seconds})
        rows[-1]["exponent"] = float(np.polyfit(np.log(values), np.log(seconds), 1)[0])
    return {"series": rows, "steps": _steps()}


def _links():
    counts = [8, 10, 14, 20, 28, 40]
    yield "links: a step", "links", counts, lambda n: _per_step(RIG, LAW, cm.Links(n))
    yield "links: a simulated second", "links", counts, lambda n: _per_second(RIG, LAW, cm.Links(n))


def _bushings():
    for engine in ENGINES:
        yield f"{engine}: a step", "bushings", [1, 2, 4, 8], lambda n, e=engine: _per_step(*_with_bushings(n), e)


def _modes():
    yield "modal: a step", "modes", [4, 6, 8, 12, 16, 24], lambda n: _per_step(RIG, LAW, cm.Modal(n))


def _batch():
    drive = excitation(SHORT)
    for engine in ENGINES:
        name, counts = f"{engine}: a batch", [4, 8, 16, 32, 64]
        yield name, "simulations", counts, lambda n, e=engine: _batch_time(drive, n, e, None)


def _duration():
    for engine in ENGINES:
        yield f"{engine}: a record", "seconds", [1, 2, 4, 8, 16], lambda s, e=engine: _time(RIG, LAW, e, s)


def _threads():
    drive, counts = excitation(SHORT), [2**i for i in range((os.cpu_count() or 1).bit_length())]
    for engine in ENGINES if len(counts) > 1 else ():
        yield f"{engine}: a batch of 16", "threads", counts, lambda n, e=engine: _batch_time(drive, 16, e, n)


def _steps():
    """Error and cost against the time step, for engines whose step can be chosen."""
    settings = {
        "links, 16": [cm.Links(16, safety=s) for s in (0.95, 0.8, 0.4, 0.2, 0.1)],
        "modal, 8 modes": [cm.Modal(8, resolution=r) for r in (2.5, 1.0, 0.5, 0.25, 0.1)],
    }
    drive, rows = excitation(), []
    for name, engines in settings.items():
        for engine in engines:
            seconds, response = timed(partial(cm.simulate, RIG, drive, LAW, engine))
            step = response.provenance["step"]
            rows.append({"name": name, "step": step, "cost": seconds / response.duration, "error": error(response)})
    return rows


def _time(rig, law, engine, seconds):
    drive = excitation(float(seconds))
    return timed(lambda: cm.simulate(rig, drive, law, engine), repeats=5)[0]


def _per_second(rig, law, engine):
    return _time(rig, law, engine, SHORT) / SHORT


def _per_step(rig, law, engine):
    steps = step_factor(FS, get_engine(engine).largest_step(rig, law)) * FS
    return _per_second(rig, law, engine) / steps


def _batch_time(drive, n, engine, workers):
    return timed(lambda: cm.simulate_batch(RIG, [drive] * n, LAW, engine, workers))[0]


def _with_bushings(n):
    """The rig with n bushings from 0.4 m to 0.9 m that share the stiffness of two."""
    _, bushing = RIG.bushings
    of_one = {"stiffness": bushing.grease.stiffness * 2 / n, "damping": bushing.grease.damping * 2 / n}
    bushing = dataclasses.replace(bushing, grease=dataclasses.replace(bushing.grease, **of_one))
    positions = np.linspace(0.4, 0.9, n).tolist() if n > 1 else [0.7918]
    rig = RIG.replace(bushings=tuple(dataclasses.replace(bushing, position=x) for x in positions))
    return rig, cm.ConstantLaw(np.full(n, LAW.k[0] * 2 / n), np.full(n, LAW.c[0] * 2 / n))
