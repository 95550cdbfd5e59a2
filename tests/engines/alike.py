"""Responses side by side: histories as shares of the largest value of each, and rigs whose bushings are all alike."""

import dataclasses

import numpy as np

from clearance_mj.clearance import ContactLaw, HuntCrossley1975, MaxwellSlip
from clearance_mj.engines import get_engine

GREASED = ContactLaw(HuntCrossley1975(2e6, 4e5), MaxwellSlip((2000.0, 900.0), (0.3, 0.5), 500.0, 2.0, 4e-4))
HISTORIES = ("acceleration", "displacement", "contact_force", "grease_force")


def assert_alike(value, expected, limit, names=HISTORIES):
    """Each history differs by less than a share of its largest expected value."""
    for name in names:
        known = getattr(expected, name)
        np.testing.assert_allclose(getattr(value, name), known, rtol=0, atol=limit * np.abs(known).max(), err_msg=name)


def with_bushings(rig, **fields):
    return rig.replace(bushings=tuple(dataclasses.replace(b, **fields) for b in rig.bushings))


def at_every_step(rig, engine, law, level=8.0, duration=0.3, cuts=1):
    """Time, displacement, contact and grease forces (n, n_bushings) at every step, and the step, under two tones."""
    engine = get_engine(engine)
    step = engine.largest_step(rig, law)
    time = np.arange(round(duration / step)) * step
    drive = level * (np.sin(2 * np.pi * 9 * time) + np.sin(2 * np.pi * 37 * time))
    run = engine.start(rig, law, "base", step)
    output = np.concatenate([run.advance(part) for part in np.array_split(drive, cuts)])
    return time, *np.split(output[:, len(rig.sensors) :], 4, axis=1)[:3], step
