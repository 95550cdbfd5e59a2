"""Rows of docs/capabilities.md on identification: records are those of the engine `modal`, of rigs that no file knows.

Gaps are an eighth wider than the rig file says, contacts a third stiffer. What the method finds is held to the walls of
the rig that was simulated: where they are from the shaft's rest, which is all that records show of a stop.
"""

import dataclasses
import functools

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.engines import static_equilibrium
from clearance_mj.identify.laws.case import OFFSETS
from clearance_mj.identify.laws.rest import rests_of
from clearance_mj.io.channels import Channel
from clearance_mj.io.dataset import Dataset, Record
from clearance_mj.io.formats import to_channels
from clearance_mj.rig import KEYPHASOR_NODE, Sensor
from clearance_mj.structure.base import is_rotation

FS, SECONDS = 2048.0, 10.0
WIDER, STIFFER = 1.12, 1.3
LEVELS = 6.0, 15.0  # N RMS, of teeth N m over 30


def measured(rig):
    """The rig with enough sensors to tell its structure from the forces in its clearances, without further inputs."""
    kept = tuple(b for b in rig.bushings if not is_rotation(b.position) or len(rig.bushings) == 1)
    if is_rotation(kept[0].position):
        sensors = [Sensor(i, f"@{x}:RX", quantity="angular velocity") for i, x in enumerate((0.3, 0.6, 0.8), 1)]
        return rig.replace(sensors=tuple(sensors))
    places, across = (0.15, 0.35, 0.55, 0.8), [(0.0, 0.0, 1.0)]
    if rig.moves_across:
        across.append((0.0, 1.0, 0.0))
    sensors = [Sensor(10 * j + i, x, direction=axis) for j, axis in enumerate(across) for i, x in enumerate(places, 1)]
    loads = rig.loads if len(kept) == len(rig.bushings) else ()
    return rig.replace(sensors=tuple(sensors), bushings=kept, shakers=(), loads=loads)


def recorded(rig):
    """Rig file and records at two levels, with noise of half a percent, and the rig that was simulated."""
    rig = measured(rig)
    wider = [dataclasses.replace(b, gap=WIDER * b.gap, contact=dataclasses.replace(
        b.contact, stiffness=STIFFER * b.contact.stiffness)) for b in rig.bushings]  # fmt: skip
    true, records = rig.replace(bushings=tuple(wider)), []
    of_torque = 30.0 if is_rotation(rig.bushings[0].position) else 1.0
    for seed, level in enumerate(LEVELS, 1):
        push = cm.excitation.random(SECONDS, FS, band=(10, 150), rms=level / of_torque, seed=seed, kind="force")
        response = cm.simulate(true, push, engine="modal")
        if true.is_loaded and (true.gravity or true.loads):  # probes read zero where the shaft rests
            rest = static_equilibrium(true).displacement
            response = dataclasses.replace(response, displacement=response.displacement - rest[:, None])
        rng = np.random.default_rng(seed)
        noisy = [x + 5e-3 * x.std(axis=1, keepdims=True) * rng.standard_normal(x.shape)
                 for x in (response.channels, response.displacement)]  # fmt: skip
        response = dataclasses.replace(response, channels=noisy[0], displacement=noisy[1])
        channels = to_channels(response, rig)
        if rig.spin:
            angle = rig.spin.angle_at(response.time)
            channels.append(Channel("keyphasor", KEYPHASOR_NODE, "S", "unknown", (angle % (2 * np.pi) < 0.3) * 1.0, FS))
        records.append(Record(f"level_{level:g}", "identify", rig, FS, channels, "force", band=(10.0, 150.0)))
    return Dataset(rig, records), true


@functools.cache
def fit_of_bench(rig):
    dataset, true = recorded(rig)
    return cm.identify.identify(dataset, "bench"), true


def identified(rig):
    fit, true = fit_of_bench(rig)
    value, std = (dict(zip(fit.estimates.names, of)) for of in (fit.estimates.value, fit.estimates.std))
    for j, (b, rest, of_one) in enumerate(zip(true.bushings, rests_of(true), fit.families)):
        case = of_one[0].fit.case
        if b.is_round:
            assert case.bushing.gap == pytest.approx(b.gap, rel=0.03)
        else:
            walls = [wall + b.offset - rest[0] for wall in b.walls]
            shown = [wall + case.bushing.offset - case.middle[0] for wall in case.bushing.walls]
            np.testing.assert_allclose(shown, walls, rtol=0, atol=0.03 * b.gap)
        for name in OFFSETS[-b.n_coordinates :]:
            offset = f"bushings[{j}].{name}"
            assert abs(value[offset] - getattr(b, name)) < 3 * std[offset]


ROWS = {"identification, method `bench`": (identified, "walls of the simulated rig, 3 % of the gap")}
SLOW = tuple(ROWS)
