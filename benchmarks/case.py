"""Cases that the benchmarks simulate, and how times and errors are taken.

The shipped rig with datasheet contact (Kelvin-Voigt) and linear grease. Three things are changed. The first gap is a
third as wide, so that the shaft meets both bushings at a level at which its motion can still be followed: with harder
or longer shaking it is chaotic and two exact methods part. The bushings are 1 mm long, which one contact in their
middle stands for. There is no mass-proportional damping, which a chain of finite elements has no place for.
"""

import dataclasses
import functools
import statistics
import time

import numpy as np

import clearance_mj as cm
from clearance_mj.clearance import ContactLaw, KelvinVoigt

SHIPPED = cm.Rig.load("models/table1_rig.toml")
_first, _second = SHIPPED.bushings
RIG = SHIPPED.replace(
    name="benchmark",
    beam=dataclasses.replace(SHIPPED.beam, rayleigh=(0.0, SHIPPED.beam.rayleigh[1])),
    bushings=(dataclasses.replace(_first, gap=1e-4, length=1e-3), dataclasses.replace(_second, length=1e-3)),
)
LAW = cm.ConstantLaw([b.contact.stiffness for b in RIG.bushings], [b.contact.damping for b in RIG.bushings])
PULLING = ContactLaw(tuple(KelvinVoigt(k, c, adhesion=True) for k, c in zip(LAW.k, LAW.c)))
"""as LAW, but the damper pulls when the shaft leaves: what Exudyn's limit stops do"""
FS, BAND, RMS, SECONDS = 2048.0, (5.0, 220.0), 2.0, 4.0
REFERENCE = cm.Modal(16, resolution=0.1)
PATIENCE = 6.0  # s, after which a run is not repeated


def excitation(seconds=SECONDS):
    """Random base acceleration."""
    return cm.excitation.random(seconds, FS, band=BAND, rms=RMS, seed=1, kind="base")


@functools.cache
def reference(law):
    """FRF of the converged solution."""
    return frf(cm.simulate(RIG, excitation(), law, REFERENCE))


def frf(response):
    return cm.estimate_frf(response, resolution=1.0, band=BAND)


def error(response, law=LAW) -> float:
    """RMSE of the FRFs against the converged ones, dB, mean of the sensors, 5-220 Hz."""
    return float(np.mean(cm.rmse_db(reference(law).value, frf(response).value)))


def timed(call, repeats=3):
    """Shortest time of several runs, s (other work of the machine only ever adds), and what the call returned."""
    times = []
    while len(times) < repeats and sum(times) < PATIENCE:
        start = time.perf_counter()
        result = call()
        times.append(time.perf_counter() - start)
    return min(times), result


def row(name, values, unit, target):
    """Median and range of repeated measurements, for a table."""
    ends = {"median": statistics.median(values), "low": min(values), "high": max(values)}
    return {"name": name, "unit": unit, "target": target} | ends
