"""Rigs and laws that a file may hold and no workshop can build: each is computed, or refused in words."""

import contextlib
import copy
import json
import math
from pathlib import Path

import numpy as np

from clearance_mj import ClearanceError, Rig, simulate
from clearance_mj.beam import natural_frequencies
from clearance_mj.clearance import nominal_law
from clearance_mj.clearance.law_files import law_from_dict
from clearance_mj.placement import candidates, grid, place_sensors
from clearance_mj.signals.excitation import random
from tests.structures import chain, stepped, two_shafts

from . import samples

SIZES = (5e-324, 1e-300, 1e-150, 1e-30, 1e-12, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e12, 1e30, 1e150, 1e300, 1.7e308, 0.0, -1.0)
FACTORS = (1e-9, 1e-6, 1e-3, 0.1, 0.5, 0.999999, 1.000001, 2.0, 10.0, 1e3, 1e6, 1e9)
COUNTS = (0, 1, 2, 3, 40, 10**6, 2**31, 10**18)
DURATION, RATE = 0.05, 1024.0


def frequencies(rig, law):
    """Those of five modes."""
    assert np.isfinite(natural_frequencies(rig, 5)).all()


def placed(rig, law):
    """Two sensors for two modes."""
    place_sensors(candidates(rig, grid(rig, 8).tolist(), [1, 2], 1.0, 1.0, []), 2)


def simulated(engine):
    """A short simulation on an engine."""

    def run(rig, law):
        kind = rig.shaker.kind
        response = simulate(rig, random(DURATION, RATE, (5.0, 220.0), 1.0, 1, kind), law or nominal_law(rig), engine)
        assert np.isfinite(response.acceleration).all()

    return run


USES = {"frequencies": frequencies, "modal": simulated("modal"), "links": simulated("links"), "placed": placed}
"""What is done with a rig and a law"""


def make(rng) -> bytes:
    """A rig, perhaps a law, and what is done with them, as JSON."""
    rigs = [samples.RIG, samples.RIG, samples.RIG, stepped(), two_shafts(), chain()]
    rig = json.loads(json.dumps(rng.choice(rigs).to_dict()))
    law = copy.deepcopy(rng.choice([None, *(law.to_dict() for law in samples.LAWS)]))
    for _ in range(rng.choice((1, 1, 2, 3, 5))):
        _change(rng, law if law and rng.random() < 0.4 else rig)
    return json.dumps({"use": rng.choice([*USES]), "rig": rig, "law": law}).encode()


def prepare(inputs) -> None:
    """Compile what is used."""
    for rig in (samples.RIG, stepped(), two_shafts(), chain()):
        for use in USES.values():
            with contextlib.suppress(ClearanceError):
                use(rig, None)


def run(path: Path, rng) -> None:
    """Do it; an error is said to be of the file."""
    case = json.loads(path.read_bytes())
    try:
        rig = Rig.from_dict(case["rig"], path.parent)
        USES[case["use"]](rig, law_from_dict(case["law"]) if case["law"] else None)
    except ClearanceError as error:
        raise ClearanceError(f"{path}: {error}") from None


def _change(rng, data) -> None:
    """Replace a number anywhere within."""
    holder, key = rng.choice([*_numbers(data)])
    old = holder[key]
    if isinstance(old, int):
        holder[key] = rng.choice(COUNTS)
    elif rng.random() < 0.5 and math.isfinite(new := old * rng.choice(FACTORS)):
        holder[key] = new
    else:
        holder[key] = rng.choice(SIZES)


def _numbers(data):
    for key, value in data.items() if isinstance(data, dict) else enumerate(data):
        if isinstance(value, dict | list):
            yield from _numbers(value)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield data, key
