"""A rig in space that nothing touches, and records of it that are simulated: what a study must find is known."""

import dataclasses
import itertools

import numpy as np

import clearance_mj as cm
from clearance_mj import Channel, Dataset, Record, simulate
from clearance_mj.rig import Bushing, Contact, Grease, Rig, Sensor, Shaker, Spin, Unbalance
from clearance_mj.structure import Disc, Material, Section, Shaft, Support

FS = 1024.0
AXES = {"y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
RUN_OUT = 8e-6  # m
SHAFT = Shaft(
    (Section(0.7, diameter=(0.03, 0.03)),), (Support(0.0, "pinned"), Support(0.7, "pinned")),
    material=Material(2.1e11, 7850.0), discs=(Disc(0.45, 4.0, 0.008, polar_inertia=0.014),), rayleigh=(60.0, 2e-6),
)  # fmt: skip
RIG = Rig(
    "turning", None, (Bushing(0.56, 5e-3, length=0.02, contact=Contact(1e5), grease=Grease(0.0), shape="round"),),
    tuple(Sensor(i, x, direction=axis) for i, x in ((1, 0.15), (2, 0.45)) for axis in AXES.values()),
    structure=SHAFT, shaker=Shaker("base"), spin=Spin(60.0), unbalances=(Unbalance(0.45, 1e-4),),
)  # fmt: skip


def keyphasor(angle):
    """One raised cosine of 60 degrees per turn, which rises through its half at angle 0."""
    turns = (angle / (2 * np.pi) + 1 / 24) % 1.0
    return np.where(turns < 1 / 6, 0.5 - 0.5 * np.cos(12 * np.pi * turns), 0.0)


def turning_record(name, role, spin, axis=None, level=None, seed=0, duration=6.0, run_out=RUN_OUT):
    """A record along an axis, or of turning alone where there is none, of probes with a run-out once per turn."""
    time = np.arange(round(duration * FS)) / FS
    noise = cm.excitation.random(duration, FS, band=(5, 220), rms=level or 1.0, seed=seed)
    excitation = noise if axis else dataclasses.replace(noise, value=np.zeros(time.size))
    shaker = Shaker("base", direction=AXES[axis or "z"])
    response = simulate(RIG.replace(shaker=shaker, spin=spin), excitation, engine="modal")
    angle = spin.angle_at(time)
    probes = response.displacement + run_out * np.array([np.cos(angle), np.sin(angle)])
    signals = [("100", f"+{axis.upper()}", "acceleration", excitation.value)] if axis else []
    signals += [(*label.split(":"), "acceleration", a) for label, a in zip(RIG.sensor_labels, response.acceleration)]
    signals += [(*label.split(":"), "displacement", x) for label, x in zip(RIG.probe_labels, probes)]
    signals.append(("400", "S", "unknown", keyphasor(angle)))
    channels = [
        Channel(f"{node}{way}{what}", int(node), way, what, value, FS, unit="V" if what == "unknown" else "")
        for node, way, what, value in signals
    ]
    band = (5.0, 220.0) if axis else None
    return Record(
        name, role, RIG, FS, channels, "base" if axis else "spin", "", level if axis else None, None, band,
        {"origin": "synthetic: modal engine"}, AXES[axis] if axis else None, spin,
    )  # fmt: skip


def turning_dataset():
    """Two records along y and two along z at 60 rad/s, two of turning at each of two speeds, and one that rolls."""
    records = [turning_record("slow_roll", "identify", Spin(5.0), duration=4.0)]
    for axis, (seed, letter) in itertools.product("yz", enumerate("ab")):
        records.append(turning_record(f"{axis}_{letter}", "validate", Spin(60.0), axis, 2.0, seed + ord(axis)))
    for letter, speed in itertools.product("ab", (100.0, 60.0)):
        records.append(turning_record(f"orbit_{speed:g}_{letter}", "validate", Spin(speed), duration=3.0))
    return Dataset(RIG, tuple(records))
