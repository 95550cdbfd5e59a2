"""The bench: a rig with its hidden truth, shaken."""

from __future__ import annotations

import dataclasses

import numpy as np

from .. import sampling
from .._version import __version__
from ..errors import ExcitationError, SimulationError
from ..response import Response
from . import integrator
from .fem import FiniteElements

__all__ = ["FACTOR", "simulate_rig"]

FACTOR = 32
"""Time steps per sample: 65 536 steps per second at 2048 Hz"""
BLOCK = 1024
"""Samples between two filterings: memory does not grow with the record. The grease drifts from block to block."""
DRIFT_STREAM = 1
"""Second word of the drift's seed, so that no other generator of the same seed draws the same numbers"""


def simulate_rig(rig, truth, excitation, seed: int) -> Response:
    """Shake the virtual rig.

    Parameters
    ----------
    rig : Rig
        Shaft, masses, sensors, gaps and bushings' places. Its grease and contact values are not used.
    truth : Truth
        Grease and contact as they really are.
    excitation : Excitation
        Base acceleration, or force at the rig's shaker.
    seed : int
        Of the grease's drift.

    Returns
    -------
    Response
        Every field, without sensor noise; ``provenance["contact_fraction"]`` is the share of time in which each
        bushing touches with at least one end.

    Raises
    ------
    ExcitationError
        If a force is given but the rig has no place for it.
    SimulationError
        If the implicit step does not converge; the message names rig and time.
    """
    elements = FiniteElements.of_shaft(rig.beam, rig.point_masses)
    load = _load(rig, elements, excitation.kind)
    ends = [x for b in rig.bushings for x in b.ends]
    points = elements.points([*ends, *(b.position for b in rig.bushings)])
    scheme = integrator.scheme(elements, load, points, 1 / (excitation.fs * FACTOR))
    motion = integrator.at_rest(elements, load, points, len(rig.bushings))
    outputs, touching = _march(rig, truth, scheme, motion, elements, excitation, seed)
    bushings, sensors = len(rig.bushings), len(rig.sensors)
    acceleration, rest = outputs[:, :sensors], outputs[:, sensors:]
    displacement, contact, grease = np.split(rest, [bushings, 2 * bushings], axis=1)
    return Response(
        fs=excitation.fs,
        excitation=excitation.value,
        acceleration=acceleration,
        displacement=displacement,
        contact_force=contact,
        grease_force=grease,
        kind=excitation.kind,
        band=excitation.band,
        responses=tuple(rig.sensor_labels),
        reference="100:+Z" if excitation.kind == "base" else "200:+Z",
        provenance={
            "source": "synthetic: virtual test rig",
            "rig": rig.to_dict(),
            "truth": dataclasses.asdict(truth),
            "excitation": dict(excitation.description),
            "seed": seed,
            "version": __version__,
            "contact_fraction": (touching / (excitation.value.size * FACTOR)).tolist(),
        },
    )


def _load(rig, elements, kind):
    if kind == "base":
        return -elements.inertia
    if rig.shaker.position is None:
        raise ExcitationError(f'rig "{rig.name}" has no shaker.position: a force needs one')
    return elements.points([rig.shaker.position]).dense(elements.count)[0]


def _march(rig, truth, scheme, motion, elements, excitation, seed):
    """Run the integrator block by block; return the filtered outputs and the counts of touching steps."""
    bushings, n = len(rig.bushings), excitation.value.size
    contacts = _contacts(rig, truth)
    starts = np.arange(0, n, BLOCK)
    stiffness = truth.grease_stiffness * _drift(truth, bushings, starts / excitation.fs, seed)
    sensors = elements.points([s.position for s in rig.sensors])
    follows = 1.0 if excitation.kind == "base" else 0.0
    fast = sampling.interpolate(excitation.value, FACTOR)
    decimator = sampling.Decimator(sensors.start.size + 3 * bushings, FACTOR)
    touching, slow = np.zeros(bushings, dtype=np.int64), []
    for first, k in zip(starts, stiffness):
        block = fast[first * FACTOR : (first + BLOCK) * FACTOR]
        out = np.zeros((block.size, sensors.start.size + 3 * bushings))
        greases = _greases(truth, k)
        done = integrator.march(
            scheme, motion, contacts, greases, block, follows, sensors.start, sensors.weight, out, touching
        )
        if done < block.size or not np.all(np.isfinite(out[-1])):
            time = first / excitation.fs + done * scheme.step
            raise SimulationError(f'rig "{rig.name}": the bushings\' forces did not converge at {time:.6f} s')
        slow.append(decimator.push(out))
    slow.append(decimator.flush())
    return np.concatenate(slow)[:n], touching


def _contacts(rig, truth):
    gaps = np.array([b.gap for b in rig.bushings for _ in b.ends])
    half = np.full(gaps.size, truth.contact_stiffness / 2)
    return integrator.Contacts(gaps, half, float(truth.contact_exponent), float(truth.contact_dissipation))


def _greases(truth, stiffness):
    return integrator.Greases(
        stiffness,
        float(truth.elastic_ratio),
        float(truth.amplitude),
        float(truth.beta),
        float(truth.gamma),
        int(truth.exponent),
        float(truth.film_damping),
        np.full(stiffness.size, truth.film_height),
        float(truth.film_limit),
    )


def _drift(truth, bushings, time, seed):
    """Grease stiffness over its nominal value, shape (len(time), bushings): straight lines between random values."""
    knots = int(time[-1] / truth.drift_interval) + 2
    values = np.random.default_rng((seed, DRIFT_STREAM)).uniform(-truth.drift, truth.drift, (bushings, knots))
    return 1 + np.array([np.interp(time, truth.drift_interval * np.arange(knots), row) for row in values]).T
